"""Limit cycles of undriven oscillators: Newton's method for the state and the period.

Unknown are the state x and the period T of flow(x, T) = x; the phase condition keeps the correction of x normal to the
motion. Source: Seydel, Practical Bifurcation and Stability Analysis, 3rd ed. (Springer, 2010), section 7.2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import islice
from typing import NamedTuple

import numpy as np
import sympy as sp
from scipy.optimize import brentq

from .orbits import Orbits
from .variational_integrator import VariationalIntegrator

__all__ = ["limit_cycle", "rates_of", "rests"]

SAMPLES = 4096
"""Steps from state to state in which a return is looked for."""

SHARE = 8
"""Least number of steps from one end of a component to the other."""

FIRST = 1e-6
"""Shortest step, relative to the time in which the first speed covers the size of the state."""

NEAR = 1e-3
"""Largest distance of a return from which Newton's method begins, relative to the extent of the motion."""

RETURNS = 32
"""Most returns that are tried."""

MOST_STEPS = 12

ASIDE = 1e-6
"""How far aside, relative to a component, rates are looked at."""

APART = 10.0
"""How many times sqrt(rtol) the other multipliers are from the unit circle.

Conservative orbits have the multiplier 1 twice, which errors of size rtol split into 1 ± sqrt(rtol).
"""

Rates = Callable[[np.ndarray], np.ndarray]


class Cycle(NamedTuple):
    """A closed orbit.

    Parameters
    ----------
    state : ndarray, shape (p,)
        A state on it.
    period : float
        The time after which the state is back.
    matrix : ndarray, shape (p, p)
        Derivative of the state a period later by the state.
    steps : int
        Steps of Newton's method.
    """

    state: np.ndarray
    period: float
    matrix: np.ndarray
    steps: int


def limit_cycle(orbit: Orbits, closed: float) -> tuple[float, int]:
    """Find the attracting cycle that an undriven orbit has settled on.

    Parameters
    ----------
    orbit : Orbits
        A single orbit after its transient; on success its state is moved onto the cycle.
    closed : float
        Largest distance of a closed cycle, relative to the size of the state.

    Returns
    -------
    period : float
        The least one, in units of non-dimensional time; 0 if no such cycle is found.
    steps : int
        Steps of Newton's method.
    """
    alone = Orbits(
        orbit.scene,
        orbit.variation,
        np.zeros_like(orbit.strengths[:1]),
        orbit.state,
        orbit.workers,
        orbit.unit,
        orbit.method,
    )
    rates, start = rates_of(orbit), orbit.state[0].copy()
    if rests(rates, start, closed):
        return 0.0, 0
    for time, extent in islice(_returns(alone, rates, start, closed), RETURNS):
        found = _newton(alone, rates, start, time, extent, closed)
        if found is not None:
            state, period, matrix, steps = _least(alone, rates, found, extent, closed)
            orbit.state = state[None]
            return period if _attracts(matrix, orbit.scene.rtol) else 0.0, steps
    return 0.0, 0


def _returns(orbit: Orbits, rates: Rates, start: np.ndarray, closed: float) -> Iterator[tuple[float, np.ndarray]]:
    """Yield the times at which the orbit comes back through the plane normal to its motion.

    With each comes the extent (p,) of the motion until then.
    """
    normal, integrator, time = rates(start), _integrator(orbit, start), 0.0
    shortest = FIRST * max(1e-3, float(np.linalg.norm(start))) / float(np.linalg.norm(normal))

    def side(state: np.ndarray) -> float:
        return float(normal @ (state[0] - start))

    for before, step, extent in _path(integrator, shortest, _slack(start, closed)):
        if side(before) < 0.0 <= side(integrator.state):
            yield time + _passage(integrator, before, step, side), extent
        time += step


def _integrator(orbit: Orbits, state: np.ndarray) -> VariationalIntegrator:
    """An integrator from a state, which does not warn of short steps: its stretches are too short to have a mean."""
    orbit.state = state[None]
    integrator = orbit.integrator_of(orbit.strengths)
    integrator.warned = True
    return integrator


