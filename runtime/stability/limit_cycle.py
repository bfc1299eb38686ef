"""Limit cycles of undriven oscillators: Newton's method for the state and the period.

Unknown are the state x and the period T of flow(x, T) = x; the phase condition keeps the correction of x normal to the
motion. Source: Seydel, Practical Bifurcation and Stability Analysis, 3rd ed. (Springer, 2010), section 7.2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import islice
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from .motion import path, rests, shortest_time
from .orbits import OrbitProblem
from .variational_integrator import VariationalIntegrator

SAMPLES = 4096
"""Most steps of a path in which returns are looked for (a choice)."""

NEAR = 1e-3
"""Largest distance of a return from which Newton's method begins, relative to the extent of the motion (a choice)."""

RETURNS = 32
"""Most returns that are tried, and most parts of a period after which the state may be back (a choice)."""

MOST_STEPS = 12
"""Most steps of Newton's method: from a distance NEAR it needs four or five to rounding."""

APART = 10.0
"""Least distance of the other multipliers from the unit circle, in units of sqrt(rtol).

Conservative orbits have the multiplier 1 twice, which errors of size rtol split into 1 ± sqrt(rtol).
"""


class Cycle(NamedTuple):
    """A closed orbit."""

    state: np.ndarray  # (p,): a state on it
    period: float  # the time after which the state is back
    matrix: np.ndarray  # (p, p): derivative of the state a period later by the state
    steps: int  # steps of Newton's method


def limit_cycle(problem: OrbitProblem, start: np.ndarray, closed: float) -> Cycle | None:
    """Find the attracting cycle on which an undriven orbit has settled; None if there is none.

    `closed`: largest distance of a cycle's end from its begin, relative to the extent of each component.
    """
    alone = replace(problem, strengths=np.zeros_like(problem.strengths[:1]))
    if rests(problem.rates, start, closed, problem.extent):
        return None
    for time, extent in islice(_returns(alone, start), RETURNS):
        cycle = _newton(alone, start, time, extent, closed)
        if cycle is not None:
            cycle = _least(alone, cycle, extent, closed)
            # it attracts if all multipliers but that of the motion itself are well inside the unit circle
            multipliers = np.linalg.eigvals(cycle.matrix)
            others = np.delete(multipliers, np.abs(multipliers - 1.0).argmin())
            attracts = np.all(np.abs(others) < 1.0 - APART * math.sqrt(problem.scene.rtol))
            return cycle if attracts else None
    return None


def _returns(problem: OrbitProblem, start: np.ndarray) -> Iterator[tuple[float, np.ndarray]]:
    """Yield the times at which the orbit comes back through the plane normal to its motion, and its extent (p,) until then."""
    rates, integrator, time = problem.rates, _integrator(problem, start), 0.0
    normal = rates.values(start) / _scale(problem.extent) ** 2  # normal if each component is measured by its extent

    def side(state: np.ndarray) -> float:
        return float(normal @ (state[0] - start))

    for before, step, extent, _ in islice(path(integrator, rates, shortest_time(rates, start)), SAMPLES):
        if side(before) < 0.0 <= side(integrator.state):
            yield time + _passage(integrator, before, step, side), np.maximum(extent, NEAR * problem.extent)
        time += step


def _scale(extent: np.ndarray) -> np.ndarray:
    """The extents (p,), and 1 for a component that does not move."""
    return np.where(extent > 0.0, extent, 1.0)


def _integrator(problem: OrbitProblem, state: np.ndarray) -> VariationalIntegrator:
    """An integrator from a state that does not warn of short steps: its stretches are too short to have a mean."""
    integrator = problem.integrator(state[None])
    integrator.observes = True
    return integrator


def _passage(
    integrator: VariationalIntegrator, before: np.ndarray, step: float, side: Callable[[np.ndarray], float]
) -> float:
    """The time within the last step at which the orbit changed sides of a plane."""
    after = integrator.state
    ends = {0.0: side(before), step: side(after)}

    def side_after(time: float) -> float:
        if time in ends:
            return ends[time]
        integrator.state = before
        integrator.advance(time)
        return side(integrator.state)

    time = float(brentq(side_after, 0.0, step, xtol=1e-12 * step))
    integrator.state = after
    return time


def _newton(problem: OrbitProblem, start: np.ndarray, time: float, extent: np.ndarray, closed: float) -> Cycle | None:
    """The cycle near a state that is back after about some time; None if Newton's method leads elsewhere."""
    state, period, near, rates, scale = start, time, NEAR * extent, problem.rates, _scale(extent)
    for steps in range(MOST_STEPS):
        try:
            image, matrix = _flow(problem, state, period)
        except FloatingPointError:  # a correction that led far away
            return None
        gap = image - state
        if not np.all(np.abs(gap) <= near):
            return None
        if np.all(np.abs(gap) <= closed * extent + rates.rounding(image, period)):
            return Cycle(image, period, matrix, steps)
        # solve (M - 1) dx + f(image) dT = -gap, f(state) dx = 0, components in units of `scale`, times in those of T
        p = len(gap)
        here, there = (period * rates.values(x) / scale for x in (state, image))
        bordered = np.zeros((p + 1, p + 1))
        bordered[:p, :p], bordered[:p, p], bordered[p, :p] = matrix * scale / scale[:, None] - np.eye(p), there, here
        change = np.linalg.lstsq(bordered, np.append(-gap / scale, 0.0), rcond=None)[0]
        state, period = state + change[:-1] * scale, period + float(change[-1] * period)
        if not (abs(period - time) < 0.5 * time and np.all(np.abs(state - start) <= 10.0 * near)):
            return None
    return None


def _least(problem: OrbitProblem, cycle: Cycle, extent: np.ndarray, closed: float) -> Cycle:
    """The cycle with its least period: one integration looks whether the state is back after a part of the period."""
    integrator, time = _integrator(problem, cycle.state), 0.0
    near = math.sqrt(closed) * extent
    for parts in range(RETURNS, 1, -1):
        integrator.advance(cycle.period / parts - time)
        time = cycle.period / parts
        if np.all(np.abs(integrator.state[0] - cycle.state) <= near):
            part = _newton(problem, cycle.state, time, extent, closed)
            if part is not None and abs(part.period - time) < NEAR * time:
                return part
    return cycle


def _flow(problem: OrbitProblem, state: np.ndarray, period: float) -> tuple[np.ndarray, np.ndarray]:
    """The state a period later, and its derivative by the state."""
    integrator = problem.integrator(state[None])
    propagators, logarithms = problem.propagators(integrator, period / problem.unit)
    return integrator.state[0], propagators[0, 0].real * float(np.exp(logarithms[0, 0]))
