"""Compute the modes of rows (models/mechanics/rows.py) at the start: off their surfaces by the level, on them by forces."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME, Node
from synchain.models.mechanics.rows import Law, Row

Values = dict[sp.Symbol, np.ndarray]


def row_modes(equations: Equations, start: np.ndarray, parameters: np.ndarray, slack: float = 0.0) -> np.ndarray:
    """Return initial states (cells, dimension) with the modes that follow from the other states at time 0.

    Levels and speeds of at most `slack` are zero.
    """
    states = np.array(start, dtype=float)
    values: Values = {
        sp.Symbol(p, real=True): c[:, None] for p, c in zip(equations.parameters, parameters.T, strict=True)
    }
    values[TIME] = np.zeros((len(states), 1))
    places = equations.places
    open_rows: list[tuple[int, int, int]] = []  # cell, node and row on its surface
    for kind, node in enumerate(equations.nodes):
        members = [i for i in range(equations.n) if equations.kind_of[i] == kind]
        slots, size = np.array([places[i] for i in members]), len(node.continuous)
        held = [(a, row) for a, row in enumerate(node.rows) if row.law is not Law.RESET]
        states[:, slots[:, size:]] = 1.0
        inside = values | _of_nodes(equations, node, members, values, states)
        for a, row in enumerate(node.rows):
            level, speed = (_at(e, inside, (len(states), len(members))) for e in (row.level, row.speed))
            if row.law is not Law.RESET:
                level, speed = (np.where(abs(e) <= slack, 0.0, e) for e in (level, speed))
            _check_start(row, level, speed, members)
            if row.law is Law.RESET:
                continue
            at = slots[:, size + [b for b, _ in held].index(a)]
            states[:, at] = np.where(level == 0.0, 0.0, np.sign(level)) if row.law is Law.SIGN else 1.0
            on = level == 0.0 if row.law is Law.SIGN else (level == 0.0) & (speed == 0.0)
            open_rows += [(int(c), members[m], a) for c, m in np.argwhere(on)]
    if open_rows:
        _decide(equations, states, values, open_rows)
    return states


def _check_start(row: Row, level: np.ndarray, speed: np.ndarray, members: Sequence[int]) -> None:
    """Raise ValueError for a start behind a stop or a guard."""
    behind = {
        Law.SIGN: np.zeros(level.shape, bool),
        Law.STOP: (level < 0.0) | ((level == 0.0) & (speed > 0.0)),
        Law.RESET: level >= 0.0,
    }[row.law]
    if behind.any():
        node = members[int(np.argwhere(behind)[0, 1])] + 1
        what = (
            f"the gap {row.level} closed, moving inwards"
            if row.law is Law.STOP
            else f"the guard {row.level} at or above 0"
        )
        raise ValueError(f"initial: found node {node} with {what}; expected a start in front of it; change the start")


def _decide(
    equations: Equations, states: np.ndarray, values: Values, open_rows: Sequence[tuple[int, int, int]]
) -> None:
    """Set the modes of the rows on their surfaces by the forces on them, as codegen/driver/rows.py does after events."""
    parts: dict[tuple[int, int], list[int]] = {}
    for cell, i, a in open_rows:
        parts.setdefault((cell, i), []).append(a)
    for i in sorted({i for _, i in parts}):
        rows, places, names = equations.rows_at(i), equations.places[i], equations.state
        symbols = tuple(sp.Symbol(name, real=True) for name in names)
        held = [a for a, row in enumerate(rows) if row.law is not Law.RESET]
        size = len(equations.node_at(i).continuous)
        for (cell, _), undecided in ((key, each) for key, each in parts.items() if key[1] == i):
            at: Values = {
                s: column[cell] for s, column in values.items() if s.name in equations.parameters or s == TIME
            }
            at |= {s: states[cell, k : k + 1] for k, s in enumerate(symbols)}
            rate, ratio = ([_at(getattr(rows[a], name), at, (1,))[0] for a in held] for name in ("rate", "ratio"))
            stiffness = np.array([[_at(e, at, (1,))[0] for e in rows[a].stiffness] for a in held])
            modes = np.array([states[cell, places[size + b]] for b in range(len(held))])
            free = [held.index(a) for a in undecided]
            stops = np.array([rows[a].law is Law.STOP for a in held])
            best = _agreeing(np.array(rate), np.array(ratio), stiffness, stops, modes, free)
            if best is None:
                raise ValueError(
                    f"initial: found no single motion of node {i + 1} that agrees with its contacts or surfaces; change the start"
                )
            states[cell, list(places[size:])] = best


def _agreeing(
    rate: np.ndarray,
    ratio: np.ndarray,
    stiffness: np.ndarray,
    stops: np.ndarray,
    modes: np.ndarray,
    free: Sequence[int],
) -> np.ndarray | None:
    """Return the modes with most held rows that agree with the laws; None if there are none, or no single ones."""
    found = []
    options = itertools.product(*((0.0, 1.0) if stops[a] else (0.0, 1.0, -1.0) for a in free))
    for choice in sorted(options, key=lambda each: sum(map(abs, each))):
        tried = modes.copy()
        tried[list(free)] = choice
        held = tried == 0.0
        x = np.where(held | stops, 0.0, tried)
        try:
            x[held] = np.linalg.solve(stiffness[np.ix_(held, held)], (rate - stiffness @ x)[held])
        except np.linalg.LinAlgError:
            continue
        slope = rate - stiffness @ x
        holds = np.where(stops, x >= 0.0, abs(x) <= ratio)
        leaves = np.where(stops, slope < 0.0, tried * slope > 0.0)
        if np.where(held, holds, leaves)[list(free)].all():
            found.append(tried)
    # static friction above kinetic friction leaves a choice; without it several answers mean that none is determined
    drops = any(ratio[a] > 1.0 for a in free if not stops[a])
    return found[0] if len(found) == 1 or (found and drops) else None


def _of_nodes(equations: Equations, node: Node, members: Sequence[int], values: Values, states: np.ndarray) -> Values:
    """Return the states, and the parameters that differ, of some nodes, each (cells, members)."""
    slots = np.array([equations.places[i] for i in members])
    found: Values = {s: states[:, slots[:, k]] for k, s in enumerate(node.state)}
    for s in node.parameters:
        if s.name in equations.varied:
            found[s] = np.concatenate([values[sp.Symbol(f"{s.name}_{i + 1}", real=True)] for i in members], axis=1)
    return found


def _at(e: sp.Expr, values: Values, shape: tuple[int, ...]) -> np.ndarray:
    used = tuple(sorted(e.free_symbols, key=str))
    return np.array(np.broadcast_to(_function(e, used)(*(values[s] for s in used)), shape), dtype=float)


@lru_cache(maxsize=256)
def _function(e: sp.Expr, symbols: tuple[sp.Symbol, ...]) -> Callable[..., np.ndarray]:
    function: Callable[..., np.ndarray] = sp.lambdify(list(symbols), e, "numpy")
    return function
