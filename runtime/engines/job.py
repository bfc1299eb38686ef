"""Jobs: a compiled kernel with all that it needs to run cells, and the specification that rebuilds
it elsewhere.

A job runs in threads of this process.  A worker that does not share its memory, another process or
another machine, gets the specification once, packed, and compiles the kernel from its own
installation (`worker.py`).
"""

from __future__ import annotations

import importlib.metadata
import io
import math
import pickle
import threading
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any, Protocol

import numpy as np

from synchain.codegen.driver.cells import REPEATING
from synchain.codegen.driver.clock_slots import (
    ACCEPTED,
    BOUND,
    CHANGE,
    CLOCK,
    CYCLE,
    DUE,
    END,
    LEFT,
    LOOK,
    LOOKS,
    MEMORY,
    PERIOD,
    POWER,
    REJECTED,
    SAVED_AT,
    START,
    STEP,
    STOP,
    TIME,
    UNTIL,
)
from synchain.codegen.driver.columns import Control, Count, SpanColumn, SumColumn
from synchain.codegen.integrators import Integrator
from synchain.codegen.kernels.observable_text import SYNC_ERROR, Recording
from synchain.codegen.kernels.sweep_kernel import SweepKernel, emit
from synchain.codegen.machine_code.compile import Kernel, load
from synchain.codegen.machine_code.installation import InstallationError
from synchain.codegen.machine_code.processor import processor, told_apart
from synchain.models.dynamics.equations import Equations
from synchain.models.inputs.plugins import allow_code, allowed_code
from synchain.models.scenes.scene import Scene

from ..cells.buffers import Buffers
from ..cells.paces import Templates
from ..cells.plan import FIRST_STEP, CellRows, control_of
from ..cells.reduce import ReducedScene
from ..support.status import Status
from .choice import Ladder, first_steps
from .scene_kernels import ladder_of, write_kernel

LARGEST_ROOM = 2**25
"""Numbers that the room for section points of a block has at first, 268 MB."""

Start = tuple[np.ndarray, np.ndarray]
"""States (cells, dimension) to start from in place of the scene's, and for which cells (cells,)
they are good.
"""


class Job(Protocol):
    """A compiled kernel, ready to run blocks of cells."""

    spec: JobSpec

    def run(self, *block: Any) -> Buffers:
        """Run a block; its arguments are those of a `Task`."""

    def cancel(self) -> None:
        """End all cells that run in this process."""


class Problem(Protocol):
    """What a job integrates."""

    def source(self, width: int) -> SweepKernel:
        """Return the text of its kernel."""

    def job(self, spec: JobSpec, kernel: Kernel) -> Job:
        """Return the job that runs its kernel."""


@dataclass(frozen=True, slots=True)
class JobSpec:
    """What all blocks of a job have in common: enough to rebuild it in another process."""

    problem: Problem
    width: int  # lanes of the kernel and SHA-256 of its text
    digest: str
    versions: str  # versions and kind of processor of the main program; a worker must have the same
    processor: str
    code: tuple[str, ...]  # files of code that are allowed to run

    @classmethod
    def of(cls, problem: Problem, source: SweepKernel) -> JobSpec:
        """Return the specification of a job of this process."""
        return cls(problem, source.width, source.digest, versions(), processor(), allowed_code())

    def packed(self) -> bytes:
        """Return the specification as bytes, for a worker elsewhere."""
        target = io.BytesIO()
        head = {name: getattr(self, name) for name in ("versions", "processor", "code", "width", "digest")}
        pickle.dump(head, target)
        pickle.dump(self.problem, target)
        return target.getvalue()

    @classmethod
    def unpacked(cls, data: bytes) -> JobSpec:
        """Return the specification from bytes."""
        source = io.BytesIO(data)
        head = pickle.load(source)
        if head["versions"] != versions():
            raise InstallationError(
                f"this worker has {versions()}; expected the versions of the main program, {head['versions']}: "
                "a sweep needs the same installation everywhere"
            )
        if head["processor"] != processor():
            kept, here = told_apart(head["processor"], processor())
            raise InstallationError(
                f"this worker has the processor {here}; expected that of the main program, {kept}, because another kind may "
                "round otherwise; run on one kind, or set NUMBA_CPU_NAME and NUMBA_CPU_FEATURES to one that all can run"
            )
        allow_code(*head["code"])
        return cls(pickle.load(source), **head)

    def rebuilt(self) -> Job:
        """Return the job, with a kernel from this installation."""
        source = self.problem.source(self.width)
        if source.digest != self.digest:
            raise InstallationError(
                f"this worker makes the kernel {source.digest[:12]}; expected that of the main program, "
                f"{self.digest[:12]}: a sweep needs the same installation everywhere"
            )
        return self.problem.job(self, load(source))


