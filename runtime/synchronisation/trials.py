"""Run cells in rounds with one kernel and one pool of workers; return mean synchronisation errors and final states."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from synchain.codegen.driver.columns import Count, SumColumn
from synchain.codegen.kernels.sweep_kernel import SweepKernel
from synchain.codegen.machine_code.compile import load
from synchain.models.scenes.scene import Scene

from ..cells.buffers import Buffers
from ..cells.layout import block_size
from ..cells.observable_arrays import ObservableArrays
from ..cells.plan import CellRows
from ..cells.reduce import ReducedScene
from ..engines.choice import chosen_for_rows
from ..engines.job import JobSpec, LadderSpec, RowsSpec
from ..engines.scene_kernels import write_kernel
from ..engines.step_control import control_of
from ..support.execution import Execution
from ..support.status import CODES, Status, tally
from ..sweeps.errors import SweepFailed, SweepInterrupted, worker_lost
from ..sweeps.pool import Task, WorkerPool

Rows = Callable[[np.ndarray], CellRows]
"""A function that lays out cells, given their numbers (count,)."""


class Outcome(NamedTuple):
    """Results of a round."""

    error: np.ndarray  # (cells,): mean synchronisation errors, infinite if a cell did not finish
    status: np.ndarray  # (cells,): status of each cell
    end: np.ndarray  # (cells, dimension): states at the end, NaN if a cell did not finish
    steps: np.ndarray  # (cells,): number of steps
    reached: np.ndarray  # (cells, dimension): states where the cells stopped, finished or not
    observed: np.ndarray  # (cells, any): observables over the window


class Trials:
    """A compiled kernel and a pool of workers for any number of rounds; as a context manager, close the pool.

    The scene gives the length of a cell. `expand` converts the buffers of a reduced network to those of the unreduced
    one.
    """

    def __init__(
        self,
        scene: Scene,
        problem: RowsSpec | LadderSpec,
        source: SweepKernel,
        execution: Execution,
        expand: Callable[[Buffers], Buffers] | None = None,
    ) -> None:
        self.scene, self.width, self.execution, self.expand = scene, source.width, execution, expand
        self.method = source.method  # with which most cells begin
        began = time.perf_counter()
        job = problem.job(JobSpec.of(problem, source), load(source))
        self._compiling = time.perf_counter() - began
        self.pool = WorkerPool(job, execution)

    @classmethod
    def of(cls, reduction: ReducedScene, execution: Execution) -> Trials:
        """Return trials of a reduced scene, whose cells represent those of all rounds and choose the kernel."""
        strongest = reduction.rows(reduction.planner.extremes())
        source = write_kernel(reduction, method=chosen_for_rows(reduction.scene, reduction.equations, strongest))
        control = control_of(reduction.planner, reduction.jumps)
        problem = RowsSpec(reduction.equations, source.method, control, reduction.recording)
        return cls(reduction.scene, problem, source, execution, reduction.expand)

    @classmethod
    def by_ladder(cls, reduction: ReducedScene, execution: Execution) -> Trials:
        """Return trials of an unreduced scene with its observables; cells may change integrators, as in `run`."""
        problem = LadderSpec(reduction)
        return cls(reduction.scene, problem, problem.source(), execution)

    def __enter__(self) -> Trials:
        return self

    def __exit__(self, *problem: object) -> None:
        self.pool.close()

    def run(self, count: int, rows: Rows) -> Outcome:
        """Run a round of `count` cells."""
        error, status = np.full(count, np.inf), np.full(count, int(Status.NOT_RUN))
        end, steps = np.full((count, self.scene.equations.dimension), np.nan), np.zeros(count, dtype=np.int64)
        reached = np.full_like(end, np.nan)
        observed = np.full((count, ObservableArrays(self.scene).numbers), np.nan)
        reporter = self.execution.reporter(count)
        size = block_size(self.scene, self.width, self.execution.size, count)

        def finish(task: Task, buffers: Buffers) -> None:
            network = buffers if self.expand is None else self.expand(buffers)
            error[task.cells] = mean_errors(network)
            end[task.cells] = np.where(network.finished[:, None], network.end, np.nan)
            reached[task.cells] = network.end
            observed[task.cells] = network.sums[:, len(SumColumn) :]
            status[task.cells] = buffers.status
            steps[task.cells] = buffers.counts[:, [Count.ACCEPTED, Count.REJECTED]].sum(axis=1)
            reporter.add(tally(buffers.status))

        blocks = (np.arange(first, min(first + size, count)) for first in range(0, count, size))
        try:
            reporter.start(np.zeros(CODES, dtype=np.int64), self._compiling)
            self._compiling = 0.0
            self.pool.run((Task(k, cells, (rows(cells),)) for k, cells in enumerate(blocks)), finish)
        except (Exception, KeyboardInterrupt) as problem:
            finished = int((status == Status.FINISHED).sum())
            if isinstance(problem, KeyboardInterrupt):
                raise SweepInterrupted(finished, count) from None
            if not worker_lost(problem):
                raise
            raise SweepFailed(f"the workers are lost ({problem})", finished, count) from problem
        finally:
            reporter.close()
        return Outcome(error, status, end, steps, reached, observed)


def mean_errors(buffers: Buffers) -> np.ndarray:
    """Return the mean synchronisation errors (cells,), infinite if a cell did not finish."""
    return np.where(buffers.finished, buffers.sums[:, SumColumn.MEAN], np.inf)
