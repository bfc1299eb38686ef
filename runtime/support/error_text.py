"""Numbers, ranges and intervals as text: one rule of digits for all summaries, figures and benchmarks."""

from __future__ import annotations

import math
import sys
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

LONGEST = 15  # most decimals of a number; a smaller number is written with an exponent


def with_error(value: float, error: float = 0.0) -> str:
    """Return a number with its error: the error to two significant digits, the value to the same decimal place.

    A number without an error has four decimals, or four digits if smaller than 0.001.  The same holds for a number with
    an error below its rounding.  An infinite or nan error is written as "unknown".  Zero has no sign.

    >>> with_error(0.17722, 5.2e-4), with_error(0.3), with_error(4e-6), with_error(0.3, math.inf)
    ('0.17722 ± 0.00052', '0.3000', '4e-06', '0.3000 ± unknown')
    """
    value, error = float(value), float(error)
    if not math.isfinite(value):
        return f"{value:g}"
    if not math.isfinite(error):
        return f"{with_error(value)} ± unknown"
    if error <= sys.float_info.epsilon * abs(value):
        return f"{value:z.4f}" if value == 0.0 or abs(value) >= 1e-3 else f"{value:.4g}"
    # find the decimal place of the second digit of the error after rounding: 0.0996 is 0.10
    rounded = f"{error:.1e}"
    digits = 1 - int(rounded.partition("e")[2])
    if digits > LONGEST:
        return f"{value:.4g} ± {rounded}"
    decimals = max(digits, 0)
    spread = f"{float(rounded):.{decimals}f}" if digits <= 6 else rounded
    return f"{round(value, digits):z.{decimals}f} ± {spread}"


def interval_text(
    intervals: Sequence[tuple[float, float]],
    errors: Sequence[tuple[float, float]] | None = None,
    grid_ends: Collection[float] = (),
    most: int = 8,
) -> str:
    """Return intervals as "low … high; low … high" with the errors of their ends, or "none"."""
    # An end in `grid_ends` is followed by dots, since the interval may continue beyond the grid. A lower end at 0 has
    # no dots, since couplings begin at 0.

    def end(value: float, error: float, lower: bool) -> str:
        cut = any(math.isclose(value, limit, rel_tol=1e-12) for limit in grid_ends) and not (lower and value == 0.0)
        return f"{with_error(value)}..." if cut else with_error(value, error)

    pairs = zip(intervals[:most], errors or [(0.0, 0.0)] * len(intervals), strict=False)
    texts = [f"{end(low, a, True)} … {end(high, b, False)}" for (low, high), (a, b) in pairs]
    more = [f"{len(intervals) - most} more"] if len(intervals) > most else []
    return "; ".join([*texts, *more]) or "none"


def range_text(values: np.ndarray) -> str:
    """Return the smallest and the largest of some numbers as "from low to high"."""
    return f"from {values.min():.6g} to {values.max():.6g}"


def counted(number: int, noun: str) -> str:
    """Return a number of things, as "1 cell" or "3 cells"."""
    return f"{number} {noun}{'s' * (number != 1)}"
