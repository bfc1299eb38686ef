"""Plane pendulum; joined by springs (torsion bars) a sine-Gordon chain.

With linear damping and a constant torque, non-dimensional; a chain is the discrete sine-Gordon equation.
"""

from ..definitions.inline import Lagrangian
from ..mechanics.parameter import Parameter

OSCILLATOR = Lagrangian(
    T="v**2/2",
    V="1 - cos(x) - torque*x",
    R="delta*v**2/2",
    coordinates={"x": "v"},
    parameters={
        "delta": Parameter(0.0, "1", "damping coefficient", minimum=0),
        "torque": Parameter(0.0, "1", "constant torque over the largest torque of the weight"),
    },
    source="Scott, Am. J. Phys. 37, 52 (1969): a line of pendulums on a torsion wire",
)
