"""Smooth equations and the exact law of friction: time per unit and core against the error, long
runs.

The Taylor steps of this program, its explicit Runge-Kutta steps and heyoka's Taylor series, all in
full lanes, each row with one reading time at the end, so that calls and restarts weigh little. The
unit of time is the drive's period, or 2 pi without a drive. The error is the largest over all
components of the state at the end; the reference is DOP853 at rtol = 1e-14 with a tenth of the step
limit, a method and a step control of their own. heyoka has no events and takes no part in the exact
law. Times are CPU times of one core, compilation apart.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from synchain.codegen.simd.lane_types import native_width
from synchain.models.graphs.families import topology
from synchain.models.scenes.scene import Scene

from ..stability.orbits import unit_of_time
from . import peers
from .kit.cases import Case
from .kit.clock import Point, curve
from .kit.own_program import REFILLS, Own, prepare
from .precision import COLUMNS, row

__all__ = ["CASES", "COLUMNS", "METHODS", "case_of", "measure", "notes", "summary"]

PEER = "heyoka_batch"
METHODS = ("taylor", "dop853")
"""This program's rows; the first is what the others are compared with."""
TOLERANCES = tuple((rtol, 0.1 * rtol) for rtol in (1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12))
REFERENCE = (1e-14, 1e-16)

_EXACT: dict[str, object] = {"contact": "set-valued", "initial": {"x": 0.3, "v": 0.0}}
_LINKED: dict[str, object] = {"sigma": 0.1}
_LINEAR: dict[str, object] = {"beta": 0.0, "delta": 0.0, **_LINKED}
_SMOOTHED: dict[str, float] = {"kappa": 10.0, "sigma": 0.1}
"""The smoothed law has a kink, |w|; over the slow belt each oscillator passes it twice a period."""
_APART: dict[str, object] = {"x": (0.3, 0.4), "v": (0.0, 0.05)}

CASES: dict[str, tuple[str, int, dict[str, object], int]] = {
    "linear, driven, n = 4": ("chain", 4, {"oscillator": "duffing", "parameters": _LINEAR}, 200),
    "Duffing, driven, n = 2": ("chain", 2, {"oscillator": "duffing", "parameters": _LINKED}, 20),
    "pendulum, n = 2": ("chain", 2, {"oscillator": "pendulum", "parameters": _LINKED}, 200),
    "FPUT ring, n = 8": ("ring", 8, {"oscillator": "mass", "coupling": "fput"}, 50),
    "friction, kappa = 10, n = 2": ("chain", 2, {"parameters": _SMOOTHED, "initial": _APART}, 50),
    "friction, kappa = 10, slow belt, n = 2": (
        "chain",
        2,
        {"parameters": {**_SMOOTHED, "theta_b": 0.02}, "initial": _APART},
        50,
    ),
    "van der Pol, n = 2": ("chain", 2, {"oscillator": "van_der_pol", "parameters": _LINKED}, 50),
    "exact law, n = 1": ("chain", 1, _EXACT, 20),
    "exact law, n = 2": ("chain", 2, {"parameters": _LINKED, **_EXACT}, 20),
    "exact law, n = 4": ("chain", 4, {"parameters": _LINKED, **_EXACT}, 20),
}
"""Family and size of the graph, other arguments of the scene, length in units of time."""


def notes() -> list[str]:
    """A line if the peer cannot run here."""
    peer = peers.load(PEER)
    why = peers.absent(peer)
    return [f"skipped: {peer.NAME} ({why})"] if why else []


def case_of(name: str, periods: int | None = None) -> Case:
    """Return a case with its reference at half its length and at its end.

    Raises ValueError for an unknown name.
    """
    if name not in CASES:
        raise ValueError(f"unknown case {name!r}; known: {'; '.join(CASES)}")
    family, n, arguments, length = CASES[name]
    scene = Scene(**{"topology": topology(family, n), "record": (), **arguments})  # type: ignore[arg-type]
    periods = length if periods is None else periods
    times = unit_of_time(scene) * np.array([math.ceil(periods / 2), periods], dtype=float)
    blank = Case(name, scene, times, np.zeros((2, len(scene.y0))))
    states, _ = prepare(blank, "dop853", 1)(*REFERENCE, times)
    return Case(name, scene, times, states)


def measure(quick: bool = False) -> list[tuple[object, ...]]:
    """Return the rows of the table, in the order of COLUMNS."""
    peer = peers.load(PEER)
    rows: list[tuple[object, ...]] = []
    for name in list(CASES)[:1] + list(CASES)[5:6] if quick else CASES:
        case = case_of(name, 4 if quick else None)
        rows += [row(case, point) for point in own_points(case, quick)]
        if not (case.scene.equations.sticks or peers.absent(peer)):
            rows += [row(case, point) for point in curve(peer, case, quick)]
    return rows


def own_points(case: Case, quick: bool) -> Iterator[Point]:
    """Yield this program's points of a case."""
    for method in METHODS:
        lanes = native_width(2 if len(case.scene.y0) <= 2 else 1)
        own = Own.compiled(case, method, lanes, REFILLS * lanes, case.periods)
        for rtol, atol in TOLERANCES[::3] if quick else TOLERANCES:
            yield own.point(rtol, atol, quick)


def summary(rows: Sequence[Sequence[object]]) -> str:
    """A second table in Markdown: time of every method at the same error, and its ratio to the
    fastest row.
    """
    from .kit.compare import table

    return table([dict(zip(COLUMNS, row, strict=False)) for row in rows], own=set(METHODS))
