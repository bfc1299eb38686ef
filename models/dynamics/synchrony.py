"""Complete synchronisation as a solution: the motion of one node while all nodes are equal."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from fractions import Fraction

import sympy as sp

from ..graphs.links import AllPairs
from ..mechanics.components import Edge, Node
from ..mechanics.rows import Law
from .equations import Equations, Layer


class NoSynchrony(ValueError):
    """Equal motion of all nodes is no solution of the network."""


def synchronous_node(equations: Equations) -> Node:
    """Return the equations of a node while all nodes are equal: s' = F(s) + sum of the links h(s, s).

    Links that vanish between equal states add nothing.  Other links add k h(s, s), where k is the sum of the weights at
    a node; k must be equal for all nodes.
    """
    expect_no_friction_in_links("complete synchronisation", equations)
    equations = equations.projected
    apart = replace(equations, layers=())
    apart.expect_alike("complete synchronisation")
    node = equations.node
    for layer in equations.layers:
        ((_, edge),) = layer.edge_of
        if layer.links and not edge.diffusive:
            node = _with_links(node, layer, edge, equations.n)
    return node


def expect_no_friction_in_links(what: str, equations: Equations) -> None:
    """Raise ValueError for contacts in links, which hold equal oscillators together, and for stops in links."""
    for edge in equations.edges:
        equal = dict(zip(edge.there, edge.here, strict=False)) | dict(
            edge.theirs
        )  # of two kinds: as far as both have states
        for surface in edge.surfaces:
            if surface.law is Law.SIGN:
                raise ValueError(
                    f"{what}: friction in links holds equal oscillators together: differences below the load/stiffness stay; "
                    "expected links without friction; compare runs instead"
                )
            gap = sp.simplify(surface.level.xreplace(equal))
            if gap.is_nonpositive:
                raise ValueError(
                    f"{what}: found stops in links with the gap {gap} between equal oscillators; expected a positive gap"
                )
            raise ValueError(
                f"{what}: found stops in links, which are open between equal oscillators if the gap {gap} is positive; expected "
                "the coupling without them"
            )


def expect_vanishing(what: str, equations: Equations) -> None:
    """Raise ValueError if a link acts between equal states, is not proportional to its weight, or has own parameters.

    Otherwise the synchronous motion is the same for all strengths, and deviations split into modes of the graph.
    """
    expect_no_friction_in_links(what, equations)
    equations.expect_exact_links(what)
    equations = equations.projected
    if not all(edge.diffusive for edge in equations.edges):
        raise ValueError(
            f"{what}: a link acts between equal states, so that the synchronous motion changes with its strength; expected "
            "links that vanish there; `plane` takes the strength as an axis, `exponents` one at a time"
        )
    for edge in equations.edges:
        if not edge.oriented and not _proportional(edge.rhs, edge.weight):
            raise ValueError(f"{what}: a link is not proportional to its weight; expected the weight as a factor")


def _with_links(node: Node, layer: Layer, edge: Edge, n: int) -> Node:
    """Return the node with the terms of its links between equal states."""
    if isinstance(layer.links, AllPairs):
        weights = [[layer.links.weight] * (n - 1)]
    else:
        weights = [[] for _ in range(n)]
        for target, _, weight in layer.links:
            weights[target].append(weight)
    felt = _felt(node, edge)
    differing = [name for name in layer.varied if any(e.has(sp.Symbol(name, real=True)) for e in felt)]
    if differing:
        raise _no_solution(f"a link acts between equal states and {', '.join(differing)} differs from link to link")
    # All nodes must feel the same weights, or the same sum of weights if the weight is a factor of the link.
    if _proportional(felt, edge.weight):
        weights = [[sum(of_node, Fraction(0))] for of_node in weights]
    if len({tuple(sorted(of_node)) for of_node in weights}) > 1:
        raise _no_solution("a link acts between equal states and the sums of weights differ from node to node")
    return with_links(node, edge, weights[0])


def with_links(node: Node, edge: Edge, weights: Iterable[Fraction]) -> Node:
    """Return the node with the rates of links of some weights to nodes in the same state."""
    felt = _felt(node, edge)
    values = [{edge.weight: sp.Rational(w.numerator, w.denominator)} for w in weights]
    rates = tuple(rate + sp.Add(*(e.xreplace(w) for w in values)) for rate, e in zip(node.rhs, felt, strict=True))
    used = {s for e in felt for s in e.free_symbols}
    more = tuple(s for s in edge.parameters if s in used and s not in node.parameters)
    return replace(node, rhs=rates, parameters=(*node.parameters, *more))


def _felt(node: Node, edge: Edge) -> list[sp.Expr]:
    """Return the rates of a link between equal states."""
    equal = {**dict(zip((*edge.here, *edge.there), node.state * 2, strict=True)), **dict(edge.theirs)}
    felt = [e.xreplace(equal) for e in edge.rhs]
    if any(e.has(sp.nan, sp.zoo, sp.oo, -sp.oo) for e in felt):
        raise _no_solution(f"a link {', '.join(map(str, edge.rhs))} has no value between equal states")
    return felt


def _proportional(rates: Iterable[sp.Expr], weight: sp.Symbol) -> bool:
    """Return True if a weight is a factor of all rates."""
    return all(sp.expand(e - weight * e.xreplace({weight: sp.S.One})) == 0 for e in rates)


def _no_solution(reason: str) -> NoSynchrony:
    return NoSynchrony(f"{reason}, so complete synchronisation is no solution of this network")
