"""Read and decide claims about parts of a spectrum, for graphs of any size.

Example: chain 1000000: largest = -4*cos(pi/(2*n))**2.

largest                 the eigenvalue of largest modulus
slowest                 the non-zero eigenvalue of smallest modulus
ratio                   largest / slowest, for real eigenvalues
distinct                the number of distinct eigenvalues
multiplicity(number)    the multiplicity of a number, 0 if the number is no eigenvalue

A claim is a part, a relation (=, <, >, <= or >=) and an exact number.  After = the number may be an
approximation such as ~-3.414; after the other relations it may be a decimal, which counts as exact.
All comparisons are exact.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, reduce
from operator import eq, ge, gt, le, lt
from typing import TypeAlias, TypeVar

import sympy as sp
from flint import arb

from ..algebra.cosine_sums import AngleSum, expression, read
from ..algebra.equality import Number, equal, sign
from ..algebra.lazy import LazyEigenvalues
from ..algebra.roots import Root
from ..graphs.families import family, topology
from ..graphs.graph_products import factors
from ..graphs.topology import Topology
from ..spectra.eigenvalue import Eigenvalue, words
from ..spectra.solve import Proof, has_closed_form, spectrum
from ..spectra.spectrum import Spectrum
from .cosine_text import cosine_sum
from .number_text import exact_number

# Most nodes of a graph whose spectrum is proved here, a choice: proofs of larger closed forms take seconds.
LARGEST = 500

# Most nodes of a graph whose eigenvalues are listed, a choice (a few seconds). The limit does not apply if the distinct
# eigenvalues are few or computed one by one.
LISTED = 5000

WORDS = ("largest", "slowest", "ratio", "distinct", "multiplicity")
T = TypeVar("T", bound=Number)

Exact: TypeAlias = AngleSum | sp.Expr
Value: TypeAlias = AngleSum | Number

_PART = re.compile(rf"({'|'.join(WORDS)})\b\s*(.*?)\s*(<=|>=|==?|<|>)\s*(.+)")
_ROUNDED = re.compile(r"~\s*([+-]?[0-9]{1,40}(?:\.[0-9]{1,60})?(?:[eE][+-]?[0-9]{1,3})?)")
_DECIMAL = re.compile(r"[+-]?[0-9]{1,40}\.[0-9]{1,60}")


@dataclass(frozen=True, slots=True)
class PartClaim:
    text: str  # the claim in the file
    word: str  # one of WORDS
    relation: str  # one of = < > <= >=
    number: Exact | None = None  # the exact number after the relation
    interval: tuple[Fraction, Fraction] | None = None  # or the numbers that round to the approximation
    of: Exact | None = None  # the number whose multiplicity is claimed


def is_part(text: str) -> bool:
    """Return whether a text is a claim about a part: begins with a word of WORDS."""
    return re.match(rf"({'|'.join(WORDS)})\b", text) is not None


def read_part(text: str, values: Mapping[str, int]) -> PartClaim:
    """Read a claim such as "ratio < 37.9"."""
    match = _PART.fullmatch(text)
    if match is None:
        raise ValueError(f"found {text[:60]!r}; expected e.g. largest = -4, ratio < 37.9 or multiplicity(-2) = 3")
    word, inner, relation, right = match.groups()
    relation = "=" if relation == "==" else relation
    of = None
    if word == "multiplicity":
        if not (inner.startswith("(") and inner.endswith(")")):
            raise ValueError(f"found {text[:60]!r}; expected a number in parentheses, e.g. multiplicity(-2) = 3")
        of = exact(inner[1:-1], values)
    elif inner:
        raise ValueError(f"found {inner[:40]!r} behind {word}; expected one of = < > <= >=")
    if right.startswith("~"):
        if relation != "=":
            raise ValueError(f"found {text[:60]!r}; expected an approximation behind = only; leave out the ~")
        return PartClaim(text, word, relation, interval=interval(right), of=of)
    if relation != "=" and _DECIMAL.fullmatch(right):
        return PartClaim(text, word, relation, AngleSum.rational(Fraction(right)), of=of)
    return PartClaim(text, word, relation, exact(right, values), of=of)


def exact(text: str, values: Mapping[str, int]) -> Exact:
    """Read a number as a sum of cosines if possible, else as a SymPy expression."""
    angle = cosine_sum(text, values)
    if angle is None:
        number = exact_number(text, values)
        angle = read(number)
        return number if angle is None else angle
    return angle


def interval(text: str) -> tuple[Fraction, Fraction]:
    """Return the interval of the numbers that round to an approximation such as ~-3.414."""
    rounded = _ROUNDED.fullmatch(text)
    if not rounded:
        raise ValueError(f"unreadable approximation {text[:60]!r}; expected ~ and a real decimal, e.g. ~-3.414")
    mantissa, _, exponent = rounded[1].lower().partition("e")
    power = int(exponent or 0) - len(mantissa.partition(".")[2])
    value, half = Fraction(rounded[1]), Fraction(10) ** power / 2
    return value - half, value + half


_RELATIONS: dict[str, Callable[[int, int], bool]] = {"=": eq, "<": lt, ">": gt, "<=": le, ">=": ge}


def verify_parts(graph: Topology, parts: Sequence[PartClaim]) -> tuple[tuple[str, ...], bool, str]:
    """Compare claimed parts with the spectrum of a graph."""
    # Chains, rings, grids, tori and Cartesian products of families need no list of eigenvalues: extreme eigenvalues are
    # sums of extreme eigenvalues of the factors. Other closed forms are listed up to LISTED nodes.
    true_parts = _Parts(graph)
    problems, right = [], []
    for part in parts:
        holds, value = _compare(part, true_parts)
        subject = part.word if part.of is None else f"{part.word}({sp.sstr(_expression(part.of))})"
        right.append(f"{subject} = {value}")
        if not holds:
            problems.append(f"claimed {part.text}: {subject} is {value}")
    return tuple(problems), graph.n <= LARGEST, ", ".join(dict.fromkeys(right))


@dataclass
class _Parts:
    """The true parts of a graph's spectrum, each computed on first use."""

    graph: Topology

    @cached_property
    def spectrum(self) -> Spectrum:
        """The whole spectrum, proved up to LARGEST nodes."""
        n = self.graph.n
        if n > LARGEST and not has_closed_form(self.graph):
            raise ValueError(f"{self.graph.name} {n}: a graph without a closed form; expected at most {LARGEST} nodes")
        if n > LISTED and not _is_short(self.graph):
            raise ValueError(
                f"{self.graph.name} {n}: expected at most {LISTED} nodes for this part of the spectrum of this graph"
            )
        return spectrum(self.graph, Proof.EXACT if n <= LARGEST else Proof.NONE)

    @cached_property
    def axes(self) -> tuple[Topology, ...]:
        """The factors of a large graph that is a Cartesian product; for any other graph the graph alone."""
        return tuple(_axes(self.graph)) if self.graph.n > LARGEST else (self.graph,)

    @cached_property
    def largest(self) -> Value:
        """The eigenvalue of largest modulus; for a product the sum of the largest eigenvalues of the factors."""
        if len(self.axes) == 1:
            return _value(self.spectrum.largest)
        return sum((_sum(axis.spectrum.largest) for axis in self.axes), AngleSum.rational(0))

    @cached_property
    def slowest(self) -> Value:
        """The non-zero eigenvalue of smallest modulus; for a product the smallest one of all factors."""
        if len(self.axes) == 1:
            return _value(self.spectrum.slowest)
        return reduce(lambda a, b: b if _order(b, a) > 0 else a, [_sum(axis.spectrum.slowest) for axis in self.axes])

    def multiplicity(self, number: Exact) -> int:
        """Return the multiplicity of a number, 0 if the number is no eigenvalue."""
        eigenvalues = self.spectrum.eigenvalues
        low, high = 0, len(eigenvalues)
        if isinstance(eigenvalues, LazyEigenvalues):  # sorted in descending order: bisect, then compare two neighbours
            while low < high:
                middle = (low + high) // 2
                if _order(_value(eigenvalues[middle].exact), number) > 0:
                    low = middle + 1
                else:
                    high = middle
            low, high = max(low - 1, 0), low + 2
        return sum(e.multiplicity for e in eigenvalues[low:high] if _is_equal(e, number))


