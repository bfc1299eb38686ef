"""The folder of compiled kernels and drivers.  Code is loaded from it, so a folder that others can change is refused.

The folder is opened once and its files are reached through it, so that nobody can replace the folder
between a check and a reading.  The machine code of a kernel is one file, a pickle, which may run
anything when it is read: it begins with a signature (HMAC) by a key of the user, which does not lie
in the folder, so that code of another user or machine is refused, and damaged code too.  The file is
read once: the bytes that were checked are the bytes that are loaded.  A file that is refused is
written anew.  Reading needs no right to write.
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
from types import TracebackType

from synchain.models.inputs.keywords import warn
from synchain.models.inputs.regular_file import open_regular

try:
    import fcntl
except ImportError:  # Windows has no such locks
    fcntl = None  # type: ignore[assignment]

DIGEST = hashlib.sha256().digest_size

KINDS = ("kernel", "driver")
"""The modules in the folder, by the beginnings of their names: the functions of a scene, and what runs and records them."""

KEY = "cache.key"
"""The file of the key that signs machine code."""

PATIENCE = 120.0
"""Seconds after which a process no longer waits for another one that compiles the same kernel."""


def cache_folder() -> Path:
    """Return the folder of compiled kernels: SYNCHAIN_CACHE, or `synchain` in the user's cache folder.

    The folder may not exist yet.
    """
    wish = os.environ.get("SYNCHAIN_CACHE", "")
    if wish:
        return Path(wish).expanduser().absolute()
    return _user_folder("XDG_CACHE_HOME", ".cache", "Caches")


def _user_folder(variable: str, linux: str, mac: str) -> Path:
    """The folder of this package among those of the user, of a kind that systems name differently."""
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / mac
    else:
        base = Path(os.environ.get(variable) or Path.home() / linux)
    return base / "synchain"


@dataclass(frozen=True, slots=True)
class Folder:
    """An open cache folder."""

    path: Path  # where the folder is
    # the open folder, through which its files are reached. Windows has no such descriptors: there it is None, and
    # files are reached by their paths
    descriptor: int | None

    def __enter__(self) -> Folder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.descriptor is not None:
            os.close(self.descriptor)

    def read(self, name: str) -> bytes | None:
        """Return the content of a file, None if there is no such file."""
        try:
            file = open_regular(self._at(name), flags=getattr(os, "O_NOFOLLOW", 0), folder=self.descriptor)
        except FileNotFoundError:
            return None
        with file:
            _check_owner(self.path / name, os.fstat(file.fileno()))
            return file.readall()

    def write(self, name: str, data: bytes) -> None:
        """Write a file that appears whole or not at all, for its owner alone."""
        temporary = f"{name}-{secrets.token_hex(8)}.tmp"
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0) | getattr(os, "O_CLOEXEC", 0)
        descriptor = os.open(self._at(temporary), flags, 0o600, dir_fd=self.descriptor)
        try:
            with FileIO(descriptor, "wb") as file:
                left = memoryview(data)
                while left:
                    left = left[file.write(left) :]
            here = self.descriptor
            os.replace(self._at(temporary), self._at(name), src_dir_fd=here, dst_dir_fd=here)
        except BaseException:
            self.delete(temporary)
            raise

    def trusted(self, name: str) -> bytes | None:
        """Return the content of a file; None if there is none, or, with a warning, if it is refused."""
        try:
            return self.read(name)
        except OSError as problem:
            _warn_of_refusal(self.path, str(problem))
            return None

    def machine_code(self, name: str) -> bytes | None:
        """Return the machine code of the kernel `name`; None if there is none, or, with a warning, if it is refused."""
        data = self.trusted(f"{name}.code")
        if data is None:
            return None
        signed, code = data[:DIGEST], data[DIGEST:]
        if not hmac.compare_digest(signed, self._signature(name, code)):
            _warn_of_refusal(self.path, f"{name}.code is damaged, or was signed by another user or machine")
            return None
        return code

    def keep(self, name: str, code: bytes) -> None:
        """Write the machine code of the kernel `name` with its signature."""
        self.write(f"{name}.code", self._signature(name, code) + code)

    def _signature(self, name: str, code: bytes) -> bytes:
        return hmac.digest(self.key(), f"{name}\n".encode() + code, "sha256")

    def key(self) -> bytes:
        """Return the key of the user, which is made if it is missing.

        It lies in the user's folder of settings; in this folder only if that one cannot be used.
        """
        try:
            with open_folder(_user_folder("XDG_CONFIG_HOME", ".config", "Application Support")) as settings:
                return settings.own_key()
        except (OSError, RuntimeError):  # RuntimeError: no home folder
            return self.own_key()

    def own_key(self) -> bytes:
        """Return the key in this folder, which is made if it is missing."""
        key = self.read(KEY)
        if key is None:
            fresh = f"{KEY}-{secrets.token_hex(8)}.tmp"
            self.write(fresh, secrets.token_bytes(DIGEST))
            with suppress(FileExistsError):  # of processes that make one at once, the first wins
                os.link(self._at(fresh), self._at(KEY), src_dir_fd=self.descriptor, dst_dir_fd=self.descriptor)
            self.delete(fresh)
            key = self.read(KEY)
        if key is None or len(key) != DIGEST:
            raise OSError(f"{self.path / KEY}: found no key of {DIGEST} bytes; expected one; delete the file")
        return key

    @contextmanager
    def turn(self, name: str) -> Iterator[None]:
        """Let one process at a time compile the kernel `name`; the others wait, and then find it.

        The operating system frees the lock of a process that ends.  A system without locks compiles
        the kernel twice, with the same result.
        """
        lock = f"{name}.lock"
        flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_CLOEXEC", 0)
        descriptor = None
        if fcntl is not None:
            with suppress(OSError):
                descriptor = os.open(self._at(lock), flags, 0o600, dir_fd=self.descriptor)
        if descriptor is None:
            yield
            return
        try:
            _wait_for(descriptor)
            yield
        finally:
            with suppress(OSError):
                self.delete(lock)
            os.close(descriptor)

    def delete(self, name: str) -> None:
        """Delete a file if it is there."""
        with suppress(FileNotFoundError):
            os.unlink(self._at(name), dir_fd=self.descriptor)

    def _at(self, name: str) -> str:
        return name if self.descriptor is not None else str(self.path / name)


def _wait_for(descriptor: int) -> None:
    """Lock an open file, or give up when patience ends or the file system has no locks."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            time.sleep(0.05)
        except OSError:
            return
        else:
            return


