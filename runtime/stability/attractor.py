"""Classify the motion of an orbit after its transient.

The motion is a fixed point, a periodic orbit locked to the drive, a limit cycle of an undriven oscillator, or
aperiodic.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
import sympy as sp
from scipy.linalg import orth

from .limit_cycle import limit_cycle
from .orbits import FAR, OrbitProblem, within

LONGEST = 32
"""Largest number of drive periods in a cycle for which the search looks (a choice)."""

ROUNDS = 3
"""Largest number of searches for a cycle. A further transient runs before each new search."""

RETURN = 1e-9
"""A cycle is closed if its end is nearer to its start than RETURN times the extent of the motion, in each component.
The limit is at least 0.1 rtol."""

CLOSE = 1e-3
"""A return may become a closed cycle if it ends nearer to its start than CLOSE times the extent of the motion (a
choice).
CLOSE times the extent is also the least motion of a component."""

TOLERANCE_RATIO = 10.0
"""Ratio of the tolerances of two integrations of one cycle; their difference estimates the error of the exponents."""

ALIKE = 1e-5
"""Two starts are on one attractor if their exponents differ by less than ALIKE times the rates of the linearised
equations."""


MULTIPLIER = 1e-3
"""Multipliers of one cycle differ by less than MULTIPLIER times the largest entry of the propagator; the square root of
an error of 1e-6, as multipliers depend on it where two of them meet."""


class Motion(StrEnum):
    """Kind of motion on an attractor.

    LINEAR: the equations are linear, so every motion, bounded or not, has the same exponents.
    UNBOUNDED: the orbit of a further start grew without bound; it has no exponents.
    """

    LINEAR = "linear"
    FIXED_POINT = "fixed point"
    PERIODIC = "periodic"
    APERIODIC = "aperiodic"
    UNBOUNDED = "unbounded"


@dataclass(frozen=True, slots=True)
class Attractor:
    """Motion of one start, with the propagators that give its exponents."""

    motion: Motion  # kind of the motion
    cycle: float  # length of one cycle in units of non-dimensional time; 0 if the motion is not a cycle
    # (3, m, p, p): propagators of all m modes over two successive cycles, and over the second one once more with
    # TOLERANCE_RATIO times the tolerance. For a fixed point and a constant linear motion, three times the matrix of
    # the variational equation. None for aperiodic motion
    propagators: np.ndarray | None = field(default=None, repr=False)
    periods: int = 1  # drive periods of one cycle; 1 without a drive
    # (3, m): logarithms of the factors by which the propagators of a cycle were divided
    logarithms: np.ndarray | float = field(default=0.0, repr=False)
    # (components,): a state of the orbit after the search, from which an average may begin
    state: np.ndarray | None = field(default=None, repr=False)

    @property
    def kind(self) -> str:
        """Name of the motion; a cycle of several drive periods is named with their number."""
        return str(self.motion) if self.periods == 1 else f"{self.motion}, {self.periods} drive periods"

    def exponents(self) -> tuple[np.ndarray, np.ndarray]:
        """Compute the exponents from the eigenvalues of the propagators. Shapes: returns values (m,), error (m,)."""
        if self.propagators is None:
            raise ValueError(f"{self.kind} motion has no eigenvalues to take exponents from")
        values = np.linalg.eigvals(self.propagators)
        if self.cycle == 0.0:
            exponents = values.real.max(axis=-1, initial=-np.inf)  # without any free direction, -inf
        else:
            with np.errstate(divide="ignore"):
                exponents = (np.log(np.abs(values).max(axis=-1)) + self.logarithms) / self.cycle
        with np.errstate(invalid="ignore"):
            apart = np.where(exponents == exponents[1], 0.0, np.abs(exponents - exponents[1]))
        return exponents[1], apart.max(axis=0)

    def same_multipliers(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Return where two rows of exponents (m,) have the same largest multiplier, to MULTIPLIER of a propagator."""
        if self.propagators is None or self.cycle == 0.0:
            return np.zeros(len(first), dtype=bool)
        shift = np.broadcast_to(self.logarithms, self.propagators.shape[:2])[1]
        with np.errstate(over="ignore", invalid="ignore"):
            apart = np.abs(np.exp(first * self.cycle - shift) - np.exp(second * self.cycle - shift))
        return np.asarray(apart <= MULTIPLIER * np.abs(self.propagators[1]).max(axis=(-2, -1)))

    def resolution(self) -> np.ndarray:
        """Return the largest difference (m,) of exponents of two starts on this attractor that end at other states."""
        _, error = self.exponents()
        if self.propagators is None or self.cycle:
            return error + ALIKE / self.cycle
        return error + ALIKE * np.abs(self.propagators[1]).max(axis=(-2, -1), initial=0.0)


