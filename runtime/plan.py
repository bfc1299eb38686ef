"""From a scene to the arrays that a kernel works on: one row of numbers for each cell of the sweep."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import sympy as sp

from synchain.models.equations import Equations
from synchain.models.periodicity import angular_frequency
from synchain.models.scene import Scene

from .contact_modes import local_clock, with_modes

__all__ = ["CANCEL", "Plan", "Planner", "control_array", "parameter_names", "plan", "tolerances"]

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
        clock = local_clock(equations, periods(equations, numbers))
        spans = np.column_stack([_spans(scene, columns, len(cells)), clock, last])
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
    value = _frequency(equations)
    if value is None:
        return np.zeros(len(numbers))
    size = np.abs(np.broadcast_to(np.asarray(value(*numbers.T), dtype=float), len(numbers)))
    with np.errstate(divide="ignore"):
        found = 2.0 * math.pi / size
    return np.where(np.isfinite(found), found, 0.0)


@lru_cache(maxsize=16)
def _frequency(equations: Equations) -> Callable[..., np.ndarray] | None:
    """The angular frequency of the equations as a function of their parameters; None where no period is known."""
    frequency = angular_frequency(equations)
    if frequency is None:
        return None
    made: Callable[..., np.ndarray] = sp.lambdify(
        [sp.Symbol(name, real=True) for name in equations.parameters], frequency, "numpy"
    )
    return made


def axis_columns(scene: Scene) -> dict[str, np.ndarray]:
    """The value of each axis in each cell."""
    return Planner(scene).columns(np.arange(scene.cells))


def parameter_names(scene: Scene, name: str) -> tuple[str, ...]:
    """The names under which a scene has a parameter: one, a_1 … a_n where nodes differ, none where it has no such."""
    if name not in scene.varied:
        return (name,) if name in scene.parameters else ()
    return tuple(found for found in scene.parameters if found.rpartition("_")[0] == name)


def _spans(scene: Scene, columns: dict[str, np.ndarray], cells: int) -> np.ndarray:
    unit = np.ones(cells)
    if scene.time_unit == "period":
        omega = columns.get("omega", np.full(cells, scene.omega or 0.0))
        if np.any(omega == 0.0):
            raise ValueError("a window in drive periods needs omega > 0, found 0; set time_unit = 'time'")
        unit = 2.0 * math.pi / np.abs(omega)
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
