"""Friction damper between equal coordinates of two oscillators: a force that saturates with the sliding speed."""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "friction damper; force sigma v_0 tanh(w/v_0) for the difference w of the velocities, at most sigma v_0"
SOURCE = "Andersson, Söderberg & Björklund, Tribology International 40, 580 (2007): friction smoothed by tanh"
PARAMETERS = {
    "sigma": Parameter(0.0, "kg/s", "damping coefficient for slow sliding", minimum=0),
    "v_0": Parameter(0.1, "m/s", "sliding speed at which the force saturates", positive=True),
}


def dissipation(v_i: sp.Expr, v_j: sp.Expr, weight: sp.Expr, sigma: sp.Expr, v_0: sp.Expr) -> sp.Expr:
    """Return Rayleigh's function sigma weight v_0^2 ln cosh(w/v_0), w = v_i - v_j (W), as -ln(1 - tanh^2)/2."""
    return -sigma * weight * v_0**2 * sp.log(1 - sp.tanh((v_i - v_j) / v_0) ** 2) / 2
