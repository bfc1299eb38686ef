"""The benchmark of the largest networks: windows, the sigma that is tried, sizes, and what direct
simulation says.
"""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest

from benchmarks import families
from synchain import Scene
from synchain.graphs import topology
from synchain.runtime.prediction.synchronisability import verdict

pytestmark = pytest.mark.long


def function(*ranges: tuple[float, float], error: float = 0.0) -> SimpleNamespace:
    """A stability function that is negative on these ranges."""
    return SimpleNamespace(intervals=ranges, uncertainties=tuple((error, error) for _ in ranges), scene=Scene())


def sigma(function_of_alpha: SimpleNamespace, name: str, n: int) -> float:
    return families.sigma_of(function_of_alpha, verdict(function_of_alpha.intervals, topology(name, n)))


def test_sigma_is_the_middle_of_the_widest_window() -> None:
    """Complete graph of 4: all |gamma| = 4, so windows are the ranges over 4."""
    assert sigma(function((1.0, 2.0), (4.0, 7.0)), "complete", 4) == pytest.approx((1.0 + 1.75) / 2)
    assert sigma(function((0.0, 2.0)), "star", 6) == pytest.approx(1.0 / 6)  # sizes 1 and 6


def test_without_a_window_both_ends_miss_by_the_same_factor() -> None:
    """Star of 9: sizes 1 and 9; the range 1 … 4 is missed by 1.5 below and above."""
    middle = sigma(function((1.0, 4.0)), "star", 9)
    assert middle == pytest.approx(2 / 3)
    assert 1.0 / middle == pytest.approx(9 * middle / 4.0) == pytest.approx(1.5)


def test_nothing_is_tried_where_nothing_is_stable() -> None:
    assert math.isnan(sigma(function(), "star", 9))
    assert all(math.isnan(value) for value in families._simulated(None, topology("star", 3), math.nan, True))


def test_largest_sizes_by_hand(monkeypatch) -> None:
    """Ratio 6.98: chain of 4 has 5.83, of 5 9.47; ring of 8 6.83, of 9 8.29; stars have n, cubes
    their dimension.
    """
    monkeypatch.setattr(families, "function_of", lambda omega, contact: function((1.0, 6.98), error=0.01))
    header, _, line = families.summary([(1.4, "atan"), (1.4, "atan")]).splitlines()
    assert header.split(" | ")[3:] == ["chain", "complete", "hypercube (dimension)", "ring", "star |"]
    cells = line.strip("| ").split(" | ")
    assert cells == ["1.4", "atan", "1.000 ± 0.010 … 6.980 ± 0.010", "4", "any", "6 (6 … 7)", "8", "6 (6 … 7)"]


def test_large_networks_with_set_valued_friction_are_left_out_and_named(monkeypatch) -> None:
    monkeypatch.setattr(families, "function_of", lambda omega, contact: function((0.1, 0.6)))
    monkeypatch.setattr(
        families, "simulate", lambda network, sigma, *_, **options: SimpleNamespace(share=[network.n], error=sigma)
    )
    rows = families.measure()
    assert all(len(row) == len(families.COLUMNS) for row in rows)
    for omega, contact in families.CASES:
        sizes = [row[9] for row in rows if row[:2] == (omega, contact)]
        assert sizes == [n for _, n in families.GRAPHS]


def test_a_short_run_confirms_a_window_and_its_absence(monkeypatch) -> None:
    monkeypatch.setattr(families, "GRAPHS", (("chain", 2), ("star", 8)))
    one, many = (dict(zip(families.COLUMNS, row, strict=True)) for row in families.measure(quick=True))
    assert (one["omega"], one["contact"]) == (1.40, "atan")
    assert (one["graph"], one["eigenratio"], one["predicted"]) == ("chain(2)", 1.0, "yes")
    assert one["share of starts synchronous"] == 1.0
    assert one["median error"] < 1e-3
    assert (many["graph"], many["predicted"], many["window of sigma"]) == ("star(8)", "no", "none")
    assert many["eigenratio"] == pytest.approx(8.0)
    assert many["share of starts synchronous"] == 0.0
