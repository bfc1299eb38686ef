"""Plots of master stability functions over complex strengths, and the modes of a network on them."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import TwoSlopeNorm

from ..prediction.mode_windows import transversal_modes
from ..stability.exponent_plane import Plane
from .exponent import finite
from .style import BLACK, symbol

FAR = 100.0  # coupling sigma at the end of a ray, far outside of the drawn plane; the limits of the axes cut the ray
# Labels of axes that are strengths of a mode.
AXES = {"alpha": r"$\alpha=-\sigma\,\mathrm{Re}\,\gamma$", "beta": r"$\beta=-\sigma\,\mathrm{Im}\,\gamma$"}
RAY: dict[str, Any] = {"color": BLACK, "linestyle": "--", "linewidth": 0.8}
DOT: dict[str, Any] = {
    "color": BLACK,
    "linestyle": "none",
    "marker": "o",
    "markersize": 4.0,
    "markerfacecolor": "white",
    "clip_on": False,
    "zorder": 5,
}


def draw_plane(axes: Axes, plane: Plane, **style: Any) -> Axes:
    """Draw exponents in colours, blue if negative, with a line at zero."""
    value = finite(plane.exponent)
    cmap, norm = _colours(value)
    labels = [AXES[name] if name in plane.strengths else symbol(name) for name in plane.names]
    look = {"norm": norm, "cmap": cmap, "shading": "nearest", "rasterized": True, **style}
    painted = axes.pcolormesh(plane.across, plane.up, value.T, **look)
    for k, line in enumerate(plane.contours):
        axes.plot(line[:, 0], line[:, 1], color=BLACK, linewidth=1.1, label="" if k else r"$\Lambda=0$")
    axes.set(
        xlim=(plane.across[0], plane.across[-1]),
        ylim=(plane.up[0], plane.up[-1]),
        xlabel=labels[0],
        ylabel=labels[1],
    )
    bar = axes.figure.colorbar(painted, ax=axes, aspect=30, pad=0.02)
    bar.set_label(r"exponent $\Lambda$ per unit of $\tau$")
    return axes


def _colours(value: np.ndarray) -> tuple[str, TwoSlopeNorm]:
    """Return a colour map that is white at zero, and its norm; only half of the map if all values have one sign."""
    valid = value[np.isfinite(value)]
    low, high = (float(valid.min()), float(valid.max())) if valid.size else (0.0, 0.0)
    if low * high > 0 and not np.isclose(low, high):
        return ("Blues_r", TwoSlopeNorm(high, low, 0.0)) if high < 0 else ("Reds", TwoSlopeNorm(low, 0.0, high))
    size = max(-low, high) or 1.0
    return "RdBu_r", TwoSlopeNorm(0.0, -size, size)


def draw_rays(axes: Axes, plane: Plane, sigma: float | None = None) -> Axes:
    """Draw the ray of every mode of the scene's network."""
    # If the plane ends at beta = 0, only the mode with beta >= 0 of a conjugate pair is visible.
    graph = plane.scene.topology
    still: dict[str, Any] = {"scalex": False, "scaley": False}
    for mode in transversal_modes(graph):
        unit = -complex(mode.eigenvalue.value)
        (ray,) = axes.plot([0.0, FAR * unit.real], [0.0, FAR * unit.imag], **RAY, **still)
        ray.set_label(rf"$-\sigma\gamma_k$ of {graph.name}({graph.n})" if mode.number == 1 else "")
        if sigma is None:
            continue
        # A dot outside the drawn part of the plane would be listed in the legend although it is invisible.
        x, y = sigma * unit.real, sigma * unit.imag
        if plane.across[0] <= x <= plane.across[-1] and plane.up[0] <= y <= plane.up[-1]:
            (dot,) = axes.plot(x, y, **DOT, **still)
            dot.set_label(rf"$\sigma={sigma:.3g}$")
    handles = dict(zip(*axes.get_legend_handles_labels()[::-1], strict=True))
    axes.figure.legend(
        handles.values(),
        handles.keys(),
        loc="outside upper center",
        ncols=3,
        handlelength=1.8,
        columnspacing=1.4,
        borderpad=0.1,
    )
    return axes
