"""Run the blocks of a job on workers: threads of this process, or any `concurrent.futures.Executor`."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from queue import Empty, SimpleQueue

import numpy as np

from ..cells.buffers import Buffers
from ..engines.job import Job
from ..support.execution import Execution
from .worker import forget, run_block

LOOK = 0.2  # seconds between two checks for Ctrl-C while waiting for a block: a choice below what a user notices


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """A block to run: its number, the numbers of its cells, and the arguments of `Job.run`."""

    block: int
    cells: np.ndarray
    arguments: tuple[object, ...]


# A task that was sent to a worker; the result is None if the worker has not yet received the job.
Running = Future[Buffers | None]
# Store the results of a task; return the task that waited for it, or None.
Finish = Callable[[Task, Buffers], Task | None]


class WorkerPool:
    """Workers and their job; at most `limit` tasks, two per worker, are in flight."""

    def __init__(self, job: Job, execution: Execution) -> None:
        self.job = job
        self.limit = 2 * execution.size
        self.owned = execution.executor is None
        self.executor = ThreadPoolExecutor(execution.size) if execution.executor is None else execution.executor
        # InterpreterPoolExecutor inherits ThreadPoolExecutor, but its interpreters share no memory.
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
        """Run the tasks, and the tasks that `finish` returns; raise the error of a worker."""
        # On Ctrl-C, finish the blocks in flight first if possible; a second Ctrl-C abandons these blocks.
        arrived: SimpleQueue[Running] = SimpleQueue()
        flying: dict[Running, Task] = {}

        def send(task: Task, introduce: bool = False) -> None:
            future = self.submit(task, introduce)
            flying[future] = task
            future.add_done_callback(arrived.put)

        try:
            self._fill(flying, tasks, send)
            while flying:
                # A wait without a timeout would block Ctrl-C on some systems.
                try:
                    future = arrived.get(timeout=LOOK)
                except Empty:
                    continue
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
            running = [future for future in flying if not future.cancel()]
            if isinstance(problem, KeyboardInterrupt):
                # Store the running blocks that still succeed.
                for future in running:
                    while not future.done():
                        with suppress(TimeoutError):
                            future.exception(timeout=LOOK)
                    succeeded = not future.cancelled() and future.exception() is None
                    if succeeded and (buffers := future.result()) is not None:
                        finish(flying[future], buffers)
            raise

    def submit(self, task: Task, introduce: bool = False) -> Running:
        """Send a task to a worker; add the specification of the job to the first tasks, and with `introduce`."""
        if self.shared:
            return self.executor.submit(self.job.run, *task.arguments)
        introduce = introduce or self.sent < self.limit
        self.sent += 1
        return self.executor.submit(run_block, self.key, self.spec if introduce else None, *task.arguments)

    def cancel(self) -> None:
        self.job.cancel()
        forget(self.key)

    def close(self) -> None:
        """Shut down the threads of the pool; an executor of the caller stays open."""
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
