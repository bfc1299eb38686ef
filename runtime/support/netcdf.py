"""Write a netCDF file piece by piece: as large as the disk, with one piece in memory.

The bytes equal the file that SciPy writes for `Result.save`, a netCDF "64-bit offset" file.  The header contains the
offset of each variable; the variables follow, big endian (NetCDF Classic Format Specification, Unidata).  The first
attribute of a result is a digest of the file, computed with zeros in place of the digest.
"""

from __future__ import annotations

import hashlib
import io
import struct
from collections.abc import Mapping
from math import prod
from typing import Any, BinaryIO

import numpy as np
import xarray as xr
from scipy.io import netcdf_file

DIGEST = "digest"  # name of the attribute that holds the SHA-256 of the file, in hexadecimal digits
BLANK = "0" * 64

DIMENSION, VARIABLE, ATTRIBUTE, ABSENT = (struct.pack(">i", tag) for tag in (10, 11, 12, 0))
TYPES = {"b": 1, "c": 2, "h": 3, "i": 4, "l": 4, "f": 5, "d": 6}
PIECE = 2**20  # bytes that are read at a time
# Bytes of the largest variable whose size fits into the header. For a larger variable the header contains 2^32 - 1, and
# readers compute the size from the dimensions.
LARGEST = 2**32 - 4


class Sheet:
    """A file with variables, dimensions and attributes of a template, and with other lengths of some dimensions."""

    def __init__(self, file: BinaryIO, template: xr.Dataset, lengths: Mapping[str, int]) -> None:
        self.file = file
        # SciPy writes the template; the header of this file is the same, with the lengths changed.
        with netcdf_file(
            io.BytesIO(bytes(template.to_netcdf(engine="scipy", format="NETCDF3_64BIT"))), mmap=False
        ) as source:
            self.sizes = {name: lengths.get(name, size) for name, size in source.dimensions.items()}
            shapes = {name: tuple(self.sizes[d] for d in v.dimensions) for name, v in source.variables.items()}
            order = sorted(map(str, template.variables), key=lambda name: shapes[name], reverse=True)
            variables = {name: source.variables[name] for name in order}
            self.types = {name: np.dtype(v.typecode()).newbyteorder(">") for name, v in variables.items()}
            heads = [self._head(name, v, shapes[name]) for name, v in variables.items()]
            first = b"CDF\2" + ABSENT + _dimensions(self.sizes) + _attributes(source._attributes)
            fixed = {name: np.array(v.data) for name, v in variables.items() if not set(v.dimensions) & set(lengths)}
        first += VARIABLE + struct.pack(">i", len(heads))
        # The entry of a variable in the header ends with its offset; variables are padded to four bytes.
        offset = len(first) + sum(len(head) + 8 for head in heads)
        self.begins = {}
        for name, head in zip(order, heads, strict=True):
            first += head + struct.pack(">q", offset)
            self.begins[name] = offset
            offset += -(-int(prod(shapes[name]) * self.types[name].itemsize) // 4) * 4
        file.write(first)
        file.truncate(offset)
        # Variables without a long dimension are already complete.
        for name, values in fixed.items():
            self._write(self.begins[name], np.asarray(values, dtype=self.types[name]))

    def put(self, name: str, rows: np.ndarray, values: np.ndarray) -> None:
        """Write rows of a variable; `rows` index its flattened leading dimensions. Shapes: values (rows, …)."""
        values = np.ascontiguousarray(values, dtype=self.types[name])
        length = values.nbytes // max(len(rows), 1)
        for run in np.split(np.arange(len(rows)), np.flatnonzero(np.diff(rows) != 1) + 1):
            if len(run):
                self._write(self.begins[name] + int(rows[run[0]]) * length, values[run[0] : run[-1] + 1])

    def _write(self, offset: int, values: np.ndarray) -> None:
        self.file.seek(offset)
        self.file.write(values.tobytes())

    def _head(self, name: str, variable: Any, shape: tuple[int, ...]) -> bytes:
        """Return the entry of a variable in the header, without its offset."""
        numbers = [list(self.sizes).index(d) for d in variable.dimensions]
        size = -(-prod(shape) * variable.itemsize() // 4) * 4
        size = size if size <= LARGEST else 2**32 - 1
        parts = [
            _text(name),
            struct.pack(f">i{len(numbers)}i", len(numbers), *numbers),
            _attributes(variable._attributes),
        ]
        return b"".join([*parts, struct.pack(">iI", TYPES[variable.typecode()], size)])


def unsealed(data: xr.Dataset) -> xr.Dataset:
    """Return the data with a placeholder for a digest before the other attributes."""
    copy = data.copy(deep=False)
    copy.attrs = {DIGEST: BLANK, **{name: value for name, value in data.attrs.items() if name != DIGEST}}
    return copy


def seal(file: BinaryIO) -> None:
    """Write the digest into the placeholder of a file of `unsealed` data, open for reading and writing."""
    offset = _digest_offset(file)
    if offset is None:
        raise ValueError("the file has no room for a digest")
    digest = _digest(file, offset)
    file.seek(offset)
    file.write(digest)


def is_sealed(file: BinaryIO) -> bool | None:
    """Return True if a file matches its digest, None if the file has no digest."""
    offset = _digest_offset(file)
    if offset is None:
        return None
    file.seek(offset)
    return file.read(len(BLANK)) == _digest(file, offset)


def _digest_offset(file: BinaryIO) -> int | None:
    """Return the offset of the digest; only the names of the dimensions come before it."""
    file.seek(0)
    head = _text(DIGEST) + struct.pack(">ii", TYPES["c"], len(BLANK))
    index = file.read(PIECE).find(head)
    return None if index < 0 else index + len(head)


def _digest(file: BinaryIO, offset: int) -> bytes:
    """Return the SHA-256 of a file with zeros in place of the digest at `offset`."""
    total, position = hashlib.sha256(), 0
    file.seek(0)
    while piece := bytearray(file.read(PIECE)):
        for k in range(max(offset - position, 0), min(offset + len(BLANK) - position, len(piece))):
            piece[k] = ord("0")
        total.update(piece)
        position += len(piece)
    return total.hexdigest().encode()


def _padded(data: bytes) -> bytes:
    return data + b"\0" * (-len(data) % 4)


def _text(name: str) -> bytes:
    data = name.encode()
    return struct.pack(">i", len(data)) + _padded(data)


def _dimensions(sizes: Mapping[str, int]) -> bytes:
    if not sizes:
        return ABSENT + ABSENT
    return (
        DIMENSION + struct.pack(">i", len(sizes)) + b"".join(_text(n) + struct.pack(">i", s) for n, s in sizes.items())
    )


def _attributes(values: Mapping[str, object]) -> bytes:
    if not values:
        return ABSENT + ABSENT
    return ATTRIBUTE + struct.pack(">i", len(values)) + b"".join(_text(name) + _value(v) for name, v in values.items())


def _value(value: object) -> bytes:
    """Return an attribute as bytes: text, or numbers of any of the types."""
    if isinstance(value, bytes):
        return struct.pack(">ii", TYPES["c"], len(value)) + _padded(value)
    numbers = np.atleast_1d(np.asarray(value))
    kind = numbers.dtype.newbyteorder(">")
    return struct.pack(">ii", TYPES[numbers.dtype.char], numbers.size) + _padded(numbers.astype(kind).tobytes())
