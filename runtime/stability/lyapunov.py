"""Lyapunov exponents of a whole network, from its own start.

Deviations are integrated over short blocks of time and made orthogonal after each. A block is short
enough if every direction stands out of the error of the integration. Under a smoothed friction law,
oscillators that stick lose their velocity deviations so fast that no block is short enough;
exponents lost in this error are not reported as numbers. Their sum is known all the same: the sum
of all exponents is the mean divergence of the equations, which is integrated along the orbit.

Under set-valued friction, stick makes the velocity of a deviation zero, so that directions vanish
within finite time. Their exponent is -inf by definition, and so is the sum. Such a direction comes
out of a block with the length of a rounding error.

Source: Benettin, Galgani, Giorgilli & Strelcyn, Meccanica 15, 9 (1980).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr

from synchain.models.dynamics.variational import PHASE, Variation, network_variation, phase_shifted, with_volume
from synchain.models.inputs.checks import check_integer
from synchain.models.scenes.scene import Scene

from ..cells.initial_modes import with_modes
from ..cells.keywords import ONE_ORBIT, Given
from ..results.labelled import Labelled, dataset
from ..support.execution import Execution
from ..support.progress import Hook
from .averages import Averaging, Batches
from .exponents import single_cell
from .orbits import unit_of_time
from .variational_integrator import VariationalIntegrator

__all__ = ["Lyapunov", "lyapunov_spectrum"]

PARTS = (1, 2, 4, 8, 16, 32, 64)
"""Numbers of blocks in a period that are tried, in ascending order."""

TRIAL = 4
"""Periods of each trial, and periods that are dropped after the choice."""

CLEAR, LOST = 1e4, 10.0
"""Lengths of a direction after a block, in tolerances.

From the first on it is clear of the error, below the second it is lost.
"""


@dataclass(frozen=True, slots=True, repr=False)
class Lyapunov(Labelled):
    """Lyapunov exponents of a network.

    Exponents that differ by less than about 1/time are not separated yet: they share their sum, and
    the errors do not include this.

    Parameters
    ----------
    exponent : ndarray, shape (count,)
        Exponents per unit of non-dimensional time in descending order.
    stderr : ndarray, shape (count,)
        Standard errors.
    resolved : ndarray of bool, shape (count,)
        False if a direction decays faster than can be followed; its exponent is -inf, its error 0.
    divergence : float
        Mean divergence along the orbit: the sum of all exponents of the network. With set-valued
        friction it is that sum itself, -inf if an oscillator has stuck, nan if not all exponents
        are computed.
    divergence_error : float
        Standard error of `divergence`.
    time : float
        Time averaged over.
    block : float
        Time between two orthogonalisations.
    components : int
        Number of all exponents.
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
    def data(self) -> xr.Dataset:
        """Exponents over their number, and the divergence."""
        return dataset(
            {
                "exponent": (("number",), self.exponent, "Lyapunov exponents per unit of time"),
                "stderr": (("number",), self.stderr, "standard errors"),
                "resolved": (("number",), self.resolved, "whether the direction could be followed"),
                "divergence": ((), self.divergence, "mean divergence along the orbit"),
            },
            {"number": np.arange(1, len(self.exponent) + 1)},
        )

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """The exponents with errors, their sum, the dimension and the length of the average."""
        shown = [f"{x:.5g} ± {e:.1g}" for x, e in zip(self.exponent[:8], self.stderr[:8], strict=True)]
        low, high = self.dimension_range
        return (
            ("exponents", ", ".join([*shown, *(["…"] if len(self.exponent) > len(shown) else [])])),
            ("divergence", f"{self.divergence:.5g} ± {self.divergence_error:.1g}"),
            ("Kaplan-Yorke dimension", f"{self.dimension:.4g}, from {low:.4g} to {high:.4g} within two errors"),
            ("average", f"{self.time:.6g} units of time"),
        )

    @property
    def rest(self) -> float:
        """Sum of the exponents that are not resolved: the divergence less the resolved ones."""
        return self.divergence - float(self.exponent[self.resolved].sum())

    @property
    def dimension(self) -> float:
        """Kaplan-Yorke dimension; nan if too few exponents are known.

        A negative exponent within its standard error counts as 0, as that along a periodic orbit is,
        whose dimension is 1. `dimension_range` says what the errors leave open.

        References
        ----------
        Kaplan & Yorke, Springer Lecture Notes in Mathematics 730, 204 (1979).
        """
        zero = (self.exponent < 0.0) & (-self.exponent <= self.stderr) & np.isfinite(self.stderr)
        return self._dimension(np.where(zero, 0.0, self.exponent))

    @property
    def dimension_range(self) -> tuple[float, float]:
        """Kaplan-Yorke dimension of the exponents less, and plus, two standard errors.

        It rises with each exponent, so that all exponents within their errors give dimensions between.
        """
        return self._dimension(self.exponent - 2.0 * self.stderr), self._dimension(self.exponent + 2.0 * self.stderr)

    def _dimension(self, exponent: np.ndarray) -> float:
        """The dimension that some exponents give."""
        exponent = -np.sort(-exponent)
        sums = np.cumsum(exponent)
        below = np.flatnonzero(sums < 0.0)
        if len(below) == 0:
            return float(self.components) if len(sums) == self.components else math.nan
        k = int(below[0])
        return k + (float(sums[k - 1] / -exponent[k]) if k else 0.0)


