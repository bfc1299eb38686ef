"""Workers for the blocks of a sweep: threads of this process, or any `concurrent.futures.Executor`."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any

import numpy as np

from synchain.models.inputs.checks import instance

from ..cells.buffers import Buffers
from ..support.threads import worker_count
from .job import RowsJob, Start, SweepJob, forget, run_block

__all__ = ["Task", "WorkerPool", "feed", "pool_size", "worker_lost"]

LOOK = 0.2
"""Seconds after which somebody who waits for a block looks whether Ctrl-C was pressed."""

ELSEWHERE = ("distributed", "dask", "tornado", "mpi4py")
"""Packages whose errors say that workers or the way to them are gone."""


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """Cells (numbers) of a block to run; `start` in place of the scene's, `near` as in `SweepJob.run`."""

    block: int
    cells: np.ndarray
    start: Start | None = None
    near: np.ndarray | None = None


class WorkerPool:
    """Workers and the sweep that they work on; `limit` tasks are with them at a time, two for each."""

    def __init__(self, shop: SweepJob | RowsJob, executor: Executor | None, workers: int) -> None:
        self.shop = shop
        self.limit = 2 * workers
        self.executor = ThreadPoolExecutor(workers) if executor is None else executor
        self.owned = executor is None
        # interpreters of one process are a kind of threads to the library, but share nothing
        kinds = {kind.__name__ for kind in type(self.executor).__mro__}
        self.shared = "ThreadPoolExecutor" in kinds and "InterpreterPoolExecutor" not in kinds
        self.key = uuid.uuid4().hex
        self.recipe = b"" if self.shared else shop.recipe.packed()
        self.sent = 0

    def submit(self, task: Task, introduce: bool = False) -> Future[Any]:
        """Give a task to a worker; the first ones, and where asked for, with the recipe."""
        block = (task.cells, task.start, task.near)
        if self.shared:
            return self.executor.submit(self.shop.run, *block)
        introduce = introduce or self.sent < self.limit
        self.sent += 1
        return self.executor.submit(run_block, self.key, self.recipe if introduce else None, *block)

    def cancel(self) -> None:
        """End what runs in this process."""
        self.shop.cancel()
        forget(self.key)

    def close(self) -> None:
        """Let our own threads go; an executor that was given stays open."""
        forget(self.key)
        if self.owned:
            self.executor.shutdown(wait=True, cancel_futures=True)


def pool_size(executor: Executor | None, workers: int | None) -> int:
    """How many blocks can run at a time: as given, else as far as the executor tells, else all cores."""
    if executor is not None:
        instance("executor", executor, Executor, "a concurrent.futures.Executor, e.g. ProcessPoolExecutor(2)")
    if executor is None or workers is not None:
        return worker_count(workers)
    client = getattr(executor, "_client", None)  # of dask.distributed
    if client is not None:
        return max(1, sum(client.nthreads().values()))
    return max(
        1, int(getattr(executor, "_max_workers", 0) or getattr(executor, "num_workers", 0) or worker_count(None))
    )


def feed(crew: WorkerPool, tasks: Iterator[Task], finish: Callable[[Task, Buffers], Task | None]) -> None:
    """Run the tasks and those that `finish` adds; on Ctrl-C the blocks in flight are finished first where that can be.

    A second Ctrl-C leaves them.  Raises what a worker raised.
    """
    arrived: SimpleQueue[Future[Any]] = SimpleQueue()
    flying: dict[Future[Any], Task] = {}

    def send(task: Task, introduce: bool = False) -> None:
        future = crew.submit(task, introduce)
        flying[future] = task
        future.add_done_callback(arrived.put)

    try:
        _fill(crew, flying, tasks, send)
        while flying:
            future = _next(arrived)
            made = future.result()
            task = flying.pop(future)
            more = None if made is None else finish(task, made)
            if made is None:
                send(task, introduce=True)
            elif more is not None:
                send(more)
            _fill(crew, flying, tasks, send)
    except BaseException as problem:
        crew.cancel()
        waited = [future for future in flying if not future.cancel()]
        if isinstance(problem, KeyboardInterrupt) and not worker_lost(problem):
            _drain(waited, flying, finish)
        raise


def _fill(
    crew: WorkerPool, flying: dict[Future[Any], Task], tasks: Iterable[Task], send: Callable[[Task], None]
) -> None:
    while len(flying) < crew.limit:
        task = next(iter(tasks), None)
        if task is None:
            return
        send(task)


def _next(arrived: SimpleQueue[Future[Any]]) -> Future[Any]:
    while True:
        with suppress(Empty):
            return arrived.get(timeout=LOOK)


def _drain(
    waited: list[Future[Any]], flying: dict[Future[Any], Task], finish: Callable[[Task, Buffers], Task | None]
) -> None:
    """Wait for the blocks that are being run and keep them; whatever happened to the others is not asked for."""
    for future in waited:
        while not future.done():
            with suppress(TimeoutError):
                future.exception(timeout=LOOK)
        if not future.cancelled() and future.exception() is None and future.result() is not None:
            finish(flying[future], future.result())


def worker_lost(problem: BaseException) -> bool:
    """True where an error says that a worker, or the way to it, is gone."""
    return isinstance(problem, BrokenExecutor | CancelledError) or type(problem).__module__.split(".")[0] in ELSEWHERE
