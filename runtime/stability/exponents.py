"""Transversal Lyapunov exponents of the synchronous state: the master stability function.

One orbit carries the modes of all strengths alpha + i beta = -sigma gamma at once. On a fixed point or a
cycle the exponents follow from eigenvalues (`attractor`). Elsewhere they are the mean growth of a deviation
(`march`), with an error from batch means (`averages`); propagators of most modes are interpolated in the
strength (`interpolation`). `along` is the road from starts to `Exponents`.

Sources: Pecora & Carroll, Phys. Rev. Lett. 80, 2109 (1998); Benettin, Galgani, Giorgilli &
Strelcyn, Meccanica 15, 9 (1980).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import xarray as xr

from synchain.models.dynamics.synchrony import expect_vanishing
from synchain.models.inputs.checks import check_integer
from synchain.models.inputs.keywords import warn
from synchain.models.scenes.scene import Scene, check_scene

from ..cells.run_keywords import ONE_CELL, ORBITS, Given, chosen
from ..prediction.intervals import Interval
from ..results.labelled import Labelled, dataset
from ..support.arrays import numbers
from ..support.arrays import row as row_of
from ..support.error_text import interval_text, range_text, with_error
from ..support.execution import Execution
from ..support.progress import Hook, Reporter
from .attractor import Attractor, Motion, find_attractor
from .averages import Averaging, Batches, document_keywords
from .march import March, interpolation_for
from .motion import starts_near
from .orbits import OrbitProblem, pair_of
from .slow_motion import warn_of_slow_motion
from .transversal_modes import unused_axes

APART = 5.0
"""Two starts are on two motions if their averages differ by more than APART errors at any strength (a choice)."""

RTOL = 1e-6
"""Relative tolerance unless a call or the scene says otherwise: averages have larger errors (a choice)."""

ROUNDING = 1e-9
"""The exponent at the first strength is zero below this share of the largest one."""


@dataclass(frozen=True, slots=True, repr=False)
class Exponents(Labelled):
    """Largest transversal exponent at each strength.

    The mean is over the scene's own start and the further ones that reached the same attractor.

    Parameters
    ----------
    alpha : ndarray, shape (m,) or (m, layers)
        Strengths, real or complex; of several layers of links one each.
    exponent : ndarray, shape (m,)
        Exponents per unit of non-dimensional time.
    stderr : ndarray, shape (m,)
        Standard errors. On fixed points and periodic orbits, the difference of two cycles, or of two tolerances;
        elsewhere the mean lies within two of them in 95 of 100 runs; infinite below 59 periods; with the error of the
        steps (docs/accuracy.md).
    time : float
        Time averaged over for each start.
    starts : int
        Number of starts.
    by_start : ndarray, shape (starts, m)
        Exponents of each start.
    attractors : tuple of Attractor
        Motion of each start.
    groups : tuple of tuple of int
        Indices of the starts on each attractor; the first one is that of the scene's own start.
    unit : str
        Unit of time in which transients and averages are counted.
    precision : float
        Standard error that the average had to reach.
    """

    alpha: np.ndarray
    exponent: np.ndarray
    stderr: np.ndarray
    time: float
    starts: int
    by_start: np.ndarray = field(repr=False)
    attractors: tuple[Attractor, ...] = ()
    groups: tuple[tuple[int, ...], ...] = ()
    unit: str = ""
    precision: float = 0.0

    @property
    def data(self) -> xr.Dataset:
        """Exponents and their errors over the modes, with alpha and beta as coordinates."""
        dims = ("mode", "layer")[: self.alpha.ndim]
        modes = {"alpha": (dims, self.alpha.real)}
        if np.iscomplexobj(self.alpha):
            modes["beta"] = (dims, self.alpha.imag)
        return dataset(
            {
                "exponent": (("mode",), self.exponent, "largest transversal exponent per unit of time"),
                "stderr": (("mode",), self.stderr, "standard error of the exponent"),
                "by_start": (("start", "mode"), self.by_start, "exponents of each start"),
                "attractor": (("start",), [a.kind for a in self.attractors], "motion of each start"),
            },
            modes,
        )

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """Strengths, stable ranges, motion and the length of the average."""
        stable: tuple[tuple[str, str], ...] = ()
        if self.on_a_line:
            stable = (("negative for alpha", self.negative),)
        return (
            ("strengths", f"{len(self.alpha)}, {range_text(self.alpha)}"),
            *stable,
            *exponent_rows(self.exponent, self.stderr, [a.kind for a in self.attractors], self.time),
            *self.accuracy,
        )

    @property
    def negative(self) -> str:
        """Ranges of alpha with a negative exponent as text; dots where one ends with the grid."""
        errors = [(low, high) for (_, low), (_, high) in self.ranges]
        return interval_text(self.intervals, errors, (self.alpha.min(), self.alpha.max()))

    @property
    def accuracy(self) -> tuple[tuple[str, str], ...]:
        """Undecided signs, the largest error if it exceeds the precision, and the unit of time, for a summary."""
        rows: list[tuple[str, str]] = []
        if self.undecided:
            rows.append(("undecided for alpha", interval_text(self.undecided)))
        worst = float(np.max(self.stderr, initial=0.0))
        if self.precision and worst > self.precision:
            rows.append(("errors", f"up to {worst:.2g}; precision = {self.precision:g} was not reached; raise periods"))
        if self.unit:
            rows.append(("unit", self.unit))
        return tuple(rows)

    @property
    def on_a_line(self) -> bool:
        """True if the strengths are real, one for each mode."""
        return self.alpha.ndim == 1 and not np.iscomplexobj(self.alpha)

    @property
    def averaged(self) -> int:
        """Number of starts in the mean."""
        return len(self.groups[0]) if self.groups else self.starts

    @property
    def intervals(self) -> tuple[Interval, ...]:
        """Intervals of real strengths with a negative exponent; ends by linear interpolation."""
        return tuple((low, high) for (low, _), (high, _) in self.ranges)

    @property
    def ranges(self) -> tuple[tuple[Interval, Interval], ...]:
        """The intervals as ((low, its uncertainty), (high, its uncertainty)).

        The uncertainty is the standard error over the slope, and the effect of a bend between two strengths; 0 at
        the ends of the grid.

        Raises
        ------
        ValueError
            If the strengths are complex, or those of several layers.
        """
        x, error = self.alpha, self.stderr
        if not self.on_a_line:
            kind = "complex" if np.iscomplexobj(x) else f"those of {x.shape[1]} layers"
            raise ValueError(f"strengths are {kind}; ranges need real ones of a single layer")
        y, stable, _ = self._judged
        # an end beside a stretch of undecided signs lies anywhere within it
        blurred = np.zeros(len(x), dtype=bool)
        for first, last in _uncertain(y, error):
            blurred[max(first - 1, 0) : last + 1] = True
        ends: list[Interval] = [(float(x[0]), 0.0)] if stable[0] else []
        for i in map(int, np.flatnonzero(stable[1:] != stable[:-1])):
            # the zero by the line through points i and i + 1, its slope by a fit to five points
            a, b = max(i - 2, 0), min(i + 3, len(x) - 1)
            step = y[i + 1] - y[i] if np.isfinite(y[i] * y[i + 1]) else np.inf  # an exponent of -inf has no slope
            smooth = b - a >= 3 and bool(np.all(np.isfinite(y[a:b])))
            slope = abs(np.polyfit(x[a:b], y[a:b], 1)[0] if smooth else step / (x[i + 1] - x[i]))
            zero = x[i] - y[i] / step * (x[i + 1] - x[i]) if np.isfinite(step) else (x[i] if y[i] >= 0 else x[i + 1])
            spread = float(max(error[i], error[i + 1]) / max(slope, 1e-300))
            first = last = i
            while blurred[i] and last + 1 < len(x) and blurred[last]:
                last += 1
            while blurred[i] and first > 0 and blurred[first]:
                first -= 1
            ends.append((float(zero), spread + _bend(x, y, i, float(zero)) + float(x[last] - x[first])))
        if stable[-1]:
            ends.append((float(x[-1]), 0.0))
        return tuple(zip(ends[::2], ends[1::2], strict=True))

    @property
    def undecided(self) -> tuple[Interval, ...]:
        """Ranges of real strengths where the exponent seems to change its sign, but by less than two errors."""
        x, stretches = self.alpha, self._judged[2] if self.on_a_line else ()
        return tuple((float(x[first]), float(x[last])) for first, last in stretches)

    @property
    def _judged(self) -> tuple[np.ndarray, np.ndarray, tuple[tuple[int, int], ...]]:
        """The exponents (m,) with the first set to zero within its error; True (m,) in an interval; the undecided stretches."""
        y, error = self.exponent, self.stderr
        rounding = ROUNDING * np.max(np.abs(y[np.isfinite(y)]), initial=0.0)
        if abs(y[0]) <= max(2.0 * error[0], rounding) < np.inf:
            y = np.append(0.0, y[1:])  # zero to its error, such as that of a limit cycle at strength 0
        stable, changed = y < 0, list[tuple[int, int]]()
        for first, last in _uncertain(y, error):
            inside = slice(first, last + 1)
            gap = first > 0 and last + 1 < len(y) and y[first - 1] < 0 and y[last + 1] < 0
            if np.any(stable[inside] != gap) and (gap or np.any(stable[inside])):
                changed.append((first, last))
                stable[inside] = gap
        return y, stable, tuple(changed)


def exponent_rows(
    exponent: np.ndarray, stderr: np.ndarray, attractors: Sequence[str], time: float, period: float | None = None
) -> tuple[tuple[str, str], ...]:
    """Return the rows of a summary on the sizes of exponents, on the attractor of each start, and on the average."""
    kinds = (f"{kind} ({n} of {len(attractors)} starts)" for kind, n in Counter(attractors).most_common())
    drive = f" ({time / period:.0f} drive periods)" if period else ""
    length = f"{time:.6g} units of time{drive} for each start" if time else "not needed"
    worst = float(np.max(stderr, initial=0.0))
    error = f"largest standard error {worst:.2g}" if math.isfinite(worst) else "too short for an error: raise periods"
    return (
        ("smallest, largest", f"{with_error(exponent.min())}, {with_error(exponent.max())} per unit of time"),
        ("attractor", "; ".join(kinds)),
        ("average", f"{length}, {error}"),
    )


def _uncertain(y: np.ndarray, error: np.ndarray) -> list[tuple[int, int]]:
    """First and last indices of stretches of runs of one sign in which no sign is certain.

    A sign is certain if one exponent of the run is two errors from zero, or if its error is unknown.
    """
    certain = ~np.isfinite(error) | (y + 2.0 * error < 0.0) | (y - 2.0 * error >= 0.0)
    runs = np.cumsum(np.append(0, (y[1:] < 0) != (y[:-1] < 0)))
    doubtful = ~np.isin(runs, runs[certain])
    edges = np.flatnonzero(np.diff(np.concatenate([[False], doubtful, [False]])))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _bend(x: np.ndarray, y: np.ndarray, i: int, zero: float) -> float:
    """Largest distance of the zero of a bent function from that of the line through points i and i + 1.

    At the share z of the way, a function whose slope changes by J is at most J z (1 - z) times the gap
    from the line, even if it has a kink.  The slopes beside the gap give J and the least slope at the
    zero.  Without them, or if they differ in sign, the zero lies anywhere in the gap.
    """
    if y[i] == 0.0 or y[i + 1] == 0.0:
        return 0.0
    gap = x[i + 1] - x[i]
    share = (zero - x[i]) / gap
    before, after = np.searchsorted(x, x[i] - 1e-6 * gap) - 1, np.searchsorted(x, x[i + 1] + 1e-6 * gap)
    most = float(max(share, 1.0 - share) * gap)
    if before < 0 or after == len(x) or not np.all(np.isfinite(y[[before, i, i + 1, after]])):
        return most
    slopes = np.diff(y[[before, i, i + 1, after]]) / np.diff(x[[before, i, i + 1, after]])
    least = min(slopes * np.sign(slopes[1]))
    return (
        min(most, float(share * (1.0 - share) * gap * np.abs(np.diff(slopes)).sum() / least)) if least > 0.0 else most
    )


@document_keywords
def exponents(
    scene: Scene,
    alpha: Sequence[float] | Sequence[complex] | np.ndarray,
    *,
    precision: float = 1e-3,
    periods: float = 5000,
    transient: float | None = None,
    starts: int = 4,
    rtol: float | None = None,
    seed: int | None = None,
    workers: int | None = None,
    show_progress: bool | None = None,
    progress: Hook | None = None,
    parameters: Mapping[str, float] | None = None,
    **more: float,
) -> Exponents:
    """Compute the largest transversal exponent of an oscillator and coupling at each strength.

    Parameters
    ----------
    scene : Scene
        Source of the oscillator and the coupling; a lone oscillator gets a partner.
    alpha : array_like, shape (m,) or (m, layers)
        Strengths alpha + i beta = -sigma gamma, real or complex; of several layers of links one each, with the eigenvalues
        of the layers on a common mode.
    {average}
    {starts}
    {progress}
    {parameters}

    Returns
    -------
    Exponents

    Warns
    -----
    RuntimeWarning
        If starts reach another motion than the scene's own: the exponents are those of the scene's own start.

    Notes
    -----
    Of the scene's fields the model, parameters, first initial state, `contact`, `integrator`, `atol` and `max_steps` are
    used; its `rtol`, `transient` and `seed` if they are not those of a scene by default, and no keyword is given.

    Raises
    ------
    ValueError
        If the network has no coupling, if the coupling has no synchronous state, if time enters
        without a known period, for a scene with a stop, and with draws, or axes that move the orbit; the
        strength of links that vanish between equal states does not.
    FloatingPointError
        If an integration fails.
    """
    given = Given(exponents, parameters, more, ORBITS)
    execution = Execution(workers, None, show_progress, progress)
    averaging = Averaging.for_scene(scene, precision, periods, transient, seed, execution)
    asked = numbers("alpha", alpha, complex_too=True)
    of_layers = asked.ndim == 2 and len(check_scene(scene).model.linked) > 1
    strengths = row_of("alpha", asked.ravel() if of_layers else asked, complex_too=True)
    return transversal(
        given, scene, strengths.reshape(asked.shape) if of_layers else strengths, starts, rtol, averaging
    )


def transversal(
    given: Given, scene: Scene, strengths: np.ndarray, starts: int, rtol: float | None, averaging: Averaging
) -> Exponents:
    """Compute the exponents at strengths (m,) or (m, layers) for a public function's call."""
    reporter = averaging.reporter()
    cell = coupled_cell(given, scene, chosen(scene, "rtol", rtol, RTOL))
    problem, states = orbits_of(cell, strengths, starts, averaging)
    averaging = averaging.in_units(cell, problem.unit)
    reporter.total = averaging.length
    with reporter:
        return along(problem, states, strengths, averaging, reporter)


