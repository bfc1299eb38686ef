"""Spring of the Fermi-Pasta-Ulam-Tsingou chain; force sigma (r + fput_alpha r^2 + fput_beta r^3), r its extension.

The quadratic part makes the alpha model, the cubic part the beta model. The quadratic part tells tension from compression,
so a link has a direction: r = q_j - q_i is its extension where it runs from node i to node j, from the smaller to the larger
number, and round a ring (`synchain.models.interactions.link`).
"""

from ..definitions.inline import link_energy
from ..mechanics.parameter import Parameter

COUPLING = link_energy(
    "sigma*W*((q_j - q_i)**2/2 + fput_alpha*(q_j - q_i)**3/3 + fput_beta*(q_j - q_i)**4/4)",
    parameters={
        "sigma": Parameter(1.0, "N/m", "coupling stiffness for small extensions", minimum=0),
        "fput_alpha": Parameter(0.25, "1/m", "quadratic part over the linear part"),
        "fput_beta": Parameter(0.0, "m^-2", "cubic part over the linear part"),
    },
    source="Fermi, Pasta & Ulam, Los Alamos report LA-1940 (1955); Ford, Phys. Rep. 213, 271 (1992)",
)
