"""Compute basin stability: the share of random starts from which a network synchronises.

The starts are independent, so that the exact confidence interval of a binomial proportion applies.

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
"""Largest number of starts in one call (a choice)."""

LONGEST = 5000.0
"""Longest average of the exponent, in units of time of the exponent (a choice)."""


class Fate(Word):
    """Fate of a start: synchronous, still approaching synchrony at the end, on another motion, or not finished."""

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
    """The fates of random starts of a scene's network.

    A start that is not synchronous counts as still approaching if its error falls, or if the time is too short for any
    error to fall below the tolerance.

    See Also
    --------
    synchain.basin
    """

    scene: Scene
    criterion: AppliedCriterion
    confidence: float
    start: np.ndarray = field(repr=False)  # (samples, dimension)
    error: np.ndarray = field(repr=False)  # (samples,): synchronisation error, infinite where a cell did not finish
    status: np.ndarray = field(repr=False)  # (samples,): status at the end of the cell
    earlier: np.ndarray = field(repr=False)  # (samples,): error after half of the transient, NaN if not needed
    fate: np.ndarray = field(repr=False)  # (samples,): index of its `Fate`
    exponent: float = math.nan  # largest transversal exponent of the synchronous state; NaN if not computed
    stderr: float = math.nan  # standard error of `exponent`

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
        """Scene, shares with their interval, statuses of cells, and the criterion."""
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
        """A start is synchronous if its error is below this value."""
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
        """Confidence interval of the share among all possible starts; its level is at least `confidence`.

        For the lower end, only the starts that synchronised count; for the upper end, the undecided starts count too.
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
        """Text with shares, interval, the exponent if it was computed, and the number of cells with each status."""
        return "; ".join(self._findings())

    def _findings(self) -> list[str]:
        """Return the parts of the message."""
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

    The state of every oscillator is drawn uniformly from `ranges`, independently of the other oscillators. The result
    depends on the seed, but not on the workers. A larger sample begins with the starts of a smaller one.

    Parameters
    ----------
    scene : Scene
        The network. The records of the scene are ignored; its stop ends cells.
    samples : int
        Number of starts.
    ranges : mapping of str to (float, float), optional
        Lowest and highest initial value of each component (default: -1 and 1 for all components). If
        ranges are given, all other components start as in the scene.
    tolerance : float, optional
        A start is synchronous if its mean synchronisation error over the window is below this value. By default a
        thousandth of the extent of the synchronous motion; the error of each component is then tested too.
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
        A cell takes at most a hundred times as many steps as the synchronous motion. A cell that needs more steps
        counts as escaped or not finished.

    Raises
    ------
    ValueError
        If a component is unknown, if a range is empty, if a number is out of range, or if the scene has
        axes or draws.
    TypeError
        If the number of samples is not whole.

    See Also
    --------
    synchain.run
    synchain.thresholds
    """
    _check(scene, samples, tolerance, confidence)
    execution = Execution(workers, executor, show_progress, progress)
    scene = Given(basin, parameters, more).scene(scene, record=("sync_error",), stop=scene.stop)
    partial = preset(Criterion(tolerance, 1, 0.0, transient, window, None, seed), scene)
    scene = random_starts(scene, samples, ranges, partial.seed or 0)
    used = resolved(partial, scene, lambda atol: _motion(scene, partial, atol, execution))

    # run all starts, and determine the fate of each from the end of its cell
    settings = {"window": used.window, "max_steps": used.max_steps, "atol": used.atol or scene.given["atol"]}
    outcome, start = _run(scene.replace(transient=used.transient, **settings), np.arange(samples), execution)
    error, fate = errors(outcome, used, scene.equations), np.full(samples, FATES.index(Fate.UNFINISHED))
    for status, end in ENDS.items():
        fate[outcome.status == status] = FATES.index(end)
    finished = outcome.status == Status.FINISHED
    fate[finished] = FATES.index(Fate.OTHER)
    fate[finished & (error < used.tolerance)] = FATES.index(Fate.SYNCHRONOUS)

    # find the starts that are still approaching, by their errors after half of the transient and by the exponent
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
    """Return a scene without reduction: all nodes have different starts."""
    return replace(reduce_scene(scene, reduce=False), jumps=True)


def _motion(scene: Scene, partial: Criterion, atol: float | None, execution: Execution) -> SynchronousMotion:
    """Return the synchronous motion from the state of the scene's first oscillator."""
    unit = scene.replace(transient=1.0, window=1.0, atol=atol or scene.given["atol"])
    planner, equations = Planner(unit), scene.equations
    spread = spread_of(equations, planner.rows(np.arange(min(scene.cells, 100))).start)
    first = Planner(unit.replace(axes=(), zipped=False)).rows(np.arange(1))
    with Trials.of(_unreduced(unit), execution) as trials:
        times = (partial.transient, partial.window)
        return measure_motion(trials, lambda rows: rows, equations, alike(equations, first), times, spread)


def _length(scene: Scene, used: AppliedCriterion) -> float:
    """Return the length of transient and window together, in non-dimensional time."""
    return (used.transient + used.window) * ((scene.period or 1.0) if scene.time_unit == TimeUnit.PERIOD else 1.0)


def _exponent(scene: Scene, used: AppliedCriterion, execution: Execution) -> tuple[float, float]:
    """Return the largest transversal exponent and its error; NaN if there is none.

    The precision is the least exponent that shows within the transient.
    """
    try:
        certificate = certify(scene, precision=0.5 / _length(scene, used), periods=LONGEST, workers=execution.workers)
    except (ValueError, FloatingPointError):
        return math.nan, math.nan
    return float(certificate.exponent[0]), float(certificate.stderr[0])


def _approaching(
    error: np.ndarray, earlier: np.ndarray, used: AppliedCriterion, length: float, exponent: float, stderr: float
) -> np.ndarray:
    """Return whether starts (samples,) that are not synchronous may synchronise later.

    After a long transient, the error of such a start must fall at half the rate of the exponent, or by a factor e.
    """
    if math.isnan(exponent):
        return np.asarray(error < earlier / math.e)
    fastest = 2.0 * stderr - exponent
    if fastest <= 0.0:
        return np.zeros(len(error), dtype=bool)
    # an error falls by at most exp(fastest) in a unit of time: a short transient cannot decide
    if fastest * length < math.log(max(used.size / used.tolerance, 1.0)):
        return np.ones(len(error), dtype=bool)
    return np.asarray(error < earlier * math.exp(max(0.25 * min(exponent, 0.0) * length, -1.0)))


def random_starts(scene: Scene, samples: int, ranges: Mapping[str, Range] | None = None, seed: int = 0) -> Scene:
    """Return the scene with one cell for each of `samples` random starts; `ranges` as for `basin`."""
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
    """Check the ranges, and return them in the order of the components, without the slip state of a contact."""
    names = tuple(name for name in scene.components if name not in scene.equations.modes)
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
