"""The results of a sweep in memory: arrays of all its cells, which blocks fill."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..cells.buffers import Buffers
from ..cells.layout import Layout
from ..cells.observable_arrays import Sections
from ..engines.choice import warn_of_steps
from ..engines.job import Start
from ..results.labels import START_STATE
from ..results.result import Result, gather
from ..support.progress import Reporter
from ..support.status import tally
from .errors import SweepFailed, SweepInterrupted
from .pool import Task, worker_lost
from .prepare import PreparedRun
from .scheduler import BlockScheduler


@dataclass(slots=True)
class Memory:
    """Keeps the blocks of a sweep in arrays of all its cells."""

    prepared: PreparedRun
    layout: Layout
    buffers: Buffers

    @classmethod
    def of(cls, prepared: PreparedRun, earlier: Result | None) -> Memory:
        """Return arrays for all cells, with those of an earlier result that finished."""
        reduction = prepared.reduction
        cells = reduction.scene.cells
        if earlier is not None:
            _expect_starts(earlier, reduction.planner.starts)
        if earlier is None:
            return cls(prepared, prepared.layout(), reduction.empty(cells, 0))
        dimension = len(reduction.scene.y0)
        kept = Sections(reduction.scene).width(dimension)
        whole = Buffers.empty(cells, dimension, 0, reduction.samples, reduction.observed.numbers, kept)
        earlier.restore(reduction.scene, whole, reduction.equations)
        return cls(prepared, prepared.layout(), reduction.merge.contract(whole))

    def done(self) -> np.ndarray:
        """True for each block (blocks,) that has finished, with those that it needed; in a
        continued sweep clears others.
        """
        finished = self.buffers.finished
        done = np.zeros(self.layout.blocks, dtype=bool)
        for block in range(self.layout.blocks):
            rows, needed = self.layout.rows(block), self.layout.before(block)
            done[block] = finished[rows].all() and (needed is None or done[needed])
            if self.layout.columns and not done[block]:  # its cells started from others
                self.buffers.clear(rows)
        return done

    def missing(self, block: int) -> np.ndarray:
        """Numbers of the cells of a block that have not finished."""
        rows = self.layout.rows(block)
        return np.asarray(rows[~self.buffers.finished[rows]])

    def ends(self, block: int) -> Start:
        """The final states of a block, and which of its cells finished."""
        rows = self.layout.rows(block)
        return self.buffers.end[rows], self.buffers.finished[rows]

    def put(self, task: Task, buffers: Buffers) -> None:
        """Copy the cells of a block into the arrays of all cells."""
        self.buffers.put(task.cells, buffers)

    def run(self, reporter: Reporter) -> None:
        """Run the blocks that have not finished."""
        scheduler = BlockScheduler(self.layout, self.done(), self, self.prepared, reporter)
        try:
            reporter.start(tally(self.buffers.status[self.buffers.finished]), self.prepared.compiling)
            scheduler.run()
            self.warn()
        except (Exception, KeyboardInterrupt) as problem:
            if not (isinstance(problem, KeyboardInterrupt) or worker_lost(problem)):
                raise
            count, result = int(self.buffers.finished.sum()), self.result()
            if isinstance(problem, KeyboardInterrupt):
                raise SweepInterrupted(count, result.scene.cells, result) from None
            reason = f"the workers are lost ({problem})"
            raise SweepFailed(reason, count, result.scene.cells, result) from problem
        finally:
            reporter.close()

    def warn(self) -> None:
        """Warn of cells that came to no end, and of steps that were short."""
        reduction = self.prepared.reduction
        warn_of_steps(
            self.prepared.job.ladder, self.buffers, lambda cells: reduction.rows(reduction.planner.rows(cells))
        )

    def result(self) -> Result:
        """Return the cells so far."""
        prepared, scene = self.prepared, self.prepared.scene
        spans = prepared.reduction.planner.spans(np.arange(scene.cells))
        return gather(
            scene,
            lambda: prepared.attributes,
            spans,
            prepared.reduction.expand(self.buffers),
            prepared.certificate,
            prepared.reduction.planner.starts,
        )


def _expect_starts(earlier: Result, starts: np.ndarray | None) -> None:
    """Raise ValueError if an earlier result started from other states than those of all cells, None for the scene's."""
    begun = earlier.states(START_STATE).reshape(earlier.scene.cells, -1) if START_STATE in earlier.data else None
    alike = begun is starts if begun is None or starts is None else np.array_equal(begun, starts)
    if not alike:
        raise ValueError(
            "the result to resume started from other states; give the start of that run, or run without resume"
        )
