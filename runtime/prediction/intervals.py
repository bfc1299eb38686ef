"""Sets of real numbers as sorted disjoint closed intervals, and the search for their ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

__all__ = ["Interval", "find", "grid_intervals", "intersect", "refine", "scale"]

Interval = tuple[float, float]
Predicate = Callable[[np.ndarray], np.ndarray]


def grid_intervals(x: np.ndarray, good: np.ndarray) -> list[Interval]:
    """The maximal runs of good points of an increasing grid, as intervals from their first to their last point."""
    found: list[Interval] = []
    for i in range(len(x)):
        if good[i]:
            start = found.pop()[0] if i > 0 and good[i - 1] else float(x[i])
            found.append((start, float(x[i])))
    return found


def find(judge: Predicate, x: np.ndarray, resolution: float, fan: int = 7) -> tuple[list[Interval], np.ndarray]:
    """Return the intervals where `judge` holds, ends refined to `resolution`, and its verdict on the grid `x`.

    `judge` maps an array of points to an array of truth values.  Between neighbours of the grid that differ, `fan` equally
    spaced points are judged and the bracket narrows to the change next to the good end, until it is narrower than
    `resolution`; the end reported is its middle.  Intervals that fit between two grid points are not seen.

    Raises ValueError for a grid that does not increase, or a resolution that is not positive.
    """
    x = np.asarray(x, dtype=float)
    if x.ndim != 1 or len(x) < 1 or np.any(np.diff(x) <= 0):
        raise ValueError("the grid must be one increasing row of numbers")
    if not resolution > 0:
        raise ValueError(f"resolution = {resolution}; expected a positive number")
    verdict = np.asarray(judge(x), dtype=bool)
    return refine(judge, x, verdict, resolution, fan), verdict


def refine(
    judge: Callable[[np.ndarray], np.ndarray], x: np.ndarray, verdict: np.ndarray, resolution: float, fan: int = 7
) -> list[Interval]:
    """Return the intervals of `find`, if the verdict (m,) on the grid `x` is known already."""
    changes = np.flatnonzero(verdict[1:] != verdict[:-1])
    good = np.where(verdict[changes], x[changes], x[changes + 1])
    bad = np.where(verdict[changes], x[changes + 1], x[changes])
    while len(changes) and np.max(np.abs(bad - good)) > resolution:
        good, bad = _narrow(judge, good, bad, fan)
    ends = list(0.5 * (good + bad))
    if verdict[0]:
        ends.insert(0, x[0])
    if verdict[-1]:
        ends.append(x[-1])
    return [(float(a), float(b)) for a, b in zip(ends[::2], ends[1::2], strict=True)]


def _narrow(judge: Predicate, good: np.ndarray, bad: np.ndarray, fan: int) -> tuple[np.ndarray, np.ndarray]:
    """Predicate `fan` points in every bracket and keep the part between the last good point and the first bad one."""
    parts = np.arange(1, fan + 1) / (fan + 1)
    points = good[:, None] + (bad - good)[:, None] * parts
    verdict = np.asarray(judge(points.reshape(-1)), dtype=bool).reshape(points.shape)
    first_bad = np.where(verdict.all(axis=1), fan, np.argmin(verdict, axis=1))
    edges = np.concatenate([good[:, None], points, bad[:, None]], axis=1)
    rows = np.arange(len(good))
    return edges[rows, first_bad], edges[rows, first_bad + 1]


def scale(intervals: Sequence[Interval], factor: float) -> list[Interval]:
    """Every interval times a positive factor."""
    if not factor > 0:
        raise ValueError(f"factor = {factor}; expected a positive number")
    return [(a * factor, b * factor) for a, b in intervals]


def intersect(left: Sequence[Interval], right: Sequence[Interval]) -> list[Interval]:
    """The points that lie in both sets; a single point counts only where one of the sets has it as an interval."""
    found = []
    for a, b in left:
        for c, d in right:
            low, high = max(a, c), min(b, d)
            if low < high or (low == high and (a == b or c == d)):
                found.append((low, high))
    return sorted(found)
