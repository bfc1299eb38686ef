"""Driven and damped rotor; with the coupling 'torsion' Kuramoto's model with inertia."""

from ..definitions.inline import Lagrangian
from ..mechanics.parameter import Parameter

OSCILLATOR = Lagrangian(
    T="v**2/2",
    V="-power*x",
    R="delta*v**2/2",
    coordinates={"x": "v"},
    parameters={
        "power": Parameter(0.0, "1", "constant torque, the power fed in at speed 1"),
        "delta": Parameter(0.1, "1", "damping coefficient", minimum=0),
    },
    source="Tanaka, Lichtenberg & Oishi, Phys. Rev. Lett. 78, 2104 (1997); "
    "Filatrella, Nielsen & Pedersen, Eur. Phys. J. B 61, 485 (2008)",
)
