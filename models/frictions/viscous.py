"""Friction coefficient proportional to the sliding speed."""

from ..definitions.inline import friction_law
from ..mechanics.parameter import Parameter

FRICTION = friction_law(
    "c*w",
    {"c": Parameter(0.3, "s/m", "growth of the friction coefficient per sliding speed", minimum=0)},
    source="Rayleigh, Proc. London Math. Soc. s1-4, 357 (1873)",
)
