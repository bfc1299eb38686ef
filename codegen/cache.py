"""The folder of compiled kernels.  Code is loaded from it, so a folder that others can write is refused."""

from __future__ import annotations

import os
import shutil
import stat
import sys
from pathlib import Path

__all__ = ["cache_folder", "clear", "describe", "open_folder"]


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
    for place in (folder, folder / "__pycache__"):
        if hasattr(os, "getuid") and place.exists():
            _check_owner(place)
    if not os.access(folder, os.W_OK):
        raise PermissionError(f"kernel cache {folder} is read-only; set SYNCHAIN_CACHE to a folder you can write")
    return folder


def _check_owner(folder: Path) -> None:
    status = folder.stat()
    if status.st_uid != os.getuid():
        raise PermissionError(f"kernel cache {folder} belongs to another user; set SYNCHAIN_CACHE to a folder of yours")
    if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        raise PermissionError(f"kernel cache {folder} can be written by others; run: chmod go-w '{folder}'")


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
    for path in kernels:
        path.unlink(missing_ok=True)
    for path in (folder / "__pycache__").glob("kernel_*"):
        path.unlink(missing_ok=True)
    shutil.rmtree(folder / "__pycache__", ignore_errors=True)
    return len(kernels)
