"""Mass on a belt whose speed is theta_b cos(nu t), with dry friction.

x'' = -x + epsilon f(theta_b cos(nu t) - x').  A plug-in of the benchmark `stability`, named there
by its path: the oscillator `friction` with another motion of the belt.
"""

from synchain import Lagrangian, Parameter

OSCILLATOR = Lagrangian(
    T="v**2/2",
    V="x**2/2",
    Q={"x": "epsilon*friction(theta_b*cos(nu*t) - v)"},
    coordinates={"x": "v"},
    friction="exponential",
    parameters={
        "theta_b": Parameter(0.1, "m/s", "largest speed of the belt"),
        "nu": Parameter(1.0, "rad/s", "frequency with which the belt turns back and forth", minimum=0),
        "epsilon": Parameter(2.0, "N", "normal load", minimum=0),
    },
)
