"""The largest network of a family that can synchronise, from its eigenratio: how many nodes one stable range carries.

Eigenratios (largest over smallest non-zero |gamma|) that grow with the size of the network, in closed form:
chain cot²(π/2n); ring 1/sin²(π/n) for even n, 1/(4 sin²(π/2n)) for odd n; star n; hypercube its dimension; complete 1.
They follow from the spectra in Brouwer & Haemers, Spectra of Graphs (Springer, 2012), section 1.4.  Those with an angle are
rational only where cos(π/n), for the even ring cos(2π/n), is 0, ±1/2 or ±1 (I. Niven, Irrational Numbers, Carus Math.
Monographs 11, 1956, corollary 3.12), so that balls reduce_scene every other comparison.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction

from flint import arb, fmpq

from synchain.models.algebra.balls import Ball, precision
from synchain.models.graphs.families import family as plugin
from synchain.models.graphs.families import topology

from .stable_ranges import StableRange, exact_ranges, widen
from .synchronisability import possible

__all__ = ["LargestNetwork", "Method", "SizeUnit", "eigenratio", "largest_network"]


class SizeUnit(StrEnum):
    """What the size of a network counts."""

    NODES = "nodes"
    DIMENSION = "dimension"


class Method(StrEnum):
    """How the largest network was found."""

    CLOSED_FORM = "closed form"
    OPEN_RANGE = "open range"
    SEARCH = "search"


@dataclass(frozen=True, slots=True)
class LargestNetwork:
    """The largest network of a family that can synchronise for some sigma > 0.

    `n` holds for the ranges as stated, `certain` for all and `possible` for at least one within their errors: None where
    every size can, 0 where none of two nodes or more.  `counts` says what is counted, "nodes" or "dimension"; `how` is
    "closed form" (no larger network can), "open range" (one that starts at alpha = 0 or has no end carries every connected
    network) or "search", which ended at `limit` and says nothing about larger ones.
    """

    family: str
    n: int | None
    certain: int | None
    possible: int | None
    counts: SizeUnit
    how: Method
    limit: int | None = None


def largest_network(
    family: str,
    ranges: Sequence[tuple[float, float]],
    errors: Sequence[tuple[float, float]] | None = None,
    limit: int = 64,
) -> LargestNetwork:
    """The largest n (hypercubes: dimension) for which a family of graphs can synchronise, decided exactly.

    `ranges` and `errors` as of `windows`.  One range and a closed form of the eigenratio (see CLOSED), or a range that
    starts at 0 or has no end, give an answer for all n; otherwise every network of up to `limit` nodes is tried.
    Raises ValueError for an unknown family, wrong ranges, or a limit below 2.
    """
    if limit < 2:
        raise ValueError(f"limit = {limit}; expected at least 2 nodes")
    directed = plugin(family).directed
    given = exact_ranges(ranges, errors)
    sets = [given, widen(given, -1), widen(given, 1)]
    counts = SizeUnit.DIMENSION if family == "hypercube" else SizeUnit.NODES
    if not directed and all(_open(found) for found in sets):
        return LargestNetwork(family, None, None, None, counts, Method.OPEN_RANGE)
    if family in CLOSED and all(_open(found) or len(found) <= 1 for found in sets):
        n, certain, most = (_by_ratio(family, found) for found in sets)
        return LargestNetwork(family, n, certain, most, counts, Method.CLOSED_FORM)
    n, certain, most = (_by_search(family, found, limit) for found in sets)
    return LargestNetwork(family, n, certain, most, counts, Method.SEARCH, limit)


def _open(ranges: Sequence[StableRange]) -> bool:
    """True where one range holds every eigenratio: some alpha > 0, from 0 or without end."""
    return any(r.high is None or (r.low == 0 and r.high > 0) for r in ranges)


def _by_ratio(family: str, ranges: Sequence[StableRange]) -> int | None:
    if _open(ranges):
        return None
    if not ranges or ranges[0].high is None or ranges[0].high == 0:
        return 0
    allowed = ranges[0].high / ranges[0].low
    first, ratio = CLOSED[family]
    if ratio is None:
        return None
    if ratio is _itself:
        return max(first, allowed.numerator // allowed.denominator)
    low, high = first, 2 * first
    while _fits(ratio, high, allowed):
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if _fits(ratio, middle, allowed) else (low, middle)
    return low


def _fits(ratio: Callable[[int], Ball], n: int, allowed: Fraction) -> bool:
    """True where the ratio at n is at most the one allowed; balls are refined until they tell."""
    bound, bits = fmpq(allowed.numerator, allowed.denominator), 64
    while True:
        with precision(bits + 4 * n.bit_length()):
            value = ratio(n)
            if isinstance(value, int):
                return bool(value <= bound)
            if value < arb(bound) or value > arb(bound):
                return bool(value < arb(bound))
        bits *= 2


def _chain(n: int) -> Ball:
    """cot²(π/2n), which is (1 + cos(π/n)) / (1 - cos(π/n))."""
    return {2: 1, 3: 3}.get(n) or _cotangent(fmpq(1, 2 * n)) ** 2


def _cotangent(turn: fmpq) -> arb:
    return arb.cos_pi_fmpq(turn) / arb.sin_pi_fmpq(turn)


def _ring(n: int) -> Ball:
    """4 / (4 sin²(π/n)) for even n; for odd n the largest is 4 cos²(π/2n)."""
    if n in (3, 4, 6):
        return {3: 1, 4: 2, 6: 4}[n]
    return 1 / (arb.sin_pi_fmpq(fmpq(1, n)) ** 2 if n % 2 == 0 else 4 * arb.sin_pi_fmpq(fmpq(1, 2 * n)) ** 2)


def _itself(n: int) -> Ball:
    return n


CLOSED: dict[str, tuple[int, Callable[[int], Ball] | None]] = {
    "chain": (2, _chain),
    "complete": (2, None),
    "hypercube": (1, _itself),
    "ring": (3, _ring),
    "star": (2, _itself),
}
"""Families whose eigenratio grows with the size: the smallest size, and the ratio by size (None: always 1)."""


def eigenratio(family: str, n: int) -> Ball:
    """The eigenratio of a family in CLOSED at size n >= 3 (hypercubes: dimension n >= 1): an int, or a flint.arb ball.

    Raises ValueError for a family without a closed form and for a smaller size.
    """
    if family not in CLOSED:
        raise ValueError(f"eigenratio of {family!r} has no closed form; known: {', '.join(CLOSED)}")
    least = 1 if family == "hypercube" else 3
    if n < least:
        raise ValueError(f"eigenratio of {family}: size {n}; expected at least {least}")
    ratio = CLOSED[family][1]
    return 1 if ratio is None else ratio(n)


def _by_search(family: str, ranges: Sequence[StableRange], limit: int) -> int | None:
    if _open(ranges) and not plugin(family).directed:
        return None
    cube = family == "hypercube"
    sizes = range(1, limit.bit_length()) if cube else range(max(2, plugin(family).minimum), limit + 1)
    found = [size for size in sizes if possible(ranges, topology(family, 2**size if cube else size))]
    return max(found, default=0)
