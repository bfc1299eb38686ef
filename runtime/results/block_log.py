"""The file of a sweep that is under way: blocks of finished cells, appended as they come.

A file begins with MAGIC and one JSON line (its length, its checksum, then the text), which says
what the sweep is; both stand there twice, and each copy begins a page of the disk.  Records follow,
one for each finished block: a head with the number of the block and two checksums, then the numbers
themselves, little endian.  Nothing is ever changed in place, so that a process that dies at any
moment leaves whole records and at most one torn one at the end, which is written over.  A damaged
record costs itself alone: reading goes on at the next mark that begins a head with a good checksum.
"""

from __future__ import annotations

import json
import os
import struct
import time
import zlib
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from io import FileIO
from pathlib import Path
from typing import Any, TypedDict, cast

import numpy as np

from synchain.codegen.driver.columns import COUNTS, Count, PointColumn, SumColumn
from synchain.models.inputs.regular_file import open_regular

from ..cells.buffers import Buffers
from ..support.files import whole_file
from ..support.status import CODES, tally

KIND = b"synchain blocks "
MAGIC = KIND + b"3\n"
PAGE = 4096
"""Bytes that a disk loses together."""
LINE = struct.Struct("<QI")
HEAD = struct.Struct(f"<4sQQIII{CODES}QI")
"""Mark, block, bytes and CRC-32 of the numbers, cells, most section points, how many ended how,
CRC-32 of all this.
"""
MARK = b"blk\0"
PIECE = 2**20
"""Bytes that are searched for a mark at a time."""
MOST = 10**9
"""Largest number of blocks, states and samples: that of the cells of a sweep."""
AGAIN = "start again with overwrite (--overwrite)"
FLUSH = 5.0
"""Seconds between two requests to the system that the file be safe from a loss of power as well."""


def is_block_log(path: str | os.PathLike[str]) -> bool:
    """True if a file begins like a log of blocks, or is called one and does not begin like a
    result.
    """
    try:
        with open_regular(path) as file:
            start = file.read(len(KIND))
    except OSError:
        return False
    return start == KIND or (Path(path).suffix == ".partial" and start[:3] != b"CDF")


class Description(TypedDict):
    """What a log says of its sweep, in JSON types, so that it can be read without the kernel.

    The numbers of blocks, of cells in a block, of the states, the samples and the observed values
    of a cell, and of the numbers that a section point keeps; what its reduction merged, and the exponents of a certified run.
    """

    attributes: dict[str, Any]
    blocks: int
    size: int
    dimension: int
    samples: int
    observed: int
    kept: int
    merged: list[list[int]] | None
    together: bool
    certificate: list[list[float]] | None


@dataclass(slots=True)
class BlockLog:
    """An open log of finished blocks."""

    path: Path
    about: Description  # description of the sweep (`synchain.runtime.results.partial.describe_sweep`)
    places: np.ndarray  # (blocks,): offsets of the records of the blocks, -1 for none
    counts: np.ndarray  # (CODES,): how many cells of the stored blocks ended with each status
    _file: FileIO = field(repr=False)
    _end: int
    most: int = 0  # section points of the cell that has most
    _flushed: float = field(default_factory=time.monotonic)

    @staticmethod
    def describe(path: str | os.PathLike[str]) -> Description:
        """Return the description of the sweep, without its blocks; ValueError if it is damaged."""
        with open_regular(path) as file:
            return _about(file, path)

    @staticmethod
    def expect_idle(path: str | os.PathLike[str]) -> None:
        """Raise BlockingIOError if another process writes to the log."""
        with open_regular(path, writing=True) as file:
            _lock(file, path)

    @staticmethod
    def create(path: str | os.PathLike[str], about: Description) -> None:
        """Create a log without blocks; `about` is what JSON can hold and says how many `blocks`
        there are.
        """
        text = json.dumps(about).encode()
        if os.path.exists(path):
            BlockLog.expect_idle(path)
        first = MAGIC + LINE.pack(len(text), zlib.crc32(text)) + text
        with whole_file(path) as temporary, open(temporary, "wb") as file:
            file.write(first + bytes(_second(len(first)) - len(first)) + first)
            file.flush()
            os.fsync(file.fileno())

    @classmethod
    def open(cls, path: str | os.PathLike[str], writing: bool = False) -> BlockLog:
        """Open a log and find its whole blocks; a record that is torn or damaged counts as none."""
        file = open_regular(path, writing=writing)
        try:
            if writing:
                _lock(file, path)
            about = _about(file, path)
            places = np.full(about["blocks"], -1, dtype=np.int64)
            log = cls(Path(path), about, places, np.zeros(CODES, np.int64), file, file.tell())
            log._scan()
            if writing:
                file.truncate(log._end)  # what is torn at the end
        except BaseException:
            file.close()
            raise
        return log

    def _scan(self) -> None:
        """Find the records; the file ends for us behind the last one that has a sound head."""
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

    def append(self, block: int, buffers: Buffers) -> None:
        """Add a finished block; OSError if it cannot be written, after which the log is as it was."""
        counts, most = tally(buffers.status), buffers.most_points
        body = _packed(buffers)
        head = HEAD.pack(MARK, block, len(body), zlib.crc32(body), len(buffers.counts), most, *counts.tolist(), 0)
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
        """Return the numbers of a stored block; OSError if they were damaged since the log was
        opened.
        """
        self._file.seek(int(self.places[block]))
        head = HEAD.unpack(self._file.read(HEAD.size))
        body = self._file.read(head[2])
        if zlib.crc32(body) != head[3]:
            raise OSError(f"{self.path}: block {block} was damaged while it was in use; run again with resume")
        sizes = (int(self.about[name]) for name in ("dimension", "samples", "observed", "kept"))
        made = _unpacked(body, head[4], head[5], *sizes)
        if made is None:
            raise ValueError(f"{self.path}: block {block} is not as long as its cells need; {AGAIN}")
        return made

    def close(self) -> None:
        """Put everything on the disk and close the file."""
        if not self._file.closed:
            with suppress(OSError):
                if self._file.writable():
                    self.flush()
            with suppress(OSError):
                self._file.close()


