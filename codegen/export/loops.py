"""Functions of one scalar after another, as C and Numba have them: node by node, or in loops over nodes and links.

Parameters come in the array `numbers` or, where a language has them as arguments, by their names.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, TypeAlias

import sympy as sp

from synchain.models.dynamics.equations import Equations

from ..program.expressions import Expression, Load, Name, Number, plus
from ..program.passes import real
from ..program.statements import Accumulate, Identity, Loop, Statement, Store, Titled, let, whole
from .body import (
    Body,
    Linked,
    Storing,
    is_unrolled,
    link_body,
    link_places,
    mass_body,
    node_body,
    node_mass_body,
    node_places,
    node_rate_symbols,
    own_parameters,
    parameters,
    rate_symbols,
)

__all__ = ["jacobian_statements", "mass_statements", "place_of", "rhs_statements"]

Places: TypeAlias = Callable[[int], Expression]
"""Where the components of a node stand."""


def rhs_statements(equations: Equations, reads: bool = True) -> list[Statement]:
    """The statements that write the right-hand side of the whole network to `rates`; `reads` parameters from `numbers`."""
    found = _parameters(equations, False) if reads else []
    if is_unrolled(equations):
        for i, title in enumerate(_nodes(equations)):
            at = _literal(equations.places[i])
            body = node_body(equations, i=i).statements(_loads(equations, i, at, reads), _to("rates", Store, at))
            found.append(Titled(title, tuple(body)))
        return found + list(_of_links(equations, link_body, lambda at, _: _to("rates", Accumulate, at), reads))
    here = _indexed("i_")
    nodes = node_body(equations).statements(_loads(equations, None, here, reads), _to("rates", Store, here))
    found.append(_loop("i_", "NODES", nodes))
    if equations.links:
        pair = _pair(equations, here, _indexed("j_"))
        links = link_body(equations).statements(pair, _to("rates", Accumulate, here))
        found.append(_loop("link_", "LINKS", [*_ends(equations, False), *links]))
    return found


def jacobian_statements(equations: Equations, reads: bool = True) -> list[Statement]:
    """The statements that write the Jacobian: dense to `matrix`, or for many nodes entry by entry to `values`."""
    found = _parameters(equations, True) if reads else []
    if is_unrolled(equations):
        for i, title in enumerate(_nodes(equations)):
            at = _literal(equations.places[i])
            loads = _loads(equations, i, at, reads)
            storing = _entry("matrix", Store, at, at)
            found.append(Titled(title, tuple(node_body(equations, True, i).statements(loads, storing))))

        def link_jacobian(equations: Equations, link: Linked) -> Body:
            return link_body(equations, link, True)

        return found + list(_of_links(equations, link_jacobian, _either_end("matrix"), reads))
    own, here = list(node_places(equations)), _indexed("i_")

    def store_own(place: Any, value: Expression) -> Statement:
        return Store("values", place_of(own.index(place), "NODES", "i_"), value)

    body = node_body(equations, True).statements(_loads(equations, None, here, reads), store_own)
    found.append(_loop("i_", "NODES", body))
    if equations.links:
        slots = list(link_places(equations))

        def store_link(place: Any, value: Expression) -> Statement:
            slot = place_of(slots.index(place), "LINKS", "link_")
            return Store("values", plus(len(own) * Name("NODES"), slot) if own else slot, value)

        pair = _pair(equations, here, _indexed("j_"))
        links = link_body(equations, None, True).statements(pair, store_link)
        found.append(_loop("link_", "LINKS", [*_ends(equations, True), *links]))
    return found


def mass_statements(equations: Equations, reads: bool = True) -> list[Statement]:
    """The statements that build the mass matrix, for networks that are written out."""
    blocks = [*_of_nodes(equations, reads), *_of_links(equations, mass_body, _either_end("mass_"), reads)]
    return [Identity("mass_", Name("DIMENSION")), *(block for block in blocks if block.body)]


def _of_nodes(equations: Equations, reads: bool) -> Iterator[Titled]:
    """The mass matrix of each node."""
    for i, title in enumerate(_nodes(equations)):
        at = _literal(equations.places[i])
        storing = _entry("mass_", Store, at, at)
        yield Titled(title, tuple(node_mass_body(equations, i).statements(_loads(equations, i, at, reads), storing)))


def place_of(block: int, size: str, index: str) -> Expression:
    """Element `index` of one of several blocks of some size."""
    return Name(index) if block == 0 else (Name(size) if block == 1 else block * Name(size)) + index


def _of_links(
    equations: Equations,
    body_of: Callable[[Equations, Linked], Body],
    storing: Callable[[Places, Places], Storing],
    reads: bool,
) -> Iterator[Titled]:
    """One block for each link; `storing` is made of the places of its target and of its source."""
    places = equations.places
    for link in equations.linked():
        target, source, _ = link[0]
        at, other = _literal(places[target]), _literal(places[source])
        body = body_of(equations, link).statements(_pair(equations, at, other, link, reads), storing(at, other))
        yield Titled(f"oscillator {target + 1} feels oscillator {source + 1}", tuple(body))


def _to(array: str, statement: type[Store] | type[Accumulate], at: Places) -> Storing:
    return lambda c, value: statement(array, at(c), value)


def _entry(array: str, statement: type[Store] | type[Accumulate], row: Places, column: Places) -> Storing:
    return lambda place, value: statement(array, (row(place[0]), column(place[1])), value)


def _either_end(array: str) -> Callable[[Places, Places], Storing]:
    """Adds to entries in the rows of the target and, as each place tells, the columns of the target or of the source."""

    def made(at: Places, other: Places) -> Storing:
        return lambda place, value: _entry(array, Accumulate, at, other if place[0] else at)(place[1], value)

    return made


def _parameters(equations: Equations, jacobian: bool) -> list[Statement]:
    """Read the parameters that are used from `numbers`."""
    firsts = {kind: i for i, kind in enumerate(equations.kind_of)}.values()
    ends = {edge: (link, edge) for link, edge in equations.linked()}.values()
    bodies = [node_body(equations, jacobian, i) for i in firsts]
    bodies += [link_body(equations, link, jacobian) for link in ends]
    bodies += [mass_body(equations, link) for link in ends]
    bodies += [node_mass_body(equations, i) for i in firsts]
    return [let(equations.parameters[k], _at("numbers", Number(k))) for k in parameters(equations, bodies)]


def _at(array: str, index: Expression) -> Load:
    return Load(array, index, None)


def _loads(equations: Equations, i: int | None, at: Places, reads: bool) -> dict[sp.Symbol, Expression]:
    """Where the states of a node are and the parameters that it has for itself; node None is the one of a loop."""
    found: dict[sp.Symbol, Expression] = {s: _at("state", at(c)) for c, s in enumerate(equations.node_at(i or 0).state)}
    for s, k in own_parameters(equations, i or 0).items():
        place = Number(k) + "i_" if i is None else Number(k)
        found[s] = _at("numbers", place) if reads else Name(equations.parameters[k])
    return found | {s: _at("rates", at(c)) for c, s in enumerate(node_rate_symbols(equations.node_at(i or 0)))}


def _pair(
    equations: Equations, here: Places, there: Places, link: Linked | None = None, reads: bool = True
) -> dict[sp.Symbol, Expression]:
    """Where the states at both ends of a link are, the parameters of its ends, and the rates."""
    edge = equations.edge if link is None else link[1]
    if edge is None:
        return {}
    places = [*map(here, range(len(edge.here))), *map(there, range(len(edge.there)))]
    found: dict[sp.Symbol, Expression] = {
        s: _at("state", place) for s, place in zip((*edge.here, *edge.there), places, strict=True)
    }
    if link is not None:  # a mass of the target that differs from node to node
        (target, source, _), names = link[0], equations.parameters
        own = own_parameters(equations, target)
        own |= {s: names.index(f"{of.name}_{source + 1}") for s, of in edge.theirs}
        numbered = (s for s in edge.parameters if s.name in equations.numbered)
        own |= {s: names.index(equations.numbered[s.name].name(s.name, link[0])) for s in numbered}
        for s, k in own.items():
            found[s] = _at("numbers", Number(k)) if reads else Name(names[k])
    else:
        for name, layer in equations.numbered.items():
            first = Number(equations.parameters.index(layer.names(name)[0]))
            found[real(name)] = _at("numbers", first + _at("NUMBER", Name("link_")))
    return found | {s: _at("rates", place) for s, place in zip(rate_symbols(edge), places, strict=True)}


def _literal(places: tuple[int, ...]) -> Places:
    return lambda c: Number(places[c])


def _indexed(name: str) -> Places:
    return lambda c: place_of(c, "NODES", name)


def _nodes(equations: Equations) -> list[str]:
    return [f"oscillator {i + 1}" for i in range(equations.n)]


def _ends(equations: Equations, jacobian: bool) -> list[Statement]:
    """The two ends and the weight of a link, those that are used."""
    edge, body = equations.edge, link_body(equations, None, jacobian)
    if edge is None:
        return []
    found, link = list[Statement](), Name("link_")
    if not jacobian or body.uses(edge.here):
        found.append(whole("i_", _at("TARGET", link)))
    if body.uses(edge.there):
        found.append(whole("j_", _at("SOURCE", link)))
    if body.uses([edge.weight]):
        found.append(let(edge.weight.name, _at("WEIGHT", link)))
    return found


def _loop(index: str, end: str, body: list[Statement]) -> Loop:
    return Loop(index, Number(0), Name(end), tuple(body))
