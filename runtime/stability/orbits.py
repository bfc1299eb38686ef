"""Define `OrbitProblem`: the equations, strengths, unit of time and method of orbits with deviations, as one value.

An `OrbitProblem` does not change after it is made, and contains no states. A function that computes exponents
or cycles makes a problem first:

* `OrbitProblem.of_modes` for transversal modes along the orbit of one oscillator,
* `OrbitProblem.of` for any other variational equation (blocks of clusters, a whole network).

`OrbitProblem.settled` runs the transient; `OrbitProblem.integrator` starts an integrator from states.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
import sympy as sp

from synchain.codegen.driver.columns import Control
from synchain.codegen.integrators import Integrator
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.mode_inertia import inertia_of_modes
from synchain.models.dynamics.reduction import without_drive
from synchain.models.dynamics.saltation import check_links_of_events
from synchain.models.dynamics.variational import PHASE, Variation, mode
from synchain.models.graphs.families import topology
from synchain.models.scenes.scene import Scene

from ..cells.initial_modes import with_modes
from ..engines.choice import chosen_for_modes
from .motion import RateFunctions, Turns, above, extent_of, rates_of, rests, turns_of
from .variational_integrator import VariationalIntegrator

FAR = 300.0
"""Factors of propagators beyond exp(±FAR) are stored as logarithms, before numbers underflow at exp(-745)."""

OF_EXTENT = 1.0
"""Largest absolute tolerance, in units of rtol times the least extent of a component that moves (a choice)."""

LOOKS, STROBES = 8, 16
"""LOOKS: number of states within a drive period. STROBES: number of drive periods. The extent of a motion is measured
from
these states (a choice)."""

TOGETHER = 100
"""Number of units of time of a transient in one call; Ctrl-C acts between calls."""


@dataclass(frozen=True, slots=True)
class OrbitProblem:
    """Orbits of a scene, with deviations along the orbits."""

    scene: Scene  # oscillator, coupling and numerical settings
    variation: Variation  # equations of the orbit and of its deviations
    # (m,) or (m, entries), real or complex: strengths of the deviations; for modes of links without inertia, alpha + i
    # beta of each layer, or the entries of matrices of alpha
    strengths: np.ndarray
    turns: Turns  # the unit of time, and the extent of the motion; an extent of 0 has not been measured
    method: Integrator  # the integrator for all strengths
    columns: int  # number of deviations of each strength; for propagators, the number of components
    workers: int | None  # number of threads

    @classmethod
    def of(
        cls, scene: Scene, variation: Variation, strengths: np.ndarray, starts: np.ndarray, columns: int = 1,
        workers: int | None = 1, turns: Turns | None = None,
    ) -> OrbitProblem:  # fmt: skip
        """Return a problem with the unit of time `turns`; by default, the drive's period, or 2 pi without a drive.

        Shapes: starts (starts, components).
        """
        unit = turns or Turns(unit_of_time(scene), np.zeros(starts.shape[1]), "period of the drive")
        values = np.tile(_parameter_values(scene, variation.orbit), (len(starts), 1))
        rows = (variation, with_modes(variation.orbit, starts, values), values, _rows(strengths))
        # undriven motion that is not yet observed may have any pace: infinity chooses power series, which find their
        # steps
        pace = 2.0 * math.pi / unit.time if turns or variation.orbit.forced else math.inf
        return cls(scene, variation, strengths, unit, chosen_for_modes(scene, *rows, pace), columns, workers)

    @classmethod
    def of_modes(
        cls, scene: Scene, strengths: np.ndarray, starts: np.ndarray, workers: int | None, turns: Turns | None = None
    ) -> OrbitProblem:
        """Return the problem of transversal modes; measure the unit of time of undriven motion from the first start.

        Shapes: strengths (m,), (m, layers), or (m, layers, size, size) of modes with `size` coordinates each; starts
        (starts, components).
        """
        scene = scene if scene.model.linked else _joined(scene, strengths)
        equations = without_drive(scene.equations, scene.parameters)
        if np.any(strengths):
            check_links_of_events(equations)
        layers, size = len(equations.layers), strengths.shape[-1] if strengths.ndim == 4 else 1
        if strengths.size != len(strengths) * layers * size**2 or (size > 1 and np.iscomplexobj(strengths)):
            names = scene.strengths
            raise ValueError(
                f"transversal modes: found {layers} layer{'s' * (layers > 1)} of links, so that a mode has as many strengths; expected "
                "one for each; exponents(scene, alpha) takes a column for each layer, or a matrix if they do not commute; "
                f"plane(scene, {', '.join(f'{name}=[…]' for name in names[:2])}) and critical(scene, {names[0]!r}, …) take parameters"
            )
        variation = _variation(equations, bool(np.iscomplexobj(strengths)), size)
        if strengths.ndim == 4:
            strengths = strengths.reshape(len(strengths), -1)
        columns = variation.size // (2 if np.iscomplexobj(strengths) else 1)
        problem = cls.of(scene, variation, _of_modes(scene, strengths), starts, columns, workers, turns)
        if turns or problem.forced or problem.linear:
            return problem
        first = problem.with_slip_states(starts[:1])
        return problem.with_turns(problem.observed_turns(first, np.zeros_like(problem.strengths[:1])), starts)

    def with_turns(self, turns: Turns, starts: np.ndarray) -> OrbitProblem:
        """Return the problem with another unit of time, and with the integrator for the pace of the motion."""
        return OrbitProblem.of(self.scene, self.variation, self.strengths, starts, self.columns, self.workers, turns)

    def observed_turns(
        self, states: np.ndarray, strengths: np.ndarray, rates: RateFunctions | None = None, hidden: int = 0
    ) -> Turns:
        """Measure the mean return time and the extent of an undriven motion.

        `hidden`: number of states at the end of the state that are no part of the motion and do not enter `rates`.
        """
        integrator = self.integrator(states, strengths)
        integrator.observes = True  # do not warn of short steps: the runs are too short
        return turns_of(integrator, rates or self.rates, hidden)

    @property
    def unit(self) -> float:
        """Unit of time: the period of the drive, or the mean return time of undriven motion."""
        return self.turns.time

    @property
    def extent(self) -> np.ndarray:
        """Extent of each component (p,) of the first orbit."""
        return self.turns.extent

    @property
    def rates(self) -> RateFunctions:
        """Rates of the state, at time 0."""
        return _rates(self.variation.orbit, tuple(self.parameter_values))

    @property
    def components(self) -> int:
        """State variables of one deviation, real or complex."""
        return self.variation.size // (2 if np.iscomplexobj(self.strengths) else 1)

    @property
    def parameter_values(self) -> np.ndarray:
        """Values (parameters,) of the parameters of the orbit."""
        return _parameter_values(self.scene, self.variation.orbit)

    @property
    def forced(self) -> bool:
        """True if a drive acts."""
        return self.variation.orbit.forced

    @property
    def lands(self) -> bool:
        """True if a deviation has two components, and a landing sets one of them to zero."""
        return (
            self.variation.events is not None
            and not self.variation.orbit.has_rows
            and self.variation.size == self.components == 2
        )

    @property
    def linear(self) -> bool:
        """True if no state occurs in the variational equation, which is then the same along every orbit."""
        states = {sp.Symbol(name, real=True) for name in self.variation.orbit.state}
        return not any(e.free_symbols & states for _, e in self.variation.matrix)

    def with_slip_states(self, starts: np.ndarray) -> np.ndarray:
        """Return starts (starts, components) with the slip states that follow from velocities and loads."""
        return with_modes(self.variation.orbit, starts, np.tile(self.parameter_values, (len(starts), 1)))

    def rests(self, state: np.ndarray, closed: float) -> bool:
        """Return whether an undriven orbit rests at a state; the speed of a held row is zero to rounding only."""
        noise = self.rates.rounding(state, self.unit) if self.variation.orbit.has_rows else 0.0
        return rests(self.rates, state, closed, self.extent, noise)

    def integrator(
        self, states: np.ndarray, strengths: np.ndarray | None = None, tolerance_ratio: float = 1.0
    ) -> VariationalIntegrator:
        """Return an integrator from states, with deviations of the problem's strengths, or of `strengths` (k,).

        `tolerance_ratio`: tolerance of the deviations relative to that of the orbits.
        """
        chosen = self.strengths if strengths is None else strengths.astype(self.strengths.dtype)
        rows = _rows(np.repeat(chosen, self.columns, axis=0))
        values = np.tile(self.parameter_values, (len(states), 1))
        integrator = VariationalIntegrator.make(
            self.scene, self.variation, states, values, rows, self.workers, tolerance_ratio, self.method
        )
        # a component that moves little needs an absolute tolerance below its extent
        moving = self.extent[self.extent > 0.0]
        least = integrator.control[Control.RTOL] * float(moving.min(initial=np.inf))
        integrator.control[Control.ATOL] = min(integrator.control[Control.ATOL], OF_EXTENT * least)
        integrator.slow = 2.0 * math.pi / self.unit
        return integrator

    def observed(self, state: np.ndarray) -> OrbitProblem:
        """Return the problem with the extent of the driven motion from this state (components,)."""
        if not self.forced:
            return self
        states = [state[None], *driven_states(self, state)]
        extent = above(extent_of(np.concatenate(states), states[-1]), self.rates.rounding(state, self.unit))
        return replace(self, turns=self.turns._replace(extent=extent))

    def settled(
        self, states: np.ndarray, periods: float, advanced: Callable[[float], object] | None = None
    ) -> tuple[OrbitProblem, np.ndarray]:
        """Run a transient of `periods` units of time.

        Return the problem with the measured extent, and the end states.
        """
        problem = self.observed(states[0])
        integrator = problem.integrator(states, self.strengths[:1])
        left = max(round(periods), 0)
        while left:
            length = min(left, TOGETHER)
            integrator.advance(length * problem.unit)
            if advanced is not None:
                advanced(length)
            left -= length
        return problem, integrator.state

    def unit_deviations(self, integrator: VariationalIntegrator) -> np.ndarray:
        """Return identity matrices (starts, size, deviations), one for each strength of an integrator."""
        basis = np.zeros((len(integrator.state), self.variation.size, len(integrator.order)))
        for k in range(self.components):
            basis[:, k, k :: self.components] = 1.0
        return basis

    def propagators(self, integrator: VariationalIntegrator, units: float) -> tuple[np.ndarray, np.ndarray]:
        """Advance an integrator by `units` units of time; return the propagators of its strengths.

        Shapes: returns propagators (starts, k, components, components), and the logarithms (starts, k) of the factors
        by which the propagators were divided.
        """
        starts, p = len(integrator.state), self.components
        integrator.set_deviations(self.unit_deviations(integrator))
        growth = integrator.advance(units * self.unit)
        largest = growth.reshape(starts, -1, p).max(axis=-1)
        logarithms = np.where((np.abs(largest) > FAR) & np.isfinite(largest), largest, 0.0)
        matrices = integrator.deviations * np.exp(growth - np.repeat(logarithms, p, axis=-1))[:, None, :]
        if self.variation.size != p:  # complex deviations: rows of real parts, then of imaginary parts
            matrices = matrices[:, :p] + 1j * matrices[:, p:]
        return np.asarray(matrices.reshape(starts, p, -1, p).transpose(0, 2, 1, 3)), logarithms


def driven_states(problem: OrbitProblem, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return states of a driven orbit in its next STROBES periods.

    Return the states at the beginning of each period, and LOOKS states within each period of the later half.
    """
    integrator, strobes = problem.integrator(state[None], problem.strengths[:1]), []
    for _ in range(STROBES):
        integrator.advance(problem.unit)
        strobes.append(integrator.state[0])
    return np.array(strobes), within(problem, np.array(strobes[STROBES // 2 :]))


def within(problem: OrbitProblem, states: np.ndarray, periods: int = 1) -> np.ndarray:
    """Return states (starts looks, components) of driven orbits, LOOKS within each of the next `periods` periods."""
    looks = LOOKS * min(periods, LOOKS)
    integrator = problem.integrator(np.tile(states, (looks, 1)), problem.strengths[:1])
    integrator.advance(problem.unit * np.repeat(np.arange(1, looks + 1), len(states)) / LOOKS)
    return integrator.state


def unit_of_time(scene: Scene) -> float:
    """Return the period of the drive in non-dimensional time; 2 pi without a drive."""
    drive = scene.drive
    if scene.forced and drive.frequency is None:
        raise ValueError(
            f"drive: the oscillator {scene.oscillator.name!r} {drive.problem}; expected one with a period; "
            "`run` integrates others with time_unit = 'time'"
        )
    return scene.period or 2.0 * math.pi


def pair_of(scene: Scene, **changes: Any) -> Scene:
    """Return a scene of two copies of a lone oscillator, with the same initial state."""
    start = {name: values[0] for name, values in scene.initial.items() if name not in scene.equations.modes}
    return scene.replace(topology=topology("chain", 2), initial=start, **changes)


def _joined(scene: Scene, strengths: np.ndarray) -> Scene:
    """Return a lone oscillator with a partner, joined by a link of strength 0.

    ValueError for a strength that is not 0.
    """
    first, second = (*scene.initial, *scene.initial)[:2]
    if not np.any(strengths):
        # with set-valued friction links must be forces
        return pair_of(scene, coupling=f"{first}->{second if scene.equations.sticks else first}")
    try:
        pair_of(scene)
    except ValueError as error:
        raise ValueError(f"transversal modes need a link to a partner: {error}; strength 0 needs none") from None
    raise ValueError(f"transversal modes: found no links in {scene!r}; expected a coupling and a topology")


def _rows(strengths: np.ndarray) -> np.ndarray:
    """Return real or complex strengths as real numbers (rows, modes), with one or two rows for each layer."""
    rows = strengths.reshape(len(strengths), -1).T
    return np.concatenate([rows.real, rows.imag]) if np.iscomplexobj(strengths) else rows


def _of_modes(scene: Scene, alpha: np.ndarray) -> np.ndarray:
    """Return the strengths alpha/(1 + b alpha) of modes of links with inertia b (`models.dynamics.mode_inertia`)."""
    _, share = inertia_of_modes(scene.equations)
    if share == 0:
        return alpha
    b = float(share.xreplace({sp.Symbol(name, real=True): value for name, value in scene.parameters.items()}))
    mass = 1.0 + b * alpha
    if not np.all(mass.real > 0.0):
        worst = alpha[mass.real.argmin()]
        raise ValueError(f"alpha = {worst}: the mass of this mode is not positive; expected strengths above {-1 / b:g}")
    return np.asarray(alpha / mass)


def _parameter_values(scene: Scene, orbit: Equations) -> np.ndarray:
    """Return the values (parameters,) of the parameters of an orbit; the phase of a shifted clock is 0."""
    values = {**scene.parameters, PHASE.name: 0.0}
    return np.array([values[name] for name in orbit.parameters])


@lru_cache(maxsize=16)
def _variation(equations: Equations, plane: bool, size: int) -> Variation:
    """Return the variational equation of a mode; cached, as every Newton step needs the equation."""
    return mode(equations, plane, size=size)


@lru_cache(maxsize=16)
def _rates(equations: Equations, values: tuple[float, ...]) -> RateFunctions:
    """Return the rate functions of equations; cached, as every Newton step on a limit cycle needs the rates."""
    return rates_of(equations, dict(zip(equations.parameters, values, strict=True)))
