"""Compute rates of decay, growth and turning at a state: eigenvalues of each node's diagonal block of the Jacobian."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import sympy as sp

from synchain.models.dynamics.variational import Variation
from synchain.models.mechanics.components import TIME

NODES = 50  # rates are computed for at most this number of orbits: a choice for speed
SPREAD = 30.0  # a decay counts as separate if it is SPREAD times as fast as the slowest motion of its node: a choice
# Functions that are steep, or turn sharply, where their argument is zero: the layer of a smoothed jump.
TURNING = (sp.atan, sp.tanh, sp.erf, sp.Abs)


class FastestRates(NamedTuple):
    """The fastest decay or growth at a state, the fastest turning, and the fastest growth."""

    # 0 for rates without a value.

    fastest: float
    turning: float
    growth: float


def mode_rates(
    variation: Variation, state: np.ndarray, parameters: np.ndarray, strengths: np.ndarray
) -> Iterator[FastestRates]:
    """Yield the rates of deviations along the first orbits at three strengths: 0, the largest, the most negative."""
    strengths, extreme = strengths[: len(variation.parameters)], []
    if strengths.size:
        extreme = [np.argmax(np.hypot.reduce(strengths, axis=0)), np.argmin(strengths[0])]
    chosen = [np.zeros(len(strengths)), *(strengths[:, column] for column in dict.fromkeys(extreme))]
    table = [[sp.S.Zero] * variation.size for _ in range(variation.size)]
    for (row, column), e in variation.matrix:
        table[row][column] = e
    entries, orbit = tuple(map(tuple, table)), variation.orbit
    names = (*orbit.state, *orbit.parameters, *(s.name for s in variation.parameters), TIME.name)
    for cell in zip(state[:NODES], parameters[:NODES], strict=True):
        for strength in chosen:
            values = dict(zip(names, np.concatenate([*cell, strength, [0.0]]), strict=True))
            block = _value(entries, values)
            yield FastestRates(*(float(rate[0]) for rate in eigenvalue_rates(block[None, None])[:3]))


def eigenvalue_rates(blocks: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the fastest decay or growth, turning, growth and parted decay (cells,) of blocks (cells, count, p, p)."""
    # A decay is parted if it is SPREAD times as fast as the slowest motion of its block. A block with an infinite entry
    # is infinitely fast; one with a NaN does not count.
    endless = (np.isinf(blocks).any(axis=(2, 3)) & ~np.isnan(blocks).any(axis=(2, 3))).any(axis=1)
    blocks = np.where(np.isfinite(blocks).all(axis=(2, 3), keepdims=True), blocks, 0.0)
    if blocks.shape[-1] == 2:  # the quadratic formula, twenty times faster than LAPACK
        half = 0.5 * (blocks[..., 0, 0] + blocks[..., 1, 1])
        root = (0.5 * (blocks[..., 0, 0] - blocks[..., 1, 1])) ** 2 + blocks[..., 0, 1] * blocks[..., 1, 0]
        real, imaginary = np.sqrt(np.maximum(root, 0.0)), np.sqrt(np.maximum(-root, 0.0))
        real = np.stack([half - real, half + real])
    else:
        values = np.moveaxis(np.linalg.eigvals(blocks), -1, 0)
        real, imaginary = values.real, np.abs(values.imag).max(axis=0, initial=0.0)
    sizes = np.hypot(real, imaginary)
    decays = np.where(sizes.min(axis=0) * SPREAD < -real.min(axis=0), -real.min(axis=0), 0.0)
    fastest, growth = np.abs(real).max(axis=(0, 2), initial=0.0), real.max(axis=(0, 2), initial=0.0)
    return (
        np.where(endless, np.inf, fastest),
        np.where(endless, 0.0, imaginary.max(axis=1, initial=0.0)),
        np.where(endless, np.inf, growth),
        np.where(endless, np.inf, decays.max(axis=1, initial=0.0)),
    )


@lru_cache(maxsize=64)
def turns(rates: tuple[sp.Expr, ...], states: tuple[sp.Symbol, ...]) -> tuple[tuple[sp.Symbol, sp.Expr], ...]:
    """Return, for each turning function, a state and the value of this state at which the argument is zero."""
    # Powers of absolute values are left out: a root is steep at one point only, and so has no layer.
    #
    # Leave out powers of absolute values, then collect the arguments of turning functions.
    roots = {
        p: sp.S.Zero
        for e in rates
        for p in e.atoms(sp.Pow)
        if isinstance(p.base, sp.Abs) and not (p.exp - 1).is_nonnegative
    }
    gaps = {part.args[0] for e in rates for part in e.xreplace(roots).atoms(*TURNING)}
    # The zero of an argument follows from the first state in which the argument is linear.
    middles = []
    for gap in sorted(gaps, key=sp.default_sort_key):
        slopes = ((s, gap.diff(s)) for s in states)
        middles += [(s, s - gap / slope) for s, slope in slopes if slope != 0 and not slope.has(s)][:1]
    return tuple(middles)


def _value(entries: tuple[tuple[sp.Expr, ...], ...], values: Mapping[str, float]) -> np.ndarray:
    """Return the values of a block's entries; NaN if the block cannot be evaluated."""
    symbols, function = _compiled(entries)
    shape = len(entries), len(entries[0])
    try:
        with np.errstate(all="ignore"):
            return np.array(function(*(values[s.name] for s in symbols)), dtype=float).reshape(shape)
    except (ArithmeticError, TypeError, ValueError):
        return np.full(shape, math.nan)


@lru_cache(maxsize=64)
def _compiled(entries: tuple[tuple[sp.Expr, ...], ...]) -> tuple[tuple[sp.Symbol, ...], Callable[..., object]]:
    flat = [e for row in entries for e in row]
    symbols = tuple(sorted(set().union(*(e.free_symbols for e in flat)), key=lambda s: s.name))
    return symbols, sp.lambdify(symbols, flat, "math")
