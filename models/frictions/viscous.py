"""Viscous friction: proportional to the sliding speed, no jump."""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "friction coefficient proportional to the sliding speed"
SOURCE = "Rayleigh, Proc. London Math. Soc. s1-4, 357 (1873)"
ODD = True
PARAMETERS = {"c": Parameter(0.3, "s/m", "growth of the friction coefficient per sliding speed", minimum=0)}


def force(w: sp.Expr, c: sp.Expr) -> sp.Expr:
    """Return c w for the sliding velocity w (m/s); unit 1."""
    return c * w
