"""Schedule the unfinished blocks of a sweep: choose blocks that can run, and store finished blocks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..cells.buffers import Buffers
from ..cells.layout import Layout
from ..engines.job import Start
from ..support.progress import Reporter
from ..support.status import tally
from .pool import Task, WorkerPool
from .prepare import PreparedRun


class Sink(Protocol):
    """Store blocks that have ended: in memory, on disk, or only their final states."""

    layout: Layout

    def missing(self, block: int) -> np.ndarray:
        """Return the numbers of the unfinished cells of a block; all cells, if the sink stores only complete blocks."""
        return self.layout.rows(block)

    def ends(self, block: int) -> Start:
        """Return the final states of a stored block, and whether each of its cells finished."""

    def put(self, task: Task, buffers: Buffers) -> None:
        """Store the cells of a block; Ctrl-C may have interrupted some of the cells."""


@dataclass(slots=True)
class BlockScheduler:
    """Schedule the blocks that are not `done` (blocks,), store them in `sink` and report progress."""

    done: np.ndarray
    sink: Sink
    prepared: PreparedRun
    reporter: Reporter

    def run(self) -> None:
        """Run all unfinished blocks; raise the errors of workers, and KeyboardInterrupt on Ctrl-C."""
        if self.done.all():
            return
        with WorkerPool(self.prepared.job, self.prepared.execution) as pool:
            pool.run(self.tasks(), self.finish)

    def tasks(self) -> Iterator[Task]:
        """Yield the unfinished blocks that do not depend on an unfinished block."""
        done = self.done.copy()  # for a block that finishes meanwhile, `finish` returns the dependent block
        for block in np.flatnonzero(~done).tolist():
            needed = self.sink.layout.before(block)
            if needed is None or done[needed]:
                yield self._task(block, None if needed is None else self.sink.ends(needed))

    def finish(self, task: Task, buffers: Buffers) -> Task | None:
        self.sink.put(task, buffers)
        if not buffers.ended:
            return None
        self.done[task.block] = True
        self.reporter.add(tally(buffers.status))
        following = self.sink.layout.after(task.block)
        if following is None or self.done[following]:
            return None
        return self._task(following, (buffers.end, buffers.finished))

    def _task(self, block: int, start: Start | None) -> Task:
        """Return the task of a block that starts from these states."""
        cells, certificate = self.sink.missing(block), self.prepared.certificate
        return Task(block, cells, (cells, start, None if certificate is None else certificate.near[cells]))
