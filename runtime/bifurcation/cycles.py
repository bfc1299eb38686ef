"""Periodic orbits as a problem that `arclength` solves and follows: multiple shooting.

The unknowns are the states x_1 … x_m at the beginning of m segments of equal time, the distances by which shifts have
moved, the period T if no drive prescribes it, and the parameter p.  The equations are flow(x_i, T/m) = x_(i+1), with the
whole turns of angles and the shifts added after the last segment, and conditions that fix phase and shifts.

* Segments.  More segments are taken where deviations grow by more than GROWTH in one.  With a drive each begins at a
  period of the drive.
* Drive.  If the parameter moves the drive's period, the column by p has the further term f dT/dp.
* Multipliers.  The flow direction f and the shifts are neutral.  They are removed from every segment before the product
  is formed, so that no other multiplier near 1 is disturbed: it stays smooth through folds and branch points.
* Clusters.  Nodes that move alike are one node of the quotient network.  The multipliers of the differences within
  clusters belong to the modes of the graph for complete synchronisation, else to the whole network.

Sources: Seydel, Practical Bifurcation and Stability Analysis, 3rd ed. (Springer, 2010), chapter 7; Kuznetsov, Elements of
Applied Bifurcation Theory, 3rd ed. (Springer, 2004), chapter 10.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
import sympy as sp
from scipy import linalg

from synchain.models.dynamics.angles import periods_of_states
from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.periodicity import angular_frequency
from synchain.models.dynamics.reduction import collapse, quotient, without_drive
from synchain.models.dynamics.synchrony import synchronous_node
from synchain.models.scenes.scene import Scene

from ..cells.run_keywords import with_numbers
from .arclength import Point
from .eigenvalues import eigenvalue_condition
from .equilibrium import Equilibrium, shifted_components
from .flow import TOLERANCE, Flow, Image, LiftedFlow, flow_of
from .kinds import BifurcationKind
from .periodic_result import PeriodicOrbit, sorted_by_size
from .problems import GrowthNumbers
from .products import null_vectors, product_eigenvalues
from .transversal import Transversal, expansion

GROWTH = 1e3  # largest growth of a deviation in a segment (a choice)
MOST_SEGMENTS = 64  # most segments of an undriven cycle (a choice)
LOOKS = 16  # states on the orbit from which the extents of the motion are measured (a choice)
RESCALED = 2.0  # the extents are measured again where the rates change by this factor (a choice)
# Integration error of an image that counts as zero, in units of the tolerance and the size of the motion (a choice).
NOISE = 0.3
ROUNDING = 1e-10  # error of the propagators, relative to the largest multiplier (a choice)
# Most steps of Newton's method at fixed parameters, and how far it may go in units of the motion (choices).
MOST_STEPS, ASTRAY = 30, 1e4
# Cycles whose amplitude, or whose two halves' difference, is below this part of the motion are born there: the place
# of birth is located to the square root of rounding (a choice).
BORN = 1e-3
# A gap, in units of the motion, from which Newton's method must reduce it in every step under friction (a choice).
NEAR = 1e-3
ORIGIN = 1e-6  # size of an equilibrium, relative to the start of its scene, that counts as zero (a choice)
RIGID = 1e-6  # part of the rates across the shifts below which a motion is a rigid rotation (a choice)
# Singular values of a matrix of Newton's method that count as zero, relative to the largest: a conservative motion is
# one of a family, to within the errors of the integration (a choice).
SINGULAR = 1e-9
CLOSE = 1e-9  # a gap, in units of the motion, at which a step of Newton's method is not halved (a choice)
# Smallest part of a step of Newton's method that is tried where the whole does not reduce the gap (a choice).
SMALLEST_SHARE = 1.0 / 64.0
REAL = 1e-7  # multipliers with a smaller imaginary part, relative to their modulus, count as real


@dataclass(slots=True)
class Cycles:
    """Periodic orbits of a network, or of its quotient by clusters; the last unknowns are the parameters `names`."""

    scene: Scene  # the network
    names: tuple[str, ...]
    classes: tuple[int, ...]  # the cluster of each node
    flow: Flow  # of the quotient
    periods: int  # drive periods of an orbit; 0 without a drive
    turns: np.ndarray  # (n,): what is added to each state in a period, whole turns of angles
    shifts: np.ndarray  # (n, k): directions in which all rates are the same
    point: np.ndarray
    scale: np.ndarray  # (n,): extent of each state
    spans: np.ndarray  # (q,): the unit of each parameter
    phase: np.ndarray  # (m, n): the direction of the motion at the reference; the unknowns move across it
    slopes: Sequence[
        Callable[[Mapping[str, float]], float] | None
    ]  # (q,): derivatives of the logarithm of the drive's frequency
    transversal: Transversal | None = None
    begin: float = 0.0  # time of the drive at which the first segment begins, between events
    shift_names: tuple[str, ...] = ()
    speed: float = math.nan  # size of the rates where the extents were measured
    last: tuple[bytes, Image, np.ndarray] | None = field(default=None, repr=False)

    @classmethod
    def of(cls, orbit: PeriodicOrbit, *names: str, begin: float = 0.0) -> Cycles:
        """Return the problem of a periodic orbit along parameters; `begin`: where the first segment begins."""
        count = len(set(orbit.classes))
        copies = expansion(orbit.scene.equations, orbit.classes, len(orbit.state) * count // orbit.scene.n)
        state = copies.T @ orbit.state / copies.sum(axis=0)
        if begin:
            flow = flow_of(orbit.scene, quotient_of(orbit.scene, orbit.classes, ()), (), state)
            state = flow.advance(orbit.scene.parameters, state[None], np.full(1, begin))[0]
        return cls.near(
            orbit.scene, names, orbit.classes, state[None], orbit.period, 0 if orbit.free else orbit.periods, begin
        )

    @classmethod
    def near(
        cls,
        scene: Scene,
        names: Sequence[str],
        classes: Sequence[int],
        states: np.ndarray,
        period: float,
        drive_periods: int,
        begin: float = 0.0,
    ) -> Cycles:
        """Return the problem near an orbit of a network. Shapes: states (m, n) of the quotient, period of the whole orbit."""
        equations = quotient_of(scene, classes, names)
        flow = flow_of(scene, equations, names, states[0], begin)
        size, values = flow.size, scene.parameters
        numbers = [values[name] for name in names]
        point = np.concatenate([states.ravel(), [] if drive_periods else [period], numbers])
        spans = np.array([abs(number) or 1.0 for number in numbers])
        slopes = [_frequency_slope(equations, name) if drive_periods else None for name in names]
        problem = cls(
            scene, tuple(names), tuple(classes), flow, drive_periods, np.zeros(size), np.zeros((size, 0)), point,
            np.ones(size), spans, np.zeros_like(states), slopes, Transversal.of(scene, tuple(classes)), begin,
        )  # fmt: skip
        distances = problem._find_turns_and_shifts(states, period)
        problem.point = point = np.insert(point, states.size, distances)
        problem._rescale(point)
        problem._refer(point, flow.rates(values, states))
        return problem

    @classmethod
    def at_hopf(cls, rest: Equilibrium, name: str, vector: np.ndarray, frequency: float) -> tuple[Cycles, np.ndarray]:
        """Return the cycles born at a Hopf point, and their first direction (n,). Shapes: vector (states,) complex."""
        classes = classes_of(rest.scene, np.stack([rest.state, vector.real, vector.imag]))
        copies = expansion(rest.scene.equations, classes, len(vector) * len(set(classes)) // rest.scene.n)
        rows = (rest.state, np.array(rest.scene.y0), vector)
        state, first, wave = ((copies.T @ each) / copies.sum(axis=0) for each in rows)
        problem = cls.near(rest.scene, (name,), classes, state[None], 2.0 * math.pi / frequency, 0)
        units = problem._balance(state)
        size, begun = (float(np.abs(each / units).max()) for each in (state, first))
        if size <= ORIGIN * begun:  # the origin to rounding, which gives no unit
            size = begun
        extents = np.abs(wave / units)
        problem.scale = units * (size or 1.0) * np.maximum(extents / extents.max(), 1e-3)
        # Real and imaginary part of the eigenvector are orthogonal; the phase of the cycle is fixed across the second.
        wave = wave / problem.scale
        wave *= np.exp(-0.5j * np.angle(np.sum(wave**2)))
        problem.phase = (-wave.imag / np.linalg.norm(wave.imag))[None]
        problem.speed = 0.0
        return problem, problem.scale * wave.real

    @classmethod
    def leaving(
        cls, orbit: PeriodicOrbit, name: str, vector: np.ndarray, known: np.ndarray, factor: int
    ) -> tuple[Cycles, np.ndarray, np.ndarray]:
        """Return the problem of the branch that leaves an orbit along a vector (states,), and that vector on the quotient.

        `known` (states,), the change of the states along the known branch, is returned on the quotient too.  `factor` is
        the number of periods in a period of the new branch: 2 at a period doubling.
        """
        classes = classes_of(orbit.scene, np.stack([orbit.state, vector]))
        copies = expansion(orbit.scene.equations, classes, len(vector) * len(set(classes)) // orbit.scene.n)
        rows = (orbit.state, np.broadcast_to(orbit.extent, len(vector)), vector, known)
        state, extent, *along = ((copies.T @ each) / copies.sum(axis=0) for each in rows)
        drive_periods = 0 if orbit.free else orbit.periods * factor
        states = np.tile(state, (factor, 1))
        problem = cls.near(orbit.scene, (name,), classes, states, orbit.period * factor, drive_periods)
        problem.scale = np.maximum(problem.scale, extent)  # the orbit may vanish there
        problem._refer(problem.point, problem.flow.rates(problem.values(problem.point), problem.states(problem.point)))
        return problem, along[0], along[1]

    def start(self, direction: np.ndarray) -> Point:
        """Return the reference with a tangent along a direction (n,) of the first state; that of others follows the flow."""
        tangent, moved = np.zeros(len(self.point)), direction
        image, _ = self._image(self.point)
        for i in range(self.segments):
            tangent[i * len(direction) : (i + 1) * len(direction)] = moved
            moved = image.propagators[i] @ moved
        return Point(self.point, self._at_phase(tangent), 0)

    # --- unknowns ---
    @property
    def segments(self) -> int:
        """Number of segments."""
        return len(self.phase)

    @property
    def kinked(self) -> bool:
        """True with set-valued friction: the states have a kink where the beginning passes from stick to slip."""
        return self.flow.equations.sticks

    @property
    def weights(self) -> np.ndarray:
        """Lengths: root mean squares of states in units of their extents, logarithms of periods, parameters by their span."""
        m, n = self.phase.shape
        states = np.tile(1.0 / (self.scale * math.sqrt(m * n)), m)
        shifts = np.full(self.shifts.shape[1], 1.0 / float(self.scale.max()))
        period = [] if self.periods else [1.0 / self.point[-1 - len(self.names)]]
        return np.concatenate([states, shifts, period, 1.0 / self.spans])

    def set_ranges(self, ranges: np.ndarray) -> None:
        """Measure parameters by the lengths of their ranges; one without bounds, inf, by its value."""
        self.spans = np.where(np.isfinite(ranges), ranges, self.spans)

    def states(self, z: np.ndarray) -> np.ndarray:
        """Return the states (m, n) at the beginning of the segments."""
        return z[: self.phase.size].reshape(self.phase.shape)

    def at_drive(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the states (m, n) where periods of the drive begin, and the propagators (m, n, n) to them."""
        states, (m, n) = self.states(z), self.phase.shape
        if not self.begin:
            return states, np.tile(np.eye(n), (m, 1, 1))
        left = np.full(m, self.period(z) - self.begin)
        return self.flow.linearise(self.values(z), states, left, self.scale)[:2]

    def values(self, z: np.ndarray) -> dict[str, float]:
        """Return the parameters at a solution."""
        return {
            **self.scene.parameters,
            **dict(zip(self.names, map(float, z[len(z) - len(self.names) :]), strict=True)),
        }

    def period(self, z: np.ndarray) -> float:
        """Return the period at a solution."""
        if self.periods:
            return self.periods * self.flow.drive_period(self.values(z))
        return float(z[-1 - len(self.names)])

    def period_slopes(self, values: Mapping[str, float]) -> np.ndarray:
        """Return the derivatives (q,) of the drive's period by the parameters; 0 without a drive."""
        shares = [0.0 if slope is None else -slope(values) for slope in self.slopes]
        return (
            self.periods * self.flow.drive_period(values) * np.array(shares) if any(shares) else np.zeros(len(shares))
        )

    # --- equations ---
    def linearise(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the gaps of all segments and the conditions, with their derivatives."""
        (m, n), shifts = self.phase.shape, self.shifts.shape[1]
        image, rates = self._image(z)
        states, slopes, tail = self.states(z), self.period_slopes(self.values(z)), len(z) - len(self.names)
        residual, matrix = np.zeros(tail), np.zeros((tail, len(z)))
        for i in range(m):
            rows, following = slice(i * n, i * n + n), (i + 1) % m
            residual[rows] = image.states[i] - states[following]
            matrix[rows, rows] += image.propagators[i]
            matrix[rows, following * n : following * n + n] -= np.eye(n)
            matrix[rows, tail:] = image.columns[i] + np.outer(rates[i], slopes / m)
            if not self.periods:
                matrix[rows, m * n + shifts] = rates[i] / m
        residual[m * n - n : m * n] -= self.turns + self.shifts @ z[m * n : m * n + shifts]
        matrix[m * n - n : m * n, m * n : m * n + shifts] = -self.shifts
        # The conditions: across the motion, and across each shift at the first state.
        away = (states - self.states(self.point)) / self.scale
        for k, direction in enumerate(self.shifts.T):
            residual[m * n + k] = direction @ away[0]
            matrix[m * n + k, :n] = direction / self.scale
        if not self.periods:
            residual[-1] = float(np.sum(self.phase * away))
            matrix[-1, : m * n] = (self.phase / self.scale).ravel()
        return residual, matrix

    def _image(self, z: np.ndarray) -> tuple[Image, np.ndarray]:
        """Integrate all segments: the images and the rates at their ends; the last call is kept."""
        key = z.tobytes()
        if self.last is None or self.last[0] != key:
            period, m = self.period(z), self.segments
            if not (math.isfinite(period) and period > 0.0 and np.isfinite(z).all()):
                raise ArithmeticError(f"a cycle has the period {period:.6g}")
            values = self.values(z)
            image = self.flow.linearise(values, self.states(z), np.full(m, period / m), self.scale)
            if not (np.isfinite(image.states).all() and np.isfinite(image.propagators).all()):
                raise ArithmeticError("the motion leaves all bounds")
            self.last = key, image, self.flow.rates(values, image.states)
        return self.last[1:]

    def noise(self, z: np.ndarray) -> np.ndarray:
        """Return what the integration leaves: its tolerance times the size of the motion."""
        states, tail = self.states(z), len(z) - len(self.names) - self.phase.size
        sizes = NOISE * TOLERANCE * (np.abs(states) + 0.1 * self.scale)
        return np.concatenate([sizes.ravel(), np.full(tail, TOLERANCE)])

    def accept(self, z: np.ndarray, tangent: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Make a solution the reference; divide the segments if deviations grow by too much."""
        image, _ = self._image(z)
        grown = max(np.linalg.norm(M * self.scale / self.scale[:, None], 2) for M in image.propagators)
        factor = self._finer() if grown > GROWTH else 1
        if factor > 1:
            z, tangent = self._divided(z, tangent, factor)
        rates = self.flow.rates(self.values(z), self.states(z))
        speed = float(np.linalg.norm(rates[0] / self.scale))
        if not self.speed / RESCALED < speed < self.speed * RESCALED:
            self._rescale(z)
        self._refer(z, rates)
        return z, self._at_phase(tangent)

    def _at_phase(self, tangent: np.ndarray) -> np.ndarray:
        """Return a tangent of length 1 without its motion along the cycle, which is no change of the cycle."""
        if not self.periods:
            rates, count = self.flow.rates(self.values(self.point), self.states(self.point)), self.phase.size
            size = float(np.linalg.norm(rates / self.scale))
            ahead = tangent[:count].reshape(self.phase.shape)
            share = float(np.sum(self.phase * ahead / self.scale)) / size if size > 0.0 else 0.0
            tangent = np.append(ahead - share * rates, tangent[count:])
        return tangent / float(np.linalg.norm(self.weights * tangent))

    def _finer(self) -> int:
        """Return the factor of the next finer division; with a drive a segment has whole periods of the drive."""
        if not self.periods:
            return 2 if 2 * self.segments <= MOST_SEGMENTS else 1
        return next((k for k in range(2, self.periods + 1) if self.periods % (k * self.segments) == 0), 1)

    def _divided(self, z: np.ndarray, tangent: np.ndarray, factor: int) -> tuple[np.ndarray, np.ndarray]:
        """Divide each segment into `factor`; the tangent at the new states follows the flow."""
        states, ahead, m = [self.states(z)], [self.states(tangent)], self.segments
        values, part = self.values(z), self.period(z) / (m * factor)
        by = tangent[len(z) - len(self.names) :]
        along = float(self.period_slopes(values) @ by) if self.periods else tangent[-1 - len(by)]
        for _ in range(factor - 1):
            image = self.flow.linearise(values, states[-1], np.full(m, part), self.scale)
            rates = self.flow.rates(values, image.states)
            moved = np.einsum("mij,mj->mi", image.propagators, ahead[-1])
            moved += image.columns @ by + rates * along / (m * factor)
            states.append(image.states)
            ahead.append(moved)
        parts = [np.stack(each, axis=1).ravel() for each in (states, ahead)]
        tail = self.phase.size
        self.phase = np.zeros((m * factor, self.phase.shape[1]))
        return np.append(parts[0], z[tail:]), np.append(parts[1], tangent[tail:])

    def _refer(self, z: np.ndarray, rates: np.ndarray) -> None:
        """Make a solution with rates (m, n) of its states the reference of the conditions."""
        self.point, rates = z, rates / self.scale
        self.phase = rates / (float(np.linalg.norm(rates)) or 1.0)

    def orbit_states(self, z: np.ndarray, looks: int = LOOKS) -> np.ndarray:
        """Return states (m * looks, n) at equal times on the orbit."""
        states, m = self.states(z), self.segments
        if looks == 1:
            return states
        times = np.arange(looks) * self.period(z) / (m * looks)
        moved = self.flow.advance(self.values(z), np.repeat(states, looks - 1, axis=0), np.tile(times[1:], m))
        return np.concatenate([states[:, None], moved.reshape(m, looks - 1, -1)], axis=1).reshape(m * looks, -1)

    def _rescale(self, z: np.ndarray) -> None:
        """Measure the extents of the motion; a state at rest gets its size, or the largest extent."""
        states = self.orbit_states(z)
        extent, size = np.ptp(states, axis=0), np.abs(states).max(axis=0)
        largest = float(extent.max()) or 1.0
        still = extent < 1e-9 * np.maximum(size, largest)
        scale = np.where(still, np.where(size > 0.0, np.minimum(size, largest), largest), extent)
        # Scales never shrink: a cycle that vanishes does so in a finite number of steps.
        self.scale = scale if math.isnan(self.speed) else np.maximum(self.scale, scale)
        self.last = None
        self.speed = float(np.linalg.norm(self.flow.rates(self.values(z), self.states(z)[:1])[0] / self.scale))

    def _balance(self, state: np.ndarray) -> np.ndarray:
        """Return a unit of each state, in which the states that drive each other change alike (Osborne, J. ACM 7, 338)."""
        assert isinstance(self.flow, LiftedFlow)  # equilibria have smooth rates
        network, *_ = self.flow.at(self.scene.parameters)
        jacobian, mass = network.jacobian(state).toarray(), network.mass(state)
        if mass is not None:
            jacobian = linalg.solve(mass.toarray(), jacobian)
        return np.asarray(linalg.matrix_balance(jacobian, permute=False, separate=True)[1][0])

    def _find_turns_and_shifts(self, states: np.ndarray, period: float) -> np.ndarray:
        """Find the shifts and the whole turns of angles in a period; return the distances that the shifts move."""
        flow, equations, values = self.flow, self.flow.equations, self.scene.parameters
        angles = periods_of_states(equations)[: flow.size]
        if not self.periods and isinstance(flow, LiftedFlow) and equations.n > 1 and flow.network.constant_mass:
            names, shifts = shifted_components(equations, flow.network.at(values), states[0])
            # A rigid rotation moves along its shifts alone: their conditions would repeat that of the phase.
            rates = flow.rates(values, states[:1])[0]
            across = rates - shifts @ (shifts.T @ rates / np.maximum(shifts.sum(axis=0), 1.0))
            if np.abs(across).max() > RIGID * np.abs(rates).max():
                self.shift_names, self.shifts = names, shifts
        if not any(angles) and not self.shifts.size:
            return np.zeros(0)
        gaps = flow.advance(values, states[-1:], np.full(1, period / len(states)))[0] - states[0]
        distances = gaps[self.shifts.argmax(axis=0)] if self.shifts.size else np.zeros(0)
        gaps -= self.shifts @ distances
        self.turns = np.array([0.0 if a is None else a * round(gap / a) for a, gap in zip(angles, gaps, strict=True)])
        return distances

    def solved(self) -> tuple[np.ndarray, float, int]:
        """Solve by Newton's method with the parameters fixed: the best point, its largest gap and the number of steps.

        A step that does not reduce the gap is halved; set-valued friction takes full steps, as its gap has kinks.
        Where the matrix is singular, as of conservative motions, the step of least length is taken.
        """
        q, n = len(self.names), self.phase.shape[1]
        z, best, steps, share = self.point, math.inf, 0, 1.0
        nearest, left, weights = z, math.inf, self.weights[: len(z) - q]
        step, sticks = np.zeros(len(weights)), self.flow.equations.sticks
        sizes = np.append(np.tile(self.scale, self.segments), np.ones(len(weights) - self.phase.size))
        while steps < MOST_STEPS:
            try:
                residual, matrix = self.linearise(z)
                size = float(np.abs(residual / sizes).max())
            except ArithmeticError:
                if math.isinf(left):
                    raise
                size = math.inf
            if not size < (10.0 * best if sticks and best > NEAR else best):
                # A small gap that no longer falls is that of the integration; a large one is left by too long a step.
                share *= 0.5
                if sticks or best < CLOSE or share < SMALLEST_SHARE:
                    break
                z = np.append(nearest[: len(weights)] + share * step, z[len(weights) :])
                continue
            if size < best:
                nearest, best, left = z, size, float(np.abs(residual[: self.phase.size]).max())
            image, share = self._image(z)[0], 1.0
            if left == 0.0:
                break
            if sticks and np.array_equal(image.propagators[0], np.diag([1.0, 0.0] if n == 2 else [0.0] * n)):
                # The ground carries the body along: follow the motion until the body slips.
                z, best = np.append(image.states[0], z[n:]), math.inf
            else:
                scaled = matrix[:, : len(weights)] / weights / sizes[:, None]
                step = linalg.lstsq(scaled, -residual / sizes, cond=SINGULAR)[0] / weights
                z = np.append(z[: len(weights)] + step, z[len(weights) :])
            steps += 1
            if not np.linalg.norm(self.weights * (z - self.point)) < ASTRAY:
                break
        return nearest, left, steps

    def solution(self, point: Point) -> PeriodicOrbit:
        """Return the periodic orbit at a solution."""
        z = point.z
        critical = self.critical(z) if point.critical is None else point.critical
        image, rates = self._image(z)
        values, state = self.values(z), self.at_drive(z)[0][0]
        along = critical.blocks < 0
        neutral = np.ones(self.shifts.shape[1])
        if not self.periods:
            # The multiplier of the motion itself, as the integration finds it.
            moved = rates[-1]
            for propagator in image.propagators:
                moved = propagator @ moved
            scaled = rates[-1] / self.scale
            size = float(scaled @ scaled)  # 0 at the equilibrium where cycles are born
            neutral = np.append(neutral, scaled @ (moved / self.scale) / size if size > 0.0 else 1.0)
        multipliers = np.concatenate([critical.values[along], neutral])
        gaps = image.states - np.roll(self.states(z), -1, axis=0)
        gaps[-1] -= self.turns + self.shifts @ z[self.phase.size : self.phase.size + self.shifts.shape[1]]
        copies = expansion(self.scene.equations, self.classes, len(state))
        order = np.argsort(critical.blocks[~along], kind="stable")
        changed = {name: values[name] for name in self.names if values[name] != self.scene.parameters[name]}
        return PeriodicOrbit(
            with_numbers(self.scene, changed), self.periods or 1, copies @ state, sorted_by_size(multipliers),
            float(np.abs(gaps).max()), point.corrections, 0.0 if self.periods else self.period(z), copies @ self.scale, self.classes,
            critical.values[~along][order], critical.blocks[~along][order],
            () if self.transversal is None else self.transversal.labels,
            "synchronous" if len(self.classes) > 1 and len(set(self.classes)) == 1 else "",
            self.shift_names,
            z[self.phase.size : self.phase.size + self.shifts.shape[1]] / self.period(z),
        )  # fmt: skip

    # --- stability ---
    def critical(self, z: np.ndarray) -> GrowthNumbers:
        """Return all multipliers but those of the motion itself and of the shifts."""
        values = self.multipliers(z)
        blocks = np.full(len(values), -1)
        if self.transversal is not None:
            across, of = self.transversal.multipliers(self.values(z), self.at_drive(z)[0], self.period(z), self.scale)
            values, blocks = np.concatenate([values, across]), np.concatenate([blocks, of])

        def condition(indices: np.ndarray) -> np.ndarray:
            """Return the condition of multipliers along the quotient; those across it belong to small blocks."""
            matrices = self._reduced(z)[0]
            product = np.linalg.multi_dot([np.eye(matrices.shape[1]), *matrices[::-1], np.eye(matrices.shape[1])])
            sizes = np.full(product.shape, np.abs(product).max())
            return np.where(blocks[indices] < 0, eigenvalue_condition(product, values[indices], sizes), 0.0)

        return GrowthNumbers.of(np.abs(values) - 1.0, values, blocks, ROUNDING, condition)

    def multipliers(self, z: np.ndarray) -> np.ndarray:
        """Return the multipliers along the quotient, without those of the motion itself and of the shifts."""
        return product_eigenvalues(self._reduced(z)[0])

    def _reduced(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the propagators without the neutral directions, and the bases (m, n, k) of what is left, in scaled states."""
        image, rates = self._image(z)
        neutral = np.repeat(self.shifts[None] / self.scale[:, None], self.segments, axis=0)
        if not self.periods:
            here = np.roll(rates, 1, axis=0) / self.scale  # rates at the beginning of each segment
            neutral = np.concatenate([here[:, :, None], neutral], axis=2)
        scaled = image.propagators * self.scale / self.scale[:, None]
        if not neutral.shape[2]:
            return scaled, np.tile(np.eye(len(self.scale)), (self.segments, 1, 1))
        bases = np.array([linalg.qr(each)[0][:, each.shape[1] :] for each in neutral])
        return np.roll(bases, -1, axis=0).transpose(0, 2, 1) @ scaled @ bases, bases

    def vectors(self, z: np.ndarray, value: complex, count: int, block: int = -1) -> np.ndarray:
        """Return directions (states, count) of the network that a period multiplies by `value`, orthonormal.

        `block` is that of the multiplier in `critical`.
        """
        if block >= 0 and self.transversal is not None:
            return self.transversal.vectors(self.values(z), self.at_drive(z)[0], self.period(z), value, count)
        matrices, bases = self._reduced(z)
        small = null_vectors(matrices, value, count)
        vectors = self.at_drive(z)[1][0] @ (self.scale[:, None] * (bases[0] @ small))
        return np.linalg.qr(expansion(self.scene.equations, self.classes, len(self.scale)) @ vectors)[0]

    def network_states(self, z: np.ndarray) -> np.ndarray:
        """Return the states of the network at the beginning of a point, tangent or row of states of the quotient."""
        size = len(self.scale)
        return np.asarray(expansion(self.scene.equations, self.classes, size) @ z[:size])

    def network_tangent(self, point: Point) -> np.ndarray:
        """Return the change of the states of the network where periods of the drive begin, and of the parameters."""
        q = len(self.names)
        moved, by = self.states(point.tangent)[:1], point.tangent[len(point.tangent) - q :]
        if self.begin:
            values, left = self.values(point.z), np.full(1, self.period(point.z) - self.begin)
            image = self.flow.linearise(values, self.states(point.z)[:1], left, self.scale)
            moved = image.propagators @ moved[0] + image.columns @ by
            if any(slopes := self.period_slopes(values)):
                flow = flow_of(self.scene, self.flow.equations, self.names, image.states[0])
                moved += flow.rates(values, image.states) * float(slopes @ by)
        return np.append(self.network_states(moved[0]), by)

    def mode(self, block: int) -> str:
        """Describe a mode of the graph; empty if a multiplier belongs to none."""
        return "" if self.transversal is None or block < 0 else self.transversal.text(block)

    def birth(self, z: np.ndarray) -> BifurcationKind | None:
        """Return the bifurcation in which the cycles are born, if a branch point is one; None else."""
        away = np.abs(self.flow.rates(self.values(z), self.states(z)) / self.scale).max() * self.period(z)
        # A circle of radius r has the speed 2 pi r / T; half a period later, its states differ by at most 2 r.
        if not self.periods and away < 2.0 * np.pi * BORN:
            return BifurcationKind.HOPF
        # After half the time the motion is where it began: a cycle of half the period doubles it here.
        if self.periods % 2 or (self.segments > 1 and self.segments % 2):
            return None
        if self.segments > 1:
            half = self.states(z)[self.segments // 2]
        else:
            half = self.flow.advance(self.values(z), self.states(z), np.full(1, 0.5 * self.period(z)))[0]
        gap = np.abs(half - self.states(z)[0] - 0.5 * self.turns)
        return BifurcationKind.PERIOD_DOUBLING if np.all(gap <= BORN * self.scale) else None

    def kind(self, value: complex, turned: bool) -> BifurcationKind:
        """Name the bifurcation at which a multiplier passes the unit circle."""
        if abs(value.imag) > REAL * abs(value):
            return BifurcationKind.TORUS
        if value.real < 0.0:
            return BifurcationKind.PERIOD_DOUBLING
        return BifurcationKind.FOLD if turned else BifurcationKind.BRANCH_POINT


def quotient_of(scene: Scene, classes: Sequence[int], names: Sequence[str]) -> Equations:
    """Return the equations of the clusters: of the whole network, or of a single node if all move alike."""
    fixed = {name: value for name, value in scene.parameters.items() if name not in names}
    equations = without_drive(scene.equations, {**dict.fromkeys(names, 1.0), **fixed})
    if len(set(classes)) == equations.n:
        return equations
    if len(set(classes)) == 1:
        return Equations.of_equal_nodes(synchronous_node(equations), None, 1)
    return collapse(equations, classes)


@lru_cache(maxsize=32)
def _frequency_slope(equations: Equations, name: str) -> Callable[[Mapping[str, float]], float] | None:
    """Return the derivative of the logarithm of the drive's frequency by a parameter; None if it does not enter."""
    frequency, symbol = angular_frequency(equations), sp.Symbol(name, real=True)
    if frequency is None or not frequency.has(symbol):
        return None
    # Frequencies with a common divisor are proportional to each other: the first of them decides.
    first = frequency.replace(lambda e: e.func.__name__ == "common", lambda e: e.args[0])
    slope = sp.simplify(first.diff(symbol) / first)
    symbols = sorted(slope.free_symbols, key=str)
    function = sp.lambdify(symbols, slope, "numpy")
    return lambda values: float(function(*(values[s.name] for s in symbols)))


def classes_of(scene: Scene, rows: np.ndarray) -> tuple[int, ...]:
    """Return the clusters of nodes whose states agree in all rows (k, states) and that symmetry keeps alike."""
    equations, alone = scene.equations, tuple(range(scene.n))
    if scene.n == 1 or equations.mixed or equations.differing:
        return alone
    scale = np.abs(rows).max(axis=1, keepdims=True)
    table = np.round(rows / np.where(scale > 0.0, scale, 1.0), 7).reshape(len(rows), -1, scene.n) + 0.0
    colours = [tuple(table[:, :, i].ravel().tolist()) for i in range(scene.n)]
    try:
        classes = quotient(equations, colours)[1]
        quotient_of(scene, classes, ())
    except ValueError:
        return alone
    return classes
