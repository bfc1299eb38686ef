"""Linear damper between equal coordinates of two oscillators."""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "linear damper; force proportional to the difference of the velocities"
SOURCE = "Rayleigh, Proc. London Math. Soc. s1-4, 357 (1873): dissipation function"
PARAMETERS = {"sigma": Parameter(0.0, "kg/s", "damping coefficient of the coupling", minimum=0)}


def dissipation(v_i: sp.Expr, v_j: sp.Expr, weight: sp.Expr, sigma: sp.Expr) -> sp.Expr:
    """Return Rayleigh's function sigma weight (v_i - v_j)^2 / 2, half the power lost (W, sigma in kg/s)."""
    return sigma * weight * (v_i - v_j) ** 2 / 2
