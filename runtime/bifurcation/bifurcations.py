"""Locate bifurcations of periodic orbits between two neighbouring orbits of a branch, and at the end of a branch.

Each kind of bifurcation is a zero of a test function of the orbit, at which the function changes its sign. M is the
monodromy matrix.

| kind | test function | further condition |
|---|---|---|
| period doubling | modulus - 1 of the k-th multiplier, sorted by size | the multiplier is -1 |
| fold | the same | the multiplier is 1, and the branch turns back in its parameter |
| branch point (transcritical, pitchfork) | the same | the multiplier is 1, and the branch does not turn |
| Neimark-Sacker (torus) | the same | a complex pair |
| stick loss | the load at a landing, less the limit of static friction | only stick phases come or go |
| grazing | the gap that closes inside a phase | phases come or go |

Moduli sorted by size are continuous along a branch, and none passes 1 at a saddle whose multipliers have the
product 1. If two multipliers change places in one step, the signs of det(M + I) and det(M - I) show the crossing. A
graze can be approached only from the side of fewer phases, where the closing gap is defined. Each orbit on the way has
a sixteenth of the gap of the orbit before. Newton's method starts from a polynomial through these orbits, so that it
stays on this side.

Sources: Kuznetsov, Elements of Applied Bifurcation Theory, 3rd ed. (Springer, 2004), chapter 10; Seydel, Practical
Bifurcation and Stability Analysis, 3rd ed. (Springer, 2010), chapters 5 and 7; di Bernardo, Budd, Champneys &
Kowalczyk, Piecewise-smooth Dynamical Systems (Springer, 2008), chapters 7-8.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.optimize import brentq

from .continuation import Arc, det, find_turn, turns
from .kinds import BifurcationKind
from .periodic import PeriodicOrbit, periodic_orbit, strobe
from .phases import Phases
from .results import Bifurcation

Test = Callable[[PeriodicOrbit], float]
"""A test function of the orbit, zero at a bifurcation."""

LOCATED = 1e-6
"""Largest residual of a bifurcation (a choice); a larger residual means that the test function jumps between
branches."""

SHUT = 1e-13
"""A gap of this size is an error of the integration, and cannot be closed further."""

SHARE = 1.0 / 16.0
"""Part of the gap that remains after each step towards a graze (a choice)."""

MOST_STEPS = 80
"""Most steps towards a graze; halving alone exhausts the digits of the parameter in 53."""

LEAST_REACH = 1e-4
"""Shortest step towards a graze, relative to the distance to the other end (a choice)."""

NEUTRAL = 1e-9
"""A multiplier within this distance of the unit circle may be on the circle, like all multipliers without damping (a
choice)."""

BESIDE = 1e-2
"""Such a multiplier must have left the circle at this distance from a crossing, relative to the step (a choice)."""

REAL = 1e-6
"""Largest imaginary part of a multiplier that passes the circle at -1 or 1 (a choice)."""


def located(bifurcation: Bifurcation) -> bool:
    """Return whether the residual is small enough for a bifurcation."""
    return bifurcation.residual < LOCATED


def bifurcations_between(arc: Arc, value: float, orbit: PeriodicOrbit, phases: Phases | None) -> list[Bifurcation]:
    """Locate the bifurcations between the last orbit of an arc and the next one on the branch."""
    before = arc.phases[-1]
    if before is None or phases is None or before.slip_states == phases.slip_states:
        both = arc.copy().take(value, orbit, phases)
        return _crossings(OrbitPair(both, (arc.values[-1], value), (arc.orbits[-1], orbit)))
    # Phases change: stick loss or grazing.  A graze is approached from the side of fewer phases.
    ahead = len(before.slip_states) <= len(phases.slip_states)
    side = arc.copy() if ahead else arc.empty().take(value, orbit, phases)
    far = value if ahead else arc.values[-1]
    change = _stick_loss(arc, value, orbit, before, phases) if _same_slips(before, phases) else None
    change = change or _graze(side, far)
    # Smooth bifurcations on that side, before the change.
    start = (side.values[0], side.orbits[0]) if not ahead else (arc.values[-1], arc.orbits[-1])
    smooth = _crossings(OrbitPair(side, (start[0], change.value), (start[1], change.orbit)))
    return sorted([change, *smooth], key=lambda bifurcation: bifurcation.value)


def bifurcations_at_end(arc: Arc, beyond: float, final: bool) -> list[Bifurcation]:
    """Locate the bifurcation at which a branch ends: period doubling of half the periods, fold, branch point or graze."""
    birth = _birth(arc, beyond)
    if birth is not None:
        return [birth]
    try:
        turn = find_turn(arc, beyond)
    except ArithmeticError:
        turn = None
    if turn is not None and (beyond - turn[1]) * (turn[1] - arc.values[-1]) >= 0.0:
        kind, at, orbit = turn
        bifurcation = Bifurcation(at, kind, _residual(orbit, kind), orbit)
        return [bifurcation] if located(bifurcation) else []
    if arc.phases[-1] is None or not final:
        return []
    graze = _graze(arc.copy(), beyond)
    return [graze] if located(graze) else []


def _birth(arc: Arc, beyond: float) -> Bifurcation | None:
    """Locate the period doubling at which a branch is born from an orbit of half its periods; None if there is none."""
    half, last = arc.periods // 2, arc.orbits[-1]
    if arc.periods % 2:
        return None
    try:
        # Start the search for the orbit of half the periods from the mean of both halves of the last orbit.
        middle = 0.5 * (last.state + strobe(last.scene, last.state, half)[0])
        single = Arc(arc.scene, arc.name, half)
        for value in (arc.values[-1], beyond):
            orbit = periodic_orbit(arc.scene, half, middle, parameters={arc.name: value})
            middle = orbit.state
            single.take(value, orbit, orbit.phases)
        crossings = _crossings(OrbitPair(single, (single.values[0], beyond), (single.orbits[0], single.orbits[1])))
    except ArithmeticError:
        return None
    return next((each for each in crossings if each.kind is BifurcationKind.PERIOD_DOUBLING and located(each)), None)


@dataclass(frozen=True, slots=True)
class OrbitPair:
    """Two orbits of the same phases on an arc, between which test functions of the orbit have zeros."""

    arc: Arc
    values: tuple[float, float]  # values of the parameter
    orbits: tuple[PeriodicOrbit, PeriodicOrbit]  # orbit at each value

    def changes(self, test: Test) -> bool:
        """Return whether a test function changes its sign; zero counts as positive."""
        one, other = map(test, self.orbits)
        return (one < 0.0) != (other < 0.0)

    def root(self, test: Test) -> tuple[float, PeriodicOrbit]:
        """Locate the zero of a test function that changes its sign, and the orbit there."""
        results = dict(zip(self.values, map(test, self.orbits), strict=True))
        arc = self.arc.copy()

        def tested(at: float) -> float:
            if at not in results:
                orbit = arc.at(at)
                arc.take(at, orbit, None)
                results[at] = test(orbit)
            return results[at]

        return _root(tested, arc, self.values)

    def passes(self, k: int) -> bool:
        """Return whether the modulus of the k-th multiplier passes 1."""
        test = partial(_outside, k=k)
        neutral = [abs(test(orbit)) < NEUTRAL for orbit in self.orbits]
        if not self.changes(test) or all(neutral):
            return False
        if not any(neutral):
            return True
        # A multiplier on the circle at one end: it must lie clearly on either side beside the crossing.
        at, beside = self.root(test)[0], BESIDE * (self.values[1] - self.values[0])
        try:
            before, after = (test(self.arc.at(at + shift)) for shift in (-beside, beside))
        except ArithmeticError:
            return True
        return before * after < 0.0 and min(abs(before), abs(after)) > NEUTRAL


def _crossings(step: OrbitPair) -> list[Bifurcation]:
    """Locate the crossings of the unit circle by multipliers."""
    at_one = BifurcationKind.FOLD if turns(step.arc, step.values, step.orbits) else BifurcationKind.BRANCH_POINT
    kinds = {-1.0: BifurcationKind.PERIOD_DOUBLING, 1.0: at_one}
    crossings = []
    passing = filter(step.passes, range(len(step.orbits[0].multipliers)))
    for k in passing:
        value, orbit = step.root(partial(_outside, k=k))
        multiplier = complex(orbit.multipliers[k])
        kind = kinds[math.copysign(1.0, multiplier.real)]
        if abs(multiplier.imag) > REAL:
            kind = BifurcationKind.NEIMARK_SACKER
            next(passing, None)  # the other multiplier of the pair
        crossings.append(Bifurcation(value, kind, _residual(orbit, kind), orbit))
    # If a determinant changes its sign, the number of crossings is odd: find the one that moduli miss, where
    # multipliers
    # change places.
    for point, kind in kinds.items():
        test = partial(det, point=point)
        if step.changes(test) and sum(each.kind is kind for each in crossings) % 2 == 0:
            value, orbit = step.root(test)
            crossings.append(Bifurcation(value, kind, _residual(orbit, kind), orbit))
    return crossings


def _residual(orbit: PeriodicOrbit, kind: BifurcationKind) -> float:
    """Return the least distance of a multiplier from -1, from 1 or, of a complex one, from the unit circle."""
    if kind is BifurcationKind.NEIMARK_SACKER:
        pairs = orbit.multipliers[np.abs(orbit.multipliers.imag) > REAL]
        return float(np.abs(np.abs(pairs) - 1.0).min())
    return float(np.abs(orbit.multipliers + (1.0 if kind is BifurcationKind.PERIOD_DOUBLING else -1.0)).min())


def _root(test: Callable[[float], float], arc: Arc, ends: tuple[float, float]) -> tuple[float, PeriodicOrbit]:
    """Return the zero of a test function and the orbit there.

    The end nearer to zero if Newton's method loses the orbit.
    """
    try:
        value = float(brentq(test, *ends, xtol=1e-14 * max(map(abs, ends)), rtol=1e-14))
        return value, arc.at(value)
    except ArithmeticError:
        value = min(ends, key=lambda end: abs(test(end)))
        return value, arc.orbits[arc.values.index(value)]


def _outside(orbit: PeriodicOrbit, k: int) -> float:
    """Return the distance by which the k-th multiplier, sorted by modulus, lies outside the unit circle."""
    return float(np.abs(orbit.multipliers[k])) - 1.0


def _same_slips(before: Phases, after: Phases) -> bool:
    """Return whether only stick phases come or go."""
    slips = [sorted(mode for mode in phases.slip_states if mode != 0) for phases in (before, after)]
    return slips[0] == slips[1] and before.slip_states.count(0) != after.slip_states.count(0)


def _stick_loss(arc: Arc, value: float, orbit: PeriodicOrbit, before: Phases, after: Phases) -> Bifurcation | None:
    """Locate stick loss between the last orbit of an arc and the next, None if there is none."""
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
    """Locate the graze at which the gap of an arc's last orbit closes before `beyond`."""
    slip_states = _last_phases(arc).slip_states
    share, reach = SHARE, 0.5
    for _ in range(MOST_STEPS):
        low, gap = arc.values[-1], _last_phases(arc).gap
        if gap < SHUT or abs(beyond - low) <= 1e-15 * abs(low) or reach < LEAST_REACH:
            break
        # Choose the next value: where the extrapolated gap is `share` times the last one, or else nearer to `beyond`.
        value = _value_at_gap(arc, share * gap)
        guided = share < 0.99 and min(low, beyond) < value < max(low, beyond)
        value = value if guided else low + reach * (beyond - low)
        orbit: PeriodicOrbit | None = None
        with suppress(ArithmeticError):
            orbit = arc.at(value)
        phases = None if orbit is None else orbit.phases
        # A gap below zero belongs to a phase too short for the samples.
        if orbit is not None and phases is not None and phases.slip_states == slip_states and phases.gap > -SHUT:
            arc.take(value, orbit, phases)
            share, reach = SHARE, 0.5
        elif orbit is not None:  # an orbit beyond the graze
            beyond = value
        elif guided:
            share = math.sqrt(share)  # a shorter step, close to the orbits that the polynomial passes through
        else:
            reach *= 0.5
    at = _value_at_gap(arc, 0.0)
    low = arc.values[-1]
    at = at if min(low, beyond) <= at <= max(low, beyond) else 0.5 * (low + beyond)
    return Bifurcation(at, BifurcationKind.GRAZING, abs(_last_phases(arc).gap), arc.orbits[-1])


def _last_phases(arc: Arc) -> Phases:
    """Return the phases of the last orbit of an arc."""
    phases = arc.phases[-1]
    if phases is None:
        raise RuntimeError("friction without phases has no gaps")
    return phases


def _value_at_gap(arc: Arc, gap: float) -> float:
    """Extrapolate linearly to the parameter at which the gap has a value; nan if it does not change."""
    if len(arc.values) < 2:
        return float("nan")
    (a, b), (one, two) = arc.values[-2:], arc.phases[-2:]
    if one is None or two is None or not np.isfinite(one.gap - two.gap) or one.gap == two.gap:
        return float("nan")
    return b + (gap - two.gap) * (b - a) / (two.gap - one.gap)
