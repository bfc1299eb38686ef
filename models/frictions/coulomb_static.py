"""Friction coefficient mu_k in sliding, mu_s at rest with the contact 'set-valued'.

Coulomb friction with a static coefficient: slip begins with a jump of the friction force.
"""

from ..definitions.inline import friction_law
from ..mechanics.parameter import Parameter

FRICTION = friction_law(
    "mu_k*sign(w)",
    {
        "mu_k": Parameter(0.2, "1", "kinetic friction coefficient, in sliding at any speed", minimum=0),
        "mu_s": Parameter(
            0.3, "1", "static friction coefficient, not below mu_k; other contacts know only mu_k", minimum=0
        ),
    },
    static="mu_s",
    order=[("mu_k", "mu_s")],
    source="Coulomb, Mém. math. phys. Acad. R. Sci. Paris 10, 161 (1785)",
)
