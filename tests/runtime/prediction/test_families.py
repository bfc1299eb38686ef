"""The largest network of a family: closed forms against spectra, bisection against brute force, exact ties."""

from __future__ import annotations

import math

import mpmath
import pytest
from flint import arb

from synchain.models.graphs.families import topology
from synchain.runtime.prediction.largest_networks import CLOSED, eigenratio, largest_network
from synchain.runtime.prediction.synchronisability import verdict


def graph(family: str, size: int):
    return topology(family, 2**size if family == "hypercube" else size)


def brute(family: str, ranges, last: int) -> int:
    first = CLOSED[family][0]
    return max((n for n in range(first, last + 1) if verdict(ranges, graph(family, n)).answer == "yes"), default=0)


@pytest.mark.parametrize("family", sorted(CLOSED))
def test_closed_eigenratios_are_those_of_the_spectra_and_never_fall(family: str) -> None:
    sizes = range(1, 9) if family == "hypercube" else range(3, 41)
    before = 0.0
    for n in sizes:
        values = [abs(v) for v in graph(family, n).spectrum.values[1:]]
        ratio = eigenratio(family, n)
        assert float(ratio) == pytest.approx(max(values) / min(values), rel=1e-13)
        assert float(ratio) >= before
        before = float(ratio)


@pytest.mark.parametrize("family", sorted(CLOSED))
def test_rational_eigenratios_are_whole_numbers_and_only_those(family: str) -> None:
    """Balls never decide equality, so every rational ratio must come as an int."""
    for n in range(3, 60):
        ratio = eigenratio(family, n)
        if isinstance(ratio, arb):
            assert abs(float(ratio) - round(float(ratio))) > 1e-6


@pytest.mark.parametrize("family", sorted(set(CLOSED) - {"complete"}))
@pytest.mark.parametrize("high", [1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 5.9, 6.0])
def test_bisection_agrees_with_every_size_tried(family: str, high: float) -> None:
    largest = largest_network(family, [(1.0, high)])
    assert (largest.how, largest.limit) == ("closed form", None)
    assert largest.n == largest.certain == largest.possible == brute(family, [(1.0, high)], 9)


@pytest.mark.parametrize(
    ("family", "n", "ratio"), [("chain", 3, 3), ("ring", 4, 2), ("ring", 6, 4), ("star", 17, 17), ("hypercube", 9, 9)]
)
def test_exact_ties_count_and_the_next_smaller_float_does_not(family: str, n: int, ratio: int) -> None:
    assert largest_network(family, [(1.0, float(ratio))]).n == n
    assert largest_network(family, [(1.0, math.nextafter(ratio, 0))]).n == n - 1


@pytest.mark.parametrize(("p", "q", "n"), [(4, 1, 4), (9, 2, 5)])
def test_quotients_of_floats_close_to_the_eigenratio_are_decided(p: int, q: int, n: int) -> None:
    """Chain of 5: cot²(π/10) = 5 + 2 sqrt(5); times 9 + 2 sqrt(20), p² - 20 q² stays -4 (below) or 1 (above)."""
    while 40 * (5 * q + p) < 2**53:
        p, q = 9 * p + 40 * q, 2 * p + 9 * q
        assert largest_network("chain", [(float(q), float(5 * q + p))]).n == n
    assert abs(p * p - 20 * q * q) <= 4
    assert q > 10**12


def test_a_long_chain_is_counted_to_the_node() -> None:
    """Chain: cot²(π/2n) <= R, that is n <= π / (2 atan(1/√R)), here with 60 digits."""
    with mpmath.workdps(60):
        for high in (1e6, 12345.678e9, 1e30, 1e200):
            with mpmath.workdps(250):
                expected = int(mpmath.floor(mpmath.pi / (2 * mpmath.atan(1 / mpmath.sqrt(mpmath.mpf(high))))))
            assert largest_network("chain", [(1.0, high)]).n == expected


def test_the_two_rossler_zeros_give_the_sizes_of_each_family() -> None:
    """(0.1863, 4.6131), ratio 24.8 (Rössler a = b = 0.2, c = 9, x to x): n by hand from the closed forms."""
    ranges = [(0.1863, 4.6131)]
    assert largest_network("chain", ranges).n == math.floor(math.pi / 2 / math.atan(math.sqrt(0.1863 / 4.6131)))
    assert largest_network("star", ranges).n == 24
    largest = largest_network("hypercube", ranges)
    assert (largest.n, largest.counts) == (24, "dimension")
    ratio = 4.6131 / 0.1863
    odd = [n for n in range(3, 99, 2) if 1 / (4 * math.sin(math.pi / 2 / n) ** 2) <= ratio]
    even = [n for n in range(4, 99, 2) if 1 / math.sin(math.pi / n) ** 2 <= ratio]
    assert largest_network("ring", ranges).n == max(odd + even)


def test_errors_give_a_certain_and_a_possible_size() -> None:
    largest = largest_network("star", [(1.0, 10.5)], [(0.1, 0.5)])
    assert (largest.n, largest.certain, largest.possible) == (10, math.floor(10.0 / 1.1), math.floor(11.0 / 0.9))
    assert largest_network("star", [(1.0, 1.1)], [(0.2, 0.2)]).certain == 0
    assert largest_network("star", [(0.1, 1.0)], [(0.1, 0.0)]).possible is None


@pytest.mark.parametrize(
    ("family", "ranges", "how"),
    [
        ("complete", [(1.0, 1.0)], "closed form"),
        ("chain", [(0.0, 0.5)], "open range"),
        ("tree", [(0.3, math.inf)], "open range"),
        ("grid", [(-1.0, 0.5), (3.0, 4.0)], "open range"),
    ],
)
def test_every_size_is_none(family: str, ranges, how: str) -> None:
    largest = largest_network(family, ranges)
    assert (largest.n, largest.certain, largest.possible, largest.how) == (None, None, None, how)


def test_other_families_are_searched_to_the_limit_beyond_gaps() -> None:
    """Sums of two chains: 2x2 has the ratio 2, 2x3 5, 3x3 6, 2x4 9.2, 2x5 14.1; 5 and 7 nodes make a chain."""
    largest = largest_network("grid", [(1.0, 6.0)], limit=10)
    assert (largest.n, largest.how, largest.limit) == (9, "search", 10)
    assert verdict([(1.0, 6.0)], topology("grid", 8)).answer == "no"


def test_several_ranges_are_searched() -> None:
    """Star: sigma in [1, 2] and n sigma <= 7, so n <= 7; cubes: 2, 4, 6 sigma are 1, 2, 3 at 0.5, and 8 sigma is lost."""
    largest = largest_network("star", [(1.0, 2.0), (6.0, 7.0)], limit=12)
    assert (largest.n, largest.how) == (7, "search")
    assert largest_network("hypercube", [(1.0, 2.1), (2.9, 3.1)], limit=16).n == 3


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: largest_network("rnig", [(1.0, 2.0)]), "unknown topology 'rnig'"),
        (lambda: largest_network("chain", [(1.0, 2.0)], limit=1), "limit = 1; expected at least 2 nodes"),
        (lambda: largest_network("chain", [(2.0, 1.0)]), "stable range 1"),
        (lambda: eigenratio("grid", 4), "no closed form; known: chain"),
        (lambda: eigenratio("star", 2), "size 2; expected at least 3"),
    ],
)
def test_wrong_requests_are_refused(call, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()
