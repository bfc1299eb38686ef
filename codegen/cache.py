"""The folder of compiled kernels.  Code is loaded from it, so a folder that others can write is refused.

A wrong bit in machine code is a crash or a wrong number, so the files of a kernel are loaded only where their checksum is
the one that was written beside them when they were made.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import stat
import sys
import tempfile
from pathlib import Path

__all__ = ["cache_folder", "clear", "describe", "discard", "has_code", "is_sound", "open_folder", "seal", "write_whole"]


def cache_folder() -> Path:
    """Return where kernels are kept: SYNCHAIN_CACHE, or `synchain` in the user's cache folder (it may not exist yet)."""
    wish = os.environ.get("SYNCHAIN_CACHE", "")
    if wish:
        return Path(wish).expanduser().absolute()
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "synchain"


def open_folder(folder: Path) -> Path:
    """Create the folder where it is missing and return it.

    Raises PermissionError where it belongs to somebody else or others may write to it, OSError where it cannot be
    made or written to.
    """
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    if hasattr(os, "getuid"):
        for place in (folder, folder / "__pycache__"):
            if place.exists():
                _check_owner(place)
        _check_way(folder)
    if not os.access(folder, os.W_OK):
        raise PermissionError(f"kernel cache {folder} is read-only; set SYNCHAIN_CACHE to a folder you can write")
    return folder


def _check_owner(place: Path) -> None:
    status = place.stat()
    if status.st_uid != os.getuid():
        raise PermissionError(f"kernel cache {place} belongs to another user; set SYNCHAIN_CACHE to a folder of yours")
    if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        raise PermissionError(f"kernel cache {place} can be written by others; run: chmod go-w '{place}'")


def _check_way(folder: Path) -> None:
    """Refuse a folder that anybody can put another one in the place of; with the sticky bit (/tmp) nobody can."""
    for place in folder.resolve().parents:
        mode = place.stat().st_mode
        if mode & stat.S_IWOTH and not mode & stat.S_ISVTX:
            raise PermissionError(
                f"kernel cache {folder} lies in {place}, which everybody can write; set SYNCHAIN_CACHE to a folder of yours"
            )


def _machine_code(folder: Path, name: str) -> list[Path]:
    """The files that Numba wrote for the kernel of this name: an index and machine code."""
    return sorted((folder / "__pycache__").glob(f"{name}.*.nb[ic]"))


def _checksum(files: list[Path]) -> str:
    total = hashlib.sha256()
    for path in files:
        total.update(f"{path.name}\n".encode() + hashlib.sha256(path.read_bytes()).digest())
    return total.hexdigest()


def has_code(folder: Path, name: str) -> bool:
    """True where there is machine code of the kernel `name`."""
    return bool(_machine_code(folder, name))


def is_sound(folder: Path, name: str) -> bool:
    """False where there is machine code of the kernel `name` that is not what was sealed.

    Raises PermissionError where one of its files belongs to somebody else or others may write to it.
    """
    files, kept = _machine_code(folder, name), folder / f"{name}.sha256"
    if hasattr(os, "getuid"):
        for path in (*files, kept):
            if path.exists():
                _check_owner(path)
    try:
        return not files or kept.read_text(encoding="ascii") == _checksum(files)
    except (OSError, ValueError):
        return False


def seal(folder: Path, name: str) -> None:
    """Write the checksum of the kernel's machine code; where another process has just deleted that, nothing."""
    try:
        write_whole(folder / f"{name}.sha256", _checksum(_machine_code(folder, name)))
    except FileNotFoundError:
        discard(folder, name)


def discard(folder: Path, name: str) -> bool:
    """Delete the files of a kernel; returns whether there were any."""
    files = [folder / f"{name}.py", folder / f"{name}.sha256", *(folder / "__pycache__").glob(f"{name}.*")]
    found = [path for path in files if path.exists()]
    for path in found:
        path.unlink(missing_ok=True)
    return bool(found)


def write_whole(path: Path, text: str) -> None:
    """Write a file that appears whole or not at all, for its owner alone."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=path.stem, suffix=".tmp")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def describe() -> dict[str, str | int]:
    """Return folder, number of kernels and bytes on disk."""
    folder = cache_folder()
    found = [p for p in folder.rglob("*") if p.is_file()] if folder.is_dir() else []
    return {
        "folder": str(folder),
        "kernels": sum(p.suffix == ".py" for p in found),
        "bytes": sum(p.stat().st_size for p in found),
    }


def clear() -> int:
    """Delete all cached kernels and return how many there were; other files in the folder stay."""
    folder = cache_folder()
    if not folder.is_dir():
        return 0
    kernels = list(folder.glob("kernel_*.py"))
    for path in (*kernels, *folder.glob("kernel_*.sha256"), *folder.glob("kernel_*.tmp")):
        path.unlink(missing_ok=True)
    for path in (folder / "__pycache__").glob("kernel_*"):
        path.unlink(missing_ok=True)
    shutil.rmtree(folder / "__pycache__", ignore_errors=True)
    return len(kernels)
