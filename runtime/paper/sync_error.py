"""Figures 4a-c: the average synchronisation error of two oscillators against the coupling."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from synchain.models.scenes.file import load_scene

from ..plots.csv_table import Table, status_names
from ..plots.style import BLUE, COLUMN, ORANGE, bands, bracket, failures, note
from ..prediction.intervals import Interval, grid_intervals
from ..results.result import Result
from ..support.status import Status
from ..synchronisation.criterion import PAPER
from .figure_runs import FigureRuns
from .published import published

NAMES = ("figure_4a", "figure_4b", "figure_4c")
SIZE = (COLUMN, 2.2)


@dataclass(frozen=True, slots=True)
class Errors:
    """A result swept over sigma, and the published synchronous ranges."""

    result: Result
    published: tuple[Interval, ...]


def compute(name: str, runs: FigureRuns) -> Errors:
    """Run the scene of a figure, with its section so that figures 4d-f share the runs."""
    scene = load_scene(name)
    row = published(scene.n, scene.parameters["omega"])
    return Errors(runs.run(scene.replace(record=("sync_error", "section"))), row.intervals if row else ())


def synchronous(result: Result, tolerance: float = PAPER.tolerance) -> list[Interval]:
    """Find the ranges of the first axis with an average error below a tolerance."""
    x = result.data[result.scene.axes[0].name].values
    good = (result.status.values == Status.FINISHED) & (result.sync_error.values < tolerance)
    middles = 0.5 * (x[1:] + x[:-1])
    lower, upper = np.append(x[:1], middles), np.append(middles, x[-1:])
    left, right = dict(zip(x, lower, strict=True)), dict(zip(x, upper, strict=True))
    return [(float(left[a]), float(right[b])) for a, b in grid_intervals(x, good)]


def table(data: Errors) -> Table:
    """Return coupling, errors (average, largest, at the end of the window) and status."""
    result = data.result
    return Table.of(
        sigma=result.data["sigma"].values,
        e_avg=result.sync_error.values,
        e_max=result.sync_error_max.values,
        e_end=result.sync_error_end.values,
        status=status_names(result.status),
    )


def draw(axes: Axes, data: Errors) -> Axes:
    """Draw the error as a line, synchronous ranges in grey, the published range as a bar."""
    result = data.result
    sigma, good = result.data["sigma"].values, result.status.values == Status.FINISHED
    error = np.where(good, result.sync_error.values, np.nan)
    bands(axes, synchronous(result))
    axes.plot(sigma, error, color=BLUE, linewidth=0.8)
    top = float(np.nanmax(error)) if good.any() else 1.0
    axes.set(
        xlim=(sigma.min(), sigma.max()),
        ylim=(-0.03 * top, 1.22 * top or 1.0),
        xlabel=r"coupling $\sigma$",
        ylabel=r"$e_{\mathrm{avg}}$",
    )
    bracket(axes, data.published, 0.93, ORANGE, "published")
    note(axes, failures(int((~good).sum()), len(sigma)))
    return axes
