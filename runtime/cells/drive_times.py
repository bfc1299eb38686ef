"""Compute the time scales of a drive: the period, and the longest step that misses no swing of the drive."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache

import numpy as np
import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.periodicity import Drive, as_function, drive_of, names_in
from synchain.models.mechanics.components import TIME

POINTS = 1 << 14  # number of samples of a drive in one period: a choice for speed
PERIODS = 16  # a drive without a period has PERIODS times as many samples: a choice for speed
RESOLVED = 2.0  # two zeros closer than this number of samples count as distinct only if a parabola separates them
WIDTH = 2.0  # change of the argument of tanh over which it rises by three quarters of its height
TOUCH = 1e-9  # ignore intervals shorter than TOUCH periods: the drive only touches zero there, to rounding


def periods(equations: Equations, parameters: np.ndarray) -> np.ndarray:
    """Return the period (cells,) of the equations at parameters (cells, parameters); 0 without a drive or a period."""
    if len(parameters) == 0:
        return np.zeros(0)
    return _periods(_drive(equations), dict(zip(equations.parameters, parameters.T, strict=True)), len(parameters))


def longest_steps(equations: Equations, parameters: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return the longest step (cells,) at parameters (cells, parameters) of runs up to the times `end` (cells,)."""
    # A longer step could miss a swing or a pulse of the drive. For sines and cosines of time, the limit is half the
    # period of the fastest. For another function of time, the limit is the shortest time between two zeros, jumps,
    # kinks (`Drive.gaps`) or rises (`Drive.rises`). Without a drive the limit is inf. A drive without a period is
    # sampled up to `end`.
    if not equations.forced or not len(parameters):
        return np.full(len(parameters), math.inf)
    values = by_place(equations, parameters)
    places = len(next(iter(values.values()), end)) // len(end)
    return np.asarray(_half_swings(equations, values, np.tile(end, places)).reshape(places, -1).min(axis=0))


def half_swing(equations: Equations, values: Mapping[str, np.ndarray], end: float = 1e3) -> float:
    """Return the least of the `longest_steps` of rows of parameters, which are given by name."""
    rows = max((len(column) for column in values.values()), default=1)
    return float(_half_swings(equations, values, np.full(rows, end)).min(initial=math.inf))


def by_place(equations: Equations, parameters: np.ndarray) -> dict[str, np.ndarray]:
    """Return the parameters of the drive by their names in templates, with a row for each cell and place."""
    # Places are the nodes and the links. The value is NaN for a parameter that a place does not have. Shapes:
    # parameters (cells, parameters).
    names = drive_parameters(equations)
    columns = dict(zip(equations.parameters, parameters.T, strict=True))
    at_nodes = {name: [f"{name}_{i + 1}" for i in range(equations.n)] for name in equations.varied}
    at_links = {name: list(layer.names(name)) for name, layer in equations.numbered.items()}
    differing = {name: single for name, single in (at_nodes | at_links).items() if name in names}
    places, absent = max(map(len, differing.values()), default=1), np.full(len(parameters), np.nan)
    values = {name: np.tile(columns[name], places) for name in names & {*columns}}
    for name, single in differing.items():
        padded = single + [""] * (places - len(single))
        values[name] = np.concatenate([columns.get(parameter, absent) for parameter in padded])
    return values


def drive_parameters(equations: Equations) -> set[str]:
    """Return the parameters, by their names in templates, on which the times of the drive depend."""
    drive = _drive(equations)
    frequency = () if drive.frequency is None else (drive.frequency,)
    return {name for expr in (*frequency, *drive.paces, *drive.gaps, *drive.rises) for name in names_in(expr)}


def _drive(equations: Equations) -> Drive:
    return drive_of((*equations.nodes, *equations.edges), equations.differing)


def _periods(drive: Drive, values: Mapping[str, np.ndarray], rows: int) -> np.ndarray:
    """Return the period (rows,) of a drive; 0 if there is none."""
    if drive.frequency is None:
        return np.zeros(rows)
    with np.errstate(divide="ignore"):
        lengths = 2.0 * math.pi / _frequencies(drive.frequency, values, rows)
    return np.where(np.isfinite(lengths), lengths, 0.0)


