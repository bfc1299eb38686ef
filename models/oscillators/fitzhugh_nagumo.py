"""FitzHugh and Nagumo's model of an excitable nerve membrane, in FitzHugh's form."""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "excitable or oscillating nerve membrane; x is its voltage, y its recovery"
SOURCE = "FitzHugh, Biophys. J. 1, 445 (1961), eqs. 1 and 2; Nagumo, Arimoto & Yoshizawa, Proc. IRE 50, 2061 (1962)"
FRICTION = False
PARAMETERS = {
    "a": Parameter(0.7, "1", "shift of the recovery"),
    "b": Parameter(0.8, "1", "decay of the recovery"),
    "c": Parameter(3.0, "1", "root of the ratio of the time scales of recovery and voltage", positive=True),
    "current": Parameter(-0.4, "1", "stimulus, FitzHugh's z: at rest for 0, oscillating near -0.4"),
}
STATE = ("x", "y")
INITIAL = {"x": 1.0}


def field(x: sp.Expr, y: sp.Expr, a: sp.Expr, b: sp.Expr, c: sp.Expr, current: sp.Expr) -> tuple[sp.Expr, ...]:
    """Return the rates c (y + x - x^3/3 + current) and -(x - a + b y)/c."""
    return c * (y + x - x**3 / 3 + current), -(x - a + b * y) / c
