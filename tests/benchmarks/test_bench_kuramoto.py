"""The rows of the Kuramoto benchmark: right end states, and costs that do not grow with the pairs."""

from __future__ import annotations

import pytest

from benchmarks import kuramoto

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def rows():
    return kuramoto.measure(quick=True)


def test_quick_rows_agree_with_scipy(rows):
    assert all(len(row) == len(kuramoto.COLUMNS) for row in rows)
    assert [row[:2] for row in rows] == [case for case in kuramoto.QUICK for _ in range(2)]
    for *_, steps, seconds, cost, far, _ in rows:
        assert steps > 3
        assert cost == pytest.approx(seconds / (steps * 40) * 1e6)
        assert far < 2e-6


def test_graphs_of_the_table():
    sparse, pairs = (kuramoto.graph_of(name, n) for name, n in kuramoto.CASES[::2])
    assert 0.9 < sparse.link_count / (kuramoto.DEGREE * sparse.n) < 1.1
    assert pairs.all_to_all * pairs.n == 1
