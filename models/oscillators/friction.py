"""Self-excited friction oscillator: a mass on a moving belt, held by a spring whose far end is driven.

m x'' = -k (x - U cos Omega t) + F_N f(v_b - x'), with mass m (kg), stiffness k (N/m), drive amplitude U (m) and
frequency Omega (rad/s), normal load F_N (N), belt speed v_b (m/s) and friction coefficient f (1).
"""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "mass on a moving belt with dry friction, held by a spring with a driven end"
SOURCE = "Marszal, Saha, Jankowski, Stefański, Eur. Phys. J. Special Topics (2016), eqs. 2 and 3, table 1"
FRICTION = True
PARAMETERS = {
    "theta_b": Parameter(0.1, "m/s", "belt speed"),
    "epsilon": Parameter(2.0, "N", "normal load", minimum=0),
    "u": Parameter(0.1, "m", "amplitude of the drive", minimum=0),
    "omega": Parameter(1.15, "rad/s", "frequency of the drive", minimum=0),
}
PHYSICAL = {"theta_b": "v_b", "epsilon": "F_N", "u": "U", "omega": "Omega"}
UNITS = {"m": "kg", "k": "N/m", "g": "m/s^2"}


def kinetic(v: sp.Expr, m: sp.Expr) -> sp.Expr:
    """Return the kinetic energy m v^2 / 2 (J)."""
    return m * v**2 / 2


def potential(x: sp.Expr, t: sp.Expr, k: sp.Expr, U: sp.Expr, Omega: sp.Expr) -> sp.Expr:
    """Return the energy k (x - U cos Omega t)^2 / 2 of the spring (J)."""
    return k * (x - U * sp.cos(Omega * t)) ** 2 / 2


def force(v: sp.Expr, F_N: sp.Expr, v_b: sp.Expr, friction: sp.Function) -> sp.Expr:
    """Return the friction force F_N f(v_b - v) (N)."""
    return F_N * friction(v_b - v)


def scales(m: sp.Expr, k: sp.Expr, g: sp.Expr) -> dict[str, sp.Expr]:
    """Return the units of mass m, of length x0 = g/omega0^2 and of time 1/omega0, with omega0 = sqrt(k/m)."""
    return {"kg": m, "m": g * m / k, "s": sp.sqrt(m / k)}
