"""Files of labelled data: netCDF-3 without further packages, netCDF-4 and Zarr if their packages are installed.

A file appears whole or not at all, and carries a digest by which damage is seen: netCDF-3 that of its
bytes, the other forms that of their contents.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
import warnings
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

import numpy as np
import xarray as xr

from synchain.models.inputs.checks import check_path

from ..support.files import netcdf_data, whole_file
from ..support.netcdf import DIGEST, seal, unsealed

__all__ = ["CHOICES", "NETCDF", "attributes_of", "ending_of", "read_data", "write_data"]

PARTS = ("real", "imaginary")
"""The values of the dimension `part`, by which complex numbers are stored as pairs of real ones."""

NETCDF = ".nc"
"""The ending of netCDF-3."""

CHOICES = {".nc4": "h5netcdf", ".zarr": "zarr"}
"""The package of each other ending."""


def ending_of(path: str | os.PathLike[str], known: Sequence[str] = (NETCDF, *CHOICES)) -> str:
    """Return the ending of a path, in small letters; ValueError if it is none of the `known` ones."""
    ending = check_path("path", path).suffix.lower()
    if ending not in known:
        raise ValueError(f"path: found {os.fspath(path)!r}; expected a name that ends in {' or '.join(known)}")
    return ending


def write_data(data: xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write a dataset; its ending chooses the form (see `Labelled.save`)."""
    ending = ending_of(path)
    target, plain = Path(path), _without_complex(data)
    if ending == ".zarr":
        _needed(ending, target)
        _write_folder(plain, target)
        return
    with whole_file(target) as temporary:
        if ending == ".nc4":
            _needed(ending, target)
            _digested(plain).to_netcdf(temporary, engine="h5netcdf")
            return
        unsealed(plain).to_netcdf(temporary, engine="scipy", format="NETCDF3_64BIT")
        with open(temporary, "r+b") as file:
            seal(file)


def read_data(path: Path) -> xr.Dataset:
    """Return the dataset of a file or Zarr folder, in memory, without its digest.

    Raises
    ------
    ModuleNotFoundError
        If the package of the form is not installed.
    OSError
        If there is no such file or if it is damaged.
    """
    if path.suffix.lower() == ".zarr" or path.suffix.lower() == ".nc4":
        data = _read_digested(path)
    else:
        with netcdf_data(path) as file:
            data = file.load()
    data.attrs = attributes_of(data.attrs, path)
    return _with_complex(data)


def attributes_of(attributes: dict[str, object], path: Path) -> dict[str, object]:
    """The attributes of a file without its digest; a RuntimeWarning says if there is none."""
    if "scene" in attributes and DIGEST not in attributes:
        warnings.warn(
            f"{path} has no digest, so damage of its numbers cannot be seen; open it and save it with Result.save",
            RuntimeWarning,
            stacklevel=4,
        )
    return {str(name): value for name, value in attributes.items() if name != DIGEST}


def _needed(ending: str, path: Path) -> None:
    """Raise ModuleNotFoundError if the package of an ending is not installed."""
    package = CHOICES[ending]
    try:
        import_module(package)
    except ModuleNotFoundError:
        raise ModuleNotFoundError(
            f"{path}: the ending {ending} needs the package {package}; install it: python -m pip install {package}, "
            "or end the name in .nc",
            name=package,
        ) from None


def _write_folder(data: xr.Dataset, target: Path) -> None:
    """Write a Zarr folder beside the target, then put it in the target's place."""
    if target.exists() and not (target / ".zgroup").is_file():
        raise FileExistsError(f"{target} is no Zarr folder; expected one or nothing there; choose another path")
    folder = Path(tempfile.mkdtemp(dir=target.parent, prefix=f".{target.stem}-", suffix=".zarr"))
    try:
        _digested(data).to_zarr(folder, mode="w", zarr_format=2, consolidated=False)
        if target.exists():
            shutil.rmtree(target)
        os.chmod(folder, 0o755)
        os.replace(folder, target)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _read_digested(path: Path) -> xr.Dataset:
    """The data of a netCDF-4 file or Zarr folder whose digest fits."""
    if not path.exists():
        raise FileNotFoundError(f"{path} does not exist; expected a result: check the path")
    ending = path.suffix.lower()
    _needed(ending, path)
    try:
        more = {} if ending == ".nc4" else {"consolidated": False}
        with xr.open_dataset(path, engine=CHOICES[ending], **more) as file:  # type: ignore[arg-type]
            data = file.load()
    except Exception as problem:  # the packages raise anything on what is no file of theirs
        words = " ".join(str(problem).split()) or type(problem).__name__
        raise OSError(f"cannot read {path}, the file is damaged: {words}") from problem
    if data.attrs.get(DIGEST, "") not in ("", _digest(data)):
        raise OSError(f"{path} is damaged, its contents do not fit their digest; restore it from a copy")
    return data


def _digested(data: xr.Dataset) -> xr.Dataset:
    copy = data.copy(deep=False)
    copy.attrs = {**data.attrs, DIGEST: _digest(data)}
    return copy


def _digest(data: xr.Dataset) -> str:
    """The SHA-256 of names, dimensions, values and attributes, whatever the form of the file."""
    total = hashlib.sha256()
    for name in sorted(map(str, data.variables)):
        variable = data[name]
        values = variable.values
        words = [name, *map(str, variable.dims), *map(str, values.shape)]
        total.update("\n".join(words).encode())
        text = values.dtype.kind in "OUST"
        total.update("\n".join(map(str, values.reshape(-1))).encode() if text else _as_double(values).tobytes())
    for name, value in sorted((str(key), value) for key, value in data.attrs.items() if key != DIGEST):
        total.update(f"{name}={value}".encode())
    return total.hexdigest()


def _as_double(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values, dtype="<f8")


def _without_complex(data: xr.Dataset) -> xr.Dataset:
    """The data with a further dimension `part` in place of complex numbers, which netCDF does not have."""
    pairs = {
        name: ((*values.dims, "part"), np.stack([values.values.real, values.values.imag], axis=-1), values.attrs)
        for name, values in data.data_vars.items()
        if values.dtype.kind == "c"
    }
    return data.assign(pairs).assign_coords(part=list(PARTS)) if pairs else data


def _with_complex(data: xr.Dataset) -> xr.Dataset:
    """The way back of `_without_complex`."""
    whole = {
        name: (values.dims[:-1], values.values[..., 0] + 1j * values.values[..., 1], values.attrs)
        for name, values in data.data_vars.items()
        if "part" in values.dims
    }
    return data.assign(whole).drop_vars("part") if whole else data
