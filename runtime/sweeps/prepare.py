"""Prepare a reduced scene for running: write the text of its kernel, and compile or load the kernel."""

from __future__ import annotations

import time
from dataclasses import dataclass

from synchain.codegen.machine_code.compile import load
from synchain.models.scenes.scene import Scene

from ..cells.layout import Layout, block_size
from ..cells.reduce import ReducedScene
from ..engines.job import JobSpec, SweepJob, SweepSpec
from ..engines.scene_kernels import warn_of_chords, write_kernel
from ..results.certificate import Certificate
from ..results.labels import provenance
from ..support.execution import Execution
from .continued_start import expect_whole_periods


@dataclass(frozen=True, slots=True)
class PreparedRun:
    """A sweep with a compiled kernel, ready to run."""

    job: SweepJob
    certificate: Certificate | None  # exponents of all cells of a certified run, else None
    execution: Execution  # runs the blocks
    compiling: float  # seconds for compiling or loading the kernel

    @property
    def reduction(self) -> ReducedScene:
        return self.job.reduction

    @property
    def scene(self) -> Scene:
        return self.job.reduction.scene

    @property
    def attributes(self) -> dict[str, object]:
        """The provenance of the result."""
        job, spec = self.job, self.job.spec
        return provenance(self.scene, job.kernel, self.reduction.skipped, spec.versions, spec.processor)

    def layout(self, workers: int | None = None) -> Layout:
        """Return the blocks of the sweep, sized for a number of workers (default: that of the execution)."""
        workers = self.execution.size if workers is None else workers
        return Layout.of(self.scene, block_size(self.scene, self.job.spec.width, workers))


def prepare(
    reduction: ReducedScene,
    execution: Execution,
    certificate: Certificate | None = None,
    *,
    width: int | None = None,
    room: int | None = None,
) -> PreparedRun:
    expect_whole_periods(reduction.planner)
    source = write_kernel(reduction, width)
    warn_of_chords(source)
    began = time.perf_counter()
    problem = SweepSpec(reduction, room)
    job = problem.job(JobSpec.of(problem, source), load(source))
    return PreparedRun(job, certificate, execution, time.perf_counter() - began)
