"""Compute the largest exponent of all transversal modes of a network at points of its parameters."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from synchain.models.dynamics.variational import mode
from synchain.models.inputs.checks import check_integer
from synchain.models.scenes.scene import Scene

from ..cells.run_keywords import with_numbers
from .attractor import Attractor, Motion
from .averages import Averaging
from .exponents import along, orbits_of
from .motion import Spread
from .orbits import OrbitProblem
from .transversal_modes import SharedOrbit, still_strengths

SAMPLES, UNITS = 256, 32
"""Number of samples of a motion, over one cycle or over UNITS units of time (choices)."""


@dataclass(frozen=True, slots=True)
class LargestExponents:
    """Largest exponents at some points of parameters."""

    exponent: np.ndarray  # (points,): largest exponent of all modes, per unit of non-dimensional time
    stderr: np.ndarray  # (points,): its standard error
    mode: np.ndarray  # (points,): index of the mode with the largest exponent
    kinds: np.ndarray  # (points, starts): kind of motion of each start
    spreads: tuple[Spread, ...]  # mean and extent of the motion of the scene's own start on each orbit
    time: float  # length of the longest average


def largest_exponents(
    cell: Scene, orbits: Sequence[SharedOrbit], starts: int, averaging: Averaging
) -> LargestExponents:
    """Compute the largest exponents at the cells of several orbits, one synchronous orbit after the other."""
    points = sum(len(orbit.cells) for orbit in orbits)
    exponent, stderr, worst = np.empty(points), np.empty(points), np.empty(points, dtype=int)
    kinds, longest = np.empty((points, check_integer("starts", starts, 1)), dtype=object), 0.0
    spreads: list[Spread] = []
    with averaging.reporter(len(orbits)) as reporter:
        for done, orbit in enumerate(orbits, start=1):
            problem, states = orbits_of(with_numbers(cell, orbit.parameters), orbit.strengths, starts, averaging)
            found = along(problem, states, orbit.strengths, averaging.in_units(cell, problem.unit), reporter)
            # keep the mode with the largest exponent at each point
            table, points_of_orbit = found.exponent[orbit.place], np.arange(len(orbit.cells))
            worst[orbit.cells] = largest = table.argmax(axis=1)
            exponent[orbit.cells] = table[points_of_orbit, largest]
            stderr[orbit.cells] = found.stderr[orbit.place][points_of_orbit, largest]
            kinds[orbit.cells] = [attractor.kind for attractor in found.attractors]
            spreads.append(_spread(problem, found.attractors[0]))
            longest = max(longest, found.time)
            reporter.advance(max(reporter.total * done / len(orbits) - reporter.done, 0.0))
    return LargestExponents(exponent, stderr, worst, kinds.astype(str), tuple(spreads), longest)


def _spread(problem: OrbitProblem, attractor: Attractor) -> Spread:
    """Return the mean and the extent (p,) of the motion on an attractor; 0 at rest, and for angles, which may turn."""
    count = problem.variation.orbit.continuous_dimension
    states = np.zeros((SAMPLES, count))
    if attractor.state is not None and attractor.motion not in (Motion.LINEAR, Motion.FIXED_POINT):
        integrator = problem.integrator(attractor.state[None], problem.strengths[:1])
        for k in range(SAMPLES):
            integrator.advance((attractor.cycle or UNITS * problem.unit) / SAMPLES)
            states[k] = integrator.state[0, :count]
        states[:, np.array([period is not None for period in problem.rates.periods[:count]])] = 0.0
    return Spread.of(states)


def check_parameters(what: str, cell: Scene, values: Mapping[str, Iterable[float]]) -> None:
    """Raise ValueError for a value out of range, or for a parameter on which no exponent depends."""
    still, of_orbit = still_strengths(cell), mode(cell.equations).orbit.parameters
    for name, numbers in values.items():
        for number in numbers:
            with_numbers(cell, {name: number})
        if name not in still and name not in of_orbit:
            names = ", ".join((*of_orbit, *sorted(still)))
            raise ValueError(f"{what}: no exponent depends on {name!r}; expected one of {names}")
