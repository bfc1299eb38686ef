"""Compute transversal Lyapunov exponents of the synchronous state: the master stability function.

The modes of all strengths alpha + i beta = -sigma gamma are integrated along one orbit. On a fixed point or a
cycle the exponents follow from eigenvalues (`attractor`). On other motion an exponent is the mean growth of a
deviation (`march`), with an error from batch means (`averages`); the propagators of most modes are interpolated
in the strength (`interpolation`). `along` computes `Exponents` from the initial states.

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
from synchain.models.scenes.open_stops import without_open_stops
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
from .averages import Averaging, Batches, document_keywords, with_growth_by_powers
from .march import March, interpolation_for
from .motion import starts_near
from .orbits import OrbitProblem, pair_of
from .slow_motion import warn_of_slow_motion
from .transversal_modes import unused_axes

APART = 5.0
"""Two starts are on different attractors if their averages differ by more than APART errors at any strength (a
choice)."""

RTOL = 1e-6
"""Default relative tolerance, if neither the call nor the scene sets one; averages have larger errors (a choice)."""

ROUNDING = 1e-9
"""The exponent at the first strength counts as zero if its size is below this share of the largest exponent's."""


@dataclass(frozen=True, slots=True, repr=False)
class Exponents(Labelled):
    """Largest transversal exponent at each strength.

    Each exponent is the mean over the scene's own start and the other starts that reached the same attractor.

    Parameters
    ----------
    alpha : ndarray, shape (m,), (m, layers) or (m, layers, size, size)
        Strengths, real or complex; with several layers of links, one column for each layer, or a matrix.
    exponent : ndarray, shape (m,)
        Exponents per unit of non-dimensional time.
    stderr : ndarray, shape (m,)
        Standard errors. On fixed points and periodic orbits, an error is the difference between two cycles, or between
        two tolerances. On chaotic and quasiperiodic motion the true value lies within two errors in 95 of
        100 runs. The error is infinite below 59 periods. It contains the error of the steps (docs/accuracy.md).
    time : float
        Length of the average of each start.
    starts : int
        Number of starts.
    by_start : ndarray, shape (starts, m)
        Exponents of each start.
    attractors : tuple of Attractor
        Motion of each start.
    groups : tuple of tuple of int
        Indices of the starts on each attractor; the first group contains the scene's own start.
    unit : str
        Unit of time in which transients and averages are counted.
    precision : float
        Requested standard error.

    See Also
    --------
    synchain.exponents
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
        dims = ("mode", "layer", "row", "column")[: self.alpha.ndim]
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
            *exponent_rows(self.exponent, self.stderr, self.motions, self.time, at_zero=self.error_at_zero),
            *self.accuracy,
        )

    @property
    def negative(self) -> str:
        """Ranges of alpha with a negative exponent as text; dots mark an end of a range at an end of the grid."""
        errors = [(low, high) for (_, low), (_, high) in self.ranges]
        return interval_text(self.intervals, errors, (self.alpha.min(), self.alpha.max()))

    @property
    def accuracy(self) -> tuple[tuple[str, str], ...]:
        """Rows of a summary: undecided signs, errors above the precision, and the unit of time."""
        rows: list[tuple[str, str]] = []
        if self.undecided:
            rows.append(("undecided for alpha", interval_text(self.undecided)))
        # far below zero the error matters little: an exponent that dips has a large one
        at_zero = self.error_at_zero
        error = float(np.max(self.stderr, initial=0.0)) if at_zero is None else at_zero
        if self.precision and error > self.precision:
            where = "" if at_zero is None else " where the exponent passes zero"
            averaged = not self.groups or self.attractors[0].propagators is None
            remedy = "raise periods" if averaged else "lower rtol"
            rows.append(
                ("errors", f"up to {error:.2g}{where}; precision = {self.precision:g} was not reached; {remedy}")
            )
        if self.unit:
            rows.append(("unit", self.unit))
        return tuple(rows)

    @property
    def error_at_zero(self) -> float | None:
        """Largest standard error beside the zeros on a line of strengths; None without a zero."""
        if not self.on_a_line:
            return None
        changes = np.flatnonzero(np.diff(self._judged[1]))
        return float(np.max(self.stderr[[changes, changes + 1]])) if len(changes) else None

    @property
    def motions(self) -> tuple[str, ...]:
        """Kind of motion of each start; further motions of one kind are numbered, as "periodic (motion 2)"."""
        kinds = [attractor.kind for attractor in self.attractors]
        for k, group in enumerate(self.groups):
            same = sum(self.attractors[other[0]].kind == kinds[group[0]] for other in self.groups[:k])
            for start in group if same else ():
                kinds[start] = f"{kinds[start]} (motion {same + 1})"
        return tuple(kinds)

    @property
    def on_a_line(self) -> bool:
        """True if every mode has a single strength, and all strengths are real."""
        return self.alpha.ndim == 1 and not np.iscomplexobj(self.alpha)

    @property
    def averaged(self) -> int:
        """Number of starts in the mean of the exponents."""
        return len(self.groups[0]) if self.groups else self.starts

    @property
    def intervals(self) -> tuple[Interval, ...]:
        """Intervals of real strengths with a negative exponent; the ends are interpolated linearly."""
        return tuple((low, high) for (low, _), (high, _) in self.ranges)

    @property
    def ranges(self) -> tuple[tuple[Interval, Interval], ...]:
        """Intervals with the uncertainties of their ends, ((low, uncertainty), (high, uncertainty)).

        An uncertainty is the standard error divided by the slope, plus the largest effect of a bend between two
        strengths. At the ends of the grid the uncertainty is 0.

        Raises
        ------
        ValueError
            If the strengths are complex, or if there are several layers.
        """
        x, error = self.alpha, self.stderr
        if not self.on_a_line:
            kind = "complex" if np.iscomplexobj(x) else f"those of {x.shape[1]} layers"
            raise ValueError(f"strengths are {kind}; ranges need real ones of a single layer")
        y, stable, _ = self._judged
        # where signs are undecided, the end of an interval may be anywhere in the undecided stretch
        blurred = np.zeros(len(x), dtype=bool)
        for first, last in _uncertain(y, error):
            blurred[max(first - 1, 0) : last + 1] = True
        ends: list[Interval] = [(float(x[0]), 0.0)] if stable[0] else []
        for i in map(int, np.flatnonzero(stable[1:] != stable[:-1])):
            # find the zero on the line through points i and i + 1, and the slope there by a fit to five points
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
        """Ranges of real strengths where the exponent changes its sign by less than two standard errors."""
        x, stretches = self.alpha, self._judged[2] if self.on_a_line else ()
        return tuple((float(x[first]), float(x[last])) for first, last in stretches)

    @property
    def _judged(self) -> tuple[np.ndarray, np.ndarray, tuple[tuple[int, int], ...]]:
        """Return exponents (m,), the first 0 if 0 within its error, signs (m,), and undecided stretches."""
        y, error = self.exponent, self.stderr
        rounding = ROUNDING * np.max(np.abs(y[np.isfinite(y)]), initial=0.0)
        if abs(y[0]) <= max(2.0 * error[0], rounding) < np.inf:
            y = np.append(0.0, y[1:])  # on a limit cycle, for example, the exponent at strength 0 is zero
        stable, changed = y < 0, list[tuple[int, int]]()
        for first, last in _uncertain(y, error):
            inside = slice(first, last + 1)
            gap = first > 0 and last + 1 < len(y) and y[first - 1] < 0 and y[last + 1] < 0
            if np.any(stable[inside] != gap) and (gap or np.any(stable[inside])):
                changed.append((first, last))
                stable[inside] = gap
        return y, stable, tuple(changed)


def exponent_rows(
    exponent: np.ndarray,
    stderr: np.ndarray,
    attractors: Sequence[str],
    time: float,
    period: float | None = None,
    at_zero: float | None = None,
) -> tuple[tuple[str, str], ...]:
    """Return rows of a summary; `at_zero`: largest standard error beside the zeros of the exponent."""
    kinds = (f"{kind} ({n} of {len(attractors)} starts)" for kind, n in Counter(attractors).most_common())
    drive = f" ({time / period:.0f} drive periods)" if period else ""
    length = f"{time:.6g} units of time{drive} for each start" if time else "not needed"
    worst = float(np.max(stderr, initial=0.0))
    error = f"largest standard error {worst:.2g}" if math.isfinite(worst) else "too short for an error: raise periods"
    if at_zero is not None and math.isfinite(worst):
        error = f"standard error {at_zero:.2g} where the exponent passes zero, at most {worst:.2g}"
    return (
        ("smallest, largest", f"{with_error(exponent.min())}, {with_error(exponent.max())} per unit of time"),
        ("attractor", "; ".join(kinds)),
        ("average", f"{length}, {error}"),
    )


def _uncertain(y: np.ndarray, error: np.ndarray) -> list[tuple[int, int]]:
    """Return the first and last index of each stretch in which no sign of `y` is certain.

    A stretch consists of runs, each of one sign. The sign of a run is certain if one exponent of the run is at least
    two errors from zero, or if its error is unknown.
    """
    certain = ~np.isfinite(error) | (y + 2.0 * error < 0.0) | (y - 2.0 * error >= 0.0)
    runs = np.cumsum(np.append(0, (y[1:] < 0) != (y[:-1] < 0)))
    doubtful = ~np.isin(runs, runs[certain])
    edges = np.flatnonzero(np.diff(np.concatenate([[False], doubtful, [False]])))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _bend(x: np.ndarray, y: np.ndarray, i: int, zero: float) -> float:
    """Return an upper bound of the distance from the zero of a function to that of the line through points i and i + 1.

    The gap is the distance x[i + 1] - x[i]. If the slope changes by J across the gap, the function differs from the
    line by at most J z (1 - z) times the gap at the share z of the gap, even if the function has a kink. J and the
    least slope at the zero follow from the slopes on both sides of the gap. If these slopes are missing, or differ in
    sign, the zero may be anywhere in the gap.
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
    precision: float | None = None,
    periods: float = 5000,
    transient: float | None = None,
    starts: int = 4,
    rtol: float | None = None,
    rng: int | np.random.Generator | None = None,
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
    alpha : array_like, shape (m,), (m, layers) or (m, layers, size, size)
        Strengths alpha + i beta = -sigma gamma, real or complex. With several layers of links, one column for each
        layer; gamma is then the eigenvalue of the layer on a mode common to all layers. Layers that do not commute have
        blocks of several differences: alpha is then a real matrix for each layer, -sigma times its matrix on the block
        (`synchain.graphs.clusters`).
    {orbits}
    {parameters}

    Returns
    -------
    Exponents

    Warns
    -----
    RuntimeWarning
        If a start reaches another attractor than the scene's own start; the exponents are those of the scene's own
        start.

    See Also
    --------
    synchain.msf
    synchain.plane
    synchain.lyapunov_spectrum

    Notes
    -----
    The scene provides the model, the parameters, the first initial state, `contact`, `integrator`, `atol` and
    `max_steps`. It also provides `rtol`, `transient` and `rng`, if they differ from the defaults of a scene and the
    call has no such keyword.

    Raises
    ------
    ValueError
        If the network has no coupling, if strengths do not fit the layers, if the coupling has no synchronous state, if time enters the equations
        without a known period, or if the scene has a stop, draws, or axes that change the synchronous orbit. The
        strength of links that vanish between equal states does not change the orbit.
    FloatingPointError
        If an integration fails.

    Examples
    --------
    >>> import synchain as sc
    >>> scene = sc.Scene("rossler", "x->x", sc.graphs.ring(6))
    >>> sc.exponents(scene, [0.0, 1.0], periods=200).exponent.shape
    (2,)
    """
    given = Given(exponents, parameters, more, ORBITS)
    execution = Execution(workers, None, show_progress, progress)
    averaging = Averaging.for_scene(scene, precision, periods, transient, rng, execution)
    asked = numbers("alpha", alpha, complex_too=True)
    of_layers = asked.ndim in (2, 4) and len(check_scene(scene).model.linked) > 1
    strengths = row_of("alpha", asked.ravel() if of_layers else asked, complex_too=True)
    return transversal(
        given, scene, strengths.reshape(asked.shape) if of_layers else strengths, starts, rtol, averaging
    )


def transversal(
    given: Given, scene: Scene, strengths: np.ndarray, starts: int, rtol: float | None, averaging: Averaging
) -> Exponents:
    """Compute the exponents at strengths (m,) or (m, layers), for the arguments of a public function."""
    reporter = averaging.reporter()
    cell = coupled_cell(given, scene, chosen(scene, "rtol", rtol, RTOL))
    if scene.equations.joined and not cell.equations.joined:
        name = given.function.__name__
        warn(f"{name}: left out the stops in links, which are open between equal oscillators", UserWarning)
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
    # further starts are copies, displaced by at most REACH extents; a copy behind a stop or a guard comes nearer
    copies = starts_near(first, problem.extent[: len(first)], starts, averaging.seed)
    while problem.variation.orbit.has_rows:
        try:
            return problem, problem.with_slip_states(copies)
        except ValueError:
            if np.array_equal(copies, np.tile(first, (starts, 1))):
                raise
            copies = 0.5 * (copies + first)
    return problem, problem.with_slip_states(copies)


def along(
    problem: OrbitProblem, states: np.ndarray, strengths: np.ndarray, averaging: Averaging, reporter: Reporter
) -> Exponents:
    """Compute exponents of modes of strengths (m,) or (m, layers) along orbits from states (starts, components)."""
    starts = len(states)
    bounded = np.ones(starts, dtype=bool)
    if not problem.linear:
        problem, states, bounded = _settled(problem, states, averaging.transient, reporter)

    # exponents of fixed points and cycles follow from eigenvalues; the search for a cycle advances the state
    attractors = [
        find_attractor(problem, state, averaging.transient) if inside else Attractor(Motion.UNBOUNDED, 0.0)
        for state, inside in zip(states, bounded, strict=True)
    ]
    by_start = np.full((starts, len(problem.strengths)), np.nan)
    error = np.full_like(by_start, np.nan)
    for row, attractor in enumerate(attractors):
        if attractor.propagators is not None:
            by_start[row], error[row] = attractor.exponents()
    time = max(attractor.cycle for attractor in attractors)

    # exponents of other motion are mean growth rates, averaged for all starts together
    aperiodic = [row for row, attractor in enumerate(attractors) if attractor.motion is Motion.APERIODIC]
    if aperiodic:
        begun = np.array([attractors[row].state for row in aperiodic])
        march = March.begin(problem, begun, interpolation_for(problem, begun, averaging.periods))
        by_start[aperiodic], error[aperiodic], time = average(march, averaging, reporter)
        ends = [] if problem.forced or problem.variation.events else [*begun, *march.integrator.state]
        rates = [problem.rates.contraction(state, problem.extent) for state in ends]
        contraction, whole = float(np.mean(rates or math.nan)), averaging.transient * problem.unit + time
        warn_of_slow_motion(problem.variation.orbit, begun, problem.parameter_values, time, contraction, whole)

    groups = group_by_attractor(attractors, by_start, error)
    first = list(groups[0])
    if len(groups) > 1:
        own = attractors[0].kind
        kinds = dict.fromkeys(attractors[group[0]].kind for group in groups[1:])
        others = ", ".join(f"{kind} with other exponents" if kind == own else kind for kind in kinds)
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
    """Run the transient of all starts; return also whether each start stays bounded (starts,); the first must."""
    bounded = np.ones(len(states), dtype=bool)
    try:
        return *problem.settled(states, transient, reporter.advance), bounded
    except FloatingPointError:
        if len(states) == 1:
            raise
    # a start that fails ends the common run: run each start alone
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
    """Return one cell with a coupling; the scene may sweep strengths that do not change the synchronous orbit."""
    given.expect_one_cell(scene, unused_axes(scene))
    return without_open_stops(given.scene(with_partner(scene), rtol=rtol))


def with_partner(scene: Scene) -> Scene:
    """Return a network without axes; a lone oscillator gets a partner.

    Raise ValueError if the link acts between equal states, and so changes the orbit. An oscillator that the coupling
    cannot join to a partner stays alone, with a single mode of strength 0 (`OrbitProblem.of_modes`).
    """
    if check_scene(scene).model.linked:
        return scene.replace(**ONE_CELL)
    try:
        coupled = pair_of(scene, **ONE_CELL)
    except ValueError:
        return scene.replace(**ONE_CELL)
    expect_vanishing("a lone oscillator gets a partner", without_open_stops(coupled).equations)
    return coupled


def initial_states(scene: Scene, starts: int, seed: int) -> np.ndarray:
    """Return states (starts, components): the first oscillator's, and copies displaced relative to its motion."""
    return orbits_of(scene, np.zeros(1), starts, Averaging(0.0, 1, 0, seed, Execution(1)))[1]


