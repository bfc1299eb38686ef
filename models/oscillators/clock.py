"""Pendulum clock: a pendulum with an escapement that feeds small swings and brakes large ones.

Non-dimensional: lengths in units of the pendulum's length l, times in units of sqrt(l/g), masses in units of the bob's.
"""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "pendulum with an escapement as van der Pol's damping; clocks hang from a beam by the coupling 'hanging'"
SOURCE = (
    "Pantaleone, Am. J. Phys. 70, 992 (2002): escapement; Bennett et al., Proc. R. Soc. Lond. A 458, 563 (2002): beam"
)
FRICTION = False
COORDINATES = {"theta": ("theta_rate", "1")}
PARAMETERS = {
    "escapement": Parameter(0.01, "1", "strength of the escapement, damping of large swings"),
    "swing": Parameter(0.39, "1", "angle in rad at which the escapement neither feeds nor brakes", minimum=1e-3),
}


def kinetic(theta_rate: sp.Expr) -> sp.Expr:
    """Return the kinetic energy theta'^2 / 2 with the pivot at rest."""
    return theta_rate**2 / 2


def potential(theta: sp.Expr) -> sp.Expr:
    """Return the energy 1 - cos theta in the field of gravity."""
    return 1 - sp.cos(theta)


def force(theta: sp.Expr, theta_rate: sp.Expr, escapement: sp.Expr, swing: sp.Expr) -> sp.Expr:
    """Return the torque -escapement ((theta/swing)^2 - 1) theta' of the escapement."""
    return -escapement * ((theta / swing) ** 2 - 1) * theta_rate
