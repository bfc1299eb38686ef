"""Networks with one-way links against stable regions of the complex plane whose windows are known in closed form."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from catalogue import nameless_one_way_ring

from synchain.graphs import Topology, topology
from synchain.runtime.prediction.intervals import intersect
from synchain.runtime.prediction.synchronisability import windows, windows_complex

ONE = Fraction(1)
GRID = np.linspace(0.0, 3.0, 301)


def disc(alpha: np.ndarray) -> np.ndarray:
    return np.abs(alpha - 1.0) <= 0.8


@pytest.mark.parametrize("n", [3, 4, 5])
def test_a_disc_and_a_one_way_ring(n: int) -> None:
    """alpha = sigma (1 - w), w the n-th roots of unity: |sigma z - 1| <= 0.8 is a quadratic in sigma for each z = 1 - w."""
    expected = [(0.0, 9.0)]
    for k in range(1, n):
        z = 1 - np.exp(2j * np.pi * k / n)
        a, b = abs(z) ** 2, z.real
        root = b * b - a * (1 - 0.64)
        assert root > 0 or n == 5
        expected = intersect(expected, [((b - root**0.5) / a, (b + root**0.5) / a)] if root > 0 else [])
    windows = windows_complex(disc, nameless_one_way_ring(n), GRID, 1e-6).windows
    assert [(w.low, w.high) for w in windows] == [pytest.approx(pair, abs=1e-6) for pair in expected]
    assert len(windows) == (n < 5)
    for w in windows:
        assert (w.low_error, w.high_error) == (5e-7, 5e-7)
        assert w.low_mode is not None
        assert w.high_mode is not None


def test_the_modes_lost_first_are_named_and_only_upper_alpha_is_asked_for() -> None:
    """The ring of 4 has z = 1 ∓ i and 2: Re alpha <= 1.5 ends at 0.75 by z = 2, Im alpha <= 0.5 at 0.5 by z = 1 ± i."""
    seen = []

    def wide(alpha: np.ndarray) -> np.ndarray:
        seen.append(alpha)
        return alpha.real <= 1.5

    (window,) = windows_complex(wide, nameless_one_way_ring(4), GRID, 1e-7).windows
    assert (window.low, window.low_error, window.low_mode) == (0.0, 0.0, None)
    assert window.high == pytest.approx(0.75, abs=1e-7)
    assert window.high_mode is not None
    assert window.high_mode.eigenvalue.number == -2
    assert all(np.all(alpha.imag >= 0) for alpha in seen)
    (narrow,) = windows_complex(lambda alpha: alpha.imag <= 0.5, nameless_one_way_ring(4), GRID, 1e-7).windows
    assert narrow.high == pytest.approx(0.5, abs=1e-7)
    assert narrow.high_mode is not None
    assert narrow.high_mode.eigenvalue.value == pytest.approx(-1 - 1j)


def test_a_feed_forward_chain_keeps_the_condition_on_its_eigenvalue_and_is_called_defective() -> None:
    chain = Topology("feed-forward", 5, tuple((i, i - 1, ONE) for i in range(1, 5)))
    result = windows_complex(lambda alpha: (alpha.real >= 0.3) & (alpha.real <= 1.7), chain, GRID, 1e-7)
    assert [(w.low, w.high) for w in result.windows] == [pytest.approx((0.3, 1.7), abs=1e-7)]
    assert [(m.eigenvalue.number, m.multiplicity) for m in result.defective] == [(-1, 4)]
    assert windows_complex(disc, nameless_one_way_ring(4), GRID, 1e-3).defective == ()


@pytest.mark.parametrize("graph", [topology("chain", 5), topology("star", 4), topology("grid", 6)])
def test_real_spectra_give_the_windows_of_real_ranges(graph: Topology) -> None:
    ranges = [(0.2, 2.5), (2.9, 4.0)]

    def stable(alpha: np.ndarray) -> np.ndarray:
        assert np.all(alpha.imag == 0)
        return np.logical_or.reduce([(a <= alpha.real) & (alpha.real <= b) for a, b in ranges])

    expected = windows(ranges, graph)
    found = windows_complex(stable, graph, GRID, 1e-8).windows
    assert [(w.low, w.high) for w in found] == [pytest.approx((w.low, w.high), abs=1e-8) for w in expected]
    assert [(w.low_mode, w.high_mode) for w in found] == [(w.low_mode, w.high_mode) for w in expected]


def test_parts_that_nothing_couples_ask_for_stability_at_zero() -> None:
    pairs = Topology("two pairs", 4, ((0, 1, ONE), (1, 0, ONE), (2, 3, ONE), (3, 2, ONE)))
    assert windows_complex(lambda alpha: alpha.real > 0.1, pairs, GRID, 1e-3).windows == ()
    assert len(windows_complex(lambda alpha: alpha.real < 1.0, pairs, GRID, 1e-3).windows) == 1


def test_wrong_requests_are_refused() -> None:
    ring = nameless_one_way_ring(3)
    with pytest.raises(ValueError, match="stable: found shape"):
        windows_complex(lambda alpha: np.array(True), ring, GRID, 1e-3)
    with pytest.raises(ValueError, match="the grid must be one increasing row"):
        windows_complex(disc, ring, [1.0, 0.0], 1e-3)
    with pytest.raises(ValueError, match="resolution = 0"):
        windows_complex(disc, ring, GRID, 0.0)
