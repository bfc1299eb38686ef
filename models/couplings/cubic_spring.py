"""Spring with a cubic part between equal coordinates of two oscillators; of free masses the FPUT beta model."""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "spring with a cubic part; force sigma (r + cubic r^3) for the difference r of the coordinates"
SOURCE = "Fermi, Pasta & Ulam, Los Alamos report LA-1940 (1955), cubic forces; Ford, Phys. Rep. 213, 271 (1992)"
PARAMETERS = {
    "sigma": Parameter(0.0, "N/m", "coupling stiffness for small differences", minimum=0),
    "cubic": Parameter(1.0, "m^-2", "cubic part over the linear part; negative for a spring that softens"),
}


def potential(q_i: sp.Expr, q_j: sp.Expr, weight: sp.Expr, sigma: sp.Expr, cubic: sp.Expr) -> sp.Expr:
    """Return the energy sigma weight (r^2/2 + cubic r^4/4), r = q_i - q_j (J, for lengths in m and sigma in N/m)."""
    return sigma * weight * ((q_i - q_j) ** 2 / 2 + cubic * (q_i - q_j) ** 4 / 4)
