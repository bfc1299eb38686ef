"""A clock that hangs from a beam: the pendulum's pivot moves with the beam."""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "a clock's pivot moves with a beam; joins a clock and a beam"
SOURCE = "Bennett, Schatz, Rockwood & Wiesenfeld, Proc. R. Soc. Lond. A 458, 563 (2002)"
PARAMETERS = {
    "sigma": Parameter(1.0, "1", "mass of the bob that the beam carries; 1 is a clock like the others", minimum=0)
}
BETWEEN = ("clock", "beam")


def kinetic(theta: sp.Expr, theta_rate: sp.Expr, v: sp.Expr, weight: sp.Expr, sigma: sp.Expr) -> sp.Expr:
    """Return what the velocity v of the pivot adds to the energy of a bob, sigma weight (v^2/2 + v theta' cos theta)."""
    return sigma * weight * (v**2 / 2 + v * theta_rate * sp.cos(theta))
