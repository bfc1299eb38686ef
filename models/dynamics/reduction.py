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

from ..graphs.links import LINK_LIMIT
from ..inputs.names import LinkName
from ..mechanics.components import TIME, Edge
from ..symmetries.partitions import class_links, coarsest_balanced
from .equations import Equations


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
    classes = _balanced(equations, colours)
    return collapse(equations, classes), classes


def _balanced(equations: Equations, colours: Sequence[Hashable]) -> tuple[int, ...]:
    """Return the coarsest partition with classes of one colour that is balanced in every layer."""
    classes = coarsest_balanced(equations.n, (), colours)
    while True:  # refining for one layer may unbalance another one
        before = classes
        for layer in equations.layers:
            classes = coarsest_balanced(equations.n, layer.links, classes)
        if classes == before or len(equations.layers) < 2:
            return classes


def collapse(equations: Equations, classes: Sequence[int]) -> Equations:
    """Return the network with one node for each class."""
    if len(classes) != equations.n:
        raise ValueError(f"partition: found {len(classes)} classes for {equations.n} nodes; expected one for each node")
    count = len(set(classes))
    if set(classes) != set(range(count)):
        raise ValueError(f"partition: found the classes {sorted(set(classes))}; expected 0 … {count - 1}")
    if count == equations.n and list(classes) == list(range(count)):
        return equations
    if equations.numbered:
        raise NoQuotient(f"quotient: the links differ in {', '.join(equations.numbered)}; nodes are stepped one by one")
    if equations.mixed or equations.inertial_links:
        raise NoQuotient("quotient: nodes of several kinds or links with inertia are stepped one by one")
    # Weights of links to one class are added, links inside a class dropped.
    for edge in equations.edges:
        _check_coupling(edge)
    layers = (replace(layer, links=class_links(equations.n, layer.links, classes)) for layer in equations.layers)
    return replace(equations, kind_of=(0,) * count, layers=tuple(layer for layer in layers if layer.links))


@lru_cache(maxsize=64)
def _check_coupling(edge: Edge) -> None:
    """Raise NoQuotient unless links add up by their weights and vanish between equal states."""
    if not edge.diffusive:
        raise NoQuotient(
            "quotient: the coupling is not zero between equal states, so links inside a class would remain"
        )
    for e in edge.rhs:
        if sp.simplify(e - edge.weight * e.xreplace({edge.weight: sp.S.One})) != 0:
            raise NoQuotient(f"quotient: the coupling {e} is not proportional to its weight; links cannot be added up")
