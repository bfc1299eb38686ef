"""From a scene to the arrays that a kernel works on: one row of numbers for each cell of the sweep."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import sympy as sp

from synchain.codegen.driver.columns import Control, SpanColumn
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.periodicity import Drive, as_function, drive_of, names_in
from synchain.models.inputs.names import NodeName
from synchain.models.mechanics.components import TIME
from synchain.models.scenes.scene import Scene

from .initial_modes import local_clock, with_modes
from .shortest_interval import shortest_stays

FIRST_STEP, SHORT = 1e-4, 0.1
"""Step tried first in every cell, and as a part of the time in which what grows fastest does so by a factor e; the step
control enlarges it sixfold at a time."""

LOOKED_AT = 200
"""Nodes of all cells at whose rates is looked."""

DIRECTIONS = {"falling": -1.0, "rising": 1.0, "both": 0.0}
"""The numbers that a kernel knows the directions of a section by."""


@dataclass(frozen=True, slots=True)
class CellRows:
    """Rows of cells as a kernel takes them."""

    start: np.ndarray  # (cells, dimension): initial states
    numbers: np.ndarray  # (cells, parameters): parameters, in the order of `Equations.parameters`
    # (cells, len(SpanColumn)): start and end of the window and the period of the equations, in non-dimensional time, the
    # synchronisation error below which a cell ends early (0: none does), the first step, the longest one, and the
    # steps after which the cell first pauses (inf: it never does)
    spans: np.ndarray

    def __post_init__(self) -> None:
        for array in (self.start, self.numbers, self.spans):
            array.flags.writeable = False

    def __len__(self) -> int:
        return len(self.start)

    def take(self, cells: np.ndarray) -> CellRows:
        """Return the rows of some of the cells."""
        return CellRows(self.start[cells], self.numbers[cells], self.spans[cells])


def plan(scene: Scene, near: np.ndarray | None = None) -> CellRows:
    """Return the rows of all cells of a scene, in C order over the axes (the last one fastest).

    Shapes: near (cells,).
    """
    return Planner(scene).rows(np.arange(scene.cells), near)


class Planner:
    """Lays out any cells of a scene, so that the rows of all cells need not be in memory at once.

    starts (cells, dimension): states of all cells to start from in place of the scene's, which axes of states overwrite.
    """

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
        """Return the value of each axis, and of what is drawn, in each of these cells."""
        if not self.scene.shape:
            return {}
        places = np.unravel_index(cells, self.scene.shape)
        along = places[:1] * len(self.values) if self.scene.zipped else places
        columns = {name: values[place] for (name, values), place in zip(self.values.items(), along, strict=False)}
        return columns | {name: values[places[-1]] for name, values in self.drawn.items()}

    def rows(self, cells: np.ndarray, near: np.ndarray | None = None) -> CellRows:
        """Return the rows of these cells; `near` (cells,) is the last column of their spans
        (default: 0).
        """
        columns = self.columns(cells)
        numbers = self._numbers(columns, len(cells))
        start = np.empty((len(cells), len(self.scene.y0)))
        start[:] = self.scene.y0 if self.starts is None else self.starts[cells]
        for name, values in columns.items():
            if name not in self.slots:
                start[:, self.places[name]] = values
        return CellRows(with_modes(self.equations, start, numbers), numbers, self._spans(numbers, near))

    def spans(self, cells: np.ndarray) -> np.ndarray:
        """Return the spans (cells, len(SpanColumn)) of these cells, without their states."""
        return self._spans(self._numbers(self.columns(cells), len(cells)), None)

    def _numbers(self, columns: Mapping[str, np.ndarray], cells: int) -> np.ndarray:
        """The parameters of cells in which the axes have these values."""
        numbers = np.empty((cells, len(self.slots)))
        numbers[:] = [self.scene.parameters[name] for name in self.slots]
        for name, values in columns.items():
            if name in self.slots:
                numbers[:, self.slots[name]] = values
        return numbers

    def _spans(self, numbers: np.ndarray, near: np.ndarray | None) -> np.ndarray:
        """The spans of cells with these parameters."""
        repeat = periods(self.equations, numbers)
        spans = np.empty((len(numbers), len(SpanColumn)))
        spans[:, : SpanColumn.PERIOD] = _windows(self.scene, repeat)
        spans[:, SpanColumn.PERIOD] = local_clock(self.equations, repeat)
        spans[:, SpanColumn.NEAR] = 0.0 if near is None else near
        spans[:, SpanColumn.FIRST_STEP], spans[:, SpanColumn.LOOK] = FIRST_STEP, math.inf
        spans[:, SpanColumn.LONGEST] = longest_steps(self.equations, numbers, spans[:, SpanColumn.END])
        return spans

    def extremes(self) -> CellRows:
        """Return the rows of a few cells in which every axis takes its smallest, its largest and
        its value nearest to 0.
        """
        return self.rows(self._extremes())

    def sample(self) -> CellRows:
        """Return the rows of the extreme cells and of others, evenly spread over the sweep: of LOOKED_AT nodes or two cells."""
        spread = _spread(math.prod(self.scene.shape), LOOKED_AT // self.equations.n)
        return self.rows(np.union1d(self._extremes(), spread))

    def _extremes(self) -> np.ndarray:
        ends = [_ends(values) for values in self.values.values()]
        cells = [(place,) for place in np.unique(ends)] if self.scene.zipped else [*zip(*ends, strict=True)]
        cells = cells or [()]
        if self.scene.realisations:
            drawn = [_ends(values) for values in self.drawn.values()]  # none of graphs without links
            places = np.unique(drawn) if drawn else np.zeros(1, int)
            cells = [(*cell, place) for cell in cells for place in places]
        if not self.scene.shape:
            return np.arange(1)
        return np.unique([np.ravel_multi_index(cell, self.scene.shape) for cell in cells])


def _ends(values: np.ndarray) -> tuple[int, int, int]:
    """Where values are smallest, largest and nearest to 0."""
    return int(values.argmin()), int(values.argmax()), int(np.abs(values).argmin())


def periods(equations: Equations, numbers: np.ndarray) -> np.ndarray:
    """Return the period of the equations for each row of parameters; 0 if time does not enter or no
    period is known.
    """
    if len(numbers) == 0:
        return np.zeros(0)
    drive = drive_of((*equations.nodes, *equations.edges), equations.differing)
    return _periods(drive, dict(zip(equations.parameters, numbers.T, strict=True)), len(numbers))


def _periods(drive: Drive, values: Mapping[str, np.ndarray], rows: int) -> np.ndarray:
    """The period (rows,) of a drive; 0 if there is none."""
    if drive.frequency is None:
        return np.zeros(rows)
    with np.errstate(divide="ignore"):
        found = 2.0 * math.pi / _sizes(drive.frequency, values, rows)
    return np.where(np.isfinite(found), found, 0.0)


def _sizes(frequency: sp.Expr, values: Mapping[str, np.ndarray], rows: int) -> np.ndarray:
    """The absolute values (rows,) of a frequency, by the same function as
    `Scene.angular_frequency`.
    """
    names = names_in(frequency)
    if not names:
        return np.full(rows, abs(as_function(frequency)()))
    found = np.frompyfunc(as_function(frequency), len(names), 1)(*(values[name] for name in names))
    return np.asarray(np.abs(np.asarray(found, dtype=float)))


def half_swing(equations: Equations, values: Mapping[str, np.ndarray], end: float = 1e3) -> float:
    """Return the shortest half swing of some rows of parameters, see `longest_steps`."""
    rows = max((len(column) for column in values.values()), default=1)
    return float(_half_swings(equations, values, np.full(rows, end)).min(initial=math.inf))


def longest_steps(equations: Equations, numbers: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return the longest step (cells,) of cells with these parameters (cells, parameters) that run up to the times `end`.

    That is half the period of the fastest sine or cosine of time, or the length in which another
    function of time can rise and fall again (`Drive.bends`) or stays between two of its jumps,
    kinks (`Drive.gaps`) and rises (`Drive.rises`), if shorter; inf without a drive.

    No step may be longer, so that none can miss a whole swing of the drive, or a pulse.  A drive
    without a period is looked at up to the time `end`.
    """
    if not equations.forced or not len(numbers):
        return np.full(len(numbers), math.inf)
    values = by_place(equations, numbers)
    places = len(next(iter(values.values()), end)) // len(end)
    return np.asarray(_half_swings(equations, values, np.tile(end, places)).reshape(places, -1).min(axis=0))


