"""Compute basins of attraction: the shares of starts that reach each attractor of a network.

Random starts are independent, so that the exact confidence interval of a binomial proportion applies. A start that has
not reached an attractor when the time ends is undecided; the interval of every share contains the undecided starts.

Sources: Menck, Heitzig, Marwan & Kurths, Nature Phys. 9, 89 (2013); Clopper & Pearson, Biometrika
26, 404 (1934).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from synchain.models.inputs.checks import check_number, check_positive, check_seed, check_table
from synchain.models.inputs.display import HasPlot
from synchain.models.inputs.frozen import FrozenDict
from synchain.models.inputs.keywords import warn
from synchain.models.scenes.scene import Axis, Scene, check_scene

from ..cells.plan import Planner
from ..cells.reduce import reduce_scene
from ..cells.run_keywords import Given, chosen, with_numbers
from ..results.labelled import Labelled, dataset, scene_text
from ..results.labels import STATE, States, dimensions, swept
from ..stability.transversal_modes import unused_axes
from ..support.error_text import with_error
from ..support.execution import Execution
from ..support.progress import Hook
from ..support.status import Status
from .attractors import SYNCHRONOUS, Attractors
from .criterion import AppliedCriterion, Criterion, preset, resolved
from .ensemble import ENDS, LEAVING, OTHER, UNDECIDED, Ensemble
from .starts import Range, Starts
from .synchronous_motion import SynchronousMotion, alike, measure_motion, spread_of
from .trials import Trials

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DOUBLINGS = 3
"""Times that the time of undecided starts doubles, if neither the call nor the scene gives a transient (a choice)."""

LISTED = 12
"""Largest number of cells of an answer in a summary (a choice)."""

_SETTINGS = {"record": (), "observe": {}, "sections": {}, "continuation": "none"}
"""Settings of the scene of a basin, which has its own records."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Basin(Labelled):
    """The ends of starts of a scene's network, and the share of each end.

    Attributes
    ----------
    scene : Scene
        The scene, with the axes of the answer: swept parameters.
    attractors : mapping of str to str
        Condition of each named attractor.
    labels : tuple of str
        Ends of starts: named attractors; "other", or "other 1", "other 2" … by size if there are several other
        motions; then "approaching" (the motion still changes), "leaving" (at the synchronous state, which is unstable),
        "escaped", "stopped", and "not finished".
    fate : ndarray of int, shape (cells, starts)
        Index in `labels` of each start.
    start : ndarray, shape (1 or perturbed nodes, starts, dimension)
        Initial states.
    error : ndarray, shape (cells, starts)
        Synchronisation error at the end; infinite if a start did not finish or nothing is compared.
    status : ndarray of int, shape (cells, starts)
        How the integration ended.
    overlaps : tuple of (str, str, int)
        Two attractors whose conditions both hold at the end, and the number of these starts, which count as the first.
        Starts that end early because they are certain to synchronise are not compared with other conditions.
    exponent, stderr : ndarray, shape (cells,)
        Largest transversal exponent of the scene's synchronous state; NaN if it was not computed.

    See Also
    --------
    synchain.basin
    """

    scene: Scene
    attractors: FrozenDict[str]
    labels: tuple[str, ...]
    criterion: AppliedCriterion | None  # of the synchronous state, at the first cell; None if it is no attractor
    confidence: float
    grid: tuple[Axis, ...]  # axes of initial states whose points are starts
    perturbed: tuple[int, ...]  # nodes (0-based) that are perturbed one after another; empty if nodes move together
    start: np.ndarray = field(repr=False)
    fate: np.ndarray = field(repr=False)
    error: np.ndarray = field(repr=False)
    status: np.ndarray = field(repr=False)
    exponent: np.ndarray = field(repr=False)
    stderr: np.ndarray = field(repr=False)
    overlaps: tuple[tuple[str, str, int], ...] = ()  # two attractors whose conditions both hold, and in how many starts

    @property
    def data(self) -> xr.Dataset:
        """Shares with their intervals, and the initial states, end and status of each start."""
        dims, shape = self._dims
        over, sizes = self._start_dims
        first = ("perturbed",) if self.perturbed else ()
        states = States.of(self.scene)
        initial = np.stack([states.table(each) for each in self.start])
        initial = initial.reshape(*initial.shape[: len(first)], *sizes, *initial.shape[2:])
        of_starts = {
            "fate": (self.fate, ", ".join(f"{k} {label}" for k, label in enumerate(self.labels))),
            "error": (self.error, "synchronisation error, inf where a start did not finish"),
            "status": (self.status, "how the integration ended"),
        }
        return dataset(
            {
                "share": ((*dims, "attractor"), self.shares.values, "part of the starts with each fate"),
                "interval": (
                    (*dims, "attractor", "bound"),
                    self.intervals.values,
                    "confidence interval of the share; it contains the undecided starts",
                ),
                "exponent": (dims, self.exponent.reshape(shape), "transversal exponent of the synchronous state"),
                "stderr": (dims, self.stderr.reshape(shape), "standard error of the exponent"),
                **{
                    name: ((*dims, *over), values.reshape(*shape, *sizes), text)
                    for name, (values, text) in of_starts.items()
                },
                "initial": ((*first, *over, *STATE), initial, "initial states"),
            },
            {
                **self._coordinates,
                **{axis.name: list(axis.values) for axis in self.grid if axis.name in over},
                "bound": ["low", "high"],
                "component": list(states.components),
                "node": list(self.scene.topology.labels),
            },
            self.scene,
        )

    def plot(self, ax: Axes | None = None, kind: str | None = None, **style: Any) -> Axes:
        """Draw the basin into the current figure of pyplot, or into given axes.

        Parameters
        ----------
        ax : Axes, optional
            Matplotlib axes; by default pyplot's current ones, or those of a new figure.
        kind : {"image", "shares", "starts"}, optional
            By default the first of them for which the basin has numbers.

            * image: fates over two axes of initial states, for a grid of starts
            * shares: the share of each fate with its interval over a swept parameter or the perturbed node; over two
              axes, the share of the first attractor as colours
            * starts: initial states as dots, coloured by their fates
        **style
            Keywords of the Matplotlib artist.

        Returns
        -------
        Axes

        Raises
        ------
        ValueError
            If the kind is unknown, or if the basin has no numbers for it.
        """
        axes: Axes = HasPlot.plot(self, ax, kind=kind, **style)
        return axes

    @property
    def _dims(self) -> tuple[tuple[str, ...], tuple[int, ...]]:
        """Names and sizes of the dimensions of the answer."""
        each = (len(self.perturbed),) if self.perturbed else ()
        return (*dimensions(self.scene), *("perturbed" for _ in each)), (*self.scene.shape, *each)

    @property
    def _start_dims(self) -> tuple[tuple[str, ...], tuple[int, ...]]:
        """Names and sizes of the dimensions of the starts."""
        sizes = tuple(len(axis.values) for axis in self.grid)
        if math.prod(sizes) > self.samples:  # zipped
            return ("sample",), (self.samples,)
        repeats = self.samples // math.prod(sizes)
        names = tuple(axis.name for axis in self.grid)
        return ((*names, "sample"), (*sizes, repeats)) if repeats > 1 or not names else (names, sizes)

    @property
    def samples(self) -> int:
        """Number of starts in each cell of the answer."""
        return int(self.fate.shape[1])

    @property
    def counts(self) -> np.ndarray:
        """Number of starts with each end (cells, labels)."""
        return np.stack([np.bincount(row, minlength=len(self.labels)) for row in self.fate])

    @property
    def shares(self) -> xr.DataArray:
        """The part of the starts with each end, over the axes of the answer and `attractor`.

        The share of an attractor is its basin stability.
        """
        return self._labelled(self.counts / self.samples)

    @property
    def intervals(self) -> xr.DataArray:
        """Confidence interval of each share among all possible starts; its level is at least `confidence`.

        The low end counts the starts of that end only, the high end the undecided starts too. On a grid of starts, it is
        the interval of as many random starts.
        """
        from scipy.stats import beta

        counts, tail, m = self.counts, 0.5 * (1.0 - self.confidence), self.samples
        # a start that leaves the synchronous state does not belong to it, but may belong to any other end
        possible = counts.copy()
        synchronous = [name for name, text in self.attractors.items() if text == SYNCHRONOUS]
        for k, label in enumerate(self.labels):
            for other in UNDECIDED:
                if label != other and not (other == LEAVING and label in synchronous):
                    possible[:, k] += counts[:, self.labels.index(other)]
        with np.errstate(invalid="ignore"):
            low = np.where(counts > 0, beta.ppf(tail, counts, m - counts + 1), 0.0)
            high = np.where(possible < m, beta.ppf(1.0 - tail, possible + 1, m - possible), 1.0)
        return self._labelled(np.stack([low, high], axis=-1), bound=["low", "high"])

    @property
    def _coordinates(self) -> dict[str, Any]:
        """Values along the axes of the answer, and the labels."""
        coordinates: dict[str, Any] = {name: (along, values) for name, along, values in swept(self.scene)}
        if self.perturbed:
            coordinates["perturbed"] = [self.scene.topology.labels[i] for i in self.perturbed]
        return {**coordinates, "attractor": list(self.labels)}

    def _labelled(self, values: np.ndarray, **more: list[str]) -> xr.DataArray:
        """Return values (cells, labels, …) over the axes of the answer, with further dimensions."""
        dims, shape = self._dims
        coordinates = {**self._coordinates, **more}
        return xr.DataArray(values.reshape(*shape, *values.shape[1:]), coordinates, (*dims, "attractor", *more))

    @property
    def statuses(self) -> dict[Status, int]:
        """Number of starts whose integration ended with each status."""
        codes, counts = np.unique(self.status, return_counts=True)
        return {Status(int(code)): int(count) for code, count in zip(codes, counts, strict=True)}

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """Scene, attractors, shares with their intervals, exponents, and the integrations that did not finish."""
        scene, cells = self.scene, len(self.fate)
        named = (("attractor", f"{name}: {text}") for name, text in self.attractors.items() if text != name)
        criterion = () if self.criterion is None else (("synchronous", self.criterion.text(scene)),)
        total = f"{self.samples} starts" + (f" in each of {cells} cells" if cells > 1 else "")
        ends = (
            ("integration", f"{n} start{'s' * (n > 1)}: {s.message}")
            for s, n in self.statuses.items()
            if s != Status.FINISHED
        )
        return (
            ("scene", scene_text(scene)),
            *named,
            ("starts", f"{total}; intervals with confidence {self.confidence:g} contain the undecided starts"),
            *self._share_rows(),
            *(("in two", f"{first}, {second}: {both} starts, of {first}") for first, second, both in self.overlaps),
            *criterion,
            *ends,
        )

    def _share_rows(self) -> list[tuple[str, str]]:
        """Return the rows of a summary with shares: one for each end, or one for each cell of the answer."""
        counts, intervals = self.counts, self.intervals.values.reshape(len(self.fate), len(self.labels), 2)
        seen = [k for k, label in enumerate(self.labels) if label in self.attractors or counts[:, k].any()]
        rows: list[tuple[str, str]] = []
        if len(counts) == 1:
            for k in seen:
                low, high = intervals[0, k]
                share = f"share {counts[0, k] / self.samples:.4g} ({counts[0, k]} of {self.samples} starts)"
                rows.append((self.labels[k], f"{share}, between {low:.4g} and {high:.4g}"))
            return rows + self._exponent_rows(0, "exponent")
        for cell, where in enumerate(self._cells()[:LISTED]):
            parts = [
                f"{self.labels[k]} {counts[cell, k] / self.samples:.3g} ({intervals[cell, k, 0]:.3g} … {intervals[cell, k, 1]:.3g})"
                for k in seen
            ]
            rows.append((where, ", ".join([*parts, *(text for _, text in self._exponent_rows(cell, ""))])))
        return rows + [("…", f"{len(counts) - LISTED} more cells, in .data")] * (len(counts) > LISTED)

    def _exponent_rows(self, cell: int, name: str) -> list[tuple[str, str]]:
        """Return the row of a summary with the exponent of a cell, if there is one."""
        value, error = float(self.exponent[cell]), float(self.stderr[cell])
        if math.isnan(value):
            return []
        unstable = ": the synchronous state is unstable" if value - 2.0 * error > 0.0 else ""
        return [(name, f"{'' if name else 'exponent '}{with_error(value, error)}{unstable}")]

    def _cells(self) -> list[str]:
        """Return texts that name the cells of the answer."""
        dims, shape = self._dims
        texts = []
        for index in np.ndindex(*shape):
            at = dict(zip(dims, index, strict=True))
            parts = [f"{name} = {values[at[along[0]]]:.6g}" for name, along, values in swept(self.scene)]
            if self.perturbed:
                parts.append(f"node {self.scene.topology.labels[self.perturbed[at['perturbed']]]}")
            texts.append(", ".join(parts))
        return texts


