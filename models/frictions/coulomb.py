"""Friction coefficient mu, independent of the sliding speed."""

from ..definitions.inline import friction_law
from ..mechanics.parameter import Parameter

FRICTION = friction_law(
    "mu*sign(w)",
    {"mu": Parameter(0.3, "1", "friction coefficient", minimum=0)},
    source="Coulomb, Mém. math. phys. Acad. R. Sci. Paris 10, 161 (1785); Den Hartog, Phil. Mag. 9, 801 (1930)",
)
