"""Friction coefficient that falls hyperbolically with the sliding speed, from mu_s towards 0."""

from ..definitions.inline import friction_law
from ..mechanics.parameter import Parameter

FRICTION = friction_law(
    "mu_s*sign(w)/(1 + delta*abs(w))",
    {
        "mu_s": Parameter(0.3, "1", "static friction coefficient, f(0+)", minimum=0),
        "delta": Parameter(3.0, "s/m", "one over the sliding speed at which half of mu_s is left", minimum=0),
    },
    source="Leine, van Campen, de Kraker, van den Steen, Nonlinear Dynamics 16, 41 (1998)",
)