def orbits_of(
    scene: Scene, strengths: np.ndarray, starts: int, averaging: Averaging
) -> tuple[OrbitProblem, np.ndarray]:
    """Return the problem of transversal modes, and the starts (starts, components); parameters as for `transversal`."""
    starts = check_integer("starts", starts, 1)
    first = np.array([values[0] for values in scene.initial.values()], dtype=float)
    problem = OrbitProblem.of_modes(scene, strengths, first[None], averaging.execution.size)
    if starts > 1 and not problem.linear:
        problem = problem.observed(problem.with_slip_states(first[None])[0])
    # further starts are copies up to REACH extents away
    return problem, problem.with_slip_states(starts_near(first, problem.extent[: len(first)], starts, averaging.seed))


def along(
    problem: OrbitProblem, states: np.ndarray, strengths: np.ndarray, averaging: Averaging, reporter: Reporter
) -> Exponents:
    """Compute the exponents of all modes along orbits from states (starts, components). Shapes: strengths (m,) or (m, layers)."""
    starts = len(states)
    bounded = np.ones(starts, dtype=bool)
    if not problem.linear:
        problem, states, bounded = _settled(problem, states, averaging.transient, reporter)

    # exponents of fixed points and cycles are eigenvalues; a search for a cycle moves its state on
    attractors, reached = [], states.copy()
    for row in range(starts):
        attractor = Attractor(Motion.UNBOUNDED, 0.0)
        if bounded[row]:
            attractor, reached[row] = find_attractor(problem, states[row], averaging.transient)
        attractors.append(attractor)
    by_start = np.full((starts, len(problem.strengths)), np.nan)
    error = np.full_like(by_start, np.nan)
    for row, attractor in enumerate(attractors):
        if attractor.propagators is not None:
            by_start[row], error[row] = attractor.exponents()
    time = max(attractor.cycle for attractor in attractors)

    # exponents of other motion are mean growth rates
    aperiodic = [row for row, attractor in enumerate(attractors) if attractor.motion is Motion.APERIODIC]
    if aperiodic:
        begun = reached[aperiodic]
        march = March.begin(problem, begun, interpolation_for(problem, begun, averaging.periods))
        by_start[aperiodic], error[aperiodic], time = average(march, averaging, reporter)
        warn_of_slow_motion(problem.variation.orbit, begun, problem.parameter_values, time)

    groups = group_by_attractor(attractors, by_start, error)
    first = list(groups[0])
    if len(groups) > 1:
        others = ", ".join(dict.fromkeys(attractors[group[0]].kind for group in groups[1:]))
        warn(
            f"exponents: found {starts - len(first)} of {starts} starts on another motion than the scene's own start "
            f"({others}); expected one motion; the exponents are those of the scene's own, by_start has all"
        )
    mean, spread = by_start[first].mean(axis=0), np.sqrt((error[first] ** 2).sum(axis=0)) / len(first)
    unit = "" if problem.linear else str(problem.turns)
    return Exponents(
        strengths, mean, spread, time, starts, by_start, tuple(attractors), groups, unit, averaging.precision
    )


