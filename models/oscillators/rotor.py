"""Rotor with inertia, damping and a constant drive; coupled by "torsion" it is Kuramoto's model with inertia."""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "driven and damped rotor; with the coupling 'torsion' Kuramoto's model with inertia"
SOURCE = (
    "Tanaka, Lichtenberg & Oishi, Phys. Rev. Lett. 78, 2104 (1997); "
    "Filatrella, Nielsen & Pedersen, Eur. Phys. J. B 61, 485 (2008)"
)
FRICTION = False
PARAMETERS = {
    "power": Parameter(0.0, "1", "constant torque, the power fed in at speed 1"),
    "delta": Parameter(0.1, "1", "damping coefficient", minimum=0),
}


def kinetic(v: sp.Expr) -> sp.Expr:
    """Return the kinetic energy v^2 / 2."""
    return v**2 / 2


def potential(x: sp.Expr, power: sp.Expr) -> sp.Expr:
    """Return minus the work of the constant torque, -power x."""
    return -power * x


def dissipation(v: sp.Expr, delta: sp.Expr) -> sp.Expr:
    """Return Rayleigh's function delta v^2 / 2 of the damping."""
    return delta * v**2 / 2
