"""The Euler-Lagrange equations of a system of generalised coordinates, and their energy balance.

Source: Goldstein, Poole & Safko, Classical Mechanics, 3rd ed. (Addison-Wesley, 2002), sections 1.4, 1.5 and 2.7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from .calculus import derivative
from .components import TIME

Symbols = Sequence[sp.Symbol]

LARGEST_BY_MINORS = 3
"""Most coupled rows for which M is inverted in symbols (a choice); the minors of three rows are short.

With more rows, elimination makes nested fractions; kernels then solve M dv/dt = r numerically.
"""


@dataclass(frozen=True, slots=True)
class Mechanics:
    """A Lagrangian system: kinetic energy T(q, v, t), potential V(q, t) and one generalised force Q(q, v, t) for each q.

    Raises ValueError if the numbers of coordinates, velocities and forces differ.
    """

    coordinates: tuple[sp.Symbol, ...]
    velocities: tuple[sp.Symbol, ...]
    kinetic: sp.Expr
    potential: sp.Expr
    forces: tuple[sp.Expr, ...]

    def __post_init__(self) -> None:
        q, v, forces = map(len, (self.coordinates, self.velocities, self.forces))
        if not q == v == forces:
            raise ValueError(f"{q} coordinates, {v} velocities and {forces} forces; expected one each")

    def balance(self) -> tuple[list[sp.Expr], sp.Matrix]:
        """Return r and M of M dv/dt = r, the equations d/dt dL/dv - dL/dq = Q with L = T - V; M may be singular."""
        lagrangian = self.kinetic - self.potential
        at_rest = [sp.S.Zero] * len(self.coordinates)
        r = []
        for x, v, force in zip(self.coordinates, self.velocities, self.forces, strict=True):
            # d/dt dL/dv is M dv/dt plus terms without accelerations, which move to r.
            momentum_rate = total_derivative(derivative(lagrangian, v), self.coordinates, self.velocities, at_rest)
            r.append(derivative(lagrangian, x) + force - momentum_rate)
        return r, mass_matrix(lagrangian, self.velocities)

    def accelerations(self) -> tuple[sp.Expr, ...]:
        """Return the equations of motion, solved for the accelerations."""
        r, masses = self.balance()
        return solve_masses(masses, r, self.velocities)

    def energy_rate(self) -> tuple[sp.Expr, sp.Expr]:
        """Return dE/dt along the motion and its theoretical value sum v Q - (partial) dL/dt; the two are equal.

        E = sum v dL/dv - L is the energy function, T + V for ordinary kinetic energies.
        """
        lagrangian, v = self.kinetic - self.potential, self.velocities
        energy = sp.Add(*(rate * derivative(lagrangian, rate) for rate in v)) - lagrangian
        power = sp.Add(*(rate * force for rate, force in zip(v, self.forces, strict=True)))
        along = total_derivative(energy, self.coordinates, v, self.accelerations())
        return along, power - derivative(lagrangian, TIME)


def total_derivative(f: sp.Expr, q: Symbols, v: Symbols, a: Sequence[sp.Expr]) -> sp.Expr:
    """Return df/dt of f(q, v, t) along a motion with dq/dt = v and dv/dt = a."""
    terms = [derivative(f, x) * rate for x, rate in zip((*q, *v), (*v, *a), strict=True)]
    return sp.Add(derivative(f, TIME), *terms)


def mass_matrix(kinetic: sp.Expr, v: Symbols) -> sp.Matrix:
    """Return the second derivatives of the kinetic energy with respect to the velocities."""
    return sp.Matrix([[derivative(derivative(kinetic, x), y) for y in v] for x in v])


def coupled(masses: sp.Matrix) -> list[int]:
    """Return the rows of a mass matrix that have off-diagonal entries."""
    size = masses.rows
    return [i for i in range(size) if any(masses[i, j] != 0 for j in range(size) if j != i)]


def check_masses_exist(masses: sp.Matrix, velocities: Symbols) -> None:
    """Raise ValueError if a mass matrix is singular; the message names a velocity that has no kinetic energy."""
    rows = coupled(masses)
    idle = [str(velocities[i]) for i in range(masses.rows) if i not in rows and masses[i, i] == 0]
    if idle:
        raise ValueError(f"no kinetic energy in the velocity {idle[0]}; expected T to grow with every velocity")
    if rows and _is_singular(masses.extract(rows, rows)):
        names = ", ".join(str(velocities[i]) for i in rows)
        raise ValueError(f"the mass matrix of {names} is singular; expected an invertible one")


def solve_masses(masses: sp.Matrix, forces: Sequence[sp.Expr], velocities: Symbols) -> tuple[sp.Expr, ...]:
    """Solve M a = r for the accelerations a, with a symmetric mass matrix M and one of `velocities` for each row.

    Raises ValueError if M is singular; the message names a velocity that has no kinetic energy.
    """
    check_masses_exist(masses, velocities)
    rows = coupled(masses)
    solution = {i: forces[i] / masses[i, i] for i in range(masses.rows) if i not in rows}
    if rows:
        block, r = masses.extract(rows, rows), [forces[i] for i in rows]
        if len(rows) > LARGEST_BY_MINORS:
            values = list(block.LUsolve(sp.Matrix(r)))
        else:  # Cramer's rule
            minors, determinant = block.adjugate(), _determinant(block)
            values = [
                sp.Add(*(minors[i, j] * force for j, force in enumerate(r))) / determinant for i in range(len(rows))
            ]
        solution |= dict(zip(rows, values, strict=True))
    return tuple(solution[i] for i in range(len(forces)))


def _determinant(masses: sp.Matrix) -> sp.Expr:
    return masses.det(method="berkowitz")


def _is_singular(masses: sp.Matrix) -> bool:
    """Return True if, at three points, the determinant is zero relative to the product of the diagonal."""
    symbols, evaluated = sorted(masses.free_symbols, key=str), False
    for k in range(3):
        point = {s: sp.Rational(7 * i + 3 * k + 5, 11 + 2 * i) for i, s in enumerate(symbols)}
        at_point = masses.subs(point).evalf(60)
        value, size = _determinant(at_point), sp.prod(at_point.diagonal())
        if value.is_number and value.is_finite:
            if abs(value) > sp.Float("1e-40") * abs(size):
                return False
            evaluated = True
    # Undefined functions have no values at points: let SymPy prove that the determinant is zero.
    return evaluated or bool(_determinant(masses).equals(0))
