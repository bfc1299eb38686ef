"""Chaotic vector field of a convection roll; x is its speed, y and z are temperature differences.

Lorenz's three modes of convection in a fluid layer that is heated from below.
"""

from ..definitions.inline import Field
from ..mechanics.parameter import Parameter

OSCILLATOR = Field(
    {"x": "prandtl*(y - x)", "y": "x*(rayleigh - z) - y", "z": "x*y - b*z"},
    parameters={
        "prandtl": Parameter(10.0, "1", "Prandtl number, viscosity over thermal diffusivity", minimum=0),
        "rayleigh": Parameter(28.0, "1", "Rayleigh number over its critical value", minimum=0),
        "b": Parameter(8 / 3, "1", "shape of the roll, 4/(1 + (height/width)^2)", minimum=0),
    },
    initial={"x": 1.0, "y": 1.0, "z": 20.0},
    source="Lorenz, J. Atmos. Sci. 20, 130 (1963), eqs. 25-27, who writes sigma and r for prandtl and rayleigh; "
    "b = 2 in Huang, Chen, Lai & Pecora, Phys. Rev. E 80, 036204 (2009)",
)
