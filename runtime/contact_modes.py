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
    if equations.node.contact is None:
        return start
    names = [*equations.state, *equations.parameters, "t"]
    symbols = [sp.Symbol(name, real=True) for name in names]
    made = np.array(start, dtype=float)
    columns = [*made.T, *numbers.T, np.zeros(len(made))]
    for i in range(equations.n):
        contact = equations.contact_at(i)
        if contact is None:
            continue
        sliding, up, down = (_at(e, symbols, columns) for e in (contact.sliding, contact.up, contact.down))
        stuck = np.where(up < 0.0, 1.0, np.where(down > 0.0, -1.0, 0.0))
        made[:, 2 * equations.n + i] = np.where(sliding == 0.0, stuck, np.sign(sliding))
    return made


def _at(e: sp.Expr, symbols: list[sp.Symbol], columns: list[np.ndarray]) -> np.ndarray:
    value = sp.lambdify(symbols, e, "numpy")(*columns)
    return np.broadcast_to(np.asarray(value, dtype=float), columns[0].shape)
