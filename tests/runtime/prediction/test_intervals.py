"""Intervals: runs on a grid, refined ends, products and intersections."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from synchain.runtime.prediction.intervals import find, grid_intervals, intersect, scale


def test_runs_of_good_points():
    x = np.arange(6.0)
    good = np.array([True, True, False, True, False, True])
    assert grid_intervals(x, good) == [(0.0, 1.0), (3.0, 3.0), (5.0, 5.0)]


@given(st.lists(st.floats(0.02, 0.98), min_size=2, max_size=6, unique=True), st.booleans())
def test_ends_are_found_to_the_resolution(points, first):
    ends = np.sort(points)
    if np.min(np.diff(ends)) < 0.011:
        return

    def judge(x):
        return (np.searchsorted(ends, x) % 2 == 0) == first

    intervals, verdict = find(judge, np.linspace(0, 1, 101), 1e-4)
    flat = [e for interval in intervals for e in interval]
    expected = ([0.0] if first else []) + list(ends) + ([1.0] if (len(ends) % 2 == 0) == first else [])
    np.testing.assert_allclose(flat, expected, atol=0.5e-4)
    assert verdict[0] == first


def test_nothing_good_and_everything_good():
    x = np.linspace(0, 1, 11)
    assert find(lambda p: p < 0, x, 1e-3)[0] == []
    assert find(lambda p: p >= 0, x, 1e-3)[0] == [(0.0, 1.0)]


def test_one_point_is_a_grid():
    assert find(lambda p: p >= 0, np.array([0.5]), 1e-3)[0] == [(0.5, 0.5)]
    assert find(lambda p: p < 0, np.array([0.5]), 1e-3)[0] == []


def test_a_bracket_narrows_to_the_change_next_to_its_good_end():
    asked = []

    def judge(x):
        asked.append(x.tolist())
        return (x <= 0.3) | ((x > 0.7) & (x < 0.9))

    intervals, verdict = find(judge, np.array([0.0, 1.0]), 0.01, fan=3)
    assert asked[:3] == [[0.0, 1.0], [0.25, 0.5, 0.75], [0.3125, 0.375, 0.4375]]
    assert len(asked) == 5  # brackets of 1/4, 1/16, 1/64 and 1/256, the first below 0.01
    assert intervals == [(0.0, 0.298828125)]  # the middle of the last one
    assert verdict.tolist() == [True, False]


def test_each_step_of_a_grid_has_its_own_resolution():
    asked = []

    def judge(x):
        asked.append(len(x))
        return (x > 0.3) & (x < 70.0)

    ((low, high),), _ = find(judge, np.array([0.0, 1.0, 100.0]), np.array([1e-3, 1.0]))
    assert (low, high) == (pytest.approx(0.3, abs=5e-4), pytest.approx(70.0, abs=0.5))
    assert asked == [3, 14, 14, 14, 7]  # 1/512 and 100/512 after three rounds


@pytest.mark.parametrize("end", [1e98, 1.0, 1e-300])
def test_brackets_end_at_the_rounding_of_their_ends(end):
    rounds = []

    def judge(x):
        rounds.append(len(x))
        assert len(rounds) < 1000
        return x < end

    ((_, high),), _ = find(judge, np.array([0.0, 1e99]), 1e-320)
    assert high == pytest.approx(end, rel=4 * np.finfo(float).eps)


@pytest.mark.parametrize("x", [[], [1.0, 0.5], [0.0, 0.0], [[0.0, 1.0]]])
def test_grids_that_do_not_increase_are_refused(x):
    with pytest.raises(ValueError, match="increasing"):
        find(lambda p: p > 0, np.array(x), 1e-3)


def test_resolution_must_be_positive():
    with pytest.raises(ValueError, match="resolution"):
        find(lambda p: p > 0, np.array([0.0, 1.0]), 0.0)


def test_intersection_is_what_both_contain():
    left, right = [(0.0, 1.0), (2.0, 3.0)], [(0.5, 2.5), (3.0, 4.0)]
    assert intersect(left, right) == [(0.5, 1.0), (2.0, 2.5)]
    assert intersect(left, []) == []


@pytest.mark.parametrize(
    ("left", "right", "expected"),
    [
        ([(0.0, 1.0)], [(1.0, 2.0)], []),
        ([(1.0, 1.0)], [(0.0, 2.0)], [(1.0, 1.0)]),
        ([(0.0, 2.0)], [(1.0, 1.0)], [(1.0, 1.0)]),
        ([(0.0, 1.0)], [(1.0, 1.0)], [(1.0, 1.0)]),
        ([(1.0, 1.0)], [(2.0, 2.0)], []),
        ([(2.0, 3.0), (0.0, 1.0)], [(0.5, 2.5)], [(0.5, 1.0), (2.0, 2.5)]),
    ],
)
def test_single_points_count_where_they_are_given_as_intervals(left, right, expected):
    assert intersect(left, right) == expected


def test_scale_needs_a_positive_factor():
    assert scale([(1.0, 2.0)], 0.5) == [(0.5, 1.0)]
    with pytest.raises(ValueError, match="factor"):
        scale([(1.0, 2.0)], 0.0)
    with pytest.raises(ValueError, match="factor"):
        scale([], float("nan"))
