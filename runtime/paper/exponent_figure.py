"""The master stability function of the friction oscillator at the paper's frequencies.

Stable ranges are grey; the published ranges of two oscillators are drawn beside them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from synchain.models.graphs.families import topology
from synchain.models.scenes.scene import Scene

from ..plots.csv_table import Table
from ..plots.exponent import draw_exponent
from ..plots.style import COLUMN, ORANGE, bracket
from ..prediction.intervals import Interval, scale
from ..stability.msf import MSF, msf
from .figure_runs import FigureRuns
from .published import PAIRS, published

NAMES = ("msf",)
SIZE = (COLUMN, 4.4)
HIGHEST = 1.2
"""Largest strength: that of the paper's probe, sigma = 0.6 of two oscillators."""


def curve(scene: Scene, runs: FigureRuns) -> MSF:
    """Return the master stability function of a scene's oscillator on 0 … HIGHEST."""
    pair = scene.replace(topology=topology("chain", 2), initial=None, axes=(), record=None, title="", sigma=0.0)
    alpha = np.linspace(0.0, HIGHEST, min(runs.quality.points or 241, 241))
    return runs.once(("msf", pair), lambda: msf(pair, alpha, **effort(runs)))


def effort(runs: FigureRuns) -> dict[str, Any]:
    """Options of `exponents` that fit the quality of the runs."""
    quality = runs.quality
    return {
        "precision": 2.0 * quality.resolution,
        "periods": 5.0 * quality.criterion.transient,
        "transient": 200.0,
        "starts": min(quality.criterion.starts, 4),
        **runs.options,
    }


def compute(name: str, runs: FigureRuns) -> tuple[MSF, ...]:
    """Return the function at each of the paper's frequencies."""
    return tuple(curve(Scene(topology=topology("chain", 2), parameters={"omega": omega}), runs) for omega in PAIRS)


def table(data: tuple[MSF, ...]) -> Table:
    """Return exponent and standard error, per unit of time, for each frequency and strength."""
    rows = [
        (found.scene.parameters["omega"], alpha, exponent, error)
        for found in data
        for alpha, exponent, error in zip(found.alpha, found.exponent, found.stderr, strict=True)
    ]
    return Table(("omega", "alpha", "exponent", "stderr"), tuple(rows))


def ranges(data: tuple[MSF, ...]) -> Table:
    """Return ranges of alpha with a negative exponent, errors of their ends, kind of motion."""
    rows = [
        (found.scene.parameters["omega"], low, high, *errors, found.attractors[0])
        for found in data
        for (low, high), errors in zip(found.intervals, found.uncertainties, strict=True)
    ]
    return Table(("omega", "low", "high", "low_error", "high_error", "motion"), tuple(rows))


def layout(figure: Figure) -> list[Axes]:
    """Add one pair of axes for each frequency, one above the other."""
    return list(figure.subplots(len(PAIRS), 1, sharex=True))


def draw(axes: list[Axes], data: tuple[MSF, ...]) -> list[Axes]:
    """Draw one curve in each panel, with the published range of two oscillators as a thin bar."""
    for panel, found in zip(axes, data, strict=True):
        draw_exponent(panel, found)
        row = published(2, found.scene.parameters["omega"])
        low, high = panel.get_ylim()
        panel.set_ylim(low, high + 0.16 * (high - low))
        bracket(panel, _inside(scale(row.intervals, 2.0), panel.get_xlim()) if row else (), 0.92, ORANGE, "published")
        motion = found.attractors[0].replace("drive periods", "periods")
        panel.set_title(rf"$\omega={found.scene.parameters['omega']:.2f}$, {motion}", fontsize=7.5, pad=3, loc="left")
        stable = ", ".join(f"{a:z.3f} … {b:z.3f}" for a, b in found.intervals[:2]) or "nowhere"
        panel.set_title(rf"$\Lambda<0$: {stable}", fontsize=7.0, pad=3, loc="right")
        panel.set_ylabel("")
        panel.label_outer()
    axes[0].figure.supylabel(r"exponent $\Lambda$ per unit of $\tau$", fontsize=8.5)
    return axes


def _inside(found: list[Interval], limits: tuple[float, float]) -> list[Interval]:
    """Intervals cut at the limits of an axis."""
    return [(max(a, limits[0]), min(b, limits[1])) for a, b in found if a < limits[1] and b > limits[0]]
