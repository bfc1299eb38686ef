"""Variational equations with orbit and deviation in one state: an independent form that tests compare with."""

from __future__ import annotations

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.mode_inertia import inertia_of_modes
from synchain.models.dynamics.variational import source_slopes
from synchain.models.mechanics.calculus import derivative
from synchain.models.mechanics.components import Node

__all__ = ["ALPHA", "deviation_names", "tangent_equations", "transversal_equations"]

ALPHA = sp.Symbol("alpha", real=True)
"""Coupling strength of a mode with its sign turned, alpha = -sigma gamma >= 0 for undirected networks."""


def deviation_names(node: Node) -> tuple[sp.Symbol, ...]:
    """The symbols of the deviation: d_x, d_v for the state x, v."""
    return tuple(sp.Symbol(f"d_{s.name}", real=True) for s in node.state)


def tangent_equations(node: Node) -> Equations:
    """Return one uncoupled oscillator together with its linearisation: state x, v, d_x, d_v."""
    return Equations.of_equal_nodes(_extend(node, sp.zeros(len(node.state)), ()), None, 1)


def transversal_equations(equations: Equations) -> Equations:
    """Return the synchronous orbit together with one transversal mode of the network, its strength `alpha` a parameter.

    With links that vanish between equal states, a deviation along an eigenvector of G with eigenvalue gamma obeys
    d' = (J + sigma gamma H) d, J the Jacobian of one oscillator and sigma H the derivative of a link with respect to the
    state at its source (Pecora & Carroll, Phys. Rev. Lett. 80, 2109 (1998)); alpha = -sigma gamma.  Links with inertia:
    `synchain.models.dynamics.mode_inertia`.

    Raises ValueError where there is no coupling, where a link does not vanish between equal states (the synchronous state
    is no solution), or where links are not proportional to sigma.
    """
    (slope,) = source_slopes(equations)
    strength = ALPHA / (1 + inertia_of_modes(equations)[1] * ALPHA)
    return Equations.of_equal_nodes(_extend(equations.node, -strength * slope, (ALPHA,)), None, 1)


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
    return Node((*node.state, *names), (*node.rhs, *rows), (*node.parameters, *parameters), law=node.law)