def lyapunov_spectrum(
    scene: Scene,
    *,
    count: int | None = None,
    precision: float = 1e-3,
    periods: float = 5000,
    transient: float = 300,
    rtol: float = 1e-8,
    seed: int = 0,
    show_progress: bool | None = None,
    progress: Hook | None = None,
    parameters: Mapping[str, float] | None = None,
    **more: float,
) -> Lyapunov:
    """Compute the Lyapunov exponents of a scene's network along the motion from its own start.

    Parameters
    ----------
    scene : Scene
        Network of at most eight oscillators.
    count : int, optional
        Number of largest exponents; all by default.
    precision : float
        Averaging stops if every standard error is below this value.
    periods : float
        Longest average, in periods of the drive, or in units of 2 pi if there is none; a whole number.
    transient : float
        Transient before the average, in the same units.
    rtol : float
        Relative tolerance of the integration. The friction law may require a smaller one.
    seed : int
        Seed of the initial directions.
    show_progress : bool, optional
        Whether to show a bar; by default a bar on terminals and in notebooks, a line a minute elsewhere.
    progress : callable, optional
        Is called with a `Progress`, which counts periods of the drive.
    parameters : mapping of str to float, optional
        Parameters of the scene to set, for names that are keywords already.
    **more : float
        Parameters of the scene to set.

    Returns
    -------
    Lyapunov

    Raises
    ------
    ValueError
        If there are more than eight oscillators, if `count` exceeds the number of exponents, or if
        time enters without a known period.
    FloatingPointError
        If the integration fails.
    """
    averaging = Averaging(precision, periods, transient, seed, Execution(1, None, show_progress, progress))
    scene = single_cell(Given(lyapunov_spectrum, parameters, more, ONE_ORBIT), scene, rtol)
    reporter = averaging.reporter()
    frame = TangentFrame.make(scene, _counted(scene, count), averaging.seed)
    with reporter:
        for _ in range(round(averaging.transient)):
            frame.advance()
            reporter.advance(1)
        frame.choose_block()
        batches, lost = Batches(frame.unit, 1.0 / frame.parts), np.zeros(frame.count, dtype=bool)
        for _ in averaging.rounds(batches, lambda: batches.error()[:-1][~lost], reporter):
            growth, share, volume = frame.advance()
            np.logical_or(lost, share < LOST * frame.rtol, out=lost)
            batches.add(np.append(np.where(np.isfinite(growth), growth, 0.0), volume)[None])
    return _report(frame, batches, lost)


def _report(frame: TangentFrame, batches: Batches, lost: np.ndarray) -> Lyapunov:
    """Means and errors; exponents after a lost direction are lost as well."""
    resolved = ~np.logical_or.accumulate(lost)
    mean, error = batches.mean()[0], batches.error_by_start()[0]
    exponent, spread = np.where(resolved, mean[:-1], -np.inf), np.where(resolved, error[:-1], 0.0)
    order = np.argsort(-exponent, kind="stable")
    time, volume = batches.time, (float(mean[-1]), float(error[-1]))
    if frame.variation.events is not None:
        known = len(exponent) == frame.variation.size
        volume = (float(exponent.sum()), float(np.hypot.reduce(spread))) if known else (math.nan, math.nan)
    return Lyapunov(
        exponent[order],
        spread[order],
        resolved[order],
        *volume,
        time=time,
        block=frame.unit / frame.parts,
        components=frame.variation.size,
    )


