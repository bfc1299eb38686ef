"""Average over batches of a long run, and estimate the standard errors."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TypeVar

import numpy as np
from scipy.special import ndtr, stdtrit

from synchain.models.inputs.checks import check_number, check_positive, check_seed
from synchain.models.scenes.defaults import TimeUnit
from synchain.models.scenes.scene import Scene

from ..cells.run_keywords import chosen
from ..support.execution import Execution
from ..support.progress import Reporter

BATCHES, TOGETHER = 64, 8
"""BATCHES: most batches in memory. TOGETHER: most batches added in one call; Ctrl-C acts between calls."""
FEWEST, MOST = 2, 8
"""Fewest and most frequencies from which an error is estimated. Each frequency has two degrees of freedom."""
NARROW = 0.1
"""An error is estimated from NARROW n^(2/3) frequencies after n periods.

Lazarus et al. take twice as many, for noise with correlations over a few samples. Correlations of chaotic motion last
several periods.
"""
FIRST, PART = 128, 0.5
"""The errors are first estimated after FIRST periods, and again after the part PART of the length that follows from the
first estimate."""
ROUNDING = 100.0 * float(np.finfo(float).eps)
"""Largest rounding error of a sum, relative to the mean size of its terms (a choice)."""
PRECISION = 1e-3
"""Default standard error of an average, times the unit of time of the motion over 2 pi (a choice)."""
TRANSIENT = 300.0
"""Periods before an average unless a call or the scene says otherwise (a choice)."""
UNCLEAR = 3.0
"""A mean rate below UNCLEAR over the time of growth may belong to growth by a power of time (a choice)."""
TOLERANCE_RATIO, TRIED = 4.0, 8
"""The error of the steps is estimated by repeating TRIED blocks at TOLERANCE_RATIO times the tolerance (a choice)."""


KEYWORDS = {
    "average": """
precision : float, optional
    Averaging stops if every standard error is below this value, per unit of non-dimensional time. By default 1e-3 times
    2 pi over the unit of time of the motion, so that the length of an average does not depend on the unit of time.
periods : float
    Longest average, in periods of the drive, or in mean return times of undriven motion; a whole number.
transient : float, optional
    Transient before the average, in the same units; by default that of the scene if it was given one above 0, else 300.
""",
    "starts": """
starts : int
    Number of initial states: that of the scene's first oscillator, and copies displaced at random in the first
    component by up to 0.4 of the extent of the motion.
rtol : float, optional
    Relative tolerance of the integration; by default that of the scene if it was given one, else 1e-6. The friction law
    may require a smaller one.
rng : int or Generator, optional
    Seed of the displacements, or a NumPy Generator that gives it; by default that of the scene.
workers : int, optional
    Number of threads; all cores by default.
""",
    "progress": """
show_progress : bool, optional
    Whether to show a bar; by default a bar on terminals and in notebooks, a line a minute elsewhere.
progress : callable, optional
    Is called with a `Progress`, which counts periods of the drive.
""",
    "parameters": """
parameters : mapping of str to float, optional
    Parameters of the scene to set, for names that are keywords already.
**more : float
    Parameters of the scene to set.
