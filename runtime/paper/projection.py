"""Figures 5-8: predict the synchronous ranges of a network from the two-oscillator probe and the eigenvalues.

Top left: the error e_II(alpha) of the probe, drawn vertically, and on a second axis the exponent of a mode, with dots
at its changes of sign. Top right: the line alpha = sigma |gamma_k| of each mode. Below: the error of the network. Grey
bands extend the synchronous ranges of the probe to the lines. A darker band leads down from values of sigma at which
all lines are inside the grey bands: the predicted range of sigma.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import sympy as sp
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from synchain.models.scenes.file import load_scene
from synchain.models.scenes.scene import Scene

from ..plots.csv_table import as_csv
from ..plots.exponent import finite
from ..plots.style import BLACK, BLUE, COLUMN, GREEN, GREY, ORANGE, PURPLE, bands, bracket, failures, note
from ..prediction.intervals import Interval, intersect, scale
from ..stability.msf import MSF
from ..synchronisation.threshold import Sweep
from .exponent_figure import curve
from .figure_runs import FigureRuns
from .published import published_ranges

NAMES = ("figure_5", "figure_6", "figure_7", "figure_8")
SIZE = (COLUMN, 4.0)
LINES = ((BLUE, "-"), (PURPLE, "--"), (GREEN, "-."), (BLACK, ":"))
DARK = "#bdbdbd"


class Projection(NamedTuple):
    scene: Scene  # network
    probe: Sweep  # two-oscillator probe in alpha
    network: Sweep  # network in sigma
    predicted: tuple[Interval, ...]  # ranges of sigma predicted from the probe
    published: tuple[Interval, ...]  # ranges of sigma
    exponent: MSF  # master stability function


def compute(name: str, runs: FigureRuns) -> Projection:
    """Sweep the probe and the network of a figure's scene, and compute the exponents."""
    scene = load_scene(name)
    predicted = tuple(runs.predicted(scene))
    return Projection(
        scene, runs.pair(scene), runs.network(scene), predicted, published_ranges(scene), curve(scene, runs)
    )


def texts(data: Projection) -> dict[str, str]:
    """Return errors (median over the starts), shares, status and exponents; and all ranges."""
    rows: list[tuple[object, ...]] = []
    for name, sweep in (("probe", data.probe), ("network", data.network)):
        for x, error, share in zip(sweep.x, sweep.error, sweep.share, strict=True):
            alpha, sigma = (x, None) if name == "probe" else (None, x)
            status = "finished" if np.isfinite(error) else "failed"
            rows.append((name, alpha, sigma, error, share, status, None, None))
    for alpha, value, stderr in zip(data.exponent.alpha, data.exponent.exponent, data.exponent.stderr, strict=True):
        rows.append(("exponent", alpha, None, None, None, "finished", value, stderr))
    groups = (
        ("probe", "alpha", data.probe.intervals),
        ("exponent", "alpha", data.exponent.intervals),
        ("predicted", "sigma", data.predicted),
        ("measured", "sigma", data.network.intervals),
        ("published", "sigma", data.published),
    )
    ranges = [(name, variable, *ends) for name, variable, intervals in groups for ends in intervals]
    return {
        ".csv": as_csv(("curve", "alpha", "sigma", "e_avg", "share", "status", "exponent", "stderr"), rows),
        "_ranges.csv": as_csv(("range", "variable", "low", "high"), ranges),
    }


def draw(figure: Figure, data: Projection) -> tuple[Axes, Axes, Axes]:
    """Draw the probe (top left), the lines (top right) and the network (below the lines)."""
    figure.set_layout_engine("none")  # place the panels by hand, so close that the bands continue across them
    left, middle, right = (0.12, 0.345), 0.375, 0.885
    rays = figure.add_axes((middle, 0.40, right - middle, 0.51))
    probe = figure.add_axes((left[0], 0.40, left[1] - left[0], 0.51), sharey=rays)
    network = figure.add_axes((middle, 0.11, right - middle, 0.265), sharex=rays)
    bands(probe, data.probe.intervals, horizontal=True)
    error = finite(data.probe.error)
    probe.plot(error, data.probe.x, color=BLACK, linewidth=0.8)
    top = float(np.nanmax(error, initial=0.0)) or 1.0
    probe.set(xlim=(1.12 * top, -0.04 * top), ylabel=r"$|\alpha|$")
    probe.set_xlabel(r"$e_{\mathrm{II}}$", labelpad=4)
    probe.xaxis.set_major_locator(MaxNLocator(2))
    probe.xaxis.set_label_position("top")
    probe.tick_params(axis="x", labeltop=True, labelbottom=False)
    _draw_exponent(probe, data)
    _draw_rays(rays, data)
    _draw_network(network, data)
    # Draw the legend in the empty corner below the probe.
    bars = [
        Line2D([], [], color=color, marker="|", markersize=4, label=name)
        for name, color in (("measured", BLUE), ("published", ORANGE))
    ]
    grey = [Patch(color=GREY, label="probe"), Patch(color=DARK, label="predicted")]
    title = f"$n={data.scene.n}$\n$\\omega={data.scene.parameters['omega']:.2f}$\nsynchronous:"
    legend = probe.legend(
        handles=[*grey, *bars],
        title=title,
        fontsize=6.5,
        title_fontsize=7,
        handlelength=1.3,
        borderpad=0,
        loc="upper left",
        bbox_to_anchor=(-0.45, -0.22),
        labelspacing=0.5,
        alignment="left",
    )
    legend.set_in_layout(False)
    failed = sum(int((~np.isfinite(s.error)).sum()) for s in (data.probe, data.network))
    note(rays, failures(failed, len(data.probe.x) + len(data.network.x)))
    return probe, rays, network


