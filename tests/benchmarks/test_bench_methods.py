"""Which integrator: rows whose error and steps are those of the same kernel driven by hand, and
gains read off a line.
"""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import methods, precision
from benchmarks.kit.cases import read_case
from benchmarks.kit.own_program import REFILLS, Own
from synchain.codegen.simd.lane_types import native_width

CASE = read_case("friction, n = 2")
CHOICE = ("rodas5p", 1, (1e-5, 1e-6, 1e-7))


@pytest.fixture(scope="module", autouse=True)
def least_lengths():
    """Timed runs are as long as the case, whatever the clock says."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("benchmarks.kit.own_program.timed_periods", lambda cost, least, quick: least)
        yield


@pytest.fixture(scope="module")
def rows():
    return methods.points(CASE, *CHOICE, quick=True)


def test_error_and_steps_are_those_of_the_kernel(rows):
    part = CASE.within(5)
    solve = precision.prepare(CASE, "rodas5p", native_width())
    assert [row[:3] for row in rows] == [("rodas5p", native_width(), rtol) for rtol in CHOICE[2][1:]]
    for _, _, rtol, error, cost, steps in rows:
        states, _ = solve(rtol, 0.1 * rtol, part.times)
        _, counts = solve(rtol, 0.1 * rtol, np.array([5 * CASE.period]))
        assert error == np.abs(states - part.states).max()
        assert steps == (counts[0, 1] + counts[0, 2]) / 5
        assert cost > 0.0


def test_time_is_per_period_and_cell(monkeypatch):
    """Counted with a clock that gives 80 seconds a call: 5 periods of 16 cells, 1 second each."""
    monkeypatch.setattr("benchmarks.kit.own_program.best_time", lambda run, quick: 80.0)
    compiled = Own.compiled(CASE, "rodas5p", native_width(), 16, 5)
    point = compiled.point(1e-6, 1e-7, quick=True)
    assert point.seconds == 1.0
    assert point.remark == f"5 of {CASE.periods} periods"
    assert (point.rtol, point.atol, point.periods) == (1e-6, 1e-7, 5)


def test_the_table_compares_every_choice_with_the_first(monkeypatch, rows):
    monkeypatch.setattr(methods, "CASES", {"friction, n = 2": (CHOICE,)})
    monkeypatch.setattr(methods, "points", lambda *arguments: rows)
    made = methods.measure(quick=True)
    assert {row[0] for row in made} == {"friction, n = 2"}
    assert all(len(row) == len(methods.COLUMNS) for row in made)
    assert [row[-1] for row in made] == pytest.approx([1.0, 1.0])  # two points lie on their line
    assert methods.gain((*rows[0][:4], rows[0][4] / 3.0), rows) == pytest.approx(3.0)
    assert REFILLS > 1