""",
}
KEYWORDS["orbits"] = "\n".join(KEYWORDS[name].strip() for name in ("average", "starts", "progress"))
"""Descriptions of keywords that are common to several public functions, for their docstrings."""

F = TypeVar("F", bound=Callable[..., object])


def document_keywords(function: F) -> F:
    """Replace `{average}` and other names of KEYWORDS in a docstring by their descriptions."""
    text = inspect.cleandoc(function.__doc__ or "")
    for name, described in KEYWORDS.items():
        text = text.replace(f"{{{name}}}", described.strip())
    function.__doc__ = text
    return function


@dataclass(frozen=True, slots=True)
class Averaging:
    """Settings that determine for how long an orbit is averaged; values are checked."""

    precision: float  # the average ends if every standard error is below this value
    # longest average, in periods of the drive, or in mean return times of undriven motion; a whole number
    periods: float
    transient: float  # transient before the average, in the same units; a whole number
    seed: int  # seed of the random numbers that are drawn before the orbit begins
    execution: Execution  # threads, and where progress is reported
    of_scene: bool = False  # True if the transient is the scene's and counts in the scene's unit of time
    of_motion: bool = False  # True if the precision counts in radians of the motion

    def __post_init__(self) -> None:
        object.__setattr__(self, "precision", check_number("precision", self.precision, 0.0))
        object.__setattr__(self, "periods", check_whole("periods", check_positive("periods", self.periods)))
        object.__setattr__(self, "transient", check_whole("transient", check_number("transient", self.transient, 0.0)))
        object.__setattr__(self, "seed", check_seed("rng", self.seed))

    @classmethod
    def for_scene(
        cls,
        scene: Scene,
        precision: float | None,
        periods: float,
        transient: float | None,
        rng: int | np.random.Generator | None,
        execution: Execution,
    ) -> Averaging:
        """Return the averaging for keywords of a public function; None stands for the scene's `transient` and `rng`."""
        seed = check_seed("rng", chosen(scene, "rng", rng, 0))
        length, of_scene = chosen(scene, "transient", transient, None), False
        if transient is None:
            # a scene without a transient records from its start on; an average needs the attractor
            length, of_scene = (_whole(scene, scene.period or 2.0 * math.pi), True) if length else (TRANSIENT, False)
        error, of_motion = (PRECISION, True) if precision is None else (precision, False)
        return cls(error, periods, length, seed, execution, of_scene, of_motion)

    def in_units(self, scene: Scene, unit: float) -> Averaging:
        """Return the averaging of a motion with this unit of time: the transient in units, the precision per time."""
        transient = _whole(scene, unit) if self.of_scene else self.transient
        precision = self.precision * (2.0 * math.pi / unit) if self.of_motion else self.precision
        return replace(self, transient=transient, precision=precision, of_scene=False, of_motion=False)

    def reporter(self, orbits: int = 1) -> Reporter:
        """Return a progress reporter for `orbits` transients and longest averages; its clock starts now."""
        return self.execution.reporter(orbits * self.length, "period")

    @property
    def length(self) -> int:
        """Return the number of periods of a transient and the longest average together."""
        return round(self.transient + self.periods)

    def rounds(self, batches: Batches, error: Callable[[], np.ndarray], reporter: Reporter) -> Iterator[int]:
        """Yield the number of remaining blocks until the average is precise enough; the caller adds at least one block.

        Triple sampling: the errors after FIRST periods determine half of the length; the errors after this half
        determine the full length. The average ends there if the errors are below `precision`. Otherwise it continues
        for the length that the new errors imply. The errors are estimated only a few times and never below the planned
        error, so that an average does not end because an error is small by chance.

        References
        ----------
        Hall, Ann. Stat. 9, 1229 (1981); the planned error: Stein, Ann. Math. Stat. 16, 243 (1945).
        """
        part = PART
        while batches.periods < self.periods:
            before = batches.blocks
            yield math.ceil(self.periods / batches.block) - before
            reporter.advance(batches.block * (batches.blocks - before))
            # the second estimate may be due at once after the first one
            while batches.due:
                worst = float(np.fmax.reduce(error(), initial=0.0))
                if worst <= self.precision:
                    return
                batches.plan(part * (worst / self.precision) ** 2 if self.precision else math.inf, part == 1.0)
                part = 1.0
        batches.planned = None


def _whole(scene: Scene, unit: float) -> float:
    """Return the scene's transient in units of time of the motion, rounded up to a whole number."""
    length = scene.transient if scene.time_unit == TimeUnit.PERIOD else scene.transient / unit
    return float(math.ceil(length * (1.0 - ROUNDING)))


def check_whole(name: str, periods: float) -> float:
    """Return `periods`; raise ValueError if the number is not whole."""
    if not periods.is_integer():
        raise ValueError(f"{name}: found {periods:g}; expected a whole number of periods")
    return periods


def error_of_steps(
    usual: Sequence[np.ndarray] | np.ndarray, looser: Sequence[np.ndarray] | np.ndarray, length: float
) -> np.ndarray:
    """Return the error of growth rates due to the steps: their change at TOLERANCE_RATIO times the tolerance.

    The change is averaged over single blocks, each repeated from the same state and deviations. Its standard error is
    added, as chaos magnifies a small difference within a block at random.
    """
    with np.errstate(invalid="ignore"):
        change = np.subtract(usual, looser)
    change[~np.isfinite(change)] = 0.0
    return np.asarray(np.sqrt(change.mean(axis=0) ** 2 + change.var(axis=0) / len(change)) / length)


