"""Averages over batches of a long run, with their standard errors."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from synchain.models.inputs.checks import check_integer, check_number, check_positive

from ..support.execution import Execution
from ..support.progress import Reporter

__all__ = ["Averaging", "Batches"]

BATCHES = 64
"""Most batches that are kept."""
CHECKED = 8
"""Batches between two checks of the error."""
ALL = slice(None)


@dataclass(frozen=True, slots=True)
class Averaging:
    """How long to average along an orbit; checked.

    Parameters
    ----------
    precision : float
        The average ends if every standard error is below this value.
    periods : float
        Longest average, in periods of the drive, or in units of 2 pi if there is none.
    transient : float
        Transient before the average, in the same units.
    seed : int
        Seed of what is drawn at random before the orbit begins.
    execution : Execution
        Who does the work, and who hears how many periods are done.
    """

    precision: float
    periods: float
    transient: float
    seed: int
    execution: Execution

    def __post_init__(self) -> None:
        object.__setattr__(self, "precision", check_number("precision", self.precision, 0.0))
        object.__setattr__(self, "periods", check_positive("periods", self.periods))
        object.__setattr__(self, "transient", check_number("transient", self.transient, 0.0))
        object.__setattr__(self, "seed", check_integer("seed", self.seed, 0))

    def reporter(self, orbits: int = 1) -> Reporter:
        """Return the reporter of the transients and the longest averages along orbits in turn; its time begins now."""
        return self.execution.reporter(orbits * (round(self.transient) + math.ceil(self.periods)), "period")

    def rounds(
        self, batches: Batches, step: float, error: Callable[[], np.ndarray | float], reporter: Reporter
    ) -> Iterator[int]:
        """Yield how many blocks are left until the average is long or precise enough; one of them at least must be added.

        Parameters
        ----------
        batches : Batches
            The average.
        step : float
            Length of a block in periods.
        error : callable
            Returns the standard errors that must become small, or the largest.
        reporter : Reporter
            Counts the periods.
        """
        while batches.blocks * step < self.periods:
            before = batches.blocks
            yield max(1, math.ceil(self.periods / step) - before)
            reporter.advance(step * (batches.blocks - before))
            if batches.due and np.all(error() <= self.precision):
                return


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
    sums : ndarray, shape (BATCHES, starts, m)
        Growth over each batch; behind the first `count` nothing that counts.
    count : int
        Number of batches, the last of which may be incomplete.
    due : bool
        True if enough new batches are complete for another check of the error.
    worst : int
        The strength with the largest error when all were looked at.

    References
    ----------
    Flyvbjerg & Petersen, J. Chem. Phys. 91, 461 (1989).
    """

    length: float
    blocks: int = 0
    per_batch: int = 1
    sums: np.ndarray = field(default_factory=lambda: np.zeros((BATCHES, 0, 0)))
    count: int = 0
    due: bool = False
    worst: int = 0

    def ahead(self, most: int) -> np.ndarray:
        """Return the blocks of the batches until the error is due.

        Parameters
        ----------
        most : int
            Most blocks of all of them.

        Returns
        -------
        ndarray of int64, shape (batches,)
            The last batch may stay incomplete.
        """
        full = self.count == BATCHES
        length, known = (2 * self.per_batch, BATCHES // 2) if full else (self.per_batch, self.count)
        count = BATCHES - known if self.blocks < BATCHES else CHECKED - known % CHECKED
        whole, rest = divmod(min(most, count * length), length)
        return np.array([length] * whole + ([rest] if rest else []), dtype=np.int64)

    def add(self, growth: np.ndarray, blocks: int = 1) -> None:
        """Add the growth over further blocks of the same batch.

        Parameters
        ----------
        growth : ndarray, shape (starts, m)
            Logarithm of the growth of each deviation over the blocks.
        blocks : int
            Their number.
        """
        if self.blocks == 0:
            self.sums = np.empty((BATCHES, *growth.shape))
        if self.blocks % self.per_batch == 0:
            if self.count == BATCHES:
                self.count, self.per_batch = BATCHES // 2, 2 * self.per_batch
                self.sums[: self.count] = self.sums[::2] + self.sums[1::2]
            self.sums[self.count] = growth
            self.count += 1
        else:
            self.sums[self.count - 1] += growth
        self.blocks += blocks
        self.due = self.blocks % self.per_batch == 0 and self.blocks >= BATCHES and self.count % CHECKED == 0

    def mean(self) -> np.ndarray:
        """Return the growth per unit of time, an ndarray of shape (starts, m)."""
        return np.asarray(np.sum(self.sums[: self.count], axis=0) / (self.blocks * self.length))

    def error_by_start(self, strengths: slice = ALL) -> np.ndarray:
        """Estimate the standard error of each start.

        Parameters
        ----------
        strengths : slice
            Which strengths to look at.

        Returns
        -------
        ndarray, shape (starts, strengths)
            The largest estimate from the batches alone, joined in twos and joined in fours; inf if
            there is a single batch.
        """
        rates = self.sums[: self.blocks // self.per_batch, :, strengths] / (self.per_batch * self.length)
        estimates = []
        for join in (1, 2, 4):
            count = len(rates) // join
            if count >= 8 or join == 1:
                means = rates[: count * join].reshape(count, join, *rates.shape[1:]).mean(axis=1)
                estimates.append(
                    means.std(axis=0, ddof=1) / math.sqrt(count) if count > 1 else np.full(means[0].shape, np.inf)
                )
        return np.asarray(np.max(estimates, axis=0))

    def error(self, strengths: slice = ALL) -> np.ndarray:
        """Return the standard errors (strengths,) of the mean over the starts, as `error_by_start`."""
        each = self.error_by_start(strengths)
        return np.asarray(np.sqrt((each**2).sum(axis=0)) / len(each))

    def largest_error(self, enough: float) -> float:
        """Return the largest standard error, or another one that exceeds `enough`.

        The strength with the largest error the last time is looked at first: a thousand of them take longer than the
        orbit itself.
        """
        first = float(self.error(slice(self.worst, self.worst + 1))[0])
        if not first <= enough:
            return first
        error = self.error()
        self.worst = int(np.argmax(error))
        return float(error[self.worst])
