"""Basin stability: the share of random starts from which a network synchronises.

Each start is one throw of a coin, so the share has the exact confidence interval of a binomial
proportion.

Sources: Menck, Heitzig, Marwan & Kurths, Nature Phys. 9, 89 (2013); Clopper & Pearson, Biometrika
26, 404 (1934).
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace

import numpy as np
import xarray as xr

from synchain.models.inputs.checks import check_integer, check_number, check_table
from synchain.models.mechanics.friction import SLIP
from synchain.models.scenes.scene import Scene, a_scene

from ..cells.keywords import Given
from ..cells.plan import Planner
from ..cells.reduce import reduce_scene
from ..results.labelled import Labelled, dataset
from ..results.labels import STATE, States
from ..support.arrays import row
from ..support.execution import Execution
from ..support.progress import Hook
from ..support.status import Status
from .trials import Trials

__all__ = ["Basin", "basin", "random_starts"]

Range = tuple[float, float]

SAMPLE_LIMIT = 10_000_000
"""Most starts of one call."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Basin(Labelled):
    """Which random starts of a scene's network synchronise.

    start (samples, dimension), in the order of the state; error (samples,): mean synchronisation
    error, infinite where a cell did not finish; status (samples,): how it ended.  A start is
    synchronous where the error is below `tolerance`.  A cell that did not finish counts among the
    samples as not synchronous, and `statuses` says how many there are and why.
    """

    scene: Scene
    tolerance: float
    confidence: float
    start: np.ndarray = field(repr=False)
    error: np.ndarray = field(repr=False)
    status: np.ndarray = field(repr=False)

    @property
    def data(self) -> xr.Dataset:
        """Start, error, status and verdict of each sample."""
        states = States.of(self.scene)
        return dataset(
            {
                "initial": (("sample", *STATE), states.table(self.start), "initial states"),
                "error": (("sample",), self.error, "mean synchronisation error, inf where a cell did not finish"),
                "status": (("sample",), self.status, "how the cell ended"),
                "synchronous": (("sample",), self.synchronous, "whether the start synchronised"),
            },
            {"component": list(states.components), "node": list(self.scene.topology.labels)},
            self.scene,
        )

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """Scene, share with its interval, how cells ended."""
        return ("scene", repr(self.scene)), *(("starts", words) for words in self.message.split("; "))

    @property
    def samples(self) -> int:
        """Number of starts."""
        return len(self.error)

    @property
    def synchronous(self) -> np.ndarray:
        """True for each start (samples,) that synchronised."""
        return self.error < self.tolerance

    @property
    def count(self) -> int:
        """Number of starts that synchronised."""
        return int(np.count_nonzero(self.synchronous))

    @property
    def share(self) -> float:
        """Basin stability: the part of all starts that synchronised."""
        return self.count / self.samples

    @property
    def interval(self) -> Range:
        """Exact confidence interval of the share among all possible starts, of the level
        `confidence` or a higher one.
        """
        from scipy.stats import binomtest

        found = binomtest(self.count, self.samples).proportion_ci(self.confidence, method="exact")
        return float(found.low), float(found.high)

    @property
    def statuses(self) -> dict[Status, int]:
        """How many cells ended how."""
        codes, counts = np.unique(self.status, return_counts=True)
        return {Status(int(code)): int(count) for code, count in zip(codes, counts, strict=True)}

    @property
    def message(self) -> str:
        """Share, interval and how many cells ended how, in words."""
        low, high = self.interval
        first = f"{self.count} of {self.samples} starts synchronised: {self.share:.4g}"
        sure = f"with confidence {self.confidence:g} {low:.4g} … {high:.4g}"
        return "; ".join([first, sure, *(f"{n} cell{'s' * (n > 1)}: {s.message}" for s, n in self.statuses.items())])


