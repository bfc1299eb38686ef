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

from .motion import RateFunctions, path, rests, shortest_time
from .orbits import Orbits
from .variational_integrator import VariationalIntegrator

SAMPLES = 4096
"""Steps from state to state in which a return is looked for."""

NEAR = 1e-3
"""Largest distance of a return from which Newton's method begins, relative to the extent of the motion."""

RETURNS = 32
"""Most returns that are tried."""

MOST_STEPS = 12

APART = 10.0
"""How many times sqrt(rtol) the other multipliers are from the unit circle.

Conservative orbits have the multiplier 1 twice, which errors of size rtol split into 1 ± sqrt(rtol).
"""


class Cycle(NamedTuple):
    """A closed orbit."""

    state: np.ndarray  # (p,): a state on it
    period: float  # the time after which the state is back
    matrix: np.ndarray  # (p, p): derivative of the state a period later by the state
    steps: int  # steps of Newton's method


def limit_cycle(orbit: Orbits, closed: float) -> tuple[float, int]:
    """Find the attracting cycle that an undriven orbit has settled on."""
    alone = replace(orbit, strengths=np.zeros_like(orbit.strengths[:1]))
    rates, start = orbit.rates, orbit.state[0].copy()
    if rests(rates, start, closed, orbit.extent):
        return 0.0, 0
    for time, extent in islice(_returns(alone, rates, start), RETURNS):
        found = _newton(alone, rates, start, time, extent, closed)
        if found is not None:
            state, period, matrix, steps = _least(alone, rates, found, extent, closed)
            orbit.state = state[None]
            return period if _attracts(matrix, orbit.scene.rtol) else 0.0, steps
    return 0.0, 0


def _returns(orbit: Orbits, rates: RateFunctions, start: np.ndarray) -> Iterator[tuple[float, np.ndarray]]:
    """Yield the times at which the orbit comes back through the plane normal to its motion.

    With each comes the extent (p,) of the motion until then.
    """
    integrator, time = _integrator(orbit, start), 0.0
    normal = rates.values(start) / _scale(orbit.extent) ** 2  # normal if each component is measured by its extent

    def side(state: np.ndarray) -> float:
        return float(normal @ (state[0] - start))

    for before, step, extent, _ in islice(path(integrator, rates, shortest_time(rates, start)), SAMPLES):
        if side(before) < 0.0 <= side(integrator.state):
            yield time + _passage(integrator, before, step, side), np.maximum(extent, NEAR * orbit.extent)
        time += step


def _scale(extent: np.ndarray) -> np.ndarray:
    """The extents (p,), and 1 for a component that does not move."""
    return np.where(extent > 0.0, extent, 1.0)


def _integrator(orbit: Orbits, state: np.ndarray) -> VariationalIntegrator:
    """An integrator from a state, which does not warn of short steps: its stretches are too short to have a mean."""
    orbit.state = state[None]
    integrator = orbit.integrator_of(orbit.strengths)
    integrator.observes = True
    return integrator


def _passage(
    integrator: VariationalIntegrator, before: np.ndarray, step: float, side: Callable[[np.ndarray], float]
) -> float:
    """The time within the last step at which the orbit changed sides of a plane."""
    after = integrator.state
    known = {0.0: side(before), step: side(after)}

    def side_after(time: float) -> float:
        if time in known:
            return known[time]
        integrator.state = before
        integrator.advance(time)
        return side(integrator.state)

    time = float(brentq(side_after, 0.0, step, xtol=1e-12 * step))
    integrator.state = after
    return time


def _newton(
    orbit: Orbits, rates: RateFunctions, start: np.ndarray, time: float, extent: np.ndarray, closed: float
) -> Cycle | None:
    """The cycle near a state that is back after about some time; None if Newton's method leads elsewhere."""
    state, period, near = start, time, NEAR * extent
    for steps in range(MOST_STEPS):
        try:
            image, matrix = _flow(orbit, state, period)
        except FloatingPointError:  # a correction that led far away
            return None
        gap = image - state
        if not np.all(np.abs(gap) <= near):
            return None
        if np.all(np.abs(gap) <= closed * extent + rates.rounding(image, period)):
            return Cycle(image, period, matrix, steps)
        change = _correction(matrix, gap, period, (rates.values(state), rates.values(image)), _scale(extent))
        state, period = state + change[:-1], period + float(change[-1])
        if not (abs(period - time) < 0.5 * time and np.all(np.abs(state - start) <= 10.0 * near)):
            return None
    return None


def _least(orbit: Orbits, rates: RateFunctions, cycle: Cycle, extent: np.ndarray, closed: float) -> Cycle:
    """The cycle with its least period: one integration looks whether the state is back after a part of the period."""
    integrator, time = _integrator(orbit, cycle.state), 0.0
    near = math.sqrt(closed) * extent
    for parts in range(RETURNS, 1, -1):
        integrator.advance(cycle.period / parts - time)
        time = cycle.period / parts
        if np.all(np.abs(integrator.state[0] - cycle.state) <= near):
            part = _newton(orbit, rates, cycle.state, time, extent, closed)
            if part is not None and abs(part.period - time) < NEAR * time:
                return part
    return cycle


def _flow(orbit: Orbits, state: np.ndarray, period: float) -> tuple[np.ndarray, np.ndarray]:
    """The state a period later, and its derivative by the state."""
    orbit.state, orbit.block = state[None], period / orbit.unit
    orbit.integrator = orbit.integrator_of(orbit.strengths)
    propagators, logarithms = orbit.propagators()
    return orbit.integrator.state[0], propagators[0, 0].real * float(np.exp(logarithms[0, 0]))


def _correction(
    matrix: np.ndarray, gap: np.ndarray, period: float, speeds: tuple[np.ndarray, np.ndarray], scale: np.ndarray
) -> np.ndarray:
    """Newton's correction of the state, normal to the motion, and of the period; `speeds` are the rates here and at the image.

    It is solved for components in units of `scale` and times in units of the period.
    """
    p = len(gap)
    here, there = (period * speed / scale for speed in speeds)
    bordered = np.zeros((p + 1, p + 1))
    bordered[:p, :p], bordered[:p, p], bordered[p, :p] = matrix * scale / scale[:, None] - np.eye(p), there, here
    change = np.linalg.lstsq(bordered, np.append(-gap / scale, 0.0), rcond=None)[0]
    return np.append(change[:-1] * scale, change[-1] * period)


def _attracts(matrix: np.ndarray, rtol: float) -> bool:
    """True if all multipliers but that of the motion itself lie well inside the unit circle."""
    multipliers = np.linalg.eigvals(matrix)
    others = np.delete(multipliers, np.abs(multipliers - 1.0).argmin())
    return bool(np.all(np.abs(others) < 1.0 - APART * math.sqrt(rtol)))
