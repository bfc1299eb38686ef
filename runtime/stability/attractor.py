"""Classification of the motion that an orbit has settled on.

The motion is a fixed point, a periodic orbit locked to the drive, a limit cycle of an undriven oscillator, or none of these.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
import sympy as sp

from synchain.models.dynamics.variational import Variation

from .limit_cycle import limit_cycle
from .motion import rests
from .orbits import FAR, Orbits, within

LONGEST = 32
"""Longest cycle that is looked for, in periods of the drive."""

RETURN = 1e-9
"""Largest distance of a closed cycle in each component, relative to what it moves; at least 0.1 rtol."""

CLOSE = 1e-3
"""Largest distance of a state that returns, relative to the extent of the motion, and the least part of it that a component moves."""

SLACK = 10.0
"""How many times the tolerance a cycle is compared with."""

ALIKE = 1e-5
"""How far exponents of one attractor lie apart, relative to the rates of its linearised equations."""


class Motion(StrEnum):
    """Kind of motion on an attractor; of linear equations every motion, bounded or not, has the same exponents.

    An unbounded motion is that of a further start that left every bound; it has no exponents.
    """

    LINEAR = "linear"
    FIXED_POINT = "fixed point"
    PERIODIC = "periodic"
    APERIODIC = "aperiodic"
    UNBOUNDED = "unbounded"


@dataclass(frozen=True, slots=True)
class Attractor:
    """Motion of one start."""

    motion: Motion  # kind of the motion
    cycle: float  # length of one cycle in units of non-dimensional time; 0 if the motion is not a cycle
    # (3, m, p, p): propagators of all m modes over two successive cycles, and over the second one once more with
    # SLACK times the tolerance. For a fixed point and a constant linear motion, the matrix of the variational
    # equation as often. None for aperiodic motion
    propagators: np.ndarray | None = field(default=None, repr=False)
    periods: int = 1  # drive periods of one cycle; 1 without a drive
    # (3, m): logarithms of the factors that the propagators of a cycle are without
    logarithms: np.ndarray | float = field(default=0.0, repr=False)

    @property
    def kind(self) -> str:
        """The motion in words, with the drive periods of its cycle if there are several."""
        return str(self.motion) if self.periods == 1 else f"{self.motion}, {self.periods} drive periods"

    def exponents(self) -> tuple[np.ndarray, np.ndarray]:
        """Compute the exponents from the eigenvalues of the propagators. Shapes: returns values (m,), error (m,)."""
        if self.propagators is None:
            raise ValueError(f"{self.kind} motion has no eigenvalues to take exponents from")
        values = np.linalg.eigvals(self.propagators)
        if self.cycle == 0.0:
            exponents = values.real.max(axis=-1)
        else:
            with np.errstate(divide="ignore"):
                exponents = (np.log(np.abs(values).max(axis=-1)) + self.logarithms) / self.cycle
        with np.errstate(invalid="ignore"):
            apart = np.where(exponents == exponents[1], 0.0, np.abs(exponents - exponents[1]))
        return exponents[1], apart.max(axis=0)

    def resolution(self) -> np.ndarray:
        """Return how far apart the exponents (m,) of two starts on this attractor may lie: by their errors, and by where the starts end."""
        _, error = self.exponents()
        if self.propagators is None or self.cycle:
            return error + ALIKE / self.cycle
        return error + ALIKE * np.abs(self.propagators[1]).max(axis=(-2, -1))


def find_attractor(orbits: Orbits, row: int, patience: float) -> Attractor:
    """Look for a fixed point or a cycle of 1 … LONGEST drive periods."""
    orbit = orbits.part([row])
    if orbit.linear:
        timed = any(e.has(sp.Symbol("t", real=True)) for _, e in orbit.variation.matrix)
        return _periodic(orbit, Motion.LINEAR, 1) if timed else _steady(orbit, Motion.LINEAR)
    closed = max(RETURN, 0.1 * orbit.scene.rtol)
    if not orbit.forced:
        return _free(orbit, closed)
    integrator = orbit.integrator_of(orbit.strengths[:1])
    for _ in range(3):
        states = [integrator.state[0]]
        for _ in range(LONGEST):
            integrator.advance(orbit.unit)
            states.append(integrator.state[0])
        orbits.state[row] = orbit.state[0] = states[-1]
        gaps = np.abs(np.array(states[-2::-1]) - states[-1])
        moves = np.maximum(np.ptp([*states, *within(orbit)], axis=0), CLOSE * orbit.extent)
        rounding = orbit.rates.rounding(states[-1], LONGEST * orbit.unit)
        cycle = next((k + 1 for k, gap in enumerate(gaps) if np.all(gap <= closed * moves + rounding)), 0)
        if cycle:
            return _periodic(orbit, Motion.PERIODIC, cycle)
        if not np.any(np.all(gaps <= CLOSE * np.maximum(moves, orbit.extent), axis=1)):
            break
        integrator.advance(max(1, round(patience)) * orbit.unit)
    return Attractor(Motion.APERIODIC, 0.0)


def _periodic(orbit: Orbits, motion: Motion, cycle: int, unit: float | None = None) -> Attractor:
    """Return motion along which the variational equation repeats itself after some drive periods, or other units."""
    unit = orbit.unit if unit is None else unit
    block = unit / orbit.unit
    found = [cycle_propagators(orbit, cycle, block)]
    settled = orbit.state
    found += [cycle_propagators(orbit, cycle, block), cycle_propagators(orbit, cycle, block, settled, SLACK)]
    propagators, logarithms = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return Attractor(motion, cycle * unit, propagators, cycle, logarithms)


def cycle_propagators(
    orbit: Orbits, cycle: int, block: float = 1.0, state: np.ndarray | None = None, slack: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Integrate the propagators of all modes over one cycle.

    Shapes: state (1, components); returns propagators (1, m, p, p), logarithms (1, m).
    """
    orbit.state = orbit.state if state is None else state
    orbit.block, orbit.integrator = block, orbit.integrator_of(orbit.strengths, tolerance=slack)
    total, logarithms = orbit.propagators()
    for _ in range(cycle - 1):
        propagators, more = orbit.propagators()
        total = propagators @ total
        size = np.abs(total).max(axis=(-2, -1))
        factor = np.where((size > math.exp(FAR)) | ((size < math.exp(-FAR)) & (size > 0.0)), size, 1.0)
        total, logarithms = total / factor[..., None, None], logarithms + more + np.log(factor)
    orbit.state = orbit.integrator.state
    return total, logarithms


