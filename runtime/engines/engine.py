"""The seam between a sweep and the code that integrates its cells."""

from __future__ import annotations

from typing import Protocol

from ..cells.buffers import Buffers
from ..cells.plan import CellRows


class Engine(Protocol):
    """Integrate cells that come as rows of numbers.

    A sweep lays out its cells as rows, an engine integrates the rows into buffers, and the results label the buffers.
    `LadderEngine` runs the compiled kernels of this package; a solver of another package takes its place with two methods.
    """

    def run(self, rows: CellRows) -> Buffers:
        """Integrate each row from `rows.start`, at time 0, to the time `rows.spans[:, SpanColumn.END]`.

        The parameters `rows.numbers` are in the order of `Equations.parameters`.  The buffers have the cells in the order of
        the rows: status, numbers of steps, the time and the state at the end, and what the scene records.  The result of a
        cell depends on its row alone: blocks come in any order, and several threads may call at once.
        """

    def cancel(self) -> None:
        """End the runs of all threads soon; unfinished cells have the status `Status.INTERRUPTED`."""
