"""Open regular files only: refuse a pipe or a device, which could block the program."""

from __future__ import annotations

import errno
import os
import stat
from io import FileIO
from pathlib import Path


def open_regular(
    path: str | os.PathLike[str], *, writing: bool = False, flags: int = 0, folder: int | None = None
) -> FileIO:
    """Open a regular file without buffering."""
    # The kind of file is tested on the open descriptor, so that exchanging the file meanwhile has no effect.
    flags |= os.O_RDWR if writing else os.O_RDONLY
    flags |= getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0) | getattr(os, "O_CLOEXEC", 0)
    file = Path(path)
    if folder is None and file.is_dir():  # Windows cannot open a folder
        raise IsADirectoryError(f"{file} is a folder; expected a file: name the file in it")
    try:
        descriptor = os.open(path, flags, dir_fd=folder)
    except OSError as problem:
        if problem.errno == errno.ENXIO:  # a socket
            raise OSError(f"{file} is a pipe or device; expected a file; choose another path") from None
        raise
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise OSError(f"{file} is a pipe or device; expected a file; choose another path")
    return FileIO(descriptor, "r+b" if writing else "rb")
