"""The arrays that a kernel fills, cell by cell."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from synchain.codegen.driver.columns import COUNTS, TOLERANCES, Count, PointColumn, SumColumn

from ..support.status import Status

IN_MEMORY = 10**9
"""Numbers of the largest result that is kept in memory, 8 GB."""


def numbers_of_a_cell(dimension: int, room: int, samples: int, observed: int = 0, kept: int | None = None) -> int:
    """Return how many numbers the buffers hold for each cell; the arguments are those of `Buffers.empty`."""
    kept = dimension if kept is None else kept
    return dimension * (1 + samples) + (PointColumn.STATE + kept) * room + len(SumColumn) + observed + COUNTS


@dataclass(slots=True)
class Buffers:
    """The arrays that a kernel fills, one row for each cell; the docstring of `drive` in a kernel
    describes them.
    """

    end: np.ndarray  # (cells, dimension): states at which the cells stopped
    # (cells, len(SumColumn)): synchronisation errors, the time at which each cell stopped, and what was observed
    sums: np.ndarray
    counts: np.ndarray  # (cells, COUNTS): status, steps, numbers of section points, and tolerances
    # (cells, room, 1 + kept): time and state of the section points, or time, number of the section and what it keeps;
    # NaN if a cell has fewer
    points: np.ndarray
    samples: np.ndarray  # (cells, samples, dimension): states at equally spaced times of the window
    # (cells, any): what the lanes of cells held that paused or whose steps underflow; empty if no cell goes on from
    # there
    lanes: np.ndarray = field(default_factory=lambda: np.empty((0, 0)))

    @classmethod
    def empty(
        cls, cells: int, dimension: int, room: int, samples: int, observed: int = 0, kept: int | None = None
    ) -> Buffers:
        """Return buffers of cells that have not run: numbers NaN, counts zero."""
        kept = dimension if kept is None else kept
        return cls(
            end=np.full((cells, dimension), np.nan),
            sums=np.full((cells, len(SumColumn) + observed), np.nan),
            counts=np.zeros((cells, COUNTS), np.int64),
            points=np.full((cells, room, PointColumn.STATE + kept), np.nan),
            samples=np.full((cells, samples, dimension), np.nan),
        )

    def arrays(self) -> tuple[np.ndarray, ...]:
        """The arrays in the order of the kernel's arguments."""
        return self.end, self.sums, self.counts, self.points, self.samples, self.lanes

    @property
    def status(self) -> np.ndarray:
        """Status (cells,) of each cell; a view of `counts`."""
        return self.counts[:, Count.STATUS]

    @property
    def tolerances(self) -> np.ndarray:
        """Relative and absolute tolerance (cells, 2) with which each cell was integrated; a view of `counts`."""
        return self.counts[:, TOLERANCES].view(np.float64)

    @property
    def steps(self) -> np.ndarray:
        """Accepted and rejected steps (cells,) of each cell."""
        return np.asarray(self.counts[:, Count.ACCEPTED] + self.counts[:, Count.REJECTED])

    def take(self, cells: np.ndarray) -> Buffers:
        """Return copies of the rows of some cells."""
        lanes = self.lanes[cells] if len(self.lanes) else self.lanes
        return Buffers(
            self.end[cells], self.sums[cells], self.counts[cells], self.points[cells], self.samples[cells], lanes
        )

    @property
    def finished(self) -> np.ndarray:
        """True for each cell (cells,) that reached the end of its window."""
        return np.asarray(self.status == Status.FINISHED)

    @property
    def ended(self) -> bool:
        """True if every cell came to its end, good or bad; False if one did not run or was
        interrupted.
        """
        return not bool(np.isin(self.status, (Status.NOT_RUN, Status.INTERRUPTED)).any())

    @property
    def point_counts(self) -> np.ndarray:
        """Number of section points of each cell (cells,)."""
        return self.counts[:, Count.POINTS]

    @property
    def most_points(self) -> int:
        """Number of section points of the cell that has most."""
        return int(self.point_counts.max(initial=0))

    def widen(self, room: int) -> None:
        """Make room for so many section points of each cell, if there is less."""
        old = self.points.shape[1]
        if room > old:
            points = np.full((len(self.points), room, self.points.shape[2]), np.nan)
            points[:, :old] = self.points
            self.points = points

    def put(self, cells: np.ndarray, part: Buffers) -> None:
        """Copy the rows of `part` into the rows `cells`, whose room for section points grows if it
        has to.
        """
        self.widen(part.points.shape[1])
        self.points[cells, : part.points.shape[1]] = part.points
        self.end[cells], self.sums[cells] = part.end, part.sums
        self.counts[cells], self.samples[cells] = part.counts, part.samples
        if len(self.lanes):
            self.lanes[cells] = part.lanes

    def clear(self, cells: np.ndarray) -> None:
        """Set cells (numbers or a mask) back to the state in which they have not run."""
        for array in (self.end, self.sums, self.points, self.samples):
            array[cells] = np.nan
        self.counts[cells] = 0
