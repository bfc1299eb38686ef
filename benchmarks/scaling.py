"""What one step of one oscillator costs in networks of 1 … 100 000, and in sweeps of 1 … 100 000
cells.

Networks: a fixed number of steps from the default start, one cell in a scalar kernel and, for
chains, as many cells as the processor has lanes; the time is that of the kernel alone. Sweeps: two
oscillators, cells that differ in the coupling, one drive period each, on one and two threads; the
time is that of the whole `run`, without compilation. Every row has a fresh process, so that its
peak of memory is its own (NaN where the platform does not tell); that peak contains the program
itself.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import TYPE_CHECKING

import numpy as np

from synchain.codegen.simd.lane_types import native_width
from synchain.models.graphs.families import family, topology
from synchain.models.scenes.scene import Scene
from synchain.runtime.cells.buffers import Buffers
from synchain.runtime.cells.plan import plan
from synchain.runtime.engines.scene_kernels import kernel
from synchain.runtime.engines.step_control import control_array
from synchain.runtime.sweeps.run import run

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = (
    "network",
    "n",
    "cells",
    "lanes",
    "threads",
    "steps per cell",
    "seconds",
    "nanoseconds per step and oscillator",
    "peak MB",
)
FAMILIES = ("chain", "ring", "star", "tree", "grid", "random_cubic")
NODES = (1, 2, 5, 10, 100, 1_000, 10_000, 100_000)
CELLS = (1, 10, 100, 1_000, 10_000, 100_000)
THREADS = (1, 2)
WORK = 2_000_000
"""Steps times oscillators times lanes of a timed run."""

Row = tuple[object, ...]


def measure(quick: bool = False) -> list[Row]:
    """Return the rows of the table, in the order of COLUMNS; `quick` takes one small case of each
    kind.
    """
    nodes = (2, 10) if quick else NODES
    work = 2_000 if quick else WORK
    rows = []
    for name in ("chain",) if quick else FAMILIES:
        for n in nodes:
            if n >= family(name).minimum:
                rows.append(apart(network_row, name, n, 1, work))
    lanes = native_width()
    rows += [apart(network_row, "chain", n, lanes, work) for n in nodes if lanes > 1]
    rows += [apart(sweep_row, c, threads) for c in (CELLS[:2] if quick else CELLS) for threads in THREADS]
    return rows


def apart(function: Callable[..., Row], *arguments: object) -> Row:
    """Call a function in a process of its own."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        row: Row = pool.submit(function, *arguments).result()
    return row


def network_row(name: str, n: int, lanes: int, work: int) -> Row:
    """Time a fixed number of steps of one network, the best of three runs; the kernel is compiled
    before.
    """
    scene = Scene(topology=topology(name, n), record=(), time_unit="time", transient=0.0, window=1e6)
    compiled = kernel(scene, lanes, reduce=False)
    one = plan(scene)
    cells = [np.repeat(part, lanes, axis=0) for part in (one.start, one.numbers, one.spans)]
    control = control_array(scene.rtol, scene.atol, math.inf, max(20, work // (n * lanes)))
    best = math.inf
    for _ in range(3):
        buffers = Buffers.empty(lanes, len(scene.y0), room=0, samples=0)
        begin = time.perf_counter()
        compiled.drive(0, lanes, *cells, control, *buffers.arrays())
        best = min(best, time.perf_counter() - begin)
    steps = int(buffers.counts[:, 1:3].sum())
    return (name, n, lanes, lanes, 1, steps / lanes, best, best / (steps * n) * 1e9, peak_memory())


def sweep_row(cells: int, threads: int) -> Row:
    """Time a sweep of the coupling of two oscillators over one drive period; the kernel is compiled
    before.
    """
    scene = Scene(topology=topology("chain", 2), record=("sync_error",), transient=0.0, window=1.0)
    run(scene, sigma=[0.0, 0.1], workers=1, show_progress=False)
    sigma = np.linspace(0.0, 0.3, cells)
    begin = time.perf_counter()
    found = run(scene, sigma=sigma, workers=threads, show_progress=False)
    seconds = time.perf_counter() - begin
    steps = int((found.steps + found.rejected).sum())
    cost = seconds / (steps * 2) * 1e9
    return ("chain", 2, cells, native_width(), threads, steps / cells, seconds, cost, peak_memory())


def peak_memory() -> float:
    """The most memory that this process has held, in MB; NaN where the platform does not tell."""
    try:
        import resource
        import sys
    except ImportError:  # Windows
        return math.nan
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most / (1e6 if sys.platform == "darwin" else 1e3)


def draw(rows: list[Row]) -> Figure:
    """Cost against the size of the network, and against the number of cells."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 3.0), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    sweeps = [row for row in rows if row[4] == 2 or (row[0] == "chain" and row[1] == 2 and row[3] != row[2])]
    networks = [row for row in rows if row not in sweeps]
    for name, lanes in dict.fromkeys((row[0], row[3]) for row in networks):
        chosen = [row for row in networks if (row[0], row[3]) == (name, lanes)]
        axes[0].plot([r[1] for r in chosen], [r[7] for r in chosen], marker="o", label=f"{name}, {lanes} lanes")
    for threads in dict.fromkeys(row[4] for row in sweeps):
        chosen = [row for row in sweeps if row[4] == threads]
        axes[1].plot([r[2] for r in chosen], [r[7] for r in chosen], marker="o", label=f"threads: {threads}")
    for ax, words in zip(axes, ("oscillators of one network", "cells of two oscillators"), strict=True):
        ax.set(xscale="log", yscale="log", xlabel=words)
        ax.legend()
    axes[0].set_ylabel("ns per step and oscillator")
    return figure
