"""Write scalar statements for C and Numba: node by node, or as loops over nodes and links.

A `Site` is a node or a link, with the indices of its states, parameters and rates.  Parameters are read from the array
`numbers`, unless the function takes them as arguments.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import Edge

from ..program.expressions import Expression, Load, Name, Number, plus
from ..program.passes import real
from ..program.statements import Accumulate, Identity, Loop, Statement, Store, Titled, let, mentioned, whole
from .body import (
    Entry,
    ExportBody,
    Linked,
    Storing,
    is_unrolled,
    link_jacobian,
    link_mass,
    link_rate_symbols,
    link_rhs,
    node_jacobian,
    node_mass,
    node_parameters,
    node_rate_symbols,
    node_rhs,
)

Index: TypeAlias = Callable[[int], Expression]  # returns the index of a component in the state


@dataclass(frozen=True, slots=True)
class Site:
    """A node, or a link with its target and its source."""

    # here, there: index in the state of a component of the target (or of the node itself), and of the source. loads:
    # the expression from which each symbol is read. title: title of the block; empty for the site of a loop. node,
    # link: the node or link whose templates are used.

    here: Index
    loads: Mapping[sp.Symbol, Expression]
    title: str = ""
    node: int = 0
    there: Index | None = None
    link: Linked | None = None

    def block(self, table: Mapping[Any, sp.Expr], storing: Storing) -> Titled | Loop:
        """Return the statements for a table of results."""
        body = ExportBody.of(table)
        statements = body.statements(self.loads, storing)
        if self.title:
            return Titled(self.title, tuple(statements))
        if self.there is None:
            return Loop("i_", Number(0), Name("NODES"), tuple(statements))
        # load the ends of the link, if the body uses them
        link, names = Name("link_"), mentioned(statements)
        ends = [whole(end, _at(array, link)) for end, array in (("i_", "TARGET"), ("j_", "SOURCE")) if end in names]
        return Loop("link_", Number(0), Name("LINKS"), (*ends, *statements))

    def entries(self, array: str) -> Storing:
        """Return the function that stores matrix entries: it assigns entries of a node and adds entries of a link."""
        kind = Store if self.there is None else Accumulate

        def store(entry: Entry, value: Expression) -> Statement:
            column = self.there if entry.source and self.there is not None else self.here
            return kind(array, (self.here(entry.row), column(entry.column)), value)

        return store


def rhs_statements(equations: Equations, reads: bool = True) -> list[Statement]:
    """Return statements that write the right-hand side to `rates`; if `reads`, first read parameters from `numbers`."""

    def storing(site: Site) -> Storing:
        kind = Store if site.there is None else Accumulate
        return lambda c, value: kind("rates", site.here(c), value)

    return [
        *(_parameters(equations, node_rhs, link_rhs) if reads else []),
        *(site.block(node_rhs(equations, site.node), storing(site)) for site in _nodes(equations, reads)),
        *(site.block(link_rhs(equations, site.link), storing(site)) for site in _links(equations, reads)),
    ]


def jacobian_statements(equations: Equations, reads: bool = True) -> list[Statement]:
    """Return statements that write the Jacobian: dense to `matrix`, or for many nodes entry by entry to `values`."""

    def storing(site: Site) -> Storing:
        if is_unrolled(equations):
            return site.entries("matrix")
        of_node, of_link = list(node_jacobian(equations)), list(link_jacobian(equations))
        if site.there is None:
            return lambda entry, value: Store("values", element_of(of_node.index(entry), "NODES", "i_"), value)
        # `values` holds the entries of all nodes first, then the entries of all links
        begin = [len(of_node) * Name("NODES")] if of_node else []
        slots = {entry: plus(*begin, element_of(k, "LINKS", "link_")) for k, entry in enumerate(of_link)}
        return lambda entry, value: Store("values", slots[entry], value)

    return [
        *(_parameters(equations, node_jacobian, link_jacobian) if reads else []),
        *(site.block(node_jacobian(equations, site.node), storing(site)) for site in _nodes(equations, reads)),
        *(site.block(link_jacobian(equations, site.link), storing(site)) for site in _links(equations, reads)),
    ]


def mass_statements(equations: Equations, reads: bool = True) -> list[Statement]:
    """Return statements that build the mass matrix, for networks that are written out."""
    blocks = [site.block(node_mass(equations, site.node), site.entries("mass_")) for site in _nodes(equations, reads)]
    blocks += [site.block(link_mass(equations, site.link), site.entries("mass_")) for site in _links(equations, reads)]
    return [Identity("mass_", Name("DIMENSION")), *(block for block in blocks if block.body)]


def element_of(block: int, size: str, index: str) -> Expression:
    """Return the index of an element of one of several blocks of some size."""
    return Name(index) if block == 0 else (Name(size) if block == 1 else block * Name(size)) + index


def _at(array: str, index: Expression) -> Load:
    return Load(array, index, None)


def _nodes(equations: Equations, reads: bool) -> Iterator[Site]:
    """Yield one site for each node, or a single site for the loop over nodes."""
    names = equations.parameters
    for i in range(equations.n) if is_unrolled(equations) else (None,):
        node, k = equations.node_at(i or 0), i or 0
        here = _indexed("i_") if i is None else _literal(equations.places[i])
        loads: dict[sp.Symbol, Expression] = {s: _at("state", here(c)) for c, s in enumerate(node.state)}
        for s, slot in node_parameters(equations, k).items():
            index = Number(slot) + "i_" if i is None else Number(slot)
            loads[s] = _at("numbers", index) if reads else Name(names[slot])
        loads |= {s: _at("rates", here(c)) for c, s in enumerate(node_rate_symbols(node))}
        yield Site(here, loads, "" if i is None else f"oscillator {i + 1}", k)


def _links(equations: Equations, reads: bool) -> Iterator[Site]:
    """Yield one site for each link, or a single site for the loop over links."""
    names = equations.parameters
    if is_unrolled(equations):
        for (target, source, weight, *_), edge in equations.linked():
            link = target, source, weight
            here, there = (_literal(equations.places[end]) for end in (target, source))
            # parameters that differ between nodes or links: of the target, of the source, of the link
            slots = node_parameters(equations, target)
            slots |= {s: names.index(f"{of.name}_{source + 1}") for s, of in edge.theirs}
            numbered = (s for s in edge.parameters if s.name in equations.numbered)
            slots |= {s: names.index(equations.numbered[s.name].name(s.name, link)) for s in numbered}
            values: dict[sp.Symbol, Expression] = {
                s: _at("numbers", Number(k)) if reads else Name(names[k]) for s, k in slots.items()
            }
            title = f"oscillator {target + 1} feels oscillator {source + 1}"
            yield Site(here, _loads_of(edge, here, there, values), title, there=there, link=(link, edge))
    elif equations.links and (template := equations.edge) is not None:
        here, there = _indexed("i_"), _indexed("j_")
        values = dict[sp.Symbol, Expression]()
        for name, layer in equations.numbered.items():
            first = Number(names.index(layer.names(name)[0]))
            values[real(name)] = _at("numbers", first + _at("NUMBER", Name("link_")))
        loads = {template.weight: _at("WEIGHT", Name("link_")), **_loads_of(template, here, there, values)}
        yield Site(here, loads, there=there)


def _loads_of(
    edge: Edge, here: Index, there: Index, parameters: dict[sp.Symbol, Expression]
) -> dict[sp.Symbol, Expression]:
    """Return the expressions from which to read states and rates at both ends of a link, and its parameters."""
    slots = [*map(here, range(len(edge.here))), *map(there, range(len(edge.there)))]
    states = {s: _at("state", slot) for s, slot in zip((*edge.here, *edge.there), slots, strict=True)}
    rates = {s: _at("rates", slot) for s, slot in zip(link_rate_symbols(edge), slots, strict=True)}
    return {**states, **parameters, **rates}


def _literal(slots: tuple[int, ...]) -> Index:
    return lambda c: Number(slots[c])


def _indexed(name: str) -> Index:
    return lambda c: element_of(c, "NODES", name)


def _parameters(
    equations: Equations,
    of_node: Callable[[Equations, int], Mapping[Any, sp.Expr]],
    of_link: Callable[[Equations, Linked], Mapping[Any, sp.Expr]],
) -> list[Statement]:
    """Return statements that read the parameters of the whole network that are used from `numbers`."""
    nodes = {kind: i for i, kind in enumerate(equations.kind_of)}.values()
    links = {edge: ((link[0], link[1], link[2]), edge) for link, edge in equations.linked()}.values()
    tables = [table(equations, i) for table in (of_node, node_mass) for i in nodes]
    tables += [table(equations, link) for table in (of_link, link_mass) for link in links]
    used = {s for table in tables for e in table.values() for s in sp.sympify(e).free_symbols}
    return [let(name, _at("numbers", Number(k))) for k, name in enumerate(equations.parameters) if real(name) in used]
