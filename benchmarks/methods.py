"""Which integrator, and how many lanes: time per drive period and core against the error, all in
the same driver.

The cases are those of `precision`. Every lane works through eight cells, so that what a scheduler
loses at the end counts as it does in a sweep. The last column is the time that the same error costs
on the log-log line through the rows of the first choice, rodas5p or taylor in one register, over
the time of the row: above 1 the row is the better choice at its error.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from synchain.codegen.simd.lane_types import native_width

from .kit.cases import Case
from .kit.own_program import REFILLS, Own
from .precision import case_of

COLUMNS = ("case", "method", "lanes", "rtol", "error", "microseconds per period", "steps per period", "gain")
Choice = tuple[str, int, tuple[float, ...]]
"""Integrator, registers that the lanes fill, and relative tolerances."""

STIFF: tuple[Choice, ...] = (
    ("rodas5p", 1, (1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11)),
    ("rodas5p", 2, (1e-6, 1e-8, 1e-10)),
    ("rodas4", 1, (1e-5, 1e-7, 1e-9)),
    ("rodas6p", 1, (1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)),
    ("ros34pw2", 1, (1e-4, 1e-5, 1e-6)),
)
SMOOTH: tuple[Choice, ...] = tuple(
    (name, registers, (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)) for name in ("taylor", "dop853") for registers in (1, 2)
)
CASES = dict.fromkeys(("friction, n = 2", "friction, n = 1", "friction, n = 4"), STIFF) | dict.fromkeys(
    ("smooth, n = 2", "exact law, n = 1", "exact law, n = 2"), SMOOTH
)
"""The choices of each case; the first is what the others are compared with."""


def measure(quick: bool = False) -> list[tuple[object, ...]]:
    """Return the rows of the table, in the order of COLUMNS."""
    rows: list[tuple[object, ...]] = []
    for name, choices in list(CASES.items())[: 1 if quick else None]:
        case = case_of(name)
        found = [point for choice in choices for point in points(case, *choice, quick)]
        first = [point for point in found if point[:2] == found[0][:2]]
        rows += [(name, *point, gain(point, first)) for point in found]
    return rows


def points(
    case: Case, method: str, registers: int, tolerances: tuple[float, ...], quick: bool
) -> list[tuple[object, ...]]:
    """Method, lanes, tolerance, error, microseconds and steps per period of each tolerance."""
    lanes = native_width(registers)
    own = Own.compiled(case, method, lanes, REFILLS * lanes, 5 if quick else min(case.periods, 50))
    found = [own.point(rtol, 0.1 * rtol, quick) for rtol in (tolerances[1:3] if quick else tolerances)]
    return [(method, lanes, p.rtol, p.error, 1e6 * p.seconds, p.steps) for p in found]


def gain(point: tuple[Any, ...], first: list[tuple[Any, ...]]) -> float:
    """Time at the error of a point on the line through the first choice's points, over the time of
    the point.
    """
    errors, times = (np.log([p[k] for p in first]) for k in (3, 4))
    slope, level = np.polyfit(errors, times, 1)
    return float(np.exp(level + slope * np.log(point[3])) / point[4])