@dataclass(frozen=True, slots=True, eq=False)
class SweepSpec:
    """The sweep of a scene, or what is left of it to integrate; `room` are section points to make
    room for at first.
    """

    reduction: ReducedScene
    room: int | None = None

    def source(self, width: int) -> SweepKernel:
        """Return the text of the kernel."""
        return write_kernel(self.reduction, width)

    def job(self, spec: JobSpec, kernel: Kernel) -> SweepJob:
        """Return the job that runs the kernel."""
        return SweepJob(spec, kernel, self.reduction, self.room)


@dataclass(slots=True)
class SweepJob:
    """The kernels of a scene, ready to run any cells of its sweep.

    `room` are section points of a cell to make room for at first; by default two a period, as far
    as memory allows.  Cells with more are run again with what they need.  `kernel` is that of the integrator with which
    most cells begin; those of others are made when the first cell needs them.
    """

    spec: JobSpec
    kernel: Kernel
    reduction: ReducedScene
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
        """End all cells that run in this process."""
        with self.lock:
            for control in (self.control, *self.controls.values()):
                control[Control.CANCEL] = 1.0

    def run(self, cells: np.ndarray, start: Start | None = None, near: np.ndarray | None = None) -> Buffers:
        """Run cells of the sweep. Shapes: near (cells,)."""
        reduction = self.reduction
        rows = reduction.rows(reduction.planner.rows(cells, near))
        if start is not None:
            rows = replace(rows, start=np.where(start[1][:, None], start[0], rows.start))
        room = first_room(reduction.scene, len(cells) * (reduction.point_size + 1)) if self.room is None else self.room
        buffers = self._climb(rows, room)
        short = np.flatnonzero(buffers.point_counts > room)
        if len(short):
            buffers.put(short, self._climb(rows.take(short), buffers.most_points))
        buffers.points = np.ascontiguousarray(buffers.points[:, : buffers.most_points])
        return buffers

    def _climb(self, rows: CellRows, room: int) -> Buffers:
        """Run rows with room for so many section points of each, each with the integrators that suit it."""
        reduction, ladder = self.reduction, self.ladder
        buffers = reduction.empty(len(rows), room, reduction.observed.tallies)
        buffers.tolerances[:] = np.stack(ladder.tolerances(rows), axis=1)
        method = ladder.first(rows)
        rows = replace(rows, spans=ladder.steps(rows, method))
        if len(ladder.methods) > 1:
            buffers.lanes = np.zeros((len(rows), lane_size(reduction.equations)))
        went = np.zeros(len(rows))  # steps and time at the last pause
        begun = np.zeros(len(rows))
        before = np.zeros(len(rows))
        cells = np.arange(len(rows))
        while len(cells):
            earlier = buffers.steps[cells]
            for k in np.unique(method[cells]):
                self._drive(int(k), cells[method[cells] == k], rows, buffers)
            taken = buffers.steps[cells] - earlier
            buffers.counts[cells, Count.BY_METHOD + ladder.columns[method[cells]]] += taken
            cells = cells[np.isin(buffers.status[cells], (Status.PAUSED, Status.STEP_UNDERFLOW))]
            if self.control[Control.CANCEL] != 0.0:
                buffers.counts[cells, Count.STATUS] = Status.INTERRUPTED
                break
            if len(ladder.methods) == 1 or not len(cells):
                break
            time, steps = buffers.sums[cells, SumColumn.STOPPED_AT], buffers.steps[cells]
            lengths = (time - begun[cells]) / np.maximum(steps - went[cells], 1.0)
            begun[cells], went[cells] = time, steps
            looked, found = rows.take(cells), buffers.take(cells)
            following = ladder.further(looked, found, method[cells], lengths)
            sliding = (following == method[cells]) & ladder.sliding(looked, found, lengths, before[cells])
            buffers.counts[cells[sliding], Count.STATUS] = Status.STEP_BUDGET
            following[sliding], before[cells] = -1, lengths
            cells, lengths, following = (own[following >= 0] for own in (cells, lengths, following))
            buffers.counts[cells, Count.STATUS] = Status.PAUSED
            handed = following != method[cells]
            hand_over(buffers.lanes, cells[handed], lengths[handed], ladder, following[handed])
            method[cells] = following
        buffers.sums = reduction.observed.summary(buffers.sums)
        buffers.lanes = np.empty((0, 0))
        return buffers

    def _drive(self, method: int, cells: np.ndarray, rows: CellRows, buffers: Buffers) -> None:
        """Run some cells by one method, those of the same tolerances at once."""
        kernel = self._kernel(self.ladder.methods[method])
        pairs, which = np.unique(buffers.tolerances[cells], axis=0, return_inverse=True)
        for k, (own_rtol, own_atol) in enumerate(pairs):
            own, control = cells[which.reshape(-1) == k], self._control(float(own_rtol), float(own_atol))
            if len(own) == len(rows):
                _drive(kernel, rows, control, buffers)
            else:
                part = buffers.take(own)
                _drive(kernel, rows.take(own), control, part)
                buffers.put(own, part)

    def _control(self, rtol: float, atol: float) -> np.ndarray:
        """The control array for some tolerances, which `cancel` reaches."""
        with self.lock:
            if (rtol, atol) not in self.controls:
                control = self.controls[rtol, atol] = self.control.copy()
                control[Control.RTOL], control[Control.ATOL] = rtol, atol
            return self.controls[rtol, atol]

    def _kernel(self, method: Integrator) -> Kernel:
        """The kernel of a method; lanes do not change results, so that all but a single cell take what suits it."""
        with self.lock:
            if method.name not in self.kernels:
                width = 1 if self.spec.width == 1 else None
                self.kernels[method.name] = load(write_kernel(self.reduction, width, method))
            return self.kernels[method.name]