def with_growth_by_powers(mean: np.ndarray, error: np.ndarray, time: float) -> np.ndarray:
    """Return the errors of mean growth rates of deviations that have grown over a time, with that of an exponent 0.

    A neutral deviation grows by a power t**k, or by a bounded factor, so that its mean rate is k/time or less. A mean
    of this size is no certain exponent: its error is at least its size.
    """
    return np.where(np.abs(mean) * time < UNCLEAR, np.maximum(error, np.abs(mean)), error)


@dataclass(slots=True)
class Batches:
    """Compute means of growth rates over batches of blocks, and their standard errors.

    If there are BATCHES batches, they are joined in pairs, so that memory does not grow.

    The error of a mean over a time T is sqrt(S/T), where S is the spectral density of the rate at frequency 0. S is
    estimated by the periodogram of the batch means at the lowest few of the frequencies 1/T, 2/T …, with two degrees of
    freedom for each frequency. The number of frequencies grows as n^(2/3) with n periods. The highest of them therefore
    falls with n, and correlations of any finite length are counted in a long enough run. A periodogram of few
    frequencies may be too small by chance; Student's quantile corrects for this chance, so that the mean lies within
    two errors of the truth in 95 of 100 runs, as often as a normal variable. An error from fewer than FEWEST
    frequencies is infinite.

    A sum that stays bounded, such as the growth along two incommensurate frequencies, has no density at frequency 0.
    Its mean still depends on where the run begins and ends: the error is at least the scatter of a batch over T. Of
    chaotic growth, the scatter over T is 1/sqrt(n) of the error, of n batches.

    References
    ----------
    Batches joined in pairs: Flyvbjerg & Petersen, J. Chem. Phys. 91, 461 (1989). Averaged periodogram, Student's
    distribution and number of frequencies: Lazarus, Lewis, Stock & Watson, J. Bus. Econ. Stat. 36, 541 (2018).
    """

    unit: float  # length of a period in units of non-dimensional time
    block: float = 1.0  # number of periods of one block
    blocks: int = 0  # number of blocks so far
    per_batch: int = 1  # number of blocks in a batch
    # (BATCHES, starts, m): growth over each batch; only the first `count` are used
    sums: np.ndarray = field(default_factory=lambda: np.zeros((BATCHES, 0, 0)))
    count: int = 0  # number of batches, the last of which may be incomplete
    enough: float = field(init=False)  # number of blocks at which the errors are estimated next
    # (starts, m): errors times the square root of the number of blocks, when the length of the average was chosen
    planned: np.ndarray | None = None

    def __post_init__(self) -> None:
        self.enough = FIRST / self.block

    @property
    def periods(self) -> float:
        """Number of periods in the average."""
        return self.blocks * self.block

    @property
    def time(self) -> float:
        """Non-dimensional time of the average."""
        return self.blocks * (self.block * self.unit)

    @property
    def frequencies(self) -> int:
        """Number of frequencies from which the standard errors are estimated; at most half of the number of batches."""
        return min(_frequencies(self.periods), (self.blocks // self.per_batch - 1) // 2)

    @property
    def due(self) -> bool:
        """True if enough batches are complete for the next estimate of the errors."""
        return self.blocks >= self.enough and self.blocks % self.per_batch == 0

    def plan(self, ratio: float, final: bool) -> None:
        """Estimate errors next at `ratio` times the present length; `final`: present errors bound later ones."""
        if final:
            self.planned = self.error_by_start() * math.sqrt(self.blocks)
        self.enough = self.blocks * max(1.0, ratio)

    def ahead(self, most: int) -> np.ndarray:
        """Return the numbers of blocks (b,) of the next batches, at most TOGETHER, none after errors are due."""
        blocks, count, per_batch, parts = self.blocks, self.count, self.per_batch, list[int]()
        while most > 0 and len(parts) < TOGETHER and not (parts and blocks >= self.enough):
            count, per_batch = _with_room(count, per_batch)
            parts.append(min(most, per_batch))
            blocks, count, most = blocks + parts[-1], count + 1, most - parts[-1]
        return np.array(parts, dtype=np.int64)

    def add(self, growth: np.ndarray) -> None:
        """Add the growth over one further block. Shapes: growth (starts, m)."""
        if self.blocks % self.per_batch:
            self.sums[self.count - 1] += growth
            self.blocks += 1
        else:
            self.extend(growth[None], np.ones(1, dtype=np.int64))

    def extend(self, growths: np.ndarray, parts: np.ndarray) -> None:
        """Add the growth (b, starts, m) over further batches; `parts` (b,): their numbers of blocks, from `ahead`."""
        if self.blocks == 0:
            self.sums = np.empty((BATCHES, *growths.shape[1:]))
        while len(growths):
            full = self.count
            self.count, self.per_batch = _with_room(self.count, self.per_batch)
            if self.count < full:  # no room: the batches were joined in pairs
                self.sums[: self.count] = self.sums[::2] + self.sums[1::2]
            new = min(BATCHES - self.count, len(growths))
            self.sums[self.count : self.count + new] = growths[:new]
            self.count += new
            growths = growths[new:]
        self.blocks += int(parts.sum())

    def mean(self) -> np.ndarray:
        """Return the growth (starts, m) per unit of time."""
        return np.asarray(np.sum(self.sums[: self.count], axis=0) / self.time)

    def running(self) -> tuple[np.ndarray, np.ndarray]:
        """Return lengths (b,) of the first batches together, and the growth (b, starts, m) per unit of time in them."""
        blocks = np.minimum(np.arange(1, self.count + 1) * self.per_batch, self.blocks)
        lengths = blocks * (self.block * self.unit)
        return lengths, np.cumsum(self.sums[: self.count], axis=0) / lengths[:, None, None]

    def error_by_start(self) -> np.ndarray:
        """Return the standard error (starts, m) of each start; in 95 of 100 runs the truth is within two errors."""
        complete, frequencies = self.blocks // self.per_batch, self.frequencies
        sums = self.sums[:complete]
        if frequencies < FEWEST:
            return np.full(sums.shape[1:], np.inf)
        # mean of the periodogram over the lowest frequencies
        freedom = 2 * frequencies
        waves = _waves(frequencies, complete) @ sums.reshape(complete, -1)
        spread = np.sqrt(np.einsum("ij,ij->j", waves, waves) / (freedom * complete)).reshape(sums.shape[1:])
        # equal terms have no scatter, but their sum has a rounding error
        least = np.maximum(sums.std(axis=0) / complete, ROUNDING * np.abs(sums).mean(axis=0))
        error = np.maximum(_wide(freedom) * spread, least)
        error /= self.per_batch * self.block * self.unit
        return np.asarray(error if self.planned is None else np.maximum(error, self.planned / math.sqrt(self.blocks)))

    def error(self) -> np.ndarray:
        """Return the standard errors (m,) of the mean over the starts."""
        errors = self.error_by_start()
        return np.asarray(np.sqrt((errors**2).sum(axis=0)) / len(errors))


def _with_room(count: int, per_batch: int) -> tuple[int, int]:
    """Return the numbers of batches and of blocks per batch before a further batch; BATCHES are joined in pairs."""
    return (BATCHES // 2, 2 * per_batch) if count == BATCHES else (count, per_batch)


def _frequencies(periods: float) -> int:
    """Return the number of frequencies from which an error is estimated after some periods."""
    return min(round(NARROW * periods ** (2.0 / 3.0)), MOST)


@lru_cache(maxsize=MOST)
def _wide(freedom: int) -> float:
    """Return the factor that widens an error: half of Student's quantile at the level of two normal deviations."""
    return float(stdtrit(freedom, ndtr(2.0)) / 2.0)


def errors_for(gaussian: float, periods: float) -> float:
    """Return how many errors of an average are as certain as `gaussian` standard deviations of a normal variable.

    The multiple is larger than `gaussian` in a short average: its few frequencies give the long tails of Student's
    distribution.
    """
    freedom = 2 * max(1, _frequencies(periods))
    return float(stdtrit(freedom, ndtr(gaussian))) / _wide(freedom)


@lru_cache(maxsize=8)
def _waves(count: int, batches: int) -> np.ndarray:
    """Return orthonormal cosines and sines (2 count, batches) of the `count` lowest frequencies."""
    angles = np.outer(np.arange(1, count + 1), np.arange(batches)) * (2.0 * math.pi / batches)
    return math.sqrt(2.0 / batches) * np.concatenate([np.cos(angles), np.sin(angles)])
