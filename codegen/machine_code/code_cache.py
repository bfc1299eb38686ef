"""Manage the folder of compiled kernels and drivers; refuse a folder that other users can change.

The folder is opened once, and files are opened relative to the folder's descriptor, so that nobody can replace the
folder between a check and a read.  The machine code of a module is one pickle file, and loading a pickle can run any
code. Each file therefore begins with a signature (HMAC) made with the user's key, which is stored outside of the
folder. Damaged code, and code of another user or machine, is refused.  Each file is read once, so that exactly the
checked bytes are loaded.  If a file is refused, its module is compiled and written again.  Reading needs no write
permission.
"""

from __future__ import annotations

import hashlib
import hmac
import os
import secrets
import shutil
import stat
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from io import FileIO
from pathlib import Path

from synchain.models.inputs.keywords import warn
from synchain.models.inputs.regular_file import open_regular

try:
    import fcntl
except ImportError:  # Windows has no such locks
    fcntl = None  # type: ignore[assignment]

DIGEST = hashlib.sha256().digest_size  # bytes of a signature and of the key
# Prefixes of file names: "kernel" for functions of a scene, "driver" for drivers and recorders, which scenes share.
KINDS = ("kernel", "driver")
KEY = "cache.key"  # name of the file with the key that signs machine code
# Seconds for which a process waits while another process compiles the same module; compilation takes up to 10 s.
LOCK_TIMEOUT = 120.0


def cache_folder() -> Path:
    """Return the folder of compiled kernels: SYNCHAIN_CACHE, or `synchain` in the user's cache folder."""
    # The folder may not exist yet.
    wish = os.environ.get("SYNCHAIN_CACHE", "")
    if wish:
        return Path(wish).expanduser().absolute()
    return _user_folder("XDG_CACHE_HOME", ".cache", "Caches")


def _user_folder(variable: str, linux: str, mac: str) -> Path:
    """Return this package's folder in the user's folder of caches or settings, whose name depends on the system."""
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / mac
    else:
        base = Path(os.environ.get(variable) or Path.home() / linux)
    return base / "synchain"


@dataclass(frozen=True, slots=True)
class Folder:
    """An open cache folder (`open_folder`)."""

    path: Path
    descriptor: int | None  # None on Windows, where folders have no descriptors: files are opened by path

    def read(self, name: str) -> bytes | None:
        """Return the content of a file, None if there is no such file."""
        try:
            file = open_regular(self._at(name), flags=getattr(os, "O_NOFOLLOW", 0), folder=self.descriptor)
        except FileNotFoundError:
            return None
        with file:
            _check_owner(self.path / name, os.fstat(file.fileno()))
            return file.readall()

    def read_trusted(self, name: str) -> bytes | None:
        """Return the content of a file; None if there is no file, or (with a warning) if the file is refused."""
        try:
            return self.read(name)
        except OSError as problem:
            _warn_of_refusal(self.path, str(problem))
            return None

    def write(self, name: str, data: bytes) -> None:
        """Write a file that only the owner can read; the file appears complete or not at all."""
        temporary = f"{name}-{secrets.token_hex(8)}.tmp"
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0) | getattr(os, "O_CLOEXEC", 0)
        descriptor = os.open(self._at(temporary), flags, 0o600, dir_fd=self.descriptor)
        try:
            with FileIO(descriptor, "wb") as file:
                remaining = memoryview(data)
                while remaining:
                    remaining = remaining[file.write(remaining) :]
            here = self.descriptor
            os.replace(self._at(temporary), self._at(name), src_dir_fd=here, dst_dir_fd=here)
        except BaseException:
            self.delete(temporary)
            raise

    def delete(self, name: str) -> None:
        with suppress(FileNotFoundError):
            os.unlink(self._at(name), dir_fd=self.descriptor)

    def _at(self, name: str) -> str:
        return name if self.descriptor is not None else str(self.path / name)

    # -- machine code and its signature -----------------------------------------------------------------------

    def load_code(self, name: str) -> bytes | None:
        """Return the machine code of module `name`; None if there is none, or (with a warning) if it is refused."""
        data = self.read_trusted(f"{name}.code")
        if data is None:
            return None
        signature, code = data[:DIGEST], data[DIGEST:]
        if not hmac.compare_digest(signature, self._signature(name, code)):
            _warn_of_refusal(self.path, f"{name}.code is damaged, or was signed by another user or machine")
            return None
        return code

    def store_code(self, name: str, code: bytes) -> None:
        """Write the machine code of the module `name` with its signature."""
        self.write(f"{name}.code", self._signature(name, code) + code)

    def _signature(self, name: str, code: bytes) -> bytes:
        return hmac.digest(self.key(), f"{name}\n".encode() + code, "sha256")

    def key(self) -> bytes:
        """Return the user's key from the folder of settings; from this folder if the folder of settings is unusable."""
        try:
            with open_folder(_user_folder("XDG_CONFIG_HOME", ".config", "Application Support")) as settings:
                return settings.key_here()
        except (OSError, RuntimeError):  # RuntimeError: no home folder
            return self.key_here()

    def key_here(self) -> bytes:
        """Return the key in this folder; create one if there is none."""
        key = self.read(KEY)
        if key is None:
            fresh = f"{KEY}-{secrets.token_hex(8)}.tmp"
            self.write(fresh, secrets.token_bytes(DIGEST))
            with suppress(FileExistsError):  # if several processes create a key at once, the first wins
                os.link(self._at(fresh), self._at(KEY), src_dir_fd=self.descriptor, dst_dir_fd=self.descriptor)
            self.delete(fresh)
            key = self.read(KEY)
        if key is None or len(key) != DIGEST:
            raise OSError(f"{self.path / KEY}: found no key of {DIGEST} bytes; expected one; delete the file")
        return key

    # -- one compilation at a time ----------------------------------------------------------------------------

    @contextmanager
    def locked(self, name: str) -> Iterator[None]:
        """Let one process at a time compile the module `name`; the others wait, and then load it."""
        # The operating system frees the lock of a process that ends. Without locks, or after LOCK_TIMEOUT, two
        # processes compile the module, with the same result.
        lock = f"{name}.lock"
        flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_CLOEXEC", 0)
        descriptor = None
        if fcntl is not None:
            with suppress(OSError):  # a folder that can only be read
                descriptor = os.open(self._at(lock), flags, 0o600, dir_fd=self.descriptor)
        if descriptor is None:
            yield
            return
        try:
            end = time.monotonic() + LOCK_TIMEOUT
            while time.monotonic() < end:
                try:
                    fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except BlockingIOError:
                    time.sleep(0.05)
                except OSError:  # a file system without locks
                    break
                else:
                    break
            yield
        finally:
            with suppress(OSError):
                self.delete(lock)
            os.close(descriptor)


