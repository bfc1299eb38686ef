"""Whether each oscillator sticks or slips at its start."""

from __future__ import annotations

import numpy as np
import sympy as sp

from synchain.models.equations import Equations

__all__ = ["with_modes"]


def with_modes(equations: Equations, start: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """The rows of `start` (cells, 3 n) with the modes that their velocities and loads ask for at the time 0.

    An oscillator at exactly the ground's velocity sticks where static friction can hold it.
    """
    contact, n = equations.node.contact, equations.n
    if contact is None:
        return start
    names = [*equations.state, *equations.parameters, "t"]
    symbols = [sp.Symbol(name, real=True) for name in names]
    made = np.array(start, dtype=float)
    columns = [*made.T, *numbers.T, np.zeros(len(made))]
    for i in range(n):
        sliding, up, down = (_at(e, symbols, columns) for e in conditions(equations, i))
        stuck = np.where(up < 0.0, 1.0, np.where(down > 0.0, -1.0, 0.0))
        made[:, 2 * n + i] = np.where(sliding == 0.0, stuck, np.sign(sliding))
    return made


def conditions(equations: Equations, i: int) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
    """Sliding velocity of node i, and its accelerations under the largest static friction in either direction."""
    contact, node = equations.node.contact, equations.node
    if contact is None:
        raise ValueError("these equations have no contact")
    at = equations.at_node(i)
    mode, velocity = (sp.Symbol(f"{node.state[k].name}_{i + 1}", real=True) for k in (2, 1))
    links = sp.S.Zero
    if equations.edge is not None:
        links = sp.Add(*(equations.edge.rhs[1].xreplace(equations.at_link(k)) for k in equations.links if k[0] == i))
    links = links.xreplace({mode: sp.S.One, velocity: contact.speed.xreplace(at)})
    return contact.sliding.xreplace(at), contact.up.xreplace(at) + links, contact.down.xreplace(at) + links


def _at(e: sp.Expr, symbols: list[sp.Symbol], columns: list[np.ndarray]) -> np.ndarray:
    value = sp.lambdify(symbols, e, "numpy")(*columns)
    return np.broadcast_to(np.asarray(value, dtype=float), columns[0].shape)
