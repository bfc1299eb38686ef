"""Find the ranges of sigma in which a network synchronises, in three ways.

1. `exponent_windows`: transversal exponents of all modes, with error bars, without transient or tolerance.
2. `probe`, `project`: the probe, a pair of oscillators with the non-zero eigenvalue -2, is simulated over
   alpha = sigma |gamma|. A network should synchronise where every non-zero |sigma gamma_k| lies in the probe's
   ranges (Pecora & Carroll, Phys. Rev. Lett. 80, 2109 (1998); Fink et al., Phys. Rev. E 61, 5080 (2000)).
3. `simulate`: the network itself is simulated over sigma.

Methods 2 and 3 test the points of a grid by an `AppliedCriterion`, and then refine the ends of ranges.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace

import numpy as np
import xarray as xr

from synchain.models.dynamics.synchrony import expect_vanishing
from synchain.models.graphs.families import topology
from synchain.models.graphs.topology import Topology
from synchain.models.inputs.checks import check_number, check_positive, check_seed
from synchain.models.scenes.defaults import TimeUnit
from synchain.models.scenes.scene import Scene, check_scene
from synchain.models.spectra.spectrum import Spectrum

from ..cells.plan import Planner
from ..cells.reduce import reduce_scene
from ..cells.run_keywords import Given
from ..prediction.intervals import Interval, intersect, refine, scale
from ..prediction.synchronisability import expect_no_repulsion
from ..results.labelled import Labelled, as_json, dataset, scene_text
from ..stability.averages import check_whole
from ..stability.transversal_modes import unused_axes
from ..support.arrays import row
from ..support.error_text import interval_text, range_text, with_error
from ..support.execution import Execution
from ..support.progress import Hook
from .criterion import IN_CRITERION, AppliedCriterion, Criterion, checked, errors, offsets, preset, resolved
from .exponent_windows import ExponentWindows, exponent_windows
from .hidden_modes import hidden_modes
from .synchronous_motion import SynchronousMotion, alike, first_starts, measure_motion, spread_of
from .trials import Trials

RESOLUTION, CLOSER, RELATIVE = 5e-4, 5.0, 1e-3
"""Ends of ranges are refined to a width in sigma: by default the larger of RESOLUTION and RELATIVE sigma, but at most
the
step of the grid divided by CLOSER."""

LONGEST = 1e9
"""Longest step of a grid, in units of the width to which ends are refined; ten rounds refine such a step."""

PROBES = 257
"""Approximate least number of values of alpha for the probe (a choice)."""

Measure = Callable[[np.ndarray], np.ndarray]
"""Mean synchronisation errors (m, starts) at points (m,)."""


@dataclass(frozen=True, slots=True)
class Sweep:
    """Verdicts of one sweep over sigma, or over alpha."""

    x: np.ndarray = field(repr=False)  # (m,): sigma or alpha
    error: np.ndarray = field(repr=False)  # (m,): median over the starts of the mean synchronisation error
    share: np.ndarray = field(repr=False)  # (m,): part of the starts that synchronised
    intervals: tuple[Interval, ...]  # ranges in which at least half of the starts synchronised, with refined ends


@dataclass(frozen=True, slots=True, repr=False)
class Thresholds(Labelled):
    """Synchronous ranges of one network: from exponents, from direct simulation, and predicted from the probe.

    The exponents are the most reliable. Simulation and probe depend on the transient: near an end of a range, errors
    fall too slowly for any transient. `warnings` names such ends. `criterion` stores the numbers that were used.
    `direct`, `predicted` and `exponents` are ranges of sigma, `probe` contains ranges of alpha = sigma abs(gamma).

    See Also
    --------
    synchain.thresholds
    """

    scene: Scene
    probe: Sweep
    predicted: tuple[Interval, ...]
    direct: Sweep
    criterion: AppliedCriterion
    exponents: ExponentWindows
    warnings: tuple[str, ...] = field(default=())

    @property
    def data(self) -> xr.Dataset:
        """Errors and shares over sigma and over alpha, the ranges, and the errors of their ends."""
        windows = self.exponents
        ranges = {
            "interval": (self.direct.intervals, "synchronous sigma, simulated"),
            "predicted": (self.predicted, "synchronous sigma, from the probe"),
            "probe_interval": (self.probe.intervals, "synchronous alpha of the probe"),
            "window": (windows.intervals, f"sigma with negative exponents{windows.absent and f', {windows.text()}'}"),
        }
        return dataset(
            {
                "error": (("sigma",), self.direct.error, "median of the mean synchronisation errors"),
                "share": (("sigma",), self.direct.share, "part of the starts that synchronised"),
                "probe_error": (("alpha",), self.probe.error, "the same of the probe"),
                "probe_share": (("alpha",), self.probe.share, "the same of the probe"),
                **{
                    name: ((f"{name}_number", "end"), np.reshape(ends, (-1, 2)), meaning)
                    for name, (ends, meaning) in ranges.items()
                },
                "window_error": (("window_number", "end"), np.reshape(windows.errors, (-1, 2)), "errors of the ends"),
            },
            {"sigma": self.direct.x, "alpha": self.probe.x, "end": ["low", "high"]},
            self.scene,
        )

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """Scene, ranges of the coupling and of alpha, grid, criterion, warnings."""
        name, used = self.scene.strength, self.criterion
        steepest = max(abs(value) for value in self.scene.topology.spectrum.values)
        grid, alpha = ((float(x[0]), float(x[-1])) for x in (self.direct.x, self.probe.x))
        reach = (*grid, *(end / steepest for end in alpha))
        conjecture = [] if self.conjecture is None else [interval_text([(0.0, self.conjecture)])]
        rows = [
            ("scene", scene_text(self.scene)),
            (f"{name}, negative exponents", self.exponents.text(reach)),
            (f"{name}, simulated", interval_text(self.direct.intervals, grid_ends=grid)),
            (f"{name}, predicted by the probe", interval_text(self.predicted, grid_ends=reach)),
            *((f"{name}, Wu-Chua conjecture", text) for text in conjecture),
            (f"alpha = {name} |gamma|, probe", interval_text(self.probe.intervals, grid_ends=alpha)),
            (f"grid of {name}", range_text(self.direct.x)),
            ("simulated and probe", f"{used.text(self.scene)}, at least half of {used.starts} starts"),
        ]
        if any("..." in text for _, text in rows):
            rows.append(("...", "the grid ends here, the range may go on"))
        return (*rows, *(("warning", sentence) for sentence in self.warnings))

    @property
    def conjecture(self) -> float | None:
        """Upper end of the range that begins at sigma = 0, by the Wu-Chua conjecture.

        None if the probe has no such end.
        """
        high = next((high for low, high in self.probe.intervals if low <= 0.0 < high), math.inf)
        if high >= self.probe.x[-1]:
            return None
        return wu_chua(high / 2.0, topology("chain", 2).spectrum, self.scene.topology.spectrum)

    def as_dict(self) -> dict[str, object]:
        """Return the ranges for JSON.

        Returns
        -------
        dict
            intervals, probe (in alpha), predicted, exponents, exponent_errors, no_exponents and warnings.  An unknown
            error is None, and so is no_exponents if there are exponents.
        """
        return as_json(
            {
                "intervals": self.direct.intervals,
                "probe": self.probe.intervals,
                "predicted": self.predicted,
                "exponents": self.exponents.intervals,
                "exponent_errors": self.exponents.errors,
                "no_exponents": self.exponents.absent or None,
                "warnings": self.warnings,
            }
        )


def thresholds(
    scene: Scene,
    *,
    sigma: Sequence[float] | np.ndarray | None = None,
    resolution: float | None = None,
    criterion: Criterion | None = None,
    precision: float | None = None,
    periods: float = 5000,
    workers: int | None = None,
    executor: Executor | None = None,
    show_progress: bool | None = None,
    progress: Hook | None = None,
    parameters: Mapping[str, float] | None = None,
    **more: float,
) -> Thresholds:
    """Find where a scene's network synchronises: by exponents, by the probe with its projection,
    and by direct simulation.

    Parameters
    ----------
    scene : Scene
        The network; its records, observables and sections are not used.
    sigma : sequence of float, optional
        Increasing grid on which ranges are searched (default: `default_grid`). A range between two neighbouring values
        is missed. The probe's grid in alpha covers every sigma abs(gamma), with the spacing of this grid.
    resolution : float, optional
        Width in sigma to which ends of ranges are refined; for the probe, twice this width in alpha. By default
        the larger of 5e-4 and a thousandth of sigma, but at most a fifth of the step of the grid.
    criterion : Criterion, optional
        Conditions for synchronisation, with rtol, rng and transient of all cells. Fields that are None follow from the
        scene and its motion.
    precision, periods : float
        Standard error and longest average of the exponents, as for `exponents`.
    workers, executor, show_progress, progress
        As for `run`, with one bar for each round.  Exponents are computed in this process.
    parameters, **more
        Override the parameters of the scene, as for `exponents`.

    Returns
    -------
    Thresholds
        The field `warnings` reports a network of several parts, and modes of a linear network that are absent from the
        start (`hidden_modes`).

    Raises
    ------
    ValueError
        For a network without links, for one-way links whose eigenvalues are complex, for unequal
        nodes, for links with inertia, and for a scene with a stop, draws or axes, but for one of sigma,
        which is not used; if a step of the grid is above 1e9 times the resolution.

    See Also
    --------
    synchain.msf
    synchain.universal_probe
    synchain.transition

    Examples
    --------
    >>> import synchain as sc
    >>> node = sc.Field({"x": "v", "v": "x - x**3 - 0.25*v + 0.4*cos(t)"}, initial={"x": 0.5})
    >>> scene = sc.Scene(node, "v->v", sc.graphs.ring(4), time_unit="time")
    >>> found = sc.thresholds(scene, sigma=[0.0, 0.2, 0.4, 0.6], precision=0.01, show_progress=False)
    >>> len(found.direct.intervals)
    1
    """
    check_scene(scene).equations.expect_alike("thresholds")
    scene.equations.expect_pairs("thresholds")
    expect_vanishing("thresholds", scene.equations)
    scene = Given(thresholds, parameters, more, IN_CRITERION).scene(scene, unused_axes(scene))
    criterion, execution = checked(criterion), Execution(workers, executor, show_progress, progress)
    spectrum = scene.topology.spectrum
    check_probe(scene.topology, spectrum)
    scene = scene.replace(record=("sync_error",))
    grid = default_grid(spectrum) if sigma is None else row("sigma", sigma, 2, rising=True)
    resolution = None if resolution is None else check_positive("resolution", resolution)
    _check_steps(grid, resolution)
    precision = None if precision is None else check_number("precision", precision, 0.0)
    periods = check_whole("periods", check_positive("periods", periods))
    alpha = _probe_grid(grid, spectrum)
    stable = exponent_windows(
        scene, alpha, execution, precision, periods, check_seed("rng", preset(criterion, scene).rng)
    )
    used = fitted(_pair(scene), 0.5 * alpha, criterion, execution)
    pair = probe(scene, alpha, used, resolution, execution)
    direct = simulate(scene, grid, used, resolution, execution)
    predicted = tuple(project(pair.intervals, spectrum, float(grid[-1]), float(grid[0])))
    result = Thresholds(scene, pair, predicted, direct, used, stable, (*scene.warnings, *hidden_modes(scene)))
    return replace(result, warnings=(*result.warnings, *_limited(result)))


def _limited(result: Thresholds) -> Iterator[str]:
    """Yield warnings of ends at which the exponent is negative, but the transient is too short for errors to fall."""
    used, scene = result.criterion, result.scene
    length = used.transient * ((scene.period or 1.0) if scene.time_unit == TimeUnit.PERIOD else 1.0)
    sizes = np.array([abs(value) for value in scene.spectrum.values if abs(value) > 0.0])
    grid, fall = {float(result.direct.x[0]), float(result.direct.x[-1])}, math.log(used.size / used.tolerance)
    if not result.exponents.strengths or not fall > 0.0:
        return
    for method, ranges in (("simulated", result.direct.intervals), ("predicted by the probe", result.predicted)):
        ends = np.array(sorted({end for pair in ranges for end in pair} - grid))
        if not len(ends):
            continue
        # an error takes the time fall / |exponent| to fall from the extent of the motion to the tolerance
        exponent = result.exponents.at(np.outer(ends, sizes)).max(axis=1)
        late = (exponent < 0.0) & (-exponent * length < fall)
        if late.any():
            shown = ", ".join(
                f"{with_error(end)} (exponent {at:.2g})" for end, at in zip(ends[late], exponent[late], strict=True)
            )
            yield (
                f"the ends of what is {method} at {scene.strength} = {shown} come of the transient: errors fall by the factor "
                f"{math.exp(fall):.3g} in ln({math.exp(fall):.3g})/|exponent|, and {length:.4g} units of time are given; "
                "trust the exponents there, or raise Criterion(transient=…)"
            )


def default_grid(spectrum: Spectrum, step: float = 0.0025) -> np.ndarray:
    """Return a grid of sigma from 0 to 1.2 / max |gamma|, in at least 60 steps of at most `step`."""
    highest = 1.2 / max(abs(value) for value in spectrum.values)
    return np.linspace(0.0, highest, max(math.ceil(highest / step), 60) + 1)


def _probe_grid(sigma: np.ndarray, spectrum: Spectrum) -> np.ndarray:
    """Return at least about PROBES values of alpha that cover sigma |gamma| for every mode."""
    # begin with sigma times the largest |gamma|, and extend the grid for modes of smaller |gamma|
    sizes = sorted({abs(value) for value in spectrum.values if abs(value) > 0.0}, reverse=True)
    grid = sigma * sizes[0]
    for size in (*sizes[1:], *([0.0] if spectrum.multiplicities[0] > 1 else [])):
        more = np.unique(sigma * size)
        grid = np.concatenate([more[more < grid[0]], grid, more[more > grid[-1]]])
    parts = max(1, round((PROBES - 1) / (len(grid) - 1)))
    return np.unique(np.interp(np.arange((len(grid) - 1) * parts + 1) / parts, np.arange(len(grid)), grid))


def _widths(x: np.ndarray, resolution: float | None) -> np.ndarray:
    """Return the width (m - 1,) to which ends of ranges are refined in each step of a grid."""
    if resolution is not None:
        return np.full(len(x) - 1, resolution)
    nearer = np.minimum(np.abs(x[1:]), np.abs(x[:-1]))
    return np.asarray(np.minimum(np.maximum(RESOLUTION, RELATIVE * nearer), np.diff(x) / CLOSER))


def _check_steps(x: np.ndarray, resolution: float | None) -> None:
    """Raise ValueError for a step of a grid that is too long to refine."""
    steps, widths = np.diff(x), _widths(x, resolution)
    k = int(np.argmax(steps / widths))
    if not steps[k] <= LONGEST * widths[k]:
        raise ValueError(
            f"sigma: found a step of {steps[k]:.3g}, from {x[k]:.6g} to {x[k + 1]:.6g}, and ends refined to {widths[k]:.3g}; "
            f"expected at most {LONGEST:g} times as much; give more values of sigma, or a larger resolution"
        )


def check_probe(graph: Topology, spectrum: Spectrum) -> None:
    """Raise ValueError if the two-oscillator probe does not apply to a network."""
    if graph.n < 2 or not graph.link_count:
        raise ValueError(f"{graph.name}({graph.n}) has no links; thresholds need at least two coupled oscillators")
    if any(isinstance(value, complex) for value in spectrum.values):
        raise ValueError(
            f"{graph.name}({graph.n}) has complex eigenvalues; the two-oscillator probe covers real ones only. "
            "Use a network with symmetric coupling"
        )
    expect_no_repulsion(graph, max(float(value.real) for value in spectrum.values))


def probe(
    scene: Scene,
    alpha: Sequence[float] | np.ndarray,
    criterion: Criterion,
    resolution: float | None = None,
    execution: Execution | None = None,
) -> Sweep:
    """Sweep the two-oscillator probe over alpha = 2 sigma."""
    pair = _pair(scene)
    sweep = simulate(pair, 0.5 * np.asarray(alpha, dtype=float), criterion, resolution, execution)
    return Sweep(2.0 * sweep.x, sweep.error, sweep.share, tuple(scale(sweep.intervals, 2.0)))


def _pair(scene: Scene) -> Scene:
    """Return the scene of the probe's two oscillators."""
    return scene.replace(topology=topology("chain", 2), initial=first_starts(scene, 2), axes=())


