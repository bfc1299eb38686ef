"""The largest network of a family that can synchronise, from the eigenratio.

The eigenratio is the largest over the smallest non-zero |gamma|. In these families it has a closed form that does not
decrease with the size: chain cot²(π/2n); ring 1/sin²(π/n) for even n, 1/(4 sin²(π/2n)) for odd n; star n; hypercube its
dimension; complete graph 1. The ratios of chain and ring are rational only if cos(π/n), for the even ring cos(2π/n), is
0, ±1/2 or ±1. Interval arithmetic (balls) therefore decides every other comparison with a rational number.

Sources: spectra, Brouwer & Haemers, Spectra of Graphs (Springer, 2012), section 1.4; rational
values, I. Niven, Irrational Numbers, Carus Math. Monographs 11 (1956), corollary 3.12.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction

from flint import arb, fmpq

from synchain.models.algebra.balls import Ball, cotangent, precision
from synchain.models.graphs.families import family as family_plugin
from synchain.models.graphs.families import topology

from .stable_ranges import StableRange, exact_ranges, widen
from .synchronisability import possible


class SizeUnit(StrEnum):
    NODES = "nodes"
    DIMENSION = "dimension"


class Method(StrEnum):
    """The method that determined the largest network."""

    # CLOSED_FORM: no larger network can synchronise. OPEN_RANGE: every connected network can synchronise, because a
    # range starts at alpha = 0 or has no upper end. SEARCH: networks larger than the limit were not tried.

    CLOSED_FORM = "closed form"
    OPEN_RANGE = "open range"
    SEARCH = "search"


@dataclass(frozen=True, slots=True)
class LargestNetwork:
    """The largest network of a family that can synchronise for some sigma > 0."""

    # A size is None if every size can synchronise, and 0 if no network of two nodes or more can.

    family: str  # name of the family
    n: int | None  # largest size for the given ranges
    certain: int | None  # largest size that can synchronise for every choice of the ends within their errors
    possible: int | None  # largest size that can synchronise for some choice of the ends within their errors
    counts: SizeUnit  # what the size counts
    how: Method  # how the size was determined
    limit: int | None = None  # largest number of nodes that the search tried


def largest_network(
    family: str,
    ranges: Sequence[tuple[float, float]],
    errors: Sequence[tuple[float, float]] | None = None,
    limit: int = 64,
) -> LargestNetwork:
    """Find the largest network of a family that can synchronise, decided exactly."""
    # The result holds for all sizes if there is a single range and the eigenratio has a closed form (see CLOSED), or if
    # a range starts at 0 or has no upper end. Otherwise every network up to the limit is tried.
    if limit < 2:
        raise ValueError(f"limit = {limit}; expected at least 2 nodes")
    directed = family_plugin(family).directed
    stated = exact_ranges(ranges, errors)
    sets = [stated, widen(stated, -1), widen(stated, 1)]
    counts = SizeUnit.DIMENSION if family == "hypercube" else SizeUnit.NODES
    if not directed and all(_open(stable) for stable in sets):
        return LargestNetwork(family, None, None, None, counts, Method.OPEN_RANGE)
    if family in CLOSED and all(_open(stable) or len(stable) <= 1 for stable in sets):
        n, certain, most = (_by_ratio(family, stable) for stable in sets)
        return LargestNetwork(family, n, certain, most, counts, Method.CLOSED_FORM)
    n, certain, most = (_by_search(family, stable, limit) for stable in sets)
    return LargestNetwork(family, n, certain, most, counts, Method.SEARCH, limit)


def _open(ranges: Sequence[StableRange]) -> bool:
    """Return True if a range admits every eigenratio: it contains some alpha > 0, and starts at 0 or has no end."""
    return any(r.high is None or (r.low == 0 and r.high > 0) for r in ranges)


def _by_ratio(family: str, ranges: Sequence[StableRange]) -> int | None:
    """Return the largest size by the closed form of the eigenratio."""
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
    # The ratio grows with the size: double until it is too large, then bisect.
    low, high = first, 2 * first
    while _fits(ratio, high, allowed):
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if _fits(ratio, middle, allowed) else (low, middle)
    return low


def _fits(ratio: Callable[[int], Ball], n: int, allowed: Fraction) -> bool:
    """Return True if ratio(n) <= allowed; increase the precision of the balls until they decide."""
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
    """Return cot²(π/2n) = (1 + cos(π/n)) / (1 - cos(π/n))."""
    return {2: 1, 3: 3}.get(n) or cotangent(fmpq(1, 2 * n)) ** 2


def _ring(n: int) -> Ball:
    """Return 4 / (4 sin²(π/n)) for even n; for odd n the numerator is 4 cos²(π/2n)."""
    if n in (3, 4, 6):
        return {3: 1, 4: 2, 6: 4}[n]
    return 1 / (arb.sin_pi_fmpq(fmpq(1, n)) ** 2 if n % 2 == 0 else 4 * arb.sin_pi_fmpq(fmpq(1, 2 * n)) ** 2)


def _itself(n: int) -> Ball:
    return n


# For each family with a closed form: smallest size, and the eigenratio as a function of size (None: always 1).
CLOSED: dict[str, tuple[int, Callable[[int], Ball] | None]] = {
    "chain": (2, _chain),
    "complete": (2, None),
    "hypercube": (1, _itself),
    "ring": (3, _ring),
    "star": (2, _itself),
}


def eigenratio(family: str, n: int) -> Ball:
    """Evaluate the eigenratio of a family in CLOSED."""
    if family not in CLOSED:
        raise ValueError(f"eigenratio of {family!r} has no closed form; known: {', '.join(CLOSED)}")
    least = 1 if family == "hypercube" else 3
    if n < least:
        raise ValueError(f"eigenratio of {family}: size {n}; expected at least {least}")
    ratio = CLOSED[family][1]
    return 1 if ratio is None else ratio(n)


def _by_search(family: str, ranges: Sequence[StableRange], limit: int) -> int | None:
    """Return the largest size up to a limit, by trial of every network."""
    if _open(ranges) and not family_plugin(family).directed:
        return None
    cube = family == "hypercube"
    sizes = range(1, limit.bit_length()) if cube else range(max(2, family_plugin(family).minimum), limit + 1)
    possible_sizes = [size for size in sizes if possible(ranges, topology(family, 2**size if cube else size))]
    return max(possible_sizes, default=0)
