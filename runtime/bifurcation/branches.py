"""Branches of periodic orbits along a parameter, and the bifurcations on them.

A smooth bifurcation is a real multiplier that passes -1 or 1.  One of friction is a change of the phases of stick and slip:
grazing, where a phase begins in the middle of another one as its distance from it becomes zero, and stick loss, where a
body that landed in stick turns at once, as the load at the landing passes the limit of static friction.  How they are
located is said in `synchain.runtime.bifurcation.bifurcations`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real

import numpy as np

from synchain.models.inputs.checks import instance, shown
from synchain.models.scenes.scene import Scene

from .bifurcations import Bifurcation, bifurcations_at_end, bifurcations_between
from .continuation import Arc
from .periodic import PeriodicOrbit, periodic_orbit
from .phases import Phases

__all__ = ["Branch", "checked_values", "follow"]

SHORTEST = 1.0 / 32.0
"""Into pieces this short a step is cut, where Newton's method fails or leads far from what was expected, before the branch
ends."""

APART = 1.0 / 16.0
"""To pieces of this part of a step changes of phases are brought before they are located: two in one piece count as one."""

FAR = 0.3
"""An orbit farther from the expected state than this part of the step leads to another branch, perhaps."""

KINK = 1e-2
"""This far from the expected state an orbit may be in any case: a branch has a kink where its phases change."""


@dataclass(frozen=True, slots=True)
class Branch:
    """Periodic orbits along a parameter: values (k,), an orbit for each, and the bifurcations between them.

    bifurcations: (value of the parameter, "period doubling", "fold", "grazing" or "stick loss"); residuals: how far the
    multiplier is from -1 or 1 there, or the distance from the other phase, at the nearest orbit that was found; at: those
    orbits; phases: of each orbit on the branch, empty for friction that is not set-valued.  The branch ends where there is
    no orbit to be found, at a fold or a graze as a rule.
    """

    name: str
    values: np.ndarray
    orbits: tuple[PeriodicOrbit, ...]
    bifurcations: tuple[Bifurcation, ...]
    phases: tuple[Phases, ...] = ()


def follow(scene: Scene, name: str, values: Sequence[float] | np.ndarray, first: PeriodicOrbit) -> Branch:
    """Follow a periodic orbit along a parameter, from `first` at values[0] on, and locate its bifurcations.

    Raises ValueError for an unknown parameter and for values that do not rise, or fall, all the way, TypeError for a first
    orbit that is none, ArithmeticError where there is no orbit near `first` at values[0].
    """
    instance("first", first, PeriodicOrbit, "a PeriodicOrbit, such as periodic_orbit(scene) returns")
    wanted = checked_values(first.scene, name, values)
    tracer = BranchTracer(Arc(scene, name, first.periods))
    start = periodic_orbit(scene, first.periods, first.state, **{name: wanted[0]})
    orbits = [tracer.take(wanted[0], start, start.phases)]
    for value in wanted[1:]:
        orbit = tracer.on(value)
        if orbit is None:
            break
        orbits.append(orbit)
    phases = [tracer.phases[value] for value in wanted[: len(orbits)]]
    return Branch(
        name,
        np.array(wanted[: len(orbits)]),
        tuple(orbits),
        tuple(tracer.bifurcations),
        tuple(each for each in phases if each is not None),
    )


def checked_values(scene: Scene, name: str, values: Sequence[float] | np.ndarray) -> list[float]:
    """Values of a parameter as numbers; ValueError in words for what they cannot be."""
    if name not in scene.parameters:
        raise ValueError(f"unknown parameter {name!r}; known: {', '.join(scene.parameters)}")
    if not np.iterable(values) or not all(isinstance(value, Real) and math.isfinite(value) for value in values):
        raise ValueError(f"values: found {shown(values)}; expected finite numbers for {name}")
    wanted = [float(value) for value in values]
    steps = np.diff(wanted)
    if not wanted or not (np.all(steps > 0.0) or np.all(steps < 0.0)):
        raise ValueError(f"values: found {shown(wanted)}; expected at least one number, rising or falling all the way")
    return wanted


class BranchTracer:
    """A branch on which orbits are found one after the other, with the piece of it that is smooth up to the last one."""

    def __init__(self, arc: Arc) -> None:
        self.arc = arc
        self.bifurcations: list[Bifurcation] = []
        self.phases: dict[float, Phases | None] = {}
        self.least: int | None = None

    def take(self, value: float, orbit: PeriodicOrbit, phases: Phases | None) -> PeriodicOrbit:
        """Add an orbit, after the bifurcations on the way to it."""
        self.phases[value] = phases
        self.least = self.least or orbit.least
        if self.arc.values:
            way = sorted(
                bifurcations_between(self.arc, value, orbit, phases),
                key=lambda each: abs(each.value - self.arc.values[-1]),
            )
            self.bifurcations += way
            last = self.arc.phases[-1]
            if last is not None and phases is not None and last.slip_states != phases.slip_states:
                self.arc = self.arc.empty()
        self.arc.take(value, orbit, phases)
        return orbit

    def on(self, value: float) -> PeriodicOrbit | None:
        """The orbit at the next value, through others between where the step is long; None where the branch ends."""
        step = abs(value - self.arc.values[-1])
        ahead = [value]
        while ahead:
            last = self.arc.values[-1]
            orbit = self._orbit(ahead[-1])
            phases = None if orbit is None else orbit.phases
            if orbit is not None and (abs(ahead[-1] - last) <= APART * step or not self._changes(phases)):
                self.take(ahead.pop(), orbit, phases)
            elif orbit is not None or abs(ahead[-1] - last) > SHORTEST * step:
                ahead.append(0.5 * (last + ahead[-1]))
            else:
                self.bifurcations += bifurcations_at_end(self.arc, ahead[-1])
                return None
        return self.arc.orbits[-1]

    def _changes(self, phases: Phases | None) -> bool:
        """True where phases are others than those of the last orbit."""
        last = self.arc.phases[-1]
        return phases is not None and last is not None and phases.slip_states != last.slip_states

    def _orbit(self, value: float) -> PeriodicOrbit | None:
        """The orbit at a value, if Newton's method finds one close to where it is expected."""
        try:
            orbit = self.arc.at(value)
        except ArithmeticError:
            return None
        guess, last = self.arc.guess(value), self.arc.orbits[-1].state
        near = FAR * float(np.abs(guess - last).max()) + KINK
        if len(self.arc.values) > 1 and not float(np.abs(orbit.state - guess).max()) < near:
            return None
        return orbit if self.least in (None, orbit.least) else None