def basin(
    scene: Scene,
    *,
    samples: int | None = None,
    ranges: Mapping[str, Range] | None = None,
    attractors: Mapping[str, str] | None = None,
    nodes: str | Sequence[int] | None = None,
    bound: float | Mapping[str, float] | None = None,
    tolerance: float | None = None,
    transient: float | None = None,
    window: float | None = None,
    rng: int | np.random.Generator | None = None,
    confidence: float = 0.95,
    workers: int | None = None,
    executor: Executor | None = None,
    show_progress: bool | None = None,
    progress: Hook | None = None,
    parameters: Mapping[str, object] | None = None,
    **axes: object,
) -> Basin:
    """Start a scene's network from many states, and count the starts that reach each attractor.

    The state of every oscillator is drawn uniformly from `ranges`, independently of the other oscillators. The result
    depends on `rng`, but not on the workers. A larger sample begins with the starts of a smaller one, and all cells of a
    sweep have the same starts. Axes of initial states make a grid of starts.

    A start belongs to the first attractor whose condition holds over the window at the end; a warning names two whose
    conditions both hold, with the number of starts. The verdict counts if it
    was the same over a window at half of the transient; for the synchronous state and for rest, if the error or the
    speed has fallen since. Other starts count as *approaching* while their motion changes from window to window:
    its features (mean over nodes and time, fluctuation in time, spread of the nodes; cosine and sine for angles)
    differ by more than a quarter of its size. Approaching starts decide nothing.

    Parameters
    ----------
    scene : Scene
        The network, with axes. The records of the scene are ignored; its stop ends cells.
    samples : int, optional
        Number of random starts (default: 1000), at each point of a grid of starts (default there: 1, without random
        states).
    ranges : mapping of str to (float, float), optional
        Lowest and highest initial value of each component (default: -1 and 1 for all components). If ranges are given,
        all other components start as in the scene.
    attractors : mapping of str to str, optional
        Condition of each attractor, by a name: a comparison of observables such as ``"mean(x_1) > 0 and maximum(x_2) <
        P/alpha"`` (with and, or, not, parameters), "synchronous", or "rest". Default: the synchronous state. Other
        motions are grouped by their features.
    nodes : "each" or sequence of int, optional
        Nodes that are perturbed, counted from 1; all others start as in the scene. "each" perturbs one node after
        another, and adds the dimension `perturbed` to the answer (single-node basin stability). Default: all nodes.
    bound : float or mapping of str to float, optional
        Largest size of the components of a bounded motion; a start that passes it has escaped and ends there. Without
        a bound, a start escapes when its state grows beyond all limits, or beyond a million ranges of the starts when its
        steps are used up.
    tolerance : float, optional
        A start is synchronous if its mean synchronisation error over the window is below this value. By default a
        thousandth of the extent of the synchronous motion; the error of each component is then tested too.
    transient, window : float, optional
        In the scene's unit of time; by default as for a `Criterion`, or those of the scene if the synchronous state is
        no attractor. If neither the call nor the scene gives a transient, the time of undecided starts doubles up to
        three times.
    rng : int or Generator, optional
        Seed or generator of the random starts; by default the seed of the scene.
    confidence : float
        Level of the confidence intervals.
    workers, executor, show_progress, progress
        As for `run`.
    parameters, **axes
        Parameters and initial states, as for `run`: a number fixes one, a sequence sweeps it.

    Returns
    -------
    Basin
        A start takes at most a hundred times as many steps as the synchronous motion. A start that needs more counts as
        escaped or not finished.

    Warns
    -----
    RuntimeWarning
        If the conditions of two attractors hold in one start.

    Raises
    ------
    ValueError
        If a component, a node or a name in a condition is unknown, if a range is empty, if a number is out of range, or
        if the scene has draws.
    TypeError
        If the number of samples is not whole.

    See Also
    --------
    synchain.run : All starts with their motions.
    synchain.thresholds : Strengths at which a network synchronises.

    Examples
    --------
    Two cells with the states -1 and 1 each, weakly coupled:

    >>> import synchain as sc
    >>> pair = sc.Scene(sc.Field({"x": "x - x**3"}), "x->x", sc.graphs.chain(2), parameters={"sigma": 0.01})
    >>> wells = {"both left": "mean(x_1) < 0 and mean(x_2) < 0", "both right": "mean(x_1) > 0 and mean(x_2) > 0"}
    >>> found = sc.basin(pair, samples=100, attractors=wells, transient=40, window=5, show_progress=False)
    >>> found.shares.sel(attractor=["both left", "both right", "other"]).values
    array([0.16, 0.29, 0.55])
    """
    check_scene(scene)
    if tolerance is not None and not check_number("basin: tolerance", tolerance) > 0:
        raise ValueError(f"basin: tolerance = {tolerance}; expected a positive number")
    if not 0 < check_number("basin: confidence", confidence) < 1:
        raise ValueError(f"basin: confidence = {confidence}; expected a number between 0 and 1, e.g. 0.95")
    execution = Execution(workers, executor, show_progress, progress)
    scene = Given(basin, parameters, axes).sweep(scene, **_SETTINGS)
    if scene.realisations:
        raise ValueError(
            "basin: found draws; expected a scene without them; write scene.replace(realisations=0, draws=None)"
        )
    seed = scene.rng if rng is None else check_seed("basin: rng", rng)
    starts = Starts.of(scene, samples, ranges, nodes, seed)
    answer = _without_grid(scene, starts)
    known = Attractors.of(answer, attractors, (OTHER, *ENDS))
    limits = _limits(answer, bound)

    # times and tolerance of each cell of the sweep, from its synchronous motion if that is an attractor
    partial = preset(Criterion(tolerance, 1, 0.0, transient, window, None, seed), answer)
    endless = chosen(answer, "transient", transient, None) is None
    if known.name_of(SYNCHRONOUS) is None:
        if tolerance is not None:
            raise ValueError('basin: tolerance: found no attractor "synchronous"; expected one, which it decides')
        times = {
            name: getattr(answer, name) if value is None else value
            for name, value in (("transient", transient), ("window", window))
        }
        criteria: tuple[AppliedCriterion, ...] = ()
        timed = answer.replace(**times)
    else:
        criteria = _criteria(answer, partial, starts, execution)
        timed = answer
    with Ensemble(timed, starts, criteria, known, limits, execution) as ensemble:
        ensemble.run(DOUBLINGS if endless else 0)
    for first, second, both in ensemble.overlaps:
        warn(
            f"basin: found {both} of {ensemble.fate.size} starts that fulfil {_condition(known.table, first)} and "
            f"{_condition(known.table, second)}; expected one of them; they count as {first!r}, the first of both"
        )
    shape = len(ensemble.exponent) * max(len(starts.perturbed), 1), starts.count
    each = np.repeat(np.arange(len(ensemble.exponent)), max(len(starts.perturbed), 1))
    return Basin(
        timed,
        known.table,
        ensemble.labels,
        criteria[0] if criteria else None,
        float(confidence),
        starts.grid,
        starts.perturbed,
        starts.states,
        ensemble.fate.reshape(shape),
        ensemble.error.reshape(shape),
        ensemble.status.reshape(shape),
        ensemble.exponent[each],
        ensemble.stderr[each],
        ensemble.overlaps,
    )


