"""From a scene to the arrays that a kernel works on: one row of numbers for each cell of the sweep."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.periodicity import as_function, drive_of, names_in
from synchain.models.mechanics.node_name import NodeName
from synchain.models.scenes.scene import Scene

from .initial_modes import local_clock, with_modes

__all__ = [
    "CANCEL",
    "Plan",
    "Planner",
    "control_array",
    "half_swing",
    "longest_step",
    "parameter_names",
    "plan",
    "tolerances",
]

FIRST_STEP = 1e-4
"""Step tried first in every cell; the step control enlarges it sixfold at a time."""

CANCEL = 6
"""Entry of the control array that stops a running kernel when it is not zero."""


@dataclass(frozen=True, slots=True)
class Plan:
    """Rows of all cells, in C order over the axes (the last one fastest).

    start (cells, dimension), numbers (cells, parameters) in the order of Equations.parameters, spans (cells, 4): start and
    end of the window, the period after which the equations repeat themselves (0: none), in non-dimensional time, and the
    synchronisation error below which a cell is known to stay synchronous (0: not known).
    """

    start: np.ndarray
    numbers: np.ndarray
    spans: np.ndarray

    def __post_init__(self) -> None:
        for array in (self.start, self.numbers, self.spans):
            array.flags.writeable = False


def plan(scene: Scene, near: np.ndarray | None = None) -> Plan:
    """Lay out all cells of a scene; `near` (cells,) is the last column of the spans (default: 0).

    Raises ValueError where a window in drive periods meets a drive of frequency 0, or is too long for double precision.
    """
    return Planner(scene).rows(np.arange(scene.cells), near)


class Planner:
    """Lays out any of a scene's cells, so that nobody need hold all of them; the axes are arrays once and for all."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.values = {axis.name: np.array(axis.values) for axis in scene.axes}

    def columns(self, cells: np.ndarray) -> dict[str, np.ndarray]:
        """The value of each axis in each of these cells."""
        if self.scene.zipped or not self.values:
            return {name: values[cells] for name, values in self.values.items()}
        places = np.unravel_index(cells, self.scene.shape)
        return {name: values[place] for (name, values), place in zip(self.values.items(), places, strict=True)}

    def rows(self, cells: np.ndarray, near: np.ndarray | None = None) -> Plan:
        """The rows of these cells; `near`, one for each of them, is the last column of the spans (default: 0)."""
        scene, equations = self.scene, self.scene.equations
        names = equations.parameters
        numbers = np.empty((len(cells), len(names)))
        numbers[:] = [scene.parameters[name] for name in names]
        start = np.empty((len(cells), len(scene.y0)))
        start[:] = scene.y0
        columns = self.columns(cells)
        state = equations.state
        for name, values in columns.items():
            if name in names:
                numbers[:, names.index(name)] = values
            else:
                start[:, state.index(name)] = values
        start = with_modes(equations, start, numbers)
        last = np.zeros(len(cells)) if near is None else near
        repeat = periods(equations, numbers)
        spans = np.column_stack([_spans(scene, repeat), local_clock(equations, repeat), last])
        return Plan(start, numbers, np.ascontiguousarray(spans))

    def extremes(self) -> Plan:
        """The rows of a few cells in which every axis takes its smallest, its largest and its value nearest to 0."""
        ends = [(v.argmin(), v.argmax(), np.abs(v).argmin()) for v in self.values.values()]
        if not ends:
            return self.rows(np.arange(1))
        if self.scene.zipped:
            return self.rows(np.unique(ends))
        return self.rows(
            np.unique([np.ravel_multi_index(places, self.scene.shape) for places in zip(*ends, strict=True)])
        )


def periods(equations: Equations, numbers: np.ndarray) -> np.ndarray:
    """The period of the equations for each row of parameters; 0 where time does not enter or no period is known."""
    if len(numbers) == 0:
        return np.zeros(0)
    frequency = drive_of(equations.nodes, equations.varied).frequency
    if frequency is None:
        return np.zeros(len(numbers))
    with np.errstate(divide="ignore"):
        found = 2.0 * math.pi / _sizes(frequency, dict(zip(equations.parameters, numbers.T, strict=True)), len(numbers))
    return np.where(np.isfinite(found), found, 0.0)


