"""Pendulum with linear damping and a constant torque, non-dimensional; a chain is the discrete sine-Gordon equation."""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "plane pendulum; joined by springs (torsion bars) a sine-Gordon chain"
SOURCE = "Scott, Am. J. Phys. 37, 52 (1969): a line of pendulums on a torsion wire"
FRICTION = False
PARAMETERS = {
    "delta": Parameter(0.0, "1", "damping coefficient", minimum=0),
    "torque": Parameter(0.0, "1", "constant torque over the largest torque of the weight"),
}


def kinetic(v: sp.Expr) -> sp.Expr:
    """Return the kinetic energy v^2 / 2."""
    return v**2 / 2


def potential(x: sp.Expr, torque: sp.Expr) -> sp.Expr:
    """Return the energy 1 - cos x of the weight less the work of the torque, torque x."""
    return 1 - sp.cos(x) - torque * x


def dissipation(v: sp.Expr, delta: sp.Expr) -> sp.Expr:
    """Return Rayleigh's function delta v^2 / 2 of the damping."""
    return delta * v**2 / 2
