"""Beam that carries clocks: a mass that moves to and fro against damping and, where it is held, a spring.

Non-dimensional as the clocks are: masses in units of a bob's, lengths of a pendulum's, times of sqrt(l/g).
"""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "common beam of pendulum clocks, free to move to and fro; clocks hang from it by the coupling 'hanging'"
SOURCE = "Bennett, Schatz, Rockwood & Wiesenfeld, Proc. R. Soc. Lond. A 458, 563 (2002)"
FRICTION = False
PARAMETERS = {
    "mass": Parameter(30.0, "1", "mass of the beam without the bobs, over that of a bob", minimum=1e-6),
    "drag": Parameter(1.0, "1", "damping coefficient of the beam", minimum=0),
    "stiffness": Parameter(0.0, "1", "stiffness of a spring that holds the beam, 0 for none", minimum=0),
}


def kinetic(v: sp.Expr, mass: sp.Expr) -> sp.Expr:
    """Return the kinetic energy mass v^2 / 2 of the beam without the bobs."""
    return mass * v**2 / 2


def potential(x: sp.Expr, stiffness: sp.Expr) -> sp.Expr:
    """Return the energy stiffness x^2 / 2 of the spring."""
    return stiffness * x**2 / 2


def force(v: sp.Expr, drag: sp.Expr) -> sp.Expr:
    """Return the drag -drag v."""
    return -drag * v
