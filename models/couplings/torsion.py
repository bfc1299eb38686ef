"""Coupling of two angles by the sine of their difference."""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "torque proportional to the sine of the difference of two angles"
SOURCE = "Tanaka, Lichtenberg & Oishi, Phys. Rev. Lett. 78, 2104 (1997): Kuramoto's coupling of rotors with inertia"
PARAMETERS = {"sigma": Parameter(0.0, "N*m", "largest torque of the coupling", minimum=0)}


def potential(q_i: sp.Expr, q_j: sp.Expr, weight: sp.Expr, sigma: sp.Expr) -> sp.Expr:
    """Return the energy sigma weight (1 - cos(q_i - q_j)) (J, sigma in N*m)."""
    return sigma * weight * (1 - sp.cos(q_i - q_j))
