"""Duffing oscillator with linear damping and harmonic force, non-dimensional."""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "oscillator with a cubic spring, linear damping and a harmonic force"
SOURCE = (
    "Duffing, Erzwungene Schwingungen bei veränderlicher Eigenfrequenz (Vieweg, 1918); "
    "Kovacic & Brennan, The Duffing Equation (Wiley, 2011)"
)
FRICTION = False
PARAMETERS = {
    "delta": Parameter(0.1, "1", "damping coefficient", minimum=0),
    "beta": Parameter(1.0, "1", "cubic part of the spring"),
    "u": Parameter(0.3, "1", "amplitude of the force", minimum=0),
    "omega": Parameter(1.0, "1", "frequency of the force", minimum=0),
}


def kinetic(v: sp.Expr) -> sp.Expr:
    """Return the kinetic energy v^2 / 2."""
    return v**2 / 2


def potential(x: sp.Expr, t: sp.Expr, beta: sp.Expr, u: sp.Expr, omega: sp.Expr) -> sp.Expr:
    """Return the energy x^2/2 + beta x^4/4 of the spring less the work u x cos(omega t) of the force."""
    return x**2 / 2 + beta * x**4 / 4 - u * x * sp.cos(omega * t)


def force(v: sp.Expr, delta: sp.Expr) -> sp.Expr:
    """Return the damping force -delta v."""
    return -delta * v
