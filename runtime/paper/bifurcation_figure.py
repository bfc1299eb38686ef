"""Figures 3 and 4d-f: bifurcation diagrams, the position at the section over frequency or coupling.

Every cell starts from the initial state of the scene. In figures whose names end in _up and _down each cell continues
from the final state of its neighbour; differences between the diagrams show coexisting attractors.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from synchain.models.scenes.file import load_scene

from ..plots.csv_table import as_csv, status_names
from ..plots.style import BLACK, COLUMN, ORANGE, bands, bracket, failures, note
from ..results.result import Result
from ..support.status import Status
from .figure_runs import FigureRuns
from .published import published_ranges
from .sync_error import synchronous

NAMES = ("figure_3", "figure_4d", "figure_4e", "figure_4f")
EXTRA = tuple(f"{name}_{direction}" for name in NAMES for direction in ("up", "down"))
SIZE = (COLUMN, 2.5)
LABELS = {"omega": r"drive frequency $\omega$", "sigma": r"coupling $\sigma$"}


def compute(name: str, runs: FigureRuns) -> Result:
    """Run the scene of a figure; several oscillators also record their synchronisation error."""
    plain, _, direction = name.removeprefix("figure_").partition("_")
    scene = load_scene(f"figure_{plain}")
    if scene.n > 1:
        scene = scene.replace(record=("sync_error", "section"))
    return runs.run(scene.replace(continuation=direction) if direction else scene)


def points(result: Result) -> np.ndarray:
    """Return axis value and section point of all finished cells. Shapes: returns (k, 2)."""
    values = result.data[result.scene.axes[0].name].values
    x = result.section.sel(component="x", node=1).values
    good = np.isfinite(x) & (result.status.values == Status.FINISHED)[:, None]
    return np.stack([np.broadcast_to(values[:, None], x.shape)[good], x[good]], axis=1)


def texts(data: Result) -> dict[str, str]:
    """Return one row for each section point; a cell without section points has one row with its status."""
    axis, states, section = data.scene.axes[0].name, data.scene.equations.state, data.states("section")
    rows: list[tuple[object, ...]] = []
    for k, (value, status) in enumerate(zip(data.data[axis].values, status_names(data.status), strict=True)):
        count = int(data.section_count.values[k]) if status == "finished" else 0
        rows += [(value, data.section_time.values[k, j], *section[k, j], status) for j in range(count)]
        if count == 0:
            rows.append((value, None, *[None] * len(states), status))
    return {".csv": as_csv((axis, "time", *states, "status"), rows)}


def draw(figure: Figure, data: Result) -> Axes:
    """Draw section points as dots, synchronous ranges in grey, the published range as a bar."""
    axes, axis = figure.add_subplot(), data.scene.axes[0].name
    x, y = points(data).T
    values = data.data[axis].values
    if "sync_error" in data.data:
        bands(axes, synchronous(data))
    axes.plot(
        x,
        y,
        linestyle="none",
        marker=".",
        markersize=float(np.clip(700.0 / max(len(values), 1), 0.9, 2.2)),  # larger for few columns of dots
        color=BLACK,
        markeredgewidth=0.0,
        rasterized=True,
    )
    axes.set(xlim=(values.min(), values.max()), xlabel=LABELS[axis], ylabel=r"$\chi_1$ at the section")
    published = published_ranges(data.scene) if data.scene.n > 1 else ()
    if published and len(y):  # room for the bar above the dots
        low, high = y.min(), y.max()
        axes.set_ylim(low - 0.05 * (high - low), high + 0.16 * (high - low))
    bracket(axes, published, 0.95, ORANGE, "published")
    failed = int((data.status.values != Status.FINISHED).sum())
    note(axes, failures(failed, len(values)))
    return axes
