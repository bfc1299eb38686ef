"""Files of labelled data: netCDF-3 without further packages, netCDF-4 and Zarr if their packages are installed.

A file is written completely or not at all.  A digest in the file reveals damage: of the bytes for netCDF-3, of the
contents for the other formats.  A file is written at once, or row by row with few rows in memory.  Only in netCDF-3 do
rows have fixed offsets.  The other formats compress whole chunks, so such a file is copied chunk by chunk from a
temporary netCDF-3 file.
"""

from __future__ import annotations

import errno
import hashlib
import os
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from importlib import import_module
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeAlias

import numpy as np
import xarray as xr

from synchain.models.inputs.checks import check_flag, check_path
from synchain.models.inputs.keywords import warn
from synchain.models.inputs.regular_file import open_regular

from ..support.files import check_replaceable, synced, whole_file, whole_folder
from ..support.netcdf import DIGEST, Sheet, is_sealed, seal, unsealed

# The values of the dimension `part`, by which complex numbers are stored as pairs of real ones.
PARTS = ("real", "imaginary")
# System errors for a full disk, an exhausted quota and a too large file.
NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
CHUNK = 2**15  # numbers of a chunk (256 kB of doubles); one chunk is in memory at a time
# Function that writes a dataset to a path: variables with one of the dimensions chunk by chunk, others at once.
Copy: TypeAlias = "Callable[[xr.Dataset, Path, Collection[str]], None]"


@dataclass(frozen=True, slots=True)
class Form:
    """Functions that write and read one format of files."""

    package: str | None  # package needed besides the dependencies of synchain
    check: Callable[[Path], None]  # raise OSError if a path exists and cannot be replaced
    whole: Callable[[Path], AbstractContextManager[Path]]  # yield a temporary path, then move it to the path
    write: Callable[[xr.Dataset, Path], None]  # write a dataset to a path, without its digest
    # open a new file for writing by rows: variables and attributes of a template, some dimensions with other lengths
    rows: Callable[[xr.Dataset, Mapping[str, int], Path], AbstractContextManager[Sheet]]
    seal: Callable[[Path], None]  # write the digest of a file into it
    open: Callable[[Path], xr.Dataset]  # verify the digest and return the dataset, which is read lazily


def form_of(path: str | os.PathLike[str]) -> Form:
    """Return the format for the ending of a path; raise ModuleNotFoundError if its package is missing."""
    ending = check_path("path", path).suffix.lower()
    if ending not in FORMS:
        raise ValueError(f"path: found {os.fspath(path)!r}; expected a name that ends in {' or '.join(FORMS)}")
    if (package := FORMS[ending].package) is not None:
        try:
            import_module(package)
        except ModuleNotFoundError:
            raise ModuleNotFoundError(
                f"{os.fspath(path)}: the ending {ending} needs the package {package}; install it: python -m pip "
                'install "synchain[files]", or end the name in .nc',
                name=package,
            ) from None
    return FORMS[ending]


def write_data(data: xr.Dataset, path: str | os.PathLike[str], overwrite: bool = False) -> None:
    """Write a dataset; the ending of the path chooses the form (see `Labelled.save`)."""
    form_of(path).check(Path(path))
    if not check_flag("overwrite", overwrite) and Path(path).exists():
        raise FileExistsError(
            f"{os.fspath(path)} is there already; give overwrite=True to replace it, or choose another path"
        )
    try:
        with _new(path) as (form, temporary):
            form.write(_without_complex(data), temporary)
    except OSError as problem:
        if problem.errno not in NO_ROOM:
            raise
        raise OSError(
            problem.errno,
            f"cannot write: {problem.strerror}; free space there, or choose another path",
            os.fspath(path),
        ) from problem


@contextmanager
def filled(path: str | os.PathLike[str], template: xr.Dataset, lengths: Mapping[str, int]) -> Iterator[Sheet]:
    """Yield the empty variables of a new file, which is moved to its path at the end of the with block."""
    with _new(path) as (form, temporary), form.rows(_without_complex(template), lengths, temporary) as rows:
        yield rows


