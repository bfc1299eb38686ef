"""Accelerations from a mass matrix and forces, by the structure of the matrix: nothing is expanded or simplified.

A diagonal entry that stands alone in its row is divided by; what is left is solved by Cramer's rule up to three rows, whose
minors stay products that generated code shares, and by symbolic elimination beyond.
"""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

__all__ = ["solve_masses"]

LARGEST_BY_MINORS = 3
"""Rows up to which minors are shorter than the fractions within fractions that elimination leaves."""


def solve_masses(masses: sp.Matrix, forces: Sequence[sp.Expr], velocities: Sequence[sp.Symbol]) -> tuple[sp.Expr, ...]:
    """Return a with masses * a = forces, for a symmetric mass matrix; `velocities` name its rows in errors.

    Raises ValueError where the matrix is singular: some velocity then has no kinetic energy.
    """
    size = len(forces)
    alone = [i for i in range(size) if all(masses[i, j] == 0 for j in range(size) if j != i)]
    idle = [str(velocities[i]) for i in alone if masses[i, i] == 0]
    if idle:
        raise ValueError(f"no kinetic energy in the velocity {idle[0]}; expected T to grow with every velocity")
    found = {i: forces[i] / masses[i, i] for i in alone}
    rest = [i for i in range(size) if i not in found]
    if rest:
        block = masses.extract(rest, rest)
        names = ", ".join(str(velocities[i]) for i in rest)
        found |= dict(zip(rest, _block(block, [forces[i] for i in rest], names), strict=True))
    return tuple(found[i] for i in range(size))


def _vanishes(e: sp.Expr) -> bool:
    """True where an expression is zero everywhere; a value that differs from zero at one place proves the contrary."""
    symbols = sorted(e.free_symbols, key=str)
    for k in range(3):
        place = {s: sp.Rational(7 * i + 3 * k + 5, 11 + 2 * i) for i, s in enumerate(symbols)}
        value = e.subs(place).evalf(30)
        if value.is_number and value.is_finite and abs(value) > sp.Float("1e-15"):
            return False
    return bool(e.equals(0))


def _block(masses: sp.Matrix, forces: Sequence[sp.Expr], names: str) -> list[sp.Expr]:
    """Cramer's rule for a small block, elimination for a large one."""
    determinant = masses.det(method="berkowitz")
    if _vanishes(determinant):
        raise ValueError(f"the mass matrix of {names} is singular; expected an invertible one")
    if masses.rows > LARGEST_BY_MINORS:
        return list(masses.LUsolve(sp.Matrix(forces)))
    minors = masses.adjugate()
    return [sp.Add(*(minors[i, j] * force for j, force in enumerate(forces))) / determinant for i in range(masses.rows)]
