"""The matrix G read off a coupling: what the tests of couplings compare the rows of a graph with."""

from __future__ import annotations

from fractions import Fraction

import sympy as sp

from synchain.models.graphs.topology import Topology
from synchain.models.inputs.plugins import call, load
from synchain.models.mechanics import coupling_text
from synchain.models.mechanics.coupling_text import split

__all__ = ["connectivity"]


def connectivity(coupling: str, graph: Topology) -> tuple[tuple[Fraction, ...], ...]:
    """Read G off the coupling: minus the Hessian of its whole potential over sigma, n rows of n fractions.

    The Hessian of one edge is derived once and added up over the links, so that a thousand nodes take no algebra.  For a
    damper the Rayleigh function takes the potential's place; for a one-way link the row is read off the force on its target.
    Of entries such as "1/2 x->y" the factor belongs to H, so that G holds the weights alone.
    Raises ValueError for a coupling whose Hessian between equal states is not sigma times weight times a number: it has no
    matrix G.
    """
    if coupling_text.is_matrix(coupling):
        coupling_text.entries(coupling)
        diagonal, aside = Fraction(-1), Fraction(1)
    else:
        diagonal, aside = _hessian(coupling)
    rows = [[Fraction(0)] * graph.n for _ in range(graph.n)]
    for target, source, factor in graph.links:
        rows[target][target] += factor * diagonal
        rows[target][source] += factor * aside
    return tuple(map(tuple, rows))


def _hessian(coupling: str) -> tuple[Fraction, Fraction]:
    """Minus the second derivatives of one edge's energy over sigma and weight: twice by one end, and by both.

    Of a non-linear coupling they are taken between equal states, where its links are those of its linear part.
    """
    model = load("coupling", split(coupling)[0])
    q_i, q_j, weight = (sp.Symbol(name, real=True) for name in ("q_i", "q_j", "weight"))
    given = {name: sp.Symbol(name, real=True) for name in model.PARAMETERS}
    if hasattr(model, "BETWEEN"):
        raise ValueError(
            f"coupling {coupling!r} joins {' and '.join(model.BETWEEN)}; it has no matrix of one coordinate"
        )
    function = next(getattr(model, name) for name in ("potential", "dissipation", "kinetic") if hasattr(model, name))
    energy = call(function, {"q_i": q_i, "q_j": q_j, "v_i": q_i, "v_j": q_j, "weight": weight, **given})
    slopes = (-energy.diff(q_i, q).xreplace({q_j: q_i}) for q in (q_i, q_j))
    own, other = (sp.simplify(slope / (given["sigma"] * weight)) for slope in slopes)
    if not (own.is_Rational and other.is_Rational) or own == 0:
        raise ValueError(
            f"coupling {coupling!r}: Hessian over sigma and weight is {own}, {other}; expected numbers other than 0"
        )
    return Fraction(int(own.p), int(own.q)), Fraction(int(other.p), int(other.q))