@contextmanager
def _new(path: str | os.PathLike[str]) -> Iterator[tuple[Form, Path]]:
    """Yield the format of a path and a temporary path; then write the digest, flush the file and move it."""
    form, target = form_of(path), Path(path)
    form.check(target)
    with form.whole(target) as temporary:
        yield form, temporary
        form.seal(temporary)
        synced(temporary)


@contextmanager
def opened(path: Path) -> Iterator[xr.Dataset]:
    """Yield the open dataset of a file, which is read lazily."""
    if not path.exists():
        raise FileNotFoundError(f"{path} does not exist; expected a result: check the path")
    form = form_of(path) if path.suffix.lower() in FORMS else FORMS[".nc"]
    with form.open(path) as data:
        yield data


def read_data(path: Path) -> xr.Dataset:
    """Return the dataset of a file in memory, without its digest; raises as `opened`."""
    with opened(path) as file, _readable(path):
        data = file.load().drop_encoding()  # so that a later file can choose another encoding
    data.attrs = attributes_of(data.attrs, path)
    # Join the pairs of `_without_complex` to complex numbers.
    joined = {
        name: (values.dims[:-1], values.values[..., 0] + 1j * values.values[..., 1], values.attrs)
        for name, values in data.data_vars.items()
        if "part" in values.dims
    }
    return data.assign(joined).drop_vars("part") if joined else data


def attributes_of(attributes: dict[str, object], path: Path) -> dict[str, object]:
    """Return the attributes of a file without its digest; warn if there is none."""
    if "scene" in attributes and DIGEST not in attributes:
        warn(f"{path} has no digest, so damage of its numbers cannot be seen; open it and save it with Result.save")
    return {str(name): value for name, value in attributes.items() if name != DIGEST}


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    """Turn any error of a package that reads a damaged file into an OSError of one line."""
    try:
        yield
    except Exception as problem:
        reason = " ".join(str(problem).split()) or type(problem).__name__
        if not isinstance(problem, OSError):  # the message of a package does not describe the file
            reason = "it ends before its data do, or they do not fit its head; restore it from a copy"
        raise OSError(f"cannot read {path}, the file is damaged: {reason}") from problem


def _damaged(path: Path, part: str) -> OSError:
    return OSError(
        f"{path} is damaged, its {part} do not fit their digest; restore it from a copy, or run again with overwrite "
        "(--overwrite)"
    )


# -- netCDF-3 ------------------------------------------------------------------------------------------------


def _write_netcdf3(data: xr.Dataset, path: Path) -> None:
    unsealed(data).to_netcdf(path, engine="scipy", format="NETCDF3_64BIT")


@contextmanager
def _rows_of_netcdf3(template: xr.Dataset, lengths: Mapping[str, int], path: Path) -> Iterator[Sheet]:
    with open(path, "wb") as file:
        yield Sheet(file, unsealed(template), lengths)


def _seal_netcdf3(path: Path) -> None:
    with open(path, "r+b") as file:
        seal(file)


def _open_netcdf3(path: Path) -> xr.Dataset:
    with open_regular(path) as file:
        start = file.read(4)
        if start[:3] != b"CDF":
            kind = "an HDF5 or netCDF4 file" if start == b"\x89HDF" else "no netCDF file"
            raise OSError(f"{path} is {kind}; expected a netCDF 3 result, as Result.save and stream write it")
        sealed = is_sealed(file)
    if sealed is False:  # verify the digest before using the header
        raise _damaged(path, "bytes")
    with _readable(path):
        data = xr.open_dataset(path, engine="scipy")
    if sealed is None and DIGEST in data.attrs:
        data.close()
        raise _damaged(path, "bytes")
    return data


# -- netCDF-4 ------------------------------------------------------------------------------------------------


