"""Files that appear whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from glob import escape
from pathlib import Path

__all__ = ["drop_leftovers", "output_folder", "whole_file", "write_text"]


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
        raise OSError(f"cannot make the folder {folder}: {problem.strerror}; choose another --out") from problem
    if not os.access(folder, os.W_OK):
        raise OSError(f"the folder {folder} cannot be written to; choose another --out")
    return folder


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
