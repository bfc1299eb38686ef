"""Basin stability: the share of random starts from which a network synchronises.

The starts are independent, so the share has the exact confidence interval of a binomial proportion.

Sources: Menck, Heitzig, Marwan & Kurths, Nature Phys. 9, 89 (2013); Clopper & Pearson, Biometrika
26, 404 (1934).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace

import numpy as np
import xarray as xr

from synchain.models.inputs.checks import check_integer, check_number, check_table
from synchain.models.inputs.words import Word
from synchain.models.mechanics.contact import SLIP
from synchain.models.scenes.defaults import TimeUnit
from synchain.models.scenes.scene import Scene, check_scene

from ..cells.plan import Planner
from ..cells.reduce import ReducedScene, reduce_scene
from ..cells.run_keywords import Given
from ..results.labelled import Labelled, dataset, scene_text
from ..results.labels import STATE, States
from ..support.arrays import row
from ..support.error_text import with_error
from ..support.execution import Execution
from ..support.progress import Hook
from ..support.status import Status
from ..sweeps.certify import certify
from .criterion import AppliedCriterion, Criterion, errors, preset, resolved
from .synchronous_motion import SynchronousMotion, alike, measure_motion, spread_of
from .trials import Outcome, Trials

Range = tuple[float, float]

SAMPLE_LIMIT = 10_000_000
"""Most starts of one call (a choice)."""

LONGEST = 5000.0
"""Longest average of the exponent, in its units of time (a choice)."""


class Fate(Word):
    """End of a start: synchronous, on the way there when its time was over, on another motion, or without an end."""

    SYNCHRONOUS = "synchronous"
    APPROACHING = "still approaching"
    OTHER = "not synchronous"
    ESCAPED = "escaped"
    STOPPED = "stopped"
    UNFINISHED = "not finished"


FATES = tuple(Fate)
ENDS = {Status.DIVERGED: Fate.ESCAPED, Status.STOPPED: Fate.STOPPED}
UNDECIDED = (Fate.APPROACHING, Fate.UNFINISHED)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Basin(Labelled):
    """Which random starts of a scene's network synchronise.

    A start that is not synchronous is still approaching if its error falls, or if no error could have fallen below the
    tolerance in this time.
    """

    scene: Scene
    criterion: AppliedCriterion
    confidence: float
    start: np.ndarray = field(repr=False)  # (samples, dimension)
    error: np.ndarray = field(repr=False)  # (samples,): synchronisation error, infinite where a cell did not finish
    status: np.ndarray = field(repr=False)  # (samples,): how the cell ended
    earlier: np.ndarray = field(
        repr=False
    )  # (samples,): error after half of the transient, NaN where it was not needed
    fate: np.ndarray = field(repr=False)  # (samples,): index of its `Fate`
    exponent: float = math.nan  # largest transversal exponent of the synchronous state; NaN if not needed or not known
    stderr: float = math.nan  # its standard error

    @property
    def data(self) -> xr.Dataset:
        """Start, errors, status and fate of each sample."""
        states = States.of(self.scene)
        return dataset(
            {
                "initial": (("sample", *STATE), states.table(self.start), "initial states"),
                "error": (("sample",), self.error, "mean synchronisation error, inf where a cell did not finish"),
                "earlier_error": (
                    ("sample",),
                    self.earlier,
                    "the same after half of the transient, where it was needed",
                ),
                "status": (("sample",), self.status, "how the cell ended"),
                "fate": (("sample",), self.fate, ", ".join(f"{k} {words}" for k, words in enumerate(FATES))),
                "synchronous": (("sample",), self.synchronous, "whether the start synchronised"),
            },
            {"component": list(states.components), "node": list(self.scene.topology.labels)},
            self.scene,
        )

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """Scene, shares with their interval, how cells ended, and the criterion."""
        return (
            ("scene", scene_text(self.scene)),
            *(("starts", words) for words in self._findings()),
            ("synchronous", self.criterion.text(self.scene)),
        )

    @property
    def samples(self) -> int:
        """Number of starts."""
        return len(self.error)

    @property
    def tolerance(self) -> float:
        """Error below which a start is synchronous."""
        return self.criterion.tolerance

    @property
    def synchronous(self) -> np.ndarray:
        """True for each start (samples,) that synchronised."""
        return np.asarray(self.fate == FATES.index(Fate.SYNCHRONOUS))

    @property
    def count(self) -> int:
        """Number of starts that synchronised."""
        return int(np.count_nonzero(self.synchronous))

    @property
    def share(self) -> float:
        """Basin stability: the part of all starts that synchronised."""
        return self.count / self.samples

    @property
    def shares(self) -> dict[str, float]:
        """The part of the starts of each fate."""
        counts = np.bincount(self.fate, minlength=len(FATES))
        return {str(name): int(count) / self.samples for name, count in zip(FATES, counts, strict=True)}

    @property
    def interval(self) -> Range:
        """Confidence interval of the share among all possible starts, of the level `confidence` or a higher one.

        The lower end is that of the starts that synchronised, the upper end that with those that are undecided.
        """
        from scipy.stats import binomtest

        undecided = int(np.isin(self.fate, [FATES.index(fate) for fate in UNDECIDED]).sum())
        counts = (self.count, self.count + undecided)
        few, most = (binomtest(k, self.samples).proportion_ci(self.confidence, method="exact") for k in counts)
        return float(few.low), float(most.high)

    @property
    def statuses(self) -> dict[Status, int]:
        """Number of cells that ended with each status."""
        codes, counts = np.unique(self.status, return_counts=True)
        return {Status(int(code)): int(count) for code, count in zip(codes, counts, strict=True)}

    @property
    def message(self) -> str:
        """Shares, interval, the exponent if it was needed, and the number of cells of each status, as text."""
        return "; ".join(self._findings())

    def _findings(self) -> list[str]:
        """The parts of the message."""
        low, high = self.interval
        first = f"{self.count} of {self.samples} starts synchronised: {self.share:.4g}"
        others = (f"{name}: {share:.4g}" for name, share in self.shares.items() if share and name != Fate.SYNCHRONOUS)
        confident = f"with confidence {self.confidence:g} {low:.4g} … {high:.4g}"
        exponent = [] if math.isnan(self.exponent) else [f"exponent {with_error(self.exponent, self.stderr)}"]
        if self.exponent - 2.0 * self.stderr > 0.0:
            left = ": starts that synchronised have not left it yet" if self.count else ""
            exponent.append(f"the synchronous state is unstable{left}")
        ends = (f"{n} cell{'s' * (n > 1)}: {s.message}" for s, n in self.statuses.items())
        return [first, *others, confident, *exponent, *ends]


def basin(
    scene: Scene,
    *,
    samples: int = 1000,
    ranges: Mapping[str, Range] | None = None,
    tolerance: float | None = None,
    transient: float | None = None,
    window: float | None = None,
    seed: int | None = None,
    confidence: float = 0.95,
    workers: int | None = None,
    executor: Executor | None = None,
    show_progress: bool | None = None,
    progress: Hook | None = None,
    parameters: Mapping[str, float] | None = None,
    **more: float,
) -> Basin:
    """Start a scene's network from random states and count those that synchronise.

    The state of every oscillator is uniform in `ranges`, independent of the others.  The result depends on the seed
    and not on the workers, and the first starts of a larger sample are those of a smaller one.

    Parameters
    ----------
    scene : Scene
        The network; its records are not used, its stop ends cells.
    samples : int
        Number of starts.
    ranges : mapping of str to (float, float), optional
        Lowest and highest value of a component (default: -1 and 1 for all components); a component
        that is not named starts as in the scene.
    tolerance : float, optional
        A start is synchronous if its mean synchronisation error over the window is below this; by default a thousandth of
        the extent of the synchronous motion, for each component too.
    transient, window : float, optional
        In the scene's unit of time; by default as for a `Criterion`.
    seed : int, optional
        By default that of the scene.
    confidence : float
        Level of the confidence interval.
    workers, executor, show_progress, progress
        As for `run`.
    parameters, **more
        Override the parameters of the scene, as for `exponents`.

    Returns
    -------
    Basin
        A cell takes at most a hundred times the steps of the synchronous motion; cells that need more have escaped or are
        not finished.

    Raises
    ------
    ValueError
        If a component is unknown, a range is empty, or a number makes no sense, and for a scene with
        axes or draws.
    TypeError
        If the number of samples is not whole.
    """
    _check(scene, samples, tolerance, confidence)
    execution = Execution(workers, executor, show_progress, progress)
    scene = Given(basin, parameters, more).scene(scene, record=("sync_error",), stop=scene.stop)
    partial = preset(Criterion(tolerance, 1, 0.0, transient, window, None, seed), scene)
    scene = random_starts(scene, samples, ranges, partial.seed or 0)
    used = resolved(partial, scene, lambda atol: _motion(scene, partial, atol, execution))

    # all starts, judged by how their cells end
    settings = {"window": used.window, "max_steps": used.max_steps, "atol": used.atol or scene.given["atol"]}
    outcome, start = _run(scene.replace(transient=used.transient, **settings), np.arange(samples), execution)
    error, fate = errors(outcome, used, scene.equations), np.full(samples, FATES.index(Fate.UNFINISHED))
    for status, end in ENDS.items():
        fate[outcome.status == status] = FATES.index(end)
    finished = outcome.status == Status.FINISHED
    fate[finished] = FATES.index(Fate.OTHER)
    fate[finished & (error < used.tolerance)] = FATES.index(Fate.SYNCHRONOUS)

    # of the others, which are still approaching: their errors after half of the transient, and the exponent
    apart, earlier = np.flatnonzero(fate == FATES.index(Fate.OTHER)), np.full(samples, np.nan)
    single = scene.replace(axes=(), zipped=False, stop=None)
    if not len(apart):
        return Basin(single.replace(stop=scene.stop), used, confidence, start, error, outcome.status, earlier, fate)
    half, _ = _run(scene.replace(transient=0.5 * used.transient, **settings), apart, execution)
    earlier[apart] = errors(half, used, scene.equations)
    exponent, stderr = _exponent(single, used, execution)
    late = _approaching(error[apart], earlier[apart], used, _length(single, used), exponent, stderr)
    fate[apart[late]] = FATES.index(Fate.APPROACHING)
    single = single.replace(stop=scene.stop)
    return Basin(single, used, confidence, start, error, outcome.status, earlier, fate, exponent, stderr)


def _run(scene: Scene, cells: np.ndarray, execution: Execution) -> tuple[Outcome, np.ndarray]:
    """Run some cells of a scene; return their outcome and starts (cells, dimension)."""
    planner = Planner(scene)
    with Trials.of(_unreduced(scene), execution) as trials:
        outcome = trials.run(len(cells), lambda chosen: planner.rows(cells[chosen]))
    return outcome, planner.rows(cells).start


def _unreduced(scene: Scene) -> ReducedScene:
    """A scene with all its nodes, which start apart."""
    return replace(reduce_scene(scene, reduce=False), jumps=True)


def _motion(scene: Scene, partial: Criterion, atol: float | None, execution: Execution) -> SynchronousMotion:
    """The motion from the state of the scene's first oscillator."""
    unit = scene.replace(transient=1.0, window=1.0, atol=atol or scene.given["atol"])
    planner, equations = Planner(unit), scene.equations
    spread = spread_of(equations, planner.rows(np.arange(min(scene.cells, 100))).start)
    first = Planner(unit.replace(axes=(), zipped=False)).rows(np.arange(1))
    with Trials.of(_unreduced(unit), execution) as trials:
        times = (partial.transient, partial.window)
        return measure_motion(trials, lambda rows: rows, equations, alike(equations, first), times, spread)


