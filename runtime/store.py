"""The file of a sweep that is under way: blocks of finished cells, appended as they come.

A file begins with MAGIC and one JSON line (its length, its checksum, then the text), which says what the sweep is.  Records
follow, one for each finished block: a head with the number of the block and two checksums, then the numbers themselves,
little endian.  Nothing is ever changed in place, so that a process that dies at any moment leaves whole records and at most
one torn one at the end.  Reading stops there; writing goes on over it.
"""

from __future__ import annotations

import json
import os
import struct
import time
import zlib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from io import FileIO
from pathlib import Path
from typing import Any

import numpy as np

from .files import whole_file
from .result import Buffers
from .status import CODES, tally

__all__ = ["Store", "is_store"]

MAGIC = b"synchain blocks 1\n"
LINE = struct.Struct("<QI")
HEAD = struct.Struct(f"<4sQQIII{CODES}QI")
"""Mark, block, bytes and CRC-32 of the numbers, cells, most section points, how many ended how, CRC-32 of all this."""
MARK = b"blk\0"
FLUSH = 5.0
"""Seconds between two requests to the system that the file be safe from a loss of power as well."""


def is_store(path: str | os.PathLike[str]) -> bool:
    """True where a file begins like a store."""
    try:
        with open(path, "rb") as file:
            return file.read(len(MAGIC)) == MAGIC
    except OSError:
        return False


@dataclass(slots=True)
class Store:
    """An open store: `about` says what the sweep is, `places` (blocks,) where each block's record begins, -1 for none.

    counts (CODES,): how many cells of the stored blocks ended how; `most`: section points of the cell that has most.
    """

    path: Path
    about: Mapping[str, Any]
    places: np.ndarray
    counts: np.ndarray
    _file: FileIO = field(repr=False)
    _end: int
    most: int = 0
    _flushed: float = field(default_factory=time.monotonic)

    @staticmethod
    def describe(path: str | os.PathLike[str]) -> dict[str, Any]:
        """What the sweep of a store is, without a look at its blocks; ValueError where it cannot be told."""
        with open(path, "rb", buffering=0) as file:
            return _about(file, path)

    @staticmethod
    def create(path: str | os.PathLike[str], about: Mapping[str, Any]) -> None:
        """Make a store without blocks; `about` is what JSON can hold and says how many `blocks` there are."""
        text = json.dumps(about).encode()
        if os.path.exists(path):
            with open(path, "r+b", buffering=0) as old:
                _lock(old, path)
        with whole_file(path) as temporary, open(temporary, "wb") as file:
            file.write(MAGIC + LINE.pack(len(text), zlib.crc32(text)) + text)
            file.flush()
            os.fsync(file.fileno())

    @classmethod
    def open(cls, path: str | os.PathLike[str], writing: bool = False) -> Store:
        """Open a store and find its whole blocks; a record that is torn or damaged counts as none.

        Raises ValueError where the file is no store or its first line is damaged, BlockingIOError where another process
        writes to it.
        """
        file = open(path, "r+b" if writing else "rb", buffering=0)  # noqa: SIM115  (open as long as the store is)
        try:
            if writing:
                _lock(file, path)
            about = _about(file, path)
            places = np.full(int(about["blocks"]), -1, dtype=np.int64)
            store = cls(Path(path), about, places, np.zeros(CODES, np.int64), file, file.tell())
            store._scan()
            if writing:
                file.truncate(store._end)  # what is torn at the end
        except BaseException:
            file.close()
            raise
        return store

    def _scan(self) -> None:
        """Find the records; the file ends for us where one is not whole."""
        size = os.fstat(self._file.fileno()).st_size
        for place, head, sound in _records(self._file, self._end, size):
            if sound and head[1] < len(self.places):
                if self.places[head[1]] >= 0:  # written twice, once before some damage: the later one counts
                    self.counts -= self._statuses(head[1])
                self.places[head[1]] = place
                self.counts += np.array(head[6:-1])
                self.most = max(self.most, head[5])
            self._end = place + HEAD.size + head[2]

    def _statuses(self, block: int) -> np.ndarray:
        self._file.seek(int(self.places[block]))
        return np.array(HEAD.unpack(self._file.read(HEAD.size))[6:-1])

    @property
    def done(self) -> np.ndarray:
        """True for each block (blocks,) that is stored."""
        return self.places >= 0

    def append(self, block: int, made: Buffers) -> None:
        """Add a finished block; OSError where it cannot be written, after which the store is as it was."""
        counts = tally(made.counts[:, 0])
        body = _packed(made)
        most = int(made.counts[:, 3].max(initial=0))
        head = HEAD.pack(MARK, block, len(body), zlib.crc32(body), len(made.counts), most, *counts.tolist(), 0)
        head = head[:-4] + struct.pack("<I", zlib.crc32(head[:-4]))
        self._file.seek(self._end)
        left = memoryview(head + body)
        while left:
            left = left[self._file.write(left) :]
        self.places[block], self._end = self._end, self._end + len(head) + len(body)
        self.counts += counts
        self.most = max(self.most, most)
        if time.monotonic() - self._flushed > FLUSH:
            self.flush()

    def flush(self) -> None:
        """Ask the system to put all that was written on the disk itself."""
        os.fsync(self._file.fileno())
        self._flushed = time.monotonic()

    def read(self, block: int) -> Buffers:
        """The numbers of a stored block; OSError where they were damaged since the store was opened."""
        self._file.seek(int(self.places[block]))
        head = HEAD.unpack(self._file.read(HEAD.size))
        body = self._file.read(head[2])
        if zlib.crc32(body) != head[3]:
            raise OSError(f"{self.path}: block {block} was damaged while it was in use; run again with resume")
        return _unpacked(body, head[4], int(self.about["dimension"]), int(self.about["samples"]))

    def close(self) -> None:
        """Put everything on the disk and close the file."""
        if not self._file.closed:
            with suppress(OSError):
                if self._file.writable():
                    self.flush()
            with suppress(OSError):
                self._file.close()


