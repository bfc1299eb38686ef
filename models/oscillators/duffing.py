"""Oscillator with a cubic spring, linear damping and a harmonic force.

Duffing's oscillator, non-dimensional.
"""

from ..definitions.inline import Lagrangian
from ..mechanics.parameter import Parameter

OSCILLATOR = Lagrangian(
    T="v**2/2",
    V="x**2/2 + beta*x**4/4 - u*x*cos(omega*t)",
    Q={"x": "-delta*v"},
    coordinates={"x": "v"},
    parameters={
        "delta": Parameter(0.1, "1", "damping coefficient", minimum=0),
        "beta": Parameter(1.0, "1", "cubic part of the spring"),
        "u": Parameter(0.3, "1", "amplitude of the force", minimum=0),
        "omega": Parameter(1.0, "1", "frequency of the force", minimum=0),
    },
    source="Duffing, Erzwungene Schwingungen bei veränderlicher Eigenfrequenz (Vieweg, 1918); "
    "Kovacic & Brennan, The Duffing Equation (Wiley, 2011)",
)