_refusing: set[Path] = set()
"""The folders with files that were refused."""


def _warn_of_refusal(folder: Path, problem: str) -> None:
    """Warn, once for each folder, of a file that is not loaded."""
    if folder not in _refusing:
        _refusing.add(folder)
        warn(f"kernel cache {folder}: refused a file, whose kernel is compiled anew, as others may be: {problem}")


def open_folder(folder: Path) -> Folder:
    """Create the folder if it is missing and open it."""
    for place in reversed(folder.parents):
        if not place.exists():
            place.mkdir(mode=0o700, exist_ok=True)
    folder.mkdir(mode=0o700, exist_ok=True)
    if not hasattr(os, "getuid"):
        opened = Folder(folder, None)
    else:
        real = folder.resolve(strict=True)
        _check_way(real)
        opened = Folder(folder, os.open(real, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC))
    try:
        if opened.descriptor is not None:
            _check_owner(folder, os.fstat(opened.descriptor))
    except BaseException:
        opened.__exit__(None, None, None)
        raise
    return opened


def _check_owner(place: Path, status: os.stat_result) -> None:
    if not hasattr(os, "getuid"):
        return
    if status.st_uid != os.getuid():
        raise PermissionError(f"kernel cache {place} belongs to another user; set SYNCHAIN_CACHE to a folder of yours")
    if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        raise PermissionError(f"kernel cache {place} can be written by others; run: chmod go-w '{place}'")


def _check_way(real: Path) -> None:
    """Refuse a folder that another user can replace; the path has no symbolic links.

    The owner of a parent folder can, and so can all who may write to it, unless it is sticky (/tmp).
    """
    for place in real.parents:
        status = place.stat()
        if status.st_uid not in (os.getuid(), 0):
            raise PermissionError(
                f"kernel cache {real} lies in {place}, which belongs to another user; "
                "set SYNCHAIN_CACHE to a folder of yours"
            )
        if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH) and not status.st_mode & stat.S_ISVTX:
            raise PermissionError(
                f"kernel cache {real} lies in {place}, which others can write; run: chmod go-w '{place}', "
                "or set SYNCHAIN_CACHE to a folder of yours"
            )


def describe() -> dict[str, str | int]:
    """Return folder, number of kernels, number of drivers that they share, and bytes on disk."""
    folder = cache_folder()
    files = [p for p in folder.rglob("*") if p.is_file()] if folder.is_dir() else []
    return {
        "folder": str(folder),
        **{f"{kind}s": sum(p.match(f"{kind}_*.py") for p in files) for kind in KINDS},
        "bytes": sum(p.stat().st_size for p in files),
    }


def clear() -> dict[str, int]:
    """Delete all cached kernels and drivers and return their numbers; other files in the folder stay."""
    folder = cache_folder()
    counts = {}
    for kind in KINDS:
        counts[f"{kind}s"] = len(list(folder.glob(f"{kind}_*.py")))
        for path in folder.glob(f"{kind}_*"):
            path.unlink(missing_ok=True)
    shutil.rmtree(folder / "__pycache__", ignore_errors=True)
    return counts
