"""Integrate the cells of scenes with compiled kernels of several integrators; a cell may change its integrator."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass, field, replace

import numpy as np

from synchain.codegen.driver import clock_slots as slot
from synchain.codegen.driver.cells import REPEATING
from synchain.codegen.driver.columns import Control, Count, SumColumn
from synchain.codegen.integrators import Integrator
from synchain.codegen.machine_code.compile import Kernel, load
from synchain.codegen.steps.row_step import row_count
from synchain.models.dynamics.equations import Equations
from synchain.models.scenes.scene import Scene

from ..cells.buffers import Buffers
from ..cells.plan import FIRST_STEP, CellRows
from ..cells.reduce import ReducedScene
from ..support.status import Status
from .choice import Ladder
from .scene_kernels import ladder_of, write_kernel
from .step_control import control_of

LARGEST_ROOM = 2**25  # largest initial buffer for the section points of a block, in numbers (268 MB): a choice


@dataclass(slots=True)
class LadderEngine:
    """Integrate rows of a scene; an `Engine`."""

    # `kernel` belongs to the integrator with which most cells begin. The kernel of another integrator is loaded when
    # the first cell needs it. `room` is the number of section points of a cell that the buffers hold at first; by
    # default two per period, as far as memory allows.

    reduction: ReducedScene
    kernel: Kernel
    room: int | None = None
    control: np.ndarray = field(init=False)
    ladder: Ladder = field(init=False)
    kernels: dict[str, Kernel] = field(init=False)
    controls: dict[tuple[float, float], np.ndarray] = field(init=False, default_factory=dict)
    lock: threading.Lock = field(init=False, default_factory=threading.Lock)

    def __post_init__(self) -> None:
        self.control = control_of(self.reduction.planner, self.reduction.jumps)
        self.ladder = ladder_of(self.reduction)
        self.kernels = {self.kernel.origin.integrator: self.kernel}

    def cancel(self) -> None:
        with self.lock:
            for control in (self.control, *self.controls.values()):
                control[Control.CANCEL] = 1.0

    def run(self, rows: CellRows) -> Buffers:
        """Integrate rows; if cells have too many section points for the buffers, run them again with larger buffers."""
        reduction, room = self.reduction, self.room
        if room is None:
            room = first_room(reduction.scene, len(rows) * (reduction.point_size + 1))
        buffers = self._climb(rows, room)
        if not (room or buffers.most_points):
            return buffers
        short = np.flatnonzero(buffers.point_counts > room)
        if len(short):
            buffers.put(short, self._climb(rows.take(short), buffers.most_points))
        buffers.points = np.ascontiguousarray(buffers.points[:, : buffers.most_points])
        return buffers

    def _climb(self, rows: CellRows, room: int) -> Buffers:
        """Integrate each row by its integrators, with buffers for `room` section points per row."""
        reduction, ladder = self.reduction, self.ladder
        buffers = reduction.empty(len(rows), room, reduction.observed.tallies)
        buffers.tolerances[:, 0], buffers.tolerances[:, 1] = ladder.tolerances(rows)
        method = ladder.first(rows)
        spans = ladder.steps(rows, method)
        rows = rows if spans is rows.spans else replace(rows, spans=spans)
        cells = np.arange(len(rows))
        if len(ladder.methods) == 1:  # no cell changes its integrator
            self._run_method(0, cells, rows, buffers)
            buffers.counts[:, Count.BY_METHOD + ladder.columns[0]] = buffers.steps
            buffers.sums = reduction.observed.summary(buffers.sums)
            return buffers
        buffers.lanes = np.zeros((len(rows), lane_size(reduction.equations)))
        # Steps, time and mean length of the steps at the last pause of each cell.
        paused_steps, paused_time, paused_length = np.zeros((3, len(rows)))
        while len(cells):
            # Run all cells that go on, those of one integrator together, and count their steps by integrator.
            earlier = buffers.steps[cells]
            for k in range(len(ladder.methods)):
                chosen = cells[method[cells] == k]
                if len(chosen):
                    self._run_method(k, chosen, rows, buffers)
            taken = buffers.steps[cells] - earlier
            buffers.counts[cells, Count.BY_METHOD + ladder.columns[method[cells]]] += taken
            # Cells that paused or got stuck may go on.
            status = buffers.status[cells]
            cells = cells[(status == Status.PAUSED) | (status == Status.STEP_UNDERFLOW)]
            if self.control[Control.CANCEL] != 0.0:
                buffers.counts[cells, Count.STATUS] = Status.INTERRUPTED
                break
            if not len(cells):
                break
            time, steps = buffers.sums[cells, SumColumn.STOPPED_AT], buffers.steps[cells]
            lengths = (time - paused_time[cells]) / np.maximum(steps - paused_steps[cells], 1.0)
            paused_time[cells], paused_steps[cells] = time, steps
            # Choose the next integrator of each cell; -1, or a slide that takes too many steps, ends the cell.
            cell_rows, state = rows.take(cells), buffers.take(cells)
            following = ladder.further(cell_rows, state, method[cells], lengths)
            sliding = (following == method[cells]) & ladder.sliding(cell_rows, state, lengths, paused_length[cells])
            buffers.counts[cells[sliding], Count.STATUS] = Status.STEP_BUDGET
            following[sliding], paused_length[cells] = -1, lengths
            # Continue from the saved lanes; where the integrator changes, set new step sizes.
            cells, lengths, following = (column[following >= 0] for column in (cells, lengths, following))
            buffers.counts[cells, Count.STATUS] = Status.PAUSED
            changed = following != method[cells]
            hand_over(buffers.lanes, cells[changed], lengths[changed], ladder, following[changed])
            method[cells] = following
        buffers.sums = reduction.observed.summary(buffers.sums)
        buffers.lanes = np.empty((0, 0))
        return buffers

    def _run_method(self, method: int, cells: np.ndarray, rows: CellRows, buffers: Buffers) -> None:
        """Run some cells by one method, those of the same tolerances together."""
        kernel = self._kernel(self.ladder.methods[method])
        tolerances = buffers.tolerances[cells]
        if len(cells) == len(rows) and (len(cells) == 1 or (tolerances == tolerances[0]).all()):
            run_rows(kernel, rows, self._control(*tolerances[0].tolist()), buffers)
            return
        pairs, pair_of = np.unique(tolerances, axis=0, return_inverse=True)
        for k, (rtol, atol) in enumerate(pairs.tolist()):
            group, control = cells[pair_of.reshape(-1) == k], self._control(rtol, atol)
            part = buffers.take(group)
            run_rows(kernel, rows.take(group), control, part)
            buffers.put(group, part)

    def _control(self, rtol: float, atol: float) -> np.ndarray:
        """Return the control array for these tolerances; `cancel` sets its flag."""
        with self.lock:
            if (rtol, atol) not in self.controls:
                control = self.controls[rtol, atol] = self.control.copy()
                control[Control.RTOL], control[Control.ATOL] = rtol, atol
            return self.controls[rtol, atol]

    def _kernel(self, method: Integrator) -> Kernel:
        """Return the kernel of a method; the number of lanes does not change results, and is 1 for a single cell."""
        with self.lock:
            if method.name not in self.kernels:
                width = 1 if self.kernel.origin.width == 1 else None
                self.kernels[method.name] = load(write_kernel(self.reduction, width, method))
            return self.kernels[method.name]


def run_rows(kernel: Kernel, rows: CellRows, control: np.ndarray, buffers: Buffers) -> None:
    kernel.drive(0, len(rows), rows.start, rows.numbers, rows.spans, control, *buffers.arrays())


def lane_size(equations: Equations) -> int:
    """Return the size of a cell's lane: clock, state, parameters, the state saved for the search for repetition, impacts."""
    return slot.CLOCK + 2 * equations.dimension + len(equations.parameters) + len(REPEATING) + 2 * row_count(equations)


