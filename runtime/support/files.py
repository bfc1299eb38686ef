"""Files that appear whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from glob import escape
from pathlib import Path
from typing import TYPE_CHECKING

from synchain.models.inputs.regular_file import open_regular

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "check_replaceable",
    "drop_leftovers",
    "netcdf_data",
    "output_folder",
    "understood",
    "whole_file",
    "write_text",
]


@contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path beside `path`; it replaces `path` at the end of the with block, or
    vanishes on an error.
    """
    target = Path(path)
    check_replaceable(target)
    try:
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.stem}-", suffix=target.suffix)
    except OSError as problem:
        raise OSError(f"cannot write {target}: {problem.strerror}; choose a folder you can write to") from problem
    os.close(handle)
    temporary = Path(name)
    try:
        with _named(target, name):
            yield temporary
        os.chmod(temporary, 0o666 & ~_umask())
        os.replace(temporary, target)
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def _named(target: Path, temporary: str) -> Iterator[None]:
    """Make an error of the system name the file of the user instead of none or a temporary one."""
    try:
        yield
    except OSError as problem:
        if problem.errno is not None and problem.filename in (None, temporary):
            problem.filename = str(target)
        raise


def check_replaceable(target: Path) -> None:
    """Raise OSError if `target` exists and is no file."""
    if target.is_dir():
        raise IsADirectoryError(f"{target} is a folder; expected a file or nothing there; choose another path (--out)")
    if target.exists() and not target.is_file():
        raise OSError(f"{target} is a pipe or device; expected a file or nothing there; choose another path (--out)")


def drop_leftovers(path: str | os.PathLike[str]) -> None:
    """Delete temporary files of processes that were killed while they wrote `path`; no other
    process may be writing it.
    """
    target = Path(path)
    for leftover in target.parent.glob(f".{escape(target.stem)}-*{escape(target.suffix)}"):
        leftover.unlink(missing_ok=True)


@contextmanager
def netcdf_data(path: Path) -> Iterator[xr.Dataset]:
    """Yield the open data of a netCDF file; OSError in one line if there is none or if it is
    damaged.
    """
    import xarray as xr

    from .netcdf import DIGEST, is_sealed

    if not path.exists():
        raise FileNotFoundError(f"{path} does not exist; expected a netCDF result: check the path")
    if path.is_dir():
        raise IsADirectoryError(f"{path} is a folder; expected a netCDF result: name the file in it")
    with open_regular(path) as file:
        start = file.read(4)
        if start[:3] != b"CDF":
            kind = "an HDF5 or netCDF4 file" if start == b"\x89HDF" else "no netCDF file"
            raise OSError(f"{path} is {kind}; expected a netCDF 3 result, as Result.save and stream write it")
        sealed = is_sealed(file)
    try:
        if sealed is not False:
            with xr.open_dataset(path, engine="scipy") as data:
                if sealed or DIGEST not in data.attrs:
                    yield data
                    return
    except OSError:
        raise
    except Exception as problem:  # SciPy and xarray raise anything on what is no file of theirs
        words = " ".join(str(problem).split()) or type(problem).__name__
        raise OSError(f"cannot read {path} as a netCDF result, the file is damaged: {words}") from problem
    raise OSError(
        f"{path} is damaged, its bytes do not fit their digest; restore it from a copy, or run again with overwrite "
        "(--overwrite)"
    )


@contextmanager
def understood(path: Path) -> Iterator[None]:
    """Turn any error that a forged file makes its reader raise into one ValueError that names the
    file.
    """
    try:
        yield
    except (OSError, MemoryError):
        raise
    except Exception as problem:  # what was forged may break anything
        words = " ".join(str(problem).split()) or type(problem).__name__
        raise ValueError(words if str(path) in words else f"cannot use {path}: {words}") from problem


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a text file in UTF-8, whole or not at all."""
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def output_folder(path: str | os.PathLike[str]) -> Path:
    """Create a folder for output and return it; OSError in a clear sentence if that cannot be done."""
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise OSError(
            f"cannot make the folder {folder}: {problem.strerror}; choose another folder (--out)"
        ) from problem
    if not os.access(folder, os.W_OK):
        raise OSError(f"the folder {folder} cannot be written to; choose another folder (--out)")
    return folder


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