def _axes(graph: Topology) -> Iterator[Topology]:
    """Yield the factors of a Cartesian product, without factors of one node."""
    # A product is factored if both factors have a short spectrum without positive eigenvalues.
    pair = factors(graph)
    if graph.name in ("grid", "torus") and (sides := family(graph.name).sides):
        shape = dict(graph.options).get("shape")
        sizes = shape if isinstance(shape, tuple) else sides(graph.n)
        yield from (topology("ring" if graph.name == "torus" else "chain", size) for size in sizes if size > 1)
    elif pair is None or not all(_is_short(axis) for part in pair for axis in _axes(part)):
        yield graph
    else:
        yield from (axis for part in pair for axis in _axes(part) if axis.n > 1)


def _is_short(graph: Topology) -> bool:
    """Return whether a closed form has few distinct eigenvalues, or computes eigenvalues one by one."""
    return graph.name in ("chain", "ring", "complete", "complete_bipartite", "star", "hypercube", "feed_forward")


def _compare(part: PartClaim, true_parts: _Parts) -> tuple[bool, str]:
    """Return (whether the claim holds, true value of the part as text)."""
    one = AngleSum.rational(1)
    if part.word in ("distinct", "multiplicity"):
        of = part.of if part.of is not None else AngleSum.rational(0)
        count = len(true_parts.spectrum) if part.word == "distinct" else true_parts.multiplicity(of)
        return _holds(part, AngleSum.rational(count), one), str(count)
    if part.word == "ratio":
        value, unit = true_parts.largest, true_parts.slowest
        # Show the ratio of rational eigenvalues as a fraction, of other real ones as a decimal.
        if isinstance(value, AngleSum) and isinstance(unit, AngleSum) and not (value.terms or unit.terms):
            shown = str(value.shift / unit.shift)
        elif _is_complex(value) or _is_complex(unit):
            shown = "complex"
        else:
            top, bottom = (Eigenvalue(_expression(x), 1).enclosure(128) for x in (value, unit))
            shown = f"{float(arb(top) / arb(bottom)):.12g}"
        return _holds(part, value, unit), shown
    value = true_parts.largest if part.word == "largest" else true_parts.slowest
    if _is_complex(value) and part.relation == "=" and part.number is not None:
        holds = equal(_expression(value), _expression(part.number))
    else:
        holds = _holds(part, value, one)
    return holds, words(Eigenvalue(_expression(value), 1))


