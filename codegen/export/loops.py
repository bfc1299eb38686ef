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
from ..program.statements import Accumulate, Identity, Loop, Statement, Store, Titled, let, mentioned, whole
from .body import (
    ExportBody,
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

StateLayout: TypeAlias = Callable[[int], Expression]
"""Where the components of a node stand."""


def rhs_statements(equations: Equations, reads: bool = True) -> list[Statement]:
    """The statements that write the right-hand side of the whole network to `rates`; `reads` parameters from `numbers`."""
    return [
        *(_parameters(equations, False) if reads else []),
        *_of_nodes(equations, lambda i: node_body(equations, i=i), lambda at: _to("rates", Store, at), reads),
        *_of_links(equations, lambda e: link_body(equations, e), lambda at, _: _to("rates", Accumulate, at), reads),
    ]


def jacobian_statements(equations: Equations, reads: bool = True) -> list[Statement]:
    """The statements that write the Jacobian: dense to `matrix`, or for many nodes entry by entry to `values`."""
    of_node, of_link = (_own("matrix"), _either_end("matrix")) if is_unrolled(equations) else _listed(equations)
    return [
        *(_parameters(equations, True) if reads else []),
        *_of_nodes(equations, lambda i: node_body(equations, True, i), of_node, reads),
        *_of_links(equations, lambda link: link_body(equations, link, True), of_link, reads),
    ]


def mass_statements(equations: Equations, reads: bool = True) -> list[Statement]:
    """The statements that build the mass matrix, for networks that are written out."""
    blocks = [
        *_of_nodes(equations, lambda i: node_mass_body(equations, i), _own("mass_"), reads),
        *_of_links(equations, lambda link: mass_body(equations, link), _either_end("mass_"), reads),
    ]
    return [Identity("mass_", Name("DIMENSION")), *(block for block in blocks if block.body)]


def place_of(block: int, size: str, index: str) -> Expression:
    """Element `index` of one of several blocks of some size."""
    return Name(index) if block == 0 else (Name(size) if block == 1 else block * Name(size)) + index


def _of_nodes(
    equations: Equations, body_of: Callable[[int], ExportBody], storing: Callable[[StateLayout], Storing], reads: bool
) -> Iterator[Titled | Loop]:
    """One block for each node, or one loop over them; `storing` is made of the places of a node."""
    if not is_unrolled(equations):
        here = _indexed("i_")
        yield _loop("i_", "NODES", body_of(0).statements(_loads(equations, None, here, reads), storing(here)))
        return
    for i in range(equations.n):
        at = _literal(equations.places[i])
        body = body_of(i).statements(_loads(equations, i, at, reads), storing(at))
        yield Titled(f"oscillator {i + 1}", tuple(body))


def _of_links(
    equations: Equations,
    body_of: Callable[[Linked | None], ExportBody],
    storing: Callable[[StateLayout, StateLayout], Storing],
    reads: bool,
) -> Iterator[Titled | Loop]:
    """One block for each link, or one loop over them; `storing` is made of the places of its target and of its source."""
    if not is_unrolled(equations) and equations.links:
        here, there, body = _indexed("i_"), _indexed("j_"), body_of(None)
        statements = body.statements(_pair(equations, here, there), storing(here, there))
        yield _loop("link_", "LINKS", [*_ends(equations, body, statements), *statements])
    for link in equations.linked() if is_unrolled(equations) else ():
        target, source, _ = link[0]
        at, other = _literal(equations.places[target]), _literal(equations.places[source])
        found = body_of(link).statements(_pair(equations, at, other, link, reads), storing(at, other))
        yield Titled(f"oscillator {target + 1} feels oscillator {source + 1}", tuple(found))


def _to(array: str, statement: type[Store] | type[Accumulate], at: StateLayout) -> Storing:
    return lambda c, value: statement(array, at(c), value)


def _entry(array: str, statement: type[Store] | type[Accumulate], row: StateLayout, column: StateLayout) -> Storing:
    return lambda place, value: statement(array, (row(place[0]), column(place[1])), value)


def _own(array: str) -> Callable[[StateLayout], Storing]:
    """Stores entries in the rows and columns of a node."""
    return lambda at: _entry(array, Store, at, at)


def _either_end(array: str) -> Callable[[StateLayout, StateLayout], Storing]:
    """Adds to entries in the rows of the target and, as each place tells, the columns of the target or of the source."""

    def made(at: StateLayout, other: StateLayout) -> Storing:
        return lambda place, value: _entry(array, Accumulate, at, other if place[0] else at)(place[1], value)

    return made


def _listed(
    equations: Equations,
) -> tuple[Callable[[StateLayout], Storing], Callable[[StateLayout, StateLayout], Storing]]:
    """Store the entries of all nodes, and those of all links, place by place behind each other."""
    own, slots = list(node_places(equations)), list(link_places(equations))

    def of_node(place: Any, value: Expression) -> Statement:
        return Store("values", place_of(own.index(place), "NODES", "i_"), value)

    def of_link(place: Any, value: Expression) -> Statement:
        slot = place_of(slots.index(place), "LINKS", "link_")
        return Store("values", plus(len(own) * Name("NODES"), slot) if own else slot, value)

    return lambda at: of_node, lambda at, other: of_link


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


def _loads(equations: Equations, i: int | None, at: StateLayout, reads: bool) -> dict[sp.Symbol, Expression]:
    """Where the states of a node are and the parameters that it has for itself; node None is the one of a loop."""
    found: dict[sp.Symbol, Expression] = {s: _at("state", at(c)) for c, s in enumerate(equations.node_at(i or 0).state)}
    for s, k in own_parameters(equations, i or 0).items():
        place = Number(k) + "i_" if i is None else Number(k)
        found[s] = _at("numbers", place) if reads else Name(equations.parameters[k])
    return found | {s: _at("rates", at(c)) for c, s in enumerate(node_rate_symbols(equations.node_at(i or 0)))}


def _pair(
    equations: Equations, here: StateLayout, there: StateLayout, link: Linked | None = None, reads: bool = True
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


def _literal(places: tuple[int, ...]) -> StateLayout:
    return lambda c: Number(places[c])


def _indexed(name: str) -> StateLayout:
    return lambda c: place_of(c, "NODES", name)


def _ends(equations: Equations, body: ExportBody, statements: list[Statement]) -> list[Statement]:
    """The two ends and the weight of a link, those that are used."""
    edge, link, names = equations.edge, Name("link_"), mentioned(statements)
    if edge is None:
        return []
    ends = [whole(name, _at(array, link)) for name, array in (("i_", "TARGET"), ("j_", "SOURCE")) if name in names]
    return [*ends, *(let(s.name, _at("WEIGHT", link)) for s in body.uses([edge.weight]))]


def _loop(index: str, end: str, body: list[Statement]) -> Loop:
    return Loop(index, Number(0), Name(end), tuple(body))