def group_by_attractor(
    attractors: Sequence[Attractor], by_start: np.ndarray, error: np.ndarray
) -> tuple[tuple[int, ...], ...]:
    """Group the starts by attractor; the first group contains the first start.

    Two starts are on one attractor if their motions are of one kind and their exponents `by_start` (starts, m) agree
    within an error. The error is `Attractor.resolution` for cycles and fixed points, and APART errors for averages. On
    cycles it suffices that the multipliers agree: an exponent dips where a multiplier passes zero, and depends there on
    the last digits of the orbit.
    """
    groups: list[list[int]] = []
    for row, attractor in enumerate(attractors):
        for others in groups:
            first = others[0]
            alike = attractors[first].kind == attractor.kind
            if alike and attractor.propagators is not None:
                close = np.isclose(by_start[first], by_start[row], rtol=1e-3, atol=attractor.resolution())
                alike = bool(np.all(close | attractor.same_multipliers(by_start[first], by_start[row])))
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
    """Average growth rates along a march; return mean (starts, m), error (starts, m), and the length of the average."""
    batches, steps = Batches(march.problem.unit, march.block), np.zeros(())
    for left in averaging.rounds(batches, batches.error, reporter):
        if batches.blocks == 0:
            growths, steps = march.tried(left)
            parts = np.ones(len(growths), dtype=np.int64)
        else:
            parts = batches.ahead(left)
            growths = march.growths(parts)
        batches.extend(growths, parts)
    mean, time = batches.mean(), batches.time
    return mean, with_growth_by_powers(mean, np.hypot(batches.error_by_start(), steps), time), time
