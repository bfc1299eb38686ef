"""Lorenz's three modes of convection in a fluid layer that is heated from below."""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "chaotic vector field of a convection roll; x is its speed, y and z are temperature differences"
SOURCE = (
    "Lorenz, J. Atmos. Sci. 20, 130 (1963), eqs. 25-27, who writes sigma and r for prandtl and rayleigh; "
    "b = 2 in Huang, Chen, Lai & Pecora, Phys. Rev. E 80, 036204 (2009)"
)
FRICTION = False
PARAMETERS = {
    "prandtl": Parameter(10.0, "1", "Prandtl number, viscosity over thermal diffusivity", minimum=0),
    "rayleigh": Parameter(28.0, "1", "Rayleigh number over its critical value", minimum=0),
    "b": Parameter(8 / 3, "1", "shape of the roll, 4/(1 + (height/width)^2)", minimum=0),
}
STATE = ("x", "y", "z")
INITIAL = {"x": 1.0, "y": 1.0, "z": 20.0}


def field(x: sp.Expr, y: sp.Expr, z: sp.Expr, prandtl: sp.Expr, rayleigh: sp.Expr, b: sp.Expr) -> tuple[sp.Expr, ...]:
    """Return the rates prandtl (y - x), x (rayleigh - z) - y and x y - b z."""
    return prandtl * (y - x), x * (rayleigh - z) - y, x * y - b * z
