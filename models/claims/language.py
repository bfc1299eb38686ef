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
from .cosine_text import angle_number, angle_wave
from .number_text import exact_number, whole_number
from .parts import LARGEST, WORDS, PartClaim, interval, is_part, read_part

BYTES, REPETITIONS = 1_000_000, 100_000
_OPTIONS = r"((?:\s+[A-Za-z_]\w*=\S+)*)"
_RANGE = re.compile(r"(\w+)\s+n\s*=\s*([0-9]{1,6})\s*\.\.\s*([0-9]{1,6})" + _OPTIONS)
_ONE = re.compile(r"(\w+)\s+([0-9]{1,9})" + _OPTIONS)
_FOR = re.compile(r"(.*\S)\s+for\s+([A-Za-z])\s*=\s*(.+?)\s*\.\.\s*(.+)")
_FORMS = "expected 'chain 4: …', 'star n=3..12: …', 'torus 9 shape=3x3: …' or 'matrix FILE: …'"


@dataclass(frozen=True, slots=True)
class Claimed:
    """A number as it was written."""

    text: str  # the number as it was written
    count: int  # how often it is claimed
    exact: sp.Expr | None = None  # the number, if it is neither a sum of cosines nor an approximation
    interval: tuple[Fraction, Fraction] | None = None  # the numbers that round to an approximation
    angle: AngleSum | None = None  # the number, if it is a sum of cosines

    @property
    def number(self) -> sp.Expr | None:
        """The exact number as a SymPy expression; None for an approximation."""
        return self.exact if self.angle is None else expression(self.angle.risen)

    @property
    def sum(self) -> AngleSum | None:
        """The number as a sum of cosines; None if it is not read as one."""
        if self.exact is not None and self.exact.is_Rational:
            return AngleSum.rational(to_fraction(self.exact))
        return self.angle

    @property
    def ends(self) -> tuple[Fraction, Fraction]:
        """The interval of an approximation; ValueError for an exact number."""
        if self.interval is None:
            raise ValueError(f"{self.text} is an exact number; expected an approximation")
        return self.interval

    @property
    def words(self) -> str:
        """The number as a sentence names it."""
        return self.text if self.angle is None else sp.sstr(self.number)


@dataclass(frozen=True, slots=True)
class Claim:
    """The claimed spectrum of one graph, or parts of it."""

    line: int  # number of the line in the file
    text: str  # the line
    graph: Topology
    numbers: tuple[Claimed, ...]  # the claimed eigenvalues; none if parts are claimed
    n: int | None = None  # the size, if the line has a range of sizes
    parts: tuple[PartClaim, ...] = ()  # the claims about parts of the spectrum


def read_claims(path: str | Path) -> list[tuple[Claim, ...]]:
    """Return the claims of a text file; nothing in the file is run."""
    place = Path(path)
    if not place.exists():
        raise FileNotFoundError(f"claims {short_repr(str(place))}: no such file; expected a text file; check the path")
    if not place.is_file() or place.stat().st_size > BYTES:
        raise ValueError(
            f"claims {short_repr(str(place))}: expected a text file of at most {BYTES} bytes; check the path"
        )
    try:
        lines = place.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise ValueError(
            f"claims {short_repr(str(place))}: not UTF-8; expected UTF-8 text; save it in that encoding"
        ) from None
    found = []
    for number, line in enumerate(lines, 1):
        bare = line.partition("#")[0].strip()
        if bare:
            try:
                found.append(_line(number, bare, place.parent))
            except (ValueError, TypeError, OSError) as error:
                raise ValueError(f"{place.name}, line {number}: {' '.join(str(error).split())}") from None
    if not found:
        raise ValueError(f"claims {short_repr(str(place))}: found no claim; {_FORMS}")
    return found


def _line(number: int, text: str, folder: Path) -> tuple[Claim, ...]:
    head, colon, listed = (part.strip() for part in text.rpartition(":"))
    if not colon or not head:
        raise ValueError(f"found {short_repr(text)}; {_FORMS}")
    one, many = _ONE.fullmatch(head), _RANGE.fullmatch(head)
    largest = None if is_part(listed) else LARGEST
    if many:
        low, high = int(many[2]), int(many[3])
        if not low <= high <= LARGEST:
            raise ValueError(f"found n = {low} … {high}; expected a range that rises and ends at {LARGEST} or before")
        return tuple(_claim(number, text, _family(many[1], n, many[4], None), listed, n) for n in range(low, high + 1))
    if head.split()[0] == "matrix":
        graph = read_matrix(folder / head[6:].strip())
    elif is_composed(head):
        graph = read_graph(head, largest)
    elif one:
        graph = _family(one[1], int(one[2]), one[3], largest)
    else:
        raise ValueError(f"found {short_repr(head)} before the colon; {_FORMS}")
    if largest is not None and graph.n > largest:
        raise ValueError(
            f"{graph.name} has {graph.n} nodes; expected at most {largest}; spectra are proved up to there"
        )
    return (_claim(number, text, graph, listed),)


