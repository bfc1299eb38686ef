"""Where a network synchronises: probe, projection through the spectrum, and the check by direct simulation.

The two-oscillator probe tells for which alpha = sigma |gamma| the mode of a network dies out: in its own network the one
non-zero eigenvalue is -2.  Any other network synchronises where every non-zero |sigma gamma_k| lies in the probe's ranges
(Pecora & Carroll, Phys. Rev. Lett. 80, 2109 (1998); Fink et al., Phys. Rev. E 61, 5080 (2000)).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from synchain.models.graphs.families import topology
from synchain.models.graphs.topology import Topology
from synchain.models.inputs.checks import instance, number, positive, whole
from synchain.models.scenes.scene import Scene, a_scene
from synchain.models.spectra.spectrum import Spectrum

from ..cells.keywords import with_parameters
from ..prediction.intervals import Interval, find, intersect, scale
from ..support.arrays import row
from ..support.status import Status
from ..sweeps.progress import Hook
from ..sweeps.run import run

__all__ = [
    "Criterion",
    "Thresholds",
    "critical_ratio",
    "offsets",
    "probe",
    "project",
    "simulate",
    "thresholds",
    "wu_chua",
]


@dataclass(frozen=True, slots=True)
class Criterion:
    """When a value of sigma counts as synchronous.

    From `starts` different initial states (the scene's own, and copies of it moved as a whole by a random amount of up to
    `reach` in the position), at least half must end with a mean synchronisation error below `tolerance`, averaged over
    `window` drive periods after a transient of `transient`.  Near the ends of a range of chaotic motion single starts
    synchronise or burst by chance; their majority does not depend on one of them.
    """

    tolerance: float = 1e-3
    starts: int = 8
    reach: float = 0.4
    transient: float = 1000.0
    window: float = 100.0
    rtol: float = 1e-8
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("tolerance", "transient", "window", "rtol"):
            object.__setattr__(self, name, positive(f"criterion: {name}", getattr(self, name)))
        object.__setattr__(self, "reach", number("criterion: reach", self.reach, 0.0))
        whole("criterion: starts", self.starts, 1)
        whole("criterion: seed", self.seed, 0)


def checked(criterion: Criterion | None) -> Criterion:
    """The criterion that was given, or the usual one; TypeError where it is none."""
    if criterion is None:
        return Criterion()
    return instance("criterion", criterion, Criterion, "a Criterion, e.g. Criterion(starts=4)")


@dataclass(frozen=True, slots=True)
class Sweep:
    """Verdicts of one sweep over sigma (or alpha) and what they rest on.

    x (m,), error (m,): median over the starts of the mean synchronisation error; share (m,): part of the starts that
    synchronised; intervals: where at least half do, ends refined.
    """

    x: np.ndarray = field(repr=False)
    error: np.ndarray = field(repr=False)
    share: np.ndarray = field(repr=False)
    intervals: tuple[Interval, ...]


@dataclass(frozen=True, slots=True)
class Thresholds:
    """Synchronous ranges of one network: measured directly and predicted from the probe.

    `direct` is in sigma, `probe` in alpha = sigma |gamma|, `predicted` in sigma.
    """

    scene: Scene
    probe: Sweep
    predicted: tuple[Interval, ...]
    direct: Sweep
    criterion: Criterion
    warnings: tuple[str, ...] = field(default=())

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready: {"intervals", "probe", "predicted"}, sigma for the first and last, alpha for the probe."""
        return {
            "intervals": [list(i) for i in self.direct.intervals],
            "probe": [list(i) for i in self.probe.intervals],
            "predicted": [list(i) for i in self.predicted],
            "warnings": list(self.warnings),
        }


