"""Errors of a sweep that does not come to its end."""

from __future__ import annotations

from ..results.result import Result


class SweepInterrupted(KeyboardInterrupt):
    """Ctrl-C during a sweep; `finished` of `cells` had finished, `result` holds them if no file
    does.
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
    """A worker or the disk has failed; `finished` of `cells` had finished, `result` holds them if
    no file does.
    """

    def __init__(self, reason: str, finished: int, cells: int, result: Result | None = None) -> None:
        super().__init__(f"{reason}; {finished} of {cells} cells had finished")
        self.reason, self.finished, self.cells, self.result = reason, finished, cells, result
