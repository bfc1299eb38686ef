"""Figures 5-8: the two-oscillator probe, projected through the eigenvalues of a network.

Top left: the probe e_II(alpha), drawn vertically, and the exponent of a mode with an axis of its
own, whose changes of sign are marked. Top right: the lines alpha = sigma |gamma_k|. Below: the
error of the network. Grey bands carry the probe's synchronous ranges to the lines. If all lines are
inside, a darker band leads down from there: the predicted range of sigma.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import sympy as sp
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from synchain.models.scenes.file import load_scene
from synchain.models.scenes.scene import Scene

from ..plots.csv_table import Table
from ..plots.exponent import finite
from ..plots.style import BLACK, BLUE, COLUMN, GREEN, GREY, ORANGE, PURPLE, bands, bracket, failures, note
from ..prediction.intervals import Interval, intersect, scale
from ..stability.msf import MSF
from ..synchronisation.threshold import Sweep
from .exponent_figure import curve
from .figure_runs import FigureRuns
from .published import published

NAMES = ("figure_5", "figure_6", "figure_7", "figure_8")
SIZE = (COLUMN, 4.0)
LINES = ((BLUE, "-"), (PURPLE, "--"), (GREEN, "-."), (BLACK, ":"))
DARK = "#bdbdbd"


@dataclass(frozen=True, slots=True)
class Projection:
    """Probe, network and ranges of one figure."""

    scene: Scene  # network
    probe: Sweep  # two-oscillator probe in alpha
    network: Sweep  # network in sigma
    predicted: tuple[Interval, ...]  # ranges of sigma predicted from the probe, and published
    published: tuple[Interval, ...]
    exponent: MSF  # master stability function


def compute(name: str, runs: FigureRuns) -> Projection:
    """Sweep the probe and the network of a figure's scene, and compute the exponents."""
    scene = load_scene(name)
    row = published(scene.n, scene.parameters["omega"])
    return Projection(
        scene,
        runs.pair(scene),
        runs.network(scene),
        tuple(runs.predicted(scene)),
        row.intervals if row else (),
        curve(scene, runs),
    )


def table(data: Projection) -> Table:
    """Return errors (median over the starts), shares and status; exponents and their errors."""
    rows: list[tuple[object, ...]] = []
    for what, sweep in (("probe", data.probe), ("network", data.network)):
        for x, error, share in zip(sweep.x, sweep.error, sweep.share, strict=True):
            place = (x, None) if what == "probe" else (None, x)
            rows.append((what, *place, error, share, "finished" if np.isfinite(error) else "failed", None, None))
    found = data.exponent
    for x, value, error in zip(found.alpha, found.exponent, found.stderr, strict=True):
        rows.append(("exponent", x, None, None, None, "finished", value, error))
    return Table(("curve", "alpha", "sigma", "e_avg", "share", "status", "exponent", "stderr"), tuple(rows))


def ranges(data: Projection) -> Table:
    """Return the synchronous ranges of probe and exponent in alpha, of the network in sigma."""
    groups = (
        ("probe", "alpha", data.probe.intervals),
        ("exponent", "alpha", data.exponent.intervals),
        ("predicted", "sigma", data.predicted),
        ("measured", "sigma", data.network.intervals),
        ("published", "sigma", data.published),
    )
    rows = [(what, variable, low, high) for what, variable, found in groups for low, high in found]
    return Table(("range", "variable", "low", "high"), tuple(rows))


def layout(figure: Figure) -> tuple[Axes, Axes, Axes]:
    """Add axes for the probe (top left), lines (top right) and the network (below the lines)."""
    figure.set_layout_engine("none")  # the panels stand so close that the bands run through
    left, middle, right = (0.12, 0.345), 0.375, 0.885
    rays = figure.add_axes((middle, 0.40, right - middle, 0.51))
    probe = figure.add_axes((left[0], 0.40, left[1] - left[0], 0.51), sharey=rays)
    network = figure.add_axes((middle, 0.11, right - middle, 0.265), sharex=rays)
    return probe, rays, network


