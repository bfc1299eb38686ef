"""Plots of master stability functions of a real strength."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from ..stability.msf import MSF
from .style import BLUE, bands

MARKED = 60
"""Most strengths that are marked; more would cover the line."""


def draw_exponent(axes: Axes, function: MSF) -> Axes:
    """Draw exponents over all strengths at which they were computed; dots mark the requested ones if they are few.

    A band shows two standard errors on either side, grey bands the ranges with a negative exponent.
    """
    fine = function.fine
    value, error = finite(fine.exponent), finite(fine.stderr)
    bands(axes, function.intervals)
    axes.axhline(0.0, color="0.35", linewidth=0.6, zorder=1)
    axes.fill_between(fine.alpha, value - 2 * error, value + 2 * error, color=BLUE, alpha=0.3, linewidth=0.0, zorder=2)
    axes.plot(fine.alpha, value, color=BLUE, linewidth=0.9, zorder=3)
    if len(function.alpha) <= MARKED:
        axes.plot(
            function.alpha,
            finite(function.exponent),
            color=BLUE,
            linestyle="none",
            marker="o",
            markersize=2.5,
            zorder=3,
        )
    axes.set(
        xlim=(function.alpha[0], function.alpha[-1]),
        xlabel=r"strength of a mode $\alpha=\sigma\,|\gamma|$",
        ylabel=r"exponent $\Lambda$ per unit of $\tau$",
    )
    return axes


def finite(values: np.ndarray) -> np.ndarray:
    """Replace infinities, which are not drawn, by NaN."""
    return np.where(np.isfinite(values), values, np.nan)
