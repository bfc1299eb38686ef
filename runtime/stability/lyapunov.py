"""Compute the Lyapunov exponents of a whole network, along the motion from its own start.

Deviations are integrated over short blocks of time and made orthogonal after each block. A block is short
enough if every direction remains longer than the error of the integration. Under a smoothed friction law,
the velocity deviations of oscillators that stick decay so fast that no block is short enough. The
exponents of such lost directions are not reported as numbers. Only the sum of the lost exponents can be
computed: the sum of all exponents is the mean divergence of the equations, which is integrated along the
orbit. If a single exponent is lost, the difference gives it.

`TangentFrame` holds the orbit (`orbits.OrbitProblem`, an integrator) and the orthogonal deviations.
`lyapunov_spectrum` makes a frame, runs the transient, chooses the length of blocks, and averages the growth.

Under set-valued friction, stick makes the velocity of a deviation zero, so that directions vanish
within finite time. The exponent of a vanished direction is -inf by definition, and so is the sum. At the end
of a block, a vanished direction has the length of a rounding error.

Source: Benettin, Galgani, Giorgilli & Strelcyn, Meccanica 15, 9 (1980).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import sympy as sp
import xarray as xr

from synchain.codegen.driver.columns import Control
from synchain.models.dynamics.reduction import without_drive
from synchain.models.dynamics.variational import PHASE, Variation, network_variation, phase_shifted, with_volume
from synchain.models.inputs.checks import check_integer
from synchain.models.scenes.scene import Scene

from ..cells.run_keywords import ONE_ORBIT, Given
from ..results.labelled import Labelled, dataset
from ..support.error_text import with_error
from ..support.execution import Execution
from ..support.progress import Hook
from .averages import TOLERANCE_RATIO, TRIED, Averaging, Batches, document_keywords, error_of_steps
from .motion import rates_of
from .orbits import LOOKS, OrbitProblem
from .slow_motion import warn_of_slow_motion
from .variational_integrator import VariationalIntegrator

__all__ = ["Lyapunov", "lyapunov_spectrum"]

PARTS = (1, 2, 4, 8, 16, 32, 64, 128, 256)
"""Numbers of blocks in a period that are tried, in ascending order."""

ENOUGH = 64
"""More than ENOUGH blocks in a period are tried only if the next direction is longer than ROUNDING (a choice)."""

TRIAL = 4
"""Number of periods of each trial, and number of periods that are dropped after the choice."""

CLEAR = 1e4
"""A direction is resolved if it is longer than CLEAR rtol after a block (a choice)."""

UNIT = 1024
"""Units of deviations are powers of UNIT. UNIT is a power of two, so that no digit is lost, and so large that
components
of usual sizes share one unit."""

CALL = 8
"""Number of periods of the transient in one call; growth without bound is seen from call to call (a choice)."""

LOOKED = 2
"""Number of drive periods in which the extent of a motion is measured."""

LARGEST_RTOL = 1e-5
"""Largest rtol that is accepted: with a larger one no direction is resolved."""

ROUNDING = 1e-13
"""A direction of this length consists of rounding errors alone; only shorter blocks may resolve it."""


@dataclass(frozen=True, slots=True, repr=False)
class Lyapunov(Labelled):
    """Lyapunov exponents of a network.

    Exponents that differ by less than about 1/time are not separated: only their sum is right. The
    standard errors do not include this effect.

    Parameters
    ----------
    exponent : ndarray, shape (count,)
        Exponents per unit of non-dimensional time in descending order.
    stderr : ndarray, shape (count,)
        Standard errors.
    resolved : ndarray of bool, shape (count,)
        False for a direction that decays too fast to be followed, if there are several; its exponent is -inf. Its
        standard error is 0 under set-valued friction, where stick makes directions vanish, and nan otherwise.
    lengths : ndarray, shape (k,)
        Lengths of up to 64 parts of the average, from its beginning, in units of time; the last is `time`.
    running : ndarray, shape (k, count)
        Exponents of these parts, which show whether the average has converged.
    divergence : float
        Mean divergence along the orbit, which is the sum of all exponents of the network. Under
        set-valued friction, the computed exponents are added instead: the sum is -inf if an oscillator
        has stuck, and nan if not all exponents are computed.
    divergence_error : float
        Standard error of `divergence`.
    time : float
        Length of the average.
    block : float
        Time between two orthogonalisations.
    components : int
        Number of exponents of the network.
    unit : str
        Unit in which transient and average are counted.
    """

    exponent: np.ndarray
    stderr: np.ndarray
    resolved: np.ndarray
    lengths: np.ndarray
    running: np.ndarray
    divergence: float
    divergence_error: float
    time: float
    block: float
    components: int
    unit: str = ""

    @property
    def data(self) -> xr.Dataset:
        """Exponents over their index, also of parts of the average, and the divergence."""
        return dataset(
            {
                "exponent": (("number",), self.exponent, "Lyapunov exponents per unit of time"),
                "stderr": (("number",), self.stderr, "standard errors"),
                "resolved": (("number",), self.resolved, "whether the direction could be followed"),
                "running": (("length", "number"), self.running, "exponents of the first part of the average"),
                "divergence": ((), self.divergence, "mean divergence along the orbit"),
            },
            {"number": np.arange(1, len(self.exponent) + 1), "length": self.lengths},
        )

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """The exponents with errors, their sum, the dimension and the length of the average."""
        shown = [with_error(x, e) for x, e in zip(self.exponent[:8], self.stderr[:8], strict=True)]
        low, high = self.dimension_range
        dimension = f"{self.dimension:.4g}, from {low:.4g} to {high:.4g} within two errors"
        lost = int((~self.resolved).sum())
        fast = f"{lost} direction{'s' * (lost > 1)}, which decay too fast; their exponents sum to {self.rest:.8g}"
        return (
            ("exponents", ", ".join([*shown, *(["…"] if len(self.exponent) > len(shown) else [])])),
            *((("not followed", fast),) if lost and len(self.exponent) == self.components else ()),
            ("divergence", with_error(self.divergence, self.divergence_error)),
            ("Kaplan-Yorke dimension", f"above {len(self.exponent)}" if math.isnan(self.dimension) else dimension),
            ("average", f"{self.time:.6g} units of time"),
            *((("unit", self.unit),) if self.unit else ()),
        )

    @property
    def rest(self) -> float:
        """Sum of the exponents that are not resolved: the divergence minus the resolved exponents."""
        return self.divergence - float(self.exponent[self.resolved].sum())

    @property
    def dimension(self) -> float:
        """Kaplan-Yorke dimension; nan if it exceeds the number of computed exponents.

        A negative exponent within its standard error of 0 counts as 0. The exponent along a periodic orbit, for
        example, is 0, and the dimension is 1. `dimension_range` is the range within the errors.

        References
        ----------
        Kaplan & Yorke, Springer Lecture Notes in Mathematics 730, 204 (1979).
        """
        zero = (self.exponent < 0.0) & (-self.exponent <= self.stderr) & np.isfinite(self.stderr)
        return self._dimension(np.where(zero, 0.0, self.exponent))

    @property
    def dimension_range(self) -> tuple[float, float]:
        """Kaplan-Yorke dimensions of the exponents minus, and plus, two standard errors.

        The dimension rises with each exponent, so that all exponents within their errors give dimensions in this range.
        """
        errors = np.nan_to_num(2.0 * self.stderr, nan=0.0, posinf=math.inf)
        return self._dimension(self.exponent - errors), self._dimension(self.exponent + errors)

    def _dimension(self, exponent: np.ndarray) -> float:
        """Return the Kaplan-Yorke dimension of exponents in any order."""
        exponent = -np.sort(-exponent)
        sums = np.cumsum(exponent)
        below = np.flatnonzero(sums < 0.0)
        if len(below) == 0:
            return float(self.components) if len(sums) == self.components else math.nan
        k = int(below[0])
        return k + (float(sums[k - 1] / -exponent[k]) if k else 0.0)


@document_keywords
def lyapunov_spectrum(
    scene: Scene,
    *,
    count: int | None = None,
    precision: float = 1e-3,
    periods: float = 5000,
    transient: float | None = None,
    rtol: float | None = None,
    seed: int | None = None,
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
    {average}
    rtol : float, optional
        Relative tolerance of the integration, at most 1e-5; by default that of the scene. The friction law may require
        a smaller one.
    seed : int, optional
        Seed of the initial directions; by default that of the scene.
    {progress}
    {parameters}

    Returns
    -------
    Lyapunov

    Raises
    ------
    ValueError
        If there are more than eight oscillators, if `count` exceeds the number of exponents, if `rtol` is
        too large, or if time enters the equations without a known period.
    FloatingPointError
        If the integration fails.
    """
    execution = Execution(1, None, show_progress, progress)
    averaging = Averaging.for_scene(scene, precision, periods, transient, seed, execution)
    given = Given(lyapunov_spectrum, parameters, more, ONE_ORBIT)
    scene = given.scene(scene, rtol=scene.rtol if rtol is None else rtol)
    reporter = averaging.reporter()
    dimension = scene.n * len(scene.equations.nodes[0].continuous)
    if count is not None and not 1 <= check_integer("count", count, -dimension) <= dimension:
        raise ValueError(f"count = {count}; expected 1 … {dimension}, the components of the network's state")
    frame = TangentFrame.make(scene, dimension if count is None else count, averaging.seed)
    if frame.rtol > LARGEST_RTOL:
        raise ValueError(
            f"rtol: found {frame.rtol:g}; expected at most {LARGEST_RTOL:g} for a whole spectrum, whose directions must "
            "stand out of the error of a block"
        )
    averaging = averaging.in_units(scene, frame.unit)
    reporter.total = averaging.length
    with reporter:
        for done in range(0, round(averaging.transient), CALL):
            length = min(CALL, round(averaging.transient) - done)
            frame.advance(np.array([length]))
            reporter.advance(length)
        frame.choose_block()
        batches, lost = Batches(frame.unit, 1.0 / frame.parts), np.zeros(frame.count, dtype=bool)
        for left in averaging.rounds(batches, lambda: batches.error()[:-1][~lost], reporter):
            parts = batches.ahead(left)
            growths, _, gone = frame.advance(parts)
            np.logical_or(lost, gone, out=lost)
            batches.extend(growths[:, None], parts)
        steps = frame.error_of_steps()
    orbit = frame.integrator
    warn_of_slow_motion(frame.variation.orbit, orbit.state, orbit.parameter_values[0], batches.time)
    return _report(frame, batches, lost, steps)