def _write_netcdf4(data: xr.Dataset, path: Path) -> None:
    data.to_netcdf(path, engine="h5netcdf")


def _copy_to_netcdf4(data: xr.Dataset, path: Path, long: Collection[str]) -> None:
    import h5netcdf

    with TemporaryDirectory(dir=path.parent, prefix=path.stem, suffix=path.suffix) as folder:
        first = Path(folder, "first.nc4")
        _write_netcdf4(_first(data, long), first)
        with h5netcdf.File(first, "r") as source, h5netcdf.File(path, "w") as file:
            file.dimensions = {name: data.sizes.get(name, part.size) for name, part in source.dimensions.items()}
            file.attrs.update(source.attrs)
            for name, variable in source.variables.items():
                attributes = dict(variable.attrs)
                fill = attributes.pop("_FillValue", None)
                copy = file.create_variable(name, variable.dimensions, variable.dtype, fillvalue=fill)
                copy.attrs.update(attributes)
                if not set(variable.dimensions) & set(long):
                    copy[...] = variable[...]
            copy_in_pieces(data, long, file.variables)


def _seal_netcdf4(path: Path) -> None:
    import h5netcdf

    digest = _digest_of(path, "h5netcdf")
    with h5netcdf.File(path, "r+") as file:
        file.attrs[DIGEST] = digest


def _open_netcdf4(path: Path) -> xr.Dataset:
    import h5py

    open_regular(path).close()
    # Read this attribute before h5netcdf does: there a damaged attribute leaves an open file and a traceback on stderr.
    with _readable(path), h5py.File(path, "r") as file:
        file.attrs.get("_nc3_strict")
    return _intact(path, "h5netcdf")


# -- Zarr ----------------------------------------------------------------------------------------------------


def _check_zarr(target: Path) -> None:
    if target.exists() and not (target / ".zgroup").is_file():
        raise FileExistsError(f"{target} is no Zarr folder; expected one or nothing there; choose another path")


def _write_zarr(data: xr.Dataset, path: Path, encoding: Mapping[str, Any] | None = None) -> None:
    data.to_zarr(path, mode="w", zarr_format=2, consolidated=False, encoding=encoding)


def _copy_to_zarr(data: xr.Dataset, path: Path, long: Collection[str]) -> None:
    import zarr

    _write_zarr(_first(data, long), path, {name: {"chunks": chunk(data[name].shape)} for name in _with(data, long)})
    arrays = dict(zarr.open_group(path, mode="r+").arrays())
    for name in _with(data, long):
        arrays[name].resize(data[name].shape)
    copy_in_pieces(data, long, arrays)


def _seal_zarr(path: Path) -> None:
    import zarr

    zarr.open_group(path, mode="r+").attrs[DIGEST] = _digest_of(path, "zarr")
    zarr.consolidate_metadata(path)


# -- pieces --------------------------------------------------------------------------------------------------


def _by_way_of_netcdf3(copy: Copy) -> Callable[..., AbstractContextManager[Sheet]]:
    """Return the `rows` function of a format without fixed offsets: fill a temporary netCDF-3 file, then copy it."""

    @contextmanager
    def rows(template: xr.Dataset, lengths: Mapping[str, int], path: Path) -> Iterator[Sheet]:
        beside = path.with_name(f"{path.stem}-rows{path.suffix}")
        try:
            with _rows_of_netcdf3(template, lengths, beside) as sheet:
                yield sheet
            with xr.open_dataset(beside, engine="scipy", cache=False) as data:
                data.attrs.pop(DIGEST)
                copy(data.drop_encoding(), path, lengths)
        finally:
            beside.unlink(missing_ok=True)

    return rows


def _with(data: xr.Dataset, long: Collection[str]) -> list[str]:
    """Return the names of variables that have a long dimension."""
    return [str(name) for name, variable in data.variables.items() if set(variable.dims) & set(long)]