def simulate(
    scene: Scene,
    sigma: Sequence[float] | np.ndarray,
    criterion: Criterion,
    resolution: float | None = None,
    execution: Execution | None = None,
) -> Sweep:
    """Sweep sigma by direct simulation; one kernel and one pool run the grid and all rounds of refinement."""
    x, execution = row("sigma", sigma, rising=True), execution or Execution()
    used = fitted(scene, x, criterion, execution)
    reduction = reduce_scene(cells_of(scene, x, used))
    with Trials.of(reduction, execution) as trials:

        def measure(points: np.ndarray) -> np.ndarray:
            planner = Planner(cells_of(scene, points, used))
            outcome = trials.run(planner.scene.cells, lambda cells: reduction.rows(planner.rows(cells)))
            return errors(outcome, used, scene.equations).reshape(len(points), used.starts)

        return judge(measure, x, resolution, used)


def fitted(scene: Scene, sigma: np.ndarray, criterion: Criterion, execution: Execution) -> AppliedCriterion:
    """Return a criterion with the numbers that follow from the synchronous motion of a scene."""
    if isinstance(criterion, AppliedCriterion):
        return criterion
    partial, apart = preset(criterion, scene), spread_of(scene.equations, np.array([scene.y0]))

    def measure(atol: float | None) -> SynchronousMotion:
        rtol = partial.rtol or scene.rtol
        unit = AppliedCriterion(1.0, partial.starts, 0.0, 1.0, 1.0, rtol, 0, (), max_steps=scene.max_steps, atol=atol)
        reduction = reduce_scene(cells_of(scene, sigma, unit))
        first = alike(scene.equations, Planner(cells_of(scene, np.zeros(1), unit)).rows(np.arange(1)))
        with Trials.of(reduction, execution) as trials:
            times = (partial.transient, partial.window)
            return measure_motion(trials, reduction.rows, scene.equations, first, times, apart)

    return resolved(partial, scene, measure)


