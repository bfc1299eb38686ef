"""Exact reductions of a network: constants in place of parameters, one node in place of equal ones.

Nodes that start equal stay equal if they belong to one class of a balanced partition: a partition in
which all nodes of a class feel every other class with the same total weight.  The quotient network
has one node for each class and the same solutions.  Links inside a class drop out, because they are
zero between equal states; such partitions are also called external equitable partitions.

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

__all__ = ["NoQuotient", "collapse", "quotient", "substitute_constants", "without_drive"]


class NoQuotient(ValueError):
    """The coupling has no exact quotient network, whatever the partition."""


def substitute_constants(equations: Equations, values: Mapping[str, int | Fraction]) -> Equations:
    """Return the equations with some parameters replaced by exact numbers.

    Parameters
    ----------
    equations : Equations
        Equations of a network of equal nodes.
    values : mapping of str to int or Fraction
        Numbers by the names of parameters that are the same for all nodes.

    Returns
    -------
    Equations
        Parameters that occur no more are left out, and so are links that have no effect.

    Raises
    ------
    TypeError
        If a number is not exact.
    ValueError
        If a parameter is unknown or differs from node to node, nodes are of several kinds, or an
        expression is undefined at the numbers.
    """
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

    linked = {s for edge in equations.edges for s in (*edge.parameters, *(own for _, own in edge.theirs))}
    kept = {s for s in linked if s.name in equations.varied}
    reduced = equations.map_templates(
        lambda node: node.map(partial(change, "node")).without_unused_parameters(kept),
        lambda edge: edge.map(partial(change, "edge")).without_unused_parameters(),
    )
    acting = tuple(layer for layer in reduced.layers if any(edge.acts for _, edge in layer.edge_of))
    return replace(reduced, layers=acting)


def without_drive(equations: Equations, values: Mapping[str, float]) -> Equations:
    """Return the equations without a drive whose strength is 0; the same equations if there is none, or another drive.

    Parameters
    ----------
    equations : Equations
        Equations of a network.
    values : mapping of str to float
        Numbers by the names of all parameters.
    """
    if not equations.forced or equations.mixed:
        return equations
    common = set(equations.parameters) - equations.single
    return _without_drive(equations, tuple(sorted(name for name in common if values[name] == 0)))


@lru_cache(maxsize=64)
def _without_drive(equations: Equations, zeros: tuple[str, ...]) -> Equations:
    """The same for parameters that are 0; Newton's method on an orbit needs it at every step."""
    rates = [*(e for node in equations.nodes for e in node.rhs), *(e for edge in equations.edges for e in edge.rhs)]
    timed = {s.name for e in rates for term in sp.Add.make_args(e) if term.has(TIME) for s in term.free_symbols}
    quiet = substitute_constants(equations, {name: 0 for name in zeros if name in timed})
    return equations if quiet.forced or len(quiet.layers) < len(equations.layers) else quiet


def _check_constants(equations: Equations, values: Mapping[str, int | Fraction]) -> None:
    """Raise TypeError or ValueError for numbers that cannot take the places of parameters."""
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
    """Return the smallest network with the same motion if nodes of equal colour start equal.

    Parameters
    ----------
    equations : Equations
        The network.
    colours : sequence of hashable
        One entry for each node, such as its initial state.

    Returns
    -------
    equations : Equations
        The quotient network.
    classes : tuple of int
        The class of each node; classes are numbered by their first nodes.

    Raises
    ------
    NoQuotient
        If the coupling does not vanish between equal states or is not proportional to the weight of
        a link; then no exact quotient is known.
    ValueError
        If there is not one colour for each node.
    """
    if any(len(pairs) > LINK_LIMIT for _, pairs in equations.fields):
        raise NoQuotient(f"quotient: the {equations.link_count} links of all pairs are too many to be listed")
    classes = _balanced(equations, colours)
    return collapse(equations, classes), classes


def _balanced(equations: Equations, colours: Sequence[Hashable]) -> tuple[int, ...]:
    """The coarsest partition with classes of one colour that is balanced in every layer."""
    found = coarsest_balanced(equations.n, (), colours)
    while True:
        before = found
        for layer in equations.layers:
            found = coarsest_balanced(equations.n, layer.links, found)
        if found == before or len(equations.layers) < 2:
            return found


def collapse(equations: Equations, classes: Sequence[int]) -> Equations:
    """Return the network with one node for each class.

    Parameters
    ----------
    equations : Equations
        The network.
    classes : sequence of int
        The class of each node, out of 0 … k-1.

    Returns
    -------
    Equations
        The quotient network; its links are those of any node of a class to the other classes.

    Raises
    ------
    NoQuotient
        For a coupling that `quotient` refuses.
    ValueError
        If the classes are not 0 … k-1, or if two nodes of a class feel another class with different
        total weights.
    """
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
    for edge in equations.edges:
        _check_coupling(edge)
    layers = (replace(own, links=class_links(equations.n, own.links, classes)) for own in equations.layers)
    return replace(equations, kind_of=(0,) * count, layers=tuple(own for own in layers if own.links))


@lru_cache(maxsize=64)
def _check_coupling(edge: Edge) -> None:
    """Prove that links add up by their weights and vanish between equal states."""
    if not edge.diffusive:
        raise NoQuotient(
            "quotient: the coupling is not zero between equal states, so links inside a class would remain"
        )
    for e in edge.rhs:
        if sp.simplify(e - edge.weight * e.xreplace({edge.weight: sp.S.One})) != 0:
            raise NoQuotient(f"quotient: the coupling {e} is not proportional to its weight; links cannot be added up")
