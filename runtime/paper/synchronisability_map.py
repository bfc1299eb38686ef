"""Drive frequencies and couplings at which networks synchronise, by the largest exponent of their modes.

The master stability function Lambda(alpha) of one oscillator is computed once for all networks: the mode of the
eigenvalue gamma has the exponent Lambda(sigma |gamma|). If initial states lead to different motions, a network counts
as stable if it is stable for most initial states, as in `synchain.runtime.synchronisation.threshold`.

Source: Pecora & Carroll, Phys. Rev. Lett. 80, 2109 (1998).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from synchain.models.graphs.families import topology
from synchain.models.graphs.topology import Topology
from synchain.models.scenes.scene import Scene

from ..plots.csv_table import as_csv
from ..plots.style import COLUMN, ORANGE
from ..prediction.mode_windows import transversal_modes
from ..stability.exponents import exponents
from .exponent_figure import effort
from .figure_runs import FigureRuns
from .published import PUBLISHED

NAMES = ("synchronisability_map",)
SIZE = (COLUMN, 4.7)
NETWORKS = (("chain", 2), ("chain", 3), ("chain", 4), ("ring", 6), ("star", 5), ("complete", 5))
LOW, HIGH, SIGMA = 1.0, 1.8, 0.6  # lowest and highest frequency, and the largest coupling sigma


class Map(NamedTuple):
    """The master stability function of one oscillator at several frequencies."""

    omega: np.ndarray  # (omegas,): frequencies
    alpha: np.ndarray  # (strengths,): strengths
    sigma: np.ndarray  # (sigmas,): couplings of the panels
    exponent: np.ndarray  # (omegas, starts, strengths): exponents per unit of time
    attractors: tuple[str, ...]  # for each frequency the kinds of motion that the initial states reach


def compute(name: str, runs: FigureRuns) -> Map:
    quality = runs.quality
    grid = quality.grid or 241
    omega = np.linspace(LOW, HIGH, grid // 2 + 1 if quality.grid else 161)
    sigma = np.linspace(0.0, SIGMA, grid)
    steepest = max(mode.size for graph in _graphs() for mode in transversal_modes(graph))
    alpha = np.linspace(0.0, SIGMA * steepest, 2 * grid - 1)
    options = effort(runs) | {
        "precision": 10.0 * quality.resolution,
        "transient": 100.0,
        "periods": quality.criterion.transient,
        "starts": min(quality.criterion.starts, 3),
    }
    pair = Scene(topology=topology("chain", 2))
    functions = [exponents(pair, alpha, omega=float(value), **options) for value in omega]
    kinds = tuple("; ".join(dict.fromkeys(a.kind for a in e.attractors)) for e in functions)
    return Map(omega, alpha, sigma, np.array([e.by_start for e in functions]), kinds)


def _graphs() -> list[Topology]:
    return [topology(name, n) for name, n in NETWORKS]


def largest_exponent(data: Map, graph: Topology) -> np.ndarray:
    """Return the largest exponent of the modes of a network, as the median over the initial states."""
    # Shapes: returns (omegas, sigmas).
    strengths = [data.sigma * mode.size for mode in transversal_modes(graph)]
    # (omegas, starts, modes, sigmas)
    by_mode = [[[np.interp(x, data.alpha, row) for x in strengths] for row in starts] for starts in data.exponent]
    return np.asarray(np.median(np.max(by_mode, axis=2), axis=1))


def texts(data: Map) -> dict[str, str]:
    """Return the largest exponent, per unit of time, of each network at every point."""
    graphs = _graphs()
    omega, sigma = np.meshgrid(data.omega, data.sigma, indexing="ij")
    motion = np.repeat(np.array(data.attractors, dtype=object), len(data.sigma))
    columns = [omega.reshape(-1), sigma.reshape(-1), *(largest_exponent(data, g).reshape(-1) for g in graphs), motion]
    names = ("omega", "sigma", *(f"{graph.name}_{graph.n}" for graph in graphs), "motion")
    return {".csv": as_csv(names, zip(*columns, strict=True))}


def draw(figure: Figure, data: Map) -> list[Axes]:
    """Draw stable points in colours, others white, published ranges of chains as bars."""
    panels, graphs = list(figure.subplots(3, 2, sharex=True, sharey=True).flat), _graphs()
    values = [largest_exponent(data, graph) for graph in graphs]
    stable = np.concatenate([-v[(v < 0) & np.isfinite(v)] for v in values])
    top = float(np.quantile(stable, 0.99)) if stable.size else 1.0
    for panel, graph, value in zip(panels, graphs, values, strict=True):
        speed = np.where(value < 0, np.minimum(-value, top), np.nan)
        mesh = panel.pcolormesh(
            data.omega, data.sigma, speed.T, shading="nearest", cmap="cividis_r", vmin=0.0, vmax=top, rasterized=True
        )
        panel.set_title(f"{graph.name}({graph.n})", fontsize=7.5, pad=3)
        panel.set(xlim=(data.omega[0], data.omega[-1]), ylim=(0.0, data.sigma[-1]))
        panel.tick_params(labelsize=7)
        for row in PUBLISHED:
            if (graph.name, graph.n) == ("chain", row.n):
                for ends in row.intervals:
                    panel.plot([row.omega] * 2, ends, color=ORANGE, linewidth=1.2, marker="_", markersize=4.0)
    figure.supxlabel(r"drive frequency $\omega$ (white: not stable; orange: published)", fontsize=8.0)
    figure.supylabel(r"coupling $\sigma$", fontsize=8.0)
    bar = figure.colorbar(mesh, ax=panels, location="top", aspect=35, shrink=0.9, pad=0.02, extend="max")
    bar.set_label(r"rate of synchronisation $-\max\,\Lambda(\sigma|\gamma_k|)$ per unit of $\tau$", fontsize=7.5)
    bar.ax.tick_params(labelsize=7)
    return panels
