"""The Euler-Lagrange operator on plain symbols, with generalised forces, and the energy balance that checks it."""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

from .calculus import derivative
from .equations import TIME

__all__ = ["accelerations", "energy_rate", "mass_matrix", "total_derivative"]

Symbols = Sequence[sp.Symbol]


def total_derivative(f: sp.Expr, q: Symbols, v: Symbols, a: Symbols) -> sp.Expr:
    """Return df/dt of f(q, v, t) with dq/dt = v and dv/dt = a."""
    terms = [f.diff(TIME)]
    terms += [f.diff(x) * rate for x, rate in zip((*q, *v), (*v, *a), strict=True)]
    return sp.Add(*terms)


def mass_matrix(kinetic: sp.Expr, v: Symbols) -> sp.Matrix:
    """Return the second derivatives of the kinetic energy with respect to the velocities."""
    return sp.Matrix([[kinetic.diff(x, y) for y in v] for x in v])


def accelerations(
    kinetic: sp.Expr, potential: sp.Expr, forces: Sequence[sp.Expr], q: Symbols, v: Symbols
) -> tuple[sp.Expr, ...]:
    """Solve d/dt dL/dv - dL/dq = Q, L = T - V, for the accelerations.

    `kinetic` T(q, v, t) and `potential` V(q, t) are energies, `forces` the generalised non-conservative forces Q(q, v, t),
    one for each coordinate.  Raises ValueError where the numbers of coordinates, velocities and forces differ, or where the
    mass matrix is singular (a velocity without kinetic energy).
    """
    if not len(q) == len(v) == len(forces):
        raise ValueError(f"{len(q)} coordinates, {len(v)} velocities, {len(forces)} forces; expected one each")
    lagrangian = kinetic - potential
    zeros = [sp.S.Zero] * len(q)
    rest = []
    for x, rate, force in zip(q, v, forces, strict=True):
        momentum = lagrangian.diff(rate)
        rest.append(force + lagrangian.diff(x) - total_derivative(momentum, q, v, zeros))
    masses = mass_matrix(kinetic, v)
    if masses.is_diagonal():
        if any(masses[i, i] == 0 for i in range(len(q))):
            raise ValueError(f"no kinetic energy in {v[[masses[i, i] for i in range(len(q))].index(0)]}; every velocity needs some")
        return tuple(value / masses[i, i] for i, value in enumerate(rest))
    if sp.simplify(masses.det()) == 0:
        raise ValueError("the mass matrix is singular; every combination of velocities needs kinetic energy")
    return tuple(masses.LUsolve(sp.Matrix(rest)))


def energy_rate(
    kinetic: sp.Expr, potential: sp.Expr, forces: Sequence[sp.Expr], q: Symbols, v: Symbols
) -> tuple[sp.Expr, sp.Expr]:
    """Return dE/dt along the motion and what it must be, sum v Q - dL/dt (explicit); their difference is zero.

    E = sum v dL/dv - L is the energy function (Goldstein, Poole & Safko, Classical Mechanics, 3rd ed. 2002, sect. 2.7).
    """
    lagrangian = kinetic - potential
    energy = sp.Add(*(rate * lagrangian.diff(rate) for rate in v)) - lagrangian
    found = total_derivative(energy, q, v, accelerations(kinetic, potential, forces, q, v))  # type: ignore[arg-type]
    power = sp.Add(*(rate * force for rate, force in zip(v, forces, strict=True))) - derivative(lagrangian, TIME)
    return found, power
