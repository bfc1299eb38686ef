"""Figure 1b: friction force over relative velocity, set-valued and smoothed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import sympy as sp
from matplotlib.axes import Axes

from synchain.models.mechanics.contact import SLIDING, regularise
from synchain.models.scenes.file import load_scene
from synchain.models.scenes.scene import Scene

from ..plots.csv_table import Table
from ..plots.style import BLUE, COLUMN, ORANGE
from .figure_runs import FigureRuns

NAMES = ("figure_1b",)
SIZE = (COLUMN, 2.5)
Function = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, slots=True)
class Law:
    """Friction coefficient at relative velocities."""

    w: np.ndarray  # (k,): relative velocities
    sharp: np.ndarray  # (k,): set-valued law, NaN at the jump
    smooth: np.ndarray  # (k,): smoothed law
    kappa: float  # steepness of the smoothed law


def compute(name: str, runs: FigureRuns) -> Law:
    """Evaluate the friction law of the scene; nothing is simulated."""
    scene = load_scene(name)
    kappa = scene.parameters["kappa"]
    near = np.concatenate([np.geomspace(1e-2 / kappa, 1e-2, 200), np.linspace(1e-2, 1.0, 400)[1:]])
    w = np.concatenate([-near[::-1], [0.0], near])
    sharp, smooth = forces(scene)
    return Law(w, np.where(w == 0.0, np.nan, sharp(w)), smooth(w), kappa)


def forces(scene: Scene) -> tuple[Function, Function]:
    """Return the friction coefficient by relative velocity, set-valued and smoothed."""
    law = scene.model.kinds[0].friction
    if law is None:
        raise ValueError(f"oscillator {scene.oscillator.name!r} takes no friction law; expected a scene with one")
    kappa = sp.Symbol("kappa", real=True)
    symbols = {key: sp.Symbol(key, real=True) for key in law.parameters}
    sharp = law.force
    numbers = {symbol: scene.parameters[key] for key, symbol in symbols.items()}
    numbers[kappa] = scene.parameters["kappa"]
    smooth = regularise(sharp, SLIDING, kappa)
    return sp.lambdify(SLIDING, sharp.subs(numbers), "numpy"), sp.lambdify(SLIDING, smooth.subs(numbers), "numpy")


def table(data: Law) -> Table:
    """Return relative velocity, set-valued law and smoothed law."""
    return Table.of(theta_r=data.w, f=data.sharp, f_smoothed=data.smooth)


def draw(axes: Axes, data: Law) -> Axes:
    """Draw the law over the whole range, and its jump magnified in an inset."""
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
    _magnify(axes.inset_axes((0.62, 0.17, 0.35, 0.31)), data)
    return axes


def _magnify(inset: Axes, data: Law) -> None:
    """Draw the jump over kappa theta_r: the law jumps, the smoothed law rises smoothly."""
    near = np.abs(data.w) <= 12.0 / data.kappa
    inset.plot(data.w[near] * data.kappa, data.sharp[near], color=ORANGE, linestyle="--", linewidth=0.9)
    inset.plot(data.w[near] * data.kappa, data.smooth[near], color=BLUE)
    inset.set(xlim=(-10, 10), ylim=(-0.36, 0.36), yticks=[-0.3, 0, 0.3], xticks=[-10, 0, 10])
    inset.set_xlabel(r"$\kappa\,\vartheta_r$", fontsize=7, labelpad=1)
    inset.tick_params(labelsize=6.5, length=2)
    inset.annotate("law", (0.55, 0.11), xycoords="axes fraction", fontsize=6, color=ORANGE, va="center")
    inset.annotate("smoothed", (0.53, 0.40), xycoords="axes fraction", fontsize=6, color=BLUE, va="center")