def judge(measure: Measure, x: np.ndarray, resolution: float | None, criterion: AppliedCriterion) -> Sweep:
    """Return the verdicts on an increasing grid, and the synchronous ranges with ends refined to `resolution`."""

    def share(mean_errors: np.ndarray) -> np.ndarray:
        return np.asarray((mean_errors < criterion.tolerance).mean(axis=1))

    on_grid = measure(x)
    ranges = refine(lambda points: share(measure(points)) >= 0.5, x, share(on_grid) >= 0.5, _widths(x, resolution))
    return Sweep(x, np.asarray(np.median(on_grid, axis=1)), share(on_grid), tuple(ranges))


def cells_of(scene: Scene, sigma: np.ndarray, criterion: AppliedCriterion) -> Scene:
    """Return the scene with a cell for every sigma and every start of a criterion, the starts fastest."""
    position, moves = scene.components[0], offsets(criterion)
    axes: dict[str, np.ndarray] = {scene.strength: np.repeat(sigma, len(moves))}
    for i, x0 in enumerate(scene.initial[position]):
        axes[f"{position}_{i + 1}"] = np.tile(x0 + moves, len(sigma))
    return scene.replace(
        axes={name: tuple(values) for name, values in axes.items()},
        zipped=True,
        record=("sync_error",),
        t_eval=None,
        transient=criterion.transient,
        window=criterion.window,
        rtol=criterion.rtol,
        max_steps=min(scene.max_steps, criterion.max_steps),
        atol=scene.given["atol"] if criterion.atol is None else criterion.atol,
    )