def _second(length: int) -> int:
    """Where the second copy of a first line of so many bytes begins."""
    return -(-length // PAGE) * PAGE


def _about(file: FileIO, path: str | os.PathLike[str]) -> Description:
    """The description of the sweep, from the first copy that is sound; the file is left at its
    first record.
    """
    size = os.fstat(file.fileno()).st_size
    if size == 0:
        raise ValueError(f"{os.fspath(path)} is empty; expected an unfinished run; {AGAIN}")
    starts = set()
    for place in range(0, size, PAGE):
        file.seek(place)
        start = file.read(len(MAGIC))
        starts |= {start} if start.startswith(KIND) else set()
        head = file.read(LINE.size) if start == MAGIC else b""
        length, check = LINE.unpack(head) if len(head) == LINE.size else (0, 1)
        text = file.read(min(length, size))
        if zlib.crc32(text) == check:
            first = len(MAGIC) + LINE.size + length
            file.seek(_second(first) + first)
            return _understood(text, path)
    if not starts:
        raise ValueError(f"{os.fspath(path)} is no unfinished run of synchain; choose another file, or {AGAIN}")
    if MAGIC not in starts:
        raise ValueError(
            f"{os.fspath(path)} was begun by another version of synchain; finish it with that one, or {AGAIN}"
        )
    raise ValueError(f"{os.fspath(path)}: both copies of its first line are damaged; {AGAIN}")


def _understood(text: bytes, path: str | os.PathLike[str]) -> Description:
    """The first line as JSON that has the numbers that a store needs."""
    try:
        about = json.loads(text)
    except (ValueError, RecursionError):
        about = None
    names = ("blocks", "dimension", "samples", "observed", "kept")
    if isinstance(about, dict) and all(type(about.get(n)) is int and 0 <= about[n] <= MOST for n in names):
        return cast(Description, about)
    raise ValueError(f"{os.fspath(path)}: its first line does not say what its sweep is; {AGAIN}")


def _records(file: FileIO, place: int, size: int) -> Iterator[tuple[int, tuple[int, ...], bool]]:
    """Place, head and soundness of the numbers of each record; what is no record is passed over."""
    while place + HEAD.size <= size:
        file.seek(place)
        raw = file.read(HEAD.size)
        head = HEAD.unpack(raw)
        if head[0] == MARK and zlib.crc32(raw[:-4]) == head[-1] and place + HEAD.size + head[2] <= size:
            yield place, head, zlib.crc32(file.read(head[2])) == head[3]
            place += HEAD.size + head[2]
        else:
            place = _next_mark(file, place + 1, size)


def _next_mark(file: FileIO, place: int, size: int) -> int:
    """The next place that has a mark, the size of the file if there is none."""
    while place < size:
        file.seek(place)
        piece = file.read(PIECE)
        found = piece.find(MARK)
        if found >= 0:
            return place + found
        if len(piece) < len(MARK):
            break
        place += len(piece) - len(MARK) + 1
    return size


def _packed(buffers: Buffers) -> bytes:
    """The numbers of a block; of the section points those that exist."""
    floats = (buffers.end, buffers.sums, buffers.points[_exists(buffers)], buffers.samples)
    return buffers.counts.astype("<i8").tobytes() + b"".join(part.astype("<f8").tobytes() for part in floats)


def _exists(buffers: Buffers) -> np.ndarray:
    """True for each section point (cells, room) that exists."""
    return np.arange(buffers.points.shape[1]) < buffers.point_counts[:, None]


def _unpacked(
    body: bytes, cells: int, most: int, dimension: int, samples: int, observed: int, kept: int
) -> Buffers | None:
    """The numbers of a block; None if there are not as many as its cells need, the most section
    points among them.
    """
    if len(body) < cells * COUNTS * 8:
        return None
    counts = np.frombuffer(body, "<i8", cells * COUNTS).reshape(cells, COUNTS).astype(np.int64)
    lengths = [int(count) for count in counts[:, Count.POINTS]]
    points = sum(lengths)
    sums_of_a_cell = len(SumColumn) + observed
    sizes = (
        cells * dimension,
        cells * sums_of_a_cell,
        points * (PointColumn.STATE + kept),
        cells * samples * dimension,
    )
    if min(lengths, default=0) < 0 or max(lengths, default=0) != most or counts.nbytes + 8 * sum(sizes) != len(body):
        return None
    floats = np.frombuffer(body, "<f8", offset=counts.nbytes).astype(float)
    end, sums, sections, tracks = np.split(floats, np.cumsum(sizes)[:-1])
    buffers = Buffers.empty(cells, dimension, most, samples, 0, kept)
    buffers.counts = counts
    buffers.points[_exists(buffers)] = sections.reshape(points, PointColumn.STATE + kept)
    buffers.end, buffers.sums = end.reshape(cells, dimension), sums.reshape(cells, sums_of_a_cell)
    buffers.samples = tracks.reshape(cells, samples, dimension)
    return buffers


def _lock(file: FileIO, path: str | os.PathLike[str]) -> None:
    """Keep other processes from writing to the same store; the lock ends with the process, however
    that ends.
    """
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
