"""Self-excited oscillator whose damping is negative for |x| < 1; an optional harmonic force has the amplitude u.

Van der Pol's oscillator, non-dimensional; the damping feeds the motion near x = 0.
"""

from ..definitions.inline import Lagrangian
from ..mechanics.parameter import Parameter

OSCILLATOR = Lagrangian(
    T="v**2/2",
    V="x**2/2 - u*x*cos(omega*t)",
    Q={"x": "mu*(1 - x**2)*v"},
    coordinates={"x": "v"},
    parameters={
        "mu": Parameter(1.0, "1", "strength of the damping", minimum=0),
        "u": Parameter(0.0, "1", "amplitude of the force, 0 for none", minimum=0),
        "omega": Parameter(1.0, "1", "frequency of the force", minimum=0),
    },
    source="van der Pol, Phil. Mag. 2, 978 (1926); with the force: Phil. Mag. 3, 65 (1927)",
)
