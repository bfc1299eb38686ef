"""Coulomb friction: independent of the sliding speed."""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "friction coefficient mu, independent of the sliding speed"
SOURCE = "Coulomb, Mém. math. phys. Acad. R. Sci. Paris 10, 161 (1785); Den Hartog, Phil. Mag. 9, 801 (1930)"
ODD = True
PARAMETERS = {"mu": Parameter(0.3, "1", "friction coefficient", minimum=0)}


def force(w: sp.Expr, mu: sp.Expr) -> sp.Expr:
    """Return mu sgn w for the sliding velocity w (m/s); unit 1."""
    return mu * sp.sign(w)