def hand_over(lanes: np.ndarray, cells: np.ndarray, length: np.ndarray, ladder: Ladder, method: np.ndarray) -> None:
    """Prepare lanes to continue with another method from their present state."""
    # The new method begins with the mean length of the last steps. It stops at the end of every period, unless it is a
    # series. The search for repetition starts again.
    lane = lanes[cells]
    time, until = lane[:, slot.TIME], lane[:, slot.UNTIL]
    # Step control: first step, memory of the controller, error of the last change.
    first = np.where(length > 0.0, length, FIRST_STEP * np.minimum(1.0, until))
    lane[:, slot.STEP], lane[:, slot.MEMORY], lane[:, slot.CHANGE] = first, 0.0, np.inf
    # Restart the search for repetition.
    lane[:, slot.CYCLE], lane[:, slot.POWER], lane[:, slot.DUE], lane[:, slot.BOUND] = (
        0.0,
        1.0,
        0.0,
        lane[:, slot.PERIOD],
    )
    lane[:, slot.SAVED_AT] = -np.inf
    # The next stop and the next look at the method.
    lane[:, slot.LEFT] = np.where(lane[:, slot.LEFT] > 0.0, -1.0, lane[:, slot.LEFT])
    window = np.where(time < lane[:, slot.START], lane[:, slot.START], lane[:, slot.END])
    lane[:, slot.STOP] = np.minimum(window, lane[:, slot.BOUND])
    tried = lane[:, slot.ACCEPTED] + lane[:, slot.REJECTED]
    lane[:, slot.LOOK] = np.where(method < len(ladder.methods) - 1, slot.LOOKS * tried, np.inf)
    lanes[cells] = lane


def first_room(scene: Scene, row: int) -> int:
    """Return the initial number of section points per cell: two per period, if memory allows."""
    # `row`: numbers in a block for one more section point of every cell.
    if not {"section", "events"} & {*scene.record} and not scene.sections:
        return 0
    periods = scene.window if scene.time_unit == "period" else scene.window / math.pi
    return int(min(2.0 * max(len(scene.sections), 1) * periods, 1e6, LARGEST_ROOM // row)) + 8
