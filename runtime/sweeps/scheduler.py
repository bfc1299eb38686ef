"""Schedule the unfinished blocks of a sweep: which can run, and where they go when they have ended."""

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
    """Store blocks that have ended: in memory, on disk, or their ends alone."""

    layout: Layout

    def missing(self, block: int) -> np.ndarray:
        """Return the numbers of the cells of a block that are still to run; all of them, unless single cells are stored."""
        return self.layout.rows(block)

    def ends(self, block: int) -> Start:
        """Return the final states of a stored block, and which of its cells finished."""

    def put(self, task: Task, buffers: Buffers) -> None:
        """Store the cells of a block; cells that Ctrl-C cut short may be among them."""


@dataclass(slots=True)
class BlockScheduler:
    """Schedule the blocks that are not `done` (blocks,), store them in `sink` and report progress."""

    done: np.ndarray
    sink: Sink
    prepared: PreparedRun
    reporter: Reporter

    def run(self) -> None:
        """Run all blocks that the sink lacks; raise the errors of workers, and KeyboardInterrupt on Ctrl-C."""
        if self.done.all():
            return
        with WorkerPool(self.prepared.job, self.prepared.execution) as pool:
            pool.run(self.tasks(), self.finish)

    def tasks(self) -> Iterator[Task]:
        """Yield the unfinished blocks that depend on no unfinished one."""
        done = self.done.copy()  # `finish` returns the block that depends on one that finishes meanwhile
        for block in np.flatnonzero(~done).tolist():
            needed = self.sink.layout.before(block)
            if needed is None or done[needed]:
                yield self._task(block, None if needed is None else self.sink.ends(needed))

    def finish(self, task: Task, buffers: Buffers) -> Task | None:
        """Store a block; return the one that depends on it, or None."""
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