def _about(file: FileIO, path: str | os.PathLike[str]) -> dict[str, Any]:
    if file.read(len(MAGIC)) != MAGIC:
        raise ValueError(f"{os.fspath(path)} is no unfinished run of synchain; choose another file")
    head = file.read(LINE.size)
    length, check = LINE.unpack(head) if len(head) == LINE.size else (0, 1)
    text = file.read(min(length, os.fstat(file.fileno()).st_size))
    if zlib.crc32(text) != check:
        raise ValueError(f"{os.fspath(path)}: its first line is damaged; delete the file and run again without resume")
    about: dict[str, Any] = json.loads(text)
    return about


def _records(file: FileIO, place: int, size: int) -> Iterator[tuple[int, tuple[Any, ...], bool]]:
    """Place, head and soundness of the numbers of each record up to the first that is torn."""
    while place + HEAD.size <= size:
        file.seek(place)
        raw = file.read(HEAD.size)
        head = HEAD.unpack(raw)
        if head[0] != MARK or zlib.crc32(raw[:-4]) != head[-1] or place + HEAD.size + head[2] > size:
            return
        yield place, head, zlib.crc32(file.read(head[2])) == head[3]
        place += HEAD.size + head[2]


def _packed(made: Buffers) -> bytes:
    """The numbers of a block; of the section points those that there are."""
    there = np.arange(made.points.shape[1]) < made.counts[:, 3:4]
    floats = (made.end, made.sums, made.points[there], made.samples)
    return made.counts.astype("<i8").tobytes() + b"".join(part.astype("<f8").tobytes() for part in floats)


def _unpacked(body: bytes, cells: int, dimension: int, samples: int) -> Buffers:
    counts = np.frombuffer(body, "<i8", cells * 6).reshape(cells, 6).astype(np.int64)
    rest = np.frombuffer(body, "<f8", offset=counts.nbytes).astype(float)
    points = int(counts[:, 3].sum())
    sizes = (cells * dimension, cells * 4, points * (dimension + 1), cells * samples * dimension)
    end, sums, found, tracks = np.split(rest, np.cumsum(sizes)[:-1])
    made = Buffers.empty(cells, dimension, int(counts[:, 3].max(initial=0)), samples)
    made.points[np.arange(made.points.shape[1]) < counts[:, 3:4]] = found.reshape(points, dimension + 1)
    return Buffers(end.reshape(cells, dimension), sums.reshape(cells, 4), counts, made.points,
                   tracks.reshape(made.samples.shape))  # fmt: skip


def _lock(file: FileIO, path: str | os.PathLike[str]) -> None:
    """Keep other processes from writing to the same store; the lock ends with the process, however that ends."""
    try:
        import fcntl
    except ImportError:  # Windows
        return
    try:
        fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        raise BlockingIOError(
            f"{os.fspath(path)} is being written by another run; wait for it or choose another folder"
        ) from None