def _condition(table: Mapping[str, str], name: str) -> str:
    """Return the name of an attractor with its condition, if they differ."""
    return repr(name) if table[name] == name else f"{name!r} ({table[name]})"


def _without_grid(scene: Scene, starts: Starts) -> Scene:
    """Return the scene with the axes of the answer, those of parameters, and without sample times."""
    rest = [axis for axis in scene.axes if axis not in starts.grid]
    if scene.zipped and rest and starts.grid:
        raise ValueError(
            f"basin: found zipped axes of parameters and initial states, {rest[0].name} and {starts.grid[0].name}; "
            "expected either; sweep one of them by a second call"
        )
    return scene.replace(axes=rest, zipped=scene.zipped and bool(rest), t_eval=None)


def _limits(scene: Scene, bound: float | Mapping[str, float] | None) -> dict[str, float]:
    """Check the argument `bound`; return the largest size of each bounded component."""
    names = [name for name in scene.components if name not in scene.equations.modes]
    if bound is None:
        return {}
    table = dict.fromkeys(names, bound) if not isinstance(bound, Mapping) else check_table("basin: bound", bound)
    unknown = [name for name in table if name not in names]
    if unknown or not table:
        raise ValueError(
            f"basin: bound: found {str(unknown[0]) if unknown else 'no component'!r}; known: {', '.join(names)}"
        )
    return {str(name): check_positive(f"basin: bound of {name}", value) for name, value in table.items()}


