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
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from synchain.codegen.driver.columns import Control
from synchain.codegen.integrators import Integrator
from synchain.codegen.kernels.compile import Kernel, load
from synchain.codegen.kernels.installation import InstallationError
from synchain.codegen.kernels.observed import UNWATCHED, Watched
from synchain.codegen.kernels.processor import processor, told_apart
from synchain.codegen.kernels.sweep import KernelSource, emit
from synchain.models.dynamics.equations import Equations
from synchain.models.inputs.plugins import allow_code, allowed_code
from synchain.models.scenes.scene import Scene

from ..cells.buffers import Buffers
from ..cells.kernels import write_kernel
from ..cells.plan import Plan, control_of
from ..cells.reduce import Reduction

__all__ = ["Job", "JobSpec", "Problem", "RowsJob", "RowsSpec", "Start", "SweepJob", "SweepSpec", "versions"]

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

    def source(self, width: int) -> KernelSource:
        """Return the text of its kernel."""

    def job(self, spec: JobSpec, kernel: Kernel) -> Job:
        """Return the job that runs its kernel."""


@dataclass(frozen=True, slots=True)
class JobSpec:
    """What all blocks of a job have in common: enough to rebuild it in another process.

    Attributes
    ----------
    problem : Problem
    width, digest : int, str
        Lanes of the kernel and SHA-256 of its text.
    versions, processor : str
        Versions and kind of processor of the main program; a worker must have the same.
    code : tuple of str
        Files of code that are allowed to run.
    """

    problem: Problem
    width: int
    digest: str
    versions: str
    processor: str
    code: tuple[str, ...]

    @classmethod
    def of(cls, problem: Problem, source: KernelSource) -> JobSpec:
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
        """Return the specification from bytes.

        Raises
        ------
        InstallationError
            If this worker has other versions or another processor than the main program.
        """
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
        """Return the job, with a kernel from this installation.

        Raises
        ------
        InstallationError
            If the text of the kernel is not that of the main program.
        """
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

    reduction: Reduction
    room: int | None = None

    def source(self, width: int) -> KernelSource:
        """Return the text of the kernel."""
        return write_kernel(self.reduction, width)

    def job(self, spec: JobSpec, kernel: Kernel) -> SweepJob:
        """Return the job that runs the kernel."""
        return SweepJob(spec, kernel, self.reduction, self.room)


@dataclass(slots=True)
class SweepJob:
    """A kernel, ready to run any cells of a scene's sweep.

    `room` are section points of a cell to make room for at first; by default two a period, as far
    as memory allows.  Cells with more are run again with what they need.
    """

    spec: JobSpec
    kernel: Kernel
    reduction: Reduction
    room: int | None = None
    control: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        self.control = control_of(self.reduction.planner, self.reduction.jumps, self.kernel.origin.method)

    def cancel(self) -> None:
        """End all cells that run in this process."""
        self.control[Control.CANCEL] = 1.0

    def run(self, cells: np.ndarray, start: Start | None = None, near: np.ndarray | None = None) -> Buffers:
        """Run cells of the sweep.

        Parameters
        ----------
        cells : ndarray of int
            Numbers of the cells.
        start : tuple of ndarray, optional
            States to start from in place of the scene's, and for which of the cells they are good.
        near : ndarray, shape (cells,), optional
            Synchronisation errors below which the cells end early.
        """
        reduction = self.reduction
        rows = reduction.rows(reduction.planner.rows(cells, near))
        if start is not None:
            rows = replace(rows, start=np.where(start[1][:, None], start[0], rows.start))
        room = first_room(reduction.scene, len(cells) * (reduction.point_size + 1)) if self.room is None else self.room
        buffers = self._drive(rows, room)
        short = np.flatnonzero(buffers.point_counts > room)
        if len(short):
            buffers.put(short, self._drive(rows.take(short), buffers.most_points))
        buffers.points = np.ascontiguousarray(buffers.points[:, : buffers.most_points])
        return buffers

    def _drive(self, rows: Plan, room: int) -> Buffers:
        """Run rows with room for so many section points of each."""
        observed = self.reduction.observed
        buffers = self.reduction.empty(len(rows), room, observed.tallies)
        _drive(self.kernel, rows, self.control, buffers)
        buffers.sums = observed.summary(buffers.sums)
        return buffers


@dataclass(frozen=True, slots=True, eq=False)
class RowsSpec:
    """Equations without a sweep, whose cells come as rows; the synchronisation error is the only
    record.

    Attributes
    ----------
    equations : Equations
    integrator : Integrator or str
    control : ndarray, shape (len(Control),)
    multiplicity : tuple of int, optional
        How many oscillators each node stands for in the synchronisation error.
    records : tuple of str
        ("sync_error",), or none if all oscillators are stepped as one.
    watched : Watched
        Holds the stop of a scene, if it has one.
    """

    equations: Equations
    integrator: Integrator | str
    control: np.ndarray
    multiplicity: tuple[int, ...] | None = None
    records: tuple[str, ...] = ("sync_error",)
    watched: Watched = UNWATCHED

    def source(self, width: int | None = None) -> KernelSource:
        """Return the text of the kernel."""
        return emit(self.equations, self.integrator, self.records, None, width, self.multiplicity, watched=self.watched)

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

    def run(self, rows: Plan) -> Buffers:
        """Run the cells of these rows."""
        buffers = Buffers.empty(len(rows), rows.start.shape[1], room=0, samples=0)
        _drive(self.kernel, rows, self.control, buffers)
        return buffers


def _drive(kernel: Kernel, rows: Plan, control: np.ndarray, buffers: Buffers) -> None:
    """Run all rows into the buffers."""
    kernel.drive(0, len(rows), rows.start, rows.numbers, rows.spans, control, *buffers.arrays())


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
