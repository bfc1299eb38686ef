"""Figures 3 and 4d-f: bifurcation diagrams, the position at the section over frequency or coupling.

Every cell starts from the initial state of the scene. Names that end in _up and _down are the same
diagrams with each cell continued from its neighbour; differences between them show coexisting
attractors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from synchain.models.scenes.file import load_scene

from ..plots.csv_table import Table, status_names
from ..plots.style import BLACK, COLUMN, ORANGE, bands, bracket, failures, note
from ..results.result import Result
from ..support.status import Status
from .figure_runs import FigureRuns
from .published import published
from .sync_error import synchronous

NAMES = ("figure_3", "figure_4d", "figure_4e", "figure_4f")
EXTRA = tuple(f"{name}_{direction}" for name in NAMES for direction in ("up", "down"))
SIZE = (COLUMN, 2.5)
LABELS = {"omega": r"drive frequency $\omega$", "sigma": r"coupling $\sigma$"}


@dataclass(frozen=True, slots=True)
class Diagram:
    """A swept result with section points."""

    result: Result  # result with one axis
    axis: str  # name of the axis
    published: tuple[tuple[float, float], ...]  # ranges of the axis that the paper calls synchronous


def compute(name: str, runs: FigureRuns) -> Diagram:
    """Run the scene of a figure; several oscillators also record their synchronisation error."""
    plain, _, direction = name.removeprefix("figure_").partition("_")
    scene = load_scene(f"figure_{plain}")
    if scene.n > 1:
        scene = scene.replace(record=("sync_error", "section"))
    if direction:
        scene = scene.replace(continuation=direction)
    row = published(scene.n, scene.parameters["omega"]) if scene.n > 1 else None
    return Diagram(runs.run(scene), scene.axes[0].name, row.intervals if row else ())


def points(data: Diagram) -> tuple[np.ndarray, np.ndarray]:
    """Collect the section points of all finished cells. Shapes: returns points (k, 2), cell (k,)."""
    result = data.result
    values = result.data[data.axis].values
    x = result.section.sel(component="x", node=1).values
    good = np.isfinite(x) & (result.status.values == Status.FINISHED)[:, None]
    cell = np.broadcast_to(np.arange(len(values))[:, None], x.shape)[good]
    return np.stack([values[cell], x[good]], axis=1), cell


def table(data: Diagram) -> Table:
    """Return one row for each section point; a cell without any has one row with its status."""
    result = data.result
    states, section = result.scene.equations.state, result.states("section")
    rows: list[tuple[object, ...]] = []
    names = status_names(result.status)
    for k, value in enumerate(result.data[data.axis].values):
        count = int(result.section_count.values[k]) if names[k] == "finished" else 0
        for j in range(count):
            rows.append((value, result.section_time.values[k, j], *section[k, j], names[k]))
        if count == 0:
            rows.append((value, None, *[None] * len(states), names[k]))
    return Table((data.axis, "time", *states, "status"), tuple(rows))


def draw(axes: Axes, data: Diagram) -> Axes:
    """Draw section points as dots, synchronous ranges in grey, the published range as a bar."""
    found, _ = points(data)
    values = data.result.data[data.axis].values
    if "sync_error" in data.result.data:
        bands(axes, synchronous(data.result))
    axes.plot(
        found[:, 0],
        found[:, 1],
        linestyle="none",
        marker=".",
        markersize=_size(len(values)),
        color=BLACK,
        markeredgewidth=0.0,
        rasterized=True,
    )
    axes.set(
        xlim=(values.min(), values.max()), xlabel=LABELS.get(data.axis, data.axis), ylabel=r"$\chi_1$ at the section"
    )
    if data.published and len(found):
        low, high = found[:, 1].min(), found[:, 1].max()
        axes.set_ylim(low - 0.05 * (high - low), high + 0.16 * (high - low))
    bracket(axes, data.published, 0.95, ORANGE, "published")
    failed = int((data.result.status.values != Status.FINISHED).sum())
    note(axes, failures(failed, len(values)))
    return axes


def _size(cells: int) -> float:
    """Marker size in points: larger for few columns of dots."""
    return float(np.clip(700.0 / max(cells, 1), 0.9, 2.2))
