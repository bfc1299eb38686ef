"""Start a run from the end of an earlier run: match states by their labels, and check the phase of the drive."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TypeAlias, TypeGuard

import numpy as np
import xarray as xr

from synchain.codegen.driver.columns import SpanColumn
from synchain.models.inputs.checks import typed_repr
from synchain.models.scenes.scene import Scene

from ..cells.plan import Planner
from ..results.labels import DRIVE_PHASE, END_TIME, STATE, States, coordinates, dimensions
from ..results.result import Result
from ..support.arrays import row

# Types of the argument `start`.
StartValue: TypeAlias = Result | xr.DataArray | Mapping[str, object] | Sequence[float] | np.ndarray
# Name of an attribute, or coordinate, of results: the time of the earlier run at which the run started.
START_TIME = "start_time"
# A number of drive periods within this distance of a whole number counts as whole: a choice far above rounding.
WHOLE = 1e-9
CELLS = 65536  # number of cells of a continued sweep whose periods are computed at once; bounds the memory


def started(scene: Scene, start: StartValue) -> tuple[Scene, float]:
    """Return the scene with the states of one cell as start, and the time at which the earlier run reached them."""
    if isinstance(start, Mapping):
        return scene.replace(initial=start), 0.0
    if isinstance(start, list | tuple | np.ndarray):
        # Label states in the order of the equations.
        numbers, state_names = row("start", start), scene.equations.state
        if len(numbers) != len(state_names):
            raise ValueError(
                f"start: found {len(numbers)} numbers; expected {len(state_names)}, of {_listed(state_names)}"
            )
        layout = States.of(scene)
        labels = {"component": list(layout.components), "node": list(scene.topology.labels)}
        start = xr.DataArray(layout.table(numbers), labels, STATE)
    end = _end(start)
    if not isinstance(end, xr.DataArray):
        raise TypeError(
            f"start: found {typed_repr(start)}; expected a Result of one cell, result.end of one, a table of initial states, "
            "or all states in a row"
        )
    _check_labels(scene, end)
    time = float(end.coords[END_TIME]) if END_TIME in end.coords else 0.0
    _check_phases(scene, end)
    initial = {}
    for name in scene.components:
        if name not in scene.equations.modes:  # the modes of contacts follow from the other states
            nodes = [scene.topology.labels[i] for i in scene.equations.holders(name)]
            initial[name] = [float(x) for x in end.sel(component=name, node=nodes).values]
    _expect_finite(np.array([x for values in initial.values() for x in values]))
    return scene.replace(initial=initial), time


def several(start: StartValue) -> TypeGuard[Result | xr.DataArray]:
    """True for a result, or states, of several cells."""
    end = _end(start)
    return isinstance(end, xr.DataArray) and set(STATE) < set(end.dims)


def starts_of_cells(scene: Scene, start: Result | xr.DataArray) -> tuple[np.ndarray, np.ndarray]:
    """Return the initial states (cells, dimension) of a scene's cells, and the times (axes) of the earlier run."""
    # A cell starts from the cell with the same values of the axes. If `start` lacks an axis, all values of this axis
    # start from one cell. Raise ValueError as in `started`, and if an axis of `start` is unknown or has other values.
    end, dims = start.end if isinstance(start, Result) else start, dimensions(scene)
    states = end.isel({name: 0 for name in end.dims if name in dims})
    _check_labels(scene, states)
    if scene.continued:
        raise ValueError(
            f"start: found the states of several cells; expected those of one, as continuation = {str(scene.continuation)!r} "
            "starts cells from others; set continuation = 'none'"
        )
    # Coordinates along the axes and draws identify the cells.
    expected = xr.Dataset(coords=coordinates(scene)).coords
    for name, values in end.coords.items():
        along = set(values.dims) & set(dims)
        if (
            along
            and name in expected
            and not (values.dims == expected[name].dims and np.array_equal(values, expected[name]))
        ):
            raise ValueError(
                f"start: found cells of {name} = {_listed(values.values.ravel().tolist())}; expected those of the sweep, "
                f"{_listed(expected[name].values.ravel().tolist())}; choose one cell, e.g. result.end.isel({next(iter(along))}=-1)"
            )
    for name in set(end.dims) & set(dims):
        size = scene.shape[dims.index(name)]
        if end.sizes[name] != size:
            raise ValueError(f"start: found {end.sizes[name]} cells along {name}; expected {size}, those of the sweep")
    _check_phases(scene, end)
    labels = {"component": list(scene.equations.components), "node": list(scene.topology.labels)}
    table = _along(end.sel(labels), dims, STATE)
    starts = States.of(scene).flat(np.broadcast_to(table, (*scene.shape, *table.shape[-2:]))).reshape(scene.cells, -1)
    modes = [k for k, name in enumerate(scene.equations.state) if name.rpartition("_")[0] in scene.equations.modes]
    starts[:, modes] = np.array(scene.y0)[modes]  # slip modes follow from the other states
    _expect_finite(np.delete(starts, modes, axis=1))
    time = end.coords.get(END_TIME, xr.zeros_like(end.isel({name: 0 for name in STATE}, drop=True)))
    return starts, np.broadcast_to(_along(time, dims), scene.shape).astype(float)


