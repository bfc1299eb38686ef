"""Work and precision of both friction laws: the set-valued one, and the smoothed one at the paper's
steepness 1e5.

Each law is measured against its own solution at the same times: the smoothed one against the runs
in quadruple precision of `precision`, the set-valued one against its own run at a tolerance of
REFERENCE, which an independent integrator in 50 digits confirms (tests/test_contact_events.py).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .kit.cases import Case, read_case
from .kit.compare import table
from .kit.own_program import REFILLS, Own, full_width, prepare
from .precision import COLUMNS, row

__all__ = ["CASES", "CHOICES", "COLUMNS", "draw", "exact", "measure", "points", "summary"]

CASES = ("friction, n = 1", "friction, n = 2")
REFERENCE = 1e-14
LADDER = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12)
CHOICES = (("rodas5p", False), ("switching", False), ("dop853", True))
"""Integrators, and whether the law is set-valued."""

OWN = {"rodas5p", "switching", "dop853, set-valued"}


def measure(quick: bool = False) -> list[tuple[object, ...]]:
    """Return the rows of the table, in the order of COLUMNS; every method with one lane and with
    all.
    """
    rows: list[tuple[object, ...]] = []
    for name in CASES[:1] if quick else CASES:
        smooth = read_case(name)
        for integrator, sticks in CHOICES[::2] if quick else CHOICES:
            case = exact(smooth) if sticks else smooth
            for full in (False, True):
                rows += points(case, integrator, full, quick)
    return rows


def exact(case: Case) -> Case:
    """The same problem under the set-valued law, with its own solution; states (m, 2 n) without the
    modes.
    """
    parameters = {name: value for name, value in case.scene.parameters.items() if name != "kappa"}
    scene = case.scene.replace(contact="set-valued", parameters=parameters)
    made = Case(case.name, scene, case.times, np.empty((0, 0)))
    states, _ = prepare(made, "dop853", 1)(REFERENCE, 0.1 * REFERENCE, case.times)
    return Case(case.name, scene, case.times, states)


def points(case: Case, integrator: str, full: bool, quick: bool) -> Iterator[tuple[object, ...]]:
    """Yield a row for each tolerance of a method."""
    lanes = full_width(case, integrator) if full else 1
    own = Own.compiled(case, integrator, lanes, REFILLS * lanes if full else 1, case.periods)
    for rtol in LADDER[1:6:4] if quick else LADDER:
        found = list(row(case, own.point(rtol, 0.1 * rtol, quick)))
        if case.scene.contact == "set-valued":
            found[1] = f"{integrator}, set-valued"
        yield tuple(found)


def summary(rows: list[tuple[object, ...]]) -> str:
    """Times at equal error, and their ratio to the fastest."""
    return table(_named(rows), own=OWN)


def draw(rows: list[tuple[object, ...]]) -> object:
    """A figure with one panel a case: time against error, a curve for each law and method."""
    from .kit.figure import figure

    return figure(_named(rows), own=OWN)


def _named(rows: list[tuple[object, ...]]) -> list[dict[str, object]]:
    return [dict(zip(COLUMNS, found, strict=True)) for found in rows]
