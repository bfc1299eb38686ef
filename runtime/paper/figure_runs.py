"""The runs for the figures: their quality, and a store that shares runs between figures."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from concurrent.futures import Future
from dataclasses import dataclass, replace
from threading import Event, Lock
from typing import Any, TypeVar

import numpy as np

from synchain.models.graphs.families import topology
from synchain.models.scenes.scene import Scene
from synchain.models.sweeps.axis import Axis, thinned

from ..prediction.intervals import Interval, scale
from ..results.result import Result
from ..support.execution import Execution
from ..support.progress import Progress
from ..sweeps.run import run
from ..synchronisation.criterion import PAPER, AppliedCriterion
from ..synchronisation.threshold import Sweep, probe, project, simulate

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Quality:
    points: int | None = None  # largest number of values of an axis that is run once per value; None for all
    grid: int | None = None  # number of values of sigma for the search of synchronous ranges; None for all
    criterion: AppliedCriterion = PAPER  # criterion of synchronisation
    resolution: float = 5e-4  # width in sigma to which the ends of synchronous ranges are refined
    networks: tuple[int, ...] = (5, 6)  # sizes of longer chains, for which no synchronisation is expected


FULL = Quality()
QUICK = Quality(241, 121, replace(PAPER, starts=5, transient=400.0, window=50.0, rtol=1e-6), 2e-3, (5,))


class FigureRuns:
    """Compute once the runs that several figures need, also for figures in different threads."""

    def __init__(self, quality: Quality = FULL, *, workers: int | None = None) -> None:
        self.quality = quality
        self.execution = Execution(workers, show_progress=False, progress=self._stop_if_asked)
        self.options: dict[str, Any] = {"workers": workers, "show_progress": False, "progress": self._stop_if_asked}
        self._criterion: dict[str, Any] = {
            "resolution": quality.resolution,
            "criterion": quality.criterion,
            "execution": self.execution,
        }
        self._lock, self._stopped = Lock(), Event()
        self._results: dict[Hashable, Future[Any]] = {}

    def stop(self) -> None:
        """Stop the runs in other threads: each raises KeyboardInterrupt after its present block."""
        self._stopped.set()

    def _stop_if_asked(self, progress: Progress) -> None:
        if self._stopped.is_set():
            raise KeyboardInterrupt

    def once(self, key: Hashable, compute: Callable[[], T]) -> T:
        """Return the result of the first call with this key; other threads wait for that result."""
        with self._lock:
            is_first = key not in self._results
            future: Future[T] = self._results.setdefault(key, Future())
        if is_first:
            try:
                future.set_result(compute())
            except BaseException as problem:
                future.set_exception(problem)
        return future.result()

    def run(self, scene: Scene) -> Result:
        scene = thin(scene, self.quality.points).replace(title="")
        return self.once(("run", scene), lambda: run(scene, **self.options))

    def pair(self, scene: Scene) -> Sweep:
        """Run the two-oscillator probe of a scene's oscillator over alpha from 0 to 1.2."""
        pair = scene.replace(topology=topology("chain", 2), initial=None, axes=(), title="", sigma=0.0)
        # Two coupled oscillators have gamma = 2, so alpha = 2 sigma: sigma ends at 0.6.
        alpha = 2.0 * np.array(thin(_with_couplings(pair, 0.6, 601), self.quality.grid).axes[0].values)
        return self.once(("pair", pair), lambda: probe(pair, alpha, **self._criterion))

    def network(self, scene: Scene) -> Sweep:
        """Simulate a scene's network on the sigma axis of the scene to find its synchronous ranges."""
        if scene.topology == topology("chain", 2):  # the network is the probe itself
            pair = self.pair(scene)
            return Sweep(0.5 * pair.x, pair.error, pair.share, tuple(scale(pair.intervals, 0.5)))
        scene = thin(scene, self.quality.grid).replace(title="")
        sigma = np.array(scene.axes[0].values)
        cell = scene.replace(axes=(), record=("sync_error",))
        return self.once(("network", scene), lambda: simulate(cell, sigma, **self._criterion))

    def after(self, scene: Scene, sigma: np.ndarray, transient: float) -> Sweep:
        """Simulate a scene's network at `sigma` with another length of the transient. Shapes: sigma (k,)."""
        criterion = replace(self.quality.criterion, transient=transient)
        options = {**self._criterion, "criterion": criterion, "resolution": math.inf}  # ends are not refined
        return simulate(scene.replace(axes=(), record=("sync_error",)), sigma, **options)

    def predicted(self, scene: Scene) -> list[Interval]:
        """Predict the ranges of sigma of a scene from the ranges of the probe, by the exact spectrum of the graph."""
        return project(self.pair(scene).intervals, scene.spectrum, max(scene.axes[0].values))

    def chain(self, n: int, omega: float) -> Scene:
        """Return a chain with couplings from 0 to the largest alpha of the probe: sigma max |gamma| = 1.2."""
        scene = Scene(topology=topology("chain", n), parameters={"omega": omega})
        largest = max(abs(value) for value in scene.spectrum.values)
        return _with_couplings(scene, round(1.2 / largest, 3), 301)


def thin(scene: Scene, points: int | None) -> Scene:
    """Reduce each axis of a scene to at most `points` values, including both ends; None keeps all values."""
    return scene.replace(axes=[thinned(axis, points) for axis in scene.axes])


def _with_couplings(scene: Scene, highest: float, count: int) -> Scene:
    return scene.replace(axes=(Axis.between("sigma", 0.0, highest, count),))