def _criteria(scene: Scene, partial: Criterion, starts: Starts, execution: Execution) -> tuple[AppliedCriterion, ...]:
    """Return the criterion of each cell; cells that differ in strengths without influence on the motion share it."""
    columns, still = Planner(scene).columns(np.arange(scene.cells)), unused_axes(scene)
    spread = spread_of(scene.equations, starts.states.reshape(-1, starts.states.shape[-1]))
    criteria: dict[tuple[float, ...], AppliedCriterion] = {}
    keys = []
    for cell in range(scene.cells):
        values = {name: float(column[cell]) for name, column in columns.items()}
        keys.append(tuple(value for name, value in values.items() if name not in still))
        if keys[-1] not in criteria:
            single = with_numbers(scene, values, axes=(), zipped=False, stop=None)
            criteria[keys[-1]] = resolved(partial, single, _motion(single, partial, spread, execution))
    return tuple(criteria[key] for key in keys)


def _motion(
    scene: Scene, partial: Criterion, spread: np.ndarray, execution: Execution
) -> Callable[[float | None], SynchronousMotion]:
    """Return a function of atol that measures the synchronous motion from the state of the first oscillator."""

    def measure(atol: float | None) -> SynchronousMotion:
        # all oscillators start alike, so that one of them is integrated where the network allows
        start = {name: values[0] for name, values in scene.initial.items() if name not in scene.equations.modes}
        unit = scene.replace(initial=start, transient=1.0, window=1.0, atol=atol or scene.given["atol"])
        reduction, equations = reduce_scene(unit.replace(record=("sync_error",))), scene.equations
        first, times = Planner(unit).rows(np.arange(1)), (partial.transient, partial.window)
        with Trials.of(reduction, execution) as trials:
            return measure_motion(trials, reduction.rows, equations, alike(equations, first), times, spread)

    return measure
