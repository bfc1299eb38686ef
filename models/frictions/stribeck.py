"""Friction coefficient that falls from mu_s to mu_k over the Stribeck speed v_s, plus viscous growth c w.

The general law has exp(-|w/v_s|^delta). Here delta = 2, the Gaussian form; delta = 1 is `exponential` with a = 1/v_s.
"""

from ..definitions.inline import friction_law
from ..mechanics.parameter import Parameter

FRICTION = friction_law(
    "(mu_k + (mu_s - mu_k)*exp(-(w/v_s)**2))*sign(w) + c*w",
    {
        "mu_s": Parameter(0.3, "1", "static friction coefficient, f(0+)", minimum=0),
        "mu_k": Parameter(0.15, "1", "kinetic friction coefficient, f for v_s << w while c w is small", minimum=0),
        "v_s": Parameter(0.4, "m/s", "Stribeck speed, over which friction falls", positive=True),
        "c": Parameter(0.0, "s/m", "viscous part, growth of the coefficient per speed", minimum=0),
    },
    source="Stribeck, Z. Ver. dt. Ing. 46, 1341 (1902); Gaussian form: Armstrong-Hélouvry, Dupont, Canudas de Wit, "
    "Automatica 30, 1083 (1994)",
)
