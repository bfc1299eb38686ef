"""A smooth piece of a branch of periodic orbits, along which all pass through the same phases of stick and slip.

Newton's method starts from a polynomial through the nearest orbits that are known, so that it stays on the piece where
the branch beside it has a kink, as it has where a phase comes or goes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import brentq

from synchain.models.scenes.scene import Scene

from .periodic import PeriodicOrbit, orbit_through, periodic_orbit, strobe
from .phases import Phases

__all__ = ["Arc", "find_fold"]

NEAR = 3
"""Orbits that the polynomial goes through."""


MOST_STEPS = 24
"""Steps along the arc on the way to a fold, each at most twice as long as the one before."""

SHORTEST = 1e-7
"""Where the way must be cut into pieces shorter than this, relative to the first, the arc ends otherwise."""

DIFFERENCE = 1e-6
"""Step of the difference for the derivative by the parameter, relative to it."""


@dataclass(slots=True)
class Arc:
    """Orbits of `periods` drive periods at values of the parameter `name`, in the order in which they were found, with
    their phases (None for friction that is not set-valued)."""

    scene: Scene
    name: str
    periods: int
    values: list[float] = field(default_factory=list)
    orbits: list[PeriodicOrbit] = field(default_factory=list)
    phases: list[Phases | None] = field(default_factory=list)

    def take(self, value: float, orbit: PeriodicOrbit, phases: Phases | None) -> Arc:
        """Add an orbit at the end, and return the arc."""
        self.values.append(value)
        self.orbits.append(orbit)
        self.phases.append(phases)
        return self

    def empty(self) -> Arc:
        """An arc of the same scene without orbits."""
        return Arc(self.scene, self.name, self.periods)

    def guess(self, value: float) -> np.ndarray:
        """The state (components,) that the nearest orbits let expect at a value."""
        order = np.argsort(np.abs(np.array(self.values) - value), kind="stable")[:NEAR].tolist()
        made = np.zeros_like(self.orbits[-1].state)
        for k in order:
            share = math.prod((value - self.values[j]) / (self.values[k] - self.values[j]) for j in order if j != k)
            made += share * self.orbits[k].state
        return made

    def at(self, value: float) -> PeriodicOrbit:
        """The orbit at a value; ArithmeticError where Newton's method does not find it."""
        return periodic_orbit(self.scene, self.periods, self.guess(value), **{self.name: value})


def find_fold(arc: Arc, beyond: float) -> tuple[float, PeriodicOrbit] | None:
    """The value of the parameter and the orbit where the arc turns back before `beyond`; None where it does not."""
    if len(arc.values) < 2:
        return None
    modes = None if arc.phases[-1] is None else arc.phases[-1].slip_states
    here, before = (np.append(arc.orbits[k].state, arc.values[k]) for k in (-1, -2))
    way = ArclengthStep(arc, here, here - before)
    length, side = float(np.linalg.norm(here - before)), way.side(here)
    shortest = SHORTEST * length
    for _ in range(MOST_STEPS):
        there = way.point(length)
        if there is None or _modes(way.orbit(there)) != modes:
            length *= 0.25
            if length < shortest:
                return None
            continue
        if way.side(there) * side < 0.0:
            return way.root(length)
        if not (beyond - there[-1]) * (there[-1] - way.start[-1]) > 0.0:  # past the end, or back without a fold
            return None
        way = ArclengthStep(arc, there, there - way.start)
        length *= 2.0
    return None


def _modes(orbit: PeriodicOrbit) -> tuple[int, ...] | None:
    phases = orbit.phases
    return None if phases is None else phases.slip_states


@dataclass(slots=True)
class ArclengthStep:
    """From a point (state, parameter) of an arc on along a direction."""

    arc: Arc
    start: np.ndarray
    along: np.ndarray

    def orbit(self, point: np.ndarray) -> PeriodicOrbit:
        """The periodic orbit at a point."""
        return orbit_through(self.arc.scene, self.arc.periods, point[:-1], **{self.arc.name: float(point[-1])})

    def side(self, point: np.ndarray) -> float:
        """det(M - 1) at a point: zero at the fold."""
        return float(np.prod(self.orbit(point).multipliers - 1.0).real)

    def point(self, length: float) -> np.ndarray | None:
        """The point of the arc at a length from the start, measured along the direction; None where there is none."""
        unit = self.along / np.linalg.norm(self.along)
        guess = self.start + length * unit
        slope = self._slope(guess)
        point, best = guess, np.inf
        for _ in range(30):
            image, matrix = self._image(point[:-1], float(point[-1]))
            rest = np.append(image - point[:-1], unit @ (point - guess))
            size = float(np.abs(rest).max())
            if not size < best:
                break
            best, kept = size, point
            rows = np.column_stack([matrix - np.eye(len(image)), slope])
            try:
                point = point - np.linalg.solve(np.vstack([rows, unit]), rest)
            except np.linalg.LinAlgError:
                return None
        return kept if best < 1e-11 else None

    def root(self, length: float) -> tuple[float, PeriodicOrbit] | None:
        """The fold between the start and a length."""

        def side(at: float) -> float:
            point = self.start if at == 0.0 else self.point(at)
            if point is None:
                raise ArithmeticError("the arc of a branch is lost close to its fold")
            return self.side(point)

        at = float(brentq(side, 0.0, length, xtol=1e-13, rtol=1e-13))
        point = self.point(at)
        return None if point is None else (float(point[-1]), self.orbit(point))

    def _image(self, state: np.ndarray, value: float) -> tuple[np.ndarray, np.ndarray]:
        image, matrix = strobe(self.arc.scene, state, self.arc.periods, **{self.arc.name: value})
        return image[: len(state)], matrix

    def _slope(self, point: np.ndarray) -> np.ndarray:
        """The derivative of the state some periods later by the parameter."""
        step = DIFFERENCE * max(1.0, abs(point[-1]))
        ends = [self._image(point[:-1], float(point[-1]) + sign * step)[0] for sign in (1.0, -1.0)]
        return np.asarray((ends[0] - ends[1]) / (2.0 * step))