def _first(data: xr.Dataset, long: Collection[str]) -> xr.Dataset:
    """Return the data at the first index of the long dimensions, in memory."""
    return data.isel({name: slice(1) for name in long}).load()


def copy_in_pieces(data: xr.Dataset, long: Collection[str], arrays: Mapping[str, Any]) -> None:
    for name in _with(data, long):
        variable, array = data.variables[name], arrays[name]
        for piece in pieces(variable.shape):
            array[piece] = variable[piece].values.astype(array.dtype)


def chunk(shape: tuple[int, ...]) -> tuple[int, ...]:
    """Return the shape of a chunk of at most CHUNK elements that follow each other in C order."""
    left, sizes = CHUNK, []
    for size in reversed(shape):
        sizes.append(max(1, min(size, left)))
        left //= size or 1
    return tuple(reversed(sizes))


def pieces(shape: tuple[int, ...]) -> Iterator[tuple[slice, ...]]:
    """Yield the chunks of an array in C order."""
    steps = [range(0, size, step) for size, step in zip(shape, chunk(shape), strict=True)]
    for corner in product(*steps):
        yield tuple(slice(first, first + run.step) for first, run in zip(corner, steps, strict=True))


# -- digests of contents -------------------------------------------------------------------------------------


def _lazy(path: Path, engine: str) -> xr.Dataset:
    options: dict[str, Any] = {"consolidated": False} if engine == "zarr" else {}
    return xr.open_dataset(path, engine=engine, cache=False, **options)


def _intact(path: Path, engine: str) -> xr.Dataset:
    """Open a file; raise OSError if the contents do not match the digest, if there is one."""
    with _readable(path):
        data = _lazy(path, engine)
        fits = data.attrs.get(DIGEST, "") in ("", _digest(data))
    if not fits:
        data.close()
        raise _damaged(path, "contents")
    return data


def _digest_of(path: Path, engine: str) -> str:
    with _lazy(path, engine) as data:
        return _digest(data)


def _digest(data: xr.Dataset) -> str:
    """Return the SHA-256 of names, dimensions, values and attributes, which is the same for every format."""
    total = hashlib.sha256()
    for name in sorted(map(str, data.variables)):
        variable = data.variables[name]
        total.update("\n".join([name, *map(str, variable.dims), *map(str, variable.shape)]).encode())
        if variable.dtype.kind in "OUST":
            total.update("\n".join(map(str, variable.values.reshape(-1))).encode())
            continue
        for piece in pieces(variable.shape):
            total.update(np.ascontiguousarray(variable[piece].values, dtype="<f8").tobytes())
    for name, value in sorted((str(key), value) for key, value in data.attrs.items() if key != DIGEST):
        total.update(f"{name}={value}".encode())
    return total.hexdigest()


# -- complex numbers -----------------------------------------------------------------------------------------


def _without_complex(data: xr.Dataset) -> xr.Dataset:
    """Replace complex numbers, which netCDF lacks, by real ones with a further dimension `part`."""
    pairs = {
        name: ((*values.dims, "part"), np.stack([values.values.real, values.values.imag], axis=-1), values.attrs)
        for name, values in data.data_vars.items()
        if values.dtype.kind == "c"
    }
    return data.assign(pairs).assign_coords(part=list(PARTS)) if pairs else data


# The format of each ending.
FORMS: dict[str, Form] = {
    ".nc": Form(None, check_replaceable, whole_file, _write_netcdf3, _rows_of_netcdf3, _seal_netcdf3, _open_netcdf3),
    ".nc4": Form(
        "h5netcdf",
        check_replaceable,
        whole_file,
        _write_netcdf4,
        _by_way_of_netcdf3(_copy_to_netcdf4),
        _seal_netcdf4,
        _open_netcdf4,
    ),
    ".zarr": Form(
        "zarr",
        _check_zarr,
        whole_folder,
        _write_zarr,
        _by_way_of_netcdf3(_copy_to_zarr),
        _seal_zarr,
        lambda path: _intact(path, "zarr"),
    ),
}
