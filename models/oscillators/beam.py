"""Common beam of pendulum clocks, free to move to and fro; clocks hang from it by the coupling 'hanging'.

Non-dimensional as the clocks are: masses in units of a bob's, lengths of a pendulum's, times of sqrt(l/g).
"""

from ..definitions.inline import Lagrangian
from ..mechanics.parameter import Parameter

OSCILLATOR = Lagrangian(
    T="mass*v**2/2",
    V="stiffness*x**2/2",
    Q={"x": "-drag*v"},
    coordinates={"x": "v"},
    parameters={
        "mass": Parameter(30.0, "1", "mass of the beam without the bobs, over that of a bob", minimum=1e-6),
        "drag": Parameter(1.0, "1", "damping coefficient of the beam", minimum=0),
        "stiffness": Parameter(0.0, "1", "stiffness of a spring that holds the beam, 0 for none", minimum=0),
    },
    source="Bennett, Schatz, Rockwood & Wiesenfeld, Proc. R. Soc. Lond. A 458, 563 (2002)",
)
