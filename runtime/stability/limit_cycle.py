"""Find limit cycles of undriven oscillators by Newton's method for the state and the period.

The unknowns are the state x and the period T, and the equation is flow(x, T) = x, but for whole turns of angles. A
phase condition keeps the correction of x normal to the motion. Source: Seydel, Practical Bifurcation and Stability Analysis, 3rd ed.
(Springer, 2010), section 7.2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from .motion import OrbitIntegrator, RateFunctions, path, shortest_time
from .orbits import OrbitProblem
from .variational_integrator import VariationalIntegrator

SAMPLES = 4096
"""Largest number of steps of a path that is searched for returns (a choice)."""

NEAR = 1e-3
"""Newton's method begins at a return only if the return is closer than NEAR times the extent of the motion (a
choice)."""

FREE, PARTS = 256, 16
"""A free state is searched for FREE times in steps of 1/PARTS of a unit of time (choices)."""

RETURNS = 32
"""Largest number of returns that are tried, and largest n for which period / n is tested as a period (a choice)."""

MOST_STEPS = 12
"""Largest number of Newton steps; from a distance NEAR, four or five steps reach rounding."""

APART = 10.0
"""A cycle attracts if all multipliers but one are further inside the unit circle than APART times sqrt(rtol).

A conservative orbit has a double multiplier 1, which errors of size rtol split into 1 ± sqrt(rtol).
"""


class Cycle(NamedTuple):
    """A closed orbit."""

    state: np.ndarray  # (p,): a state on the orbit
    period: float  # the time after which the orbit returns to the state
    matrix: np.ndarray  # (p, p): derivative of the state one period later with respect to the state
    steps: int  # number of Newton steps


def limit_cycle(problem: OrbitProblem, start: np.ndarray, closed: float) -> Cycle | None:
    """Find the attracting cycle that an undriven orbit has reached; return None if there is no such cycle.

    `closed`: largest distance between the start and the end of a cycle, relative to the extent of each component.
    """
    alone = replace(problem, strengths=np.zeros_like(problem.strengths[:1]))
    start = _free(alone, start)
    if problem.rests(start, closed):
        return None
    for time, extent in islice(returns(partial(_integrator, alone), alone.rates, alone.extent, start), RETURNS):
        cycle = _newton(alone, start, time, extent, closed)
        if cycle is not None:
            cycle = _least(alone, cycle, extent, closed)
            # the cycle attracts if all multipliers, except the multiplier 1 along the motion, are inside the unit
            # circle
            multipliers = np.linalg.eigvals(cycle.matrix)
            others = np.delete(multipliers, np.abs(multipliers - 1.0).argmin())
            attracts = np.all(np.abs(others) < 1.0 - APART * math.sqrt(problem.scene.rtol))
            return cycle if attracts else None
    return None


def returns(
    begin: Callable[[np.ndarray], OrbitIntegrator], rates: RateFunctions, extent: np.ndarray, start: np.ndarray
) -> Iterator[tuple[float, np.ndarray]]:
    """Yield each return of the orbit through the plane normal to its motion: the time, and the extent (p,) so far.

    `begin` returns an integrator that begins at a state; `extent` (p,) is that of the motion.
    """
    integrator, time = begin(start), 0.0
    # A motion that turns all the way round extends over a turn.
    turns = np.array([math.inf if period is None else period for period in rates.periods])
    turns = np.pad(turns, (0, len(start) - len(turns)), constant_values=math.inf)
    normal = rates.values(start) / _scale(np.minimum(extent, turns)) ** 2  # in units of the extent of each component

    def side(state: np.ndarray) -> float:
        return float(normal @ rates.difference(state[0], start))

    for before, step, moved, _ in islice(path(integrator, rates, shortest_time(rates, start)), SAMPLES):
        if side(before) < 0.0 <= side(integrator.state):
            yield time + _passage(integrator, before, step, side), np.minimum(np.maximum(moved, NEAR * extent), turns)
        time += step


def _free(problem: OrbitProblem, start: np.ndarray) -> np.ndarray:
    """Return the first state of an orbit (p,) that no contact, stop or surface holds; `start` if there is none."""
    integrator, size, state = _integrator(problem, start), problem.variation.orbit.continuous_dimension, start
    for _ in range(FREE):
        if np.all(state[size:] != 0.0):
            return state
        integrator.advance(problem.unit / PARTS)
        state = integrator.state[0]
    return start


def _scale(extent: np.ndarray) -> np.ndarray:
    """Return the extents (p,), with 1 for a component that does not move."""
    return np.where(extent > 0.0, extent, 1.0)


def _integrator(problem: OrbitProblem, state: np.ndarray) -> VariationalIntegrator:
    """Return an integrator from a state that never warns of short steps: its runs are too short for a mean."""
    integrator = problem.integrator(state[None])
    integrator.observes = True
    return integrator


def _passage(
    integrator: OrbitIntegrator, before: np.ndarray, step: float, side: Callable[[np.ndarray], float]
) -> float:
    """Return the time within the last step at which the orbit crossed a plane."""
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
    """Return the cycle near a state, with a period near `time`; None if Newton's method leaves the neighbourhood."""
    p, rates = (
        problem.variation.orbit.continuous_dimension,
        problem.rates,
    )  # the modes of contacts follow from the p continuous states
    state, period, near, scale = start, time, NEAR * extent[:p], _scale(extent[:p])
    for steps in range(MOST_STEPS):
        try:
            image, matrix = _flow(problem, state, period)
        except FloatingPointError:  # the last correction led too far away
            return None
        gap = rates.difference(image, state)[:p]
        if not np.all(np.abs(gap) <= near):
            return None
        if np.all(np.abs(gap) <= closed * extent[:p] + rates.rounding(image, period)[:p]):
            return Cycle(image, period, matrix, steps)
        # solve (M - 1) dx + f(image) dT = -gap, f(state) dx = 0, components in units of `scale`, times in those of T
        here, there = (period * rates.values(x)[:p] / scale for x in (state, image))
        bordered = np.zeros((p + 1, p + 1))
        bordered[:p, :p], bordered[:p, p], bordered[p, :p] = matrix * scale / scale[:, None] - np.eye(p), there, here
        change = np.linalg.lstsq(bordered, np.append(-gap / scale, 0.0), rcond=None)[0]
        moved, period = np.append(state[:p] + change[:-1] * scale, state[p:]), period + float(change[-1] * period)
        if not (abs(period - time) < 0.5 * time and np.all(np.abs(moved - start)[:p] <= 10.0 * near)):
            return None
        try:
            state = problem.with_slip_states(moved[None])[0]
        except ValueError:  # behind a stop or a guard
            return None
    return None


def _least(problem: OrbitProblem, cycle: Cycle, extent: np.ndarray, closed: float) -> Cycle:
    """Return the cycle with its least period: test by one integration whether a fraction of the period is one."""
    integrator, time = _integrator(problem, cycle.state), 0.0
    near = math.sqrt(closed) * extent
    for parts in range(RETURNS, 1, -1):
        integrator.advance(cycle.period / parts - time)
        time = cycle.period / parts
        if np.all(np.abs(problem.rates.difference(integrator.state[0], cycle.state)) <= near):
            part = _newton(problem, cycle.state, time, extent, closed)
            if part is not None and abs(part.period - time) < NEAR * time:
                return part
    return cycle


def _flow(problem: OrbitProblem, state: np.ndarray, period: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the state one period later, and its derivative with respect to the state."""
    integrator = problem.integrator(state[None])
    propagators, logarithms = problem.propagators(integrator, period / problem.unit)
    return integrator.state[0], propagators[0, 0, : len(state), : len(state)].real * float(np.exp(logarithms[0, 0]))