def _report(frame: TangentFrame, batches: Batches, lost: np.ndarray, steps: np.ndarray) -> Lyapunov:
    """Return the result of an average; all exponents after a lost direction count as lost too."""
    resolved = ~np.logical_or.accumulate(lost)
    mean, error = batches.mean()[0], np.hypot(batches.error_by_start()[0], steps)
    unknown = np.nan if frame.variation.events is None else 0.0
    exponent, spread = np.where(resolved, mean[:-1], -np.inf), np.where(resolved, error[:-1], unknown)
    order = np.argsort(-exponent, kind="stable")
    lengths, running = batches.running()
    time, volume = batches.time, (float(mean[-1]), float(error[-1]))
    if frame.variation.events is not None:  # stick makes volumes zero: use the sum of all exponents
        complete = len(exponent) == frame.variation.size
        volume = (float(exponent.sum()), float(np.hypot.reduce(spread))) if complete else (math.nan, math.nan)
    return Lyapunov(
        exponent[order],
        spread[order],
        resolved[order],
        lengths,
        np.where(resolved, running[:, 0, :-1], -np.inf)[:, order],
        *volume,
        time=time,
        block=frame.unit / frame.parts,
        components=frame.variation.size,
        unit=str(frame.problem.turns),
    )


@dataclass(slots=True)
class TangentFrame:
    """One orbit with orthogonal deviations, advanced over blocks of 1/parts of a period."""

    problem: OrbitProblem  # network with the variational equation of all its states
    integrator: VariationalIntegrator  # integrator of the orbit and its deviations
    count: int  # number of deviations
    parts: int = 1  # blocks in a period
    phase: int = 0  # block within the period

    @classmethod
    def make(cls, scene: Scene, count: int, seed: int) -> TangentFrame:
        """Return a frame at the scene's start, with random directions."""
        network = network_variation(without_drive(scene.equations, scene.parameters))
        sticks = network.events is not None
        # append the logarithms of volumes to the states of the orbit, unless stick makes volumes zero
        variation = network if sticks else Variation(with_volume(network.orbit), network.size, network.matrix)
        variation = phase_shifted(variation) if variation.orbit.forced else variation
        hidden = 0 if sticks else scene.n
        start = np.array([[*scene.y0, *(0.0 for _ in range(hidden))]])
        problem = OrbitProblem.of(scene, variation, np.zeros((count, 0)), start)
        state = problem.with_slip_states(start)

        # measure the extent of the motion; in units of the extent, all components of a deviation have similar sizes
        if problem.forced:
            first = cls.begin(problem, state, count, seed)
            first.parts, states = LOOKS, [state[0]]
            for _ in range(LOOKED * LOOKS):
                first.advance(np.ones(1, dtype=np.int64))
                states.append(first.integrator.state[0])
            turns = problem.turns._replace(extent=np.ptp(states, axis=0)[: len(states[0]) - hidden])
        else:
            rates = rates_of(network.orbit, dict(scene.parameters))
            turns = problem.observed_turns(state, problem.strengths, rates, hidden)
        if not sticks:
            problem = replace(problem, variation=_scaled(variation, turns.extent))
        problem = problem.with_turns(turns, start)
        return cls.begin(problem, state, count, seed)

    @classmethod
    def begin(cls, problem: OrbitProblem, state: np.ndarray, count: int, seed: int) -> TangentFrame:
        """Return a frame at a state (1, components), with random orthonormal directions."""
        integrator, size = problem.integrator(state), problem.variation.size
        integrator.vectors[:] = 0.0  # also in the lanes behind the last direction
        integrator.vectors[0, :, :count] = np.linalg.qr(np.random.default_rng(seed).normal(size=(size, count)))[0]
        return cls(problem, integrator, count)

    @property
    def variation(self) -> Variation:
        """The variational equation of the network."""
        return self.problem.variation

    @property
    def unit(self) -> float:
        """Unit of time: the period of the drive, or the mean return time of undriven motion."""
        return self.problem.unit

    @property
    def rtol(self) -> float:
        """Relative tolerance of the integration."""
        return float(self.integrator.control[Control.RTOL])

    def advance(self, batches: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Advance by batches (b,) of blocks; return growths (b, count + 1), least lengths (count,), lost (count,).

        The last column of the growths is that of the volume. The least length of a direction is that at the end of a
        block, before normalisation, at most 1. A direction is lost if it is shorter than the error after a block.
        """
        names, frame = self.variation.orbit.parameters, np.zeros((4, self.count))
        shift = names.index(PHASE.name) if PHASE.name in names else -1
        volumes = 0 if self.variation.events is not None else self.problem.scene.n
        frame[0] = np.inf
        plan = np.array([self.parts, self.phase, shift, volumes])
        growths = self.integrator.orthogonal(self.unit / self.parts, batches, plan, frame)
        self.phase = int(plan[1])
        return growths, frame[0], frame[1] > 0.0

    def error_of_steps(self) -> np.ndarray:
        """Advance by TRIED periods; return the error of all growth rates (count + 1,) due to the steps."""
        usual, looser, single = [], [], np.ones(1, dtype=np.int64)
        for _ in range(TRIED * self.parts):
            phase = self.phase
            with self.integrator.loosened(TOLERANCE_RATIO):
                looser.append(self.advance(single)[0][0])
            self.phase = phase
            usual.append(self.advance(single)[0][0])
        return error_of_steps(usual, looser, self.unit / self.parts)

    def choose_block(self) -> None:
        """Choose the smallest number of blocks in a period for which most directions are resolved."""
        best, fewest = -1, 1
        for parts in PARTS:
            self.parts, self.phase = parts, 0
            # a direction counts as resolved if it and all directions before it are longer than the error in every block
            _, least, _ = self.advance(np.array([TRIAL * parts]))
            clear = np.logical_and.accumulate(least > CLEAR * self.rtol)
            if clear.sum() > best:
                best, fewest = int(clear.sum()), parts
            if best == self.count or (parts >= ENOUGH and least[best] < ROUNDING):
                break
        self.parts, self.phase = fewest, 0
        self.advance(np.array([TRIAL * fewest]))


def _scaled(variation: Variation, extent: np.ndarray) -> Variation:
    """Return the variational equation in units of the extent of each component, rounded to powers of UNIT."""
    moving = extent[: variation.size] > 0.0
    if not moving.any():
        return variation
    logarithms = np.log(np.where(moving, extent[: variation.size], 1.0)) / math.log(UNIT)
    powers = np.where(moving, np.round(logarithms - np.median(logarithms[moving])), 0.0).astype(int)
    matrix = tuple(((r, c), e * sp.Integer(UNIT) ** int(powers[c] - powers[r])) for (r, c), e in variation.matrix)
    return Variation(variation.orbit, variation.size, matrix)
