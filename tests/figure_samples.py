"""What the tests of the figures share: results that nothing was simulated for, and ways to look at what was drawn."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from synchain import Scene
from synchain.results import MSF, Exponents, Plane, Result, Status
from synchain.runtime.paper import exponent_figure, figure_runs, load, make, plane_figure, synchronisability_map
from synchain.runtime.plots import style
from synchain.runtime.results.labels import States
from synchain.runtime.stability.attractor import Attractor, Motion
from synchain.runtime.synchronisation.criterion import PAPER
from synchain.runtime.synchronisation.threshold import Sweep, project

RANGE = {1.15: (0.0, 0.466), 1.4: (0.09, 0.6), 1.55: (0.176, 0.594)}
"""Ranges of alpha that the stand-in for the simulation pretends to measure."""
TINY = figure_runs.Quality(9, 13, replace(PAPER, starts=1), 1e-3, (5,))


def pretend(scene: Scene, failed: tuple[int, ...] = (), **options: Any) -> Result:
    """A result of the right shape whose numbers are simple functions of the cell; some cells have failed."""
    shape, dimension = scene.shape, len(scene.y0)
    cells = np.arange(math.prod(shape), dtype=float)
    status = np.full(len(cells), int(Status.FINISHED), np.int32)
    status[list(failed)] = Status.DIVERGED
    dims = ("cell",) if scene.zipped else tuple(axis.name for axis in scene.axes)
    data: dict[str, Any] = {"status": (dims, status.reshape(shape))}
    states, table = ("component", "node"), States.of(scene).table
    data["end"] = ((*dims, *states), table((cells[:, None] + np.arange(dimension)).reshape(*shape, dimension)))
    for name in ("sync_error", "sync_error_max", "sync_error_end"):
        data[name] = (dims, np.where(cells % 3 == 1, 0.0, 0.1 * cells + 0.1).reshape(shape))
    if "section" in scene.record:
        counts = (cells % 3).astype(np.int32)
        inside = np.arange(2) < counts[:, None]
        data["section_count"] = (dims, counts.reshape(shape))
        data["section_time"] = ((*dims, "point"), np.where(inside, cells[:, None], np.nan).reshape(*shape, 2))
        points = np.where(inside[..., None], 0.1 * cells[:, None, None] + np.arange(dimension), np.nan)
        data["section"] = ((*dims, "point", *states), table(points.reshape(*shape, 2, dimension)))
    if "trajectory" in scene.record:
        waves = np.sin(np.linspace(0, 6, 20)[:, None] + np.arange(dimension))
        data["time"] = (("sample",), np.linspace(0, 6, 20))
        data["trajectory"] = ((*dims, "sample", *states), table(np.broadcast_to(waves, (*shape, *waves.shape))))
    coordinates: dict[str, Any] = {"component": list(scene.equations.components), "node": np.arange(1, scene.n + 1)}
    for axis in scene.axes:
        coordinates[axis.name] = ("cell" if scene.zipped else axis.name, np.array(axis.values))
    return Result(xr.Dataset(data, coordinates), scene)


class Simulation:
    """Answers in place of runs and sweeps, and remembers what it was asked for."""

    def __init__(self) -> None:
        self.runs: list[Scene] = []
        self.probes: list[tuple[float, int]] = []
        self.networks: list[tuple[int, float, int]] = []
        self.functions: list[tuple[str, float, int]] = []
        self.failed: tuple[int, ...] = ()

    def install(self, monkeypatch: pytest.MonkeyPatch) -> Simulation:
        """Stand in for the runs and sweeps, and make both qualities tiny."""
        for name in ("run", "probe", "simulate"):
            monkeypatch.setattr(figure_runs, name, getattr(self, name))
        monkeypatch.setattr(exponent_figure, "msf", self.msf)
        monkeypatch.setattr(plane_figure, "plane", self.plane)
        monkeypatch.setattr(synchronisability_map, "exponents", self.exponents)
        monkeypatch.setattr(make, "QUICK", TINY)
        monkeypatch.setattr(make, "FULL", TINY)
        return self

    def run(self, scene: Scene, **options: Any) -> Result:
        self.runs.append(scene)
        return pretend(scene, self.failed)

    def probe(self, scene: Scene, alpha: np.ndarray, **options: Any) -> Sweep:
        omega = scene.parameters["omega"]
        self.probes.append((omega, len(alpha)))
        low, high = RANGE[omega]
        good = (alpha >= low) & (alpha <= high)
        return Sweep(alpha, np.where(good, 0.0, 0.2), good.astype(float), ((low, high),))

    def simulate(self, scene: Scene, sigma: np.ndarray, **options: Any) -> Sweep:
        omega = scene.parameters["omega"]
        self.networks.append((scene.n, omega, len(sigma)))
        windows = project([RANGE[omega]], scene.spectrum, float(sigma[-1]))
        good = np.array([any(a <= s <= b for a, b in windows) for s in sigma])
        error = np.where(good, 0.0, 0.3)
        error[list(self.failed)] = np.inf
        return Sweep(sigma, error, good.astype(float), tuple(windows))

    def exponents(self, scene: Scene, alpha: np.ndarray, omega: float | None = None, **options: Any) -> Exponents:
        omega = scene.parameters["omega"] if omega is None else omega
        self.functions.append(("exponents", omega, len(alpha)))
        return parabola(omega, alpha)

    def msf(self, scene: Scene, alpha: np.ndarray, **options: Any) -> MSF:
        omega = scene.parameters["omega"]
        self.functions.append(("msf", omega, len(alpha)))
        return MSF(scene, alpha, parabola(omega, np.union1d(alpha, np.linspace(alpha[0], alpha[-1], 1001))))

    def plane(self, scene: Scene, alpha: np.ndarray, beta: np.ndarray, **options: Any) -> Plane:
        omega = scene.parameters["omega"]
        self.functions.append(("plane", omega, len(alpha) * len(beta)))
        table = parabola(omega, alpha).exponent[:, None] + beta**2
        return Plane(scene, alpha, beta, table, np.full(table.shape, 1e-3), np.array([[["aperiodic"]]]), 500.0)


def parabola(omega: float, alpha: np.ndarray) -> Exponents:
    """Exponents that vanish at the ends of RANGE, those of 1.4 where omega has none, with an error of 0.001."""
    low, high = RANGE.get(omega, RANGE[1.4])
    value = (alpha - low) * (alpha - high)
    return Exponents(
        alpha, value, np.full(len(alpha), 1e-3), 500.0, 1, value[None], (Attractor(Motion.APERIODIC, 0.0),)
    )


def drawn(name: str, runs: figure_runs.FigureRuns) -> tuple[Any, Any]:
    """Axes and data of a figure."""
    module = load(name)
    data = module.compute(name, runs)
    with style.context():
        return module.draw(style.new_figure(module.SIZE), data), data


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def words(axes: Any) -> list[str]:
    return [text.get_text() for text in axes.texts]
