"""Figure 1b: friction force over relative velocity, set-valued and smoothed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import sympy as sp
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from synchain.models.mechanics.contact import SLIDING, regularise
from synchain.models.scenes.file import load_scene

from ..plots.csv_table import as_csv
from ..plots.style import BLUE, COLUMN, ORANGE
from .figure_runs import FigureRuns

NAMES = ("figure_1b",)
SIZE = (COLUMN, 2.5)


class FrictionCurve(NamedTuple):
    w: np.ndarray  # (k,): relative velocities
    sharp: np.ndarray  # (k,): set-valued law, NaN at the jump
    smooth: np.ndarray  # (k,): smoothed law
    kappa: float  # steepness of the smoothed law


def compute(name: str, runs: FigureRuns) -> FrictionCurve:
    """Evaluate the friction law of the scene; nothing is simulated."""
    scene = load_scene(name)
    law = scene.model.kinds[0].friction
    assert law is not None  # the oscillator of this figure slips on a belt
    # The law at the parameters of the scene, and the law with its jump smoothed over the width 1 / kappa.
    kappa = sp.Symbol("kappa", real=True)
    values = {sp.Symbol(key, real=True): scene.parameters[key] for key in (*law.parameters, "kappa")}
    sharp, smooth = (
        sp.lambdify(SLIDING, force.subs(values), "numpy")
        for force in (law.force, regularise(law.force, SLIDING, kappa))
    )
    # Points crowd at the jump: the smoothed law rises within 1 / kappa.
    near = np.concatenate([np.geomspace(1e-2 / scene.parameters["kappa"], 1e-2, 200), np.linspace(1e-2, 1.0, 400)[1:]])
    w = np.concatenate([-near[::-1], [0.0], near])
    return FrictionCurve(w, np.where(w == 0.0, np.nan, sharp(w)), smooth(w), scene.parameters["kappa"])


def texts(data: FrictionCurve) -> dict[str, str]:
    """Return relative velocity, set-valued law and smoothed law."""
    return {".csv": as_csv(("theta_r", "f", "f_smoothed"), zip(data.w, data.sharp, data.smooth, strict=True))}


def draw(figure: Figure, data: FrictionCurve) -> Axes:
    """Draw the law over the whole range, and its jump magnified in an inset over kappa theta_r."""
    axes = figure.add_subplot()
    axes.axhline(0.0, color="0.75", linewidth=0.6, zorder=0)
    axes.axvline(0.0, color="0.75", linewidth=0.6, zorder=0)
    axes.plot(data.w, data.smooth, color=BLUE)
    axes.set(
        xlim=(-1, 1),
        ylim=(-0.36, 0.36),
        xticks=[-1, -0.5, 0, 0.5, 1],
        xlabel=r"relative velocity $\vartheta_r$",
        ylabel=r"friction $f(\vartheta_r)$",
    )
    inset = axes.inset_axes((0.62, 0.17, 0.35, 0.31))
    near = np.abs(data.w) <= 12.0 / data.kappa
    inset.plot(data.w[near] * data.kappa, data.sharp[near], color=ORANGE, linestyle="--", linewidth=0.9)
    inset.plot(data.w[near] * data.kappa, data.smooth[near], color=BLUE)
    inset.set(xlim=(-10, 10), ylim=(-0.36, 0.36), yticks=[-0.3, 0, 0.3], xticks=[-10, 0, 10])
    inset.set_xlabel(r"$\kappa\,\vartheta_r$", fontsize=7, labelpad=1)
    inset.tick_params(labelsize=6.5, length=2)
    inset.annotate("law", (0.55, 0.11), xycoords="axes fraction", fontsize=6, color=ORANGE, va="center")
    inset.annotate("smoothed", (0.53, 0.40), xycoords="axes fraction", fontsize=6, color=BLUE, va="center")
    return axes
