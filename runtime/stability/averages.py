"""Averages over batches of a long run, with their standard errors."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from scipy.special import ndtr, stdtrit

from synchain.models.inputs.checks import check_integer, check_number, check_positive

from ..support.execution import Execution
from ..support.progress import Reporter

__all__ = ["SLACK", "TRIED", "Averaging", "Batches", "check_whole", "error_of_steps", "errors_for"]

BATCHES = 64
"""Most batches that are kept."""
CHECKED = 8
"""Fewest batches between two checks of the error."""
FEWEST, MOST = 3, 16
"""Fewest degrees of freedom of an error that is known, and most that are used."""
NARROW = 0.2
"""Degrees of freedom are NARROW n^(2/3) after n periods.

Lazarus et al. take 0.4 for noise that is correlated over a few samples; chaos is over several periods.
"""
ALL = slice(None)
SLACK, TRIED = 4.0, 8
"""How many times the tolerance the growth over a block is compared with, and over how many blocks."""


@dataclass(frozen=True, slots=True)
class Averaging:
    """How long to average along an orbit; checked.

    Parameters
    ----------
    precision : float
        The average ends if every standard error is below this value.
    periods : float
        Longest average, in periods of the drive, or in mean return times of undriven motion; a whole number.
    transient : float
        Transient before the average, in the same units; a whole number.
    seed : int
        Seed of what is drawn at random before the orbit begins.
    execution : Execution
        Who does the work, and who hears how many periods are done.

    Raises
    ------
    TypeError, ValueError
        If a number is none, too small, or not whole.
    """

    precision: float
    periods: float
    transient: float
    seed: int
    execution: Execution

    def __post_init__(self) -> None:
        object.__setattr__(self, "precision", check_number("precision", self.precision, 0.0))
        object.__setattr__(self, "periods", check_whole("periods", check_positive("periods", self.periods)))
        object.__setattr__(self, "transient", check_whole("transient", check_number("transient", self.transient, 0.0)))
        object.__setattr__(self, "seed", check_integer("seed", self.seed, 0))

    def reporter(self, orbits: int = 1) -> Reporter:
        """Return the reporter of the transients and the longest averages along orbits in turn; its time begins now."""
        return self.execution.reporter(round(orbits * (self.transient + self.periods)), "period")

    def rounds(self, batches: Batches, error: Callable[[], np.ndarray | float], reporter: Reporter) -> Iterator[int]:
        """Yield how many blocks are left until the average is long or precise enough; one of them at least must be added.

        Parameters
        ----------
        batches : Batches
            The average.
        error : callable
            Returns the standard errors that must become small, or the largest, or another one that is too large.
        reporter : Reporter
            Counts the periods.
        """
        while batches.periods < self.periods:
            before = batches.blocks
            yield math.ceil(self.periods / batches.block) - before
            reporter.advance(batches.block * (batches.blocks - before))
            if batches.due:
                worst = float(np.max(error(), initial=0.0))
                if worst <= self.precision:
                    return
                batches.defer(worst / self.precision if self.precision else math.inf)


def check_whole(what: str, periods: float) -> float:
    """Return a number of periods; ValueError if it is not whole."""
    if not periods.is_integer():
        raise ValueError(f"{what}: found {periods:g}; expected a whole number of periods")
    return periods


def error_of_steps(
    usual: Sequence[np.ndarray] | np.ndarray, looser: Sequence[np.ndarray] | np.ndarray, length: float
) -> np.ndarray:
    """Return the error of growth rates that is due to the steps: their change at SLACK times the tolerance.

    It is the mean change over single blocks, each from the same state and deviations as the other, with its own standard
    error: chaos makes much of a small difference within a block, at random.

    Parameters
    ----------
    usual, looser : sequence of ndarray
        Growth over each block, with the usual and with the looser tolerance; blocks without growth do not count.
    length : float
        Length of a block in units of non-dimensional time.
    """
    with np.errstate(invalid="ignore"):
        change = np.subtract(usual, looser)
    change[~np.isfinite(change)] = 0.0
    return np.asarray(np.sqrt(change.mean(axis=0) ** 2 + change.var(axis=0) / len(change)) / length)


@dataclass(slots=True)
class Batches:
    """Means of growth rates over batches of blocks, and their standard errors.

    When BATCHES batches are full, they are joined in pairs, so that memory does not grow.

    The error of a mean over a time T is sqrt(S/T), where S is the spectral density of the rate at frequency 0. The
    cosine transform of the batch means has one value for each of the frequencies 1/(2T), 2/(2T) …; the mean of the
    lowest few squares estimates S, with one degree of freedom for each. Their number grows as n^(2/3) with n periods, so
    that the band narrows and correlations of any finite length are seen in the end. Few squares may be small together by
    chance; Student's quantile makes up for it, so that the mean lies within two errors of the truth as often as a
    normal variable, in 95 of 100 runs. An error of fewer than FEWEST squares is unknown: it has no variance.

    Parameters
    ----------
    unit : float
        Length of a period in units of non-dimensional time.
    block : float
        Number of periods of one block.
    blocks : int
        Number of blocks so far.
    per_batch : int
        Number of blocks in a batch.
    sums : ndarray, shape (BATCHES, starts, m)
        Growth over each batch; behind the first `count` nothing that counts.
    count : int
        Number of batches, the last of which may be incomplete.
    enough : int
        Blocks before the next check of the error.
    worst : int
        The strength with the largest error when all were looked at.

    References
    ----------
    Batches joined in pairs: Flyvbjerg & Petersen, J. Chem. Phys. 91, 461 (1989). Cosine transform and Student's
    distribution: Müller, J. Econometrics 141, 1331 (2007). Number of frequencies: Lazarus, Lewis, Stock & Watson, J.
    Bus. Econ. Stat. 36, 541 (2018).
    """

    unit: float
    block: float = 1.0
    blocks: int = 0
    per_batch: int = 1
    sums: np.ndarray = field(default_factory=lambda: np.zeros((BATCHES, 0, 0)))
    count: int = 0
    enough: int = BATCHES
    worst: int = 0

    @property
    def periods(self) -> float:
        """Number of periods averaged over."""
        return self.blocks * self.block

    @property
    def time(self) -> float:
        """Non-dimensional time averaged over."""
        return self.blocks * (self.block * self.unit)

    @property
    def freedom(self) -> int:
        """Degrees of freedom of the standard errors: NARROW n^(2/3) after n periods, within what the batches allow."""
        return min(round(NARROW * self.periods ** (2.0 / 3.0)), MOST, self.blocks // self.per_batch - 1)

    @property
    def due(self) -> bool:
        """True if enough new batches are complete for another check of the error."""
        return self._due(self.blocks, self.count, self.per_batch)

    def _due(self, blocks: int, count: int, per_batch: int) -> bool:
        return blocks >= self.enough and blocks % per_batch == 0 and count % CHECKED == 0

    def defer(self, ratio: float) -> None:
        """Put off the next check of the error until a quarter of the time is done that it asks for, or twice the present one.

        Parameters
        ----------
        ratio : float
            The largest error over the one that is asked for.
        """
        self.enough = math.ceil(self.blocks * min(2.0, max(1.0, 0.25 * ratio**2)))

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
        blocks, count, per_batch, parts = self.blocks, self.count, self.per_batch, list[int]()
        while most > 0 and not (parts and self._due(blocks, count, per_batch)):
            count, per_batch = _with_room(count, per_batch)
            new = min(most, per_batch * (CHECKED - count % CHECKED))  # no check comes before
            more = -(-new // per_batch)
            parts += [per_batch] * more
            parts[-1] -= per_batch * more - new
            blocks, count, most = blocks + new, count + more, most - new
        return np.array(parts, dtype=np.int64)

    def add(self, growth: np.ndarray) -> None:
        """Add the growth over a further block.

        Parameters
        ----------
        growth : ndarray, shape (starts, m)
            Logarithm of the growth of each deviation.
        """
        if self.blocks % self.per_batch:
            self.sums[self.count - 1] += growth
            self.blocks += 1
        else:
            self.extend(growth[None], np.ones(1, dtype=np.int64))

    def extend(self, growths: np.ndarray, parts: np.ndarray) -> None:
        """Add the growth over further batches, as many blocks in each as `ahead` has said.

        Parameters
        ----------
        growths : ndarray, shape (b, starts, m)
            Logarithm of the growth of each deviation over each batch.
        parts : ndarray of int64, shape (b,)
            Blocks of each batch.
        """
        if self.blocks == 0:
            self.sums = np.empty((BATCHES, *growths.shape[1:]))
        while len(growths):
            full = self.count
            self.count, self.per_batch = _with_room(self.count, self.per_batch)
            if self.count < full:
                self.sums[: self.count] = self.sums[::2] + self.sums[1::2]
            new = min(BATCHES - self.count, len(growths))
            self.sums[self.count : self.count + new] = growths[:new]
            self.count += new
            growths = growths[new:]
        self.blocks += int(parts.sum())

    def mean(self) -> np.ndarray:
        """Return the growth per unit of time, an ndarray of shape (starts, m)."""
        return np.asarray(np.sum(self.sums[: self.count], axis=0) / self.time)

    def error_by_start(self, strengths: slice = ALL) -> np.ndarray:
        """Estimate the standard error of each start: half of what the mean is within in 95 of 100 runs.

        Parameters
        ----------
        strengths : slice
            Which strengths to look at.

        Returns
        -------
        ndarray, shape (starts, strengths)
            The estimates; inf if the average has fewer than FEWEST degrees of freedom; 45 periods have them.
        """
        whole, freedom = self.blocks // self.per_batch, self.freedom
        sums = self.sums[:whole, :, strengths]
        if freedom < FEWEST:
            return np.full(sums.shape[1:], np.inf)
        parts = _waves(freedom, whole) @ sums.reshape(whole, -1)
        length = self.per_batch * self.block * self.unit
        spread = np.sqrt(np.einsum("ij,ij->j", parts, parts) / (freedom * whole))
        return np.asarray(_wide(freedom) / length * spread.reshape(sums.shape[1:]))

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


def _with_room(count: int, per_batch: int) -> tuple[int, int]:
    """How many batches of how many blocks there are when a further one begins: BATCHES are joined in pairs."""
    return (BATCHES // 2, 2 * per_batch) if count == BATCHES else (count, per_batch)


@lru_cache(maxsize=MOST)
def _wide(freedom: int) -> float:
    """Half of Student's quantile by which a mean lies within two errors of the truth as often as a normal variable."""
    return float(stdtrit(freedom, ndtr(2.0)) / 2.0)


def errors_for(gaussian: float, periods: float) -> float:
    """Return how many stated errors of an average over some periods are as certain as so many of a normal variable.

    The few squares of a short average have the long tails of Student's distribution.
    """
    freedom = max(1, min(round(NARROW * periods ** (2.0 / 3.0)), MOST))
    return float(stdtrit(freedom, ndtr(gaussian))) / _wide(freedom)


@lru_cache(maxsize=8)
def _waves(count: int, batches: int) -> np.ndarray:
    """The lowest terms (count, batches) of the orthonormal cosine transform of some batches, but the mean."""
    angles = np.outer(np.arange(1, count + 1), np.arange(batches) + 0.5) * (math.pi / batches)
    return math.sqrt(2.0 / batches) * np.cos(angles)
