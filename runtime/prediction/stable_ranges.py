"""Stable ranges of alpha with uncertain ends, as exact rationals: stated, narrowed and widened by their errors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

__all__ = ["StableRange", "exact_ranges", "widen"]


@dataclass(frozen=True, slots=True)
class StableRange:
    """Stable alpha from `low` >= 0 to `high` (None: without end), both included, and the uncertainties of the ends."""

    low: Fraction
    high: Fraction | None
    errors: tuple[float, float] = (0.0, 0.0)

    @property
    def ratio(self) -> float:
        """high / low, the largest eigenratio that fits: infinite from 0 or without end, 0 for alpha = 0 alone."""
        if self.high is None:
            return math.inf
        if self.low == 0:
            return math.inf if self.high > 0 else 0.0
        return float(self.high / self.low)


def exact_ranges(
    ranges: Sequence[tuple[float, float]], errors: Sequence[tuple[float, float]] | None = None
) -> list[StableRange]:
    """The ranges as given, cut at alpha = 0; an end that is cut, and one at infinity, has no error.

    Raises ValueError where they are not ascending and disjoint, or an error is negative, infinite or missing.
    """
    if errors is not None and len(errors) != len(ranges):
        raise ValueError(f"errors: found {len(errors)} pairs for {len(ranges)} ranges; expected one for each range")
    found, last = [], -math.inf
    for i, (low, high) in enumerate(ranges):
        if not (-math.inf < low <= high and low > last):
            before = f" after {last}" if i else ""
            raise ValueError(
                f"stable range {i + 1} is ({low}, {high}){before}; expected disjoint ranges (low, high), low <= high, "
                "ascending: sort them and join those that touch"
            )
        last = high
        below, above = errors[i] if errors is not None else (0.0, 0.0)
        if not (0 <= below < math.inf and 0 <= above < math.inf):
            raise ValueError(f"errors of range {i + 1}: found ({below}, {above}); expected two finite numbers >= 0")
        if high >= 0:
            end = None if high == math.inf else _exact(high)
            kept = (float(below) if low > 0 else 0.0, float(above) if end is not None else 0.0)
            found.append(StableRange(max(_exact(low), Fraction(0)), end, kept))
    return found


def _exact(x: float) -> Fraction:
    """The rational that a number is; those of NumPy by way of a float."""
    return Fraction(x) if isinstance(x, (int, float, Fraction)) else Fraction(float(x))


def widen(ranges: Sequence[StableRange], sign: int) -> list[StableRange]:
    """The largest ranges (sign 1) or the smallest (sign -1) that the errors allow; those that meet are joined."""
    found: list[StableRange] = []
    for r in ranges:
        below, above = (sign * Fraction(e) for e in r.errors)
        low, high = max(r.low - below, Fraction(0)), None if r.high is None else r.high + above
        if high is not None and high < low:
            continue
        last = found[-1] if found else None
        if last is not None and (last.high is None or low <= last.high):
            high = None if high is None or last.high is None else max(high, last.high)
            found[-1] = StableRange(last.low, high)
        else:
            found.append(StableRange(low, high))
    return found
