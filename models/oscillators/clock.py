"""Pendulum with an escapement as van der Pol's damping; clocks hang from a beam by the coupling 'hanging'.

The escapement feeds small swings and brakes large ones. Non-dimensional: lengths in units of the pendulum's length l, times
in units of sqrt(l/g), masses in units of the bob's. The kinetic energy is that with the pivot at rest.
"""

from ..definitions.inline import Lagrangian
from ..mechanics.parameter import Parameter

OSCILLATOR = Lagrangian(
    T="theta_rate**2/2",
    V="1 - cos(theta)",
    Q={"theta": "-escapement*((theta/swing)**2 - 1)*theta_rate"},
    coordinates={"theta": "theta_rate"},
    parameters={
        "escapement": Parameter(0.01, "1", "strength of the escapement, damping of large swings"),
        "swing": Parameter(0.39, "1", "angle in rad at which the escapement neither feeds nor brakes", minimum=1e-3),
    },
    source="Pantaleone, Am. J. Phys. 70, 992 (2002): escapement; Bennett et al., Proc. R. Soc. Lond. A 458, 563 (2002): beam",
)
