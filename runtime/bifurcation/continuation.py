"""Continuation of periodic orbits along a smooth arc of their branch, and through a fold.

All orbits of an arc pass through the same phases of stick and slip. Newton's method starts from a
polynomial through the nearest known orbits, so that it stays on the arc if the branch has a kink,
as it has at a change of phases.

At a fold the branch turns back in its parameter and a multiplier is 1, so that the parameter alone
does not lead on. Pseudo-arclength continuation passes through it: state and parameter are unknowns
together, and the length along the arc is prescribed.

Sources: Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems, in Rabinowitz
(ed.), Applications of Bifurcation Theory (Academic Press, 1977), pages 359-384; Seydel, Practical
Bifurcation and Stability Analysis, 3rd ed. (Springer, 2010), chapter 4.
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
"""Number of orbits that the polynomial passes through."""


MOST_STEPS = 24
"""Most steps along the arc towards a fold, each at most twice as long as the one before."""

SHORTEST = 1e-7
"""Shortest step, relative to the first; if a step must be shorter, the arc does not end at a fold.
"""

DIFFERENCE = 1e-6
"""Relative step of the difference quotient for the derivative by the parameter."""


@dataclass(slots=True)
class Arc:
    """Orbits along a parameter, in the order in which they were found.

    Parameters
    ----------
    scene : Scene
        Scene of the orbits.
    name : str
        Name of the parameter.
    periods : int
        Drive periods of each orbit.
    values : list of float
        Values of the parameter.
    orbits : list of PeriodicOrbit
        Orbit at each value.
    phases : list of Phases or None
        Phases of each orbit; None for friction that is not set-valued.
    """

    scene: Scene
    name: str
    periods: int
    values: list[float] = field(default_factory=list)
    orbits: list[PeriodicOrbit] = field(default_factory=list)
    phases: list[Phases | None] = field(default_factory=list)

    def take(self, value: float, orbit: PeriodicOrbit, phases: Phases | None) -> Arc:
        """Append an orbit and return the arc.

        Parameters
        ----------
        value : float
            Value of the parameter.
        orbit : PeriodicOrbit
            Orbit at the value.
        phases : Phases or None
            Phases of the orbit.
        """
        self.values.append(value)
        self.orbits.append(orbit)
        self.phases.append(phases)
        return self

    def empty(self) -> Arc:
        """Return an arc of the same scene without orbits."""
        return Arc(self.scene, self.name, self.periods)

    def copy(self) -> Arc:
        """Return an arc with the same orbits, which can be extended independently."""
        return Arc(self.scene, self.name, self.periods, [*self.values], [*self.orbits], [*self.phases])

    def guess(self, value: float) -> np.ndarray:
        """Extrapolate the state of the orbit, shape (components,), at a value of the parameter."""
        order = np.argsort(np.abs(np.array(self.values) - value), kind="stable")[:NEAR].tolist()
        state = np.zeros_like(self.orbits[-1].state)
        for k in order:
            share = math.prod((value - self.values[j]) / (self.values[k] - self.values[j]) for j in order if j != k)
            state += share * self.orbits[k].state
        return state

    def at(self, value: float) -> PeriodicOrbit:
        """Find the orbit at a value of the parameter.

        Raises
        ------
        ArithmeticError
            If Newton's method does not find it.
        """
        return periodic_orbit(self.scene, self.periods, self.guess(value), parameters={self.name: value})


def find_fold(arc: Arc, beyond: float) -> tuple[float, PeriodicOrbit] | None:
    """Find the fold at which an arc turns back before a value of its parameter.

    Parameters
    ----------
    arc : Arc
        Arc with at least two orbits.
    beyond : float
        Value of the parameter past the fold.

    Returns
    -------
    tuple of (float, PeriodicOrbit) or None
        Value of the parameter and orbit at the fold; None if the arc does not turn back.
    """
    if len(arc.values) < 2:
        return None
    slip_states = None if arc.phases[-1] is None else arc.phases[-1].slip_states
    here, before = (np.append(arc.orbits[k].state, arc.values[k]) for k in (-1, -2))
    way = ArclengthStep(arc, here, here - before)
    length, side = float(np.linalg.norm(here - before)), way.side(here)
    shortest = SHORTEST * length
    for _ in range(MOST_STEPS):
        there = way.point(length)
        if there is None or _slip_states(way.orbit(there)) != slip_states:
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


def _slip_states(orbit: PeriodicOrbit) -> tuple[int, ...] | None:
    """Slip states of an orbit's phases, None for friction that is not set-valued."""
    phases = orbit.phases
    return None if phases is None else phases.slip_states


@dataclass(slots=True)
class ArclengthStep:
    """A step from a point (state, parameter) of an arc along a direction.

    Parameters
    ----------
    arc : Arc
        Arc that is continued.
    start : ndarray, shape (components + 1,)
        State and parameter at the start.
    along : ndarray, shape (components + 1,)
        Direction, of any length.
    """

    arc: Arc
    start: np.ndarray
    along: np.ndarray

    def orbit(self, point: np.ndarray) -> PeriodicOrbit:
        """Return the periodic orbit at a point."""
        return orbit_through(self.arc.scene, self.arc.periods, point[:-1], {self.arc.name: float(point[-1])})

    def side(self, point: np.ndarray) -> float:
        """Return det(M - 1) of the monodromy matrix M at a point: zero at a fold."""
        return float(np.prod(self.orbit(point).multipliers - 1.0).real)

    def point(self, length: float) -> np.ndarray | None:
        """Find the point of the arc at a length from the start, measured along the direction.

        Parameters
        ----------
        length : float
            Length.

        Returns
        -------
        ndarray, shape (components + 1,), or None
            State and parameter; None if Newton's method does not converge.
        """
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
        """Locate the fold between the start and a length."""

        def side(at: float) -> float:
            point = self.start if at == 0.0 else self.point(at)
            if point is None:
                raise ArithmeticError("the arc of a branch is lost close to its fold")
            return self.side(point)

        at = float(brentq(side, 0.0, length, xtol=1e-13, rtol=1e-13))
        point = self.point(at)
        return None if point is None else (float(point[-1]), self.orbit(point))

    def _image(self, state: np.ndarray, value: float) -> tuple[np.ndarray, np.ndarray]:
        """The state some periods later, and its derivative by the state."""
        image, matrix = strobe(self.arc.scene, state, self.arc.periods, {self.arc.name: value})
        return image[: len(state)], matrix

    def _slope(self, point: np.ndarray) -> np.ndarray:
        """Derivative of the state some periods later by the parameter."""
        step = DIFFERENCE * max(1.0, abs(point[-1]))
        ends = [self._image(point[:-1], float(point[-1]) + sign * step)[0] for sign in (1.0, -1.0)]
        return np.asarray((ends[0] - ends[1]) / (2.0 * step))