def _half_swings(equations: Equations, values: Mapping[str, np.ndarray], end: np.ndarray) -> np.ndarray:
    """The longest step (rows,) of nodes with these parameters."""
    rows = len(end)
    drive = drive_of((*equations.nodes, *equations.edges), equations.differing)
    fastest = np.fmax.reduce([np.zeros(rows), *(_sizes(pace, values, rows) for pace in drive.paces)])
    with np.errstate(divide="ignore"):
        longest = np.where(fastest > 0.0, math.pi / fastest, math.inf)
    gaps, rises = (tuple(e for e in own if {*names_in(e)} <= {*values, TIME.name}) for own in (drive.gaps, drive.rises))
    if not (gaps or rises):
        return longest
    return np.minimum(longest, shortest_stays(gaps, rises, values, _periods(drive, values, rows), end))


def by_place(equations: Equations, numbers: np.ndarray) -> dict[str, np.ndarray]:
    """Return the drive's parameters of cells (cells, parameters) by their names in templates: a row for each cell and place.

    Places are the nodes and, beside them, the links; what a place does not have is nan.
    """
    drive = drive_of((*equations.nodes, *equations.edges), equations.differing)
    names = {name for e in (*drive.paces, *drive.gaps, *drive.rises) for name in names_in(e)}
    columns = dict(zip(equations.parameters, numbers.T, strict=True))
    nodes = {name: [f"{name}_{i + 1}" for i in range(equations.n)] for name in equations.varied}
    links = {name: list(layer.names(name)) for name, layer in equations.numbered.items()}
    differing = {name: single for name, single in (nodes | links).items() if name in names}
    places, absent = max(map(len, differing.values()), default=1), np.full(len(numbers), np.nan)
    values = {name: np.tile(columns[name], places) for name in names & {*columns}}
    for name, single in differing.items():
        padded = single + [""] * (places - len(single))
        values[name] = np.concatenate([columns.get(parameter, absent) for parameter in padded])
    return values


