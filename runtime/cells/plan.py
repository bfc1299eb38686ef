"""Lay out the cells of a scene's sweep as rows of numbers for a kernel."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from synchain.codegen.driver.columns import SpanColumn
from synchain.models.scenes.scene import Scene

from .drive_times import longest_steps, periods
from .initial_modes import local_clock, with_modes

# Step tried first in every cell, in units of non-dimensional time: a choice; step control enlarges it sixfold at a
# time.
FIRST_STEP = 1e-4
# The kernel that is compiled first is chosen by the rates of this number of nodes, in all cells together: a choice.
LOOKED_AT = 200


@dataclass(frozen=True, slots=True)
class CellRows:
    """Rows of cells, as a kernel reads them."""

    start: np.ndarray  # (cells, dimension): initial states
    numbers: np.ndarray  # (cells, parameters): parameters, in the order of `Equations.parameters`
    # (cells, len(SpanColumn)): start and end of the window and period of the equations, in non-dimensional time;
    # synchronisation error below which a cell ends early (0: never); first step; longest step; number of steps before
    # the
    # first pause (inf: never); unit of the sample times
    spans: np.ndarray

    def __post_init__(self) -> None:
        for array in (self.start, self.numbers, self.spans):
            array.flags.writeable = False

    def __len__(self) -> int:
        return len(self.start)

    def take(self, cells: np.ndarray) -> CellRows:
        return CellRows(self.start[cells], self.numbers[cells], self.spans[cells])


def plan(scene: Scene, near: np.ndarray | None = None) -> CellRows:
    """Return the rows of all cells of a scene, in C order over the axes (the last one fastest)."""
    # Shapes: near (cells,).
    return Planner(scene).rows(np.arange(scene.cells), near)


class Planner:
    """Lay out any cells of a scene, so that only some rows are in memory at once."""

    # `starts` (cells, dimension): initial states that replace those of the scene; axes of initial states replace both.

    def __init__(self, scene: Scene, starts: np.ndarray | None = None) -> None:
        self.scene = scene
        self.starts = starts
        self.equations = scene.equations
        self.values = {axis.name: np.array(axis.values) for axis in scene.axes}
        self.drawn = {axis.name: np.array(axis.values) for axis in scene.drawn}
        self.slots = {name: k for k, name in enumerate(self.equations.parameters)}
        self.places = {name: k for k, name in enumerate(self.equations.state)}

    def __reduce__(self) -> tuple[type[Planner], tuple[Scene, np.ndarray | None]]:
        return Planner, (self.scene, self.starts)

    def columns(self, cells: np.ndarray) -> dict[str, np.ndarray]:
        """Return the value of each axis and of each draw in these cells, by name."""
        if not self.scene.shape:
            return {}
        indices = np.unravel_index(cells, self.scene.shape)
        along = indices[:1] * len(self.values) if self.scene.zipped else indices
        columns = {name: values[index] for (name, values), index in zip(self.values.items(), along, strict=False)}
        return columns | {name: values[indices[-1]] for name, values in self.drawn.items()}

    def rows(self, cells: np.ndarray, near: np.ndarray | None = None) -> CellRows:
        # `near` (cells,) is the column `SpanColumn.NEAR` of their spans (default: 0).
        columns = self.columns(cells)
        parameters = self._parameters(columns, len(cells))
        start = np.empty((len(cells), len(self.scene.y0)))
        start[:] = self.scene.y0 if self.starts is None else self.starts[cells]
        for name, values in columns.items():
            if name not in self.slots:
                start[:, self.places[name]] = values
        return self.started(start, parameters, self.spans_at(parameters, near))

    def started(self, start: np.ndarray, parameters: np.ndarray, spans: np.ndarray) -> CellRows:
        """Return the rows of these numbers, with the slip states that follow from them."""
        return CellRows(with_modes(self.equations, start, parameters), parameters, spans)

    def spans(self, cells: np.ndarray) -> np.ndarray:
        """Return the spans (cells, len(SpanColumn)) of these cells, without their states."""
        return self.spans_at(self._parameters(self.columns(cells), len(cells)))

    def _parameters(self, columns: Mapping[str, np.ndarray], cells: int) -> np.ndarray:
        """Return the parameters (cells, parameters) of cells with these values of the axes."""
        parameters = np.empty((cells, len(self.slots)))
        parameters[:] = [self.scene.parameters[name] for name in self.slots]
        for name, values in columns.items():
            if name in self.slots:
                parameters[:, self.slots[name]] = values
        return parameters

    def spans_at(self, parameters: np.ndarray, near: np.ndarray | None = None) -> np.ndarray:
        """Return the spans of cells with these parameters (cells, parameters)."""
        scene, period = self.scene, periods(self.equations, parameters)
        unit = period if scene.time_unit == "period" else np.ones(len(period))
        if np.any(unit == 0.0):
            raise ValueError(
                f"a window in drive periods: found a cell in which {scene.drive.frequency} is 0, or undefined; expected a "
                "drive with a period; set time_unit = 'time'"
            )
        window = np.stack([scene.transient * unit, (scene.transient + scene.window) * unit], axis=1)
        if not np.all(window < 1e12):
            raise ValueError(
                f"the run ends at t = {window.max():.3g}; expected less than 1e12, where time has lost 4 digits"
            )
        spans = np.empty((len(parameters), len(SpanColumn)))
        spans[:, : SpanColumn.PERIOD] = window
        spans[:, SpanColumn.PERIOD] = local_clock(self.equations, period)
        spans[:, SpanColumn.NEAR] = 0.0 if near is None else near
        spans[:, SpanColumn.FIRST_STEP], spans[:, SpanColumn.LOOK] = FIRST_STEP, math.inf
        spans[:, SpanColumn.UNIT] = unit
        spans[:, SpanColumn.LONGEST] = longest_steps(self.equations, parameters, spans[:, SpanColumn.END])
        return spans

    def extremes(self) -> CellRows:
        """Return the rows of a few cells that contain the smallest, largest and nearest-to-0 value of each axis."""
        return self.rows(self._extremes())

    def sample(self) -> CellRows:
        """Return the rows of the extreme cells, and of other cells that are evenly spread over the sweep."""
        # All rows together have about LOOKED_AT nodes; there are at least two other cells.
        spread = np.linspace(0, math.prod(self.scene.shape) - 1, max(2, LOOKED_AT // self.equations.n))
        return self.rows(np.union1d(self._extremes(), spread.round().astype(int)))

    def _extremes(self) -> np.ndarray:
        if not self.scene.shape:
            return np.arange(1)
        ends = [_ends(values) for values in self.values.values()]
        cells = [(index,) for index in np.unique(ends)] if self.scene.zipped else [*zip(*ends, strict=True)]
        cells = cells or [()]
        if self.scene.realisations:
            drawn = [_ends(values) for values in self.drawn.values()]  # none of graphs without links
            indices = np.unique(drawn) if drawn else np.zeros(1, int)
            cells = [(*cell, index) for cell in cells for index in indices]
        return np.unique([np.ravel_multi_index(cell, self.scene.shape) for cell in cells])


def _ends(values: np.ndarray) -> tuple[int, int, int]:
    """Return the indices at which values are smallest, largest and nearest to 0."""
    return int(values.argmin()), int(values.argmax()), int(np.abs(values).argmin())
