"""The shortest interval in which a drive with jumps, kinks or rises stays on one side."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache

import numpy as np
import sympy as sp

from synchain.models.dynamics.periodicity import names_in
from synchain.models.mechanics.components import TIME

POINTS = 1 << 14
"""Samples of a drive in one period: a choice of time."""

PERIODS = 16
"""Factor of the samples of a drive without a period: a choice of time."""

RESOLVED = 2.0
"""Least distance, in samples, of two zeros that are distinct without a parabola."""

WIDTH = 2.0
"""Change of the argument of tanh over which it rises by three quarters of its height."""

TOUCH = 1e-9
"""Ignore intervals shorter than TOUCH periods: the drive only touches zero there, to rounding."""


def shortest_stays(
    gaps: tuple[sp.Expr, ...],
    rises: tuple[sp.Expr, ...],
    values: Mapping[str, np.ndarray],
    periods: np.ndarray,
    end: np.ndarray,
) -> np.ndarray:
    """Return the shortest time (rows,) between two zeros of expressions of time; inf if there are no two.

    Shapes: values (rows,), periods (rows,), end (rows,).

    Notes
    -----
    Two zeros of one smooth expression are found however close they are, others if they are RESOLVED points apart.
    """
    _, names = _written((*gaps, *rises))
    ends = np.where(periods > 0.0, 0.0, end)
    rows = np.column_stack([*(np.broadcast_to(values[name], periods.shape) for name in names), periods, ends])
    different, row_of = np.unique(rows, axis=0, return_inverse=True)
    shortest = np.array([_shortest(gaps, rises, *map(float, row)) for row in different])
    return np.asarray(shortest[row_of.reshape(-1)])


@lru_cache(maxsize=4096)
def _shortest(gaps: tuple[sp.Expr, ...], rises: tuple[sp.Expr, ...], *row: float) -> float:
    """Return the shortest time of one row: values of the parameters, the period and the end."""
    functions, _ = _written((*gaps, *rises))
    *parameters, period, end = row
    # Two periods hold a complete interval of each kind at least.
    length, points = (2.0 * period, 2 * POINTS) if period else (end, PERIODS * POINTS)
    times, pitch = np.linspace(0.0, length, points + 1, retstep=True)
    with np.errstate(all="ignore"):
        samples = [np.broadcast_to(g, times.shape) for g in functions(times, *parameters)]
        passages = [_passages(g, k >= len(gaps)) for k, g in enumerate(samples)]
        dips = [_dips(g) for g in samples[: len(gaps)]]
    # Between zeros of one function, and between zeros of any two.
    apart = np.concatenate([_apart(zeros) for zeros in (*passages, np.concatenate(passages, axis=1))])
    stays = np.concatenate([apart[apart > RESOLVED], *dips])
    return float(pitch * np.min(stays[stays * pitch > TOUCH * length], initial=math.inf))


def _passages(values: np.ndarray, rises: bool) -> np.ndarray:
    """Return (2, passages) in samples: where values change their sign, and how long they take to rise, 0 if they jump."""
    nonzero = np.flatnonzero(values)
    old, new = values[nonzero[:-1]], values[nonzero[1:]]
    passed = old * new < 0.0
    change, length = (new - old)[passed], np.diff(nonzero)[passed]
    return np.stack([nonzero[:-1][passed] - old[passed] / change * length, rises * WIDTH * length / np.abs(change)])


def _apart(passages: np.ndarray) -> np.ndarray:
    """Return the distances of neighbouring zeros, or the rise time of the slower one if that is longer."""
    zeros, widths = passages[:, np.argsort(passages[0])]
    return np.maximum(np.diff(zeros), np.maximum(widths[1:], widths[:-1]))


def _dips(values: np.ndarray) -> np.ndarray:
    """Return the lengths, in samples, for which parabolas through three values leave the side on which these begin and end."""
    before, here, after = values[:-2], values[1:-1], values[2:]
    slope, bend = 0.5 * (after - before), after - 2.0 * here + before
    bottom = here - 0.5 * slope * slope / bend
    sunk = (before * after > 0.0) & (np.abs(slope) <= np.abs(bend)) & (bottom * before < 0.0)
    return np.asarray(2.0 * np.sqrt(-2.0 * bottom[sunk] / bend[sunk]))


@lru_cache(maxsize=64)
def _written(gaps: tuple[sp.Expr, ...]) -> tuple[Callable[..., Sequence[np.ndarray]], tuple[str, ...]]:
    """Return the expressions as a function of times and of parameters in the order of the names."""
    names = tuple(name for name in names_in(sp.Tuple(*gaps)) if name != TIME.name)
    symbols = [sp.Symbol(name, real=True) for name in names]
    return sp.lambdify([TIME, *symbols], list(gaps), ["scipy", "numpy"]), names
