"""Exact reductions of a network: constants in place of parameters, one node in place of equal ones.

A partition of the nodes into classes is balanced if all nodes of a class feel every other class with the same total
weight.  Nodes of a class that start equal then stay equal.  The quotient network has one node for each class and the
same solutions.  Links inside a class drop out, because they are zero between equal states; such partitions are also
called external equitable partitions.

References
----------
Golubitsky & Stewart, Bull. Amer. Math. Soc. 43, 305 (2006): balanced partitions and quotients.
Schaub, O'Clery, Billeh, Delvenne, Lambiotte & Barahona, Chaos 26, 094821 (2016): partitions of
difference couplings.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache, partial

import sympy as sp

from ..graphs.links import LINK_LIMIT, numbered
from ..inputs.names import LinkName
from ..mechanics.components import TIME, Edge, Node
from ..symmetries.partitions import balanced_in_all, class_links
from .equations import Equations, Layer
from .synchrony import with_links


class NoQuotient(ValueError):
    """The coupling has no exact quotient network for any partition."""


def substitute_constants(equations: Equations, values: Mapping[str, int | Fraction]) -> Equations:
    """Return the equations with some parameters replaced by exact numbers."""
    _check_constants(equations, values)
    if not values:
        return equations
    numbers = {sp.Symbol(name, real=True): sp.Rational(v.numerator, v.denominator) for name, v in values.items()}

    def change(what: str, e: sp.Expr) -> sp.Expr:
        value = e.xreplace(numbers)
        if value.has(sp.nan, sp.zoo, sp.oo, -sp.oo):
            at = ", ".join(f"{symbol} = {number}" for symbol, number in numbers.items())
            raise ValueError(f"fold: a right-hand side of the {what} is undefined at {at}; leave it a parameter")
        return value

    # Keep parameters of nodes that only links use, if they differ from node to node.
    of_links = {s for edge in equations.edges for s in (*edge.parameters, *(of for _, of in edge.theirs))}
    needed = {s for s in of_links if s.name in equations.varied}
    reduced = equations.map_templates(
        lambda node: node.map(partial(change, "node")).without_unused_parameters(needed),
        lambda edge: edge.map(partial(change, "edge")).without_unused_parameters(),
    )
    # A layer whose links became zero drops out.
    acting = tuple(layer for layer in reduced.layers if any(edge.acts for _, edge in layer.edge_of))
    return replace(reduced, layers=acting)


def without_drive(equations: Equations, values: Mapping[str, float]) -> Equations:
    """Return the equations without a drive whose strength is 0; the same equations if another drive remains."""
    if not equations.forced or equations.mixed:
        return equations
    common = set(equations.parameters) - equations.single
    return _without_drive(equations, tuple(sorted(name for name in common if values[name] == 0)))


@lru_cache(maxsize=64)
def _without_drive(equations: Equations, zeros: tuple[str, ...]) -> Equations:
    """Set parameters of the drive to 0; cached, since Newton's method for orbits calls this function at every step."""
    rates = [*(e for node in equations.nodes for e in node.rhs), *(e for edge in equations.edges for e in edge.rhs)]
    # Only parameters in terms with time can remove the drive.
    timed = {s.name for e in rates for term in sp.Add.make_args(e) if term.has(TIME) for s in term.free_symbols}
    quiet = substitute_constants(equations, {name: 0 for name in zeros if name in timed})
    return equations if quiet.forced or len(quiet.layers) < len(equations.layers) else quiet


def _check_constants(equations: Equations, values: Mapping[str, int | Fraction]) -> None:
    """Raise TypeError or ValueError for names or numbers that cannot replace parameters."""
    for name, value in values.items():
        if isinstance(value, bool) or not isinstance(value, (int, Fraction)):
            raise TypeError(f"fold {name}: found {value!r} ({type(value).__name__}); expected an int or a Fraction")
        if name not in equations.parameters:
            raise ValueError(f"fold: unknown parameter {name!r}; known: {', '.join(equations.parameters) or 'none'}")
        if name in equations.single:
            link = LinkName.parse(name)
            places = "links" if link is not None and link.base in equations.numbered else "nodes"
            raise ValueError(f"fold {name}: the {places} have different values of it; it stays a parameter")
    if values and equations.mixed:
        raise ValueError(f"fold {', '.join(values)}: found nodes of several kinds; they stay parameters")


def quotient(equations: Equations, colours: Sequence[Hashable]) -> tuple[Equations, tuple[int, ...]]:
    """Return the smallest network with the same motion if nodes of equal colour start equal, and each node's class."""
    if any(len(pairs) > LINK_LIMIT for _, pairs in equations.fields):
        raise NoQuotient(f"quotient: the {equations.link_count} links of all pairs are too many to be listed")
    if equations.triadic or equations.joined:
        found = "links of three ends" if equations.triadic else "rows in links"
        raise NoQuotient(f"quotient: nodes with {found} are stepped one by one")
    classes = balanced_in_all(equations.n, [layer.links for layer in equations.layers], colours)
    if max(classes) + 1 == equations.n:
        return equations, classes
    if equations.numbered:
        raise NoQuotient(f"quotient: the links differ in {', '.join(equations.numbered)}; nodes are stepped one by one")
    if equations.mixed or equations.inertial_links:
        raise NoQuotient("quotient: nodes of several kinds or links with inertia are stepped one by one")
    if not all(edge.diffusive for edge in equations.edges):
        raise NoQuotient(
            "quotient: the coupling is not zero between equal states, so links inside a class would remain"
        )
    return collapse(equations, classes), classes