def thresholds(
    scene: Scene,
    *,
    sigma: Sequence[float] | np.ndarray | None = None,
    resolution: float = 5e-4,
    criterion: Criterion | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    show_progress: bool | None = None,
    progress: Hook | None = None,
    **parameters: float,
) -> Thresholds:
    """Return probe, prediction and direct simulation of a scene's network; `parameters` override the scene's.

    `sigma` is the grid on which ranges are looked for (default: `default_grid`); narrower ranges are not seen.  The probe's
    grid in alpha covers every sigma |gamma|.  Ends are refined to `resolution` in sigma.  A network in several parts is
    allowed; its warnings say so.  `workers`, `executor`, `show_progress` and `progress` are those of `run`.

    Raises ValueError for a network without links, or with one-way links whose eigenvalues are complex, for unequal nodes and
    for links with inertia.
    """
    a_scene(scene).equations.expect_alike("thresholds")
    scene = with_parameters(thresholds, scene, parameters, axes=(), zipped=False, continuation="none", record=())
    criterion = checked(criterion)
    spectrum = scene.topology.spectrum
    check_probe(scene.topology, spectrum)
    scene = scene.replace(record=("sync_error",))
    grid = default_grid(spectrum) if sigma is None else row("sigma", sigma, 2, rising=True)
    resolution = positive("resolution", resolution)
    options = {"workers": workers, "executor": executor, "show_progress": show_progress, "progress": progress}
    found = probe(scene, _probe_grid(grid, spectrum), resolution=2.0 * resolution, criterion=criterion, **options)
    direct = simulate(scene, grid, resolution=resolution, criterion=criterion, **options)
    predicted = project(found.intervals, spectrum, float(grid[-1]))
    return Thresholds(scene, found, tuple(predicted), direct, criterion, scene.warnings)


def default_grid(spectrum: Spectrum, step: float = 0.0025) -> np.ndarray:
    """Sigma from 0 to where the largest |sigma gamma| is 1.2, in at least 60 steps of at most `step`."""
    highest = 1.2 / max(abs(value) for value in spectrum.values)
    return np.linspace(0.0, highest, max(math.ceil(highest / step), 60) + 1)


def _probe_grid(sigma: np.ndarray, spectrum: Spectrum) -> np.ndarray:
    """Values of alpha that cover sigma |gamma| for every mode, as many as sigma has and at least one every 0.01."""
    sizes = [abs(value) for value in spectrum.values if abs(value) > 0.0]
    low = 0.0 if 0.0 in sigma or spectrum.multiplicities[0] > 1 else sigma[0] * min(sizes)
    high = sigma[-1] * max(sizes)
    return np.linspace(low, high, max(len(sigma), math.ceil((high - low) / 0.01) + 1, 2))


def check_probe(graph: Topology, spectrum: Spectrum) -> None:
    """Raise ValueError where the two-oscillator probe says nothing about a network."""
    if graph.n < 2 or not graph.links:
        raise ValueError(f"{graph.name}({graph.n}) has no links; thresholds need at least two coupled oscillators")
    if any(isinstance(value, complex) for value in spectrum.values):
        raise ValueError(
            f"{graph.name}({graph.n}) has complex eigenvalues; the two-oscillator probe covers real ones only. "
            "Use a network with symmetric coupling"
        )
    worst = max(float(value.real) for value in spectrum.values)
    if worst > 0.0:
        raise ValueError(
            f"{graph.name}({graph.n}) has the positive eigenvalue {worst:g}, which drives oscillators apart; expected none. "
            "If the matrix is a Laplacian D - A, negate it: the connectivity matrix is A - D"
        )


def probe(scene: Scene, alpha: Sequence[float] | np.ndarray, **options: Any) -> Sweep:
    """Sweep the two-oscillator probe over alpha = 2 sigma; options as for `simulate`."""
    pair = scene.replace(topology=topology("chain", 2), initial=None, axes=())
    half = dict(options)
    if "resolution" in half:
        half["resolution"] *= 0.5
    found = simulate(pair, 0.5 * np.asarray(alpha, dtype=float), **half)
    return Sweep(2.0 * found.x, found.error, found.share, tuple(scale(found.intervals, 2.0)))


