"""The scaling benchmark's rows are what its columns say."""

from __future__ import annotations

import pytest

from benchmarks import scaling
from synchain.codegen.simd.lane_types import native_width

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def rows():
    return scaling.measure(quick=True)


def test_quick_rows(rows):
    assert all(len(row) == len(scaling.COLUMNS) for row in rows)
    lanes = native_width()
    networks = [("chain", 2, 1), ("chain", 10, 1)] + ([("chain", 2, lanes), ("chain", 10, lanes)] if lanes > 1 else [])
    cases = [tuple(row[:3]) for row in rows]
    assert cases == networks + [("chain", 2, cells) for cells in (1, 1, 10, 10)]
    assert [row[4] for row in rows[-4:]] == [1, 2, 1, 2]


def test_cost_is_time_over_steps_and_oscillators(rows):
    for _, n, cells, _, _, steps, seconds, cost, memory in rows:
        assert cost == pytest.approx(seconds / (steps * cells * n) * 1e9)
        assert memory != memory or memory > 10


def test_networks_take_the_steps_that_were_asked_for():
    few, many = (scaling.network_row("chain", 2, 1, work) for work in (200, 400))
    assert (few[5], many[5]) == (100, 200)


def test_figure_has_a_line_for_each_network_and_number_of_threads(rows):
    figure = scaling.draw(rows)
    networks, sweeps = figure.axes
    assert len(networks.lines) == len({(row[0], row[3]) for row in rows[:-4]})
    assert len(sweeps.lines) == 2
    assert all(len(line.get_xdata()) == 2 for ax in figure.axes for line in ax.lines)
