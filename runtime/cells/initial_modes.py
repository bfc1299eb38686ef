"""Slip states of oscillators at their start, and the clock that times their events."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME

CLOCK = 8.0
"""Period of the clock of an oscillator without a drive: a power of two, so that no digit is lost."""


def with_modes(equations: Equations, start: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """Return initial states with the slip states that velocities and loads imply at the time 0.

    An oscillator at exactly the ground's velocity sticks if static friction can hold it.
    Shapes: start (cells, 3 n), numbers (cells, parameters).
    """
    n = equations.n
    if not equations.sticks:
        return start
    (event,) = equations.node.events
    states = np.array(start, dtype=float)
    values = {sp.Symbol(p, real=True): c[:, None] for p, c in zip(equations.parameters, numbers.T, strict=True)}
    values[TIME] = np.zeros((len(states), 1))
    own = _own(equations, values)
    node_values = values | own | {s: states[:, k * n : (k + 1) * n] for k, s in enumerate(equations.node.state)}
    sliding, up, down = (_at(e, node_values, (len(states), n)) for e in (event.level, *event.limits))
    push = _link_forces(equations, event.target, states, values, own)
    stuck = np.where(up + push < 0.0, 1.0, np.where(down + push > 0.0, -1.0, 0.0))
    states[:, 2 * n :] = np.where(sliding == 0.0, stuck, np.sign(sliding))
    return states


def _own(equations: Equations, values: dict[sp.Symbol, np.ndarray]) -> dict[sp.Symbol, np.ndarray]:
    """Values (cells, n) of the parameters that each node has for itself."""
    return {
        sp.Symbol(name, real=True): np.concatenate(
            [values[sp.Symbol(f"{name}_{i + 1}", real=True)] for i in range(equations.n)], axis=1
        )
        for name in equations.varied
    }


def _link_forces(
    equations: Equations,
    speed: sp.Expr,
    state: np.ndarray,
    given: dict[sp.Symbol, np.ndarray],
    own: dict[sp.Symbol, np.ndarray],
) -> np.ndarray:
    """Forces (cells, n) of the links on each oscillator if it moves with the ground."""
    n = equations.n
    total = np.zeros((len(state), n))
    if not equations.edges:
        return total
    (edge,) = equations.edges
    target, source = (np.array([link[side] for link in equations.links]) for side in (0, 1))
    given = {**given, edge.weight: np.array([float(link[2]) for link in equations.links])}
    given |= {s: column[:, target] for s, column in own.items()}
    given |= {s: own[of][:, source] for s, of in edge.theirs}
    for name, layer in equations.numbered.items():
        columns = [given[sp.Symbol(layer.name(name, link), real=True)] for link in equations.links]
        given[sp.Symbol(name, real=True)] = np.concatenate(columns, axis=1)
    for symbols, nodes in ((edge.here, target), (edge.there, source)):
        given |= {s: state[:, k * n + nodes] for k, s in enumerate(symbols)}
    force = edge.rhs[1].xreplace({edge.here[2]: sp.S.One, edge.here[1]: speed})
    np.add.at(total.T, target, _at(force, given, (len(state), len(target))).T)
    return total


def local_clock(equations: Equations, period: np.ndarray) -> np.ndarray:
    """Return the times (cells,) after which the clocks of cells start anew: their `period`
    (cells,), 0 for none.

    Events are located on the clock, to rounding.  If time does not enter the equations any length
    is a period, and a short one keeps the digits of events in long runs.
    """
    if not equations.sticks or any(e.has(TIME) for e in equations.node.expressions):
        return period
    return np.full(len(period), CLOCK)


def _at(e: sp.Expr, given: dict[sp.Symbol, np.ndarray], shape: tuple[int, int]) -> np.ndarray:
    value = _function(e, tuple(given))(*given.values())
    return np.array(np.broadcast_to(value, shape), dtype=float)


@lru_cache(maxsize=64)
def _function(e: sp.Expr, symbols: tuple[sp.Symbol, ...]) -> Callable[..., np.ndarray]:
    """An expression as a function: the blocks of a sweep share it."""
    made: Callable[..., np.ndarray] = sp.lambdify(list(symbols), e, "numpy")
    return made
