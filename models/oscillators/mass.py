"""Free mass without spring or force, non-dimensional: the node of a Fermi-Pasta-Ulam-Tsingou chain."""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "free mass; with the coupling 'fput' a Fermi-Pasta-Ulam-Tsingou chain"
SOURCE = "Fermi, Pasta & Ulam, Los Alamos report LA-1940 (1955); Ford, Phys. Rep. 213, 271 (1992)"
FRICTION = False
PARAMETERS: dict[str, Parameter] = {}


def kinetic(v: sp.Expr) -> sp.Expr:
    """Return the kinetic energy v^2 / 2."""
    return v**2 / 2


def potential() -> sp.Expr:
    """Return 0: nothing holds the mass."""
    return sp.S.Zero
