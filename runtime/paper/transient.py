"""Measured synchronous ranges over the length of the transient, beside the published ends.

Near an end the error decays over thousands of periods, so that a longer transient finds a wider
range.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ..plots.csv_table import Table
from ..plots.style import COLUMN, ORANGE
from ..prediction.intervals import Interval
from ..synchronisation.threshold import Sweep
from .figure_runs import FigureRuns
from .published import NOT_PERIODIC, PUBLISHED, Published
from .threshold_table import scene_of

EXTRA = ("transient",)
SIZE = (COLUMN, 3.6)
ROWS = tuple(row for row in PUBLISHED if row.omega in NOT_PERIODIC)
LENGTHS = (1.0, 0.3, 0.1, 3.0)
"""Transients in units of that of the quality."""


@dataclass(frozen=True, slots=True)
class Trial:
    """Sweeps over the same values of sigma after transients of different length."""

    row: Published
    transients: tuple[float, ...]  # lengths in drive periods
    sweeps: tuple[Sweep, ...]  # one sweep for each length


def compute(name: str, runs: FigureRuns) -> tuple[Trial, ...]:
    """Sweep sigma around the published ends of the rows without periodic motion."""
    transients = tuple(sorted(factor * runs.quality.criterion.transient for factor in LENGTHS))
    trials = []
    for row in ROWS:
        scene, sigma = scene_of(row.n, row.omega, runs), _grid(row.intervals[0], runs)
        trials.append(Trial(row, transients, tuple(runs.after(scene, sigma, length) for length in transients)))
    return tuple(trials)


def _grid(interval: Interval, runs: FigureRuns) -> np.ndarray:
    """Values of sigma within 0.02 of either end, and a few between."""
    step = 0.001 if runs.quality.grid is None else 0.004
    near = [end + step * np.arange(-round(0.02 / step), round(0.02 / step) + 1) for end in interval]
    return np.unique(np.round(np.concatenate([*near, np.linspace(*interval, 6)]), 6))


def table(data: tuple[Trial, ...]) -> Table:
    """Return error (median over the starts) and share of synchronised starts for every point."""
    rows = []
    for trial in data:
        for transient, sweep in zip(trial.transients, trial.sweeps, strict=True):
            for sigma, error, share in zip(sweep.x, sweep.error, sweep.share, strict=True):
                status = "finished" if np.isfinite(error) else "failed"
                rows.append((trial.row.n, trial.row.omega, transient, sigma, error, share, status))
    return Table(("n", "omega", "transient", "sigma", "e_avg", "share", "status"), tuple(rows))


def layout(figure: Figure) -> list[Axes]:
    """Add one pair of axes for each row."""
    return list(figure.subplots(2, 2, sharey=True).flat)


def draw(axes: list[Axes], data: tuple[Trial, ...]) -> list[Axes]:
    """Draw the share of synchronised starts over sigma and transient, published ends as lines."""
    for panel, trial in zip(axes, data, strict=True):
        share = np.array([sweep.share for sweep in trial.sweeps])
        heights = np.arange(len(trial.transients))
        painted = panel.pcolormesh(
            trial.sweeps[0].x, heights, share, shading="nearest", cmap="Greys", vmin=0.0, vmax=1.25, rasterized=True
        )
        for end in trial.row.intervals[0]:
            panel.axvline(end, color=ORANGE, linewidth=1.0)
        panel.set_yticks(heights, [f"{length:g}" for length in trial.transients])
        panel.set_title(rf"$n={trial.row.n}$, $\omega={trial.row.omega:.2f}$", fontsize=7.5, pad=3)
        panel.tick_params(labelsize=6.5)
        panel.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    figure = axes[0].figure
    figure.supxlabel(r"coupling $\sigma$ (orange: published ends)", fontsize=8)
    figure.supylabel("transient (drive periods)", fontsize=8)
    bar = figure.colorbar(painted, ax=axes, location="top", shrink=0.6, aspect=30, boundaries=np.linspace(0, 1, 101))
    bar.set_label("share of starts that synchronised", fontsize=7)
    bar.set_ticks([0, 0.5, 1])
    bar.ax.tick_params(labelsize=6.5)
    return axes