@dataclass(frozen=True, slots=True, eq=False)
class RowsSpec:
    """Equations without a sweep, whose cells come as rows; the synchronisation error is the only
    record.
    """

    equations: Equations
    integrator: Integrator | str
    control: np.ndarray  # (len(Control)
    # the record is the synchronisation error, or none if all oscillators are stepped as one; a scene may have a stop
    recording: Recording = SYNC_ERROR

    def source(self, width: int | None = None) -> SweepKernel:
        """Return the text of the kernel."""
        return emit(self.equations, self.integrator, self.recording, width)

    def job(self, spec: JobSpec, kernel: Kernel) -> RowsJob:
        """Return the job that runs the kernel."""
        return RowsJob(spec, kernel, self.control.copy())


@dataclass(slots=True)
class RowsJob:
    """A kernel, ready to run any rows."""

    spec: JobSpec
    kernel: Kernel
    control: np.ndarray

    def cancel(self) -> None:
        """End all cells that run in this process."""
        self.control[Control.CANCEL] = 1.0

    def run(self, rows: CellRows) -> Buffers:
        """Run the cells of these rows."""
        buffers = Buffers.empty(len(rows), rows.start.shape[1], room=0, samples=0)
        if self.kernel.origin.method.implicit:
            spans = rows.spans.copy()
            spans[:, SpanColumn.FIRST_STEP] = first_steps(Templates(self.kernel.equations), rows)
            rows = replace(rows, spans=spans)
        _drive(self.kernel, rows, self.control, buffers)
        return buffers


def _drive(kernel: Kernel, rows: CellRows, control: np.ndarray, buffers: Buffers) -> None:
    """Run all rows into the buffers."""
    kernel.drive(0, len(rows), rows.start, rows.numbers, rows.spans, control, *buffers.arrays())


def lane_size(equations: Equations) -> int:
    """Return how many numbers the lane of a cell holds: clock, state, parameters, and a saved state with what repeats."""
    return CLOCK + 2 * equations.dimension + len(equations.parameters) + len(REPEATING)


def hand_over(lanes: np.ndarray, cells: np.ndarray, length: np.ndarray, ladder: Ladder, method: np.ndarray) -> None:
    """Let lanes go on by another method from the state that they have reached.

    The new method begins with the mean length of the last steps, and stops at the ends of all periods unless it is a
    series.  What the old one found to repeat itself need not repeat itself now.
    """
    lane = lanes[cells]
    time, until = lane[:, TIME], lane[:, UNTIL]
    first = np.where(length > 0.0, length, FIRST_STEP * np.minimum(1.0, until))
    lane[:, STEP], lane[:, MEMORY], lane[:, CHANGE] = first, 0.0, np.inf
    lane[:, CYCLE], lane[:, POWER], lane[:, DUE], lane[:, BOUND] = 0.0, 1.0, 0.0, lane[:, PERIOD]
    lane[:, SAVED_AT] = -np.inf
    lane[:, LEFT] = np.where(lane[:, LEFT] > 0.0, -1.0, lane[:, LEFT])
    lane[:, STOP] = np.minimum(np.where(time < lane[:, START], lane[:, START], lane[:, END]), lane[:, BOUND])
    lane[:, LOOK] = np.where(method < len(ladder.methods) - 1, LOOKS * (lane[:, ACCEPTED] + lane[:, REJECTED]), np.inf)
    lanes[cells] = lane


@cache
def versions() -> str:
    """Return the versions that a result depends on."""
    names = ("synchain", "numba", "numpy", "sympy")
    return ", ".join(f"{name} {importlib.metadata.version(name)}" for name in names)


def first_room(scene: Scene, row: int) -> int:
    """Return the section points to make room for at first: two a period, if one more needs `row`
    numbers.
    """
    if "section" not in scene.record and not scene.sections:
        return 0
    periods = scene.window if scene.time_unit == "period" else scene.window / math.pi
    return int(min(2.0 * max(len(scene.sections), 1) * periods, 1e6, LARGEST_ROOM // row)) + 8
