"""Methods at the same error: times interpolated on work-precision curves, and their ratios."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any

from .tables import markdown

TARGETS = (1e-6, 1e-8, 1e-10, 1e-12)
"""Errors at which methods are compared."""

Curve = list[tuple[float, float]]


def time_at(points: Sequence[tuple[float, float]], target: float) -> float:
    """The least time at which a method reaches an error, from its points (error, time) in the order
    of its tolerances.

    A point counts whose error is at most the target, and so does a place between two neighbours on
    either side of it, by interpolation in the logarithms. NaN where no point reaches the target:
    nothing is extrapolated.
    """
    found = [seconds for error, seconds in points if error <= target]
    for (error, seconds), (next_error, next_seconds) in pairwise(points):
        if error > target >= next_error > 0.0:
            part = math.log(error / target) / math.log(error / next_error)
            found.append(seconds * (next_seconds / seconds) ** part)
    return min(found, default=math.nan)


def curves(rows: Iterable[Mapping[str, Any]]) -> dict[str, dict[tuple[str, str], Curve]]:
    """Points (error, microseconds) by case and (method, lanes), in the order of the rows; rows
    without are left out.

    Lanes are "1", or all numbers that the rows of a method have: they may follow the tolerance.
    """
    points: dict[tuple[str, str, bool], tuple[Curve, set[int]]] = {}
    for row in rows:
        error, cost = row.get("error", math.nan), row.get("microseconds per period", math.nan)
        if math.isfinite(error) and math.isfinite(cost):
            curve, lanes = points.setdefault((row["case"], row["method"], row["lanes"] > 1), ([], set()))
            curve.append((error, cost))
            lanes.add(row["lanes"])
    found: dict[str, dict[tuple[str, str], Curve]] = {}
    for (case, method, _), (curve, lanes) in points.items():
        found.setdefault(case, {})[method, ", ".join(map(str, sorted(lanes)))] = curve
    return found


def table(rows: Iterable[Mapping[str, Any]], own: set[str]) -> str:
    """Microseconds per period at each target, and ratios to this program's fastest with full lanes;
    "" without rows.
    """
    columns = [
        "case",
        "method",
        "lanes",
        *(f"{target:.0e}: {what}" for target in TARGETS for what in ("time", "ratio")),
    ]
    lines: list[tuple[object, ...]] = []
    for case, methods in curves(rows).items():
        full = any(name in own and lanes != "1" for name, lanes in methods)
        times = {key: [time_at(points, target) for target in TARGETS] for key, points in methods.items()}
        ours = [values for (name, lanes), values in times.items() if name in own and (lanes != "1") == full]
        least = [min((values[i] for values in ours if values[i] > 0.0), default=math.nan) for i in range(len(TARGETS))]
        for (name, lanes), values in times.items():
            pairs = zip(values, least, strict=True)
            lines.append((case, name, lanes, *(_shown(v) for time, one in pairs for v in (time, time / one))))
    words = (
        "Microseconds per period at the same error, and their ratio to the fastest row of this program with full lanes."
    )
    return f"{words}\n\n{markdown(columns, lines)}" if lines else ""


def _shown(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.3g}"
