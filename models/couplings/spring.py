"""Linear spring between equal coordinates of two oscillators."""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "linear spring; stiffness sigma times the stiffness of the oscillator's own spring"
SOURCE = "Marszal, Saha, Jankowski, Stefański, Eur. Phys. J. Special Topics (2016), eqs. 6-8"
PARAMETERS = {"sigma": Parameter(0.0, "N/m", "coupling stiffness", minimum=0)}


def potential(q_i: sp.Expr, q_j: sp.Expr, weight: sp.Expr, sigma: sp.Expr) -> sp.Expr:
    """Return the energy sigma weight (q_i - q_j)^2 / 2 of the spring (J, for lengths in m and sigma in N/m)."""
    return sigma * weight * (q_i - q_j) ** 2 / 2
