"""Spring of the Fermi-Pasta-Ulam-Tsingou chain: with a quadratic part (alpha model), a cubic part (beta model) or both.

The quadratic part tells tension from compression, so a link has a direction: r = q_j - q_i is its extension where it runs
from node i to node j, from the smaller to the larger number, and round a ring (`synchain.models.orientation`).
"""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = (
    "spring of the Fermi-Pasta-Ulam-Tsingou chain; force sigma (r + fput_alpha r^2 + fput_beta r^3), r its extension"
)
SOURCE = "Fermi, Pasta & Ulam, Los Alamos report LA-1940 (1955); Ford, Phys. Rep. 213, 271 (1992)"
PARAMETERS = {
    "sigma": Parameter(1.0, "N/m", "coupling stiffness for small extensions", minimum=0),
    "fput_alpha": Parameter(0.25, "1/m", "quadratic part over the linear part"),
    "fput_beta": Parameter(0.0, "m^-2", "cubic part over the linear part"),
}


def potential(
    q_i: sp.Expr, q_j: sp.Expr, weight: sp.Expr, sigma: sp.Expr, fput_alpha: sp.Expr, fput_beta: sp.Expr
) -> sp.Expr:
    """Return sigma weight (r^2/2 + fput_alpha r^3/3 + fput_beta r^4/4), r = q_j - q_i (J, for lengths in m)."""
    r = q_j - q_i
    return sigma * weight * (r**2 / 2 + fput_alpha * r**3 / 3 + fput_beta * r**4 / 4)