def with_start_times(result: Result, times: float | np.ndarray) -> Result:
    """Return a result with the start time in the earlier run: an attribute, or a coordinate (axes) if cells differ."""
    if isinstance(times, float):
        return Result(result.data.assign_attrs({START_TIME: times}), result.scene)
    return Result(result.data.assign_coords({START_TIME: (dimensions(result.scene), times)}), result.scene)


def _end(start: StartValue) -> object:
    """Return the final states of a result whose cells have all finished; return any other start unchanged."""
    if not isinstance(start, Result):
        return start
    if not start.success:
        raise ValueError(f"start: found a result with {start.message}; expected cells that finished")
    return start.end


def _along(values: xr.DataArray, dims: tuple[str, ...], more: tuple[str, ...] = ()) -> np.ndarray:
    """Return values with the dimensions of a sweep, then `more`; a missing dimension gets the length 1."""
    missing = [name for name in dims if name not in values.dims]
    return values.expand_dims(missing).transpose(*dims, *more).values


def _expect_finite(states: np.ndarray) -> None:
    if not np.isfinite(states).all():
        raise ValueError("start: found a state that is not finite; expected those of a cell that finished")


def expect_whole_periods(planner: Planner) -> None:
    """Raise ValueError if a cell of a continued sweep ends within a drive period: the next cell starts at phase 0."""
    scene = planner.scene
    if not (scene.continued and scene.forced) or scene.time_unit == "period":
        return
    for first in range(0, scene.cells, CELLS):
        spans = planner.spans(np.arange(first, min(first + CELLS, scene.cells)))
        with np.errstate(divide="ignore", invalid="ignore"):
            periods = np.where(
                spans[:, SpanColumn.PERIOD] > 0.0, spans[:, SpanColumn.END] / spans[:, SpanColumn.PERIOD], np.nan
            )
        amid = np.abs(periods - np.rint(periods)) < WHOLE
        if not amid.all():
            part = periods[amid.argmin()] % 1.0
            where = "has no period" if math.isnan(part) else f"is {part:.6f} into a period"
            raise ValueError(
                f"continuation: the drive {where} at the end of a cell; expected the beginning of one, where the next cell "
                "begins; let transient + window be whole drive periods, or set time_unit = 'period'"
            )


def _check_labels(scene: Scene, end: xr.DataArray) -> None:
    further = [f"{name} ({end.sizes[name]})" for name in end.dims if name not in STATE]
    if further:
        axis = next(name for name in end.dims if name not in STATE)
        raise ValueError(
            f"start: found the states of several cells, along {', '.join(map(str, further))}; expected those of one; "
            f"choose it, e.g. result.end.isel({axis}=-1)"
        )
    expected = {"component": tuple(scene.equations.components), "node": tuple(scene.topology.labels)}
    for name, labels in expected.items():
        present = tuple(end.coords[name].values.tolist()) if name in end.dims and name in end.coords else ()
        if set(present) != set(labels) or len(present) != len(labels):
            raise ValueError(
                f"start: found the {name}s {_listed(present)}; expected {_listed(labels)}, those of the scene"
            )


def _check_phases(scene: Scene, end: xr.DataArray) -> None:
    """Raise ValueError if a cell ended within a period of the drive: a run must begin with a period."""
    times = np.ravel(end.coords[END_TIME].values) if END_TIME in end.coords else np.zeros(1)
    phases = np.ravel(end.coords[DRIVE_PHASE].values) if DRIVE_PHASE in end.coords else np.full(times.shape, np.nan)
    amid = ~(np.abs(phases - np.rint(phases)) < WHOLE) & (times != 0.0)
    if scene.forced and amid.any():
        time, phase = float(times[amid][0]), float(phases[amid][0])
        where = "has no period" if math.isnan(phase) else f"is {phase:.6f} into a period"
        raise ValueError(
            f"start: the drive {where} at t = {time:.10g}; expected the beginning of one, where a run begins; "
            "let the first run last a whole number of drive periods"
        )


def _listed(labels: Sequence[object]) -> str:
    texts = [str(label) for label in labels[:8]]
    return ", ".join([*texts, *(["…"] if len(labels) > len(texts) else [])]) or "none"
