"""Van der Pol's oscillator with an optional harmonic force, non-dimensional."""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "self-excited oscillator whose damping is negative for |x| < 1; a harmonic force where u is not 0"
SOURCE = "van der Pol, Phil. Mag. 2, 978 (1926); with the force: Phil. Mag. 3, 65 (1927)"
FRICTION = False
PARAMETERS = {
    "mu": Parameter(1.0, "1", "strength of the damping", minimum=0),
    "u": Parameter(0.0, "1", "amplitude of the force, 0 for none", minimum=0),
    "omega": Parameter(1.0, "1", "frequency of the force", minimum=0),
}


def kinetic(v: sp.Expr) -> sp.Expr:
    """Return the kinetic energy v^2 / 2."""
    return v**2 / 2


def potential(x: sp.Expr, t: sp.Expr, u: sp.Expr, omega: sp.Expr) -> sp.Expr:
    """Return the energy x^2/2 of the spring less the work u x cos(omega t) of the force."""
    return x**2 / 2 - u * x * sp.cos(omega * t)


def force(x: sp.Expr, v: sp.Expr, mu: sp.Expr) -> sp.Expr:
    """Return the damping force mu (1 - x^2) v, which feeds the motion near x = 0."""
    return mu * (1 - x**2) * v
