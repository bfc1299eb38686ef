"""Friction coefficient that decays exponentially with the sliding speed, from mu_s to mu_k."""

from ..definitions.inline import friction_law
from ..mechanics.parameter import Parameter

FRICTION = friction_law(
    "(mu_k + (mu_s - mu_k)*exp(-a*abs(w)))*sign(w)",
    {
        "mu_s": Parameter(0.3, "1", "static friction coefficient, f(0+)", minimum=0),
        "mu_k": Parameter(0.15, "1", "kinetic friction coefficient, f at large sliding speed", minimum=0),
        "a": Parameter(2.5, "s/m", "rate of decay with the sliding speed", minimum=0),
    },
    source="Marszal, Saha, Jankowski, Stefański, Eur. Phys. J. Special Topics (2016), eq. 4",
)