def find_attractor(problem: OrbitProblem, state: np.ndarray, patience: float) -> Attractor:
    """Look for a fixed point or a cycle at a state (components,); `patience`: units of time before a new search."""
    if problem.linear:
        timed = any(e.has(sp.Symbol("t", real=True)) for _, e in problem.variation.matrix)
        return (_periodic if timed else _steady)(problem, state, Motion.LINEAR)
    closed = max(RETURN, 0.1 * problem.scene.rtol)
    if not problem.forced:
        if problem.rests(state, closed):
            return _steady(problem, state, Motion.FIXED_POINT)
        cycle = limit_cycle(problem, state, closed)
        if cycle is None:
            return Attractor(Motion.APERIODIC, 0.0, state=state)
        return _periodic(problem, cycle.state, Motion.PERIODIC, unit=cycle.period)
    integrator = problem.integrator(state[None], problem.strengths[:1])
    for _ in range(ROUNDS):
        # compare the last state with the states one, two … periods before
        states = [integrator.state[0]]
        for _ in range(LONGEST):
            integrator.advance(problem.unit)
            states.append(integrator.state[0])
        last = states[-1]
        gaps = np.abs(np.array(states[-2::-1]) - last)
        moves = np.maximum(np.ptp([*states, *within(problem, last[None])], axis=0), CLOSE * problem.extent)
        rounding = problem.rates.rounding(last, LONGEST * problem.unit)
        periods = next((k + 1 for k, gap in enumerate(gaps) if np.all(gap <= closed * moves + rounding)), 0)
        if periods:
            return _periodic(problem, last, Motion.PERIODIC, periods)
        if not np.any(np.all(gaps <= CLOSE * np.maximum(moves, problem.extent), axis=1)):
            break
        integrator.advance(max(1, round(patience)) * problem.unit)
    return Attractor(Motion.APERIODIC, 0.0, state=last)


def _periodic(
    problem: OrbitProblem, state: np.ndarray, motion: Motion, periods: int = 1, unit: float | None = None
) -> Attractor:
    """Return the attractor of a periodic orbit, whose variational equation repeats after `periods` times `unit`."""
    unit = problem.unit if unit is None else unit
    block = unit / problem.unit
    # two successive cycles differ if the transient is not over; a third run with looser steps shows the error of the
    # steps
    *first, settled = cycle_propagators(problem, state, periods, block)
    *second, _ = cycle_propagators(problem, settled, periods, block)
    *looser, _ = cycle_propagators(problem, settled, periods, block, TOLERANCE_RATIO)
    propagators, logarithms = (np.concatenate(parts) for parts in zip(first, second, looser, strict=True))
    return Attractor(motion, periods * unit, propagators, periods, logarithms, state)


def cycle_propagators(
    problem: OrbitProblem, state: np.ndarray, cycle: int, block: float = 1.0, tolerance_ratio: float = 1.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Integrate the propagators of all modes from a state (components,) over `cycle` blocks of time.

    `tolerance_ratio`: factor of the tolerances.
    Shapes: returns propagators (1, m, p, p), the logarithms (1, m) of the factors by which the propagators were
    divided, and the state at the end (components,).
    """
    integrator = problem.integrator(state[None])
    integrator.loosen(tolerance_ratio)
    total, logarithms = problem.propagators(integrator, block)
    for _ in range(cycle - 1):
        propagators, more = problem.propagators(integrator, block)
        total = propagators @ total
        # divide a product by its largest entry before it overflows or underflows
        size = np.abs(total).max(axis=(-2, -1))
        factor = np.where((size > math.exp(FAR)) | ((size < math.exp(-FAR)) & (size > 0.0)), size, 1.0)
        total, logarithms = total / factor[..., None, None], logarithms + more + np.log(factor)
    return total, logarithms, integrator.state[0]


def _steady(problem: OrbitProblem, state: np.ndarray, motion: Motion) -> Attractor:
    """Return the attractor of a constant variational equation; propagators are its matrices (m, p, p) at `state`."""
    variation, strengths = problem.variation, problem.strengths
    symbols = [sp.Symbol(name, real=True) for name in (*variation.orbit.state, *variation.orbit.parameters, "t")]
    values = [*state, *(problem.scene.parameters[name] for name in variation.orbit.parameters), 0.0]
    p, columns = problem.components, strengths.reshape(len(strengths), -1).T
    alphas = variation.parameters[: len(columns)]
    matrices = np.zeros((len(strengths), p, p), dtype=strengths.dtype)
    for (r, c), e in variation.matrix:
        if r < p and c < p:
            # each entry is linear in the strengths of the layers: find its coefficients from the unit strengths
            at = sp.lambdify([*symbols, *alphas], e, "numpy")
            base = at(*values, *np.zeros(len(alphas)))
            matrices[:, r, c] = base
            for unit, column in zip(np.eye(len(alphas)), columns, strict=True):
                matrices[:, r, c] += (at(*values, *unit) - base) * column
    if variation.events is not None and variation.events.jumps:
        # held rows: only deviations along their surfaces move, q of p directions
        at, deviations = dict(zip(symbols, values, strict=True)), variation.events.deviations[:p]
        along = [[sp.diff(e, d).xreplace(at) for d in deviations] for e in variation.events.jumps[-1][:p]]
        directions = orth(np.array(along, dtype=float))
        matrices = directions.T @ matrices @ directions
    return Attractor(motion, 0.0, np.stack([matrices] * 3), state=state)
