"""Pendulum that hangs from a rotating shaft with dry friction.

Froude's pendulum: friction of the sleeve drags it along and can make it swing. In units of the pendulum's own mass, length
and sqrt(length/g): x'' = -sin x - damping x' + epsilon f(shaft - x'), epsilon the radial load times the radius of the shaft
over the largest torque of the weight.
"""

from ..definitions.inline import Lagrangian
from ..mechanics.parameter import Parameter

OSCILLATOR = Lagrangian(
    T="v**2/2",
    V="1 - cos(x)",
    Q={"x": "epsilon*friction(shaft - v)"},
    R="damping*v**2/2",
    coordinates={"x": "v"},
    friction="exponential",
    parameters={
        "shaft": Parameter(0.5, "1", "angular speed of the shaft"),
        "epsilon": Parameter(1.0, "1", "load of the sleeve: friction torque for the coefficient 1", minimum=0),
        "damping": Parameter(0.01, "1", "coefficient of the damping by air", minimum=0),
    },
    source="W. Froude in Rayleigh, The Theory of Sound, vol. 1, 2nd ed. (Macmillan, 1894); "
    "Andronov, Vitt & Khaikin, Theory of Oscillators (Pergamon, 1966)",
)