def _path(
    integrator: VariationalIntegrator, shortest: float, least: float
) -> Iterator[tuple[np.ndarray, float, np.ndarray]]:
    """Advance by steps in which no component moves by more than a share of its extent, or of the least one.

    Yield, after each step, the state before it, its length and the extent (p,) so far.  Steps of the shortest length may
    move by more, as the first ones do.
    """
    step, low, high = shortest, integrator.state[0] - least, integrator.state[0] + least
    for _ in range(SAMPLES):
        before = integrator.state
        integrator.advance(step)
        after = integrator.state[0]
        lower, higher = np.minimum(low, after), np.maximum(high, after)
        moved, extent = SHARE * np.abs(after - before[0]), higher - lower
        if step > shortest and np.any(moved > extent):
            integrator.state, step = before, max(shortest, 0.5 * step)
            continue
        low, high = lower, higher
        yield before, step, extent
        step *= 1.5 if np.all(2.0 * moved <= extent) else 1.0


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
    orbit: Orbits, rates: Rates, start: np.ndarray, time: float, extent: np.ndarray, closed: float
) -> Cycle | None:
    """The cycle near a state that is back after about some time; None if Newton's method leads elsewhere."""
    state, period, near = start, time, NEAR * extent + _slack(start, closed)
    for steps in range(MOST_STEPS):
        try:
            image, matrix = _flow(orbit, state, period)
        except FloatingPointError:  # a correction that led far away
            return None
        gap = image - state
        if not np.all(np.abs(gap) <= near):
            return None
        if np.abs(gap).max() < _slack(image, closed):
            return Cycle(image, period, matrix, steps)
        change = _correction(matrix, gap, rates(state), rates(image))
        state, period = state + change[:-1], period + float(change[-1])
        if not (abs(period - time) < 0.5 * time and np.all(np.abs(state - start) <= 10.0 * near)):
            return None
    return None


def _least(orbit: Orbits, rates: Rates, cycle: Cycle, extent: np.ndarray, closed: float) -> Cycle:
    """The cycle with its least period: one integration looks whether the state is back after a part of the period."""
    integrator, time = _integrator(orbit, cycle.state), 0.0
    near = math.sqrt(closed) * extent + _slack(cycle.state, closed)
    for parts in range(RETURNS, 1, -1):
        integrator.advance(cycle.period / parts - time)
        time = cycle.period / parts
        if np.all(np.abs(integrator.state[0] - cycle.state) <= near):
            part = _newton(orbit, rates, cycle.state, time, extent, closed)
            if part is not None and abs(part.period - time) < NEAR * time:
                return part
    return cycle


def _slack(state: np.ndarray, closed: float) -> float:
    """Largest distance from a state at which an orbit is closed."""
    return closed * max(1e-3, float(np.abs(state).max()))


def _flow(orbit: Orbits, state: np.ndarray, period: float) -> tuple[np.ndarray, np.ndarray]:
    """The state a period later, and its derivative by the state."""
    orbit.state, orbit.block = state[None], period / orbit.unit
    orbit.integrator = orbit.integrator_of(orbit.strengths)
    propagators, logarithms = orbit.propagators()
    return orbit.integrator.state[0], propagators[0, 0].real * float(np.exp(logarithms[0, 0]))


def _correction(matrix: np.ndarray, gap: np.ndarray, here: np.ndarray, there: np.ndarray) -> np.ndarray:
    """Newton's correction of the state, normal to the motion, and of the period."""
    p = len(gap)
    bordered = np.zeros((p + 1, p + 1))
    bordered[:p, :p], bordered[:p, p], bordered[p, :p] = matrix - np.eye(p), there, here
    return np.asarray(np.linalg.lstsq(bordered, np.append(-gap, 0.0), rcond=None)[0])


def _attracts(matrix: np.ndarray, rtol: float) -> bool:
    """True if all multipliers but that of the motion itself lie well inside the unit circle."""
    multipliers = np.linalg.eigvals(matrix)
    others = np.delete(multipliers, np.abs(multipliers - 1.0).argmin())
    return bool(np.all(np.abs(others) < 1.0 - APART * math.sqrt(rtol)))


def rests(rates: Rates, state: np.ndarray, closed: float) -> bool:
    """Return whether the rates at a state are zero, within what they change if each component moves by a part `closed` of its size.

    Components smaller than 1 count as 1.  Units of time do not matter, nor the size of a component that moves no other.
    """
    here, moves = rates(state), ASIDE * np.maximum(1.0, np.abs(state))
    with np.errstate(all="ignore"):
        changes = np.abs([rates(state + move) - here for move in np.diag(moves)]).sum(axis=0)
    return bool(np.all(np.abs(here) <= closed / ASIDE * changes))


def rates_of(orbit: Orbits) -> Rates:
    """Return the rates of an undriven orbit as a function of its state."""
    equations = orbit.variation.orbit
    names = [sp.Symbol(name, real=True) for name in (*equations.state, *equations.parameters)]
    rhs = sp.lambdify(names, list(equations.rhs()), "numpy")
    numbers = [orbit.scene.parameters[name] for name in equations.parameters]
    return lambda state: np.array(rhs(*state, *numbers), dtype=float)
