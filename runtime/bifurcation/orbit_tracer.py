"""Follow branches of periodic orbits along a parameter, and locate the bifurcations on each branch.

A smooth bifurcation is a multiplier that passes the unit circle: at -1, at 1, or in a complex pair.  A bifurcation of
friction is a change of the phases of stick and slip.  In grazing, a phase begins in the middle of another phase, where
a margin becomes zero.  In stick loss, a body that landed in stick turns at once, as the load at the landing passes the
limit of static friction.  `synchain.runtime.bifurcation.bifurcations` locates them.

The tracer doubles its step after each orbit. It halves a step if no orbit fits the arc, if a bifurcation on the step is
not located, or if phases change on a long step. After refused steps, it looks for a bifurcation that ends the branch.

Sources: as `synchain.runtime.bifurcation.continuation`; di Bernardo, Budd, Champneys & Kowalczyk, Piecewise-smooth
Dynamical Systems (Springer, 2008), chapters 7-8, for friction.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from numbers import Real

import numpy as np

from synchain.models.inputs.checks import short_repr
from synchain.models.inputs.names import expect_free
from synchain.models.scenes.scene import Scene

from ..cells.run_keywords import Given
from .bifurcations import bifurcations_at_end, bifurcations_between, located
from .continuation import Arc
from .periodic import PeriodicOrbit, periodic_orbit, relative
from .phases import Phases
from .results import NAMES, Bifurcation, Branch

LONGEST = 1.0 / 4.0
"""Longest step, relative to the range of the parameter (a choice)."""

SHORT = 1.0 / 32.0
"""Length of a refused step, relative to the range or to the last such step, at which the branch's end is sought (a
choice)."""

SHORTEST = 2.0**-20
"""Shortest step, relative to the range; if it is refused too, the branch is lost (a choice)."""

APART = 1.0 / 64.0
"""Longest step, relative to the range, in which a change of phases is located; two changes in one count as one (a
choice)."""

FAR = 0.3
"""Largest distance from the expected state, relative to the step, of an orbit of other phases on the same branch (a
choice)."""

KINK = 1e-2
"""Distance from the expected state that such an orbit may always have, relative to its extent: a change of phases is a
kink of
the branch (a choice)."""


def others(keywords: Given, scene: Scene, name: str) -> Scene:
    """Return a scene with other parameters than the one along which a branch is followed."""
    if name in keywords.values:
        function = keywords.function.__name__
        raise ValueError(f"{function}: {name!r} takes its values one after the other; expected others")
    return keywords.scene(scene)


def traced(scene: Scene, name: str, values: Iterable[float], first: PeriodicOrbit, span: float) -> Branch:
    """Follow a periodic orbit along checked values of a parameter with a range of length `span`, as `follow` does."""
    tracer = BranchTracer(Arc(scene, name, first.periods, span))
    orbits: dict[float, PeriodicOrbit] = {}
    for value in values:
        if orbits:
            orbit = tracer.on(value)
        else:
            start = periodic_orbit(scene, first.periods, first.state, parameters={name: value})
            orbit = tracer.take(value, start, start.phases)
        if orbit is None:
            break
        orbits[value] = orbit
    phases = [tracer.phases[value] for value in orbits]
    outside = [int((np.abs(orbit.multipliers) > 1.0).sum()) for orbit in orbits.values()]
    return Branch(
        name,
        np.array(list(orbits)),
        tuple(orbits.values()),
        tuple(tracer.bifurcations),
        np.array(outside),
        np.array(list(orbits)),
        tuple(each for each in phases if each is not None),
        tracer.lost,
    )


def checked_values(scene: Scene, name: str, values: Sequence[float] | np.ndarray) -> list[float]:
    """Check the values (k,) of a parameter: finite, and rising or falling all the way; return them as floats."""
    if name not in scene.parameters:
        raise ValueError(f"unknown parameter {name!r}; known: {', '.join(scene.parameters)}")
    expect_free("branch", [name], NAMES)
    if not np.iterable(values) or not all(isinstance(value, Real) and math.isfinite(value) for value in values):
        raise ValueError(f"values: found {short_repr(values)}; expected finite numbers for {name}")
    checked = [float(value) for value in values]
    steps = np.diff(checked)
    if not checked or not (np.all(steps > 0.0) or np.all(steps < 0.0)):
        raise ValueError(
            f"values: found {short_repr(checked)}; expected at least one number, rising or falling all the way"
        )
    return checked


class BranchTracer:
    """Trace a branch orbit by orbit, from the last orbit of a smooth arc."""

    def __init__(self, arc: Arc) -> None:
        self.arc = arc
        self.bifurcations: list[Bifurcation] = []
        self.phases: dict[float, Phases | None] = {}  # by value of the parameter
        self.least: int | None = None  # least number of drive periods of all orbits
        self.lost: tuple[float, ...] = ()
        self.step = LONGEST * arc.span

    def take(
        self, value: float, orbit: PeriodicOrbit, phases: Phases | None, crossed: Sequence[Bifurcation] = ()
    ) -> PeriodicOrbit:
        """Append an orbit, after the bifurcations that the step to it crosses."""
        self.phases[value] = phases
        self.least = self.least or orbit.least
        if self.arc.values:
            self.bifurcations += sorted(crossed, key=lambda each: abs(each.value - self.arc.values[-1]))
            if self._changes(phases):
                self.arc = self.arc.empty()
        self.arc.take(value, orbit, phases)
        return orbit

    def on(self, value: float) -> PeriodicOrbit | None:
        """Find the orbit at the next value by steps whose length follows the branch alone, None if the branch ends."""
        span, longest, sought = self.arc.span, np.inf, SHORT * self.arc.span
        while (last := self.arc.values[-1]) != value:
            step = min(self.step, longest)
            length = min(step, abs(value - last))
            at = value if step >= abs(value - last) else last + math.copysign(step, value - last)
            next_orbit = self._orbit_on_branch(at)
            # The next orbit sticks and slips in another order: halve the step until the parameter of the change is bracketed.
            if next_orbit is not None and length > APART * span and self._changes(next_orbit[1]):
                longest = 0.5 * length
                continue
            # Accept the orbit if every bifurcation on the step is located.
            crossed = None if next_orbit is None else bifurcations_between(self.arc, at, *next_orbit)
            if next_orbit is not None and crossed is not None and all(map(located, crossed)):
                longest = np.inf if self._changes(next_orbit[1]) else longest
                self.take(at, *next_orbit, crossed)
                self.step = max(self.step, min(2.0 * length, LONGEST * span))
                continue
            # A refused step: the branch ends within its double, or the step is too long.
            if length <= max(sought, SHORTEST * span):
                sought = SHORT * length
                beyond = value if 2.0 * length > abs(value - last) else last + 2.0 * (at - last)
                final = length <= SHORTEST * span
                end = bifurcations_at_end(self.arc, beyond, final)
                if end or final:
                    self.bifurcations += end
                    self.lost = () if end else (last,)
                    return None
            self.step = 0.5 * length
        return self.arc.orbits[-1]

    def _changes(self, phases: Phases | None) -> bool:
        """Return whether phases differ from those of the last orbit."""
        last = self.arc.phases[-1]
        return phases is not None and last is not None and phases.slip_states != last.slip_states

    def _orbit_on_branch(self, value: float) -> tuple[PeriodicOrbit, Phases | None] | None:
        """Find the orbit at a value and its phases; None if Newton's method finds none, or one of another branch."""
        try:
            orbit = self.arc.at(value)
        except ArithmeticError:
            return None
        if self.least not in (None, orbit.least):
            return None
        phases = orbit.phases
        if not self._changes(phases):
            return (orbit, phases) if self.arc.joins(value, orbit) else None
        # Orbits of other phases have other tangents: compare with the extrapolated state.
        expected, last = self.arc.guess(value), self.arc.orbits[-1]
        allowed = FAR * relative(expected - last.state, last.extent) + KINK
        near = len(self.arc.values) == 1 or relative(orbit.state - expected, last.extent) < allowed
        return (orbit, phases) if near else None
