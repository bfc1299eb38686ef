"""How fast motions decay, grow and turn at a state: eigenvalues of the nodes' own blocks of the Jacobian."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import lru_cache
from itertools import islice
from typing import NamedTuple

import numpy as np
import sympy as sp

from synchain.codegen.steps.mass import turned_masses
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.variational import Variation
from synchain.models.graphs.links import Link
from synchain.models.mechanics.components import TIME, Edge, Node

__all__ = ["Rates", "bends", "mode_rates", "rates"]

NODES, LINKS = 50, 5000
"""Nodes of a large network that are looked at, and links."""

TURNING = (sp.atan, sp.tanh, sp.erf, sp.Abs)
"""Functions that are steep, or turn sharply, where their argument is zero: the layer of a smoothed jump."""


class Rates(NamedTuple):
    """The fastest decay or growth at a state, the fastest turning, and the fastest growth; 0 where there are no numbers."""

    fastest: float
    turning: float
    growth: float


ENDLESS = Rates(math.inf, 0.0, math.inf)
"""Those of a block with an infinite entry."""


def rates(equations: Equations, state: np.ndarray, numbers: np.ndarray, time: float = 0.0) -> Rates:
    """Return those at a state: of the node's own blocks, with twice what their links add, which bounds those of springs.

    They are infinite where a slope by a state or by time has no number although the rates have: those of sqrt(x + t) at 0.
    """
    values = _named(equations, state, numbers, time)
    blocks = _blocks(equations, values)
    by_time = (_column(part.time_derivative(), at, values) for part, at in _parts(equations, only_forced=True))
    if not _finite((*blocks, *by_time)) and _finite(_column(part.rhs, at, values) for part, at in _parts(equations)):
        return ENDLESS
    return _of_blocks(blocks)


def bends(equations: Equations, state: np.ndarray, numbers: np.ndarray) -> Rates:
    """Return those in the layers of smoothed jumps, into which one state is moved."""
    return _of_blocks(_bends(equations, _named(equations, state, numbers)))


def mode_rates(variation: Variation, state: np.ndarray, numbers: np.ndarray, strengths: np.ndarray) -> Iterator[Rates]:
    """Yield those of deviations without a strength, with the largest and with the most negative, of the first orbits."""
    strengths, extreme = strengths[: len(variation.parameters)], []
    if strengths.size:
        extreme = [np.argmax(np.hypot.reduce(strengths, axis=0)), np.argmin(strengths[0])]
    known = [np.zeros(len(strengths)), *(strengths[:, which] for which in dict.fromkeys(extreme))]
    table = [[sp.S.Zero] * variation.size for _ in range(variation.size)]
    for (row, column), e in variation.matrix:
        table[row][column] = e
    entries, orbit = tuple(map(tuple, table)), variation.orbit
    names = (*orbit.state, *orbit.parameters, *(s.name for s in variation.parameters), TIME.name)
    for cell in zip(state[:NODES], numbers[:NODES], strict=True):
        for strong in known:
            values = dict(zip(names, np.concatenate([*cell, strong, [0.0]]), strict=True))
            yield _of_blocks([_value(entries, {}, values)])


def _named(equations: Equations, state: np.ndarray, numbers: np.ndarray, time: float = 0.0) -> dict[str, float]:
    """States, parameters and the time by name."""
    found = dict(zip(equations.state, state, strict=True)) | dict(zip(equations.parameters, numbers, strict=True))
    return {**found, TIME.name: time}


def _of_blocks(blocks: Iterable[np.ndarray]) -> Rates:
    """Those of the eigenvalues of some blocks.

    A block with entries beyond the largest float is infinitely fast.
    """
    blocks = [block for block in blocks if not np.isnan(block).any()]
    if any(np.isinf(block).any() for block in blocks):
        return ENDLESS
    found = np.concatenate([np.linalg.eigvals(block) for block in blocks]) if blocks else np.zeros(0)
    real, imaginary = found.real, found.imag
    return Rates(*(float(parts.max(initial=0.0)) for parts in (np.abs(real), np.abs(imaginary), real)))


def _blocks(equations: Equations, values: Mapping[str, float]) -> list[np.ndarray]:
    """The blocks of the Jacobian of the first nodes, with twice what their links add."""
    blocks = [_block(equations, i, values) for i in range(min(equations.n, NODES))]
    for link, edge, share in _links(equations):
        if link[0] < len(blocks):
            found = _value(edge.jacobian_here(), equations.at_link(link, edge), values)
            with np.errstate(over="ignore", invalid="ignore"):
                blocks[link[0]] = blocks[link[0]] + 2.0 * share * found
    return [_by_masses(equations, i, values, block) for i, block in enumerate(blocks)]


def _block(equations: Equations, i: int, values: Mapping[str, float]) -> np.ndarray:
    """The Jacobian of a node's right-hand side less that of M F at fixed rates F."""
    node, at = equations.node_at(i), equations.at_node(i)
    found = _value(node.jacobian(), at, values)
    if node.constant_inertia:
        return found
    forces = _column(node.rhs, at, values)
    rates = [sp.Dummy(s.name, real=True) for s in node.state]
    known = dict(zip(rates, map(sp.Float, _by_masses(equations, i, values, forces)[:, 0]), strict=True))
    return found - _value(turned_masses(node, rates), {**at, **known}, values)