def _settled(
    problem: OrbitProblem, states: np.ndarray, transient: float, reporter: Reporter
) -> tuple[OrbitProblem, np.ndarray, np.ndarray]:
    """Run the transient of all starts; True (starts,) for each that stays bounded. FloatingPointError if the first does not."""
    bounded = np.ones(len(states), dtype=bool)
    try:
        return *problem.settled(states, transient, reporter.advance), bounded
    except FloatingPointError:
        if len(states) == 1:
            raise
    # one that fails stops all: run each alone
    problem, ends = problem.observed(states[0]), states.copy()
    for row in range(len(states)):
        try:
            ends[row] = problem.settled(states[row : row + 1], transient)[1][0]
        except FloatingPointError:
            if row == 0:
                raise
            bounded[row] = False
    return problem, ends, bounded


def coupled_cell(given: Given, scene: Scene, rtol: float) -> Scene:
    """Return a single cell with a coupling: a lone oscillator gets a partner, if there is a link for it.

    The scene may sweep strengths that do not move the synchronous orbit.
    """
    given.expect_one_cell(scene, unused_axes(scene))
    return given.scene(with_partner(scene), rtol=rtol)


def with_partner(scene: Scene) -> Scene:
    """Return a network that sweeps nothing: a lone oscillator gets a partner; ValueError if the link moves them both.

    One that its coupling cannot join stays alone: it has the mode of strength 0 (`OrbitProblem.of_modes`).
    """
    if check_scene(scene).model.linked:
        return scene.replace(**ONE_CELL)
    try:
        coupled = pair_of(scene, **ONE_CELL)
    except ValueError:
        return scene.replace(**ONE_CELL)
    expect_vanishing("a lone oscillator gets a partner", coupled.equations)
    return coupled


