"""Files that appear whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from glob import escape
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["drop_leftovers", "netcdf_data", "output_folder", "whole_file", "write_text"]


@contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path beside `path`; it replaces `path` at the end of the with block, or vanishes on an error."""
    target = Path(path)
    try:
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.stem}-", suffix=target.suffix)
    except OSError as problem:
        raise OSError(f"cannot write {target}: {problem.strerror}; choose a folder you can write to") from problem
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        os.chmod(temporary, 0o666 & ~_umask())
        os.replace(temporary, target)
    finally:
        temporary.unlink(missing_ok=True)


def drop_leftovers(path: str | os.PathLike[str]) -> None:
    """Delete the temporary files of processes that were killed while they wrote `path`; only for who alone writes it."""
    target = Path(path)
    for leftover in target.parent.glob(f".{escape(target.stem)}-*{escape(target.suffix)}"):
        leftover.unlink(missing_ok=True)


@contextmanager
def netcdf_data(path: Path) -> Iterator[xr.Dataset]:
    """The open data of a netCDF file; OSError in one line where there is none, or where it is damaged."""
    import xarray as xr

    if not path.exists():
        raise FileNotFoundError(f"{path} does not exist; expected a netCDF result: check the path")
    if path.is_dir():
        raise IsADirectoryError(f"{path} is a folder; expected a netCDF result: name the file in it")
    try:
        with path.open("rb") as file:
            start = file.read(4)
        if start[:3] != b"CDF":
            kind = "an HDF5 or netCDF4 file" if start == b"\x89HDF" else "no netCDF file"
            raise OSError(f"{path} is {kind}; expected a netCDF 3 result, as Result.save and stream write it")
        with xr.open_dataset(path, engine="scipy") as data:
            yield data
    except (ValueError, TypeError, KeyError, IndexError) as problem:
        words = " ".join(str(problem).split())
        raise OSError(f"cannot read {path} as a netCDF result, the file is damaged: {words}") from problem


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a text file in UTF-8, whole or not at all."""
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def output_folder(path: str | os.PathLike[str]) -> Path:
    """Create a folder for output and return it; OSError with a clear sentence where that cannot be done."""
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