def _claim(number: int, text: str, graph: Topology, listed: str, n: int | None = None) -> Claim:
    """The claim of a line for one graph; the letter n has its size, but for a matrix."""
    values = {} if text.startswith("matrix") else {"n": graph.n}
    if is_part(listed):
        parts = tuple(read_part(part, values) for part in _split(listed, ","))
        return Claim(number, text, graph, (), n, parts)
    return Claim(number, text, graph, _numbers(listed, values), n)


def _family(name: str, n: int, written: str, largest: int | None) -> Topology:
    options: dict[str, str] = {}
    for word in written.split():
        key, _, value = word.partition("=")
        if key in options:
            raise ValueError(f"option {key} is given twice; expected it once")
        options[key] = value
    if largest is not None and n > largest:
        raise ValueError(
            f"{name} {n}: expected at most {largest} nodes; claims about all eigenvalues of larger graphs are not proved "
            f"here, but those about parts of them: {', '.join(WORDS)}"
        )
    return topology(name, n, **options)


def _numbers(listed: str, values: dict[str, int]) -> tuple[Claimed, ...]:
    found = [claimed for part in _split(listed, ",") for claimed in _entry(part, values)]
    if sum(claimed.count for claimed in found) > REPETITIONS:
        raise ValueError(f"found more than {REPETITIONS} eigenvalues; expected as many as the graph has nodes")
    return tuple(found)


def _split(text: str, mark: str) -> Iterator[str]:
    """The parts of a text between marks outside parentheses."""
    depth, begin = 0, 0
    for place, letter in enumerate(text):
        depth += (letter == "(") - (letter == ")")
        if letter == mark and depth == 0:
            yield text[begin:place].strip()
            begin = place + 1
    yield text[begin:].strip()


def _entry(part: str, values: dict[str, int]) -> Iterator[Claimed]:
    """One entry: a number, perhaps with a multiplicity, perhaps for a range of a letter."""
    if not part:
        raise ValueError("found an empty entry between commas; expected a number")
    many = _FOR.fullmatch(part)
    if many:
        body, letter = many[1], many[2]
        if letter in (*values, "I"):
            raise ValueError(
                f"{short_repr(part)}: the letter {letter!r} has a meaning already; expected another, e.g. k"
            )
        low, high = whole_number(many[3], values), whole_number(many[4], values)
        if high - low > LARGEST:
            raise ValueError(
                f"{short_repr(part)}: found {high - low + 1} values of {letter}; expected at most {LARGEST + 1}"
            )
        yield from _each(body, values, letter, range(low, high + 1))
        return
    pieces = list(_split(part, "^"))
    if len(pieces) > 2:
        raise ValueError(
            f"found {short_repr(part)} with {len(pieces) - 1} times ^; expected number^multiplicity, ** for powers"
        )
    count = whole_number(pieces[1], values) if len(pieces) == 2 else 1
    if count < 0:
        raise ValueError(f"{short_repr(part)}: multiplicity {count}{_where(values)}; expected at least 0")
    if count:
        yield _number(pieces[0], count, values)


def _each(body: str, values: dict[str, int], letter: str, places: range) -> Iterator[Claimed]:
    """An entry for each value of a letter; a sum of cosines is read once for all of them."""
    wave = angle_wave(body, values, letter) if places else None
    if wave is None:
        for k in places:
            yield from _entry(body, {**values, letter: k})
    else:
        yield from (Claimed(body, 1, angle=number) for number in wave.at(places[0], places[-1]))


def _where(values: dict[str, int]) -> str:
    return f" for {', '.join(f'{name} = {value}' for name, value in values.items())}" if values else ""


def _number(text: str, count: int, values: dict[str, int]) -> Claimed:
    if not text.startswith("~"):
        angle = angle_number(text, values)
        if angle is not None:
            return Claimed(text, count, angle=angle)
        exact = exact_number(text, values)
        return Claimed(text if exact.is_Rational is False and not values else sp.sstr(exact), count, exact=exact)
    return Claimed(text, count, interval=interval(text))
