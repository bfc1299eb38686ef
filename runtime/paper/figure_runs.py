"""The runs behind the figures: their quality, and a store that shares them between figures."""

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
from synchain.models.sweeps.axis import Axis

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
    """Resolution of the figures."""

    points: int | None = None  # most values of a scene's axis if every value is run once; None for all
    grid: int | None = None  # number of values on which synchronous ranges are searched; None for all
    criterion: AppliedCriterion = PAPER  # criterion of synchronisation
    resolution: float = 5e-4  # width in sigma to which the ends of synchronous ranges are refined
    networks: tuple[int, ...] = (5, 6)  # sizes above the paper's for which no synchronisation is expected

    def __post_init__(self) -> None:
        for name in ("points", "grid"):
            value = getattr(self, name)
            if value is not None and value < 2:
                raise ValueError(f"quality: {name} = {value}; expected at least 2 values for an axis")
        if not self.resolution > 0:
            raise ValueError(f"quality: resolution = {self.resolution}; expected a positive number")


FULL = Quality()
QUICK = Quality(241, 121, replace(PAPER, starts=5, transient=400.0, window=50.0, rtol=1e-6), 2e-3, (5,))


class FigureRuns:
    """Computes what figures share once, also for figures in threads of their own.

    Parameters
    ----------
    quality : Quality
        Resolution of the figures.
    workers : int, optional
        Number of threads of a run; all cores by default.
    show_progress : bool or None
        Whether to show a progress bar for each run; None shows it on terminals only.
    """

    def __init__(
        self, quality: Quality = FULL, *, workers: int | None = None, show_progress: bool | None = False
    ) -> None:
        self.quality = quality
        self.execution = Execution(workers, show_progress=show_progress, progress=self._heed)
        self._lock, self._stopped = Lock(), Event()
        self._made: dict[Hashable, Future[Any]] = {}

    def stop(self) -> None:
        """End what runs in other threads: it raises KeyboardInterrupt."""
        self._stopped.set()

    def _heed(self, progress: Progress) -> None:
        if self._stopped.is_set():
            raise KeyboardInterrupt

    def once(self, what: Hashable, make: Callable[[], T]) -> T:
        """Return what `make` returned when `what` was first asked for; other threads wait for it."""
        with self._lock:
            own = what not in self._made
            made = self._made.setdefault(what, Future())
        if own:
            try:
                made.set_result(make())
            except BaseException as problem:
                made.set_exception(problem)
        found: T = made.result()
        return found

    def run(self, scene: Scene) -> Result:
        """Run a scene on its own axes, thinned to the quality."""
        scene = thin(scene, self.quality.points).replace(title="")
        return self.once(("run", scene), lambda: run(scene, **self.options))

    def pair(self, scene: Scene) -> Sweep:
        """Run the two-oscillator probe of a scene's oscillator over alpha from 0 to 1.2."""
        pair = scene.replace(topology=topology("chain", 2), initial=None, axes=(), title="", sigma=0.0)
        alpha = 2.0 * np.array(thin(_swept(pair, 0.6, 601), self.quality.grid).axes[0].values)
        return self.once(("pair", pair), lambda: probe(pair, alpha, **self._options()))

    def network(self, scene: Scene) -> Sweep:
        """Simulate a scene's network on its own grid of sigma to find its synchronous ranges."""
        if scene.topology == topology("chain", 2):
            found = self.pair(scene)
            return Sweep(0.5 * found.x, found.error, found.share, tuple(scale(found.intervals, 0.5)))
        scene = thin(scene, self.quality.grid).replace(title="")
        sigma = np.array(scene.axes[0].values)
        one = scene.replace(axes=(), record=("sync_error",))
        return self.once(("network", scene), lambda: simulate(one, sigma, **self._options()))

    def after(self, scene: Scene, sigma: np.ndarray, transient: float) -> Sweep:
        """Simulate a scene's network after a transient of another length. Shapes: sigma (k,)."""
        criterion = replace(self.quality.criterion, transient=transient)
        options = {**self._options(), "criterion": criterion, "resolution": math.inf}
        return simulate(scene.replace(axes=(), record=("sync_error",)), sigma, **options)

    def predicted(self, scene: Scene) -> list[Interval]:
        """Project the ranges of the probe onto a scene's values of sigma by its exact spectrum."""
        return project(self.pair(scene).intervals, scene.spectrum, max(scene.axes[0].values))

    def chain(self, n: int, omega: float) -> Scene:
        """Return a chain whose largest |sigma gamma| is that of the probe (alpha = 1.2)."""
        scene = Scene(topology=topology("chain", n), parameters={"omega": omega})
        largest = max(abs(value) for value in scene.spectrum.values)
        return _swept(scene, round(1.2 / largest, 3), 301)

    @property
    def options(self) -> dict[str, Any]:
        """Who does the work of a public function, as its keywords."""
        done_by = self.execution
        return {"workers": done_by.workers, "show_progress": done_by.show_progress, "progress": done_by.progress}

    def _options(self) -> dict[str, Any]:
        """Options of probes and simulations."""
        return {
            "resolution": self.quality.resolution,
            "criterion": self.quality.criterion,
            "execution": self.execution,
        }


def thin(scene: Scene, points: int | None) -> Scene:
    """Reduce the axes of a scene to a number of values."""
    if points is None:
        return scene
    axes = []
    for axis in scene.axes:
        count = len(axis)
        kept = np.unique(np.round(np.linspace(0, count - 1, min(points, count))).astype(int))
        axes.append(Axis(axis.name, [axis.values[k] for k in kept]))
    return scene.replace(axes=axes)


def _swept(scene: Scene, highest: float, count: int) -> Scene:
    """Scene with an axis of the coupling from 0."""
    return scene.replace(axes=(Axis.between("sigma", 0.0, highest, count),))
