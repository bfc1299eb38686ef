"""Options of a call: threads or an executor, and reports of progress."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass, field

from synchain.models.inputs.checks import check_callable, check_flag, check_instance

from .progress import Hook, Reporter
from .threads import worker_count


@dataclass(frozen=True, slots=True)
class Execution:
    """Checked options of a call: threads or an executor, and reports of progress."""

    workers: int | None = None  # number of threads (default: all cores)
    executor: Executor | None = None  # runs the blocks in place of threads (docs/scale.md)
    # whether to show a bar; by default a bar on terminals and in notebooks, a line a minute elsewhere
    show_progress: bool | None = None
    progress: Hook | None = None  # is called with a `Progress` after each block of cells, periods or values
    size: int = field(init=False)  # blocks that run at a time

    def __post_init__(self) -> None:
        if self.progress is not None:
            check_callable("progress", self.progress)
        if self.show_progress is not None:
            check_flag("show_progress", self.show_progress)
        if self.executor is not None:
            expected = "a concurrent.futures.Executor, e.g. ProcessPoolExecutor(2)"
            check_instance("executor", self.executor, Executor, expected)
        object.__setattr__(self, "size", _size(self.executor, self.workers))

    def reporter(self, total: float, unit: str = "cell") -> Reporter:
        """Return a reporter for a number of cells, periods or values; the clock of the reporter starts now."""
        return Reporter(total, self.show_progress, self.progress, unit)


def _size(executor: Executor | None, workers: int | None) -> int:
    """Return how many blocks run at a time: `workers`, else the size of the executor, else all cores."""
    if executor is None or workers is not None:
        return worker_count(workers)
    client = getattr(executor, "_client", None)  # of dask.distributed
    if client is not None:
        return max(1, int(sum(client.nthreads().values())))
    count = getattr(executor, "_max_workers", 0) or getattr(executor, "num_workers", 0) or worker_count(None)
    return max(1, int(count))
