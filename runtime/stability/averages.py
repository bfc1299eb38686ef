"""Averages over batches of a long run, with their standard error."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

__all__ = ["Batches"]

BATCHES = 64


@dataclass(slots=True)
class Batches:
    """Means over batches of blocks; when BATCHES of them are full they are joined in pairs, so memory does not grow."""

    length: float
    blocks: int = 0
    per_batch: int = 1
    sums: list[np.ndarray] = field(default_factory=list)
    due: bool = False

    def add(self, growth: np.ndarray) -> None:
        """Take the growth (starts, m) over one more block."""
        if self.blocks % self.per_batch == 0:
            if len(self.sums) == BATCHES:
                self.sums = [a + b for a, b in zip(self.sums[::2], self.sums[1::2], strict=True)]
                self.per_batch *= 2
            self.sums.append(np.zeros_like(growth))
        self.sums[-1] += growth
        self.blocks += 1
        self.due = self.blocks % self.per_batch == 0 and self.blocks >= BATCHES and len(self.sums) % 8 == 0

    def mean(self) -> np.ndarray:
        """Growth per unit of time (starts, m)."""
        return np.asarray(np.sum(self.sums, axis=0) / (self.blocks * self.length))

    def error_by_start(self) -> np.ndarray:
        """Standard errors (starts, m): the largest over batches as they are, joined in twos and in fours."""
        rates = np.array(self.sums[: self.blocks // self.per_batch]) / (self.per_batch * self.length)
        found = []
        for join in (1, 2, 4):
            count = len(rates) // join
            if count >= 8 or join == 1:
                means = rates[: count * join].reshape(count, join, *rates.shape[1:]).mean(axis=1)
                found.append(
                    means.std(axis=0, ddof=1) / math.sqrt(count) if count > 1 else np.full(means[0].shape, np.inf)
                )
        return np.asarray(np.max(found, axis=0))

    def error(self) -> np.ndarray:
        """Standard error (m,) of the mean over the starts."""
        each = self.error_by_start()
        return np.asarray(np.sqrt((each**2).sum(axis=0)) / len(each))
