"""Inerter; force proportional to the difference of the accelerations, so that the mass matrix is the graph's."""

from ..definitions.inline import link_energy
from ..mechanics.parameter import Parameter

COUPLING = link_energy(
    T="sigma*W*(v_i - v_j)**2/2",
    parameters={"sigma": Parameter(0.0, "kg", "inertance of the coupling", minimum=0)},
    source="Smith, IEEE Trans. Automat. Control 47, 1648 (2002)",
)
