"""A clock's pivot moves with a beam; joins a clock and a beam."""

from ..definitions.inline import link_energy
from ..mechanics.parameter import Parameter

COUPLING = link_energy(
    T="sigma*W*(v**2/2 + v*theta_rate*cos(theta))",  # what the velocity v of the pivot adds to the energy of a bob
    between={"clock": ["theta", "theta_rate"], "beam": ["v"]},
    parameters={
        "sigma": Parameter(1.0, "1", "mass of the bob that the beam carries; 1 is a clock like the others", minimum=0)
    },
    source="Bennett, Schatz, Rockwood & Wiesenfeld, Proc. R. Soc. Lond. A 458, 563 (2002)",
)
