"""Spring with a cubic part; force sigma (r + cubic r^3) for the difference r of the coordinates.

Between free masses it makes the FPUT beta model.
"""

from ..definitions.inline import link_energy
from ..mechanics.parameter import Parameter

COUPLING = link_energy(
    "sigma*W*((q_i - q_j)**2/2 + cubic*(q_i - q_j)**4/4)",
    parameters={
        "sigma": Parameter(0.0, "N/m", "coupling stiffness for small differences", minimum=0),
        "cubic": Parameter(1.0, "m^-2", "cubic part over the linear part; negative for a spring that softens"),
    },
    source="Fermi, Pasta & Ulam, Los Alamos report LA-1940 (1955), cubic forces; Ford, Phys. Rep. 213, 271 (1992)",
)
