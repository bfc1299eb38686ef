"""What is derived from the parts of a model, by the names of their files; a value of a test's own may take the place of a name."""

from __future__ import annotations

from fractions import Fraction

import sympy as sp

from synchain import Parameter
from synchain.graphs import Topology
from synchain.models.dynamics import network
from synchain.models.interactions import link
from synchain.models.interactions.coupling import WEIGHT, Coupling, LagrangianCoupling, MatrixCoupling
from synchain.models.mechanics.components import Edge, Node
from synchain.models.mechanics.oscillator import LagrangianModel
from synchain.models.networks.layers import as_coupling, as_law, as_oscillator
from synchain.plugins import FrictionLaw, Oscillator

__all__ = ["connectivity", "coupling_of", "edge", "is_lagrangian", "law_of", "node", "oscillator_of", "parameters"]


def oscillator_of(part: str | Oscillator) -> Oscillator:
    return as_oscillator(part)


def law_of(part: str | FrictionLaw) -> FrictionLaw:
    law = as_law(part, as_oscillator("friction"))
    assert law is not None
    return law


def coupling_of(part: str | Coupling) -> Coupling:
    coupling = as_coupling(part)
    assert coupling is not None
    return coupling


def is_lagrangian(name: str) -> bool:
    return isinstance(as_oscillator(name).model, LagrangianModel)


def node(oscillator: str | Oscillator, friction: str | FrictionLaw | None = None, contact: str = "atan") -> Node:
    return network.node(oscillator_of(oscillator), None if friction is None else law_of(friction), contact)


def parameters(
    oscillator: str | Oscillator,
    friction: str | FrictionLaw | None = None,
    contact: str = "atan",
    coupling: str | Coupling | None = None,
) -> dict[str, Parameter]:
    law = None if friction is None else law_of(friction)
    joined = as_coupling(coupling)
    return network.parameters(oscillator_of(oscillator), law, contact, () if joined is None else (joined,))


def edge(coupling: str | Coupling, single: Node, oscillator: str | Oscillator | None = None) -> Edge:
    return link.edge(coupling_of(coupling), single, None if oscillator is None else oscillator_of(oscillator))


def connectivity(coupling: str | Coupling, graph: Topology) -> tuple[tuple[Fraction, ...], ...]:
    return _connectivity(coupling_of(coupling), graph)


def _connectivity(coupling: Coupling, graph: Topology) -> tuple[tuple[Fraction, ...], ...]:
    """Read G off the coupling: minus the Hessian of its whole potential over sigma, n rows of n fractions.

    The Hessian of one edge is derived once and added up over the links, so that a thousand nodes take no algebra.  For a
    damper the Rayleigh function takes the potential's place; for a one-way link the row is read off the force on its target.
    Of entries such as "1/2 x->y" the factor belongs to H, so that G holds the weights alone.
    Raises ValueError for a coupling whose Hessian between equal states is not sigma times weight times a number: it has no
    matrix G.
    """
    if isinstance(coupling, MatrixCoupling):
        diagonal, aside = Fraction(-1), Fraction(1)
    elif isinstance(coupling, LagrangianCoupling):
        diagonal, aside = _hessian(coupling)
    else:
        raise ValueError(f"coupling {str(coupling)!r}: found any function of two ends; expected one linear difference")
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
    diagonal, other = (sp.simplify(slope / (sigma * WEIGHT)) for slope in slopes)
    if not (diagonal.is_Rational and other.is_Rational) or diagonal == 0:
        raise ValueError(
            f"coupling {str(coupling)!r}: Hessian over sigma and weight is {diagonal}, {other}; expected numbers other than 0"
        )
    return Fraction(int(diagonal.p), int(diagonal.q)), Fraction(int(other.p), int(other.q))
