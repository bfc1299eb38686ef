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

from ..plots.csv_table import as_csv
from ..plots.exponent import draw_exponent
from ..plots.style import COLUMN, ORANGE, bracket
from ..prediction.intervals import intersect, scale
from ..stability.msf import MSF, msf
from .figure_runs import FigureRuns
from .published import PAIRS, published_ranges

NAMES = ("msf",)
SIZE = (COLUMN, 4.4)
# Largest strength alpha: the largest of the paper's two-oscillator probe, alpha = 2 sigma with sigma = 0.6.
HIGHEST = 1.2


def curve(scene: Scene, runs: FigureRuns) -> MSF:
    """Return the master stability function of a scene's oscillator on 0 … HIGHEST."""
    pair = scene.replace(topology=topology("chain", 2), initial=None, axes=(), record=None, title="", sigma=0.0)
    alpha = np.linspace(0.0, HIGHEST, min(runs.quality.points or 241, 241))
    return runs.once(("msf", pair), lambda: msf(pair, alpha, **effort(runs)))


def effort(runs: FigureRuns) -> dict[str, Any]:
    """Return the options of `exponents` for the quality of the runs."""
    quality = runs.quality
    return {
        "precision": 2.0 * quality.resolution,
        "periods": 5.0 * quality.criterion.transient,
        "transient": 200.0,
        "starts": min(quality.criterion.starts, 4),
        **runs.options,
    }


def compute(name: str, runs: FigureRuns) -> tuple[MSF, ...]:
    """Return the master stability function at each frequency of the paper."""
    return tuple(curve(Scene(topology=topology("chain", 2), parameters={"omega": omega}), runs) for omega in PAIRS)


def texts(data: tuple[MSF, ...]) -> dict[str, str]:
    """Return exponents with standard errors, per unit of time, and the ranges with a negative exponent."""
    curves = [
        (function.scene.parameters["omega"], *point)
        for function in data
        for point in zip(function.alpha, function.exponent, function.stderr, strict=True)
    ]
    ranges = [
        (function.scene.parameters["omega"], *interval, *errors, function.attractors[0])
        for function in data
        for interval, errors in zip(function.intervals, function.uncertainties, strict=True)
    ]
    return {
        ".csv": as_csv(("omega", "alpha", "exponent", "stderr"), curves),
        "_ranges.csv": as_csv(("omega", "low", "high", "low_error", "high_error", "motion"), ranges),
    }


def draw(figure: Figure, data: tuple[MSF, ...]) -> list[Axes]:
    """Draw one curve in each panel, with the published range of two oscillators as a thin bar."""
    panels = list(figure.subplots(len(data), 1, sharex=True))
    for panel, function in zip(panels, data, strict=True):
        draw_exponent(panel, function)
        low, high = panel.get_ylim()
        panel.set_ylim(low, high + 0.16 * (high - low))
        published = scale(published_ranges(function.scene), 2.0)  # alpha = 2 sigma
        bracket(panel, intersect(published, [panel.get_xlim()]), 0.92, ORANGE, "published")
        motion = function.attractors[0].replace("drive periods", "periods")
        panel.set_title(
            rf"$\omega={function.scene.parameters['omega']:.2f}$, {motion}", fontsize=7.5, pad=3, loc="left"
        )
        stable = ", ".join(f"{a:z.3f} … {b:z.3f}" for a, b in function.intervals[:2]) or "nowhere"
        panel.set_title(rf"$\Lambda<0$: {stable}", fontsize=7.0, pad=3, loc="right")
        panel.set_ylabel("")
        panel.label_outer()
    figure.supylabel(r"exponent $\Lambda$ per unit of $\tau$", fontsize=8.5)
    return panels
