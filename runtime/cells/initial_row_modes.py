"""Compute the modes of rows (models/mechanics/rows.py) at the start: off their surfaces by the level, on them by forces."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache

import numpy as np
import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME, Node
from synchain.models.mechanics.rows import Law, Row

Values = dict[sp.Symbol, np.ndarray]


def row_modes(equations: Equations, start: np.ndarray, parameters: np.ndarray, slack: float = 0.0) -> np.ndarray:
    """Return initial states (cells, dimension) with the modes that follow from the other states at time 0."""
    # Levels and speeds of at most `slack` are zero.
    states = np.array(start, dtype=float)
    values: Values = {
        sp.Symbol(p, real=True): c[:, None] for p, c in zip(equations.parameters, parameters.T, strict=True)
    }
    values[TIME] = np.zeros((len(states), 1))
    if equations.joined:
        return _modes_of_parts(equations, states, values, slack)
    places = equations.places
    open_rows: list[tuple[int, int, int]] = []  # cell, node and row on its surface
    for kind, node in enumerate(equations.nodes):
        members = [i for i in range(equations.n) if equations.kind_of[i] == kind]
        slots, size = np.array([places[i] for i in members]), len(node.continuous)
        held = [(a, row) for a, row in enumerate(node.rows) if row.law is not Law.RESET]
        states[:, slots[:, size:]] = 1.0
        inside = values | _of_nodes(equations, node, members, values, states)
        for a, row in enumerate(node.rows):
            level, speed = (evaluate(e, inside, (len(states), len(members))) for e in (row.level, row.speed))
            if row.law is not Law.RESET:
                level, speed = (np.where(abs(e) <= slack, 0.0, e) for e in (level, speed))
            _check_start(row, level, speed, members, node.continuous)
            if row.law is Law.RESET:
                continue
            at = slots[:, size + [b for b, _ in held].index(a)]
            states[:, at] = np.where(level == 0.0, 0.0, np.sign(level)) if row.law is Law.SIGN else 1.0
            on = level == 0.0 if row.law is Law.SIGN else (level == 0.0) & (speed == 0.0)
            open_rows += [(int(c), members[m], a) for c, m in np.argwhere(on)]
    if open_rows:
        _decide(equations, states, values, open_rows)
    return states


WHERE = "in initial, an axis or ranges"
"""Where starts are given."""


def _check_start(
    row: Row, level: np.ndarray, speed: np.ndarray, members: Sequence[int], states: Sequence[sp.Symbol]
) -> None:
    """Raise ValueError for a start behind a stop or a guard, or at a stop that closes."""
    behind = {
        Law.SIGN: np.zeros(level.shape, bool),
        Law.STOP: (level < 0.0) | ((level == 0.0) & (speed > 0.0)),
        Law.RESET: level >= 0.0,
    }[row.law]
    if not behind.any():
        return
    first = tuple(np.argwhere(behind)[0])
    what, expected, used = f"the guard {row.level} at or above 0", "a start in front of it", row.level.free_symbols
    if row.law is Law.STOP:
        what, expected = f"the gap {row.level} = {level[first]:.6g}", "0 or more"
        if level[first] == 0.0:
            what, expected = (
                f"{what}, which closes at the speed {speed[first]:.6g}",
                "an open gap, or one that does not close",
            )
            used = used | row.speed.free_symbols
    changed = " or ".join(s.name for s in states if s in used)
    raise ValueError(
        f"start: found node {members[first[1]] + 1} with {what}; expected {expected}; change {changed} {WHERE}"
    )


def _decide(
    equations: Equations, states: np.ndarray, values: Values, open_rows: Sequence[tuple[int, int, int]]
) -> None:
    """Set the modes of the rows on their surfaces by the forces on them, as codegen/driver/rows.py does after events."""
    undecided: dict[int, dict[int, list[int]]] = {}
    for cell, i, a in open_rows:
        undecided.setdefault(i, {}).setdefault(cell, []).append(a)
    for i in sorted(undecided):
        _decide_together(equations, states, values, equations.rows_at(i), undecided[i], f"node {i + 1}")


def _decide_together(
    equations: Equations,
    states: np.ndarray,
    values: Values,
    rows: Sequence[Row],
    undecided: Mapping[int, Sequence[int]],
    where: str,
) -> None:
    """Set the modes of rows that are solved together; `undecided` (cell): the numbers of the rows on their surfaces."""
    places = {sp.Symbol(name, real=True): k for k, name in enumerate(equations.state)}
    held = [a for a, row in enumerate(rows) if row.law is not Law.RESET]
    slots = [places[rows[a].mode] for a in held]
    for cell, numbers in undecided.items():
        at: Values = {s: column[cell] for s, column in values.items()}
        at |= {s: states[cell, k : k + 1] for s, k in places.items()}
        rate, ratio = ([evaluate(getattr(rows[a], name), at, (1,))[0] for a in held] for name in ("rate", "ratio"))
        stiffness = np.array([[evaluate(e, at, (1,))[0] for e in rows[a].stiffness] for a in held])
        free = [held.index(a) for a in numbers]
        stops = np.array([rows[a].law is Law.STOP for a in held])
        redundant = np.array([rows[a].redundant for a in held])
        best = _agreeing(np.array(rate), np.array(ratio), stiffness, stops, states[cell, slots], free, redundant)
        if best is None:
            raise ValueError(
                f"start: found no single motion of {where} that agrees with its contacts or surfaces; expected one; change "
                f"the states {WHERE}"
            )
        states[cell, slots] = best


def _modes_of_parts(equations: Equations, states: np.ndarray, values: Values, slack: float) -> np.ndarray:
    """Return initial states with the modes of rows of parts that links join."""
    symbols = [sp.Symbol(name, real=True) for name in equations.state]
    modes = [
        k
        for places, node in zip(equations.places, map(equations.node_at, range(equations.n)), strict=True)
        for k in places[len(node.continuous) :]
    ]
    states[:, modes] = 1.0
    columns = {s: c[:, 0] for s, c in values.items()}
    for part in equations.parts:
        rows, undecided = part.rows, dict[int, list[int]]()
        for a, row in enumerate(rows):
            at = columns | {s: states[:, k] for k, s in enumerate(symbols)}
            level, speed = (evaluate(e, at, (len(states),)) for e in (row.level, row.speed))
            if row.law is not Law.RESET:
                level, speed = (np.where(abs(e) <= slack, 0.0, e) for e in (level, speed))
            _check_start(row, level[:, None], speed[:, None], [part.owners[a][0]], symbols)
            if row.law is Law.SIGN:
                states[:, symbols.index(row.mode)] = np.where(level == 0.0, 0.0, np.sign(level))
            on = (level == 0.0) & (row.law is Law.SIGN or (speed == 0.0)) & (row.law is not Law.RESET)
            for cell in np.flatnonzero(on):
                undecided.setdefault(int(cell), []).append(a)
        _decide_together(
            equations, states, values, rows, undecided, f"nodes {', '.join(str(i + 1) for i in part.nodes)}"
        )
    return states


def _agreeing(
    rate: np.ndarray,
    ratio: np.ndarray,
    stiffness: np.ndarray,
    stops: np.ndarray,
    modes: np.ndarray,
    free: Sequence[int],
    redundant: np.ndarray,
) -> np.ndarray | None:
    """Return the modes with most held rows that agree with the laws; None if there are none, or no single ones.

    redundant: contacts that depend on each other, so that at rest their forces are not unique; the motion is.
    """
    found, slack = [], 1e-9 if redundant.any() else 0.0
    options = itertools.product(*((0.0, 1.0) if stops[a] else (0.0, 1.0, -1.0) for a in free))
    for choice in sorted(options, key=lambda each: sum(map(abs, each))):
        tried = modes.copy()
        tried[list(free)] = choice
        held = tried == 0.0
        x = _forces(rate, stiffness, stops, tried)
        if x is None:
            continue
        slope = rate - stiffness @ x
        holds = np.where(stops, x >= 0.0, abs(x) <= ratio)
        small = slack * (abs(rate) + abs(stiffness) @ abs(x))
        leaves = np.where(stops, slope < small, tried * slope > -small)
        if np.where(held, holds, leaves)[list(free)].all():
            moved = abs(slope) > small
            found.append(_shared(rate, ratio, stiffness, stops, tried, ~held & redundant & ~moved))
    # static friction above kinetic friction leaves a choice; without it several answers mean that none is determined
    drops = any(ratio[a] > 1.0 for a in free if not stops[a])
    return found[0] if len(found) == 1 or (found and (drops or redundant.any())) else None


def _forces(rate: np.ndarray, stiffness: np.ndarray, stops: np.ndarray, modes: np.ndarray) -> np.ndarray | None:
    """Return x of all rows in some modes; None if the held rows depend on each other."""
    held = modes == 0.0
    x = np.where(held | stops, 0.0, modes)
    block = stiffness[np.ix_(held, held)]
    if held.any() and np.linalg.cond(block) > 1e12:
        return None
    x[held] = np.linalg.solve(block, (rate - stiffness @ x)[held])
    return x


def _shared(
    rate: np.ndarray,
    ratio: np.ndarray,
    stiffness: np.ndarray,
    stops: np.ndarray,
    modes: np.ndarray,
    resting: np.ndarray,
) -> np.ndarray:
    """Return modes with shares of the load of contacts that cannot slide, as `share_forces` of codegen/driver/rows.py."""
    held = modes == 0.0
    for a in np.flatnonzero(resting):
        ends = [_forces(rate, stiffness, stops, np.where(np.arange(len(modes)) == a, s, modes)) for s in (-1.0, 1.0)]
        low, high = (x[held] for x in ends if x is not None)
        slope, middle = (high - low) / 2, (high + low) / 2
        least, most = np.where(stops, 0.0, -ratio)[held] - middle, np.where(stops, np.inf, ratio)[held] - middle
        bounds = np.sort([least[slope != 0] / slope[slope != 0], most[slope != 0] / slope[slope != 0]], axis=0)
        low_end, high_end = max(-1.0, *bounds[0]), min(1.0, *bounds[1])
        share, span = (low_end + high_end) / 2, high_end - low_end
        modes = np.where(np.arange(len(modes)) == a, share if abs(share) > 0.1 * span else share + 0.2 * span, modes)
    return modes


def _of_nodes(equations: Equations, node: Node, members: Sequence[int], values: Values, states: np.ndarray) -> Values:
    """Return the states, and the parameters that differ, of some nodes, each (cells, members)."""
    slots = np.array([equations.places[i] for i in members])
    found: Values = {s: states[:, slots[:, k]] for k, s in enumerate(node.state)}
    for s in node.parameters:
        if s.name in equations.varied:
            found[s] = np.concatenate([values[sp.Symbol(f"{s.name}_{i + 1}", real=True)] for i in members], axis=1)
    return found


def evaluate(e: sp.Expr, values: Values, shape: tuple[int, ...]) -> np.ndarray:
    """Return the values of an expression in an array of some shape."""
    used = tuple(sorted(e.free_symbols, key=str))
    return np.array(np.broadcast_to(_function(e, used)(*(values[s] for s in used)), shape), dtype=float)


@lru_cache(maxsize=256)  # the blocks of a sweep share the functions
def _function(e: sp.Expr, symbols: tuple[sp.Symbol, ...]) -> Callable[..., np.ndarray]:
    function: Callable[..., np.ndarray] = sp.lambdify(list(symbols), e, "numpy")
    return function
