"""Hyperbolic friction: falls from mu_s at rest towards zero in fast sliding."""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "friction coefficient that falls hyperbolically with the sliding speed, from mu_s towards 0"
SOURCE = "Leine, van Campen, de Kraker, van den Steen, Nonlinear Dynamics 16, 41 (1998)"
ODD = True
PARAMETERS = {
    "mu_s": Parameter(0.3, "1", "static friction coefficient, f(0+)", minimum=0),
    "delta": Parameter(3.0, "s/m", "one over the sliding speed at which half of mu_s is left", minimum=0),
}


def force(w: sp.Expr, mu_s: sp.Expr, delta: sp.Expr) -> sp.Expr:
    """Return mu_s sgn w / (1 + delta |w|) for the sliding velocity w (m/s); unit 1."""
    return mu_s * sp.sign(w) / (1 + delta * sp.Abs(w))
