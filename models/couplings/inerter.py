"""Inerter between equal coordinates of two oscillators: a force proportional to the difference of the accelerations."""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "inerter; force proportional to the difference of the accelerations, so that the mass matrix is the graph's"
SOURCE = "Smith, IEEE Trans. Automat. Control 47, 1648 (2002)"
PARAMETERS = {"sigma": Parameter(0.0, "kg", "inertance of the coupling", minimum=0)}


def kinetic(v_i: sp.Expr, v_j: sp.Expr, weight: sp.Expr, sigma: sp.Expr) -> sp.Expr:
    """Return the energy sigma weight (v_i - v_j)^2 / 2 of the inerter (J, sigma in kg)."""
    return sigma * weight * (v_i - v_j) ** 2 / 2
