"""The time scales of a drive: its period, and the longest step that misses no swing of it."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.periodicity import Drive, as_function, drive_of, names_in
from synchain.models.mechanics.components import TIME

from .shortest_interval import shortest_stays


def periods(equations: Equations, parameters: np.ndarray) -> np.ndarray:
    """Return the period (cells,) of the equations at parameters (cells, parameters); 0 without a drive or a period."""
    if len(parameters) == 0:
        return np.zeros(0)
    return _periods(_drive(equations), dict(zip(equations.parameters, parameters.T, strict=True)), len(parameters))


def longest_steps(equations: Equations, parameters: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return the longest step (cells,) at parameters (cells, parameters) of runs up to the times `end` (cells,).

    A longer step could miss a swing or a pulse of the drive.  The limit is half the period of the fastest sine or cosine of
    time, or the shortest time between two zeros, jumps, kinks (`Drive.gaps`) or rises (`Drive.rises`) of another function
    of time; inf without a drive.  A drive without a period is sampled up to `end`.
    """
    if not equations.forced or not len(parameters):
        return np.full(len(parameters), math.inf)
    values = by_place(equations, parameters)
    places = len(next(iter(values.values()), end)) // len(end)
    return np.asarray(_half_swings(equations, values, np.tile(end, places)).reshape(places, -1).min(axis=0))


def half_swing(equations: Equations, values: Mapping[str, np.ndarray], end: float = 1e3) -> float:
    """Return the least of the longest steps of some rows of parameters by name, see `longest_steps`."""
    rows = max((len(column) for column in values.values()), default=1)
    return float(_half_swings(equations, values, np.full(rows, end)).min(initial=math.inf))


def by_place(equations: Equations, parameters: np.ndarray) -> dict[str, np.ndarray]:
    """Return the drive's parameters of cells (cells, parameters) by their names in templates: a row for each cell and place.

    Places are the nodes and, beside them, the links; NaN for parameters that a place lacks.
    """
    drive = _drive(equations)
    names = {name for expr in (*drive.paces, *drive.gaps, *drive.rises) for name in names_in(expr)}
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
    # Functions of parameters that no row has belong to other templates.
    gaps, rises = (
        tuple(expr for expr in exprs if {*names_in(expr)} <= {*values, TIME.name})
        for exprs in (drive.gaps, drive.rises)
    )
    if not (gaps or rises):
        return np.asarray(longest)
    shortest = shortest_stays(gaps, rises, values, _periods(drive, values, rows), end)
    return np.asarray(np.minimum(longest, shortest))