def initial_states(scene: Scene, starts: int, seed: int) -> np.ndarray:
    """Return the first oscillator's initial state and others near it (starts, components), by the extent of its motion."""
    return orbits_of(scene, np.zeros(1), starts, Averaging(0.0, 1, 0, seed, Execution(1)))[1]


def group_by_attractor(
    attractors: Sequence[Attractor], by_start: np.ndarray, error: np.ndarray
) -> tuple[tuple[int, ...], ...]:
    """Group the starts by attractor, that of the first start first.

    Two attractors are the same if they are of one kind and their exponents (starts, m) agree, to their errors: those of
    cycles and fixed points to `Attractor.resolution`, averages within APART errors.
    """
    groups: list[list[int]] = []
    for row, attractor in enumerate(attractors):
        for others in groups:
            first = others[0]
            alike = attractors[first].kind == attractor.kind
            if alike and attractor.propagators is not None:
                alike = np.allclose(by_start[first], by_start[row], rtol=1e-3, atol=attractor.resolution())
            elif alike and attractor.motion is Motion.APERIODIC:
                both = APART * np.hypot(error[first], error[row])
                alike = not np.any(np.abs(by_start[first] - by_start[row]) > both)
            if alike:
                others.append(row)
                break
        else:
            groups.append([row])
    return tuple(map(tuple, groups))


def average(march: March, averaging: Averaging, reporter: Reporter) -> tuple[np.ndarray, np.ndarray, float]:
    """Average growth rates along a march from where it is.

    Shapes: returns mean, error (starts, m).
    """
    batches, steps = Batches(march.problem.unit, march.block), np.zeros(())
    for left in averaging.rounds(batches, batches.error, reporter):
        if batches.blocks == 0:
            growths, steps = march.tried(left)
            parts = np.ones(len(growths), dtype=np.int64)
        else:
            parts = batches.ahead(left)
            growths = march.growths(parts)
        batches.extend(growths, parts)
    return batches.mean(), np.hypot(batches.error_by_start(), steps), batches.time
