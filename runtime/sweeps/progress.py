"""Progress of a sweep: a bar on a terminal, a line a minute elsewhere, and a value for a hook of
the caller.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from tqdm import tqdm

from ..support.status import CODES, Status

__all__ = ["Hook", "Progress", "Reporter", "duration"]

EVERY = 60.0
"""Seconds between two lines if stderr is no terminal."""


@dataclass(frozen=True, slots=True)
class Progress:
    """State of a sweep.

    Attributes
    ----------
    cells, done, kept : int
        Cells in all, those that have ended, and those of them that an earlier run had finished.
    statuses : mapping of Status to int
        How many cells ended how.
    compiling : float
        Seconds that the compilation of the kernel took, or its loading.
    running : float
        Seconds since the first cell began.
    preparing : float
        Seconds before that without the compilation: equations, text of the kernel, exponents of a
        certified run.
    """

    cells: int
    done: int
    kept: int
    statuses: Mapping[Status, int]
    compiling: float
    running: float
    preparing: float = 0.0

    @property
    def rate(self) -> float:
        """Cells a second in this run."""
        return (self.done - self.kept) / self.running if self.running > 0.0 else 0.0

    @property
    def left(self) -> float:
        """Seconds left at this rate; infinite before the first cell has ended."""
        return (self.cells - self.done) / self.rate if self.rate > 0.0 else float("inf")

    @property
    def failures(self) -> str:
        """How many cells ended otherwise than at the end of their window, in words; empty if none
        did.
        """
        bad = ((s, n) for s, n in self.statuses.items() if s != Status.FINISHED and n)
        return ", ".join(f"{n} {s.name.lower().replace('_', ' ')}" for s, n in bad)

    def __str__(self) -> str:
        parts = f"{self.done} of {self.cells} cells ({100.0 * self.done / self.cells:.0f} %)"
        parts += f", {self.rate:.3g} cells/s, {duration(self.left)} left"
        return f"{parts}; {self.failures}" if self.failures else parts


Hook = Callable[[Progress], object]


def duration(seconds: float) -> str:
    """A time in the largest unit that fits: 40 s, 12 min, 3.5 h."""
    if seconds == float("inf"):
        return "unknown time"
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


@dataclass(slots=True)
class Reporter:
    """Counts cells as they end and shows a bar on a terminal, else a line every minute; `show`
    False shows nothing.
    """

    cells: int
    show: bool | None = None
    hook: Hook | None = None
    counts: np.ndarray = field(default_factory=lambda: np.zeros(CODES, dtype=np.int64))
    kept: int = 0
    preparing: float = 0.0
    compiling: float = 0.0
    began: float = field(default_factory=time.perf_counter)
    every: float = EVERY
    _said: float = 0.0
    _bar: tqdm | None = None

    def start(self, counts: np.ndarray, compiling: float = 0.0) -> None:
        """Begin to count cells.

        Parameters
        ----------
        counts : ndarray, shape (CODES,)
            Cells that are kept from an earlier run.
        compiling : float
            Seconds of the time since this reporter was made that the compilation took.
        """
        now = time.perf_counter()
        self.preparing, self.compiling = now - self.began - compiling, compiling
        self.began, self._said = now, now
        self.counts = self.counts + counts
        self.kept = int(self.counts.sum())
        terminal = bool(getattr(sys.stderr, "isatty", bool)())
        if self.show or (self.show is None and terminal):
            self._bar = tqdm(total=self.cells, initial=self.kept, unit="cell", file=sys.stderr)
        self._tell()

    def add(self, counts: np.ndarray) -> None:
        """Count cells that have ended; counts (CODES,)."""
        self.counts = self.counts + counts
        if self._bar is not None:
            self._bar.set_postfix_str(self.now.failures, refresh=False)
            self._bar.update(int(counts.sum()))
        elif self.show is None and time.perf_counter() - self._said > self.every and sys.stderr is not None:
            self._said = time.perf_counter()
            print(self.now, file=sys.stderr, flush=True)
        self._tell()

    @property
    def now(self) -> Progress:
        """The state of the sweep."""
        found = {status: int(self.counts[status]) for status in Status if self.counts[status]}
        running = time.perf_counter() - self.began
        done = int(self.counts.sum())
        return Progress(self.cells, done, self.kept, MappingProxyType(found), self.compiling, running, self.preparing)

    def close(self) -> None:
        """Leave the bar as it stands."""
        if self._bar is not None:
            self._bar.close()

    def _tell(self) -> None:
        if self.hook is not None:
            self.hook(self.now)
