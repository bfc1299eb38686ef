"""Double pendulum below a cart on a moving belt with dry friction; three coordinates.

A spring holds the cart back. The cart (m, kg) is the friction oscillator of Marszal et al. without its drive; the angles
phi and psi of the rods are counted from the vertical. The normal load F_N is constant: the guide of the cart takes up the
vertical reaction of the pendulums.
"""

from ..definitions.inline import Lagrangian
from ..mechanics.parameter import Parameter

OSCILLATOR = Lagrangian(
    T="(m + m_1 + m_2)*v**2/2 + (m_1 + m_2)*(l_1**2*w_phi**2 + 2*v*l_1*w_phi*cos(phi))/2"
    " + m_2*(l_2**2*w_psi**2 + 2*v*l_2*w_psi*cos(psi) + 2*l_1*l_2*w_phi*w_psi*cos(phi - psi))/2",
    V="k*x**2/2 - g*((m_1 + m_2)*l_1*cos(phi) + m_2*l_2*cos(psi))",
    Q={"x": "F_N*friction(v_b - v)"},
    R="d*(w_phi**2 + (w_psi - w_phi)**2)/2",
    coordinates={"x": "v", "phi": "w_phi", "psi": "w_psi"},
    friction="exponential",
    parameters={
        "theta_b": Parameter(0.1, "m/s", "belt speed"),
        "epsilon": Parameter(2.0, "N", "normal load of the cart", minimum=0),
        "mass_1": Parameter(0.1, "kg", "upper mass of the pendulum", positive=True),
        "mass_2": Parameter(0.1, "kg", "lower mass of the pendulum", positive=True),
        "length_1": Parameter(1.0, "m", "upper rod", positive=True),
        "length_2": Parameter(1.0, "m", "lower rod", positive=True),
        "damping": Parameter(0.0, "N*m*s", "damping coefficient of either joint", minimum=0),
    },
    scaling={
        "units": {"m": "kg", "k": "N/m", "g": "m/s^2", "x": "m"},
        "scales": {"kg": "m", "m": "g*m/k", "s": "sqrt(m/k)"},
        "physical": {
            "theta_b": "v_b",
            "epsilon": "F_N",
            "mass_1": "m_1",
            "mass_2": "m_2",
            "length_1": "l_1",
            "length_2": "l_2",
            "damping": "d",
        },
    },
    source="Landau & Lifshitz, Mechanics, 3rd ed. (Pergamon, 1976), sect. 5, problems 1 and 2; the cart: Marszal, Saha, "
    "Jankowski, Stefański, Eur. Phys. J. Special Topics (2016), eq. 2",
)
