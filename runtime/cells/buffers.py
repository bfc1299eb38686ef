"""Define the arrays that a kernel fills, cell by cell."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from synchain.codegen.driver.columns import COUNTS, TOLERANCES, Count, PointColumn, SumColumn

from ..support.status import Status

FINISHED = int(Status.FINISHED)  # `Status.FINISHED` as a number: NumPy compares with it three times as fast
IN_MEMORY = 10**9  # size of the largest result in memory, in numbers (8 GB): a choice


def numbers_of_a_cell(dimension: int, room: int, samples: int, observed: int = 0, point_size: int | None = None) -> int:
    """Return the size of the buffers of one cell; the arguments are those of `Buffers.empty`."""
    point_size = dimension if point_size is None else point_size
    return dimension * (1 + samples) + (PointColumn.STATE + point_size) * room + len(SumColumn) + observed + COUNTS


@dataclass(slots=True)
class Buffers:
    """The arrays that a kernel fills, one row for each cell."""

    end: np.ndarray  # (cells, dimension): states at which the cells stopped
    # (cells, len(SumColumn) + observed): synchronisation errors, the time at which each cell stopped, observables
    sums: np.ndarray
    counts: np.ndarray  # (cells, COUNTS): status, steps, numbers of section points, and tolerances
    # (cells, room, 1 + point_size): time and state of each section point, or time, number of the section and the values
    # that
    # the section keeps; NaN after the last point of a cell
    points: np.ndarray
    samples: np.ndarray  # (cells, samples, dimension): states at equally spaced times of the window
    # (cells, any): lanes of cells that paused or have steps that underflow; empty if no cell continues
    lanes: np.ndarray = field(default_factory=lambda: np.empty((0, 0)))

    @classmethod
    def empty(
        cls, cells: int, dimension: int, room: int, samples: int, observed: int = 0, point_size: int | None = None
    ) -> Buffers:
        """Return buffers of cells that have not run, filled with NaN and counts of 0."""
        # `point_size`: numbers of a section point; by default the dimension.
        point_size = dimension if point_size is None else point_size
        return cls(
            end=np.full((cells, dimension), np.nan),
            sums=np.full((cells, len(SumColumn) + observed), np.nan),
            counts=np.zeros((cells, COUNTS), np.int64),
            points=np.full((cells, room, PointColumn.STATE + point_size), np.nan),
            samples=np.full((cells, samples, dimension), np.nan),
        )

    def arrays(self) -> tuple[np.ndarray, ...]:
        """The arrays in the order of the kernel's arguments."""
        return self.end, self.sums, self.counts, self.points, self.samples, self.lanes

    @property
    def status(self) -> np.ndarray:
        return self.counts[:, Count.STATUS]

    @property
    def tolerances(self) -> np.ndarray:
        """Relative and absolute tolerance (cells, 2) with which each cell was integrated; a view of `counts`."""
        return self.counts[:, TOLERANCES].view(np.float64)

    @property
    def steps(self) -> np.ndarray:
        return np.asarray(self.counts[:, Count.ACCEPTED] + self.counts[:, Count.REJECTED])

    def take(self, cells: np.ndarray) -> Buffers:
        lanes = self.lanes[cells] if len(self.lanes) else self.lanes
        return Buffers(
            self.end[cells], self.sums[cells], self.counts[cells], self.points[cells], self.samples[cells], lanes
        )

    @property
    def finished(self) -> np.ndarray:
        """True for each cell (cells,) that reached the end of its window."""
        return np.asarray(self.status == FINISHED)

    @property
    def ended(self) -> bool:
        """True if every cell has ended, even with an error; False if a cell did not run or was interrupted."""
        return not bool(np.isin(self.status, (Status.NOT_RUN, Status.INTERRUPTED)).any())

    @property
    def point_counts(self) -> np.ndarray:
        return self.counts[:, Count.POINTS]

    @property
    def most_points(self) -> int:
        return int(self.point_counts.max(initial=0))

    def widen(self, room: int) -> None:
        """Enlarge the buffers to `room` section points of each cell, if they are smaller."""
        old = self.points.shape[1]
        if room > old:
            points = np.full((len(self.points), room, self.points.shape[2]), np.nan)
            points[:, :old] = self.points
            self.points = points

    def put(self, cells: np.ndarray, part: Buffers) -> None:
        """Copy the rows of `part` into the rows `cells`; enlarge the buffers of section points if necessary."""
        self.widen(part.points.shape[1])
        self.points[cells, : part.points.shape[1]] = part.points
        self.end[cells], self.sums[cells] = part.end, part.sums
        self.counts[cells], self.samples[cells] = part.counts, part.samples
        if len(self.lanes):
            self.lanes[cells] = part.lanes

    def clear(self, cells: np.ndarray) -> None:
        """Reset cells (numbers or a mask) to the state before they run."""
        for array in (self.end, self.sums, self.points, self.samples):
            array[cells] = np.nan
        self.counts[cells] = 0
