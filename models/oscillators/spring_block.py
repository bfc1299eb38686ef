"""Block of the Burridge-Knopoff chain: a spring pulls it over a rough surface that moves away below it at constant speed.

m x'' = -k x + F_0 f(V - x'), with mass m (kg), stiffness k (N/m) of the spring to the slider, scale F_0 (N) of the friction
force and pulling speed V (m/s); joined by springs of stiffness sigma k, sigma = l^2 of Carlson & Langer.  Their friction
1/(1 + 2 alpha |w|) is the law "hyperbolic" with mu_s = 1 and delta = 2 alpha; unlike theirs it acts in both directions,
so that a block may slip back.  Displacements are counted along the surface, opposite to theirs.
"""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "block of the Burridge-Knopoff chain: a mass dragged by a rough surface, held by a spring"
SOURCE = (
    "Burridge & Knopoff, Bull. Seismol. Soc. Am. 57, 341 (1967); Carlson & Langer, Phys. Rev. A 40, 6470 (1989): "
    "scaled by the spring to the slider, the mass and F_0"
)
FRICTION = True
PARAMETERS = {"nu": Parameter(0.01, "m/s", "pulling speed")}
PHYSICAL = {"nu": "V"}
UNITS = {"m": "kg", "k": "N/m", "F_0": "N"}


def kinetic(v: sp.Expr, m: sp.Expr) -> sp.Expr:
    """Return the kinetic energy m v^2 / 2 (J)."""
    return m * v**2 / 2


def potential(x: sp.Expr, k: sp.Expr) -> sp.Expr:
    """Return the energy k x^2 / 2 of the spring to the slider (J)."""
    return k * x**2 / 2


def force(v: sp.Expr, F_0: sp.Expr, V: sp.Expr, friction: sp.Function) -> sp.Expr:
    """Return the friction force F_0 f(V - v) (N)."""
    return F_0 * friction(V - v)


def scales(m: sp.Expr, k: sp.Expr, F_0: sp.Expr) -> dict[str, sp.Expr]:
    """Return the units of mass m, of length F_0/k and of time sqrt(m/k)."""
    return {"kg": m, "m": F_0 / k, "s": sp.sqrt(m / k)}
