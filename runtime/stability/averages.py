"""Averages over batches of a long run, with their standard errors."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

__all__ = ["Batches"]

BATCHES = 64
"""Most batches that are kept."""


@dataclass(slots=True)
class Batches:
    """Means of growth rates over batches of blocks.

    When BATCHES batches are full, they are joined in pairs, so that memory does not grow.

    Parameters
    ----------
    length : float
        Length of one block in units of non-dimensional time.
    blocks : int
        Number of blocks so far.
    per_batch : int
        Number of blocks in a batch.
    sums : list of ndarray, shape (starts, m)
        Growth over each batch.
    due : bool
        True if enough new batches are complete for another check of the error.

    References
    ----------
    Flyvbjerg & Petersen, J. Chem. Phys. 91, 461 (1989).
    """

    length: float
    blocks: int = 0
    per_batch: int = 1
    sums: list[np.ndarray] = field(default_factory=list)
    due: bool = False

    def add(self, growth: np.ndarray) -> None:
        """Add the growth over one more block.

        Parameters
        ----------
        growth : ndarray, shape (starts, m)
            Logarithm of the growth of each deviation over the block.
        """
        if self.blocks % self.per_batch == 0:
            if len(self.sums) == BATCHES:
                self.sums = [a + b for a, b in zip(self.sums[::2], self.sums[1::2], strict=True)]
                self.per_batch *= 2
            self.sums.append(np.zeros_like(growth))
        self.sums[-1] += growth
        self.blocks += 1
        self.due = self.blocks % self.per_batch == 0 and self.blocks >= BATCHES and len(self.sums) % 8 == 0

    def mean(self) -> np.ndarray:
        """Return the growth per unit of time, an ndarray of shape (starts, m)."""
        return np.asarray(np.sum(self.sums, axis=0) / (self.blocks * self.length))

    def error_by_start(self) -> np.ndarray:
        """Estimate the standard error of each start.

        Returns
        -------
        ndarray, shape (starts, m)
            The largest estimate from the batches alone, joined in twos and joined in fours; inf if
            there is a single batch.
        """
        rates = np.array(self.sums[: self.blocks // self.per_batch]) / (self.per_batch * self.length)
        estimates = []
        for join in (1, 2, 4):
            count = len(rates) // join
            if count >= 8 or join == 1:
                means = rates[: count * join].reshape(count, join, *rates.shape[1:]).mean(axis=1)
                estimates.append(
                    means.std(axis=0, ddof=1) / math.sqrt(count) if count > 1 else np.full(means[0].shape, np.inf)
                )
        return np.asarray(np.max(estimates, axis=0))

    def error(self) -> np.ndarray:
        """Return the standard error of the mean over the starts, an ndarray of shape (m,)."""
        each = self.error_by_start()
        return np.asarray(np.sqrt((each**2).sum(axis=0)) / len(each))
