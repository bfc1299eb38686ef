"""Froude's pendulum: it hangs by a sleeve from a rotating shaft, whose dry friction drags it along and can make it swing.

In units of the pendulum's own mass, length and sqrt(length/g): x'' = -sin x - damping x' + epsilon f(shaft - x'), epsilon
the radial load times the radius of the shaft over the largest torque of the weight.
"""

import sympy as sp

from ..mechanics.parameter import Parameter

SUMMARY = "pendulum that hangs from a rotating shaft with dry friction"
SOURCE = (
    "W. Froude in Rayleigh, The Theory of Sound, vol. 1, 2nd ed. (Macmillan, 1894); "
    "Andronov, Vitt & Khaikin, Theory of Oscillators (Pergamon, 1966)"
)
FRICTION = True
PARAMETERS = {
    "shaft": Parameter(0.5, "1", "angular speed of the shaft"),
    "epsilon": Parameter(1.0, "1", "load of the sleeve: friction torque for the coefficient 1", minimum=0),
    "damping": Parameter(0.01, "1", "coefficient of the damping by air", minimum=0),
}


def kinetic(v: sp.Expr) -> sp.Expr:
    """Return the kinetic energy v^2 / 2."""
    return v**2 / 2


def potential(x: sp.Expr) -> sp.Expr:
    """Return the energy 1 - cos x of the weight."""
    return 1 - sp.cos(x)


def force(v: sp.Expr, shaft: sp.Expr, epsilon: sp.Expr, friction: sp.Function) -> sp.Expr:
    """Return the friction torque epsilon f(shaft - v)."""
    return epsilon * friction(shaft - v)


def dissipation(v: sp.Expr, damping: sp.Expr) -> sp.Expr:
    """Return Rayleigh's function damping v^2 / 2 of the damping by air."""
    return damping * v**2 / 2
