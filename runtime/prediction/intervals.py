"""Sets of real numbers as sorted disjoint closed intervals, and the search for their ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

Interval = tuple[float, float]  # closed interval (low, high)
Predicate = Callable[[np.ndarray], np.ndarray]  # maps an array of points to an array of truth values
# Least width of a bracket relative to its ends; inside a narrower bracket points are equal by rounding.
ROUNDING = 8.0 * float(np.finfo(float).eps)


def grid_intervals(x: np.ndarray, good: np.ndarray) -> list[Interval]:
    """Find the maximal runs of good points of an increasing grid. Shapes: x (k,), good (k,)."""
    intervals: list[Interval] = []
    for i in range(len(x)):
        if good[i]:
            start = intervals.pop()[0] if i > 0 and good[i - 1] else float(x[i])
            intervals.append((start, float(x[i])))
    return intervals


def find(
    judge: Predicate, x: np.ndarray, resolution: float | np.ndarray, fan: int = 7
) -> tuple[list[Interval], np.ndarray]:
    """Find the intervals on which a predicate holds."""
    # Two neighbours of the grid with different truth values form a bracket. `fan` equally spaced points in the bracket
    # are evaluated, and the bracket narrows to the change next to its good end, until narrower than `resolution`. The
    # reported end of an interval is the middle of the bracket. Intervals between neighbours of the grid are not found.
    # Shapes: x (k,), resolution (k - 1,); returns verdict (k,), the truth values on the grid.
    x = np.asarray(x, dtype=float)
    if x.ndim != 1 or len(x) < 1 or np.any(np.diff(x) <= 0):
        raise ValueError("the grid must be one increasing row of numbers")
    if not np.all(np.asarray(resolution) > 0.0):
        raise ValueError(f"resolution = {resolution}; expected a positive number")
    verdict = np.asarray(judge(x), dtype=bool)
    return refine(judge, x, verdict, resolution, fan), verdict


def refine(
    judge: Predicate, x: np.ndarray, verdict: np.ndarray, resolution: float | np.ndarray, fan: int = 7
) -> list[Interval]:
    """Return the intervals of `find` from the truth values `verdict` on the grid. Shapes: x (k,), verdict (k,)."""
    changes = np.flatnonzero(verdict[1:] != verdict[:-1])
    good = np.where(verdict[changes], x[changes], x[changes + 1])
    bad = np.where(verdict[changes], x[changes + 1], x[changes])
    wanted = np.broadcast_to(resolution, len(x) - 1)[changes]
    while True:
        finest = ROUNDING * np.maximum(np.abs(good), np.abs(bad))
        wide = np.flatnonzero(np.abs(bad - good) > np.maximum(wanted, finest))
        if not len(wide):  # all brackets are narrower than the resolution, or at the limit of rounding
            break
        good[wide], bad[wide] = _narrow(judge, good[wide], bad[wide], fan)
    ends = list(0.5 * (good + bad))
    if verdict[0]:
        ends.insert(0, x[0])
    if verdict[-1]:
        ends.append(x[-1])
    return [(float(a), float(b)) for a, b in zip(ends[::2], ends[1::2], strict=True)]


def _narrow(judge: Predicate, good: np.ndarray, bad: np.ndarray, fan: int) -> tuple[np.ndarray, np.ndarray]:
    """Evaluate points in every bracket; narrow each to the first change from good to bad."""
    parts = np.arange(1, fan + 1) / (fan + 1)
    points = good[:, None] + (bad - good)[:, None] * parts
    verdict = np.asarray(judge(points.reshape(-1)), dtype=bool).reshape(points.shape)
    first_bad = np.where(verdict.all(axis=1), fan, np.argmin(verdict, axis=1))
    edges = np.concatenate([good[:, None], points, bad[:, None]], axis=1)
    rows = np.arange(len(good))
    return edges[rows, first_bad], edges[rows, first_bad + 1]


def scale(intervals: Sequence[Interval], factor: float) -> list[Interval]:
    if not factor > 0:
        raise ValueError(f"factor = {factor}; expected a positive number")
    return [(a * factor, b * factor) for a, b in intervals]


def intersect(left: Sequence[Interval], right: Sequence[Interval]) -> list[Interval]:
    intervals = []
    for a, b in left:
        for c, d in right:
            low, high = max(a, c), min(b, d)
            if low < high or (low == high and (a == b or c == d)):
                intervals.append((low, high))
    return sorted(intervals)
