"""Folds: where a branch of periodic orbits turns back in its parameter, found by following it along its arc.

State and parameter are unknowns together, and the length along the arc is given (pseudo-arclength continuation), so
Newton's method goes through the fold, at which a multiplier is 1 and the parameter alone does not lead on.

Source: Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems, in Rabinowitz (ed.), Applications of
Bifurcation Theory (Academic Press, 1977), pages 359-384; Seydel, Practical Bifurcation and Stability Analysis, 3rd ed.
(Springer, 2010), chapter 4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from .arcs import Arc
from .periodic import PeriodicOrbit, orbit_through, strobe

__all__ = ["find_fold"]

MOST_STEPS = 24
"""Steps along the arc on the way to a fold, each at most twice as long as the one before."""

SHORTEST = 1e-7
"""Where the way must be cut into pieces shorter than this, relative to the first, the arc ends otherwise."""

DIFFERENCE = 1e-6
"""Step of the difference for the derivative by the parameter, relative to it."""


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