def _length(scene: Scene, used: AppliedCriterion) -> float:
    """Transient and window in non-dimensional time."""
    return (used.transient + used.window) * ((scene.period or 1.0) if scene.time_unit == TimeUnit.PERIOD else 1.0)


def _exponent(scene: Scene, used: AppliedCriterion, execution: Execution) -> tuple[float, float]:
    """The largest transversal exponent, as precise as a transient can resolve, and its error; NaN if there is none."""
    try:
        certificate = certify(scene, precision=0.5 / _length(scene, used), periods=LONGEST, workers=execution.workers)
    except (ValueError, FloatingPointError):
        return math.nan, math.nan
    return float(certificate.exponent[0]), float(certificate.stderr[0])


def _approaching(
    error: np.ndarray, earlier: np.ndarray, used: AppliedCriterion, length: float, exponent: float, stderr: float
) -> np.ndarray:
    """True for starts (samples,) that are not synchronous but may only need more time.

    After a long transient they do if their errors fall at half the pace of the exponent, or by a factor e.
    """
    if math.isnan(exponent):
        return np.asarray(error < earlier / math.e)
    fastest = 2.0 * stderr - exponent
    if fastest <= 0.0:
        return np.zeros(len(error), dtype=bool)
    # errors fall at most by exp(fastest) in a unit of time: too little to decide after a short transient
    if fastest * length < math.log(max(used.size / used.tolerance, 1.0)):
        return np.ones(len(error), dtype=bool)
    return np.asarray(error < earlier * math.exp(max(0.25 * min(exponent, 0.0) * length, -1.0)))