def draw(axes: tuple[Axes, Axes, Axes], data: Projection) -> tuple[Axes, Axes, Axes]:
    """Draw probe, lines and network into the three axes of `layout`."""
    probe, rays, network = axes
    _draw_probe(probe, data)
    _draw_exponent(probe, data)
    _draw_rays(rays, data)
    _draw_network(network, data)
    _explain(probe, data)
    failed = sum(int((~np.isfinite(s.error)).sum()) for s in (data.probe, data.network))
    note(rays, failures(failed, len(data.probe.x) + len(data.network.x)))
    return axes


def _draw_probe(axes: Axes, data: Projection) -> None:
    bands(axes, data.probe.intervals, horizontal=True)
    error = _finite(data.probe.error)
    axes.plot(error, data.probe.x, color=BLACK, linewidth=0.8)
    top = float(np.nanmax(error, initial=0.0)) or 1.0
    axes.set(xlim=(1.12 * top, -0.04 * top), ylabel=r"$|\alpha|$")
    axes.set_xlabel(r"$e_{\mathrm{II}}$", labelpad=4)
    axes.xaxis.set_major_locator(MaxNLocator(2))
    axes.xaxis.set_label_position("top")
    axes.tick_params(axis="x", labeltop=True, labelbottom=False)


def _draw_exponent(axes: Axes, data: Projection) -> None:
    """The exponent against its own axis below the panel, with a dot where it changes its sign."""
    found, value = data.exponent, finite(data.exponent.exponent)
    own = axes.twiny()
    axes.xaxis.tick_top()
    own.axvline(0.0, color=BLUE, linewidth=0.5, linestyle=":")
    own.plot(value, found.alpha, color=BLUE, linewidth=0.7)
    ends = [end for interval in found.intervals for end in interval if found.alpha[0] < end < found.alpha[-1]]
    own.plot(
        [0.0] * len(ends),
        ends,
        linestyle="none",
        marker="o",
        markersize=2.6,
        color=BLUE,
        markerfacecolor="white",
        markeredgewidth=0.8,
    )
    low, high = float(np.nanmin(value, initial=0.0)), float(np.nanmax(value, initial=0.0))
    room = 0.08 * (high - low) or 1.0
    own.set_xlim(high + room, low - room)
    own.xaxis.set_label_position("bottom")
    own.xaxis.tick_bottom()
    own.set_xticks([0.0, *([float(f"{0.65 * low:.0e}")] if low < 0.0 else [])])
    own.set_xlabel(r"$\Lambda$", labelpad=1, color=BLUE)
    own.tick_params(axis="x", colors=BLUE, labelsize=6.5)


def _draw_rays(axes: Axes, data: Projection) -> None:
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
    error = _finite(data.network.error)
    axes.plot(data.network.x, error, color=BLACK, linewidth=0.8)
    top = float(np.nanmax(error, initial=0.0)) or 1.0
    axes.set(ylim=(-0.04 * top, 1.42 * top), xlabel=r"coupling $\sigma$", ylabel=r"$e_{\mathrm{avg}}$")
    axes.yaxis.set_major_locator(MaxNLocator(4, prune="upper"))
    bracket(axes, data.network.intervals, 0.91, BLUE)
    bracket(axes, data.published, 0.80, ORANGE)


def _explain(axes: Axes, data: Projection) -> None:
    """Draw the legend in the empty corner below the probe."""
    bars = [
        Line2D([], [], color=color, marker="|", markersize=4, label=what)
        for what, color in (("measured", BLUE), ("published", ORANGE))
    ]
    grey = [Patch(color=GREY, label="probe"), Patch(color=DARK, label="predicted")]
    title = f"$n={data.scene.n}$\n$\\omega={data.scene.parameters['omega']:.2f}$\nsynchronous:"
    legend = axes.legend(
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


def _finite(values: np.ndarray) -> np.ndarray:
    return np.where(np.isfinite(values), values, np.nan)