def _free(orbit: Orbits, closed: float) -> Attractor:
    """Return the fixed point or the limit cycle of an undriven orbit, else aperiodic motion."""
    if rests(orbit.rates, orbit.state[0], closed, orbit.extent):
        return _steady(orbit, Motion.FIXED_POINT)
    period = 0.0 if orbit.variation.events else limit_cycle(orbit, closed)[0]
    return _periodic(orbit, Motion.PERIODIC, 1, period) if period else Attractor(Motion.APERIODIC, 0.0)


def _steady(orbit: Orbits, motion: Motion) -> Attractor:
    """Return motion along which the variational equation is constant."""
    matrix = _matrix(orbit.variation, _symbols(orbit.variation), _values(orbit), orbit.strengths)
    return Attractor(motion, 0.0, np.stack([matrix] * 3))


def _symbols(variation: Variation) -> list[sp.Symbol]:
    """Symbols of states, parameters and time."""
    names = [*variation.orbit.state, *variation.orbit.parameters, "t"]
    return [sp.Symbol(name, real=True) for name in names]


def _values(orbit: Orbits) -> list[float]:
    """Values of `_symbols` at the orbit's state."""
    return [*orbit.state[0], *(orbit.scene.parameters[name] for name in orbit.variation.orbit.parameters), 0.0]


def _matrix(variation: Variation, symbols: list[sp.Symbol], values: list[float], strengths: np.ndarray) -> np.ndarray:
    """Evaluate the matrices (m, p, p) of the variational equation at a state, for each strength."""
    p, columns = len(variation.orbit.node.continuous), strengths.reshape(len(strengths), -1).T
    alphas = variation.parameters[: len(columns)]
    matrices = np.zeros((len(strengths), p, p), dtype=strengths.dtype)
    for (r, c), e in variation.matrix:
        if r < p and c < p:
            at = sp.lambdify([*symbols, *alphas], e, "numpy")
            base = at(*values, *np.zeros(len(alphas)))
            matrices[:, r, c] = base
            for unit, column in zip(np.eye(len(alphas)), columns, strict=True):
                matrices[:, r, c] += (at(*values, *unit) - base) * column
    return matrices
