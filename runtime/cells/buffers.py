"""The arrays that a kernel fills, cell by cell."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["Buffers"]

SUMS, COUNTS = 4, 6
"""Columns of the numbers and of the counts that a kernel writes for each cell."""


@dataclass(slots=True)
class Buffers:
    """What the kernel fills, one row for each cell; see the docstring of `drive` in any kernel."""

    end: np.ndarray
    sums: np.ndarray
    counts: np.ndarray
    points: np.ndarray
    samples: np.ndarray

    @classmethod
    def empty(cls, cells: int, dimension: int, room: int, samples: int) -> Buffers:
        """Buffers in which nothing has run: numbers NaN, counts zero."""
        return cls(
            end=np.full((cells, dimension), np.nan),
            sums=np.full((cells, SUMS), np.nan),
            counts=np.zeros((cells, COUNTS), np.int64),
            points=np.full((cells, room, dimension + 1), np.nan),
            samples=np.full((cells, samples, dimension), np.nan),
        )

    def arrays(self) -> tuple[np.ndarray, ...]:
        """In the order of the kernel's arguments."""
        return self.end, self.sums, self.counts, self.points, self.samples
