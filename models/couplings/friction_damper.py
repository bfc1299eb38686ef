"""Friction damper; force sigma v_0 tanh(w/v_0) for the difference w of the velocities, at most sigma v_0."""

from ..definitions.inline import link_energy
from ..mechanics.parameter import Parameter

COUPLING = link_energy(
    R="-sigma*W*v_0**2*log(1 - tanh((v_i - v_j)/v_0)**2)/2",  # sigma W v_0^2 ln cosh(w/v_0), w = v_i - v_j
    parameters={
        "sigma": Parameter(0.0, "kg/s", "damping coefficient for slow sliding", minimum=0),
        "v_0": Parameter(0.1, "m/s", "sliding speed at which the force saturates", positive=True),
    },
    source="Andersson, Söderberg & Björklund, Tribology International 40, 580 (2007): friction smoothed by tanh",
)