def _sizes(frequency: sp.Expr, values: Mapping[str, np.ndarray], rows: int) -> np.ndarray:
    """The absolute values (rows,) of a frequency, by the same function as `Scene.angular_frequency`."""
    names = names_in(frequency)
    if not names:
        return np.full(rows, abs(as_function(frequency)()))
    found = np.frompyfunc(as_function(frequency), len(names), 1)(*(values[name] for name in names))
    return np.abs(np.asarray(found, dtype=float))


def half_swing(equations: Equations, values: Mapping[str, np.ndarray]) -> float:
    """Half the period of the fastest sine or cosine of time at arrays of parameters of one length; inf without a drive.

    No step may be longer, so that none can miss a whole swing of the drive.
    """
    rows = max((len(column) for column in values.values()), default=1)
    waves = drive_of(equations.nodes, equations.varied).waves
    fastest = max((float(np.max(_sizes(wave, values, rows), initial=0.0)) for wave in waves), default=0.0)
    return math.pi / fastest if fastest > 0.0 else math.inf


def longest_step(scene: Scene) -> float:
    """The half swing at the ends of all that a scene's nodes and axes give to the parameters of its drive."""
    known = dict.fromkeys(name for wave in scene.drive.waves for name in names_in(wave))
    ends = []
    for names in (parameter_names(scene, name) for name in known):
        values = [scene.parameters[name] for name in names]
        values += [end(axis.values) for axis in scene.axes if axis.name in names for end in (min, max)]
        ends.append((min(values), max(values)))
    corners = np.array(list(itertools.product(*ends)), dtype=float)
    return half_swing(scene.equations, dict(zip(known, corners.T, strict=True)))


def axis_columns(scene: Scene) -> dict[str, np.ndarray]:
    """The value of each axis in each cell."""
    return Planner(scene).columns(np.arange(scene.cells))


def parameter_names(scene: Scene, name: str) -> tuple[str, ...]:
    """The names under which a scene has a parameter: one, a_1 … a_n where nodes differ, none where it has no such."""
    if name not in scene.varied:
        return (name,) if name in scene.parameters else ()
    return tuple(own for own in scene.parameters if (parts := NodeName.parse(own)) and parts.base == name)


def _spans(scene: Scene, period: np.ndarray) -> np.ndarray:
    unit = period if scene.time_unit == "period" else np.ones(len(period))
    if np.any(unit == 0.0):
        name = scene.drive.frequency
        raise ValueError(f"a window in drive periods needs {name} other than 0, found 0; set time_unit = 'time'")
    spans = np.stack([scene.transient * unit, (scene.transient + scene.window) * unit], axis=1)
    if not np.all(spans < 1e12):
        raise ValueError(
            f"the run ends at t = {spans.max():.3g}; expected less than 1e12, where time has lost 4 digits"
        )
    return np.ascontiguousarray(spans)


def control_array(
    rtol: float, atol: float, max_step: float, max_steps: float, direction: float = 0.0, jumps: bool = True
) -> np.ndarray:
    """The numbers that steer a kernel, in the order of its column names (codegen/skeletons/recording.py).

    Without `jumps` a cell that repeats itself is integrated to its end all the same.
    """
    return np.array([rtol, atol, FIRST_STEP, max_step, max_steps, direction, 0.0, float(not jumps)])


def tolerances(scene: Scene, numbers: np.ndarray) -> tuple[float, float]:
    """Return (rtol, atol) as integrated with.

    A smoothed jump of friction is 1/kappa wide in velocity; a step control that does not see this width lets oscillators
    slip through it unnoticed.  With contact "atan" rtol is therefore at most 1/kappa and atol at most 0.1/kappa (not below
    1e-13), for the largest kappa of the sweep.
    """
    rtol, atol = scene.rtol, scene.atol
    columns = [k for k, name in enumerate(scene.equations.parameters) if name in parameter_names(scene, "kappa")]
    if scene.contact == "atan" and columns:
        fixed = (scene.parameters[name] for name in parameter_names(scene, "kappa"))
        steepest = numbers[:, columns].max() if numbers.size else max(fixed)
        width = 1.0 / max(float(steepest), 1e-300)
        rtol, atol = min(rtol, max(width, 1e-13)), min(atol, max(0.1 * width, 1e-13))
    return rtol, atol
