"""Transversal modes of links with inertia: one strength for their stiffness and their inertia.

A mode of strength alpha = -sigma gamma obeys (1 + alpha B) d' = (J - alpha H) d.  B is the inertia of a link at equal
states, divided by sigma.  Let B B = b B and B H = b H with a number b: forces and inertia of a link act on the same
coordinates.  Then d' = (J - tau (H + B J)) d with tau = alpha/(1 + b alpha), which is linear in the one strength tau.
"""

from __future__ import annotations

import sympy as sp

from ..interactions.link import strength
from .equations import Equations


def inertia_of_modes(equations: Equations) -> tuple[sp.Matrix, sp.Expr]:
    """Return B and b of the links, both 0 without inertia; raise ValueError unless B B = b B and B H = b H."""
    node = equations.node
    size = len(node.state)
    edge = equations.edge if equations.inertial_links else None
    if edge is None:
        return sp.zeros(size, size), sp.S.Zero
    here, there = (sp.Matrix(block) for block in edge.inertia)
    if (here + there).applyfunc(sp.simplify) != sp.zeros(size, size):
        raise ValueError(
            "a link has inertia between nodes that move alike, so complete synchronisation is no solution of this network; "
            "expected inertia of differences, as an inerter has"
        )
    sigma = strength(edge, node.parameters)
    equal = dict(zip((*edge.here, *edge.there), node.state * 2, strict=True))
    at_equal = here.xreplace(equal)
    b_matrix = at_equal.xreplace({edge.weight: sp.S.One}).diff(sigma)
    proportional = (at_equal - sigma * edge.weight * b_matrix).applyfunc(sp.simplify) == sp.zeros(size, size)
    if not proportional or b_matrix.free_symbols - {*node.state, *node.parameters}:
        raise ValueError("the inertia of links is not proportional to sigma; a mode has no single strength alpha")
    share = sp.simplify(b_matrix.trace() / b_matrix.rank())  # b: B/b is a projector, whose trace is its rank
    residual = (b_matrix * b_matrix - share * b_matrix).applyfunc(sp.simplify)
    if share.has(*node.state) or residual != sp.zeros(size, size):
        raise ValueError(
            "links have inertia that joins coordinates by different masses, or masses that depend on the state; a mode has "
            "no single strength alpha; expected one mass for all coordinates that a link joins"
        )
    return b_matrix, share


def effective_slope(equations: Equations, slope: sp.Matrix) -> sp.Matrix:
    """Return the matrix that multiplies the strength tau of a mode, H + B J."""
    b_matrix, share = inertia_of_modes(equations)
    if share == 0:
        return slope
    if (b_matrix * slope - share * slope).applyfunc(sp.simplify) != sp.zeros(*slope.shape):
        raise ValueError(
            "links push coordinates that their inertia does not join; a mode has no single strength alpha; expected forces "
            "and inertia on the same coordinates"
        )
    return slope + b_matrix * sp.Matrix(equations.node.jacobian())
