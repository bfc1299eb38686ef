"""Functions of one scalar after another, as C and Numba have them: node by node, or in loops over nodes and links."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.graphs.links import Link

from .body import (
    Store,
    Syntax,
    is_unrolled,
    link_body,
    link_places,
    mass_body,
    node_body,
    node_places,
    own_parameters,
    parameters,
    rate_symbols,
)

__all__ = ["jacobian_lines", "mass_lines", "rhs_lines"]


def rhs_lines(equations: Equations, syntax: Syntax) -> list[str]:
    """The statements that write the right-hand side of the whole network to `rates`."""
    lines = _parameters(equations, syntax, False)
    if is_unrolled(equations):
        places = equations.places
        for i, begin in enumerate(_nodes(equations, syntax)):
            lines += _block(syntax, begin, _node(equations, syntax, i, _literal(places[i])))
        for link, begin in zip(equations.links, _links(equations, syntax), strict=True):
            at, other = _literal(places[link[0]]), _literal(places[link[1]])
            loads = _pair(equations, at, other, link, syntax.reads)
            lines += _block(syntax, begin, syntax.body(link_body(equations, link), loads, _adding(syntax, at)))
        return lines
    lines += _loop(syntax, "i_", "NODES", _node(equations, syntax, None, _indexed("i_")))
    if equations.links:
        loads = _pair(equations, _indexed("i_"), _indexed("j_"))
        inner = syntax.body(link_body(equations), loads, _adding(syntax, _indexed("i_")))
        lines += _loop(syntax, "link_", "LINKS", [*_ends(syntax, equations, False), *inner])
    return lines


def jacobian_lines(equations: Equations, syntax: Syntax) -> list[str]:
    """The statements that write the Jacobian: dense to `matrix`, or for many nodes entry by entry to `values`."""
    lines = _parameters(equations, syntax, True)
    if is_unrolled(equations):
        return lines + _dense(equations, syntax)
    own = list(node_places(equations))

    def place_own(place: Any, text: str) -> str:
        return syntax.assign.format(f"values[{_index(own.index(place), 'NODES', 'i_')}]", "=", text)

    body = node_body(equations, True)
    loads = _loads(equations, syntax, None, _indexed("i_"))
    lines += _loop(syntax, "i_", "NODES", syntax.body(body, loads, place_own))
    if equations.links:
        here, there = link_places(equations)
        slots = [(False, place) for place in here] + [(True, place) for place in there]

        def place_link(place: Any, text: str) -> str:
            slot = _index(slots.index(place), "LINKS", "link_")
            first = f"{len(own)}*NODES + " if own else ""
            return syntax.assign.format(f"values[{first}{slot}]", "=", text)

        pair = _pair(equations, _indexed("i_"), _indexed("j_"))
        inner = syntax.body(link_body(equations, None, True), pair, place_link)
        lines += _loop(syntax, "link_", "LINKS", [*_ends(syntax, equations, True), *inner])
    return lines


def _dense(equations: Equations, syntax: Syntax) -> list[str]:
    places, lines = equations.places, list[str]()
    for i, begin in enumerate(_nodes(equations, syntax)):
        at, body = _literal(places[i]), node_body(equations, True, i)
        loads = _loads(equations, syntax, i, at)
        lines += _block(syntax, begin, syntax.body(body, loads, _entry(syntax, at, at, "=")))
    for link, begin in zip(equations.links, _links(equations, syntax), strict=True):
        at, other = _literal(places[link[0]]), _literal(places[link[1]])
        body = link_body(equations, link, True)

        def store(place: Any, text: str, at: Callable[[int], str] = at, other: Callable[[int], str] = other) -> str:
            there, inner = place
            return _entry(syntax, at, other if there else at, "+=")(inner, text)

        lines += _block(syntax, begin, syntax.body(body, _pair(equations, at, other, link, syntax.reads), store))
    return lines


def mass_lines(equations: Equations, syntax: Syntax) -> list[str]:
    """The statements that add what the links contribute to the mass matrix, for networks that are written out."""
    places, lines = equations.places, list[str]()
    for link, begin in zip(equations.links, _links(equations, syntax), strict=True):
        at, other = _literal(places[link[0]]), _literal(places[link[1]])
        body = mass_body(equations, link)

        def store(place: Any, text: str, at: Callable[[int], str] = at, other: Callable[[int], str] = other) -> str:
            there, (r, c) = place
            name = syntax.entry.format(at(r), (other if there else at)(c)).replace("matrix", "mass_", 1)
            return syntax.assign.format(name, "+=", text)

        if body.results:
            lines += _block(syntax, begin, syntax.body(body, _pair(equations, at, other, link, syntax.reads), store))
    return lines


def _entry(syntax: Syntax, row: Callable[[int], str], column: Callable[[int], str], sign: str) -> Store:
    def store(place: Any, text: str) -> str:
        r, c = place
        return syntax.assign.format(syntax.entry.format(row(r), column(c)), sign, text)

    return store


def _parameters(equations: Equations, syntax: Syntax, jacobian: bool) -> list[str]:
    """Read the parameters that are used from `numbers`; nothing where the language has them as arguments."""
    firsts = {kind: i for i, kind in enumerate(equations.kind_of)}.values()
    ends = {equations.ends(link): link for link in equations.links}.values()
    bodies = [node_body(equations, jacobian, i) for i in firsts]
    bodies += [link_body(equations, link, jacobian) for link in ends]
    bodies += [mass_body(equations, link) for link in ends]
    if not syntax.reads:
        return []
    return [syntax.declare.format(equations.parameters[k], f"numbers[{k}]") for k in parameters(equations, bodies)]


def _node(equations: Equations, syntax: Syntax, i: int | None, at: Callable[[int], str]) -> list[str]:
    body, loads = node_body(equations, i=i or 0), _loads(equations, syntax, i, at)
    return syntax.body(body, loads, lambda c, text: syntax.assign.format(f"rates[{at(c)}]", "=", text))


def _loads(equations: Equations, syntax: Syntax, i: int | None, at: Callable[[int], str]) -> dict[sp.Symbol, str]:
    """Where the states of a node are and the parameters that it has for itself; node None is the one of a loop."""
    state = equations.node_at(i or 0).state
    found = dict(zip(state, (f"state[{at(c)}]" for c in range(len(state))), strict=True))
    for s, k in own_parameters(equations, i or 0).items():
        found[s] = f"numbers[{k}{' + i_' if i is None else ''}]" if syntax.reads else equations.parameters[k]
    return found


def _adding(syntax: Syntax, at: Callable[[int], str]) -> Store:
    return lambda c, text: syntax.assign.format(f"rates[{at(c)}]", "+=", text)


def _pair(
    equations: Equations,
    here: Callable[[int], str],
    there: Callable[[int], str],
    link: Link | None = None,
    reads: bool = True,
) -> dict[sp.Symbol, str]:
    """Where the states at both ends of a link are, the parameters of its target, and the rates."""
    edge = equations.edge if link is None else equations.edge_at(link)
    if edge is None:
        return {}
    places = [*map(here, range(len(edge.here))), *map(there, range(len(edge.there)))]
    found = {s: f"state[{place}]" for s, place in zip((*edge.here, *edge.there), places, strict=True)}
    if link is not None:  # a mass of the target that differs from node to node
        own = own_parameters(equations, link[0])
        found |= {s: f"numbers[{k}]" if reads else equations.parameters[k] for s, k in own.items()}
    rates = zip(rate_symbols(edge), places, strict=True)
    return found | {s: f"rates[{place}]" for s, place in rates}


def _literal(places: tuple[int, ...]) -> Callable[[int], str]:
    return lambda c: str(places[c])


def _indexed(name: str) -> Callable[[int], str]:
    return lambda c: _index(c, "NODES", name)


def _index(block: int, size: str, name: str) -> str:
    return name if block == 0 else f"{size} + {name}" if block == 1 else f"{block}*{size} + {name}"


def _nodes(equations: Equations, syntax: Syntax) -> Iterator[str]:
    return (syntax.comment.format(f"oscillator {i + 1}") for i in range(equations.n))


def _links(equations: Equations, syntax: Syntax) -> Iterator[str]:
    return (syntax.comment.format(f"oscillator {i + 1} feels oscillator {j + 1}") for i, j, _ in equations.links)


def _block(syntax: Syntax, comment: str, lines: list[str]) -> list[str]:
    if not syntax.braces:
        return [comment, *lines]
    return [f"{{ {comment}", *(f"    {line}" for line in lines), "}"]


def _ends(syntax: Syntax, equations: Equations, jacobian: bool) -> list[str]:
    """The two ends and the weight of a link, those that are used."""
    edge, body = equations.edge, link_body(equations, None, jacobian)
    if edge is None:
        return []
    lines = []
    if not jacobian or body.uses(edge.here):
        lines.append(syntax.whole.format("i_", "TARGET[link_]"))
    if body.uses(edge.there):
        lines.append(syntax.whole.format("j_", "SOURCE[link_]"))
    if body.uses([edge.weight]):
        lines.append(syntax.declare.format(edge.weight.name, "WEIGHT[link_]"))
    return lines


def _loop(syntax: Syntax, index: str, end: str, lines: list[str]) -> list[str]:
    inner = [f"    {line}" for line in lines]
    if syntax.braces:
        return [f"for (int {index} = 0; {index} < {end}; {index}++) {{", *inner, "}"]
    return [f"for {index} in range({end}):", *(inner or ["    pass"])]
