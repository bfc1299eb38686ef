"""Define the errors of a sweep that does not finish."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError
from contextlib import contextmanager

from ..results.result import Result

# An error from one of these packages means that workers, or the connection to workers, are lost.
ELSEWHERE = ("distributed", "dask", "tornado", "mpi4py")


class SweepInterrupted(KeyboardInterrupt):
    """Ctrl-C during a sweep.

    `finished` of `cells` cells had finished, and are in `result` unless a file stores them.

    See Also
    --------
    synchain.stream
    """

    def __init__(self, finished: int, cells: int, result: Result | None = None) -> None:
        super().__init__(f"interrupted with {finished} of {cells} cells finished")
        self.finished, self.cells, self._result = finished, cells, result

    @property
    def result(self) -> Result:
        """The cells that had finished; AttributeError if they are in a file."""
        if self._result is None:
            raise AttributeError("the finished cells are in the file of the run; open it with open_result")
        return self._result


class SweepFailed(RuntimeError):
    """A worker or the disk has failed; `finished` of `cells` cells had finished, and are in `result` or in a file.

    See Also
    --------
    synchain.run
    """

    def __init__(self, reason: str, finished: int, cells: int, result: Result | None = None) -> None:
        super().__init__(f"{reason}; {finished} of {cells} cells had finished")
        self.reason, self.finished, self.cells, self.result = reason, finished, cells, result


def worker_lost(problem: BaseException) -> bool:
    """Return whether an error means that a worker, or the connection to it, is lost."""
    return isinstance(problem, BrokenExecutor | CancelledError) or type(problem).__module__.split(".")[0] in ELSEWHERE


def reason_of(problem: Exception) -> str | None:
    """Return the reason of an error that means lost workers; None for any other error."""
    return f"the workers are lost ({problem})" if worker_lost(problem) else None


@contextmanager
def sweep_errors(
    cells: int,
    finished: Callable[[], tuple[int, Result | None]],
    reason: Callable[[Exception], str | None] = reason_of,
) -> Iterator[None]:
    """Convert Ctrl-C to SweepInterrupted, and errors with a `reason` to SweepFailed, both with the finished cells."""
    try:
        yield
    except KeyboardInterrupt:
        count, result = finished()
        raise SweepInterrupted(count, cells, result) from None
    except Exception as problem:
        text = reason(problem)
        if text is None:
            raise
        count, result = finished()
        raise SweepFailed(text, count, cells, result) from problem
