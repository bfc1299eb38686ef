"""Transversal Lyapunov exponents of the synchronous state: the master stability function.

One orbit carries the modes of all strengths alpha + i beta = -sigma gamma at once (`synchain.codegen.kernels.modes`), the
propagators of most of them interpolated in the strength (`synchain.runtime.stability.interpolation`).  On a fixed point or a periodic
orbit locked to the drive the exponents follow from eigenvalues, elsewhere from the mean growth of a deviation, with an
error from batch means.

Sources: Pecora & Carroll, Phys. Rev. Lett. 80, 2109 (1998); Benettin, Galgani, Giorgilli & Strelcyn, Meccanica 15, 9
(1980); batch means: Flyvbjerg & Petersen, J. Chem. Phys. 91, 461 (1989).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from tqdm import tqdm

from synchain.models.graphs.families import topology
from synchain.models.inputs.checks import whole
from synchain.models.scenes.scene import Scene, a_scene

from ..cells.keywords import with_parameters
from ..prediction.intervals import Interval
from ..support.arrays import averaging
from ..support.arrays import row as row_of
from ..support.threads import worker_count
from .attractor import Attractor, find_attractor
from .averages import Batches
from .orbits import Orbits

__all__ = ["Exponents", "coupled_cell", "exponents", "group_by_attractor", "initial_states", "single_cell"]


@dataclass(frozen=True, slots=True)
class Exponents:
    """Largest exponent (m,) per unit of non-dimensional time at each strength (m,), real or complex, with its standard
    error.

    The mean is over the starts that reached the attractor found most often; by_start (starts, m) and attractors (starts,)
    hold all of them.  On fixed points and drive-locked periodic orbits the error is the difference of two cycles;
    elsewhere it comes from the scatter of batch means.  `time` is the length averaged over for each start.
    """

    alpha: np.ndarray
    exponent: np.ndarray
    stderr: np.ndarray
    time: float
    starts: int
    by_start: np.ndarray = field(repr=False)
    attractors: tuple[Attractor, ...] = ()

    @property
    def averaged(self) -> int:
        """Number of starts in the mean."""
        return max(map(len, self.groups))

    @property
    def groups(self) -> list[list[int]]:
        """The starts that reached the same attractor, by their numbers."""
        return group_by_attractor(self.attractors, self.by_start)

    @property
    def intervals(self) -> tuple[Interval, ...]:
        """Where the exponent is negative (real strengths); ends between grid points by linear interpolation."""
        return tuple((low, high) for (low, _), (high, _) in self.ranges)

    @property
    def ranges(self) -> tuple[tuple[Interval, Interval], ...]:
        """The intervals as ((low, its uncertainty), (high, its uncertainty)): standard error over the slope, 0 at grid
        ends."""
        x, y, error = self.alpha, self.exponent, self.stderr
        if np.iscomplexobj(x):
            raise ValueError("strengths are complex; ranges need real ones")
        ends: list[Interval] = [(float(x[0]), 0.0)] if y[0] < 0 else []
        for i in map(int, np.flatnonzero((y[1:] < 0) != (y[:-1] < 0))):
            a, b = max(i - 2, 0), min(i + 3, len(x) - 1)
            step = y[i + 1] - y[i] if np.isfinite(y[i] * y[i + 1]) else np.inf  # an exponent of -inf has no slope
            smooth = b - a >= 3 and bool(np.all(np.isfinite(y[a:b])))
            slope = abs(np.polyfit(x[a:b], y[a:b], 1)[0] if smooth else step / (x[i + 1] - x[i]))
            zero = x[i] - y[i] / step * (x[i + 1] - x[i]) if np.isfinite(step) else (x[i] if y[i] >= 0 else x[i + 1])
            ends.append((float(zero), float(max(error[i], error[i + 1]) / max(slope, 1e-300))))
        if y[-1] < 0:
            ends.append((float(x[-1]), 0.0))
        return tuple(zip(ends[::2], ends[1::2], strict=True))


def exponents(
    scene: Scene,
    alpha: Sequence[float] | Sequence[complex] | np.ndarray,
    *,
    precision: float = 1e-3,
    periods: float = 5000,
    transient: float = 300,
    starts: int = 4,
    rtol: float = 1e-6,
    seed: int = 0,
    workers: int | None = None,
    show_progress: bool | None = False,
    **parameters: float,
) -> Exponents:
    """Return the largest transversal exponent of a scene's oscillator and coupling for each strength, real or complex.

    Times count periods of the drive, or 2 pi where there is none.  After `transient` the averages run until the standard
    error of every exponent is below `precision`, or for `periods`.  The `starts` initial states are that of the scene's
    first oscillator and copies moved at random by up to 0.4 in the first component.  `rtol` is the tolerance of the
    integration, never looser than what the friction law asks for.

    Raises ValueError for a network without coupling or a coupling without synchronous state, and for time dependence
    without a known period; FloatingPointError where an integration fails.
    """
    scene, strengths = coupled_cell(exponents, scene, rtol, parameters), row_of("alpha", alpha, complex_too=True)
    precision, periods, transient, seed = averaging(precision, periods, transient, seed)
    orbits = Orbits.make(scene, strengths, initial_states(scene, starts, seed), worker_count(workers))
    orbits.settle(transient)
    attractors = tuple(find_attractor(orbits, row, transient) for row in range(starts))
    by_start, error, length = _by_start(orbits, attractors, precision, periods, show_progress)
    chosen = max(group_by_attractor(attractors, by_start), key=len)
    mean, spread = by_start[chosen].mean(axis=0), np.sqrt((error[chosen] ** 2).sum(axis=0)) / len(chosen)
    return Exponents(strengths, mean, spread, length, starts, by_start, attractors)


def _by_start(
    orbits: Orbits, attractors: Sequence[Attractor], precision: float, periods: float, show_progress: bool | None
) -> tuple[np.ndarray, np.ndarray, float]:
    """Exponents and errors (starts, m): by eigenvalues where the motion has them, else by averages; the time they
    took."""
    found = np.empty((len(attractors), len(orbits.strengths)))
    error = np.empty_like(found)
    rest = [row for row, attractor in enumerate(attractors) if attractor.propagators is None]
    for row, attractor in enumerate(attractors):
        if attractor.propagators is not None:
            found[row], error[row] = attractor.exponents()
    length = max(attractor.cycle for attractor in attractors)
    if rest:
        found[rest], error[rest], length = _average(orbits.part(rest), precision, periods, show_progress)
    return found, error, length


def coupled_cell(function: Callable[..., Any], scene: Scene, rtol: float, parameters: dict[str, float]) -> Scene:
    """The scene with fixed parameters and without records; a lone oscillator gets a partner, so that it has a
    coupling."""
    graph = scene.topology if a_scene(scene).topology.links else topology("chain", 2)
    coupled = scene.replace(topology=graph, axes=(), zipped=False, continuation="none")
    return single_cell(function, coupled, rtol, parameters)


def single_cell(function: Callable[..., Any], scene: Scene, rtol: float, parameters: dict[str, float]) -> Scene:
    """A single cell of the scene without records, with parameters that `function` was given; TypeError where it is no
    Scene."""
    return with_parameters(
        function, scene, parameters, axes=(), zipped=False, continuation="none", record=(), rtol=rtol, atol=None
    )


def initial_states(scene: Scene, starts: int, seed: int) -> np.ndarray:
    """Initial states (starts, components): the first oscillator's, and copies moved in the first component."""
    starts = whole("starts", starts, 1)
    state = np.tile([values[0] for values in scene.initial.values()], (starts, 1))
    state[1:, 0] += np.random.default_rng(seed).uniform(-0.4, 0.4, starts - 1)
    return state


