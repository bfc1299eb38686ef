"""The runs behind the figures: how finely they are made, and a store that shares them between figures and table."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from synchain.models.graphs.families import topology
from synchain.models.scenes.axis import Axis
from synchain.models.scenes.scene import Scene

from ..prediction.intervals import Interval, scale
from ..results.result import Result
from ..sweeps.run import run
from ..synchronisation.threshold import Criterion, Sweep, probe, project, simulate

__all__ = ["FULL", "QUICK", "FigureRuns", "Quality", "thin"]


@dataclass(frozen=True, slots=True)
class Quality:
    """How finely the figures are computed.

    points: most values kept of a scene's axis where every value is run once; grid: where synchronous ranges are looked for
    (None: all of them); criterion and resolution (in sigma): those of the synchronous ranges; networks: sizes above the
    paper's for which no synchronisation is expected.
    """

    points: int | None = None
    grid: int | None = None
    criterion: Criterion = field(default_factory=Criterion)
    resolution: float = 5e-4
    networks: tuple[int, ...] = (5, 6)

    def __post_init__(self) -> None:
        for name in ("points", "grid"):
            value = getattr(self, name)
            if value is not None and value < 2:
                raise ValueError(f"quality: {name} = {value}; expected at least 2 values for an axis")
        if not self.resolution > 0:
            raise ValueError(f"quality: resolution = {self.resolution}; expected a positive number")


FULL = Quality()
QUICK = Quality(241, 121, Criterion(starts=5, transient=400.0, window=50.0), 2e-3, (5,))


class FigureRuns:
    """Runs each scene once and keeps what came out, for all figures that want it.

    `workers` is the number of threads; a bar for each run is shown where `show_progress` says so.
    """

    def __init__(
        self, quality: Quality = FULL, *, workers: int | None = None, show_progress: bool | None = False
    ) -> None:
        self.quality = quality
        self.workers = workers
        self.show_progress = show_progress
        self._runs: dict[Scene, Result] = {}
        self._sweeps: dict[Scene, Sweep] = {}

    def run(self, scene: Scene) -> Result:
        """Run a scene on its own axes, thinned to the quality."""
        scene = thin(scene, self.quality.points).replace(title="")
        if scene not in self._runs:
            self._runs[scene] = run(scene, workers=self.workers, show_progress=self.show_progress)
        return self._runs[scene]

    def pair(self, scene: Scene) -> Sweep:
        """The two-oscillator probe of a scene's oscillator over alpha, on the grid of sigma 0 … 0.6."""
        pair = scene.replace(topology=topology("chain", 2), initial=None, axes=(), title="", sigma=0.0)
        if pair not in self._sweeps:
            alpha = 2.0 * np.array(thin(_swept(pair, 0.6, 601), self.quality.grid).axes[0].values)
            self._sweeps[pair] = probe(pair, alpha, **self._options(1.0))
        return self._sweeps[pair]

    def network(self, scene: Scene) -> Sweep:
        """Ranges and errors of a scene's network on its own grid of sigma, by direct simulation."""
        if scene.topology == topology("chain", 2):
            found = self.pair(scene)
            return Sweep(0.5 * found.x, found.error, found.share, tuple(scale(found.intervals, 0.5)))
        scene = thin(scene, self.quality.grid).replace(title="")
        if scene not in self._sweeps:
            sigma = np.array(scene.axes[0].values)
            self._sweeps[scene] = simulate(scene.replace(axes=(), record=("sync_error",)), sigma, **self._options(1.0))
        return self._sweeps[scene]

    def after(self, scene: Scene, sigma: np.ndarray, transient: float) -> Sweep:
        """Errors and shares at these values of sigma after a transient of another length; ends are not refined."""
        criterion = replace(self.quality.criterion, transient=transient)
        options = {**self._options(1.0), "criterion": criterion, "resolution": math.inf}
        return simulate(scene.replace(axes=(), record=("sync_error",)), sigma, **options)

    def predicted(self, scene: Scene) -> list[Interval]:
        """What the probe's ranges leave of a scene's values of sigma, through its exact spectrum."""
        return project(self.pair(scene).intervals, scene.spectrum, max(scene.axes[0].values))

    def chain(self, n: int, omega: float) -> Scene:
        """A chain whose largest |sigma gamma| goes as far as the probe (alpha = 1.2)."""
        scene = Scene(topology=topology("chain", n), parameters={"omega": omega})
        largest = max(abs(value) for value in scene.spectrum.values)
        return _swept(scene, round(1.2 / largest, 3), 301)

    def _options(self, factor: float) -> dict[str, Any]:
        return {
            "resolution": factor * self.quality.resolution, "criterion": self.quality.criterion,
            "workers": self.workers, "show_progress": self.show_progress,
        }  # fmt: skip


def thin(scene: Scene, points: int | None) -> Scene:
    """The scene with at most `points` values on each axis: both ends and evenly chosen ones between them."""
    if points is None:
        return scene
    axes = []
    for axis in scene.axes:
        count = len(axis)
        kept = np.unique(np.round(np.linspace(0, count - 1, min(points, count))).astype(int))
        axes.append(Axis(axis.name, [axis.values[k] for k in kept]))
    return scene.replace(axes=axes)


def _swept(scene: Scene, highest: float, count: int) -> Scene:
    return scene.replace(axes=(Axis.between("sigma", 0.0, highest, count),))
