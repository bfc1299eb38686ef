"""The Euler-Lagrange operator on plain symbols, with generalised forces, and the energy balance that checks it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from .calculus import derivative
from .components import TIME

Symbols = Sequence[sp.Symbol]


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
        _one_each(self.coordinates, self.velocities, self.forces)

    def balance(self) -> tuple[list[sp.Expr], sp.Matrix]:
        """The equations of motion before they are solved; see `balance`."""
        return balance(self.kinetic, self.potential, self.forces, self.coordinates, self.velocities)

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

    References
    ----------
    Goldstein, Poole & Safko, Classical Mechanics, 3rd ed. (Addison-Wesley, 2002), sect. 1.4.
    """
    rest, masses = balance(kinetic, potential, forces, q, v, time)
    return solve_masses(masses, rest, v)


def balance(
    kinetic: sp.Expr, potential: sp.Expr, forces: Sequence[sp.Expr], q: Symbols, v: Symbols, time: sp.Symbol = TIME
) -> tuple[list[sp.Expr], sp.Matrix]:
    """Return r and M of M dv/dt = r, the Euler-Lagrange equations before they are solved; M may be singular.

    Raises ValueError if the numbers of coordinates, velocities and forces differ.
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


LARGEST_BY_MINORS = 3
"""Coupled rows up to which M is inverted in the equations: its minors are short.

Beyond, elimination leaves fractions within fractions, and kernels solve M dv/dt = r.
"""


def coupled(masses: sp.Matrix) -> list[int]:
    """Return the rows of a mass matrix with entries beside the diagonal."""
    size = masses.rows
    return [i for i in range(size) if any(masses[i, j] != 0 for j in range(size) if j != i)]


def check_masses_exist(masses: sp.Matrix, velocities: Sequence[sp.Symbol]) -> None:
    """Raise ValueError if a symmetric mass matrix is singular: some velocity, which names it, has no kinetic energy."""
    rest = coupled(masses)
    idle = [str(velocities[i]) for i in range(masses.rows) if i not in rest and masses[i, i] == 0]
    if idle:
        raise ValueError(f"no kinetic energy in the velocity {idle[0]}; expected T to grow with every velocity")
    if rest and _is_singular(masses.extract(rest, rest)):
        names = ", ".join(str(velocities[i]) for i in rest)
        raise ValueError(f"the mass matrix of {names} is singular; expected an invertible one")


def solve_masses(masses: sp.Matrix, forces: Sequence[sp.Expr], velocities: Sequence[sp.Symbol]) -> tuple[sp.Expr, ...]:
    """Return a with masses * a = forces, for a symmetric mass matrix; `velocities` name its rows in errors.

    Raises ValueError if the matrix is singular: some velocity then has no kinetic energy.
    """
    check_masses_exist(masses, velocities)
    rest = coupled(masses)
    found = {i: forces[i] / masses[i, i] for i in range(masses.rows) if i not in rest}
    if rest:
        block = masses.extract(rest, rest)
        found |= dict(zip(rest, _block(block, [forces[i] for i in rest]), strict=True))
    return tuple(found[i] for i in range(len(forces)))


def _determinant(masses: sp.Matrix) -> sp.Expr:
    return masses.det(method="berkowitz")


def _is_singular(masses: sp.Matrix) -> bool:
    """True if the determinant is zero at three places, beside the product of the diagonal; without numbers, everywhere."""
    symbols, found = sorted(masses.free_symbols, key=str), False
    for k in range(3):
        place = {s: sp.Rational(7 * i + 3 * k + 5, 11 + 2 * i) for i, s in enumerate(symbols)}
        numbers = masses.subs(place).evalf(60)
        value, size = _determinant(numbers), sp.prod(numbers.diagonal())
        if value.is_number and value.is_finite:
            if abs(value) > sp.Float("1e-40") * abs(size):
                return False
            found = True
    return found or bool(_determinant(masses).equals(0))


def _block(masses: sp.Matrix, forces: Sequence[sp.Expr]) -> list[sp.Expr]:
    """Cramer's rule for a small block, elimination for a large one."""
    if masses.rows > LARGEST_BY_MINORS:
        return list(masses.LUsolve(sp.Matrix(forces)))
    minors, determinant = masses.adjugate(), _determinant(masses)
    return [sp.Add(*(minors[i, j] * force for j, force in enumerate(forces))) / determinant for i in range(masses.rows)]
