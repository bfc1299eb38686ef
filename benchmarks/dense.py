"""Dense reading: time per period and core against the error of a trajectory that is read often.

Every row gives the states at READINGS evenly spaced times of each period, for one trajectory in
each lane; the error is the largest over all of them.  Methods with dense output pay for
polynomials, those without stop at every time.  `precision` has the runs with one reading at their
end, as in a sweep.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from . import peers, precision
from .kit.cases import Case
from .kit.clock import Point, best_time, curve
from .kit.computed import solved
from .kit.own_program import full_width, prepare
from .precision import COLUMNS, TOLERANCES, draw, notes, row, summary

__all__ = ["CASES", "COLUMNS", "METHODS", "case_of", "draw", "measure", "notes", "summary"]

CASES = ("linear, driven, n = 4", "Duffing, n = 2", "pendulum, n = 2")
METHODS = ("taylor", "dop853", "rodas5p")
READINGS, PERIODS = 20, 50


def case_of(name: str, periods: int = PERIODS) -> Case:
    """Return a case with its reference at all readings; ValueError for an unknown name."""
    if name not in CASES:
        raise ValueError(f"unknown case {name!r}; known: {'; '.join(CASES)}")
    case = precision.case_of(name)
    times = case.period * np.arange(1, READINGS * periods + 1) / READINGS
    return solved(Case(name, case.scene, times, np.empty((0, 0))))


def measure(quick: bool = False) -> list[tuple[object, ...]]:
    """Return the rows of the table, in the order of COLUMNS."""
    present = peers.present()
    rows: list[tuple[object, ...]] = []
    for name in CASES[:1] if quick else CASES:
        case = case_of(name, 4 if quick else PERIODS)
        rows += [row(case, point) for point in own_points(case, quick)]
        for peer in present:
            rows += [row(case, point) for point in curve(peer, case, quick, read_all=True)]
    return rows


def own_points(case: Case, quick: bool) -> Iterator[Point]:
    """Yield this program's points of a case."""
    for method in METHODS:
        solve = prepare(case, method, None, readings=len(case.times) + 1)
        for rtol, atol in TOLERANCES[::4] if quick else TOLERANCES:
            lanes = full_width(case, method, rtol, atol)
            ends = np.full(lanes, case.times[-1])
            states, counts = solve(rtol, atol, ends)
            seconds = best_time(partial(solve, rtol, atol, ends), quick)
            error = float(np.abs(states[0, 1:] - case.states).max())
            steps = float(counts[0, 1] + counts[0, 2]) / case.periods
            yield Point(method, lanes, rtol, atol, error, seconds / (case.periods * lanes), case.periods, 0.0, steps)
