"""Stable ranges of alpha with uncertain ends, as exact rationals."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction


@dataclass(frozen=True, slots=True)
class StableRange:
    low: Fraction  # lower end, at least 0
    high: Fraction | None  # upper end; None if there is none
    errors: tuple[float, float] = (0.0, 0.0)  # uncertainties of the ends

    @property
    def ratio(self) -> float:
        """high / low, the largest eigenratio of a network whose modes all fit into the range."""
        # The ratio is infinite for a range from 0 or without an upper end, and 0 for the single point alpha = 0.
        if self.high is None:
            return math.inf
        if self.low == 0:
            return math.inf if self.high > 0 else 0.0
        return float(self.high / self.low)


def exact_ranges(
    ranges: Sequence[tuple[float, float]], errors: Sequence[tuple[float, float]] | None = None
) -> list[StableRange]:
    """Convert ranges of floats to exact ones, cut at alpha = 0."""
    if errors is not None and len(errors) != len(ranges):
        raise ValueError(f"errors: found {len(errors)} pairs for {len(ranges)} ranges; expected one for each range")
    exact: list[StableRange] = []
    last = -math.inf
    for i, (low, high) in enumerate(ranges):
        if not (-math.inf < low <= high and low >= last):
            before = f" after {last}" if i else ""
            raise ValueError(
                f"stable range {i + 1} is ({low}, {high}){before}; expected disjoint ranges (low, high), low <= high, "
                "ascending: sort them"
            )
        touches, last = low == last, high
        below, above = errors[i] if errors is not None else (0.0, 0.0)
        if not (0 <= below < math.inf and 0 <= above < math.inf):
            raise ValueError(f"errors of range {i + 1}: found ({below}, {above}); expected two finite numbers >= 0")
        if high >= 0:
            end = None if high == math.inf else _exact(high)
            uncertainties = (float(below) if low > 0 else 0.0, float(above) if end is not None else 0.0)
            begin = max(_exact(low), Fraction(0))
            if touches and exact:  # join closed ranges that touch
                joined = exact.pop()
                begin, uncertainties = joined.low, (joined.errors[0], uncertainties[1])
            exact.append(StableRange(begin, end, uncertainties))
    return exact


def _exact(x: float) -> Fraction:
    """Return the rational value of a number; numbers of NumPy are converted to float first."""
    return Fraction(x) if isinstance(x, (int, float, Fraction)) else Fraction(float(x))


def widen(ranges: Sequence[StableRange], sign: int) -> list[StableRange]:
    """Widen (`sign` = 1) or narrow (`sign` = -1) ranges by their errors."""
    widened: list[StableRange] = []
    for r in ranges:
        below, above = (sign * Fraction(e) for e in r.errors)
        low, high = max(r.low - below, Fraction(0)), None if r.high is None else r.high + above
        if high is not None and high < low:
            continue
        last = widened[-1] if widened else None
        if last is not None and (last.high is None or low <= last.high):
            high = None if high is None or last.high is None else max(high, last.high)
            widened[-1] = StableRange(last.low, high)
        else:
            widened.append(StableRange(low, high))
    return widened
