"""Choose the kernel and the blocks of time of orthogonal deviations along the motion of a network.

Up to eight equal oscillators without a mass matrix take the kernel of modes: it integrates the orbit once, has the events
of set-valued friction, and integrates the divergence of the equations. All other networks take the kernel of the lifted
network.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import sympy as sp

from synchain.codegen.driver.columns import Control
from synchain.codegen.kernels.sweep_kernel import LARGEST_UNROLLED
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.reduction import without_drive
from synchain.models.dynamics.variational import (
    PHASE,
    Variation,
    clock_shifted,
    network_variation,
    phase_shifted,
    with_volume,
)
from synchain.models.scenes.scene import Scene

from .averages import TOLERANCE_RATIO, TRIED, error_of_steps
from .lifted_integrator import LiftedIntegrator
from .motion import OrbitIntegrator, RateFunctions, Turns, rates_of, turns_of
from .orbits import LOOKS, OF_EXTENT, OrbitProblem, unit_of_time

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

PIECES = 16
"""Parts of a turn after each of which the growth is measured, for its scatter at the ends of an average."""

LOOKED = 2
"""Number of drive periods in which the extent of a motion is measured."""

ROUNDING = 1e-13
"""A direction of this length consists of rounding errors alone; only shorter blocks may resolve it."""


class FrameIntegrator(OrbitIntegrator, Protocol):
    """An orbit with orthogonal directions."""

    observes: bool  # True if no warning of short steps is due

    def set_directions(self, basis: np.ndarray) -> None:
        """Set the directions (size, count)."""

    def orthogonal(self, length: float, batches: np.ndarray, plan: np.ndarray, frame: np.ndarray) -> np.ndarray:
        """Integrate over blocks of time; return the growth (b, count + 1) of the directions and of the volume."""

    def loosened(self, ratio: float) -> AbstractContextManager[None]:
        """Multiply the tolerances inside the context; restore state, directions and tolerances after it."""


@dataclass(slots=True)
class TangentFrame:
    """One orbit with orthogonal deviations, advanced over blocks of 1/parts of a period."""

    integrator: FrameIntegrator
    orbit: Equations  # equations of the orbit
    turns: Turns  # the period of the drive, or the mean return time of undriven motion
    size: int  # number of exponents
    count: int  # number of directions
    volumes: int = 0  # number of states, at the end of the state, that are logarithms of volumes
    parts: int = 1  # blocks in a period
    phase: int = 0  # block within the period

    @classmethod
    def make(cls, scene: Scene, count: int, seed: int) -> TangentFrame:
        """Return a frame at the scene's start, with random directions."""
        equations = without_drive(scene.equations, scene.parameters)
        size = equations.continuous_dimension
        basis = np.linalg.qr(np.random.default_rng(seed).normal(size=(size, count)))[0]
        alike = len(equations.nodes) == 1 and not equations.inertial
        # lifted networks are faster above LARGEST_UNROLLED nodes, but have no saltation
        if alike and (equations.n <= LARGEST_UNROLLED or equations.sticks):
            return cls._of_modes(scene, equations, basis)
        return cls._of_lift(scene, equations, basis)

    @classmethod
    def _of_modes(cls, scene: Scene, equations: Equations, basis: np.ndarray) -> TangentFrame:
        network, (size, count) = network_variation(equations), basis.shape
        sticks = network.events is not None
        # append the logarithms of volumes to the states of the orbit, unless stick makes volumes zero
        variation = network if sticks else Variation(with_volume(network.orbit), network.size, network.matrix)
        variation = phase_shifted(variation) if variation.orbit.forced else variation
        hidden = 0 if sticks else scene.n
        start = np.array([[*scene.y0, *(0.0 for _ in range(hidden))]])
        problem = OrbitProblem.of(scene, variation, np.zeros((count, 0)), start)
        state = problem.with_slip_states(start)

        def begun(problem: OrbitProblem) -> TangentFrame:
            integrator = problem.integrator(state)
            integrator.set_directions(basis)
            return cls(integrator, variation.orbit, problem.turns, size, count, hidden)

        # in units of the extent of the motion, all components of a deviation have similar sizes
        turns = begun(problem)._measured(lambda: rates_of(network.orbit, dict(scene.parameters)))
        problem = replace(problem, variation=_scaled(variation, turns.extent))
        return begun(problem.with_turns(turns, start))

    @classmethod
    def _of_lift(cls, scene: Scene, equations: Equations, basis: np.ndarray) -> TangentFrame:
        orbit, size = clock_shifted(equations) if equations.forced else equations, len(basis)
        integrator = LiftedIntegrator.make(scene, orbit, np.array(scene.y0), basis)
        turns = Turns(unit_of_time(scene), np.zeros(size), "period of the drive")
        turns = cls(integrator.alone(), orbit, turns, size, 1)._measured(
            lambda: rates_of(equations, dict(scene.parameters))
        )
        # a component of a direction has the size of the motion, so that one tolerance suits both
        moving = turns.extent > 0.0
        if moving.any():
            extent = np.where(moving, turns.extent, np.median(turns.extent[moving]))
            integrator.units[:] = 2.0 ** np.round(np.log2(extent))
            least = OF_EXTENT * integrator.control[Control.RTOL] * extent.min()
            integrator.control[Control.ATOL] = min(integrator.control[Control.ATOL], least)
        return cls(integrator, orbit, turns, size, basis.shape[1])

    def _measured(self, rates: Callable[[], RateFunctions]) -> Turns:
        """Return the unit of time and the extent of the motion, which advances."""
        hidden = self.volumes
        if not self.orbit.forced:
            self.integrator.observes = True  # do not warn of short steps: the runs are too short
            return turns_of(self.integrator, rates(), hidden)
        self.parts, states = LOOKS, [self.integrator.state[0].copy()]
        for _ in range(LOOKED * LOOKS):
            self.advance(np.ones(1, dtype=np.int64))
            states.append(self.integrator.state[0].copy())
        return self.turns._replace(extent=np.ptp(states, axis=0)[: len(states[0]) - hidden])

    @property
    def unit(self) -> float:
        """Unit of time: the period of the drive, or the mean return time of undriven motion."""
        return self.turns.time

    @property
    def rtol(self) -> float:
        """Relative tolerance of the integration."""
        return float(self.integrator.control[Control.RTOL])

    def advance(self, batches: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Advance by batches (b,) of blocks; return growths (b, count + 1), least lengths (count,), lost (count,).

        The last column of the growths is that of the volume. The least length of a direction is that at the end of a
        block, before normalisation, at most 1. A direction is lost if it is shorter than the error after a block.
        """
        names, frame = self.orbit.parameters, np.zeros((4, self.count))
        shift = names.index(PHASE.name) if PHASE.name in names else -1
        frame[0] = np.inf
        plan = np.array([self.parts, self.phase, shift, self.volumes])
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

    def uneven_growth(self, mean: np.ndarray) -> np.ndarray:
        """Return the scatter (count + 1,) of the growth between the two ends of an average, beyond that at the mean rate.

        The turns of undriven motion are known on average only: the run may end anywhere in a turn.  Within a turn the
        logarithm of a length wanders about its mean rate; two independent ends add.  Periods of a drive are whole.
        """
        if self.orbit.forced:
            return np.zeros(self.count + 1)
        parts, phase = self.parts, self.phase
        with self.integrator.loosened(1.0):  # the average goes on from the state before
            self.parts, self.phase = PIECES, 0
            growth = np.cumsum(self.advance(np.ones(PIECES, dtype=np.int64))[0], axis=0)
        self.parts, self.phase = parts, phase
        with np.errstate(invalid="ignore"):
            steady = np.arange(1, PIECES + 1)[:, None] * (self.unit / PIECES) * mean
            return np.asarray(np.nan_to_num(math.sqrt(2.0) * np.std(growth - steady, axis=0), posinf=0.0))

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
    return variation.in_units([sp.Integer(UNIT) ** int(power) for power in powers])
