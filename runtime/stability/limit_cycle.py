"""Limit cycles of undriven oscillators: Newton's method for the state and the period.

Unknown are the state x and the period T of flow(x, T) = x; the phase condition keeps the correction of x normal to the
motion. Source: Seydel, Practical Bifurcation and Stability Analysis, 3rd ed. (Springer, 2010), section 7.2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import islice

import numpy as np
import sympy as sp

from .orbits import Orbits

__all__ = ["limit_cycle", "rates_of", "rests"]

SAMPLES = 4096
"""States in which a return is looked for."""

SHARE = 64
"""Samples of a turn around the origin."""

NEAR = 1e-3
"""Largest distance of a return from which Newton's method begins, relative to the extent of the motion."""

RETURNS = 32
"""Most returns that are tried."""

MOST_STEPS = 12
REFINED = 4
"""Corrections of the time of a return."""

APART = 10.0
"""How many times sqrt(rtol) the other multipliers are from the unit circle.

Conservative orbits have the multiplier 1 twice, which errors of size rtol split into 1 ± sqrt(rtol).
"""


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
        In units of non-dimensional time; 0 if no such cycle is found.
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
    for guess, extent in islice(_returns(alone, rates, start), RETURNS):
        state, period = start, _on_plane(alone, rates, start, guess)
        for steps in range(MOST_STEPS):
            image, matrix = _flow(alone, state, period)
            gap = image - state
            if not np.abs(gap).max() < NEAR * extent:
                break
            if np.abs(gap).max() < closed * max(1e-3, float(np.abs(image).max())):
                orbit.state = image[None]
                return period if _attracts(matrix, orbit.scene.rtol) else 0.0, steps
            change = _correction(matrix, gap, rates(state), rates(image))
            state, period = state + change[:-1], period + float(change[-1])
            if not (period > 0.0 and np.abs(state - start).max() < 10.0 * NEAR * extent):
                break
    return 0.0, 0


def _returns(
    orbit: Orbits, rates: Callable[[np.ndarray], np.ndarray], start: np.ndarray
) -> Iterator[tuple[float, float]]:
    """Yield the times at which the orbit comes back through the plane normal to its motion, and its extent until then."""
    speed = rates(start)
    step = 2.0 * np.pi / SHARE * float(np.linalg.norm(start) / np.linalg.norm(speed))
    orbit.state = start[None]
    integrator, extent, time, last = orbit.integrator_of(orbit.strengths), 0.0, 0.0, 0.0
    for _ in range(SAMPLES):
        integrator.advance(step)
        away = integrator.state[0] - start
        side, extent, time = float(speed @ away), max(extent, float(np.abs(away).max())), time + step
        if last < 0.0 <= side:
            yield time - step * side / (side - last), extent
        last = side


def _on_plane(orbit: Orbits, rates: Callable[[np.ndarray], np.ndarray], start: np.ndarray, time: float) -> float:
    """The time of a return, by Newton's method."""
    speed = rates(start)
    for _ in range(REFINED):
        image, _ = _flow(orbit, start, time)
        late = float(speed @ (image - start) / (speed @ rates(image)))
        if not abs(late) < 0.5 * time:
            break
        time -= late
    return time


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


def rests(rates: Callable[[np.ndarray], np.ndarray], state: np.ndarray, closed: float) -> bool:
    """Return whether the rates at a state are zero, within a part `closed` of the state."""
    return bool(np.abs(rates(state)).max() < closed * max(1.0, float(np.abs(state).max())))


def rates_of(orbit: Orbits) -> Callable[[np.ndarray], np.ndarray]:
    """Return the rates of an undriven orbit as a function of its state."""
    equations = orbit.variation.orbit
    names = [sp.Symbol(name, real=True) for name in (*equations.state, *equations.parameters)]
    rhs = sp.lambdify(names, list(equations.rhs()), "numpy")
    numbers = [orbit.scene.parameters[name] for name in equations.parameters]
    return lambda state: np.array(rhs(*state, *numbers), dtype=float)
