"""Torque proportional to the sine of the difference of two angles."""

from ..definitions.inline import link_energy
from ..mechanics.parameter import Parameter

COUPLING = link_energy(
    "sigma*W*(1 - cos(q_i - q_j))",
    parameters={"sigma": Parameter(0.0, "N*m", "largest torque of the coupling", minimum=0)},
    source="Tanaka, Lichtenberg & Oishi, Phys. Rev. Lett. 78, 2104 (1997): Kuramoto's coupling of rotors with inertia",
)