@contextmanager
def open_folder(path: Path) -> Iterator[Folder]:
    """Open a folder, and create it if it is missing; raise PermissionError if others can change or replace it."""
    for parent in reversed(path.parents):
        if not parent.exists():
            parent.mkdir(mode=0o700, exist_ok=True)
    path.mkdir(mode=0o700, exist_ok=True)
    if not hasattr(os, "getuid"):
        yield Folder(path, None)
        return
    real = path.resolve(strict=True)
    _check_parents(real)
    descriptor = os.open(real, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        _check_owner(path, os.fstat(descriptor))
        yield Folder(path, descriptor)
    finally:
        os.close(descriptor)


_warned_folders: set[Path] = set()  # the folders for which a warning of refused files was issued


def _warn_of_refusal(folder: Path, problem: str) -> None:
    if folder not in _warned_folders:
        _warned_folders.add(folder)
        warn(f"kernel cache {folder}: refused a file, whose kernel is compiled anew, as others may be: {problem}")


def _check_owner(path: Path, status: os.stat_result) -> None:
    """Raise PermissionError unless a file or folder belongs to the user, who alone can write to it."""
    if not hasattr(os, "getuid"):
        return
    if status.st_uid != os.getuid():
        raise PermissionError(f"kernel cache {path} belongs to another user; set SYNCHAIN_CACHE to a folder of yours")
    if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        raise PermissionError(f"kernel cache {path} can be written by others; run: chmod go-w '{path}'")


def _check_parents(real: Path) -> None:
    """Raise PermissionError if another user can replace a folder, given by its path without symbolic links."""
    for parent in real.parents:
        status = parent.stat()
        # A parent's owner can replace `real`; so can users with write permission, unless it is sticky (/tmp).
        if status.st_uid not in (os.getuid(), 0):
            raise PermissionError(
                f"kernel cache {real} lies in {parent}, which belongs to another user; "
                "set SYNCHAIN_CACHE to a folder of yours"
            )
        if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH) and not status.st_mode & stat.S_ISVTX:
            raise PermissionError(
                f"kernel cache {real} lies in {parent}, which others can write; run: chmod go-w '{parent}', "
                "or set SYNCHAIN_CACHE to a folder of yours"
            )


def describe() -> dict[str, str | int]:
    """Return the folder, the numbers of kernels and of drivers with their recorders, and the bytes on disk."""
    folder = cache_folder()
    files = [p for p in folder.rglob("*") if p.is_file()] if folder.is_dir() else []
    return {
        "folder": str(folder),
        **{f"{kind}s": sum(p.match(f"{kind}_*.py") for p in files) for kind in KINDS},
        "bytes": sum(p.stat().st_size for p in files),
    }


def clear() -> dict[str, int]:
    """Delete all cached kernels and drivers and return their numbers; keep other files in the folder."""
    folder = cache_folder()
    counts = {}
    for kind in KINDS:
        counts[f"{kind}s"] = len(list(folder.glob(f"{kind}_*.py")))
        for path in folder.glob(f"{kind}_*"):
            path.unlink(missing_ok=True)
    shutil.rmtree(folder / "__pycache__", ignore_errors=True)
    return counts
