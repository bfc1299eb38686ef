"""Bifurcations of periodic orbits between two neighbours on a branch, and at its end.

A real multiplier m passes -1 or 1 if det(M + 1) or det(M - 1) of the monodromy matrix M changes
sign. Stick is lost if the load at a landing passes the limit of static friction, a number of either
sign. Grazing can be approached only from the side of fewer phases, where the closing gap is known:
each orbit on the way has a sixteenth of the gap of the one before, and Newton's method starts from
a polynomial through those, so that it does not leave this side.

Sources: Seydel, Practical Bifurcation and Stability Analysis, 3rd ed. (Springer, 2010), chapters 5
and 7; di Bernardo, Budd, Champneys & Kowalczyk, Piecewise-smooth Dynamical Systems (Springer,
2008), chapters 7-8.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from scipy.optimize import brentq

from .continuation import Arc, find_fold
from .periodic import PeriodicOrbit, periodic_orbit, strobe
from .phases import Phases

__all__ = ["Bifurcation", "BifurcationKind", "bifurcations_at_end", "bifurcations_between"]

CLOSED = 1e-6
"""Largest gap that counts as closed: the branch ends by grazing."""

SHUT = 1e-13
"""Gap as small as the error of the integration, which cannot be closed further."""

SHARE = 1.0 / 16.0
"""Part of the gap that remains after each step towards a graze."""

MOST_STEPS = 80
"""Most steps towards a graze; halving alone exhausts the digits of the parameter in 53."""

LEAST_REACH = 1e-4
"""Shortest step towards a graze, relative to the distance to the other end."""


class BifurcationKind(StrEnum):
    """Kind of a bifurcation of periodic orbits."""

    PERIOD_DOUBLING = "period doubling"
    FOLD = "fold"
    GRAZING = "grazing"
    STICK_LOSS = "stick loss"


@dataclass(frozen=True, slots=True)
class Bifurcation:
    """A bifurcation on a branch of periodic orbits.

    Parameters
    ----------
    value : float
        Value of the parameter.
    kind : BifurcationKind
        Kind of the bifurcation.
    residual : float
        Distance of the multiplier from -1 or 1, or from the other phase, at `orbit`.
    orbit : PeriodicOrbit
        Nearest orbit that was found.
    """

    value: float
    kind: BifurcationKind
    residual: float
    orbit: PeriodicOrbit = field(repr=False)


def bifurcations_between(arc: Arc, value: float, orbit: PeriodicOrbit, phases: Phases | None) -> list[Bifurcation]:
    """Locate the bifurcations between the last orbit of an arc and the next one on the branch.

    Parameters
    ----------
    arc : Arc
        Arc up to the last orbit.
    value : float
        Value of the parameter at the next orbit.
    orbit : PeriodicOrbit
        Next orbit.
    phases : Phases or None
        Phases of the next orbit.

    Returns
    -------
    list of Bifurcation
        In the order of the parameter.
    """
    before = arc.phases[-1]
    if before is None or phases is None or before.slip_states == phases.slip_states:
        last, there = arc.orbits[-1], (arc.values[-1], value)
        return _crossings(arc.copy().take(value, orbit, phases), there, (last, orbit))
    ahead = len(before.slip_states) <= len(phases.slip_states)
    known = arc.copy() if ahead else arc.empty().take(value, orbit, phases)
    far = value if ahead else arc.values[-1]
    change = _stick_loss(arc, value, orbit, before, phases) if _same_slips(before, phases) else None
    change = change or _graze(known, far)
    start = (known.values[0], known.orbits[0]) if not ahead else (arc.values[-1], arc.orbits[-1])
    beside = _crossings(known, (start[0], change.value), (start[1], change.orbit))
    return sorted([change, *beside], key=lambda bifurcation: bifurcation.value)


def bifurcations_at_end(arc: Arc, beyond: float) -> list[Bifurcation]:
    """Locate the bifurcation at which a branch ends.

    The branch may be born of one of half as many periods, or end at a fold or at a graze.

    Parameters
    ----------
    arc : Arc
        Arc up to the last orbit.
    beyond : float
        Value of the parameter at which Newton's method finds no orbit of the branch.

    Returns
    -------
    list of Bifurcation
        One bifurcation, or none.
    """
    birth = _birth(arc, beyond)
    if birth is not None:
        return [birth]
    turn = find_fold(arc, beyond)
    if turn is not None:
        at, orbit = turn
        return [Bifurcation(at, BifurcationKind.FOLD, float(np.abs(orbit.multipliers - 1.0).min()), orbit)]
    if arc.phases[-1] is None:
        return []
    last = _graze(arc.copy(), beyond)
    return [last] if last.residual < CLOSED else []


def _birth(arc: Arc, beyond: float) -> Bifurcation | None:
    """Period doubling of an orbit of half the periods, between the halves of the last orbit."""
    half, last = arc.periods // 2, arc.orbits[-1]
    if arc.periods % 2:
        return None
    try:
        middle = 0.5 * (last.state + strobe(last.scene, last.state, half)[0])
        single = Arc(arc.scene, arc.name, half)
        for value in (arc.values[-1], beyond):
            orbit = periodic_orbit(arc.scene, half, middle, parameters={arc.name: value})
            middle = orbit.state
            single.take(value, orbit, orbit.phases)
        crossings = _crossings(single, (single.values[0], beyond), (single.orbits[0], single.orbits[1]))
    except ArithmeticError:
        return None
    return next((each for each in crossings if each.kind is BifurcationKind.PERIOD_DOUBLING), None)


def _crossings(arc: Arc, ends: tuple[float, float], orbits: tuple[PeriodicOrbit, PeriodicOrbit]) -> list[Bifurcation]:
    """Crossings of a real multiplier through -1 or 1 between two orbits of the same phases."""
    crossings = []
    for point, kind in ((-1.0, BifurcationKind.PERIOD_DOUBLING), (1.0, BifurcationKind.FOLD)):
        if not _beyond(orbits[0], point) * _beyond(orbits[1], point) < 0.0:
            continue

        def distance(value: float, point: float = point) -> float:
            return _beyond(orbits[ends.index(value)] if value in ends else arc.at(value), point)

        value, orbit = _root(distance, arc, ends)
        crossings.append(Bifurcation(value, kind, float(np.abs(orbit.multipliers - point).min()), orbit))
    return crossings


def _root(test: Callable[[float], float], arc: Arc, ends: tuple[float, float]) -> tuple[float, PeriodicOrbit]:
    """Zero of a test function of the orbit, and the orbit there.

    If Newton's method loses the orbit on the way, the end nearer to zero is returned.
    """
    try:
        value = float(brentq(test, *ends, xtol=1e-14, rtol=1e-14))
        return value, arc.at(value)
    except ArithmeticError:
        value = min(ends, key=lambda end: abs(test(end)))
        return value, arc.orbits[arc.values.index(value)]


def _beyond(orbit: PeriodicOrbit, point: float) -> float:
    """Product of the distances of all multipliers from a real number, det(M - point)."""
    return float(np.prod(orbit.multipliers - point).real)


def _same_slips(before: Phases, after: Phases) -> bool:
    """True if only stick phases come or go."""
    slips = [sorted(mode for mode in phases.slip_states if mode != 0) for phases in (before, after)]
    return slips[0] == slips[1] and before.slip_states.count(0) != after.slip_states.count(0)


def _stick_loss(arc: Arc, value: float, orbit: PeriodicOrbit, before: Phases, after: Phases) -> Bifurcation | None:
    """Stick loss between the last orbit of an arc and the next, None if there is none."""
    if not before.landing * after.landing < 0.0:
        return None
    ends = {arc.values[-1]: before.landing, value: after.landing}
    both = arc.empty().take(arc.values[-1], arc.orbits[-1], before).take(value, orbit, after)

    def landing(at: float) -> float:
        if at in ends:
            return ends[at]
        crossed = both.at(at)
        phases = crossed.phases
        if phases is None:
            raise ArithmeticError("an orbit without phases")
        both.take(at, crossed, phases)
        return phases.landing

    at, last = _root(landing, both, (arc.values[-1], value))
    return Bifurcation(at, BifurcationKind.STICK_LOSS, abs(landing(at)), last)


def _graze(arc: Arc, beyond: float) -> Bifurcation:
    """Grazing at which the gap of an arc's last orbit closes before `beyond`."""
    slip_states = _known(arc).slip_states
    share, reach = SHARE, 0.5
    for _ in range(MOST_STEPS):
        low, gap = arc.values[-1], _known(arc).gap
        if gap < SHUT or abs(beyond - low) <= 1e-15 * max(1.0, abs(low)) or reach < LEAST_REACH:
            break
        value = _where(arc, share * gap)
        guided = share < 0.99 and min(low, beyond) < value < max(low, beyond)
        value = value if guided else low + reach * (beyond - low)
        orbit = _orbit(arc, value)
        phases = None if orbit is None else orbit.phases
        # A gap below zero belongs to a phase too short for the samples.
        if orbit is not None and phases is not None and phases.slip_states == slip_states and phases.gap > -SHUT:
            arc.take(value, orbit, phases)
            share, reach = SHARE, 0.5
        elif orbit is not None:
            beyond = value
        elif guided:
            share = math.sqrt(share)  # a shorter step, on which more is known of the orbit
        else:
            reach *= 0.5
    at = _where(arc, 0.0)
    low = arc.values[-1]
    at = at if min(low, beyond) <= at <= max(low, beyond) else 0.5 * (low + beyond)
    return Bifurcation(at, BifurcationKind.GRAZING, abs(_known(arc).gap), arc.orbits[-1])


def _known(arc: Arc) -> Phases:
    """Phases of the last orbit of an arc."""
    phases = arc.phases[-1]
    if phases is None:
        raise RuntimeError("friction without phases has no gaps")
    return phases


def _orbit(arc: Arc, value: float) -> PeriodicOrbit | None:
    """Orbit at a value, None if Newton's method does not find it."""
    try:
        return arc.at(value)
    except ArithmeticError:
        return None


def _where(arc: Arc, gap: float) -> float:
    """Value at which a gap is expected by linear extrapolation; nan if there is none."""
    if len(arc.values) < 2:
        return float("nan")
    (a, b), (one, two) = arc.values[-2:], arc.phases[-2:]
    if one is None or two is None or not np.isfinite(one.gap - two.gap) or one.gap == two.gap:
        return float("nan")
    return b + (gap - two.gap) * (b - a) / (two.gap - one.gap)