def _by_masses(equations: Equations, i: int, values: Mapping[str, float], right: np.ndarray) -> np.ndarray:
    """M^-1 right, M the mass matrix of a node; NaN where it is singular."""
    inertia = equations.node_at(i).inertia
    if not inertia:
        return right
    try:
        return np.linalg.solve(_value(inertia, equations.at_node(i), values), right)
    except np.linalg.LinAlgError:
        return np.full(right.shape, math.nan)


def _parts(
    equations: Equations, only_forced: bool = False
) -> Iterator[tuple[Node | Edge, Mapping[sp.Symbol, sp.Expr]]]:
    """The nodes and links that are looked at, and what their symbols stand for."""
    nodes = (equations.node_at(i) for i in range(min(equations.n, NODES)))
    yield from ((node, equations.at_node(i)) for i, node in enumerate(nodes) if node.forced or not only_forced)
    if not only_forced or any(edge.forced for edge in equations.edges):
        yield from ((edge, equations.at_link(link, edge)) for link, edge, _ in _links(equations))


def _finite(arrays: Iterable[np.ndarray]) -> bool:
    return all(np.isfinite(array).all() for array in arrays)


def _links(equations: Equations) -> Iterator[tuple[Link, Edge, float]]:
    """The links that are looked at with their templates, and how many links each stands for."""
    large = [(edge, pairs) for edge, pairs in equations.fields if len(pairs) > LINKS]
    if not large:
        yield from ((link, edge, 1.0) for link, edge in islice(equations.linked(), LINKS))
        return
    yield from ((link, edge, 1.0) for link, edge in islice(replace(equations, layers=equations.listed).linked(), LINKS))
    each = LINKS // NODES
    for edge, pairs in large:
        gaps = [1 + k * (pairs.n - 1) // each for k in range(each)]
        links = ((i, (i + gap) % pairs.n, pairs.weight) for i in range(min(pairs.n, NODES)) for gap in gaps)
        yield from ((link, edge, (pairs.n - 1) / each) for link in links)


def _bends(equations: Equations, values: Mapping[str, float]) -> Iterator[np.ndarray]:
    """The blocks of the nodes and of the links in the layers of their turning functions, one state moved there."""
    for i in range(min(equations.n, NODES)):
        node = equations.node_at(i)
        for moved in _turned(node.rhs, node.state, equations.at_node(i), values):
            yield _by_masses(equations, i, moved, _block(equations, i, moved))
    for link, edge, share in _links(equations):
        at = equations.at_link(link, edge)
        for moved in _turned(edge.rhs, edge.here, at, values):
            with np.errstate(over="ignore"):
                added = 2.0 * share * _by_masses(equations, link[0], moved, _value(edge.jacobian_here(), at, moved))
            yield added


def _turned(
    rates: tuple[sp.Expr, ...],
    states: tuple[sp.Symbol, ...],
    at: Mapping[sp.Symbol, sp.Expr],
    values: Mapping[str, float],
) -> Iterator[dict[str, float]]:
    """Values at which the argument of a turning function is zero, and close by on either side."""
    for state, place in _turns(rates, states):
        ((there,),) = _value(((place,),), at, values)
        for shift in (-1e-9, 0.0, 1e-9):
            yield {**values, at[state].name: there + shift * (1.0 + abs(there))}


@lru_cache(maxsize=64)
def _turns(rates: tuple[sp.Expr, ...], states: tuple[sp.Symbol, ...]) -> tuple[tuple[sp.Symbol, sp.Expr], ...]:
    """For each turning function a state, and the value of it at which the argument is zero.

    A root of a size, which a power of unknown exponent may be, is steep at a point, and has no layer.
    """
    roots = {
        p: sp.S.Zero
        for e in rates
        for p in e.atoms(sp.Pow)
        if isinstance(p.base, sp.Abs) and not (p.exp - 1).is_nonnegative
    }
    gaps = {part.args[0] for e in rates for part in e.xreplace(roots).atoms(*TURNING)}
    found = []
    for gap in sorted(gaps, key=sp.default_sort_key):
        slopes = ((s, gap.diff(s)) for s in states)
        found += [(s, s - gap / slope) for s, slope in slopes if slope != 0 and not slope.has(s)][:1]
    return tuple(found)


def _value(
    entries: tuple[tuple[sp.Expr, ...], ...], at: Mapping[sp.Symbol, sp.Expr], values: Mapping[str, float]
) -> np.ndarray:
    """The numbers of a block; NaN where it has none."""
    symbols, function = _compiled(entries)
    known: dict[sp.Symbol, float] = {}
    for s in symbols:
        e = at.get(s, s)
        known[s] = float(e) if e.is_number else values[e.name]
    shape = len(entries), len(entries[0])
    try:
        with np.errstate(all="ignore"):
            return np.array(function(*(known[s] for s in symbols)), dtype=float).reshape(shape)
    except (ArithmeticError, TypeError, ValueError):
        return np.full(shape, math.nan)


def _column(entries: tuple[sp.Expr, ...], at: Mapping[sp.Symbol, sp.Expr], values: Mapping[str, float]) -> np.ndarray:
    return _value(tuple((e,) for e in entries), at, values)


@lru_cache(maxsize=64)
def _compiled(entries: tuple[tuple[sp.Expr, ...], ...]) -> tuple[tuple[sp.Symbol, ...], Callable[..., object]]:
    flat = [e for row in entries for e in row]
    symbols = tuple(sorted(set().union(*(e.free_symbols for e in flat)), key=lambda s: s.name))
    return symbols, sp.lambdify(symbols, flat, "math")
