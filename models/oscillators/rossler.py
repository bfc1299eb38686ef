"""Chaotic vector field with one quadratic term; a spiral in x and y that folds back through z."""

from ..definitions.inline import Field
from ..mechanics.parameter import Parameter

OSCILLATOR = Field(
    {"x": "-y - z", "y": "x + a*y", "z": "b + (x - c)*z"},
    parameters={
        "a": Parameter(0.2, "1", "growth of the spiral"),
        "b": Parameter(0.2, "1", "constant inflow of z"),
        "c": Parameter(9.0, "1", "value of x above which z grows"),
    },
    initial={"x": 1.0, "y": 1.0},
    source="Rössler, Phys. Lett. A 57, 397 (1976); c = 9 as in Huang, Chen, Lai & Pecora, Phys. Rev. E 80, 036204 (2009), "
    "where the paper of 1976 has 5.7",
)