def _draw_exponent(axes: Axes, data: Projection) -> None:
    """Draw the exponent against an axis below the panel, with a dot where it changes its sign."""
    alpha, value = data.exponent.alpha, finite(data.exponent.exponent)
    twin = axes.twiny()
    axes.xaxis.tick_top()
    twin.axvline(0.0, color=BLUE, linewidth=0.5, linestyle=":")
    twin.plot(value, alpha, color=BLUE, linewidth=0.7)
    roots = [end for interval in data.exponent.intervals for end in interval if alpha[0] < end < alpha[-1]]
    twin.plot(
        [0.0] * len(roots),
        roots,
        linestyle="none",
        marker="o",
        markersize=2.6,
        color=BLUE,
        markerfacecolor="white",
        markeredgewidth=0.8,
    )
    low, high = float(np.nanmin(value, initial=0.0)), float(np.nanmax(value, initial=0.0))
    margin = 0.08 * (high - low) or 1.0
    twin.set_xlim(high + margin, low - margin)
    twin.xaxis.set_label_position("bottom")
    twin.xaxis.tick_bottom()
    twin.set_xticks([0.0, *([float(f"{0.65 * low:.0e}")] if low < 0.0 else [])])
    twin.set_xlabel(r"$\Lambda$", labelpad=1, color=BLUE)
    twin.tick_params(axis="x", colors=BLUE, labelsize=6.5)


def _draw_rays(axes: Axes, data: Projection) -> None:
    """Draw the line alpha = sigma |gamma_k| of each mode, thick inside the probe's ranges."""
    low, high = 0.0, max(data.scene.axes[0].values)
    ceiling = float(data.probe.x[-1])
    bands(axes, data.probe.intervals, horizontal=True)
    bands(axes, data.predicted, color=DARK)
    modes = data.scene.spectrum.nonzero
    for k, mode in enumerate(modes):
        size = abs(mode.value)
        color, dashes = LINES[k % len(LINES)]
        axes.plot([low, high], [0.0, high * size], color=color, linestyle=dashes, linewidth=0.7)
        for a, b in intersect(scale(data.probe.intervals, 1.0 / size), [(low, high)]):
            axes.plot([a, b], [a * size, b * size], color=color, linewidth=1.8, solid_capstyle="butt")
        # the exact eigenvalue at the end of its line
        axes.annotate(
            f"${sp.latex(-mode.exact, order='rev-lex')}$",
            (high, min(high * size, ceiling)),
            xytext=(3, 0),
            textcoords="offset points",
            fontsize=6.5,
            color=color,
            va="center",
            annotation_clip=False,
        )
    axes.set(xlim=(low, high), ylim=(0.0, ceiling))
    axes.annotate(
        r"$|\gamma_k|$", (1.0, 1.0), xycoords="axes fraction", xytext=(3, 8), textcoords="offset points", fontsize=7.0
    )
    axes.set_title(r"$|\alpha| = \sigma\,|\gamma_k|$", fontsize=8.0, pad=5)
    axes.tick_params(labelleft=False, labelbottom=False)


def _draw_network(axes: Axes, data: Projection) -> None:
    bands(axes, data.predicted, color=DARK)
    error = finite(data.network.error)
    axes.plot(data.network.x, error, color=BLACK, linewidth=0.8)
    top = float(np.nanmax(error, initial=0.0)) or 1.0
    axes.set(ylim=(-0.04 * top, 1.42 * top), xlabel=r"coupling $\sigma$", ylabel=r"$e_{\mathrm{avg}}$")
    axes.yaxis.set_major_locator(MaxNLocator(4, prune="upper"))
    bracket(axes, data.network.intervals, 0.91, BLUE)
    bracket(axes, data.published, 0.80, ORANGE)
