"""Double pendulum below a cart that dry friction drags along on a moving belt and a spring holds back.

The cart (m, kg) is the friction oscillator of Marszal et al. without its drive; the angles phi and psi of the rods are
counted from the vertical.  The normal load F_N is constant: the guide of the cart takes up the vertical reaction of the
pendulums.
"""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "double pendulum below a cart on a moving belt with dry friction; three coordinates"
SOURCE = (
    "Landau & Lifshitz, Mechanics, 3rd ed. (Pergamon, 1976), sect. 5, problems 1 and 2; the cart: Marszal, Saha, Jankowski, "
    "Stefański, Eur. Phys. J. Special Topics (2016), eq. 2"
)
FRICTION = True
PARAMETERS = {
    "theta_b": Parameter(0.1, "m/s", "belt speed"),
    "epsilon": Parameter(2.0, "N", "normal load of the cart", minimum=0),
    "mass_1": Parameter(0.1, "kg", "upper mass of the pendulum", positive=True),
    "mass_2": Parameter(0.1, "kg", "lower mass of the pendulum", positive=True),
    "length_1": Parameter(1.0, "m", "upper rod", positive=True),
    "length_2": Parameter(1.0, "m", "lower rod", positive=True),
    "damping": Parameter(0.0, "N*m*s", "damping coefficient of either joint", minimum=0),
}
PHYSICAL = {
    "theta_b": "v_b",
    "epsilon": "F_N",
    "mass_1": "m_1",
    "mass_2": "m_2",
    "length_1": "l_1",
    "length_2": "l_2",
    "damping": "d",
}
UNITS = {"m": "kg", "k": "N/m", "g": "m/s^2"}
COORDINATES = {"x": ("v", "m"), "phi": ("w_phi", "1"), "psi": ("w_psi", "1")}


def kinetic(
    v: sp.Expr,
    phi: sp.Expr,
    psi: sp.Expr,
    w_phi: sp.Expr,
    w_psi: sp.Expr,
    m: sp.Expr,
    m_1: sp.Expr,
    m_2: sp.Expr,
    l_1: sp.Expr,
    l_2: sp.Expr,
) -> sp.Expr:
    """Return the kinetic energy of cart and masses (J)."""
    swing = l_1**2 * w_phi**2 + 2 * v * l_1 * w_phi * sp.cos(phi)
    lower = l_2**2 * w_psi**2 + 2 * v * l_2 * w_psi * sp.cos(psi) + 2 * l_1 * l_2 * w_phi * w_psi * sp.cos(phi - psi)
    return (m + m_1 + m_2) * v**2 / 2 + (m_1 + m_2) * swing / 2 + m_2 * lower / 2


def potential(
    x: sp.Expr,
    phi: sp.Expr,
    psi: sp.Expr,
    k: sp.Expr,
    g: sp.Expr,
    m_1: sp.Expr,
    m_2: sp.Expr,
    l_1: sp.Expr,
    l_2: sp.Expr,
) -> sp.Expr:
    """Return the energy of the spring and of the weights (J)."""
    return k * x**2 / 2 - g * ((m_1 + m_2) * l_1 * sp.cos(phi) + m_2 * l_2 * sp.cos(psi))


def force(v: sp.Expr, F_N: sp.Expr, v_b: sp.Expr, friction: sp.Function) -> tuple[sp.Expr, ...]:
    """Return the friction force F_N f(v_b - v) on the cart (N); no torque acts on the angles."""
    return F_N * friction(v_b - v), sp.S.Zero, sp.S.Zero


def dissipation(w_phi: sp.Expr, w_psi: sp.Expr, d: sp.Expr) -> sp.Expr:
    """Return Rayleigh's function of the joints, d (phi'^2 + (psi' - phi')^2) / 2 (W)."""
    return d * (w_phi**2 + (w_psi - w_phi) ** 2) / 2


def particles(
    x: sp.Expr, phi: sp.Expr, psi: sp.Expr, m: sp.Expr, m_1: sp.Expr, m_2: sp.Expr, l_1: sp.Expr, l_2: sp.Expr
) -> tuple[tuple[sp.Expr, sp.Expr, sp.Expr], ...]:
    """Return (mass, across, upward) of the cart and of either mass (kg, m, m)."""
    across, upward = x + l_1 * sp.sin(phi), -l_1 * sp.cos(phi)
    lower = (m_2, across + l_2 * sp.sin(psi), upward - l_2 * sp.cos(psi))
    return (m, x, sp.S.Zero), (m_1, across, upward), lower


def scales(m: sp.Expr, k: sp.Expr, g: sp.Expr) -> dict[str, sp.Expr]:
    """Return the units of the friction oscillator: mass m, length g m/k and time sqrt(m/k)."""
    return {"kg": m, "m": g * m / k, "s": sp.sqrt(m / k)}
