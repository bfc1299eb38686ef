"""Stribeck friction with the Gaussian fall-off and a viscous part.

The general law has exp(-|w/v_s|^delta).  Here delta = 2, the Gaussian form; delta = 1 is `exponential` with
a = 1/v_s.
"""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "friction coefficient that falls from mu_s to mu_k over the Stribeck speed v_s, plus viscous growth c w"
SOURCE = (
    "Stribeck, Z. Ver. dt. Ing. 46, 1341 (1902); Gaussian form: Armstrong-Hélouvry, Dupont, Canudas de Wit, "
    "Automatica 30, 1083 (1994)"
)
ODD = True
PARAMETERS = {
    "mu_s": Parameter(0.3, "1", "static friction coefficient, f(0+)", minimum=0),
    "mu_k": Parameter(0.15, "1", "kinetic friction coefficient, f for v_s << w while c w is small", minimum=0),
    "v_s": Parameter(0.4, "m/s", "Stribeck speed, over which friction falls", positive=True),
    "c": Parameter(0.0, "s/m", "viscous part, growth of the coefficient per speed", minimum=0),
}


def force(w: sp.Expr, mu_s: sp.Expr, mu_k: sp.Expr, v_s: sp.Expr, c: sp.Expr) -> sp.Expr:
    """Return (mu_k + (mu_s - mu_k) exp(-(w/v_s)^2)) sgn w + c w for the sliding velocity w (m/s); unit 1."""
    return (mu_k + (mu_s - mu_k) * sp.exp(-((w / v_s) ** 2))) * sp.sign(w) + c * w
