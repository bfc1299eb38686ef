"""The basin of synchrony of a hundred Rössler oscillators, beside a plain run of the same starts and time.

All strengths lie where every mode of the graph decays, so that the share of synchrony is 1. A basin
computes exponents, observes two windows and decides; it ends starts that are certain to synchronise.
The plain run integrates every start to the end. Times are CPU times of two
threads together, without compilation.
"""

from __future__ import annotations

import time

import numpy as np

from synchain.models.definitions.inline import Field
from synchain.models.graphs.families import topology
from synchain.models.scenes.scene import Scene
from synchain.runtime.sweeps.run import run
from synchain.runtime.synchronisation.basin import basin

COLUMNS = (
    "program",
    "nodes",
    "strengths",
    "starts of each",
    "smallest share of synchrony",
    "its interval from",
    "largest error of the others",
    "CPU seconds",
    "ratio to the run",
)
NODE = Field({"x": "-y - z", "y": "x + a*y", "z": "a + z*(x - c)"}, parameters={"a": 0.2, "c": 9.0})
STRENGTHS = np.linspace(0.045, 0.095, 11)
RANGES = {"x": (-2.0, 2.0), "y": (-2.0, 2.0), "z": (0.0, 2.0)}
START = {"x": 1.0, "y": 0.0, "z": 1.0}
Row = tuple[object, ...]


def measure(quick: bool = False) -> list[Row]:
    """Return the rows of the table, in the order of COLUMNS; `quick` takes ten nodes and eight starts."""
    nodes, samples, strengths, workers = (10, 8, STRENGTHS[::5], 1) if quick else (100, 500, STRENGTHS, 2)
    graph = topology("complete", nodes) if quick else topology("erdos_renyi", nodes, p=0.2, seed=1)
    scene = Scene(NODE, "x->x", graph, initial=START, rtol=1e-6, transient=100, window=10, record=("sync_error",))
    rows: list[Row] = []
    for count in (1, samples):  # the first round compiles
        begun = time.process_time()
        found = basin(
            scene,
            sigma=strengths,
            samples=count,
            ranges=RANGES,
            transient=100,
            window=10,
            workers=workers,
            show_progress=False,
        )
        seconds = [time.process_time() - begun]
        # the same starts, as zipped axes of initial states
        columns = {name: np.tile(found.start[0][:, k], len(strengths)) for k, name in enumerate(scene.equations.state)}
        starts = scene.replace(axes={"sigma": np.repeat(strengths, count), **columns}, zipped=True)
        begun = time.process_time()
        plain = run(starts, workers=workers, show_progress=False)
        seconds.append(time.process_time() - begun)
    criterion = found.criterion
    assert criterion is not None
    error = np.asarray(plain["sync_error"]).reshape(len(strengths), -1)
    shares = found.shares.sel(attractor="synchronous").values
    low = found.intervals.sel(attractor="synchronous", bound="low").values.min()
    size = (nodes, len(strengths), samples)
    undecided = np.where(found.fate == found.labels.index("synchronous"), 0.0, found.error).max()
    together = (error < criterion.tolerance).mean(axis=1)
    rows.append(("basin", *size, shares.min(), low, undecided, seconds[0], seconds[0] / seconds[1]))
    rows.append(("run", *size, together.min(), float("nan"), error.max(), seconds[1], 1.0))
    return rows
