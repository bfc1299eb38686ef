"""Progress of a long call: a bar on a terminal and in a notebook, a line a minute elsewhere, and a value for a hook
of the caller.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from .status import CODES, Status

if TYPE_CHECKING:
    from tqdm import tqdm

T = TypeVar("T")

EVERY = 60.0  # seconds between two lines if stderr is no terminal


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of a call that counts units: cells of a sweep, periods of an average, or values of a parameter.

    Attributes
    ----------
    total, done, kept : float
        Number of units, number of units done, and number of those already done in an earlier run.  The numbers are
        integers, except for periods.  If an average is precise enough early, or a branch ends, `total` becomes `done`.
    statuses : mapping of Status to int
        Number of cells that ended with each status; empty if the units are not cells.
    compiling : float
        Seconds to compile or load the kernel of a sweep.
    running : float
        Seconds since the first unit began.
    preparing : float
        Seconds before the first unit: equations, text of the kernel, exponents of a certified run, and compilation
        unless counted in `compiling`.
    unit : str
        The unit: "cell", "period" or "value".

    See Also
    --------
    synchain.run
    """

    total: float
    done: float
    kept: float
    statuses: Mapping[Status, int]
    compiling: float
    running: float
    preparing: float = 0.0
    unit: str = "cell"

    @property
    def share(self) -> float:
        """Fraction done, from 0 to 1."""
        return self.done / self.total if self.total > 0 else 1.0

    @property
    def rate(self) -> float:
        """Units per second in this run."""
        return (self.done - self.kept) / self.running if self.running > 0.0 else 0.0

    @property
    def left(self) -> float:
        """Remaining seconds at this rate; infinite before the first unit is done, 0 if no unit remains."""
        if self.done >= self.total:
            return 0.0
        return (self.total - self.done) / self.rate if self.rate > 0.0 else float("inf")

    @property
    def failures(self) -> str:
        """Text with the number of cells that did not reach the end of their window, by status; empty without any."""
        bad = ((s, n) for s, n in self.statuses.items() if s != Status.FINISHED and n)
        return ", ".join(f"{n} {s.name.lower().replace('_', ' ')}" for s, n in bad)

    def __str__(self) -> str:
        parts = f"{self.done:.12g} of {self.total:.12g} {self.unit}s ({100.0 * self.share:.0f} %)"
        parts += f", {self.rate:.3g} {self.unit}s/s, {duration(self.left)} left"
        return f"{parts}; {self.failures}" if self.failures else parts


Hook = Callable[[Progress], object]


def duration(seconds: float) -> str:
    """Return a time in the largest unit that fits: 40 s, 12 min, 3.5 h."""
    if seconds == float("inf"):
        return "unknown time"
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


def _has_bars() -> bool:
    """Return True if stderr is a terminal, or if this process is the kernel of a notebook."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return bool(getattr(sys.stderr, "isatty", bool)()) or "IPKernelApp" in getattr(shell, "config", ())


@dataclass(slots=True)
class Reporter:
    """Count units that are done; show a bar on a terminal or in a notebook, else a line every minute."""

    total: float
    show: bool | None = None  # False shows nothing, None a bar or lines, True a bar everywhere
    hook: Hook | None = None  # called with a `Progress` after each change
    unit: str = "cell"
    counts: np.ndarray = field(default_factory=lambda: np.zeros(CODES, dtype=np.int64))  # (CODES,): ended cells
    done: float = 0
    kept: float = 0  # the part of `done` from an earlier run
    preparing: float = 0.0
    compiling: float = 0.0
    began: float = field(default_factory=time.perf_counter)
    every: float = EVERY
    _last_line: float = 0.0
    _bar: tqdm | None = None

    def __enter__(self) -> Reporter:
        self.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, *problem: object) -> None:
        if kind is None and self.done < self.total:  # an average was precise enough early, or a branch ended
            self.total = self.done
            if self._bar is not None:
                self._bar.total = self.done
                self._bar.refresh()
            self._call_hook()
        self.close()

    def start(self, counts: np.ndarray | None = None, compiling: float = 0.0) -> None:
        """Begin to count. Shapes: counts (CODES,)."""
        now = time.perf_counter()
        self.preparing, self.compiling = now - self.began - compiling, compiling
        self.began, self._last_line = now, now
        if counts is not None:
            self.counts = self.counts + counts
            self.done = self.kept = int(counts.sum())
        if self.show or (self.show is None and _has_bars()):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # tqdm warns if a notebook has no widgets
                from tqdm.auto import tqdm

            note = f"compiled in {duration(compiling)}" if compiling >= 1.0 else None
            self._bar = tqdm(total=self.total, initial=self.kept, desc=note, unit=self.unit, file=sys.stderr)
        self._call_hook()

    def add(self, counts: np.ndarray) -> None:
        """Count cells that have ended; counts (CODES,)."""
        self.counts = self.counts + counts
        self.advance(int(counts.sum()))

    def advance(self, amount: float) -> None:
        self.done += amount
        if self._bar is not None:
            self._bar.set_postfix_str(self.now.failures, refresh=False)
            self._bar.update(amount)
        elif self.show is None and time.perf_counter() - self._last_line > self.every and sys.stderr is not None:
            self._last_line = time.perf_counter()
            print(self.now, file=sys.stderr, flush=True)
        self._call_hook()

    def each(self, values: Iterable[T]) -> Iterator[T]:
        """Yield values; count each value as done when the caller requests the next."""
        for value in values:
            yield value
            self.advance(1)

    @property
    def now(self) -> Progress:
        statuses = MappingProxyType({s: int(self.counts[s]) for s in Status if self.counts[s]})
        running = time.perf_counter() - self.began
        return Progress(self.total, self.done, self.kept, statuses, self.compiling, running, self.preparing, self.unit)

    def close(self) -> None:
        if self._bar is not None:
            self._bar.close()

    def _call_hook(self) -> None:
        if self.hook is not None:
            self.hook(self.now)