def _frequencies(frequency: sp.Expr, values: Mapping[str, np.ndarray], rows: int) -> np.ndarray:
    """Return the absolute values (rows,) of a frequency, by the same function as `Scene.angular_frequency`."""
    names = names_in(frequency)
    if not names:
        return np.full(rows, abs(as_function(frequency)()))
    signed = np.frompyfunc(as_function(frequency), len(names), 1)(*(values[name] for name in names))
    return np.asarray(np.abs(np.asarray(signed, dtype=float)))


def _half_swings(equations: Equations, values: Mapping[str, np.ndarray], end: np.ndarray) -> np.ndarray:
    """Return the longest step (rows,) at parameters by name."""
    rows, drive = len(end), _drive(equations)
    fastest = np.fmax.reduce([np.zeros(rows), *(_frequencies(pace, values, rows) for pace in drive.paces)])
    with np.errstate(divide="ignore"):
        longest = np.where(fastest > 0.0, math.pi / fastest, math.inf)
    # Leave out functions of parameters that are absent: they belong to other templates.
    gaps, rises = (
        tuple(expr for expr in exprs if {*names_in(expr)} <= {*values, TIME.name})
        for exprs in (drive.gaps, drive.rises)
    )
    if not (gaps or rises):
        return np.asarray(longest)
    shortest = _shortest_stays(gaps, rises, values, _periods(drive, values, rows), end)
    return np.asarray(np.minimum(longest, shortest))


def _shortest_stays(
    gaps: tuple[sp.Expr, ...],
    rises: tuple[sp.Expr, ...],
    values: Mapping[str, np.ndarray],
    periods: np.ndarray,
    end: np.ndarray,
) -> np.ndarray:
    """Return the shortest time (rows,) between two zeros of expressions of time; inf for fewer than two zeros."""
    # Shapes: values (rows,), periods (rows,), end (rows,). Two zeros of one smooth expression are found at any
    # distance; other zeros must be RESOLVED samples apart.
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
    # Two periods contain at least one complete interval between any two zeros.
    length, points = (2.0 * period, 2 * POINTS) if period else (end, PERIODS * POINTS)
    times, pitch = np.linspace(0.0, length, points + 1, retstep=True)
    with np.errstate(all="ignore"):
        samples = [np.broadcast_to(g, times.shape) for g in functions(times, *parameters)]
        passages = [_passages(g, k >= len(gaps)) for k, g in enumerate(samples)]
        dips = [_dips(g) for g in samples[: len(gaps)]]
    # Collect the distances between zeros of one function, and between zeros of different functions.
    apart = np.concatenate([_apart(zeros) for zeros in (*passages, np.concatenate(passages, axis=1))])
    stays = np.concatenate([apart[apart > RESOLVED], *dips])
    return float(pitch * np.min(stays[stays * pitch > TOUCH * length], initial=math.inf))


def _passages(values: np.ndarray, rises: bool) -> np.ndarray:
    """Return the positions of changes of sign and their rise times (2, passages), in samples."""
    # A jump has the rise time 0.
    nonzero = np.flatnonzero(values)
    old, new = values[nonzero[:-1]], values[nonzero[1:]]
    passed = old * new < 0.0
    change, length = (new - old)[passed], np.diff(nonzero)[passed]
    return np.stack([nonzero[:-1][passed] - old[passed] / change * length, rises * WIDTH * length / np.abs(change)])


def _apart(passages: np.ndarray) -> np.ndarray:
    """Return the distances of neighbouring zeros, or the rise time of the slower one if that is longer."""
    zeros, widths = passages[:, np.argsort(passages[0])]
    return np.asarray(np.maximum(np.diff(zeros), np.maximum(widths[1:], widths[:-1])))


def _dips(values: np.ndarray) -> np.ndarray:
    """Return the distances, in samples, between two zeros that lie between neighbouring samples of one sign."""
    # A parabola through three samples detects such zeros.
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
