"""Workers for the blocks of a job: threads of this process, or any `concurrent.futures.Executor`."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from queue import Empty, SimpleQueue

import numpy as np

from ..cells.buffers import Buffers
from ..engines.job import Job
from ..support.execution import Execution
from .worker import forget, run_block

LOOK = 0.2
"""Seconds after which a wait for a block looks whether Ctrl-C was pressed."""

ELSEWHERE = ("distributed", "dask", "tornado", "mpi4py")
"""Packages whose errors say that workers or the way to them are gone."""


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """A block to run: its number, the numbers of its cells, and the arguments of `Job.run`."""

    block: int
    cells: np.ndarray
    arguments: tuple[object, ...]


Running = Future[Buffers | None]
"""A task that is with a worker; None is the answer of one that does not know the job yet."""

Finish = Callable[[Task, Buffers], Task | None]
"""Takes the results of a task; returns the task that has waited for it, if there is one."""


class WorkerPool:
    """Workers and the job that they work on; `limit` tasks are with them at a time, two for each."""

    def __init__(self, job: Job, execution: Execution) -> None:
        self.job = job
        self.limit = 2 * execution.size
        self.owned = execution.executor is None
        self.executor = ThreadPoolExecutor(execution.size) if execution.executor is None else execution.executor
        # interpreters of one process are a kind of threads to the library, but share nothing
        kinds = {kind.__name__ for kind in type(self.executor).__mro__}
        self.shared = "ThreadPoolExecutor" in kinds and "InterpreterPoolExecutor" not in kinds
        self.key = uuid.uuid4().hex
        self.spec = b"" if self.shared else job.spec.packed()
        self.sent = 0

    def __enter__(self) -> WorkerPool:
        return self

    def __exit__(self, *problem: object) -> None:
        self.close()

    def run(self, tasks: Iterator[Task], finish: Finish) -> None:
        """Run the tasks and those that `finish` adds.

        On Ctrl-C the blocks in flight are finished first if that is possible; a second Ctrl-C
        leaves them.  Raises what a worker raised.
        """
        arrived: SimpleQueue[Running] = SimpleQueue()
        flying: dict[Running, Task] = {}

        def send(task: Task, introduce: bool = False) -> None:
            future = self.submit(task, introduce)
            flying[future] = task
            future.add_done_callback(arrived.put)

        try:
            self._fill(flying, tasks, send)
            while flying:
                future = _next(arrived)
                buffers = future.result()
                task = flying.pop(future)
                following = None if buffers is None else finish(task, buffers)
                if buffers is None:
                    send(task, introduce=True)
                elif following is not None:
                    send(following)
                self._fill(flying, tasks, send)
        except BaseException as problem:
            self.cancel()
            waited = [future for future in flying if not future.cancel()]
            if isinstance(problem, KeyboardInterrupt) and not worker_lost(problem):
                _drain(waited, flying, finish)
            raise

    def submit(self, task: Task, introduce: bool = False) -> Running:
        """Give a task to a worker; the first ones, and with `introduce`, come with the
        specification of the job.
        """
        if self.shared:
            return self.executor.submit(self.job.run, *task.arguments)
        introduce = introduce or self.sent < self.limit
        self.sent += 1
        return self.executor.submit(run_block, self.key, self.spec if introduce else None, *task.arguments)

    def cancel(self) -> None:
        """End what runs in this process."""
        self.job.cancel()
        forget(self.key)

    def close(self) -> None:
        """Shut the threads of the pool down; an executor of the caller stays open."""
        forget(self.key)
        if self.owned:
            self.executor.shutdown(wait=True, cancel_futures=True)

    def _fill(self, flying: dict[Running, Task], tasks: Iterable[Task], send: Callable[[Task], None]) -> None:
        """Send tasks until all workers are busy."""
        while len(flying) < self.limit:
            task = next(iter(tasks), None)
            if task is None:
                return
            send(task)


def _next(arrived: SimpleQueue[Running]) -> Running:
    """The next future that is done."""
    while True:
        with suppress(Empty):
            return arrived.get(timeout=LOOK)


def _drain(waited: list[Running], flying: dict[Running, Task], finish: Finish) -> None:
    """Wait for the blocks that are being run and keep those that succeed."""
    for future in waited:
        while not future.done():
            with suppress(TimeoutError):
                future.exception(timeout=LOOK)
        done = not future.cancelled() and future.exception() is None
        if done and (buffers := future.result()) is not None:
            finish(flying[future], buffers)


def worker_lost(problem: BaseException) -> bool:
    """True if an error says that a worker, or the way to it, is gone."""
    return isinstance(problem, BrokenExecutor | CancelledError) or type(problem).__module__.split(".")[0] in ELSEWHERE
