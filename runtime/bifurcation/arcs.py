"""A smooth piece of a branch of periodic orbits, along which all pass through the same phases of stick and slip.

Newton's method starts from a polynomial through the nearest orbits that are known, so that it stays on the piece where
the branch beside it has a kink, as it has where a phase comes or goes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from synchain.models.scenes.scene import Scene

from .periodic import PeriodicOrbit, periodic_orbit
from .phases import Phases

__all__ = ["Arc"]

NEAR = 3
"""Orbits that the polynomial goes through."""


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
