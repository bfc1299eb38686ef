"""Mass on a moving belt with dry friction, held by a spring with a driven end.

m x'' = -k (x - U cos Omega t) + F_N f(v_b - x'), with mass m (kg), stiffness k (N/m), drive amplitude U (m) and
frequency Omega (rad/s), normal load F_N (N), belt speed v_b (m/s) and friction coefficient f (1).
"""

from ..definitions.inline import Lagrangian
from ..mechanics.parameter import Parameter

OSCILLATOR = Lagrangian(
    T="m*v**2/2",
    V="k*(x - U*cos(Omega*t))**2/2",
    Q={"x": "F_N*friction(v_b - v)"},
    coordinates={"x": "v"},
    friction="exponential",
    parameters={
        "theta_b": Parameter(0.1, "m/s", "belt speed"),
        "epsilon": Parameter(2.0, "N", "normal load", minimum=0),
        "u": Parameter(0.1, "m", "amplitude of the drive", minimum=0),
        "omega": Parameter(1.15, "rad/s", "frequency of the drive", minimum=0),
    },
    # Units of mass m, of length x0 = g/omega0^2 and of time 1/omega0, with omega0 = sqrt(k/m).
    scaling={
        "units": {"m": "kg", "k": "N/m", "g": "m/s^2", "x": "m"},
        "scales": {"kg": "m", "m": "g*m/k", "s": "sqrt(m/k)"},
        "physical": {"theta_b": "v_b", "epsilon": "F_N", "u": "U", "omega": "Omega"},
    },
    source="Marszal, Saha, Jankowski, Stefański, Eur. Phys. J. Special Topics (2016), eqs. 2 and 3, table 1",
)
