"""Plane double pendulum: two masses on two massless rods, both angles counted from the vertical.

In units of the upper mass, the upper rod l and sqrt(l/g); the mass matrix is full and depends on the angles.
"""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "plane double pendulum, two angles from the vertical; conservative unless damped"
SOURCE = "Landau & Lifshitz, Mechanics, 3rd ed. (Pergamon, 1976), sect. 5, problem 1"
FRICTION = False
PARAMETERS = {
    "mass_ratio": Parameter(1.0, "1", "lower mass over upper mass", positive=True),
    "length_ratio": Parameter(1.0, "1", "lower rod over upper rod", positive=True),
    "delta": Parameter(0.0, "1", "damping coefficient of either joint", minimum=0),
}
COORDINATES = {"phi": ("w_phi", "1"), "psi": ("w_psi", "1")}


def kinetic(
    phi: sp.Expr, psi: sp.Expr, w_phi: sp.Expr, w_psi: sp.Expr, mass_ratio: sp.Expr, length_ratio: sp.Expr
) -> sp.Expr:
    """Return the kinetic energy of both masses."""
    lower = w_phi**2 + length_ratio**2 * w_psi**2 + 2 * length_ratio * w_phi * w_psi * sp.cos(phi - psi)
    return w_phi**2 / 2 + mass_ratio * lower / 2


def potential(phi: sp.Expr, psi: sp.Expr, mass_ratio: sp.Expr, length_ratio: sp.Expr) -> sp.Expr:
    """Return the energy of both weights, counted from the joint at the top."""
    return -(1 + mass_ratio) * sp.cos(phi) - mass_ratio * length_ratio * sp.cos(psi)


def dissipation(w_phi: sp.Expr, w_psi: sp.Expr, delta: sp.Expr) -> sp.Expr:
    """Return Rayleigh's function of the joints, delta (phi'^2 + (psi' - phi')^2) / 2."""
    return delta * (w_phi**2 + (w_psi - w_phi) ** 2) / 2


def particles(
    phi: sp.Expr, psi: sp.Expr, mass_ratio: sp.Expr, length_ratio: sp.Expr
) -> tuple[tuple[sp.Expr, sp.Expr, sp.Expr], ...]:
    """Return (mass, across, upward) of either mass, the joint at the top at (0, 0)."""
    across, upward = sp.sin(phi), -sp.cos(phi)
    lower = (mass_ratio, across + length_ratio * sp.sin(psi), upward - length_ratio * sp.cos(psi))
    return (sp.S.One, across, upward), lower
