"""Exponential friction: falls from mu_s at rest to mu_k in fast sliding."""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "friction coefficient that decays exponentially with the sliding speed, from mu_s to mu_k"
SOURCE = "Marszal, Saha, Jankowski, Stefański, Eur. Phys. J. Special Topics (2016), eq. 4"
ODD = True
PARAMETERS = {
    "mu_s": Parameter(0.3, "1", "static friction coefficient, f(0+)", minimum=0),
    "mu_k": Parameter(0.15, "1", "kinetic friction coefficient, f at large sliding speed", minimum=0),
    "a": Parameter(2.5, "s/m", "rate of decay with the sliding speed", minimum=0),
}


def force(w: sp.Expr, mu_s: sp.Expr, mu_k: sp.Expr, a: sp.Expr) -> sp.Expr:
    """Return (mu_k + (mu_s - mu_k) exp(-a|w|)) sgn w for the sliding velocity w (m/s); unit 1."""
    return (mu_k + (mu_s - mu_k) * sp.exp(-a * sp.Abs(w))) * sp.sign(w)
