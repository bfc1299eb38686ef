"""Benchmarks cannot rot: each runs, and its table has what its columns say."""

from __future__ import annotations

import numpy as np
import pytest

from synchain.runtime import bench
from synchain.runtime.bench import precision, sensitivity


def test_unknown_benchmarks_are_refused():
    with pytest.raises(ValueError, match=r"known: .*precision"):
        bench.load("speed")


@pytest.mark.parametrize("n", precision.CASES)
def test_reference_cases_are_solved(n):
    case = precision.read_case(n)
    states, counts, seconds = precision.solve(case, precision.Method("rodas5p", 8, 1e-8, 1e-9, 1), case.times)
    assert np.abs(states - case.states).max() < 1e-8
    assert (counts[:, 0] == 1).all()
    assert seconds > 0


def test_scalar_step_needs_a_hundredth_of_the_paper_methods_steps():
    """Cash-Karp at 1e-15/1e-12 is held back by stability, not accuracy: 15 thousand steps a period."""
    case = precision.read_case(2)
    period = np.array([10 * 2 * np.pi / 1.15])
    _, slow, _ = precision.solve(case, precision.Method("cash_karp", 1, 1e-12, 1e-15, 1), period)
    _, fast, _ = precision.solve(case, precision.Method("rodas5p", 1, 1e-6, 1e-7, 1), period)
    assert slow[0, 1] > 100 * fast[0, 1]


def test_markdown_has_one_line_a_row():
    text = bench.markdown(("a", "b"), [(1, 0.25), ("x", 1e-9)])
    assert text.splitlines() == ["| a | b |", "|---|---|", "| 1 | 0.25 |", "| x | 1e-09 |"]


def test_sensitivity_brackets_the_published_end(monkeypatch):
    """A short run of the first case: every choice finds one range, and its end lies near the exponent's."""
    changes = (("short", {"transient": 200.0, "window": 20.0, "starts": 1}),)
    monkeypatch.setattr(sensitivity, "CHANGES", changes)
    rows = sensitivity.measure(quick=True)
    assert [row[2] for row in rows] == ["short", "sign of the transversal exponent"]
    assert all(len(row) == len(sensitivity.COLUMNS) and row[5] == 1 and row[3] == 0.0 for row in rows)
    direct, exponent = (float(row[4]) for row in rows)
    assert exponent == pytest.approx(0.2327, abs=2e-3)
    assert exponent - 0.02 < direct < exponent  # a finite transient leaves the slowest decay undecided
