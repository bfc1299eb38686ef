"""Schedules the blocks of a sweep that are not finished: which can run, and where they go when they
have ended.
"""

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
    """Keeps blocks that have ended."""

    def missing(self, block: int) -> np.ndarray:
        """Numbers of the cells of a block that are still to run."""

    def ends(self, block: int) -> Start:
        """The final states of a block that the sink has, and which of its cells finished."""

    def put(self, task: Task, buffers: Buffers) -> None:
        """Keep the cells of a block; cells that Ctrl-C cut short may be among them."""


@dataclass(slots=True)
class BlockScheduler:
    """Schedules the unfinished blocks of a sweep, stores results in `sink` and reports progress.

    done (blocks,): which blocks the sink has.
    """

    layout: Layout
    done: np.ndarray
    sink: Sink
    prepared: PreparedRun
    reporter: Reporter

    def run(self) -> None:
        """Run all blocks that the sink does not have; raises what a worker raises, and
        KeyboardInterrupt on Ctrl-C.
        """
        if self.done.all():
            return
        with WorkerPool(self.prepared.job, self.prepared.execution) as pool:
            pool.run(self.tasks(), self.finish)

    def tasks(self) -> Iterator[Task]:
        """Yield the blocks that can run at once: unfinished, and in no need of an unfinished one."""
        done = self.done.copy()  # a block that finishes meanwhile brings the one that needs it along
        for block in np.flatnonzero(~done).tolist():
            needed = self.layout.before(block)
            if needed is None or done[needed]:
                yield self._task(block, None if needed is None else self.sink.ends(needed))

    def finish(self, task: Task, buffers: Buffers) -> Task | None:
        """Keep a block; returns the one that has waited for it, if there is one."""
        self.sink.put(task, buffers)
        if not buffers.ended:
            return None
        self.done[task.block] = True
        self.reporter.add(tally(buffers.status))
        following = self.layout.after(task.block)
        if following is None or self.done[following]:
            return None
        return self._task(following, (buffers.end, buffers.finished))

    def _task(self, block: int, start: Start | None) -> Task:
        """The task of a block that starts from these states."""
        cells, certificate = self.sink.missing(block), self.prepared.certificate
        return Task(block, cells, (cells, start, None if certificate is None else certificate.near[cells]))
