"""Tangent dynamics: what a small deviation does, along the orbit it deviates from.

Both functions return equations like any others, so that a deviation is integrated by the same generated kernels and
with its own exact Jacobian.
"""

from __future__ import annotations

import sympy as sp

from .calculus import derivative
from .equations import Equations, Node

__all__ = ["ALPHA", "deviation_names", "tangent", "transversal"]

ALPHA = sp.Symbol("alpha", real=True)
"""Coupling strength of a mode with its sign turned, alpha = -sigma gamma >= 0 for undirected networks."""


def deviation_names(node: Node) -> tuple[sp.Symbol, ...]:
    """The symbols of the deviation: d_x, d_v for the state x, v."""
    return tuple(sp.Symbol(f"d_{s.name}", real=True) for s in node.state)


def tangent(node: Node) -> Equations:
    """Return one uncoupled oscillator together with its linearisation: state x, v, d_x, d_v."""
    return Equations(_extend(node, sp.zeros(len(node.state)), ()), None, 1)


def transversal(equations: Equations) -> Equations:
    """Return the synchronous orbit together with one transversal mode of the network, its strength `alpha` a parameter.

    With links that vanish between equal states, a deviation along an eigenvector of G with eigenvalue gamma obeys
    d' = (J + sigma gamma H) d, J the Jacobian of one oscillator and sigma H the derivative of a link with respect to the
    state at its source (Pecora & Carroll, Phys. Rev. Lett. 80, 2109 (1998)); alpha = -sigma gamma.

    Raises ValueError where there is no coupling, where a link does not vanish between equal states (the synchronous state
    is no solution), or where links are not proportional to sigma.
    """
    edge = equations.edge
    if edge is None:
        raise ValueError("these equations have no coupling; a transversal mode needs links")
    if not edge.diffusive:
        raise ValueError("a link acts between equal states, so complete synchronisation is no solution of this network")
    if [s.name for s in edge.parameters] != ["sigma"]:
        raise ValueError(f"links depend on {', '.join(s.name for s in edge.parameters)}; expected sigma alone")
    strength = edge.parameters[0]
    equal = dict(zip((*edge.here, *edge.there), equations.node.state * 2, strict=True))
    matrix = sp.Matrix(edge.jacobian_there()).xreplace({edge.weight: sp.S.One}).xreplace(equal)
    slope = matrix.diff(strength)
    if (matrix - strength * slope).applyfunc(sp.simplify) != sp.zeros(*matrix.shape):
        raise ValueError("links are not proportional to sigma; a mode has no single strength alpha")
    return Equations(_extend(equations.node, -ALPHA * slope, (ALPHA,)), None, 1)


def _extend(node: Node, coupling: sp.Matrix, parameters: tuple[sp.Symbol, ...]) -> Node:
    """The node with its deviation d' = (J + coupling) d appended to the state."""
    names = deviation_names(node)
    taken = {s.name for s in (*node.state, *node.parameters)} & {s.name for s in (*names, *parameters)}
    if taken:
        raise ValueError(f"the symbol {sorted(taken)[0]!r} is needed for the deviation; rename it in the model")
    rows = []
    for i, rhs in enumerate(node.rhs):
        slopes = (derivative(rhs, s) + coupling[i, j] for j, s in enumerate(node.state))
        rows.append(sp.Add(*(slope * d for slope, d in zip(slopes, names, strict=True))))
    return Node((*node.state, *names), (*node.rhs, *rows), (*node.parameters, *parameters))