def _counted(scene: Scene, count: int | None) -> int:
    """Number of exponents to compute, checked against the network's state."""
    dimension = scene.n * len(scene.equations.nodes[0].continuous)
    if count is None:
        return dimension
    if not 1 <= check_integer("count", count, -dimension) <= dimension:
        raise ValueError(f"count = {count}; expected 1 … {dimension}, the components of the network's state")
    return count


@dataclass(slots=True)
class TangentFrame:
    """One orbit with orthogonal deviations, advanced over blocks of 1/parts of a period.

    Parameters
    ----------
    scene : Scene
        Network and its start.
    variation : Variation
        Variational equation of the whole network.
    integrator : VariationalIntegrator
        Integrator of the orbit and its deviations.
    basis : ndarray, shape (size, count)
        Orthonormal deviations.
    unit : float
        Period of the drive, or 2 pi.
    parts : int
        Blocks in a period.
    phase : int
        Block within the period.
    """

    scene: Scene
    variation: Variation
    integrator: VariationalIntegrator
    basis: np.ndarray
    unit: float
    parts: int = 1
    phase: int = 0

    @classmethod
    def make(cls, scene: Scene, count: int, seed: int) -> TangentFrame:
        """Set up the frame at the scene's start, with random directions.

        Parameters
        ----------
        scene : Scene
            Network and its start.
        count : int
            Number of deviations.
        seed : int
            Seed of the directions.

        Raises
        ------
        ValueError
            If time enters without a known period.
        """
        unit = unit_of_time(scene)
        network = network_variation(scene.equations)
        sticks = network.events is not None
        variation = network if sticks else Variation(with_volume(network.orbit), network.size, network.matrix)
        variation = phase_shifted(variation) if scene.forced else variation
        values = {**scene.parameters, PHASE.name: 0.0}
        numbers = np.array([[values[name] for name in variation.orbit.parameters]])
        state = np.array([[*scene.y0, *(0.0 for _ in range(0 if sticks else scene.n))]])
        state = with_modes(variation.orbit, state, numbers)
        integrator = VariationalIntegrator.make(scene, variation, state, numbers, np.zeros((0, count)), 1)
        basis = np.linalg.qr(np.random.default_rng(seed).normal(size=(network.size, count)))[0]
        return cls(scene, variation, integrator, basis, unit)

    @property
    def count(self) -> int:
        """Number of deviations."""
        return int(self.basis.shape[1])

    @property
    def rtol(self) -> float:
        """Relative tolerance of the integration."""
        return float(self.integrator.control[0])

    def advance(self) -> tuple[np.ndarray, np.ndarray, float]:
        """Advance by one block.

        Returns
        -------
        growth : ndarray, shape (count,)
            Logarithm of the growth in each direction.
        share : ndarray, shape (count,)
            Length of each direction after the block over the longest length of its deviation.
        volume : float
            Logarithm of the growth of volumes; nan with set-valued friction.
        """
        names = self.variation.orbit.parameters
        if PHASE.name in names:
            self.integrator.numbers[:, names.index(PHASE.name)] = self.phase * (self.unit / self.parts)
        self.phase = (self.phase + 1) % self.parts
        self.integrator.set_deviations(self.basis[None])
        whole_growth = self.integrator.advance(self.unit / self.parts)[0]
        self.basis, triangle = np.linalg.qr(self.integrator.deviations[0])
        lengths = np.abs(np.diagonal(triangle))
        volume = np.nan
        if self.variation.events is None:
            shares = self.integrator.state[:, -self.scene.n :]
            volume = float(shares.sum())
            shares[:] = 0.0
        with np.errstate(divide="ignore"):
            return whole_growth + np.log(lengths), lengths * np.exp(np.minimum(whole_growth, 0.0)), volume

    def choose_block(self) -> None:
        """Choose the fewest blocks in a period that keep most directions clear of the error."""
        best = -1
        fewest = 1
        for parts in PARTS:
            self.parts, self.phase = parts, 0
            shares = np.array([self.advance()[1] for _ in range(TRIAL * parts)])
            clear = np.logical_and.accumulate(shares.min(axis=0) > CLEAR * self.rtol)
            if clear.sum() > best:
                best, fewest = int(clear.sum()), parts
            if best == self.count:
                break
        self.parts, self.phase = fewest, 0
        for _ in range(TRIAL * fewest):
            self.advance()