def simulate(
    scene: Scene,
    sigma: Sequence[float] | np.ndarray,
    *,
    resolution: float = 5e-4,
    criterion: Criterion | None = None,
    **options: Any,
) -> Sweep:
    """Sweep sigma by direct simulation and return errors, shares and refined synchronous intervals; options as for `run`."""
    criterion = checked(criterion)
    moves = offsets(criterion)
    seen: dict[str, np.ndarray] = {}

    def judge(points: np.ndarray) -> np.ndarray:
        errors = _errors(scene, points, moves, criterion, options)
        seen.setdefault("error", np.median(errors, axis=1))
        share = (errors < criterion.tolerance).mean(axis=1)
        seen.setdefault("share", share)
        return share >= 0.5

    x = row("sigma", sigma, rising=True)
    intervals, _ = find(judge, x, resolution)
    return Sweep(x, seen["error"], seen["share"], tuple(intervals))


def offsets(criterion: Criterion) -> np.ndarray:
    """How far the starts are moved: not at all, then at random."""
    random = np.random.default_rng(criterion.seed)
    return np.concatenate([[0.0], random.uniform(-criterion.reach, criterion.reach, criterion.starts - 1)])


def _errors(
    scene: Scene,
    sigma: np.ndarray,
    offsets: np.ndarray,
    criterion: Criterion,
    options: Mapping[str, Any],
) -> np.ndarray:
    """Mean synchronisation error (points, starts); infinite where a cell did not finish."""
    position = scene.components[0]
    axes: dict[str, np.ndarray] = {"sigma": np.repeat(sigma, len(offsets))}
    for i, x0 in enumerate(scene.initial[position]):
        axes[f"{position}_{i + 1}"] = np.tile(x0 + offsets, len(sigma))
    cells = scene.replace(
        axes={name: tuple(values) for name, values in axes.items()}, zipped=True, record=("sync_error",),
        transient=criterion.transient, window=criterion.window, rtol=criterion.rtol,
    )  # fmt: skip
    result = run(cells, **options)
    errors = np.where(result.status == Status.FINISHED, result.sync_error, np.inf)
    return errors.reshape(len(sigma), len(offsets))


def project(ranges: Sequence[Interval], spectrum: Spectrum, highest: float = math.inf) -> list[Interval]:
    """The sigma for which every transversal |sigma gamma_k| lies in one of the ranges of alpha, up to `highest`.

    One zero eigenvalue belongs to the synchronous motion itself.  Every further one is a part of the network that nothing
    couples to the rest: it asks that alpha = 0 be in a range (identical oscillators that the drive alone locks).
    """
    allowed: list[Interval] = [(0.0, highest)]
    for value, multiplicity in zip(spectrum.values, spectrum.multiplicities, strict=True):
        if abs(value) > 0.0:
            allowed = intersect(allowed, scale(ranges, 1.0 / abs(value)))
        elif multiplicity > 1 and not any(low <= 0.0 <= high for low, high in ranges):
            return []
    return allowed


def critical_ratio(spectrum: Spectrum) -> float:
    """Largest over smallest non-zero |gamma|; a bounded range of alpha must be at least this wide (as a ratio)."""
    sizes = [abs(value) for value in spectrum.values if abs(value) > 0.0]
    return max(sizes) / min(sizes)


def wu_chua(sigma: float, known: Spectrum, wanted: Spectrum) -> float:
    """Carry the end of a range that starts at zero coupling from one network to another.

    sigma_m gamma_1(m) = sigma_n gamma_1(n), with gamma_1 the eigenvalue of largest modulus where the end is the upper one.
    Source: Wu & Chua, IEEE Trans. Circuits Syst. I 43, 161 (1996).
    """
    largest = [max(abs(value) for value in s.values) for s in (known, wanted)]
    return sigma * largest[0] / largest[1]
