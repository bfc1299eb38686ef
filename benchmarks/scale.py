"""Sweeps that stream to disk: a map over omega and sigma of 100 … 100 000 cells, or a million with
`--long`.

Two oscillators, 100 periods of the drive and a window of 20 (for a million cells 20 and a window of
10), on two threads; the time is that of the cells without the kernel, the memory is the peak of a
fresh process, program included, and the file is the finished result. Memory that does not grow with
the number of cells is what this is for.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from synchain.models.graphs.families import topology
from synchain.models.scenes.scene import Scene
from synchain.models.sweeps.axis import Axis
from synchain.runtime.sweeps.stream import stream

from .scaling import apart, peak_memory

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = (
    *("cells", "periods", "threads", "seconds", "cells per second", "steps per cell"),
    *("peak MB", "file MB", "bytes per cell"),
)
SIDES = (10, 32, 100, 316)
"""Values of each of the two axes."""
LONG = (*SIDES, 1000)
PERIODS = (100.0, 20.0)
"""Periods before the window, and of the window."""
SHORT = (20.0, 10.0)
"""The same for the map of a million cells, which would otherwise take an hour."""
THREADS = 2

Row = tuple[object, ...]


def measure(quick: bool = False) -> list[Row]:
    """Return the rows of the table in the order of COLUMNS; `quick` takes the two smallest maps."""
    return [apart(row, side) for side in (SIDES[:2] if quick else SIDES)]


def measure_long() -> list[Row]:
    """The same up to a million cells, which take ten minutes on two idle cores."""
    return [apart(row, side) for side in LONG]


def periods(side: int) -> tuple[float, float]:
    """Periods before the window and of the window of a map of side * side cells."""
    return SHORT if side > max(SIDES) else PERIODS


def scene(side: int) -> Scene:
    """A map of side * side cells."""
    transient, window = periods(side)
    axes = [Axis.between("omega", 1.0, 1.9, side), Axis.between("sigma", 0.0, 0.6, side)]
    return Scene(topology=topology("chain", 2), record=("sync_error",), transient=transient, window=window, axes=axes)


def row(side: int) -> Row:
    """Run one map to a file and measure."""
    import xarray as xr

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "map.nc")
        stream(scene(2), path, workers=THREADS, show_progress=False)  # the kernel, and all that is loaded once
        done = stream(scene(side), path, overwrite=True, workers=THREADS, show_progress=False)
        memory, size = peak_memory(), path.stat().st_size
        with xr.open_dataset(path, engine="scipy") as data:
            steps = float(data.steps.mean() + data.rejected.mean())
    cells, seconds = side * side, done.progress.running
    return (cells, sum(periods(side)), THREADS, seconds, cells / seconds, steps, memory, size / 1e6, size / cells)


def draw(rows: list[Row]) -> Figure:
    """Throughput and memory against the number of cells."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 3.0), layout="constrained")
    for axes, column, low in zip(figure.subplots(1, 2), (4, 6), (None, 0.0), strict=True):
        axes.plot([r[0] for r in rows], [r[column] for r in rows], marker="o")
        axes.set(xscale="log", xlabel="cells", ylabel=COLUMNS[column], ylim=(low, None))
    return figure
