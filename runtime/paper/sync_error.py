"""Figures 4a-c: the average synchronisation error of two oscillators against the coupling."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from synchain.models.scenes.file import load_scene

from ..plots.csv_table import as_csv, status_names
from ..plots.style import BLUE, COLUMN, ORANGE, bands, bracket, failures, note
from ..prediction.intervals import Interval, grid_intervals
from ..results.result import Result
from ..support.status import Status
from ..synchronisation.criterion import PAPER
from .figure_runs import FigureRuns
from .published import published_ranges

NAMES = ("figure_4a", "figure_4b", "figure_4c")
SIZE = (COLUMN, 2.2)


def compute(name: str, runs: FigureRuns) -> Result:
    """Run the scene of a figure; also record the section, so that figures 4d-f share the runs."""
    return runs.run(load_scene(name).replace(record=("sync_error", "section")))


def synchronous(result: Result, tolerance: float = PAPER.tolerance) -> list[Interval]:
    """Find the ranges of the first axis with an average error below a tolerance."""
    # A range extends half a step of the axis beyond its first and its last value.
    x = result.data[result.scene.axes[0].name].values
    good = (result.status.values == Status.FINISHED) & (result.sync_error.values < tolerance)
    middles = 0.5 * (x[1:] + x[:-1])
    lower = dict(zip(x, np.append(x[:1], middles), strict=True))
    upper = dict(zip(x, np.append(middles, x[-1:]), strict=True))
    return [(float(lower[a]), float(upper[b])) for a, b in grid_intervals(x, good)]


def texts(data: Result) -> dict[str, str]:
    """Return coupling, errors (average, largest, at the end of the window) and status."""
    errors = (data.sync_error.values, data.sync_error_max.values, data.sync_error_end.values)
    rows = zip(data.data["sigma"].values, *errors, status_names(data.status), strict=True)
    return {".csv": as_csv(("sigma", "e_avg", "e_max", "e_end", "status"), rows)}


def draw(figure: Figure, data: Result) -> Axes:
    """Draw the error as a line, synchronous ranges in grey, the published range as a bar."""
    axes = figure.add_subplot()
    sigma, good = data.data["sigma"].values, data.status.values == Status.FINISHED
    error = np.where(good, data.sync_error.values, np.nan)
    bands(axes, synchronous(data))
    axes.plot(sigma, error, color=BLUE, linewidth=0.8)
    top = float(np.nanmax(error)) if good.any() else 1.0
    axes.set(
        xlim=(sigma.min(), sigma.max()),
        ylim=(-0.03 * top, 1.22 * top or 1.0),
        xlabel=r"coupling $\sigma$",
        ylabel=r"$e_{\mathrm{avg}}$",
    )
    bracket(axes, published_ranges(data.scene), 0.93, ORANGE, "published")
    note(axes, failures(int((~good).sum()), len(sigma)))
    return axes
