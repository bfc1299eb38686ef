"""How far a sweep has come: for a bar on a terminal, a line now and then elsewhere, and whoever wants to know."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
from tqdm import tqdm

from synchain.models.inputs.checks import a_callable, flag

from ..support.status import CODES, Status

__all__ = ["Hook", "Progress", "Reporter", "duration"]

EVERY = 60.0
"""Seconds between two lines where stderr is no terminal."""


@dataclass(frozen=True, slots=True)
class Progress:
    """State of a sweep: `done` of `cells` have ended, `kept` of them in an earlier sitting, and how; times in seconds.

    `compiling` is the time before the first cell ran, `running` that since then.
    """

    cells: int
    done: int
    kept: int
    statuses: Mapping[Status, int]
    compiling: float
    running: float

    @property
    def rate(self) -> float:
        """Cells a second in this sitting."""
        return (self.done - self.kept) / self.running if self.running > 0.0 else 0.0

    @property
    def left(self) -> float:
        """Seconds left at this rate, infinite while nothing is known."""
        return (self.cells - self.done) / self.rate if self.rate > 0.0 else float("inf")

    @property
    def failures(self) -> str:
        """How many cells ended otherwise than at the end of their window, in words; empty where none did."""
        bad = ((s, n) for s, n in self.statuses.items() if s != Status.FINISHED and n)
        return ", ".join(f"{n} {s.name.lower().replace('_', ' ')}" for s, n in bad)

    def __str__(self) -> str:
        parts = f"{self.done} of {self.cells} cells ({100.0 * self.done / self.cells:.0f} %)"
        parts += f", {self.rate:.3g} cells/s, {duration(self.left)} left"
        return f"{parts}; {self.failures}" if self.failures else parts


Hook = Callable[[Progress], Any]


def duration(seconds: float) -> str:
    """A time in the largest unit that fits: 40 s, 12 min, 3.5 h."""
    if seconds == float("inf"):
        return "unknown time"
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


@dataclass(slots=True)
class Reporter:
    """Counts cells as they end and shows it: a bar on a terminal, else a line every minute; `show` False shows nothing."""

    cells: int
    show: bool | None = None
    hook: Hook | None = None
    counts: np.ndarray = field(default_factory=lambda: np.zeros(CODES, dtype=np.int64))
    kept: int = 0
    compiling: float = 0.0
    began: float = field(default_factory=time.perf_counter)
    _said: float = 0.0
    _bar: Any = None

    def __post_init__(self) -> None:
        if self.hook is not None:
            a_callable("progress", self.hook)
        if self.show is not None:
            flag("show_progress", self.show)

    def start(self, counts: np.ndarray) -> None:
        """The kernel is there and the first cell runs; `counts` (CODES,) are the cells kept from before."""
        now = time.perf_counter()
        self.compiling, self.began, self._said = now - self.began, now, now
        self.counts = self.counts + counts
        self.kept = int(self.counts.sum())
        terminal = bool(getattr(sys.stderr, "isatty", bool)())
        if self.show or (self.show is None and terminal):
            self._bar = tqdm(total=self.cells, initial=self.kept, unit="cell", file=sys.stderr)
        self._tell()

    def add(self, counts: np.ndarray) -> None:
        """Some more cells have ended; counts (CODES,)."""
        self.counts = self.counts + counts
        if self._bar is not None:
            self._bar.set_postfix_str(self.now.failures, refresh=False)
            self._bar.update(int(counts.sum()))
        elif self.show is None and time.perf_counter() - self._said > EVERY and sys.stderr is not None:
            self._said = time.perf_counter()
            print(self.now, file=sys.stderr, flush=True)
        self._tell()

    @property
    def now(self) -> Progress:
        """The state of the sweep."""
        found = {status: int(self.counts[status]) for status in Status if self.counts[status]}
        running = time.perf_counter() - self.began
        done = int(self.counts.sum())
        return Progress(self.cells, done, self.kept, MappingProxyType(found), self.compiling, running)

    def close(self) -> None:
        """Leave the bar as it stands."""
        if self._bar is not None:
            self._bar.close()

    def _tell(self) -> None:
        if self.hook is not None:
            self.hook(self.now)
