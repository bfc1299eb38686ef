"""Read exact rational numbers, and square tables of rational numbers, from lists, matrices, text and files."""

from __future__ import annotations

import re
from collections.abc import Iterable
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache
from math import lcm
from numbers import Complex, Integral, Rational, Real
from pathlib import Path
from typing import Any

from .checks import check_path, check_printable

FILE_LIMIT = 32 * 2**20  # largest matrix file in bytes, a choice
ROWS = 2000  # most rows of a matrix, a choice; larger graphs can be read as lists of edges

_TEXT = re.compile(r"[+-]?(?:\d+/0*[1-9]\d*|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?)", re.ASCII)
_BY_ZERO = re.compile(r"[+-]?\d+/0+", re.ASCII)
_LONGEST = 1000
_EXPECTED = "expected a rational number such as 1/2, -3 or 0.25"


def rational(entry: Any, where: str) -> Fraction:
    """Return the exact value of a number or a text; a float stands for its shortest decimal."""
    if isinstance(entry, bool):
        raise TypeError(f"{where} is {entry}, a bool; {_EXPECTED}")
    if isinstance(entry, str):
        return _from_text(entry.strip(), where)
    if isinstance(entry, Integral):
        return Fraction(int(entry))
    if getattr(entry, "is_Rational", False):  # SymPy
        return Fraction(int(entry.p), int(entry.q))
    if isinstance(entry, Rational):
        return Fraction(int(entry.numerator), int(entry.denominator))
    if isinstance(entry, (Decimal, Real)) or getattr(entry, "is_Float", False):
        return _from_text(str(entry), where)
    if isinstance(entry, Complex):
        raise ValueError(f"{where} is complex: {entry}; {_EXPECTED}: connectivity is real")
    if hasattr(entry, "free_symbols"):  # another SymPy expression
        raise ValueError(f"{where} is {entry}, not a rational number; {_EXPECTED}")
    raise TypeError(f"{where} is {entry!r}, a {type(entry).__name__}; {_EXPECTED}")


@lru_cache(maxsize=4096)
def _number(text: str) -> Fraction | None:
    """Read a number; None if the text is no number."""
    return Fraction(text) if len(text) <= _LONGEST and _TEXT.fullmatch(text) else None


def _from_text(text: str, where: str) -> Fraction:
    number = _number(text)
    if number is not None:
        return number
    shown = text if len(text) <= 40 else f"{text[:40]}… ({len(text)} characters)"
    if _BY_ZERO.fullmatch(text):
        raise ValueError(f"{where} is {shown}, a division by zero; {_EXPECTED}")
    if text.lstrip("+-").lower() in {"nan", "snan", "inf", "infinity", "oo"}:
        raise ValueError(f"{where} is {shown}, not finite; {_EXPECTED}")
    raise ValueError(f"{where} is {shown!r}, not a number; {_EXPECTED}")


def rational_rows(rows: Any, name: str) -> list[list[Fraction]]:
    """Convert a square table to exact numbers."""
    return [[_entry(entry, name, i, j) for j, entry in enumerate(line)] for i, line in enumerate(square(rows, name))]


def _entry(entry: object, name: str, i: int, j: int) -> Fraction:
    number = _number(entry) if type(entry) is str else None
    return rational(entry, f"{name}: entry ({i + 1}, {j + 1})") if number is None else number


def total(numbers: Iterable[Fraction]) -> Fraction:
    """Add fractions over one common denominator and reduce once; faster for many fractions."""
    terms = list(filter(None, numbers))
    below = lcm(*(x.denominator for x in terms))
    return Fraction(sum(x.numerator * (below // x.denominator) for x in terms), below)


def square(rows: Any, name: str) -> list[list[Any]]:
    """Return the rows of a square table with unchanged entries; ValueError if the table is not square."""
    # A SymPy matrix iterates over its entries, not its rows.
    symbolic = hasattr(rows, "tolist") and not hasattr(rows, "dtype")
    listed = rows.tolist() if symbolic else rows
    if isinstance(listed, (str, bytes)) or not isinstance(listed, Iterable) or hasattr(rows, "tocoo"):
        hint = "; a sparse matrix is read by from_sparse" if hasattr(rows, "tocoo") else ""
        raise TypeError(f"{name} is a {type(rows).__name__}; expected rows of numbers: [[-1, 1], [1, -1]]{hint}")
    lines = []
    for i, line in enumerate(listed):
        if i == ROWS:
            raise _too_large(name)
        if isinstance(line, (str, bytes)) or not isinstance(line, Iterable):
            raise TypeError(f"{name}: row {i + 1} is {line!r}; expected a list of numbers")
        lines.append(list(line))
    if not lines:
        raise ValueError(f"{name} is empty; expected at least one row")
    for i, line in enumerate(lines):
        if len(line) != len(lines):
            raise ValueError(
                f"{name}: row {i + 1} has {len(line)} entries; expected {len(lines)}, as many as there are "
                "rows: a connectivity matrix is square"
            )
    return lines


def _too_large(name: str) -> ValueError:
    return ValueError(
        f"{name} has more than {ROWS} rows or columns; expected at most {ROWS}; give its edges, which are fewer: "
        "read_edges or from_sparse (--edges)"
    )


def file_text(path: str | Path, what: str, expected: str = "a text file") -> tuple[str, str]:
    """Read a file of at most FILE_LIMIT bytes; return its text and its name."""
    file = check_path(what, path)
    check_printable(what, file.name)
    if not file.exists():
        raise FileNotFoundError(f"{what} {str(file)!r} does not exist; expected {expected}: check the path")
    if not file.is_file():
        raise ValueError(f"{what} {str(file)!r} is a folder or device; expected {expected}")
    size = file.stat().st_size
    if size > FILE_LIMIT:
        raise ValueError(
            f"{what} {str(file)!r} has {size} bytes; expected at most {FILE_LIMIT}: larger graphs are made from lists"
        )
    try:
        return file.read_text(encoding="utf-8-sig"), file.name
    except UnicodeDecodeError:
        raise ValueError(f"{what} {str(file)!r} is not UTF-8; expected {expected} in that encoding") from None


def parse_rows(text: str, name: str) -> list[list[str]]:
    """Split the text of a matrix into rows of entries, separated by blanks or commas."""
    # Comments begin with `#`; empty lines are skipped.
    rows: list[list[str]] = []
    for number, line in enumerate(text.splitlines(), 1):
        bare = line.partition("#")[0].strip()
        if not bare:
            continue
        if len(rows) == ROWS:
            raise _too_large(name)
        cells = [cell for part in bare.split(",") for cell in (part.split() or [""])]
        if len(cells) > ROWS:
            raise _too_large(name)
        if "" in cells:
            raise ValueError(f"{name}: line {number} has an empty entry between commas; write 0 for no link")
        rows.append(cells)
    return rows
