"""Simulated synchronous ranges as a function of the length of the transient, with the published ends.

Near an end of a range the error decays over thousands of periods, so a longer transient finds a wider range.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ..plots.csv_table import as_csv
from ..plots.style import COLUMN, ORANGE
from ..synchronisation.threshold import Sweep
from .figure_runs import FigureRuns
from .published import NOT_PERIODIC, PUBLISHED, Published
from .threshold_table import scene_of

EXTRA = ("transient",)
SIZE = (COLUMN, 3.6)
LENGTHS = (0.1, 0.3, 1.0, 3.0)  # lengths of transients, in units of the transient of the quality


class Trial(NamedTuple):
    """Sweeps over the same values of sigma after transients of different length."""

    row: Published
    transients: tuple[float, ...]  # lengths in drive periods
    sweeps: tuple[Sweep, ...]  # one sweep for each length


def compute(name: str, runs: FigureRuns) -> tuple[Trial, ...]:
    """Sweep sigma around the published ends, at frequencies without periodic motion."""
    transients = tuple(factor * runs.quality.criterion.transient for factor in LENGTHS)
    step = 0.001 if runs.quality.grid is None else 0.004
    offsets = step * np.arange(-round(0.02 / step), round(0.02 / step) + 1)
    trials = []
    for row in PUBLISHED:
        if row.omega in NOT_PERIODIC:
            scene, ends = scene_of(row.n, row.omega, runs), row.intervals[0]
            # values within 0.02 of either end, and a few between
            values = np.concatenate([*(end + offsets for end in ends), np.linspace(*ends, 6)])
            sigma = np.unique(np.round(values, 6))
            trials.append(Trial(row, transients, tuple(runs.after(scene, sigma, length) for length in transients)))
    return tuple(trials)


def texts(data: tuple[Trial, ...]) -> dict[str, str]:
    """Return error (median over the starts) and share of synchronised starts for every point."""
    rows = [
        (trial.row.n, trial.row.omega, transient, sigma, error, share, "finished" if np.isfinite(error) else "failed")
        for trial in data
        for transient, sweep in zip(trial.transients, trial.sweeps, strict=True)
        for sigma, error, share in zip(sweep.x, sweep.error, sweep.share, strict=True)
    ]
    return {".csv": as_csv(("n", "omega", "transient", "sigma", "e_avg", "share", "status"), rows)}


def draw(figure: Figure, data: tuple[Trial, ...]) -> list[Axes]:
    """Draw the share of synchronised starts over sigma and transient, published ends as lines."""
    panels = list(figure.subplots(2, 2, sharey=True).flat)
    for panel, trial in zip(panels, data, strict=True):
        share = np.array([sweep.share for sweep in trial.sweeps])
        heights = np.arange(len(trial.transients))
        mesh = panel.pcolormesh(
            trial.sweeps[0].x, heights, share, shading="nearest", cmap="Greys", vmin=0.0, vmax=1.25, rasterized=True
        )
        for end in trial.row.intervals[0]:
            panel.axvline(end, color=ORANGE, linewidth=1.0)
        panel.set_yticks(heights, [f"{length:g}" for length in trial.transients])
        panel.set_title(rf"$n={trial.row.n}$, $\omega={trial.row.omega:.2f}$", fontsize=7.5, pad=3)
        panel.tick_params(labelsize=6.5)
        panel.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    figure.supxlabel(r"coupling $\sigma$ (orange: published ends)", fontsize=8)
    figure.supylabel("transient (drive periods)", fontsize=8)
    bar = figure.colorbar(mesh, ax=panels, location="top", shrink=0.6, aspect=30, boundaries=np.linspace(0, 1, 101))
    bar.set_label("share of starts that synchronised", fontsize=7)
    bar.set_ticks([0, 0.5, 1])
    bar.ax.tick_params(labelsize=6.5)
    return panels
