"""Harmonic oscillator without friction or force, non-dimensional: its networks have closed-form normal modes."""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "undamped linear oscillator of frequency 1; a network of them has frequencies sqrt(1 - sigma gamma_k)"
SOURCE = "Rayleigh, The Theory of Sound, vol. 1, ch. 4-5 (Macmillan, 1877)"
FRICTION = False
PARAMETERS: dict[str, Parameter] = {}


def kinetic(v: sp.Expr) -> sp.Expr:
    """Return the kinetic energy v^2 / 2."""
    return v**2 / 2


def potential(x: sp.Expr) -> sp.Expr:
    """Return the energy x^2 / 2 of the spring."""
    return x**2 / 2
