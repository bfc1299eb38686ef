"""The Euler-Lagrange operator on plain symbols, with generalised forces, and the energy balance that checks it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from .calculus import derivative
from .equations import TIME
from .mass_solve import solve_masses

__all__ = ["Mechanics", "balance", "energy_rate", "equations_of_motion", "mass_matrix", "total_derivative"]

Symbols = Sequence[sp.Symbol]


@dataclass(frozen=True, slots=True)
class Mechanics:
    """A Lagrangian system: kinetic energy T(q, v, t), potential V(q, t) and one generalised force Q(q, v, t) for each q.

    Raises ValueError where the numbers of coordinates, velocities and forces differ.
    """

    coordinates: tuple[sp.Symbol, ...]
    velocities: tuple[sp.Symbol, ...]
    kinetic: sp.Expr
    potential: sp.Expr
    forces: tuple[sp.Expr, ...]

    def __post_init__(self) -> None:
        _one_each(self.coordinates, self.velocities, self.forces)

    def accelerations(self) -> tuple[sp.Expr, ...]:
        """The equations of motion, solved for the accelerations."""
        return equations_of_motion(self.kinetic, self.potential, self.forces, self.coordinates, self.velocities)

    def energy_rate(self) -> tuple[sp.Expr, sp.Expr]:
        """dE/dt along the motion, and what it must be; see `energy_rate`."""
        return energy_rate(self.kinetic, self.potential, self.forces, self.coordinates, self.velocities)


def total_derivative(f: sp.Expr, q: Symbols, v: Symbols, a: Sequence[sp.Expr], time: sp.Symbol = TIME) -> sp.Expr:
    """Return df/dt of f(q, v, t) along a motion with dq/dt = v and dv/dt = a."""
    terms = [derivative(f, x) * rate for x, rate in zip((*q, *v), (*v, *a), strict=True)]
    return sp.Add(derivative(f, time), *terms)


def mass_matrix(kinetic: sp.Expr, v: Symbols) -> sp.Matrix:
    """Return the second derivatives of the kinetic energy with respect to the velocities."""
    return sp.Matrix([[derivative(derivative(kinetic, x), y) for y in v] for x in v])


def equations_of_motion(
    kinetic: sp.Expr, potential: sp.Expr, forces: Sequence[sp.Expr], q: Symbols, v: Symbols, time: sp.Symbol = TIME
) -> tuple[sp.Expr, ...]:
    """Solve d/dt dL/dv - dL/dq = Q with L = T - V for the accelerations dv/dt.

    The mass matrix is solved by its structure (`synchain.models.mass_solve`).  Raises ValueError where the numbers of
    coordinates, velocities and forces differ, or where the mass matrix is singular: some velocity has no kinetic energy.
    Source: Goldstein, Poole & Safko, Classical Mechanics, 3rd ed. (Addison-Wesley, 2002), sect. 1.4.
    """
    rest, masses = balance(kinetic, potential, forces, q, v, time)
    return solve_masses(masses, rest, v)


def balance(
    kinetic: sp.Expr, potential: sp.Expr, forces: Sequence[sp.Expr], q: Symbols, v: Symbols, time: sp.Symbol = TIME
) -> tuple[list[sp.Expr], sp.Matrix]:
    """Return r and M of M dv/dt = r, the Euler-Lagrange equations before they are solved; M may be singular.

    Raises ValueError where the numbers of coordinates, velocities and forces differ.
    """
    _one_each(q, v, forces)
    lagrangian = kinetic - potential
    at_rest = [sp.S.Zero] * len(q)
    rest = []
    for x, rate, force in zip(q, v, forces, strict=True):
        momentum = derivative(lagrangian, rate)
        rest.append(derivative(lagrangian, x) + force - total_derivative(momentum, q, v, at_rest, time))
    return rest, mass_matrix(lagrangian, v)


def energy_rate(
    kinetic: sp.Expr, potential: sp.Expr, forces: Sequence[sp.Expr], q: Symbols, v: Symbols, time: sp.Symbol = TIME
) -> tuple[sp.Expr, sp.Expr]:
    """Return dE/dt along the motion and what it must be, sum v Q - (partial) dL/dt; their difference vanishes.

    E = sum v dL/dv - L is the energy function, T + V for ordinary kinetic energies.
    Source: Goldstein, Poole & Safko, Classical Mechanics, 3rd ed. (Addison-Wesley, 2002), sect. 2.7.
    """
    lagrangian = kinetic - potential
    energy = sp.Add(*(rate * derivative(lagrangian, rate) for rate in v)) - lagrangian
    motion = equations_of_motion(kinetic, potential, forces, q, v, time)
    power = sp.Add(*(rate * force for rate, force in zip(v, forces, strict=True)))
    return total_derivative(energy, q, v, motion, time), power - derivative(lagrangian, time)


def _one_each(q: Symbols, v: Symbols, forces: Sequence[sp.Expr]) -> None:
    if not len(q) == len(v) == len(forces):
        raise ValueError(f"{len(q)} coordinates, {len(v)} velocities and {len(forces)} forces; expected one each")
