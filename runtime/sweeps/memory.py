"""Store the results of a sweep in memory, in arrays of all cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..cells.buffers import Buffers
from ..cells.layout import Layout
from ..cells.observable_arrays import Sections
from ..engines.job import Start
from ..engines.scene_kernels import ladder_of
from ..engines.step_warnings import warn_of_steps
from ..results.labels import START_STATE
from ..results.result import Result, gather
from ..support.progress import Reporter
from ..support.status import tally
from .errors import sweep_errors
from .pool import Task
from .prepare import PreparedRun
from .scheduler import BlockScheduler


@dataclass(slots=True)
class Memory:
    """Store the blocks of a sweep in arrays of all cells."""

    prepared: PreparedRun
    layout: Layout
    buffers: Buffers

    @classmethod
    def of(cls, prepared: PreparedRun, earlier: Result | None) -> Memory:
        """Return arrays for all cells; copy the finished cells of an earlier result."""
        reduction = prepared.reduction
        cells = reduction.scene.cells
        if earlier is None:
            return cls(prepared, prepared.layout(), reduction.empty(cells, 0))
        begun, starts = None, reduction.planner.starts
        if START_STATE in earlier.data:
            begun = earlier.states(START_STATE).reshape(earlier.scene.cells, -1)
        if not (begun is starts if begun is None or starts is None else np.array_equal(begun, starts)):
            raise ValueError(
                "the result to resume started from other states; give the start of that run, or run without resume"
            )
        dimension = len(reduction.scene.y0)
        point_size = Sections(reduction.scene).width(dimension)
        network = Buffers.empty(cells, dimension, 0, reduction.samples, reduction.observed.numbers, point_size)
        earlier.restore(reduction.scene, network, reduction.equations)
        return cls(prepared, prepared.layout(), reduction.merge.contract(network))

    def done(self) -> np.ndarray:
        """Return whether each block (blocks,), and all blocks on which it depends, have finished."""
        # In a continued sweep, clear the unfinished blocks.
        finished = self.buffers.finished
        done = np.zeros(self.layout.blocks, dtype=bool)
        for block in range(self.layout.blocks):
            rows, needed = self.layout.rows(block), self.layout.before(block)
            done[block] = finished[rows].all() and (needed is None or done[needed])
            if self.layout.columns and not done[block]:  # the cells started from unfinished cells
                self.buffers.clear(rows)
        return done

    def missing(self, block: int) -> np.ndarray:
        rows = self.layout.rows(block)
        return np.asarray(rows[~self.buffers.finished[rows]])

    def ends(self, block: int) -> Start:
        rows = self.layout.rows(block)
        return self.buffers.end[rows], self.buffers.finished[rows]

    def put(self, task: Task, buffers: Buffers) -> None:
        self.buffers.put(task.cells, buffers)

    def run(self, reporter: Reporter) -> None:
        scheduler = BlockScheduler(self.done(), self, self.prepared, reporter)
        reduction = self.prepared.reduction
        try:
            with sweep_errors(reduction.scene.cells, lambda: (int(self.buffers.finished.sum()), self.result())):
                reporter.start(tally(self.buffers.status[self.buffers.finished]), self.prepared.compiling)
                scheduler.run()
                # Rows are not stored: lay out the rows of cells with short steps again.
                warn_of_steps(
                    ladder_of(reduction), self.buffers, lambda cells: reduction.rows(reduction.planner.rows(cells))
                )
        finally:
            reporter.close()

    def result(self) -> Result:
        """Return the result with the cells that have run so far."""
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