def basin(
    scene: Scene,
    *,
    samples: int = 1000,
    ranges: Mapping[str, Range] | None = None,
    tolerance: float = 1e-3,
    transient: float = 1000.0,
    window: float = 100.0,
    seed: int = 0,
    confidence: float = 0.95,
    workers: int | None = None,
    executor: Executor | None = None,
    show_progress: bool | None = None,
    progress: Hook | None = None,
    parameters: Mapping[str, float] | None = None,
    **more: float,
) -> Basin:
    """Start a scene's network from random states and count those that synchronise.

    Every oscillator has a state of its own, uniform in `ranges`.  The result depends on the seed
    and not on the workers, and the first starts of a larger sample are those of a smaller one.

    Parameters
    ----------
    scene : Scene
        The network; its records are not used.
    samples : int
        Number of starts.
    ranges : mapping of str to (float, float), optional
        Lowest and highest value of a component (default: -1 and 1 for all components); a component
        that is not named starts as in the scene.
    tolerance : float
        A start is synchronous if its mean synchronisation error over the window is below this.
    transient, window : float
        In the scene's unit of time.
    seed : int
    confidence : float
        Level of the confidence interval.
    workers, executor, show_progress, progress
        As for `run`.
    parameters, **more
        Override the parameters of the scene, as for `exponents`.

    Raises
    ------
    ValueError
        If a component is unknown, a range is empty, or a number makes no sense, and for a scene with
        axes or draws.
    TypeError
        If the number of samples is not whole.
    """
    _check(scene, samples, tolerance, confidence, seed)
    execution = Execution(workers, executor, show_progress, progress)
    timed = {"transient": transient, "window": window}
    scene = Given(basin, parameters, more).scene(scene, record=("sync_error",), **timed)
    planner = Planner(random_starts(scene, samples, ranges, seed))
    whole = replace(reduce_scene(planner.scene, reduce=False), jumps=True)
    with Trials.of(whole, execution) as trials:
        error, status = trials.run(samples, planner.rows)
    return Basin(scene, tolerance, confidence, planner.rows(np.arange(samples)).start, error, status)


def random_starts(scene: Scene, samples: int, ranges: Mapping[str, Range] | None = None, seed: int = 0) -> Scene:
    """Return the scene with a cell for each of `samples` random starts; `ranges` as for `basin`."""
    box = _box(scene, ranges)
    names = [f"{component}_{i + 1}" for component in box for i in scene.equations.holders(component)]
    counts = [len(scene.initial[component]) for component in box]
    low, high = (np.repeat([ends[k] for ends in box.values()], counts) for k in (0, 1))
    values = low + (high - low) * np.random.default_rng(seed).random((samples, len(names)))
    return scene.replace(axes=dict(zip(names, values.T, strict=True)), zipped=True)


def _check(scene: Scene, samples: object, tolerance: object, confidence: object, seed: object) -> None:
    if a_scene(scene).n < 2:
        raise ValueError(f"basin: found {scene.n} oscillator; expected at least two, which can synchronise")
    check_integer("basin: samples", samples, 1, SAMPLE_LIMIT)
    check_integer("basin: seed", seed, 0)
    if not check_number("basin: tolerance", tolerance) > 0:
        raise ValueError(f"basin: tolerance = {tolerance}; expected a positive number")
    if not 0 < check_number("basin: confidence", confidence) < 1:
        raise ValueError(f"basin: confidence = {confidence}; expected a number between 0 and 1, e.g. 0.95")


def _box(scene: Scene, ranges: Mapping[str, Range] | None) -> dict[str, Range]:
    """The ranges in the order of the components, checked; the mode of a contact follows from the
    other states.
    """
    known = tuple(name for name in scene.components if name != SLIP.name)
    if ranges is None:
        return dict.fromkeys(known, (-1.0, 1.0))
    unknown = [name for name in check_table("basin: ranges", ranges) if name not in known]
    if unknown:
        raise ValueError(f"basin: unknown component {unknown[0]!r}; known: {', '.join(known)}")
    if not ranges:
        raise ValueError(f"basin: no ranges; name at least one component of {', '.join(known)}")
    box = {}
    for name in known:
        if name not in ranges:
            continue
        ends = row(f"basin: the range of {name}", ranges[name], 2)
        low, high = float(ends[0]), float(ends[-1])
        if not (len(ends) == 2 and low < high):
            raise ValueError(
                f"basin: the range of {name} is {low:g} … {high:g}; expected two numbers, the lower one first "
                "(for a fixed value leave the component out and set it in the scene's initial state)"
            )
        box[name] = (low, high)
    return box
