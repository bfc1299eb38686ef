"""How long a drive that jumps, or has a kink, stays on one side."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache

import numpy as np
import sympy as sp

from synchain.models.dynamics.periodicity import names_in
from synchain.models.mechanics.components import TIME

POINTS = 1 << 14
"""Points of a period at which a drive is looked at."""

PERIODS = 16
"""As many times more points a drive without a period is looked at."""

RESOLVED = 2.0
"""Points between two zeros that are told apart without a parabola."""

WIDTH = 2.0
"""What tanh changes by while its argument does by so much is three quarters of its height."""

TOUCH = 1e-9
"""A stay that is a smaller part of a period than this is none: the drive touches zero to rounding."""


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
    different, which = np.unique(rows, axis=0, return_inverse=True)
    found = np.array([_shortest(gaps, rises, *map(float, row)) for row in different])
    return np.asarray(found[which.reshape(-1)])


@lru_cache(maxsize=4096)
def _shortest(gaps: tuple[sp.Expr, ...], rises: tuple[sp.Expr, ...], *row: float) -> float:
    """The shortest time of one row: values of the parameters, the period and the end."""
    written, _ = _written((*gaps, *rises))
    *known, period, end = row
    # of two periods, one whole stay of each kind at least
    length, points = (2.0 * period, 2 * POINTS) if period else (end, PERIODS * POINTS)
    times, pitch = np.linspace(0.0, length, points + 1, retstep=True)
    with np.errstate(all="ignore"):
        found = [np.broadcast_to(g, times.shape) for g in written(times, *known)]
        passages, dips = (
            [_passages(g, k >= len(gaps)) for k, g in enumerate(found)],
            [_dips(g) for g in found[: len(gaps)]],
        )
    apart = np.concatenate([_apart(own) for own in (*passages, np.concatenate(passages, axis=1))])
    stays = np.concatenate([apart[apart > RESOLVED], *dips])
    return float(pitch * np.min(stays[stays * pitch > TOUCH * length], initial=math.inf))


def _passages(values: np.ndarray, rises: bool) -> np.ndarray:
    """Where values change their sign, and how long they take to rise, 0 if they jump: (2, passages) in points."""
    places = np.flatnonzero(values)
    old, new = values[places[:-1]], values[places[1:]]
    passed = old * new < 0.0
    gone, length = (new - old)[passed], np.diff(places)[passed]
    return np.stack([places[:-1][passed] - old[passed] / gone * length, rises * WIDTH * length / np.abs(gone)])


def _apart(passages: np.ndarray) -> np.ndarray:
    """How far neighbours are apart, or how long the slower one of both takes, if that is longer."""
    places, widths = passages[:, np.argsort(passages[0])]
    return np.maximum(np.diff(places), np.maximum(widths[1:], widths[:-1]))


def _dips(values: np.ndarray) -> np.ndarray:
    """The lengths, in points, for which parabolas through three values leave the side on which these begin and end."""
    before, here, after = values[:-2], values[1:-1], values[2:]
    slope, bend = 0.5 * (after - before), after - 2.0 * here + before
    bottom = here - 0.5 * slope * slope / bend
    sunk = (before * after > 0.0) & (np.abs(slope) <= np.abs(bend)) & (bottom * before < 0.0)
    return np.asarray(2.0 * np.sqrt(-2.0 * bottom[sunk] / bend[sunk]))


@lru_cache(maxsize=64)
def _written(gaps: tuple[sp.Expr, ...]) -> tuple[Callable[..., Sequence[np.ndarray]], tuple[str, ...]]:
    """The expressions as a function of times and of numbers in the order of the names."""
    names = tuple(name for name in names_in(sp.Tuple(*gaps)) if name != TIME.name)
    symbols = [sp.Symbol(name, real=True) for name in names]
    return sp.lambdify([TIME, *symbols], list(gaps), ["scipy", "numpy"]), names
