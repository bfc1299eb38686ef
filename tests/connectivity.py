"""The matrix G read off a coupling: what the tests of couplings compare the rows of a graph with."""

from __future__ import annotations

from fractions import Fraction

import sympy as sp

from synchain.models.graphs.topology import Topology
from synchain.models.mechanics.coupling import WEIGHT, Coupling, LagrangianCoupling, MatrixCoupling

__all__ = ["connectivity"]


def connectivity(coupling: Coupling, graph: Topology) -> tuple[tuple[Fraction, ...], ...]:
    """Read G off the coupling: minus the Hessian of its whole potential over sigma, n rows of n fractions.

    The Hessian of one edge is derived once and added up over the links, so that a thousand nodes take no algebra.  For a
    damper the Rayleigh function takes the potential's place; for a one-way link the row is read off the force on its target.
    Of entries such as "1/2 x->y" the factor belongs to H, so that G holds the weights alone.
    Raises ValueError for a coupling whose Hessian between equal states is not sigma times weight times a number: it has no
    matrix G.
    """
    if isinstance(coupling, MatrixCoupling):
        diagonal, aside = Fraction(-1), Fraction(1)
    else:
        diagonal, aside = _hessian(coupling)
    rows = [[Fraction(0)] * graph.n for _ in range(graph.n)]
    for target, source, factor in graph.links:
        rows[target][target] += factor * diagonal
        rows[target][source] += factor * aside
    return tuple(map(tuple, rows))


def _hessian(coupling: LagrangianCoupling) -> tuple[Fraction, Fraction]:
    """Minus the second derivatives of one edge's energy over sigma and weight: twice by one end, and by both.

    Of a non-linear coupling they are taken between equal states, where its links are those of its linear part.
    """
    q_i, q_j, v_i, v_j, sigma = sp.symbols("q_i q_j v_i v_j sigma", real=True)
    if coupling.between is not None:
        raise ValueError(
            f"coupling {str(coupling)!r} joins {' and '.join(coupling.between)}; it has no matrix of one coordinate"
        )
    functions = (coupling.potential, coupling.dissipation, coupling.kinetic)
    energy = next((e for e in functions if e != 0), sp.S.Zero).xreplace({v_i: q_i, v_j: q_j})
    slopes = (-energy.diff(q_i, q).xreplace({q_j: q_i}) for q in (q_i, q_j))
    own, other = (sp.simplify(slope / (sigma * WEIGHT)) for slope in slopes)
    if not (own.is_Rational and other.is_Rational) or own == 0:
        raise ValueError(
            f"coupling {str(coupling)!r}: Hessian over sigma and weight is {own}, {other}; expected numbers other than 0"
        )
    return Fraction(int(own.p), int(own.q)), Fraction(int(other.p), int(other.q))
