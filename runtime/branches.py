"""Branches of periodic orbits along a parameter, and the bifurcations on them.

A smooth bifurcation is a real multiplier that passes -1 or 1.  One of friction is a change of the phases of stick and slip:
grazing, where a phase begins in the middle of another one as its distance from it becomes zero, and stick loss, where a
body that landed in stick turns at once, as the load at the landing passes the limit of static friction.

Sources: Seydel, Practical Bifurcation and Stability Analysis, 3rd ed. (Springer, 2010), chapter 7; di Bernardo, Budd,
Champneys & Kowalczyk, Piecewise-smooth Dynamical Systems (Springer, 2008), chapters 7-8.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from synchain.models.scene import Scene

from .periodic import PeriodicOrbit, periodic_orbit
from .phases import Phases

__all__ = ["Branch", "follow", "skeleton"]

CLOSE = 1e-9
"""How closely a change of phases is located, relative to the parameter."""

CLOSED = 1e-6
"""A gap this small has closed: the branch ends by grazing."""

Found = tuple[float, str, float]
"""Value of the parameter, what happens there, and how far the test function is from zero."""


@dataclass(frozen=True, slots=True)
class Branch:
    """Periodic orbits along a parameter: values (k,), an orbit for each, and the bifurcations between them.

    bifurcations: (value of the parameter, "period doubling", "fold", "grazing" or "stick loss"); residuals: how far the
    multiplier is from -1 or 1 there, or the distance from the other phase, at the nearest orbit that was found; phases: of
    each orbit, empty for friction that is not set-valued.  The branch ends where Newton's method fails.
    """

    name: str
    values: np.ndarray
    orbits: tuple[PeriodicOrbit, ...]
    bifurcations: tuple[tuple[float, str], ...]
    residuals: tuple[float, ...] = ()
    phases: tuple[Phases, ...] = ()


def follow(scene: Scene, name: str, values: Sequence[float], first: PeriodicOrbit) -> Branch:
    """Follow a periodic orbit along a parameter, from `first` at values[0] on, and locate its bifurcations.

    Raises ValueError for an unknown parameter.
    """
    if name not in first.scene.parameters:
        raise ValueError(f"unknown parameter {name!r}; known: {', '.join(first.scene.parameters)}")
    orbits: list[PeriodicOrbit] = []
    phases: list[Phases] = []
    found: list[Found] = []
    for k, value in enumerate(values):
        guess = first.state if k == 0 else orbits[-1].state
        if k > 1:
            slope = (orbits[-1].state - orbits[-2].state) / (values[k - 1] - values[k - 2])
            guess = guess + slope * (value - values[k - 1])
        try:
            orbits.append(periodic_orbit(scene, first.periods, guess, **{name: float(value)}))
        except ArithmeticError:
            if phases:
                search = Search(scene, name, (float(values[k - 1]), float(value)), (orbits[-1], orbits[-1]))
                found += search.end(phases[-1])
            break
        own = orbits[-1].phases
        phases += [] if own is None else [own]
        if k > 0:
            search = Search(scene, name, (float(values[k - 1]), float(value)), (orbits[-2], orbits[-1]))
            changes = search.phases(phases[-2], phases[-1]) if own is not None else []
            found += sorted([*changes, *([] if changes else search.multipliers())])
    known = np.asarray(values[: len(orbits)], dtype=float)
    pairs = tuple((at, words) for at, words, _ in found)
    return Branch(name, known, tuple(orbits), pairs, tuple(rest for _, _, rest in found), tuple(phases))


def skeleton(
    scene: Scene, name: str, values: Sequence[float] | np.ndarray, periods: Sequence[int] = (1, 2)
) -> tuple[Branch, ...]:
    """The skeleton of a bifurcation diagram: for each number of drive periods the branch of the orbit that the scene settles
    on, followed up and down from the first of `values` at which it is found; unstable orbits included.

    An orbit that is one of fewer periods is passed over; a number of periods without an orbit has no branch.
    Raises ValueError for an unknown parameter.
    """
    made = []
    for count in periods:
        start = next((k for k, value in enumerate(values) if _seed(scene, name, float(value), count) is not None), None)
        if start is None:
            continue
        first = _seed(scene, name, float(values[start]), count)
        if first is not None:
            made.append(follow(scene, name, [float(value) for value in values[start:]], first))
            if start > 0:
                made.append(follow(scene, name, [float(value) for value in values[start::-1]], first))
    return tuple(made)


def _seed(scene: Scene, name: str, value: float, periods: int) -> PeriodicOrbit | None:
    """The orbit that the scene settles on, if it has this number of periods and no fewer."""
    try:
        found = periodic_orbit(scene, periods, None, **{name: value})
        shorter = [k for k in range(1, periods) if periods % k == 0]
        return None if any(_repeats(found, k) for k in shorter) else found
    except ArithmeticError:
        return None


def _repeats(orbit: PeriodicOrbit, periods: int) -> bool:
    """True where an orbit is one of fewer periods, counted as often as it takes."""
    try:
        other = periodic_orbit(orbit.scene, periods, orbit.state)
    except ArithmeticError:
        return False
    return bool(np.abs(other.state - orbit.state).max() < 1e-7)


@dataclass(frozen=True, slots=True)
class Search:
    """Two neighbours on a branch, at the ends of a stretch of the parameter, between which bifurcations are looked for."""

    scene: Scene
    name: str
    ends: tuple[float, float]
    orbits: tuple[PeriodicOrbit, PeriodicOrbit]

    def orbit(self, value: float) -> PeriodicOrbit:
        """The orbit of the branch at a value between the ends."""
        (low, high), (before, after) = self.ends, self.orbits
        guess = before.state + (value - low) / (high - low) * (after.state - before.state)
        return periodic_orbit(self.scene, before.periods, guess, **{self.name: value})

    def multipliers(self) -> list[Found]:
        """The crossing of a real multiplier through -1 or 1."""
        found = []
        for at, words in ((-1.0, "period doubling"), (1.0, "fold")):
            ends = [_nearest(orbit, at) for orbit in self.orbits]
            if None in ends or ends[0] * ends[1] > 0.0:  # type: ignore[operator]
                continue

            def distance(value: float, at: float = at) -> float:
                return _nearest(self.orbit(value), at) or 0.0

            value = float(brentq(distance, *self.ends, xtol=1e-12))
            found.append((value, words, abs(distance(value))))
        return found

    def phases(self, before: Phases, after: Phases) -> list[Found]:
        """The change of phases between the ends, closed in on from the side with fewer phases."""
        if before.modes == after.modes:
            return []
        test = _test(before, after)
        few = before if len(before.modes) <= len(after.modes) else after
        low, high = self.ends if few is before else self.ends[::-1]
        at, residual = _close_in(self._at, few, low, high, test)
        return [(at, "stick loss" if test is _landing else "grazing", residual)]

    def end(self, last: Phases) -> list[Found]:
        """The grazing at which the branch ends, where Newton's method fails at the second end and `last` are the phases at
        the first; nothing where no gap has closed."""
        at, residual = _close_in(self._at, last, *self.ends, _gap)
        return [(at, "grazing", residual)] if residual < CLOSED else []

    def _at(self, value: float) -> Phases | None:
        try:
            return self.orbit(value).phases
        except ArithmeticError:
            return None


def _close_in(
    at: Callable[[float], Phases | None], few: Phases, low: float, high: float, test: Callable[[Phases], float]
) -> tuple[float, float]:
    """Where the phases `few` at `low` are lost on the way to `high`, and the test function at the last value that has
    them."""
    known = [(low, test(few))]
    while abs(high - low) > CLOSE * max(1.0, abs(low)):
        value = _propose(known, high)
        own = at(value)
        if own is None or own.modes != few.modes:
            high = value
        else:
            low = value
            known.append((low, test(own)))
    return 0.5 * (low + high), abs(known[-1][1])


def _propose(known: list[tuple[float, float]], high: float) -> float:
    """Where the line through the last two values of a test function is zero, kept off the ends of what is left."""
    low = known[-1][0]
    wanted = 0.5
    if len(known) > 1 and known[-1][1] != known[-2][1]:
        (a, f), (b, g) = known[-2:]
        wanted = -g * (b - a) / (g - f) / (high - low)
        wanted += 1e-3 if abs(wanted) < 1.0 else 0.0  # a little beyond: the zero is then closed in from both sides
    return low + (high - low) * (wanted if 0.0 < wanted < 1.0 and len(known) % 3 != 0 else 0.5)


def _landing(phases: Phases) -> float:
    return phases.landing


def _gap(phases: Phases) -> float:
    return phases.gap


def _test(before: Phases, after: Phases) -> Callable[[Phases], float]:
    """What becomes zero where phases change: the margin at a landing where stick alone comes or goes, else a gap."""
    slips = [tuple(mode for mode in phases.modes if mode != 0) for phases in (before, after)]
    same = sorted(slips[0]) == sorted(slips[1])
    return _landing if same and before.modes.count(0) != after.modes.count(0) else _gap


def _nearest(orbit: PeriodicOrbit, at: float) -> float | None:
    """How far the largest multiplier is from a point of the real axis; None where it is complex."""
    value = complex(orbit.multipliers[0])
    return value.real - at if value.imag == 0.0 else None
