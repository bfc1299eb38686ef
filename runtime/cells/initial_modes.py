"""Compute the slip states of oscillators at the start, and the period of the clock that times events."""

from __future__ import annotations

import numpy as np
import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME

from .initial_row_modes import evaluate, row_modes

CLOCK = 8.0  # period of the clock of an oscillator without a drive: a power of two, so that no digit is lost


def with_modes(equations: Equations, start: np.ndarray, parameters: np.ndarray) -> np.ndarray:
    """Return initial states with the slip states that follow from velocities and loads at time 0."""
    # An oscillator at exactly the ground's velocity sticks if static friction can hold it. Shapes: start (cells, 3 n),
    # parameters (cells, count).
    n = equations.n
    if not equations.sticks:
        return start
    if equations.has_rows:
        return row_modes(equations, start, parameters)
    (event,) = equations.node.events
    states = np.array(start, dtype=float)
    # Parameters (cells, 1), and (cells, n) where nodes differ.
    values = {sp.Symbol(p, real=True): c[:, None] for p, c in zip(equations.parameters, parameters.T, strict=True)}
    values[TIME] = np.zeros((len(states), 1))
    of_nodes = {}
    for name in equations.varied:
        columns = [values[sp.Symbol(f"{name}_{i + 1}", real=True)] for i in range(n)]
        of_nodes[sp.Symbol(name, real=True)] = np.concatenate(columns, axis=1)
    node_values = values | of_nodes | {s: states[:, k * n : (k + 1) * n] for k, s in enumerate(equations.node.state)}
    # Slip has the sign of the sliding velocity; at rest it is 0 unless the load exceeds a limit of static friction.
    sliding, up, down = (evaluate(e, node_values, (len(states), n)) for e in (event.level, *event.limits))
    push = _link_forces(equations, event.target, states, values, of_nodes)
    stuck = np.where(up + push < 0.0, 1.0, np.where(down + push > 0.0, -1.0, 0.0))
    states[:, 2 * n :] = np.where(sliding == 0.0, stuck, np.sign(sliding))
    return states


def _link_forces(
    equations: Equations,
    speed: sp.Expr,
    states: np.ndarray,
    values: dict[sp.Symbol, np.ndarray],
    of_nodes: dict[sp.Symbol, np.ndarray],
) -> np.ndarray:
    """Return the forces (cells, n) of the links on each oscillator that moves with the ground, at `speed`."""
    n = equations.n
    total = np.zeros((len(states), n))
    if not equations.edges:
        return total
    (edge,) = equations.edges
    target, source = (np.array([link[side] for link in equations.links]) for side in (0, 1))
    # Parameters and states at the ends of the links, each (cells, links).
    at_links = {**values, edge.weight: np.array([float(link[2]) for link in equations.links])}
    at_links |= {s: column[:, target] for s, column in of_nodes.items()}
    at_links |= {s: of_nodes[of][:, source] for s, of in edge.theirs}
    for name, layer in equations.numbered.items():
        columns = [at_links[sp.Symbol(layer.name(name, link), real=True)] for link in equations.links]
        at_links[sp.Symbol(name, real=True)] = np.concatenate(columns, axis=1)
    for symbols, nodes in ((edge.here, target), (edge.there, source)):
        at_links |= {s: states[:, k * n + nodes] for k, s in enumerate(symbols)}
    force = edge.rhs[1].xreplace({edge.here[2]: sp.S.One, edge.here[1]: speed})
    np.add.at(total.T, target, evaluate(force, at_links, (len(states), len(target))).T)
    return total


def local_clock(equations: Equations, period: np.ndarray) -> np.ndarray:
    """Return the period (cells,) of the clock of each cell."""
    # `period` (cells,): period of the drive, 0 without a drive. Times of events are read from the clock, with its
    # rounding error. If time does not enter the equations, the period may have any length; a short one keeps the digits
    # of events in long runs.
    if not equations.sticks or any(e.has(TIME) for template in equations.templates for e in template.expressions):
        return period
    return np.full(len(period), CLOCK)