def random_starts(scene: Scene, samples: int, ranges: Mapping[str, Range] | None = None, seed: int = 0) -> Scene:
    """Return the scene with a cell for each of `samples` random starts; `ranges` as for `basin`."""
    box = _box(scene, ranges)
    names = [f"{component}_{i + 1}" for component in box for i in scene.equations.holders(component)]
    counts = [len(scene.initial[component]) for component in box]
    low, high = (np.repeat([ends[k] for ends in box.values()], counts) for k in (0, 1))
    values = low + (high - low) * np.random.default_rng(seed).random((samples, len(names)))
    return scene.replace(axes=dict(zip(names, values.T, strict=True)), zipped=True)


def _check(scene: Scene, samples: object, tolerance: object, confidence: object) -> None:
    if check_scene(scene).n < 2:
        raise ValueError(f"basin: found {scene.n} oscillator; expected at least two, which can synchronise")
    check_integer("basin: samples", samples, 1, SAMPLE_LIMIT)
    if tolerance is not None and not check_number("basin: tolerance", tolerance) > 0:
        raise ValueError(f"basin: tolerance = {tolerance}; expected a positive number")
    if not 0 < check_number("basin: confidence", confidence) < 1:
        raise ValueError(f"basin: confidence = {confidence}; expected a number between 0 and 1, e.g. 0.95")


def _box(scene: Scene, ranges: Mapping[str, Range] | None) -> dict[str, Range]:
    """The ranges in the order of the components, checked; the slip state of a contact follows from the other states."""
    names = tuple(name for name in scene.components if name != SLIP.name)
    if ranges is None:
        return dict.fromkeys(names, (-1.0, 1.0))
    unknown = [name for name in check_table("basin: ranges", ranges) if name not in names]
    if unknown:
        raise ValueError(f"basin: unknown component {unknown[0]!r}; known: {', '.join(names)}")
    if not ranges:
        raise ValueError(f"basin: no ranges; name at least one component of {', '.join(names)}")
    box = {}
    for name in names:
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
