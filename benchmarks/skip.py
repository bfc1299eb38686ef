"""What each skip saves: arithmetic operations of a step, time and answer with it and without it.

Operations are those of one step of all oscillators, counted as `_operations.py` says; searching
sections, sampling and the synchronisation error are not part of a step and show in the time alone,
which is CPU time of whole runs. The answer is everything that both runs record: the largest
difference over all cells, relative where a number is larger than 1, over the first twentieth of the
time and at rtol 1e-10, since unstable motions part by rounding alone when they are given the time.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from synchain.models.graphs.families import topology
from synchain.models.scenes.scene import Scene
from synchain.models.sweeps.axis import Axis
from synchain.runtime.cells.reduce import ReducedScene, reduce_scene
from synchain.runtime.engines.scene_kernels import kernel_source
from synchain.runtime.results.result import Result
from synchain.runtime.sweeps.run import run

from .kit.operations import operations

__all__ = ["CASES", "COLUMNS", "Case", "difference", "measure", "operations"]

COLUMNS = (
    "skipped",
    "oscillators",
    "operations a step",
    "operations without the skip",
    "milliseconds",
    "milliseconds without the skip",
    "times faster",
    "largest difference",
)

PARAMETERS = {"theta_b": 0.1, "sigma": 0.3}


@dataclass(frozen=True, slots=True)
class Case:
    """A skip and a scene in which it applies; `less` is what the scene with the skip has otherwise
    than the one without.

    Without `less` the skip is a reduction, and the same scene is run with and without it;
    `fold_all` folds every number.
    """

    name: str
    n: int
    given: dict[str, Any] = field(default_factory=dict)
    less: dict[str, object] = field(default_factory=dict)
    fold_all: bool = False
    graph: str = "chain"


CASES = (
    Case("no synchronisation error", 4, {"record": ("sync_error",)}, {"record": ()}),
    Case("all start equal", 4, {"initial": {"x": 0.3}}),
    Case("no forcing, u = 0", 2, {"parameters": {**PARAMETERS, "u": 0.0}, "time_unit": "time", "window": 550.0}),
    Case("no coupling, sigma = 0", 4, {"parameters": {"sigma": 0.0}}),
    Case("no section", 4, {"record": ("section",)}, {"record": ()}),
    Case("no trajectory", 4, {"record": ("trajectory",), "samples": 2001}, {"record": ()}),
    Case("start mirrored", 4, {"initial": {"x": [0.3, 0.28, 0.28, 0.3]}, "record": ()}),
    Case("hub and equal leaves", 8, {"initial": {"x": [0.3, *[0.28] * 7]}, "record": ()}, graph="star"),
    Case("all fixed numbers folded", 2, {"parameters": PARAMETERS}, fold_all=True),
)

QUICK = 2
"""A quick run takes this many cases from the first on; they need three kernels in all."""


def measure(quick: bool = False) -> list[tuple[object, ...]]:
    """Return the rows of the table, in the order of COLUMNS; `quick` runs two cases with fewer
    cells for shorter times.
    """
    return [_row(case, quick) for case in (CASES[:QUICK] if quick else CASES)]


def scenes(case: Case, quick: bool) -> tuple[ReducedScene, ReducedScene]:
    """What runs with the skip and without it: cells of one core over the frequency of the drive."""
    axis = Axis.between("omega", 1.1, 1.2, 8 if quick else 64)
    given = {"parameters": PARAMETERS, "transient": 0.0, "window": 20.0 if quick else 100.0, **case.given}
    if quick and "time_unit" in given:
        given["window"] /= 5.0
    scene = Scene(topology=topology(case.graph, case.n), axes=[axis], **given)
    if case.less:
        return reduce_scene(scene.replace(**case.less), reduce=False), reduce_scene(scene, reduce=False)
    return reduce_scene(scene, fold_all=case.fold_all), reduce_scene(scene, reduce=False)


def _row(case: Case, quick: bool) -> tuple[object, ...]:
    pair = scenes(case, quick)
    counts = [operations(kernel_source(chosen.scene, reduce=chosen)) for chosen in pair]
    seconds = [np.inf, np.inf]
    for _ in range(2 if quick else 6):  # the first may compile
        for k, chosen in enumerate(pair):
            began = time.process_time()
            run(chosen.scene, workers=1, reduce=chosen, show_progress=False)
            seconds[k] = min(seconds[k], time.process_time() - began)
    fewer, more = seconds
    return (case.name, case.n, *counts, 1e3 * fewer, 1e3 * more, more / fewer, _worst(case, pair))


def _worst(case: Case, pair: tuple[ReducedScene, ReducedScene]) -> float:
    """The largest difference of the answers over a short time."""
    results = []
    for chosen, skip in zip(pair, (not case.less, False), strict=True):
        scene = chosen.scene.replace(window=chosen.scene.window / 20.0, rtol=1e-10)
        short = reduce_scene(scene, skip, fold_all=case.fold_all)
        results.append(run(scene, workers=1, reduce=short, show_progress=False))
    return difference(*results)


def difference(one: Result, other: Result) -> float:
    """The largest difference of what both results have; infinite where statuses or counts of
    section points differ.
    """
    worst = 0.0
    for name in ("status", "section_count", "end", "end_time", "sync_error", "sync_error_end", "section", "trajectory"):
        if name not in one.data or name not in other.data:
            continue
        a, b = one.data[name].values.astype(float), other.data[name].values.astype(float)
        if a.shape != b.shape or not np.array_equal(np.isnan(a), np.isnan(b)):
            return float("inf")
        if name in ("status", "section_count") and not np.array_equal(a, b):
            return float("inf")
        worst = max(worst, float(np.nanmax(np.abs(a - b) / np.maximum(1.0, np.abs(b)), initial=0.0)))
    return worst
