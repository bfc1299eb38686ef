"""Mechanical systems of any number of coupled coordinates, made as users make models, and the mass matrix by hand."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import sympy as sp

from synchain.models.inputs.frozen import FrozenDict
from synchain.models.mechanics.oscillator import Coordinate, LagrangianModel, Oscillator
from synchain.models.mechanics.parameter import Parameter


def real(prefix: str, count: int) -> tuple[sp.Symbol, ...]:
    return tuple(sp.Symbol(f"{prefix}{k + 1}", real=True) for k in range(count))


def of_energies(name: str, links: int, kinetic: sp.Expr, potential: sp.Expr, lost: sp.Expr, *names: str) -> Oscillator:
    """An oscillator with coordinates q1 …, velocities w1 … and parameters of the value 1."""
    coordinates = tuple(Coordinate(f"q{k + 1}", f"w{k + 1}", "1") for k in range(links))
    model = LagrangianModel(coordinates, kinetic, potential, (sp.S.Zero,) * links, lost)
    return Oscillator(name, FrozenDict({s: Parameter(1.0, "1", "a number") for s in names}), model)


def pendulum(links: int) -> Oscillator:
    """Unit masses on unit rods, each angle counted from the vertical; dampers between neighbouring rods."""
    q, w = real("q", links), real("w", links)
    gravity, delta = (sp.Symbol(name, real=True) for name in ("gravity", "delta"))
    across = [sp.Add(*(b * sp.cos(a) for a, b in zip(q[:k], w[:k], strict=True))) for k in range(1, links + 1)]
    upward = [sp.Add(*(b * sp.sin(a) for a, b in zip(q[:k], w[:k], strict=True))) for k in range(1, links + 1)]
    kinetic = sp.Add(*(a**2 + b**2 for a, b in zip(across, upward, strict=True))) / 2
    potential = -gravity * sp.Add(*((links - k) * sp.cos(a) for k, a in enumerate(q)))
    lost = delta * (w[0] ** 2 + sp.Add(*((b - a) ** 2 for a, b in itertools.pairwise(w)))) / 2
    return of_energies(f"pendulum of {links}", links, kinetic, potential, lost, "gravity", "delta")


def telescope(tubes: int) -> Oscillator:
    """Tubes that slide within each other, each position relative to the last tube: constant masses, all coupled."""
    q, w = real("q", tubes), real("w", tubes)
    mass, delta = (sp.Symbol(name, real=True) for name in ("mass", "delta"))
    kinetic = mass * sp.Add(*(sp.Add(*w[:k]) ** 2 for k in range(1, tubes + 1))) / 2
    potential = sp.Add(*(a**2 / 2 + a**4 / 4 for a in q))
    return of_energies(f"telescope of {tubes}", tubes, kinetic, potential, delta * w[0] ** 2 / 2, "mass", "delta")


@dataclass(frozen=True)
class ByHand:
    """The equations of the pendulum as matrices: M_ab = m_ab cos(q_a - q_b), m_ab the masses below both."""

    links: int
    gravity: float
    delta: float = 0.0

    @property
    def below(self) -> np.ndarray:
        return np.arange(self.links, 0.0, -1.0)

    def rates(self, _: float, y: np.ndarray) -> np.ndarray:
        """The rates of the state (q, w)."""
        q, w = y.reshape(2, -1)
        masses, gaps = np.minimum.outer(self.below, self.below), q[:, None] - q[None, :]
        drag = 2 * np.eye(self.links) - np.eye(self.links, k=1) - np.eye(self.links, k=-1)
        drag[-1, -1] = 1
        forces = -(masses * np.sin(gaps)) @ w**2 - self.gravity * self.below * np.sin(q) - self.delta * drag @ w
        return np.concatenate([w, np.linalg.solve(masses * np.cos(gaps), forces)])

    def energy(self, y: np.ndarray) -> float:
        """Kinetic and potential energy, by the positions of the masses."""
        q, w = y.reshape(2, -1)
        across, upward = np.cumsum(w * np.cos(q)), np.cumsum(w * np.sin(q))
        return float((across @ across + upward @ upward) / 2 - self.gravity * self.below @ np.cos(q))
