"""Coulomb friction with a static coefficient of its own: slip begins with a jump of the friction force."""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "friction coefficient mu_k in sliding, mu_s at rest with the contact 'set-valued'"
SOURCE = "Coulomb, Mém. math. phys. Acad. R. Sci. Paris 10, 161 (1785)"
ODD = True
PARAMETERS = {
    "mu_k": Parameter(0.2, "1", "kinetic friction coefficient, in sliding at any speed", minimum=0),
    "mu_s": Parameter(
        0.3, "1", "static friction coefficient, not below mu_k; other contacts know only mu_k", minimum=0
    ),
}
ORDER = (("mu_k", "mu_s"),)


def force(w: sp.Expr, mu_k: sp.Expr, mu_s: sp.Expr) -> sp.Expr:
    """Return mu_k sgn w for the sliding velocity w (m/s); unit 1."""
    return mu_k * sp.sign(w)


def static(mu_s: sp.Expr) -> sp.Expr:
    """Return the static coefficient mu_s; unit 1."""
    return mu_s
