"""A mass on a belt that turns back and forth, held by a spring: x'' = -x + epsilon f(theta_b cos(nu
t) - x').

A plug-in of the benchmark `stability`, named there by its path.
"""

import sympy as sp

from synchain.models.mechanics.parameter import Parameter

SUMMARY = "mass on a belt whose speed is theta_b cos(nu t), with dry friction"
SOURCE = "as the oscillator `friction`, with another motion of the belt"
FRICTION = True
PARAMETERS = {
    "theta_b": Parameter(0.1, "m/s", "largest speed of the belt"),
    "nu": Parameter(1.0, "rad/s", "frequency with which the belt turns back and forth", minimum=0),
    "epsilon": Parameter(2.0, "N", "normal load", minimum=0),
}


def kinetic(v: sp.Expr) -> sp.Expr:
    """Return the kinetic energy v^2 / 2 of a unit mass."""
    return v**2 / 2


def potential(x: sp.Expr) -> sp.Expr:
    """Return the energy x^2 / 2 of a unit spring."""
    return x**2 / 2


def force(v: sp.Expr, t: sp.Expr, theta_b: sp.Expr, nu: sp.Expr, epsilon: sp.Expr, friction: sp.Function) -> sp.Expr:
    """Return the friction force epsilon f(theta_b cos(nu t) - v)."""
    return epsilon * friction(theta_b * sp.cos(nu * t) - v)
