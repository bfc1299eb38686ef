"""Plane double pendulum, two angles from the vertical; conservative unless damped.

Two masses on two massless rods, in units of the upper mass, the upper rod l and sqrt(l/g); the mass matrix is full and
depends on the angles.
"""

from ..definitions.inline import Lagrangian
from ..mechanics.parameter import Parameter

OSCILLATOR = Lagrangian(
    T="w_phi**2/2 + mass_ratio*(w_phi**2 + length_ratio**2*w_psi**2 + 2*length_ratio*w_phi*w_psi*cos(phi - psi))/2",
    V="-(1 + mass_ratio)*cos(phi) - mass_ratio*length_ratio*cos(psi)",
    R="delta*(w_phi**2 + (w_psi - w_phi)**2)/2",
    coordinates={"phi": "w_phi", "psi": "w_psi"},
    parameters={
        "mass_ratio": Parameter(1.0, "1", "lower mass over upper mass", positive=True),
        "length_ratio": Parameter(1.0, "1", "lower rod over upper rod", positive=True),
        "delta": Parameter(0.0, "1", "damping coefficient of either joint", minimum=0),
    },
    source="Landau & Lifshitz, Mechanics, 3rd ed. (Pergamon, 1976), sect. 5, problem 1",
)
