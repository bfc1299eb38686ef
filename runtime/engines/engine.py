"""Define the interface between a sweep and the code that integrates its cells."""

from __future__ import annotations

from typing import Protocol

from ..cells.buffers import Buffers
from ..cells.plan import CellRows


class Engine(Protocol):
    """Integrate cells that come as rows of numbers."""

    # A sweep lays out its cells as rows, an engine integrates the rows into buffers, and a result labels the buffers.
    # `LadderEngine` runs the compiled kernels of this package. A solver of another package needs these two methods.

    def run(self, rows: CellRows) -> Buffers:
        """Integrate each row from `rows.start`, at time 0, to the time `rows.spans[:, SpanColumn.END]`."""
        # The parameters `rows.numbers` are in the order of `Equations.parameters`. The buffers contain, in the order of
        # the rows, status, numbers of steps, time and state at the end, and the records of the scene. The result of a
        # cell must depend on its row alone: blocks come in any order, and several threads may call at once.

    def cancel(self) -> None:
        """End the runs of all threads soon; unfinished cells have the status `Status.INTERRUPTED`."""
