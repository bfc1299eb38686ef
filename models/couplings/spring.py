"""Linear spring; stiffness sigma times the stiffness of the oscillator's own spring."""

from ..definitions.inline import link_energy
from ..mechanics.parameter import Parameter

COUPLING = link_energy(
    "sigma*W*(q_i - q_j)**2/2",
    parameters={"sigma": Parameter(0.0, "N/m", "coupling stiffness", minimum=0)},
    source="Marszal, Saha, Jankowski, Stefański, Eur. Phys. J. Special Topics (2016), eqs. 6-8",
)
