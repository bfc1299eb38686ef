"""The language of claims about spectra, one claim a line of text.

chain 4: 0, -2+sqrt(2), -2, -2-sqrt(2)                # the whole spectrum, in any order
star 6: 0, -1^4, -6                                   # ^4: four times
star n=3..12: 0, -1^(n-2), -n                         # every n of a range
torus 9 shape=3x3: 0, -3^4, -6^4                      # options of the family: name=value, without blanks
ring n=3..9: -4*sin(k*pi/n)**2 for k=0..n-1
matrix G.txt: ~-3.414, -2, ~-0.586, 0                 # ~: right if it is the value rounded to its digits
chain 1000000: largest = -4*cos(pi/(2*n))**2, distinct = n    # parts, of graphs of any size: see `parts`
cartesian(chain(2), ring(5)): ratio < 10              # products and unions of families: see `graph_text`
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import sympy as sp

from ..algebra.cosine_sums import AngleSum, expression
from ..algebra.rationals import to_fraction
from ..graphs.families import topology
from ..graphs.graph_text import is_composed, read_graph
from ..graphs.topology import Topology, read_matrix
from ..inputs.checks import short_repr
from .cosine_text import cosine_sum
from .number_text import exact_number, whole_number
from .part_claims import LARGEST, WORDS, PartClaim, interval, is_part, read_part

# Largest file in bytes, and most eigenvalues of a line, counted with multiplicity: choices for seconds of work.
BYTES, REPETITIONS = 1_000_000, 100_000

_OPTIONS = r"((?:\s+[A-Za-z_]\w*=\S+)*)"
_RANGE = re.compile(r"(\w+)\s+n\s*=\s*([0-9]{1,6})\s*\.\.\s*([0-9]{1,6})" + _OPTIONS)
_ONE = re.compile(r"(\w+)\s+([0-9]{1,9})" + _OPTIONS)
_FOR = re.compile(r"(.*\S)\s+for\s+([A-Za-z])\s*=\s*(.+?)\s*\.\.\s*(.+)")
_FORMS = "expected 'chain 4: …', 'star n=3..12: …', 'torus 9 shape=3x3: …' or 'matrix FILE: …'"


@dataclass(frozen=True, slots=True)
class Claimed:
    """One claimed number; exactly one of `exact`, `interval` and `angle` is set."""

    text: str  # the number in messages
    count: int  # claimed multiplicity
    exact: sp.Expr | None = None  # the number, if it is neither a sum of cosines nor an approximation
    interval: tuple[Fraction, Fraction] | None = None  # the numbers that round to an approximation
    angle: AngleSum | None = None  # the number, if it is a sum of cosines

    @property
    def number(self) -> sp.Expr | None:
        """The exact number as a SymPy expression; None for an approximation."""
        return self.exact if self.angle is None else expression(self.angle.risen)

    @property
    def sum(self) -> AngleSum | None:
        """The number as a sum of cosines; None if the number is an approximation or no such sum."""
        if self.exact is not None and self.exact.is_Rational:
            return AngleSum.rational(to_fraction(self.exact))
        return self.angle

    @property
    def words(self) -> str:
        """The number with its decimal value, for a sentence of a message."""
        return self.text if self.angle is None else sp.sstr(self.number)


@dataclass(frozen=True, slots=True)
class Claim:
    """The claimed spectrum of one graph, or claims about parts of its spectrum."""

    line: int  # number of the line in the file
    text: str  # the line
    graph: Topology
    numbers: tuple[Claimed, ...]  # the claimed eigenvalues; none if parts are claimed
    n: int | None = None  # the size, if the line has a range of sizes
    parts: tuple[PartClaim, ...] = ()  # the claims about parts of the spectrum


def read_claims(path: str | Path) -> list[tuple[Claim, ...]]:
    """Read a text file; return a tuple of claims for each line.  The text is parsed, not run."""
    file = Path(path)
    shown = f"claims {short_repr(str(file))}"
    if not file.exists():
        raise FileNotFoundError(f"{shown}: no such file; expected a text file; check the path")
    if not file.is_file() or file.stat().st_size > BYTES:
        raise ValueError(f"{shown}: expected a text file of at most {BYTES} bytes; check the path")
    try:
        lines = file.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise ValueError(f"{shown}: not UTF-8; expected UTF-8 text; save it in that encoding") from None
    claims = []
    for number, line in enumerate(lines, 1):
        if text := line.partition("#")[0].strip():
            try:
                claims.append(_line(number, text, file.parent))
            except (ValueError, TypeError, OSError) as error:
                raise ValueError(f"{file.name}, line {number}: {' '.join(str(error).split())}") from None
    if not claims:
        raise ValueError(f"{shown}: found no claim; {_FORMS}")
    return claims


def _line(number: int, text: str, folder: Path) -> tuple[Claim, ...]:
    """Read a line "GRAPH: NUMBERS" or "GRAPH: PARTS"; return one claim for each size of the graph."""
    head, colon, listed = (part.strip() for part in text.rpartition(":"))
    if not colon or not head:
        raise ValueError(f"found {short_repr(text)}; {_FORMS}")
    largest = None if is_part(listed) else LARGEST

    def claim(graph: Topology, n: int | None = None) -> Claim:
        values = {} if text.startswith("matrix") else {"n": graph.n}  # a matrix has no letter for its size
        if is_part(listed):
            parts = tuple(read_part(part, values) for part in _split(listed, ","))
            return Claim(number, text, graph, (), n, parts)
        numbers = tuple(claimed for entry in _split(listed, ",") for claimed in _entry(entry, values))
        if sum(claimed.count for claimed in numbers) > REPETITIONS:
            raise ValueError(f"found more than {REPETITIONS} eigenvalues; expected as many as the graph has nodes")
        return Claim(number, text, graph, numbers, n)

    if many := _RANGE.fullmatch(head):
        low, high = int(many[2]), int(many[3])
        if not low <= high <= LARGEST:
            raise ValueError(f"found n = {low} … {high}; expected a range that rises and ends at {LARGEST} or before")
        return tuple(claim(_family(many[1], n, many[4], None), n) for n in range(low, high + 1))
    if head.split()[0] == "matrix":
        graph = read_matrix(folder / head[6:].strip())
    elif is_composed(head):
        graph = read_graph(head, largest)
    elif one := _ONE.fullmatch(head):
        graph = _family(one[1], int(one[2]), one[3], largest)
    else:
        raise ValueError(f"found {short_repr(head)} before the colon; {_FORMS}")
    if largest is not None and graph.n > largest:
        raise ValueError(
            f"{graph.name} has {graph.n} nodes; expected at most {largest}; spectra are proved up to there"
        )
    return (claim(graph),)


def _family(name: str, n: int, options_text: str, largest: int | None) -> Topology:
    options: dict[str, str] = {}
    for option in options_text.split():
        key, _, value = option.partition("=")
        if key in options:
            raise ValueError(f"option {key} is given twice; expected it once")
        options[key] = value
    if largest is not None and n > largest:
        raise ValueError(
            f"{name} {n}: expected at most {largest} nodes; claims about all eigenvalues of larger graphs are not proved "
            f"here, but those about parts of them: {', '.join(WORDS)}"
        )
    return topology(name, n, **options)


def _split(text: str, mark: str) -> Iterator[str]:
    """Split a text at each `mark` outside parentheses."""
    depth, begin = 0, 0
    for end, letter in enumerate(text):
        depth += (letter == "(") - (letter == ")")
        if letter == mark and depth == 0:
            yield text[begin:end].strip()
            begin = end + 1
    yield text[begin:].strip()


def _entry(text: str, values: dict[str, int]) -> Iterator[Claimed]:
    """Yield the claimed numbers of an entry such as -2, -1^(n-2) or 2*k for k=0..3."""
    if not text:
        raise ValueError("found an empty entry between commas; expected a number")
    if many := _FOR.fullmatch(text):
        body, letter = many[1], many[2]
        if letter in (*values, "I"):
            raise ValueError(
                f"{short_repr(text)}: the letter {letter!r} has a meaning already; expected another, e.g. k"
            )
        low, high = whole_number(many[3], values), whole_number(many[4], values)
        if high - low > LARGEST:
            raise ValueError(
                f"{short_repr(text)}: found {high - low + 1} values of {letter}; expected at most {LARGEST + 1}"
            )
        for k in range(low, high + 1):
            yield from _entry(body, {**values, letter: k})
        return
    number, *powers = _split(text, "^")
    if len(powers) > 1:
        raise ValueError(
            f"found {short_repr(text)} with {len(powers)} times ^; expected number^multiplicity, ** for powers"
        )
    count = whole_number(powers[0], values) if powers else 1
    if count < 0:
        where = ", ".join(f"{name} = {value}" for name, value in values.items())
        raise ValueError(f"{short_repr(text)}: multiplicity {count}{where and f' for {where}'}; expected at least 0")
    if not count:
        return
    if number.startswith("~"):
        yield Claimed(number, count, interval=interval(number))
    elif (angle := cosine_sum(number, values)) is not None:
        yield Claimed(number, count, angle=angle)
    else:
        exact = exact_number(number, values)
        # Show a number without letters as written in the file.
        shown = number if exact.is_Rational is False and not values else sp.sstr(exact)
        yield Claimed(shown, count, exact=exact)
