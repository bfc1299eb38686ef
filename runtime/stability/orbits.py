"""Synchronous orbits with all their modes: settled on an attractor, then advanced block by block."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.mode_inertia import inertia_of_modes
from synchain.models.dynamics.variational import Variation, mode
from synchain.models.scenes.scene import Scene

from ..cells.initial_modes import with_modes
from .carrier import Carrier
from .interpolation import Interpolation, exact, interpolation

__all__ = ["Orbits", "unit_of_time"]

NODES, PARTS = (14, 20, 28, 40, 60), (1, 2, 4, 8, 16)
"""Nodes of a panel of strengths, and panels a side, that are tried."""

LOOSENESS = 10.0
"""Times the tolerance that modes are allowed where their growth is averaged: it moves exponents by less than rtol."""


@dataclass(slots=True)
class Orbits:
    """Orbits from several starts and the modes of `strengths` (m,) along them.

    strengths: those of the variational equation, alpha + i beta unless links have inertia; state (starts, components);
    unit: the period of the drive, or 2 pi; block: how many of them are advanced at once;
    deviations (starts, m, components), at unit length.
    """

    scene: Scene
    variation: Variation
    strengths: np.ndarray
    state: np.ndarray
    workers: int | None
    unit: float
    block: float = 1.0
    chosen: Interpolation | None = None
    carrier: Carrier | None = None
    deviations: np.ndarray | None = None
    interpolation_error: float = 0.0

    @classmethod
    def make(cls, scene: Scene, strengths: np.ndarray, state: np.ndarray, workers: int | None) -> Orbits:
        """Orbits at the start of their transient, `strengths` alpha + i beta of their modes.

        Raises ValueError where time enters without a known period, and for a strength at which a mode has no mass.
        """
        variation = _variation(scene.equations, bool(np.iscomplexobj(strengths)))
        unit = unit_of_time(scene)
        row = np.array([[scene.parameters[name] for name in variation.orbit.parameters]])
        state = with_modes(variation.orbit, state, np.repeat(row, len(state), axis=0))
        return cls(scene, variation, _of_modes(scene, strengths), state, workers, unit)

    @property
    def components(self) -> int:
        """State variables of one deviation, real or complex."""
        return self.variation.size // len(self.variation.parameters)

    def part(self, rows: list[int]) -> Orbits:
        """The orbits of some starts."""
        return Orbits(self.scene, self.variation, self.strengths, self.state[rows], self.workers, self.unit)

    def carry(self, strengths: np.ndarray, looseness: float = 1.0) -> Carrier:
        """A carrier of these strengths along the orbits from where they are, one deviation for each component."""
        repeated = np.repeat(strengths, self.components)
        rows = np.stack([repeated.real, repeated.imag]) if np.iscomplexobj(self.strengths) else repeated[None]
        names = self.variation.orbit.parameters
        numbers = np.tile([self.scene.parameters[name] for name in names], (len(self.state), 1))
        return Carrier.make(self.scene, self.variation, self.state, numbers, rows, self.workers, looseness)

    def settle(self, periods: float) -> None:
        """Run through a transient."""
        carrier = self.carry(self.strengths[:1])
        for length in _stretches(round(periods)):
            carrier.advance(length * self.unit)
        self.state = carrier.state

    def prepare(self) -> None:
        """Choose the block and the panels of strengths, tried on the next block of the orbits, and start the deviations."""
        limit = max(0.1 * self.scene.rtol, 1e-12)
        for block, nodes, parts in _choices(self.scene.forced):
            self.block, self.chosen = block, interpolation(self.strengths, nodes, parts)
            self.carrier = self.carry(self.chosen.nodes, LOOSENESS)
            if self.chosen.exact or self.chosen.error(self.propagators()) < limit:
                break
        else:
            self.chosen = exact(self.strengths)
        self.carrier = self.carry(self.chosen.nodes, LOOSENESS)
        start = np.ones((len(self.state), len(self.strengths), self.components), dtype=self.strengths.dtype)
        self.deviations = start / math.sqrt(self.components)

    def propagators(self) -> np.ndarray:
        """Advance by one block; returns the propagators (starts, nodes, components, components)."""
        carrier, p = self.carrier, self.components
        if carrier is None:
            raise RuntimeError("orbits are not prepared")
        size = self.variation.size
        basis = np.zeros((len(self.state), size, len(carrier.order)))
        for k in range(p):
            basis[:, k, k::p] = 1.0
        carrier.point(basis)
        growth = carrier.advance(self.block * self.unit)
        found = carrier.deviations * np.exp(growth)[:, None, :]
        if size != p:
            found = found[:, :p] + 1j * found[:, p:]
        return np.asarray(found.reshape(len(self.state), p, -1, p).transpose(0, 2, 1, 3))

    def advance(self) -> np.ndarray:
        """Advance orbits and deviations by one block; returns the logarithm of their growth (starts, m)."""
        if self.chosen is None or self.deviations is None:
            raise RuntimeError("orbits are not prepared")
        nodes = self.propagators()
        self.interpolation_error = max(self.interpolation_error, self.chosen.error(nodes))
        found = self.chosen.apply(nodes)
        moved = sum(found[..., k] * self.deviations[..., k, None] for k in range(self.components))
        length = np.linalg.norm(moved, axis=2)
        with np.errstate(divide="ignore", invalid="ignore"):
            self.deviations = np.where(length[..., None] > 0.0, moved / length[..., None], 0.0)
            return np.log(length)


def _of_modes(scene: Scene, alpha: np.ndarray) -> np.ndarray:
    """The strengths tau = alpha/(1 + b alpha) of modes whose links have inertia (`synchain.models.dynamics.mode_inertia`)."""
    _, share = inertia_of_modes(scene.equations)
    if share == 0:
        return alpha
    b = float(share.xreplace({sp.Symbol(name, real=True): value for name, value in scene.parameters.items()}))
    mass = 1.0 + b * alpha
    if not np.all(mass.real > 0.0):
        worst = alpha[mass.real.argmin()]
        raise ValueError(f"alpha = {worst}: the mass of this mode is not positive; expected strengths above {-1 / b:g}")
    return np.asarray(alpha / mass)


@lru_cache(maxsize=16)
def _variation(equations: Equations, plane: bool) -> Variation:
    """The variational equation of a mode: Newton's method on an orbit asks for it at every step."""
    return mode(equations, plane=plane)


def unit_of_time(scene: Scene) -> float:
    """The period of the drive, or 2 pi if there is none; ValueError if time enters without a known period."""
    drive = scene.drive
    if scene.forced and drive.frequency is None:
        raise ValueError(
            f"drive: the oscillator {scene.oscillator.name!r} {drive.problem}; expected one with a period; "
            "`run` integrates others with time_unit = 'time'"
        )
    return scene.period or 2.0 * math.pi


def _choices(forced: bool) -> list[tuple[float, int, int]]:
    """Blocks, nodes of a panel and panels a side, the cheapest first; each block costs as much as some nodes by itself."""
    blocks = (4.0, 2.0, 1.0) if forced else (1.0, 0.5, 0.25, 0.125)
    made = [(block, nodes, parts) for block in blocks for nodes in NODES for parts in PARTS]
    return sorted(made, key=lambda choice: (20.0 + choice[1] * choice[2]) / choice[0])


def _stretches(periods: int) -> list[int]:
    """A number of periods in pieces, so that Ctrl-C is heard."""
    whole, rest = divmod(max(periods, 0), 100)
    return [100] * whole + ([rest] if rest else [])
