"""Linear damper; force proportional to the difference of the velocities."""

from ..definitions.inline import link_energy
from ..mechanics.parameter import Parameter

COUPLING = link_energy(
    R="sigma*W*(v_i - v_j)**2/2",
    parameters={"sigma": Parameter(0.0, "kg/s", "damping coefficient of the coupling", minimum=0)},
    source="Rayleigh, Proc. London Math. Soc. s1-4, 357 (1873): dissipation function",
)
