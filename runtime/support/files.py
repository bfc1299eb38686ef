"""Write files completely or not at all."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from glob import escape
from pathlib import Path


@contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary path beside `path`; move it there at the end of the with block, delete it on an error."""
    target = Path(path)
    check_replaceable(target)
    with _cannot_write(target):
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.stem}-", suffix=target.suffix)
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
def whole_folder(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Yield a temporary folder beside `path`, and move it there as `whole_file` does; delete an existing folder."""
    target = Path(path)
    with _cannot_write(target):
        name = tempfile.mkdtemp(dir=target.parent, prefix=f".{target.stem}-", suffix=target.suffix)
    folder = Path(name)
    former = folder.with_name(f"{folder.stem}-former{folder.suffix}")
    try:
        with _named(target, name):
            yield folder
        os.chmod(folder, 0o777 & ~_umask())
        if target.exists():
            os.replace(target, former)
        os.replace(folder, target)
    finally:
        for leftover in (folder, former):
            shutil.rmtree(leftover, ignore_errors=True)


def synced(path: Path) -> None:
    """Flush a file, or all files of a folder, from buffers of the system to the disk."""
    for part in (path, *path.rglob("*")):
        if part.is_file():
            with open(part, "rb+") as file:
                os.fsync(file.fileno())


@contextmanager
def _cannot_write(target: Path) -> Iterator[None]:
    """Turn a system error into a message that names the target and a remedy."""
    try:
        yield
    except OSError as problem:
        raise OSError(f"cannot write {target}: {problem.strerror}; choose a folder you can write to") from problem


@contextmanager
def _named(target: Path, temporary: str) -> Iterator[None]:
    """Put the name of the user's file into a system error, in place of no name or a temporary name."""
    try:
        yield
    except OSError as problem:
        if problem.errno is not None and str(problem.filename or temporary).startswith(temporary):
            problem.filename = str(target)
        raise


def check_replaceable(target: Path) -> None:
    """Raise OSError if `target` exists and is no file."""
    if target.is_dir():
        raise IsADirectoryError(f"{target} is a folder; expected a file or nothing there; choose another path (--out)")
    if target.exists() and not target.is_file():
        raise OSError(f"{target} is a pipe or device; expected a file or nothing there; choose another path (--out)")


def drop_leftovers(path: str | os.PathLike[str]) -> None:
    """Delete temporary files of killed processes that wrote `path`; call only if no process is writing `path`."""
    target = Path(path)
    for leftover in target.parent.glob(f".{escape(target.stem)}-*{escape(target.suffix)}"):
        if leftover.is_dir():
            shutil.rmtree(leftover, ignore_errors=True)
        else:
            leftover.unlink(missing_ok=True)


@contextmanager
def understood(path: Path) -> Iterator[None]:
    """Turn any error of a reader, as from a forged file, into one ValueError that names the file."""
    try:
        yield
    except (OSError, MemoryError):
        raise
    except Exception as problem:  # forged contents may raise any exception
        message = " ".join(str(problem).split()) or type(problem).__name__
        raise ValueError(message if str(path) in message else f"cannot use {path}: {message}") from problem


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a text file in UTF-8, whole or not at all."""
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def output_folder(path: str | os.PathLike[str]) -> Path:
    """Create a folder for output and return it; raise OSError with a remedy if that cannot be done."""
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