def _holds(part: PartClaim, value: Value, unit: Value) -> bool:
    """Return whether the claim holds for value / unit; the unit is the slowest eigenvalue for a ratio, else 1."""
    if _is_complex(value) or _is_complex(unit):
        raise ValueError(f"{part.text}: complex eigenvalues have no order; expected = and an exact number")
    if part.interval is not None:
        low, high = (AngleSum.rational(end) for end in part.interval)
        return _quotient_order(value, unit, low) >= 0 >= _quotient_order(value, unit, high)
    if part.number is None:
        raise ValueError(f"{part.text}: expected a number")
    return _RELATIONS[part.relation](_quotient_order(value, unit, part.number), 0)


def _quotient_order(value: Value, unit: Value, number: Exact) -> int:
    """Return the sign of value / unit - number."""
    if unit == AngleSum.rational(1):
        return _order(value, number)
    if isinstance(value, AngleSum) and isinstance(unit, AngleSum) and isinstance(number, AngleSum):
        return (value + -(number * unit)).sign() * unit.sign()
    return sign((_expression(value),), (_expression(number), _expression(unit))) * _order(unit, AngleSum.rational(0))


def _order(value: Value, number: Exact) -> int:
    """Return the sign of value - number."""
    if isinstance(value, AngleSum) and isinstance(number, AngleSum):
        return (value + -number).sign()
    return sign((_expression(value),), (_expression(number),))


def _is_equal(e: Eigenvalue, number: Exact) -> bool:
    middle = complex(sp.N(_expression(number), 20))
    if abs(complex(e.value) - middle) > 1e-9 * max(1.0, abs(middle)):  # floats this far apart are different numbers
        return False
    value = _value(e.number)
    if isinstance(value, AngleSum) and isinstance(number, AngleSum):
        return (value + -number).sign() == 0
    return equal(e.number, _expression(number))


def _value(number: Number) -> Value:
    """Convert an eigenvalue to a sum of cosines if possible."""
    angle = None if isinstance(number, Root) else read(number)
    return number if angle is None else angle


def _sum(number: sp.Expr) -> AngleSum:
    angle = read(number)
    if angle is None:
        raise ValueError(f"{number} is no sum of cosines; expected one of a chain or ring")
    return angle


def _expression(value: AngleSum | T) -> sp.Expr | T:
    """Convert a sum of cosines to an expression; return any other value unchanged."""
    return expression(value.risen) if isinstance(value, AngleSum) else value


def _is_complex(value: Value) -> bool:
    return not isinstance(value, AngleSum) and isinstance(Eigenvalue(value, 1).value, complex)