def collapse(equations: Equations, classes: Sequence[int]) -> Equations:
    """Return the network with one node for each class of a balanced partition; raise ValueError for any other.

    The weights of links to one class are added.  Links inside a class drop out if they vanish between equal states;
    others become a part of the rates of the node.
    """
    if len(classes) != equations.n:
        raise ValueError(f"partition: found {len(classes)} classes for {equations.n} nodes; expected one for each node")
    count = len(set(classes))
    if set(classes) != set(range(count)):
        raise ValueError(f"partition: found the classes {sorted(set(classes))}; expected 0 … {count - 1}")
    for edge in equations.edges:
        _check_coupling(edge)
    if count == equations.n and list(classes) == list(range(count)):
        return equations
    firsts = [list(classes).index(k) for k in range(count)]
    for i, k in enumerate(classes):
        if equations.kind_of[i] != equations.kind_of[firsts[k]]:
            raise ValueError(
                f"partition: nodes {firsts[k] + 1} and {i + 1} of one class are of different kinds; expected equal nodes"
            )
    layers = [replace(layer, links=class_links(equations.n, layer.links, classes)) for layer in equations.layers]

    # Classes with different links inside need nodes of different kinds.
    kinds = [equations.kind_of[i] for i in firsts]
    inside = [_inside(layer, equations, classes, firsts) for layer in equations.layers]
    signatures = list(zip(kinds, *inside, strict=True))
    kind_of = numbered(signatures)
    nodes = []
    for kind, *weights in dict.fromkeys(signatures):
        node = equations.nodes[kind]
        for layer, weight in zip(equations.layers, weights, strict=True):
            node = with_links(node, dict(layer.edge_of)[kind, kind], [weight]) if weight else node
        nodes.append(node)
    old_kinds = [kind for kind, *_ in dict.fromkeys(signatures)]
    layers = [replace(layer, edge_of=_between(layer, old_kinds)) for layer in layers if layer.links]
    return replace(equations, nodes=tuple(nodes), kind_of=kind_of, layers=tuple(layers))


def _between(layer: Layer, old_kinds: Sequence[int]) -> tuple[tuple[tuple[int, int], Edge], ...]:
    """Return the templates of links between new kinds of nodes, each from an old kind."""
    edges, kinds = dict(layer.edge_of), list(enumerate(old_kinds))
    return tuple(((a, b), edges[c, d]) for a, c in kinds for b, d in kinds if (c, d) in edges)


def _inside(layer: Layer, equations: Equations, classes: Sequence[int], firsts: Sequence[int]) -> list[Fraction]:
    """Return for each class the sum of weights that a node feels from its own class; 0 if these links vanish."""
    acting = {ends for ends, edge in layer.edge_of if ends[0] == ends[1] and not edge.diffusive}
    sums = [Fraction(0)] * equations.n
    for link in layer.links if acting else ():
        if classes[link[0]] == classes[link[1]] and equations.ends(link) in acting:
            sums[link[0]] += link[2]
    for i, k in enumerate(classes):
        if sums[i] != sums[firsts[k]]:
            raise ValueError(
                f"partition: nodes {firsts[k] + 1} and {i + 1} of one class feel the weights {sums[firsts[k]]} and {sums[i]} "
                "of their class, by links that act between equal states; expected equal sums"
            )
    return [sums[i] for i in firsts]


def by_class(equations: Equations, classes: Sequence[int]) -> Equations:
    """Return the equations with one kind of nodes for each class, instead of parameters with a value for each node.

    The nodes of a class have the values of its first node, whose names they take: a_3 of node 3.
    """
    equations = equations.without_fields()
    if not equations.varied:
        return equations
    firsts = [list(classes).index(k) for k in range(max(classes) + 1)]

    def names(k: int) -> dict[sp.Symbol, sp.Symbol]:
        kind = equations.node_at(firsts[k])
        varied = [s for s in kind.parameters if s.name in equations.varied]
        return {s: sp.Symbol(f"{s.name}_{firsts[k] + 1}", real=True) for s in varied}

    def link(edge: Edge, target: int, source: int) -> Edge:
        values = {**names(target), **{s: names(source)[parameter] for s, parameter in edge.theirs}}
        parameters = (*(values.get(s, s) for s in edge.parameters), *(values[s] for s, _ in edge.theirs))
        rhs = tuple(e.xreplace(values) for e in edge.rhs)
        return replace(edge, rhs=rhs, parameters=tuple(dict.fromkeys(parameters)), theirs=())

    nodes = [_renamed(equations.node_at(i), names(k)) for k, i in enumerate(firsts)]
    kinds, layers = [equations.kind_of[i] for i in firsts], []
    for layer in equations.layers:
        edges = dict(layer.edge_of)
        pairs = [(a, b) for a in range(len(firsts)) for b in range(len(firsts)) if (kinds[a], kinds[b]) in edges]
        edge_of = tuple(((a, b), link(edges[kinds[a], kinds[b]], a, b)) for a, b in pairs)
        layers.append(replace(layer, edge_of=edge_of))
    return replace(equations, nodes=tuple(nodes), kind_of=tuple(classes), layers=tuple(layers), varied=())


def _renamed(node: Node, names: Mapping[sp.Symbol, sp.Symbol]) -> Node:
    return node.map(lambda e: e.xreplace(dict(names)))


@lru_cache(maxsize=64)
def _check_coupling(edge: Edge) -> None:
    """Raise NoQuotient unless links add up by their weights."""
    for e in edge.rhs:
        if sp.simplify(e - edge.weight * e.xreplace({edge.weight: sp.S.One})) != 0:
            raise NoQuotient(f"quotient: the coupling {e} is not proportional to its weight; links cannot be added up")
