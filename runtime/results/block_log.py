"""The file of an unfinished sweep: a log to which each finished block of cells is appended.

A file begins with MAGIC and one line of JSON (length, checksum, text), which describes the sweep.  MAGIC and the line
are written twice, and each copy begins a page of the disk.  One record for each finished block follows: a head with the
number of the block and two checksums, then the numbers of the block, little endian.  No byte is changed in place.  A
process that dies at any moment therefore loses at most the last record; the next process overwrites an incomplete
record.  If a record is damaged, only this record is lost: reading continues at the next mark that begins a head with a
correct checksum.
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
PAGE = 4096  # bytes of a page of the disk, the unit in which damage occurs
LINE = struct.Struct("<QI")
# Head of a record: mark, block, bytes and CRC-32 of the numbers, cells, most section points, counts by status, CRC-32
# of the head.
HEAD = struct.Struct(f"<4sQQIII{CODES}QI")
MARK = b"blk\0"
PIECE = 2**20  # bytes that are read at a time in the search for a mark
MOST = 10**9  # largest number of blocks, states and samples that a log may have: the largest number of cells of a sweep
AGAIN = "start again with overwrite (--overwrite)"
FLUSH = 5.0  # seconds between two flushes to the disk, which protect the file from a loss of power


def is_block_log(path: str | os.PathLike[str]) -> bool:
    """Return True if a file begins like a block log, or ends in .partial and does not begin like a result."""
    try:
        with open_regular(path) as file:
            start = file.read(len(KIND))
    except OSError:
        return False
    return start == KIND or (Path(path).suffix == ".partial" and start[:3] != b"CDF")


class Description(TypedDict):
    """Description of a sweep in JSON types, with which a log can be read without the kernel."""

    attributes: dict[str, Any]  # attributes of the result
    blocks: int
    size: int  # cells in a block
    dimension: int  # states of a cell
    samples: int  # of the trajectory of a cell
    observed: int  # values of observables of a cell
    kept: int  # states in a section point
    merged: list[list[int]] | None  # states and indices of `NodeMerge`
    together: bool
    part: list[int] | None  # k and N of part k of N, None for a whole sweep
    certificate: list[list[float]] | None  # fields of `Certificate`


@dataclass(slots=True)
class BlockLog:
    """An open log of finished blocks."""

    path: Path
    about: Description  # description of the sweep (`synchain.runtime.results.partial.describe_sweep`)
    places: np.ndarray  # (blocks,): offsets of the records of the blocks, -1 for none
    counts: np.ndarray  # (CODES,): how many cells of the stored blocks ended with each status
    _file: FileIO = field(repr=False)
    _end: int
    most: int = 0  # largest number of section points of a cell
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
        """Open a log and find its complete blocks; skip torn and damaged records."""
        file = open_regular(path, writing=writing)
        try:
            if writing:
                _lock(file, path)
            about = _about(file, path)
            places = np.full(about["blocks"], -1, dtype=np.int64)
            log = cls(Path(path), about, places, np.zeros(CODES, np.int64), file, file.tell())
            # Find the records; new records are appended behind the last record with a correct head.
            size = os.fstat(file.fileno()).st_size
            for offset, head, sound in _records(file, log._end, size):
                _, block, length, _, _, most, *statuses, _ = head
                if sound and block < len(log.places):
                    if log.places[block] >= 0:  # a block that was written twice after damage: the later record counts
                        file.seek(int(log.places[block]))
                        log.counts -= np.array(HEAD.unpack(file.read(HEAD.size))[6:-1])
                    log.places[block] = offset
                    log.counts += np.array(statuses)
                    log.most = max(log.most, most)
                log._end = offset + HEAD.size + length
            if writing:
                file.truncate(log._end)  # drop a torn record at the end
        except BaseException:
            file.close()
            raise
        return log

    @property
    def done(self) -> np.ndarray:
        return self.places >= 0

    def append(self, block: int, buffers: Buffers) -> None:
        """Append a finished block; an OSError does not change the log."""
        counts, most = tally(buffers.status), buffers.most_points
        # Unused entries for section points are left out.
        floats = (buffers.end, buffers.sums, buffers.points[_exists(buffers)], buffers.samples)
        body = buffers.counts.astype("<i8").tobytes() + b"".join(part.astype("<f8").tobytes() for part in floats)
        head = HEAD.pack(MARK, block, len(body), zlib.crc32(body), len(buffers.counts), most, *counts.tolist(), 0)
        head = head[:-4] + struct.pack("<I", zlib.crc32(head[:-4]))
        self._file.seek(self._end)
        left = memoryview(head + body)
        while left:  # an unbuffered write may stop early
            left = left[self._file.write(left) :]
        self.places[block], self._end = self._end, self._end + len(head) + len(body)
        self.counts += counts
        self.most = max(self.most, most)
        if time.monotonic() - self._flushed > FLUSH:
            self.flush()

    def flush(self) -> None:
        os.fsync(self._file.fileno())
        self._flushed = time.monotonic()

    def read(self, block: int) -> Buffers:
        """Return the numbers of a stored block; raise OSError if they were damaged since the log was opened."""
        self._file.seek(int(self.places[block]))
        _, _, length, check, cells, most, *_ = HEAD.unpack(self._file.read(HEAD.size))
        body = self._file.read(length)
        if zlib.crc32(body) != check:
            raise OSError(f"{self.path}: block {block} was damaged while it was in use; run again with resume")
        sizes = (int(self.about[name]) for name in ("dimension", "samples", "observed", "kept"))
        buffers = _unpacked(body, cells, most, *sizes)
        if buffers is None:
            raise ValueError(f"{self.path}: block {block} is not as long as its cells need; {AGAIN}")
        return buffers

    def close(self) -> None:
        if not self._file.closed:
            with suppress(OSError):
                if self._file.writable():
                    self.flush()
            with suppress(OSError):
                self._file.close()


def _second(length: int) -> int:
    """Return the offset of the second copy of a first line of `length` bytes: the next page."""
    return -(-length // PAGE) * PAGE


def _about(file: FileIO, path: str | os.PathLike[str]) -> Description:
    """Read the description from its first sound copy, and leave the file at its first record."""
    size = os.fstat(file.fileno()).st_size
    if size == 0:
        raise ValueError(f"{os.fspath(path)} is empty; expected an unfinished run; {AGAIN}")
    starts = set()
    for offset in range(0, size, PAGE):
        file.seek(offset)
        start = file.read(len(MAGIC))
        starts |= {start} if start.startswith(KIND) else set()
        head = file.read(LINE.size) if start == MAGIC else b""
        length, check = LINE.unpack(head) if len(head) == LINE.size else (0, 1)
        text = file.read(min(length, size))
        if zlib.crc32(text) == check:
            first = len(MAGIC) + LINE.size + length
            file.seek(_second(first) + first)
            # Parse the first line as JSON; raise ValueError if a number that the log needs is missing.
            try:
                about = json.loads(text)
            except (ValueError, RecursionError):
                about = None
            names = ("blocks", "dimension", "samples", "observed", "kept")
            if isinstance(about, dict) and all(type(about.get(n)) is int and 0 <= about[n] <= MOST for n in names):
                return cast(Description, about)
            raise ValueError(f"{os.fspath(path)}: its first line does not say what its sweep is; {AGAIN}")
    if not starts:
        raise ValueError(f"{os.fspath(path)} is no unfinished run of synchain; choose another file, or {AGAIN}")
    if MAGIC not in starts:
        raise ValueError(
            f"{os.fspath(path)} was begun by another version of synchain; finish it with that one, or {AGAIN}"
        )
    raise ValueError(f"{os.fspath(path)}: both copies of its first line are damaged; {AGAIN}")


def _records(file: FileIO, offset: int, size: int) -> Iterator[tuple[int, tuple[int, ...], bool]]:
    """Yield offset and head of each record, and True if the checksum of its numbers is correct; skip other bytes."""
    while offset + HEAD.size <= size:
        file.seek(offset)
        raw = file.read(HEAD.size)
        head = HEAD.unpack(raw)
        if head[0] == MARK and zlib.crc32(raw[:-4]) == head[-1] and offset + HEAD.size + head[2] <= size:
            yield offset, head, zlib.crc32(file.read(head[2])) == head[3]
            offset += HEAD.size + head[2]
        else:
            offset = _next_mark(file, offset + 1, size)


def _next_mark(file: FileIO, offset: int, size: int) -> int:
    """Return the offset of the next mark, or the size of the file if there is none."""
    while offset < size:
        file.seek(offset)
        piece = file.read(PIECE)
        index = piece.find(MARK)
        if index >= 0:
            return offset + index
        if len(piece) < len(MARK):
            break
        offset += len(piece) - len(MARK) + 1  # pieces overlap by one byte less than a mark
    return size


def _exists(buffers: Buffers) -> np.ndarray:
    """Return a mask of the section points that exist. Shapes: returns (cells, width of the buffer)."""
    return np.arange(buffers.points.shape[1]) < buffers.point_counts[:, None]


def _unpacked(
    body: bytes, cells: int, most: int, dimension: int, samples: int, observed: int, kept: int
) -> Buffers | None:
    """Return the numbers of a block; None if their count does not fit its cells and their section points."""
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
    """Lock the log against other processes that write; the system releases the lock when the process ends."""
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
