"""Define jobs: a compiled kernel with all data to run cells, and a specification that rebuilds the job elsewhere.

A job runs in threads of this process. A worker in another process or on another machine receives the packed
specification once, and compiles the kernel from its own installation (`sweeps/worker.py`).
"""

from __future__ import annotations

import importlib.metadata
import io
import pickle
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Protocol

import numpy as np

from synchain.codegen.driver.columns import Control, SpanColumn
from synchain.codegen.integrators import Integrator
from synchain.codegen.kernels.observable_functions import SYNC_ERROR, Recording
from synchain.codegen.kernels.sweep_kernel import LARGEST_UNROLLED, SweepKernel, emit
from synchain.codegen.machine_code.compile import Kernel, load
from synchain.codegen.machine_code.installation import InstallationError
from synchain.codegen.machine_code.processor import processor, told_apart
from synchain.models.dynamics.equations import Equations
from synchain.models.inputs.plugin_files import allow_code, allowed_code

from ..cells.buffers import Buffers
from ..cells.paces import Templates
from ..cells.plan import CellRows
from ..cells.reduce import ReducedScene
from .choice import first_steps
from .engine import Engine
from .ladder_engine import LadderEngine, run_rows
from .scene_kernels import write_kernel

# States (cells, dimension) that replace the start of the scene, and whether each is valid (cells,).
Start = tuple[np.ndarray, np.ndarray]


class Job(Protocol):
    """A compiled kernel, ready to run blocks of cells."""

    spec: JobSpec

    def run(self, *block: Any) -> Buffers:
        """Run a block; its arguments are those of a `Task`."""

    def cancel(self) -> None:
        """End all cells that run in this process."""


class Problem(Protocol):
    """The equations and records of a job."""

    def source(self, width: int) -> SweepKernel:
        """Return the text of its kernel."""

    def job(self, spec: JobSpec, kernel: Kernel) -> Job:
        """Return the job that runs its kernel."""


@dataclass(frozen=True, slots=True)
class JobSpec:
    """The common part of all blocks of a job, from which another process rebuilds it."""

    problem: Problem
    width: int  # lanes of the kernel and SHA-256 of its text
    digest: str
    versions: str  # versions and kind of processor of the main program; a worker must have the same
    processor: str
    code: tuple[str, ...]  # files of code that are allowed to run

    @classmethod
    def of(cls, problem: Problem, source: SweepKernel) -> JobSpec:
        return cls(problem, source.width, source.digest, versions(), processor(), allowed_code())

    def packed(self) -> bytes:
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
            main, here = told_apart(head["processor"], processor())
            raise InstallationError(
                f"this worker has the processor {here}; expected that of the main program, {main}, because another kind may "
                "round otherwise; run on one kind, or set NUMBA_CPU_NAME and NUMBA_CPU_FEATURES to one that all can run"
            )
        allow_code(*head["code"])
        return cls(pickle.load(source), **head)

    def rebuilt(self) -> Job:
        source = self.problem.source(self.width)
        if source.digest != self.digest:
            raise InstallationError(
                f"this worker makes the kernel {source.digest[:12]}; expected that of the main program, "
                f"{self.digest[:12]}: a sweep needs the same installation everywhere"
            )
        return self.problem.job(self, load(source))


@dataclass(frozen=True, slots=True, eq=False)
class SweepSpec:
    """The sweep of a reduced scene; `room`: initial number of section points that a buffer can hold."""

    reduction: ReducedScene
    room: int | None = None

    def source(self, width: int) -> SweepKernel:
        return write_kernel(self.reduction, width)

    def job(self, spec: JobSpec, kernel: Kernel) -> SweepJob:
        return SweepJob(spec, kernel, self.reduction, LadderEngine(self.reduction, kernel, self.room))


@dataclass(slots=True)
class SweepJob:
    """Lay out cells of a sweep as rows, and integrate them with an engine."""

    spec: JobSpec
    kernel: Kernel  # the kernel with which most cells begin; named in the attributes of results
    reduction: ReducedScene
    engine: Engine

    def cancel(self) -> None:
        """End all cells that run in this process."""
        self.engine.cancel()

    def run(self, cells: np.ndarray, start: Start | None = None, near: np.ndarray | None = None) -> Buffers:
        rows = self.reduction.rows(self.reduction.planner.rows(cells, near))
        if start is not None:
            rows = replace(rows, start=np.where(start[1][:, None], start[0], rows.start))
        return self.engine.run(rows)


@dataclass(frozen=True, slots=True, eq=False)
class RowsSpec:
    """Equations whose cells come as rows, without a sweep."""

    equations: Equations
    integrator: Integrator | str
    control: np.ndarray  # (len(Control),)
    # the synchronisation error is recorded, unless all oscillators are stepped as one; a scene may have a stop
    recording: Recording = SYNC_ERROR
    unroll: int = LARGEST_UNROLLED  # most nodes of a step that is written out

    def source(self, width: int | None = None) -> SweepKernel:
        return emit(self.equations, self.integrator, self.recording, width, unroll=self.unroll)

    def job(self, spec: JobSpec, kernel: Kernel) -> RowsJob:
        return RowsJob(spec, kernel, self.control.copy())


@dataclass(slots=True)
class RowsJob:
    """Run any rows with one kernel; both a `Job` and an `Engine` of one integrator."""

    spec: JobSpec
    kernel: Kernel
    control: np.ndarray

    def cancel(self) -> None:
        """End all cells that run in this process."""
        self.control[Control.CANCEL] = 1.0

    def run(self, rows: CellRows) -> Buffers:
        buffers = Buffers.empty(len(rows), rows.start.shape[1], room=0, samples=0)
        if self.kernel.origin.method.implicit:
            spans = rows.spans.copy()
            spans[:, SpanColumn.FIRST_STEP] = first_steps(Templates(self.kernel.equations), rows)
            rows = replace(rows, spans=spans)
        run_rows(self.kernel, rows, self.control, buffers)
        return buffers


@dataclass(frozen=True, slots=True, eq=False)
class LadderSpec:
    """A reduced scene whose cells come as rows; each cell may change its integrator, as in a sweep."""

    reduction: ReducedScene

    def source(self, width: int | None = None) -> SweepKernel:
        return write_kernel(self.reduction, width)

    def job(self, spec: JobSpec, kernel: Kernel) -> LadderJob:
        return LadderJob(spec, LadderEngine(self.reduction, kernel, 0))


@dataclass(slots=True)
class LadderJob:
    """Run any rows of a reduced scene with an engine."""

    spec: JobSpec
    engine: Engine

    def cancel(self) -> None:
        """End all cells that run in this process."""
        self.engine.cancel()

    def run(self, rows: CellRows) -> Buffers:
        return self.engine.run(rows)


@cache
def versions() -> str:
    """Return the versions of software on which a result depends."""
    names = ("synchain", "numba", "numpy", "sympy")
    return ", ".join(f"{name} {importlib.metadata.version(name)}" for name in names)