def project(
    ranges: Sequence[Interval], spectrum: Spectrum, highest: float = math.inf, lowest: float = 0.0
) -> list[Interval]:
    """Return the ranges of sigma, from `lowest` to `highest`, in which every sigma |gamma_k| lies in a range of alpha.

    One zero eigenvalue belongs to the synchronous motion. Each further zero eigenvalue belongs to a part of the network
    without links to the other parts. Such parts synchronise only if alpha = 0 is in a range, as when a drive alone
    locks the oscillators.
    """
    allowed: list[Interval] = [(lowest, highest)]
    for value, multiplicity in zip(spectrum.values, spectrum.multiplicities, strict=True):
        if abs(value) > 0.0:
            allowed = intersect(allowed, scale(ranges, 1.0 / abs(value)))
        elif multiplicity > 1 and not any(low <= 0.0 <= high for low, high in ranges):
            return []
    return allowed


def critical_ratio(spectrum: Spectrum) -> float:
    """Return max |gamma| / min |gamma| over the non-zero eigenvalues.

    A bounded stable range of alpha contains all modes at some strength only if its ends have at least this ratio.
    """
    sizes = [abs(value) for value in spectrum.values if abs(value) > 0.0]
    return max(sizes) / min(sizes)


def wu_chua(sigma: float, first: Spectrum, second: Spectrum) -> float:
    """Return the upper end of the range from sigma = 0 on for a second network, from the end `sigma` for a first one.

    The product of sigma and gamma_1, the eigenvalue of largest modulus, is the same for both networks. Source: Wu &
    Chua, IEEE Trans. Circuits Syst. I 43, 161 (1996).
    """
    largest = [max(abs(value) for value in spectrum.values) for spectrum in (first, second)]
    return sigma * largest[0] / largest[1]
