"""One sitting of a sweep: which blocks are still to run, and where they go when they are done."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from synchain.codegen.integrators import integrator
from synchain.models.inputs.checks import flag
from synchain.models.scenes.scene import Scene

from ..cells.buffers import Buffers
from ..cells.kernels import as_reduction, kernel_source
from ..cells.layout import Layout, block_size
from ..cells.reduce import Reduction
from ..results.certificate import Certificate
from ..results.labels import provenance
from ..results.result import Result
from ..support.status import Status, tally
from .certify import certify
from .job import JobSpec, Start, SweepJob, whole
from .pool import Task, WorkerPool, feed, pool_size
from .progress import Reporter

__all__ = ["BlockScheduler", "PreparedRun", "Sink", "SweepFailed", "SweepInterrupted", "prepare"]


class SweepInterrupted(KeyboardInterrupt):
    """Ctrl-C during a sweep; `finished` of `cells` had finished, `result` holds them where no file does."""

    def __init__(self, finished: int, cells: int, result: Result | None = None) -> None:
        super().__init__(f"interrupted with {finished} of {cells} cells finished")
        self.finished, self.cells, self._result = finished, cells, result

    @property
    def result(self) -> Result:
        """The cells that had finished; AttributeError where they are in a file."""
        if self._result is None:
            raise AttributeError("the finished cells are in the file of the run; open it with open_result")
        return self._result


class SweepFailed(RuntimeError):
    """A worker or the disk has failed; `finished` of `cells` had finished, `result` holds them where no file does."""

    def __init__(self, reason: str, finished: int, cells: int, result: Result | None = None) -> None:
        super().__init__(f"{reason}; {finished} of {cells} cells had finished")
        self.reason, self.finished, self.cells, self.result = reason, finished, cells, result


class Sink(Protocol):
    """Where finished blocks go."""

    def missing(self, block: int) -> np.ndarray:
        """Numbers of the cells of a block that are still to run."""

    def ends(self, block: int) -> Start:
        """The final states of a block that is there, and which of its cells finished."""

    def put(self, task: Task, made: Buffers) -> None:
        """Keep what a block's cells have come to; those that were cut short by Ctrl-C are among them."""


@dataclass(slots=True)
class BlockScheduler:
    """A sweep's layout, the blocks (blocks,) that are there, where the others go, and who is told."""

    layout: Layout
    done: np.ndarray
    sink: Sink
    reporter: Reporter
    certificate: Certificate | None = None

    def run(self, shop: SweepJob, executor: Executor | None, workers: int) -> None:
        """Run all blocks that are not there; raises what a worker raises, and KeyboardInterrupt on Ctrl-C."""
        if self.done.all():
            return
        crew = WorkerPool(shop, executor, workers)
        try:
            feed(crew, self.tasks(), self.finish)
        finally:
            crew.close()

    def tasks(self) -> Iterator[Task]:
        """The blocks that can run at once: not there, and not waiting for another one."""
        done = self.done.copy()  # what is finished meanwhile brings what comes after it along
        for block in np.flatnonzero(~done).tolist():
            needed = self.layout.before(block)
            if needed is None or done[needed]:
                yield self._task(block, None if needed is None else self.sink.ends(needed))

    def finish(self, task: Task, made: Buffers) -> Task | None:
        """Keep a block; returns the one that has waited for it, if there is one."""
        self.sink.put(task, made)
        if not whole(made):
            return None
        self.done[task.block] = True
        self.reporter.add(tally(made.counts[:, 0]))
        following = self.layout.after(task.block)
        if following is None or self.done[following]:
            return None
        return self._task(following, (made.end, made.counts[:, 0] == Status.FINISHED))

    def _task(self, block: int, start: Start | None) -> Task:
        cells = self.sink.missing(block)
        return Task(block, cells, start, None if self.certificate is None else self.certificate.near[cells])


@dataclass(frozen=True, slots=True)
class PreparedRun:
    """Kernel and certificate of a sweep, and how many workers it has."""

    shop: SweepJob
    certificate: Certificate | None
    workers: int

    @property
    def limits(self) -> tuple[float, float]:
        """The tolerances (rtol, atol) that are integrated with."""
        return float(self.shop.control[0]), float(self.shop.control[1])

    @property
    def attributes(self) -> dict[str, Any]:
        """What a result says about how it came about."""
        recipe = self.shop.recipe
        chosen = recipe.chosen
        return provenance(
            chosen.scene, self.shop.kernel, self.limits, chosen.skipped, recipe.versions, recipe.processor
        )

    def size(self) -> int:
        """Cells of a block."""
        return block_size(self.shop.recipe.chosen.scene, self.shop.kernel.origin.width, self.workers)


def prepare(
    scene: Scene,
    reduce: bool | Reduction,
    width: int | None,
    workers: int | None,
    executor: Executor | None,
    certificate: Certificate | bool,
) -> PreparedRun:
    """Compile the kernel of a scene and, with `certificate` True, find the exponents of its cells."""
    chosen = as_reduction(scene, reduce)
    if not isinstance(certificate, Certificate):
        flag("certified", certificate)
    source = kernel_source(scene, width, chosen)
    _warn_of_chords(scene, source.integrator)
    count = pool_size(executor, workers)
    if isinstance(certificate, bool):
        found = certify(scene, workers=None if executor is not None else count) if certificate else None
    else:
        found = certificate
    return PreparedRun(SweepJob(JobSpec.of(chosen, source.width, source.digest)), found, count)


def _warn_of_chords(scene: Scene, name: str) -> None:
    """Warn where states between steps are recorded by an integrator that has only straight lines there."""
    between = [record for record in ("trajectory", "section") if record in scene.record]
    if between and integrator(name).dense_order < 2:
        warnings.warn(
            f"{name} draws straight lines between its steps, so errors of {' and '.join(between)} are not bounded by rtol; "
            "take another integrator for these records, e.g. rodas5p",
            RuntimeWarning,
            stacklevel=4,
        )
