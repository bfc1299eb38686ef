"""What the measured thresholds hang on: one choice of the criterion changed at a time.

Each row is the widest synchronous range of sigma found with one choice changed, ends refined to
5e-4. The exponent's row is where the transversal exponent of the synchronous state is negative: it
knows no zero-error threshold and no transient.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from synchain.models.graphs.families import topology
from synchain.models.scenes.scene import Scene
from synchain.runtime.prediction.intervals import Interval
from synchain.runtime.stability.exponents import exponents
from synchain.runtime.synchronisation.criterion import PAPER
from synchain.runtime.synchronisation.threshold import project, simulate

COLUMNS = ("n", "omega", "what is different", "lower end", "upper end", "ranges found")
CASES = ((2, 1.15, 0.0, 0.3), (2, 1.40, 0.02, 0.34), (3, 1.55, 0.16, 0.22))
"""Oscillators, drive frequency, and the grid of sigma from … to, 33 points."""

PROJECTED = ((2, 1.55), (4, 1.15), (4, 1.40))
"""More networks whose range is read off the exponent alone."""

CHANGES: tuple[tuple[str, dict[str, float | int]], ...] = (
    ("nothing: 1000 periods, 1e-3, 8 starts, rtol 1e-8", {}),
    ("transient 300 periods", {"transient": 300.0}),
    ("transient 3000 periods", {"transient": 3000.0}),
    ("window 400 periods", {"window": 400.0}),
    ("zero-error threshold 1e-6", {"tolerance": 1e-6}),
    ("zero-error threshold 1e-2", {"tolerance": 1e-2}),
    ("one start, the stated one", {"starts": 1}),
    ("other starts", {"rng": 1}),
    ("rtol 1e-6", {"rtol": 1e-6}),
    ("rtol 1e-10", {"rtol": 1e-10}),
)


def measure(quick: bool = False) -> list[tuple[object, ...]]:
    """Return the rows of the table, in the order of COLUMNS; `quick` takes the first case and three
    choices.
    """
    rows: list[tuple[object, ...]] = []
    for n, omega, low, high in CASES[:1] if quick else CASES:
        scene = _chain(n, omega)
        grid = np.linspace(low, high, 13 if quick else 33)
        for words, change in CHANGES[:3] if quick else CHANGES:
            criterion = replace(PAPER, **change)  # type: ignore[arg-type]
            found = simulate(scene, grid, criterion).intervals
            rows.append((n, omega, words, *_widest(found), len(found)))
        rows.append(_by_exponent(n, omega, quick))
    return rows + [_by_exponent(n, omega, quick) for n, omega in (() if quick else PROJECTED)]


def _chain(n: int, omega: float) -> Scene:
    return Scene(topology=topology("chain", n), parameters={"omega": omega})


def _by_exponent(n: int, omega: float, quick: bool) -> tuple[object, ...]:
    ranges = project(_negative(omega, quick), _chain(n, omega).spectrum)
    return (n, omega, "sign of the transversal exponent", *_widest(ranges), len(ranges))


@lru_cache
def _negative(omega: float, quick: bool) -> tuple[Interval, ...]:
    """Ranges of alpha with a negative exponent; the same for every network."""
    alpha = np.linspace(0.0, 0.7, 36 if quick else 141)
    effort = {"periods": 300.0, "starts": 2} if quick else {"periods": 3000.0, "starts": 8, "precision": 1e-4}
    return exponents(_chain(2, omega), alpha, **effort).intervals  # type: ignore[arg-type]


def _widest(found: tuple[Interval, ...] | list[Interval]) -> Interval:
    return max(found, key=lambda interval: interval[1] - interval[0], default=(float("nan"), float("nan")))
