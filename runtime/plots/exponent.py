"""Plots of master stability functions of a real strength."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from synchain.models.inputs.checks import check_number
from synchain.models.presentation.writer import Latex

from ..stability.msf import MSF
from .canvas import line_style
from .style import BLUE, ORANGE, bands

MARKED = 60  # most strengths that are marked with dots; more dots would hide the line


def draw_exponent(axes: Axes, function: MSF, sigma: float | None = None, **style: Any) -> Axes:
    """Draw exponents over all computed strengths; dots mark the requested strengths if these are few."""
    # A band shows two standard errors on either side, grey bands the ranges with a negative exponent. Orange dots are
    # the modes of the network at the strength `sigma` of links, by default that of the scene.
    fine = function.fine
    value, error = finite(fine.exponent), finite(fine.stderr)
    bands(axes, function.intervals)
    axes.axhline(0.0, color="0.35", linewidth=0.6, zorder=1)
    axes.fill_between(fine.alpha, value - 2 * error, value + 2 * error, color=BLUE, alpha=0.3, linewidth=0.0, zorder=2)
    axes.plot(fine.alpha, value, **line_style(style, color=BLUE, linewidth=0.9, zorder=3))
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
    _mark_modes(axes, function, sigma)
    axes.set(
        xlim=(function.alpha[0], function.alpha[-1]),
        xlabel=r"strength of a mode $\alpha=\sigma\,|\gamma|$",
        ylabel=r"exponent $\Lambda$ per unit of $\tau$",
    )
    return axes


def _mark_modes(axes: Axes, function: MSF, sigma: float | None) -> None:
    """Mark the strengths sigma |gamma| of the modes of the network, if they are real and inside the plotted range."""
    scene = function.scene
    strength = scene.parameters[scene.strength] if sigma is None else check_number("sigma", sigma, 0.0)
    gamma = np.array([value for value in scene.topology.spectrum.values if value != 0]) if strength else np.array([])
    if not gamma.size or np.iscomplexobj(gamma):  # nothing to mark on a line
        return
    modes = np.unique(-strength * gamma.real)
    modes = modes[(modes >= function.alpha[0]) & (modes <= function.alpha[-1])]
    heights = np.interp(modes, function.fine.alpha, finite(function.fine.exponent))
    label = rf"modes at ${Latex().letter(scene.strength)} = {strength:.4g}$"
    axes.plot(modes, heights, color=ORANGE, linestyle="none", marker="o", markersize=5.0, zorder=4, label=label)
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0))


def finite(values: np.ndarray) -> np.ndarray:
    """Replace infinities, which are not drawn, by NaN."""
    return np.where(np.isfinite(values), values, np.nan)
