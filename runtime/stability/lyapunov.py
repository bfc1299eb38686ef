"""Lyapunov exponents of a whole network, from its own start.

Deviations are carried over short blocks of time and made orthogonal after each (Benettin, Galgani, Giorgilli & Strelcyn,
Meccanica 15, 9 (1980)).  A block is short enough where every direction stands out of the error of the integration; under a
smoothed friction law oscillators that stick lose their velocity deviations so fast that no block is, and exponents lost
in this error are not reported as numbers.  Their sum is known all the same: the sum of all exponents is the mean
divergence of the equations, which is integrated along the orbit by itself.

Under set-valued friction stick makes the velocity of a deviation zero, so that directions vanish within finite time: their
exponent is -inf by rule, and so is the sum.  Such a direction comes out of a block with the length of a rounding.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from tqdm import tqdm

from synchain.models.dynamics.variational import PHASE, Variation, network_variation, phase_shifted, with_volume
from synchain.models.inputs.checks import whole
from synchain.models.scenes.scene import Scene

from ..cells.initial_modes import with_modes
from ..support.arrays import averaging
from .averages import Batches
from .carrier import Carrier
from .orbits import unit_of_time
from .transversal import one_cell

__all__ = ["Lyapunov", "lyapunov_spectrum"]

PARTS = (1, 2, 4, 8, 16, 32, 64)
"""Blocks a period that are tried, from few to many."""

TRIAL = 4
"""Periods each of them is tried for, and periods that are left out after the choice."""

CLEAR, LOST = 1e4, 10.0
"""A direction is clear of the error where it is this many tolerances long after a block, lost where it is shorter than
that."""


@dataclass(frozen=True, slots=True)
class Lyapunov:
    """Exponents (count,) per unit of non-dimensional time, from the largest down, with their standard errors.

    resolved (count,): False where a direction decays faster than can be followed; its exponent is -inf, without error.
    divergence: mean of the divergence along the same orbit, the sum of all exponents of the network, with its error.  With
    set-valued friction it is that sum itself: -inf where an oscillator has stuck, nan where not all exponents are asked
    for.
    `time` is the length averaged over, `block` the time between two orthogonalisations, `components` the number of all
    exponents.  Exponents that differ by less than about 1/time have not parted yet: they share their sum, and the errors do
    not say so.
    """

    exponent: np.ndarray
    stderr: np.ndarray
    resolved: np.ndarray
    divergence: float
    divergence_error: float
    time: float
    block: float
    components: int

    @property
    def rest(self) -> float:
        """The sum of the exponents that are not known one by one: the divergence less the resolved ones."""
        return self.divergence - float(self.exponent[self.resolved].sum())

    @property
    def dimension(self) -> float:
        """Kaplan-Yorke dimension (Springer Lecture Notes in Mathematics 730, 204 (1979)); nan where too few exponents are
        known."""
        sums = np.cumsum(self.exponent)
        below = np.flatnonzero(sums < 0.0)
        if len(below) == 0:
            return float(self.components) if len(sums) == self.components else math.nan
        k = int(below[0])
        return k + (float(sums[k - 1] / -self.exponent[k]) if k else 0.0)


def lyapunov_spectrum(
    scene: Scene,
    *,
    count: int | None = None,
    precision: float = 1e-3,
    periods: float = 2000,
    transient: float = 300,
    rtol: float = 1e-8,
    seed: int = 0,
    show_progress: bool | None = False,
    **parameters: float,
) -> Lyapunov:
    """Return all Lyapunov exponents of a scene's network, or the `count` largest, along the motion from its own start.

    Times count periods of the drive, or 2 pi where there is none.  After `transient` the averages run until every
    standard error is below `precision`, or for `periods`.  `rtol` is the tolerance of the integration, never looser than
    what the friction law asks for; `seed` chooses the first directions.

    Raises ValueError for more than eight oscillators, a count that the network does not have, and for time dependence
    without a known period; FloatingPointError where an integration fails.
    """
    precision, periods, transient, seed = averaging(precision, periods, transient, seed)
    scene = one_cell(lyapunov_spectrum, scene, rtol, parameters)
    walk = Walk.make(scene, _counted(scene, count), seed)
    for _ in range(round(transient)):
        walk.advance()
    walk.choose()
    batches, lost = Batches(walk.unit / walk.parts), np.zeros(walk.count, dtype=bool)
    hidden = None if show_progress is None else not show_progress
    with tqdm(total=math.ceil(periods), unit="period", disable=hidden) as bar:
        while batches.blocks < periods * walk.parts:
            growth, share, volume = walk.advance()
            lost |= share < LOST * walk.rtol
            batches.add(np.append(np.where(np.isfinite(growth), growth, 0.0), volume)[None])
            bar.update(1.0 / walk.parts)
            if batches.due and np.all(batches.error()[:-1][~lost] <= precision):
                break
    return _report(walk, batches, lost)


def _report(walk: Walk, batches: Batches, lost: np.ndarray) -> Lyapunov:
    """Means and errors; what comes after a lost direction is lost as well."""
    resolved = ~np.logical_or.accumulate(lost)
    mean, error = batches.mean()[0], batches.error_by_start()[0]
    found, spread = np.where(resolved, mean[:-1], -np.inf), np.where(resolved, error[:-1], 0.0)
    order = np.argsort(-found, kind="stable")
    time, volume = batches.blocks * batches.length, (float(mean[-1]), float(error[-1]))
    if walk.variation.events is not None:
        known = len(found) == walk.variation.size
        volume = (float(found.sum()), float(np.hypot.reduce(spread))) if known else (math.nan, math.nan)
    return Lyapunov(found[order], spread[order], resolved[order], *volume, time, walk.unit / walk.parts,
                    walk.variation.size)  # fmt: skip


def _counted(scene: Scene, count: int | None) -> int:
    dimension = scene.n * len(scene.equations.nodes[0].continuous)
    if count is None:
        return dimension
    if not 1 <= whole("count", count, -dimension) <= dimension:
        raise ValueError(f"count = {count}; expected 1 … {dimension}, the components of the network's state")
    return count


@dataclass(slots=True)
class Walk:
    """One orbit with `count` orthogonal deviations, taken over blocks of 1/parts of a period; `phase` counts them."""

    scene: Scene
    variation: Variation
    carrier: Carrier
    basis: np.ndarray
    unit: float
    parts: int = 1
    phase: int = 0

    @classmethod
    def make(cls, scene: Scene, count: int, seed: int) -> Walk:
        """At the scene's start, with random directions; ValueError where time enters without a known period."""
        unit = unit_of_time(scene)
        own = network_variation(scene.equations)
        sticks = own.events is not None
        variation = own if sticks else Variation(with_volume(own.orbit), own.size, own.matrix)
        variation = phase_shifted(variation) if scene.forced else variation
        values = {**scene.parameters, PHASE.name: 0.0}
        numbers = np.array([[values[name] for name in variation.orbit.parameters]])
        state = np.array([[*scene.y0, *(0.0 for _ in range(0 if sticks else scene.n))]])
        state = with_modes(variation.orbit, state, numbers)
        carrier = Carrier.make(scene, variation, state, numbers, np.zeros((0, count)), 1)
        basis = np.linalg.qr(np.random.default_rng(seed).normal(size=(own.size, count)))[0]
        return cls(scene, variation, carrier, basis, unit)

    @property
    def count(self) -> int:
        """Number of deviations."""
        return int(self.basis.shape[1])

    @property
    def rtol(self) -> float:
        """The tolerance integrated with."""
        return float(self.carrier.control[0])

    def advance(self) -> tuple[np.ndarray, np.ndarray, float]:
        """Advance by one block.

        Returns the logarithms of the growth in each direction (count,), the length of each direction after the block over
        the longest that its deviation has been (count,), and the logarithm of the growth of volumes (nan with set-valued
        friction).
        """
        names = self.variation.orbit.parameters
        if PHASE.name in names:
            self.carrier.numbers[:, names.index(PHASE.name)] = self.phase * (self.unit / self.parts)
        self.phase = (self.phase + 1) % self.parts
        self.carrier.point(self.basis[None])
        whole_growth = self.carrier.advance(self.unit / self.parts)[0]
        self.basis, triangle = np.linalg.qr(self.carrier.deviations[0])
        own = np.abs(np.diagonal(triangle))
        volume = np.nan
        if self.variation.events is None:
            shares = self.carrier.state[:, -self.scene.n :]
            volume = float(shares.sum())
            shares[:] = 0.0
        with np.errstate(divide="ignore"):
            return whole_growth + np.log(own), own * np.exp(np.minimum(whole_growth, 0.0)), volume

    def choose(self) -> None:
        """Take the fewest blocks a period that keep as many directions clear of the error as any number does."""
        best = -1
        chosen = 1
        for parts in PARTS:
            self.parts, self.phase = parts, 0
            shares = np.array([self.advance()[1] for _ in range(TRIAL * parts)])
            clear = np.logical_and.accumulate(shares.min(axis=0) > CLEAR * self.rtol)
            if clear.sum() > best:
                best, chosen = int(clear.sum()), parts
            if best == self.count:
                break
        self.parts, self.phase = chosen, 0
        for _ in range(TRIAL * chosen):
            self.advance()