def _spread(count: int, most: int) -> np.ndarray:
    """At most so many places of a row, the first and the last among them."""
    return np.linspace(0, count - 1, max(2, most)).round().astype(int)


def parameter_names(scene: Scene, name: str) -> tuple[str, ...]:
    """Return the names under which a scene has a parameter: one, a_1 … a_n if nodes differ, k_1_2 …
    if links do, none if it has no such.
    """
    if name not in scene.varied:
        return (name,) if name in scene.parameters else ()
    links = scene.model.link_names(name)
    if links:
        return tuple(dict.fromkeys(map(str, links.values())))
    return tuple(own for own in scene.parameters if (parts := NodeName.parse(own)) and parts.base == name)


def _windows(scene: Scene, period: np.ndarray) -> np.ndarray:
    """Start and end (cells, 2) of the windows of cells whose drives have these periods."""
    unit = period if scene.time_unit == "period" else np.ones(len(period))
    if np.any(unit == 0.0):
        raise ValueError(
            f"a window in drive periods: found a cell in which {scene.drive.frequency} is 0, or undefined; expected a "
            "drive with a period; set time_unit = 'time'"
        )
    spans = np.stack([scene.transient * unit, (scene.transient + scene.window) * unit], axis=1)
    if not np.all(spans < 1e12):
        raise ValueError(
            f"the run ends at t = {spans.max():.3g}; expected less than 1e12, where time has lost 4 digits"
        )
    return spans


def control_array(
    rtol: float, atol: float, max_step: float, max_steps: float, direction: float = 0.0, jumps: bool = True
) -> np.ndarray:
    """Return the array (Control.FURTHER,) that steers a kernel."""
    control = np.zeros(Control.FURTHER)
    control[Control.RTOL], control[Control.ATOL] = rtol, atol
    control[Control.FIRST_STEP], control[Control.MAX_STEP] = FIRST_STEP, max_step
    control[Control.MAX_STEPS], control[Control.DIRECTION] = max_steps, direction
    control[Control.NO_JUMPS] = float(not jumps)
    return control


def control_of(planner: Planner, jumps: bool) -> np.ndarray:
    """Return the control array of a scene's sweep; `jumps` as for `control_array`, tolerances those of the strictest cell."""
    scene = planner.scene
    rtol, atol = (float(own.min()) for own in tolerances(scene, scene.equations, planner.extremes().numbers))
    directions = [DIRECTIONS[section.direction] for section in scene.sections.values() or (scene.section,)]
    control = control_array(rtol, atol, math.inf, scene.max_steps, directions[0], jumps)
    return np.concatenate([control, directions[1:]])


def first_step(growth: float) -> float:
    """Return the length of the first step of a Rosenbrock method, by how fast motions grow where it begins.

    Such a method damps fast growth as it does fast decay, and its estimate of the error with it, if a step is much longer:
    it would stay at an equilibrium that repels. Steps that grow with the solution see it.
    """
    return min(FIRST_STEP, SHORT / max(growth, SHORT))


def tolerances(scene: Scene, equations: Equations, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (rtol, atol), each (cells,), as integrated with; `numbers` (cells, parameters) are those of the equations.

    A smoothed jump of friction is 1/kappa wide in velocity; a step control that does not see this
    width lets oscillators slip through it unnoticed.  With contact "atan" rtol is therefore at most
    1/kappa and atol at most 0.1/kappa (not below 1e-13), for the largest kappa of the nodes.
    """
    rtol, atol = np.full(len(numbers), scene.rtol), np.full(len(numbers), scene.atol)
    names = parameter_names(scene, "kappa")
    columns = [k for k, name in enumerate(equations.parameters) if name in names]
    if scene.contact == "atan" and columns and len(numbers):
        width = 1.0 / np.maximum(numbers[:, columns].max(axis=1), 1e-300)
        rtol, atol = np.minimum(rtol, np.maximum(width, 1e-13)), np.minimum(atol, np.maximum(0.1 * width, 1e-13))
    return rtol, atol


def scale_of_atol(size: np.ndarray) -> np.ndarray:
    """Return by what a default atol, a tenth of rtol, is multiplied for motions of some sizes: a power of ten, at most 1.

    Below size 1 atol is between a tenth of rtol times the size and all of it, in decades that end at 0.1, 0.01 and so on.
    The bound 0.1 is the last of these ends, not a size that is small by itself.  Motions above it keep the atol of size 1:
    for a motion of size 1e9 it is next to nothing beside rtol times the size, so that steps are as exact as rtol says
    and only a little shorter.  A size of 0 is unknown.
    """
    return np.asarray(10.0 ** np.floor(np.log10(np.where((size > 0.0) & (size < 0.1), 10.0 * size, 1.0))))