def group_by_attractor(attractors: Sequence[Attractor], by_start: np.ndarray) -> list[list[int]]:
    """The starts by attractor: of one kind and, where eigenvalues give the exponents, with the same exponents."""
    found: list[list[int]] = []
    for row, attractor in enumerate(attractors):
        for others in found:
            alike = attractors[others[0]].kind == attractor.kind
            if alike and attractor.propagators is not None:
                alike = np.allclose(by_start[others[0]], by_start[row], rtol=1e-3, atol=1e-4)
            if alike:
                others.append(row)
                break
        else:
            found.append([row])
    return found


def _average(
    orbits: Orbits, precision: float, periods: float, show_progress: bool | None
) -> tuple[np.ndarray, np.ndarray, float]:
    """Mean growth rates (starts, m), their standard errors and the time averaged over."""
    orbits.prepare()
    batches = Batches(orbits.unit * orbits.block)
    hidden = None if show_progress is None else not show_progress
    with tqdm(total=math.ceil(periods / orbits.block), unit="block", disable=hidden) as bar:
        while batches.blocks * orbits.block < periods:
            batches.add(orbits.advance())
            bar.update(1)
            if batches.due and np.all(batches.error() <= precision):
                break
    mean, error = batches.mean(), batches.error_by_start()
    return mean, error, batches.blocks * batches.length
