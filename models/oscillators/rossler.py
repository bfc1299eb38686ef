"""Rössler's chaotic vector field, with one non-linear term."""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "chaotic vector field with one quadratic term; a spiral in x and y that folds back through z"
SOURCE = (
    "Rössler, Phys. Lett. A 57, 397 (1976); c = 9 as in Huang, Chen, Lai & Pecora, Phys. Rev. E 80, 036204 (2009), "
    "where the paper of 1976 has 5.7"
)
FRICTION = False
PARAMETERS = {
    "a": Parameter(0.2, "1", "growth of the spiral"),
    "b": Parameter(0.2, "1", "constant inflow of z"),
    "c": Parameter(9.0, "1", "value of x above which z grows"),
}
STATE = ("x", "y", "z")
INITIAL = {"x": 1.0, "y": 1.0}


def field(x: sp.Expr, y: sp.Expr, z: sp.Expr, a: sp.Expr, b: sp.Expr, c: sp.Expr) -> tuple[sp.Expr, ...]:
    """Return the rates -y - z, x + a y and b + (x - c) z."""
    return -y - z, x + a * y, b + (x - c) * z
