"""Runs that begin where an earlier one ended: states by their labels, and the phase of the drive."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TypeAlias

import numpy as np
import xarray as xr

from synchain.codegen.driver.columns import Span
from synchain.models.inputs.checks import typed_repr
from synchain.models.mechanics.friction import SLIP
from synchain.models.scenes.scene import Scene

from ..cells.plan import Planner
from ..results.labels import DRIVE_PHASE, END_TIME, STATE, States
from ..results.result import Result
from ..support.arrays import row

__all__ = ["Start", "expect_whole_periods", "started"]

Start: TypeAlias = Result | xr.DataArray | Mapping[str, object] | Sequence[float] | np.ndarray
"""What a run may start from."""

WHOLE = 1e-9
"""Largest distance of a time from a whole number of drive periods, in periods."""

CELLS = 65536
"""Cells of a continued sweep that are looked at together."""


def started(scene: Scene, start: Start) -> tuple[Scene, float]:
    """Return the scene with the states of one cell as its start, and when they were reached.

    Parameters
    ----------
    scene : Scene
    start : Result, DataArray, mapping, or sequence of numbers
        A result of one cell, or the states `end` of one, with dimensions component and node; a table as `initial` of
        `Scene` takes; or all states in the order of the equations.

    Raises
    ------
    TypeError
        If `start` is none of these.
    ValueError
        If the states are those of several cells or of other components or nodes, if one is not
        finite, or if the drive was not at the beginning of a period.
    """
    if isinstance(start, Result) and not start.success:
        raise ValueError(f"start: found a result with {start.message}; expected a cell that finished")
    if isinstance(start, Mapping):
        return scene.replace(initial=start), 0.0
    if isinstance(start, list | tuple | np.ndarray):
        start = _in_order(scene, start)
    end = start.end if isinstance(start, Result) else start
    if not isinstance(end, xr.DataArray):
        raise TypeError(
            f"start: found {typed_repr(start)}; expected a Result of one cell, result.end of one, a table of initial states, "
            "or all states in a row"
        )
    _check_labels(scene, end)
    time = float(end.coords[END_TIME]) if END_TIME in end.coords else 0.0
    _check_phase(scene, end, time)
    initial = {}
    for name in scene.components:
        if name != SLIP.name:  # the modes of contacts follow from the other states
            nodes = [scene.topology.labels[i] for i in scene.equations.holders(name)]
            initial[name] = [float(x) for x in end.sel(component=name, node=nodes).values]
    if not all(math.isfinite(x) for values in initial.values() for x in values):
        raise ValueError("start: found a state that is not finite; expected those of a cell that finished")
    return scene.replace(initial=initial), time


def expect_whole_periods(planner: Planner) -> None:
    """Refuse a continued sweep in which the drive is amid a period at the end of a cell, as each cell begins with one.

    Raises
    ------
    ValueError
        With the part of the period.
    """
    scene = planner.scene
    if not (scene.continued and scene.forced) or scene.time_unit == "period":
        return
    for first in range(0, scene.cells, CELLS):
        spans = planner.spans(np.arange(first, min(first + CELLS, scene.cells)))
        with np.errstate(divide="ignore", invalid="ignore"):
            periods = np.where(spans[:, Span.PERIOD] > 0.0, spans[:, Span.END] / spans[:, Span.PERIOD], np.nan)
        amid = np.abs(periods - np.rint(periods)) < WHOLE
        if not amid.all():
            part = periods[amid.argmin()] % 1.0
            where = "has no period" if math.isnan(part) else f"is {part:.6f} into a period"
            raise ValueError(
                f"continuation: the drive {where} at the end of a cell; expected the beginning of one, where the next cell "
                "begins; let transient + window be whole drive periods, or set time_unit = 'period'"
            )


def _in_order(scene: Scene, start: Sequence[float] | np.ndarray) -> xr.DataArray:
    """States in the order of the equations with their labels."""
    values, names = row("start", start), scene.equations.state
    if len(values) != len(names):
        raise ValueError(f"start: found {len(values)} numbers; expected {len(names)}, of {_listed(names)}")
    states = States.of(scene)
    labels = {"component": list(states.components), "node": list(scene.topology.labels)}
    return xr.DataArray(states.table(values), labels, STATE)


def _check_labels(scene: Scene, end: xr.DataArray) -> None:
    """Raise ValueError if the labels are not those of one cell of the scene."""
    further = [f"{name} ({end.sizes[name]})" for name in end.dims if name not in STATE]
    if further:
        axis = next(name for name in end.dims if name not in STATE)
        raise ValueError(
            f"start: found the states of several cells, along {', '.join(map(str, further))}; expected those of one; "
            f"choose it, e.g. result.end.isel({axis}=-1)"
        )
    expected = {"component": tuple(scene.equations.components), "node": tuple(scene.topology.labels)}
    for name, labels in expected.items():
        found = tuple(end.coords[name].values.tolist()) if name in end.dims and name in end.coords else ()
        if set(found) != set(labels) or len(found) != len(labels):
            raise ValueError(
                f"start: found the {name}s {_listed(found)}; expected {_listed(labels)}, those of the scene"
            )


def _check_phase(scene: Scene, end: xr.DataArray, time: float) -> None:
    """Raise ValueError if the drive was amid a period, where a run cannot begin."""
    if not scene.forced or time == 0.0:
        return
    phase = float(end.coords[DRIVE_PHASE]) if DRIVE_PHASE in end.coords else np.nan
    if not abs(phase - np.rint(phase)) < WHOLE:
        where = "has no period" if math.isnan(phase) else f"is {phase:.6f} into a period"
        raise ValueError(
            f"start: the drive {where} at t = {time:.10g}; expected the beginning of one, where a run begins; "
            "let the first run last a whole number of drive periods"
        )


def _listed(labels: tuple[object, ...]) -> str:
    words = [str(label) for label in labels[:8]]
    return ", ".join([*words, *(["…"] if len(labels) > len(words) else [])]) or "none"
