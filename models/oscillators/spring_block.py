"""Block of the Burridge-Knopoff chain: a mass dragged by a rough surface, held by a spring.

m x'' = -k x + F_0 f(V - x'), with mass m (kg), stiffness k (N/m) of the spring to the slider, scale F_0 (N) of the friction
force and pulling speed V (m/s); joined by springs of stiffness sigma k, sigma = l^2 of Carlson & Langer. Their friction
1/(1 + 2 alpha |w|) is the law "hyperbolic" with mu_s = 1 and delta = 2 alpha; unlike theirs it acts in both directions,
so that a block may slip back. Displacements are counted along the surface, opposite to theirs.
"""

from ..definitions.inline import Lagrangian
from ..mechanics.parameter import Parameter

OSCILLATOR = Lagrangian(
    T="m*v**2/2",
    V="k*x**2/2",
    Q={"x": "F_0*friction(V - v)"},
    coordinates={"x": "v"},
    friction="exponential",
    parameters={"nu": Parameter(0.01, "m/s", "pulling speed")},
    scaling={
        "units": {"m": "kg", "k": "N/m", "F_0": "N", "x": "m"},
        "scales": {"kg": "m", "m": "F_0/k", "s": "sqrt(m/k)"},
        "physical": {"nu": "V"},
    },
    source="Burridge & Knopoff, Bull. Seismol. Soc. Am. 57, 341 (1967); Carlson & Langer, Phys. Rev. A 40, 6470 (1989): "
    "scaled by the spring to the slider, the mass and F_0",
)
