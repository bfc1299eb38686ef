"""Functions of one scalar after another, as C and Numba have them: node by node, or in loops over nodes and links."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import sympy as sp

from .equations import Equations
from .export_body import LARGEST_UNROLLED, Store, Syntax, link_body, link_places, node_body, node_places, parameters

__all__ = ["is_unrolled", "jacobian_lines", "rhs_lines"]


def is_unrolled(equations: Equations) -> bool:
    """True where every node is written out."""
    return equations.n <= LARGEST_UNROLLED


def rhs_lines(equations: Equations, syntax: Syntax) -> list[str]:
    """The statements that write the right-hand side of the whole network to `rates`."""
    lines = _parameters(equations, syntax, False)
    if is_unrolled(equations):
        for i, begin in enumerate(_nodes(equations, syntax)):
            lines += _block(syntax, begin, _node(equations, syntax, str(i), _literal(equations.n, i)))
        for (i, j, weight), begin in zip(equations.links, _links(equations, syntax), strict=True):
            body = link_body(equations, sp.Rational(weight.numerator, weight.denominator))
            loads = _pair(equations, _literal(equations.n, i), _literal(equations.n, j))
            place = _literal(equations.n, i)
            lines += _block(syntax, begin, syntax.body(body, loads, _adding(syntax, place)))
        return lines
    lines += _loop(syntax, "i", "NODES", _node(equations, syntax, "i", _indexed("i")))
    if equations.links:
        loads = _pair(equations, _indexed("i"), _indexed("j"))
        inner = syntax.body(link_body(equations), loads, _adding(syntax, _indexed("i")))
        lines += _loop(syntax, "link", "LINKS", [*_ends(syntax, equations, False), *inner])
    return lines


def jacobian_lines(equations: Equations, syntax: Syntax) -> list[str]:
    """The statements that write the Jacobian: dense to `matrix`, or for many nodes entry by entry to `values`."""
    lines = _parameters(equations, syntax, True)
    if is_unrolled(equations):
        return lines + _dense(equations, syntax)
    own = list(node_places(equations))

    def place_own(place: Any, text: str) -> str:
        return syntax.assign.format(f"values[{_index(own.index(place), 'NODES', 'i')}]", "=", text)

    body = node_body(equations, True)
    loads = dict(zip(equations.node.state, _states(equations, _indexed("i")), strict=True))
    lines += _loop(syntax, "i", "NODES", syntax.body(body, loads, place_own))
    if equations.links:
        here, there = link_places(equations)
        slots = [(False, place) for place in here] + [(True, place) for place in there]

        def place_link(place: Any, text: str) -> str:
            slot = _index(slots.index(place), "LINKS", "link")
            first = f"{len(own)}*NODES + " if own else ""
            return syntax.assign.format(f"values[{first}{slot}]", "=", text)

        pair = _pair(equations, _indexed("i"), _indexed("j"))
        inner = syntax.body(link_body(equations, None, True), pair, place_link)
        lines += _loop(syntax, "link", "LINKS", [*_ends(syntax, equations, True), *inner])
    return lines


def _dense(equations: Equations, syntax: Syntax) -> list[str]:
    n, lines = equations.n, list[str]()
    body = node_body(equations, True)
    for i, begin in enumerate(_nodes(equations, syntax)):
        at = _literal(n, i)
        loads = dict(zip(equations.node.state, _states(equations, at), strict=True))
        lines += _block(syntax, begin, syntax.body(body, loads, _entry(syntax, at, at, "=")))
    for (i, j, weight), begin in zip(equations.links, _links(equations, syntax), strict=True):
        at, other = _literal(n, i), _literal(n, j)
        body = link_body(equations, sp.Rational(weight.numerator, weight.denominator), True)

        def store(place: Any, text: str, at: Callable[[int], str] = at, other: Callable[[int], str] = other) -> str:
            there, inner = place
            return _entry(syntax, at, other if there else at, "+=")(inner, text)

        lines += _block(syntax, begin, syntax.body(body, _pair(equations, at, other), store))
    return lines


def _entry(syntax: Syntax, row: Callable[[int], str], column: Callable[[int], str], sign: str) -> Store:
    def store(place: Any, text: str) -> str:
        r, c = place
        return syntax.assign.format(syntax.entry.format(row(r), column(c)), sign, text)

    return store


def _parameters(equations: Equations, syntax: Syntax, jacobian: bool) -> list[str]:
    """Read the parameters that are used from `numbers`; nothing where the language has them as arguments."""
    bodies = [node_body(equations, jacobian), link_body(equations, None, jacobian)]
    if not syntax.reads:
        return []
    return [syntax.declare.format(equations.parameters[k], f"numbers[{k}]") for k in parameters(equations, bodies)]


def _node(equations: Equations, syntax: Syntax, i: str, at: Callable[[int], str]) -> list[str]:
    loads = dict(zip(equations.node.state, _states(equations, at), strict=True))
    return syntax.body(node_body(equations), loads, lambda c, text: syntax.assign.format(f"rates[{at(c)}]", "=", text))


def _adding(syntax: Syntax, at: Callable[[int], str]) -> Store:
    return lambda c, text: syntax.assign.format(f"rates[{at(c)}]", "+=", text)


def _states(equations: Equations, at: Callable[[int], str]) -> list[str]:
    return [f"state[{at(c)}]" for c in range(len(equations.node.state))]


def _pair(equations: Equations, here: Callable[[int], str], there: Callable[[int], str]) -> dict[sp.Symbol, str]:
    edge = equations.edge
    if edge is None:
        return {}
    return dict(zip((*edge.here, *edge.there), (*_states(equations, here), *_states(equations, there)), strict=True))


def _literal(n: int, i: int) -> Callable[[int], str]:
    return lambda c: str(c * n + i)


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
        lines.append(syntax.whole.format("i", "TARGET[link]"))
    if body.uses(edge.there):
        lines.append(syntax.whole.format("j", "SOURCE[link]"))
    if body.uses([edge.weight]):
        lines.append(syntax.declare.format(edge.weight.name, "WEIGHT[link]"))
    return lines


def _loop(syntax: Syntax, index: str, end: str, lines: list[str]) -> list[str]:
    inner = [f"    {line}" for line in lines]
    if syntax.braces:
        return [f"for (int {index} = 0; {index} < {end}; {index}++) {{", *inner, "}"]
    return [f"for {index} in range({end}):", *(inner or ["    pass"])]
