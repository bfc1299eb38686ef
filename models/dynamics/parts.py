"""Parts of a network: nodes whose rows are solved together, because rows of links join them.

The rows of a part share one system D (K x - b) + (1 - D) (x - s) = 0 with K = G M^-1 G^T over all its rows
(`synchain.models.mechanics.rows`).  Parts without common nodes are independent.  A part is solved once for all parts of
its shape, in symbols that number its nodes from 1 and with a symbol for the rate of each state without rows.  Parts of
one shape therefore have the same code, and equal bits in equal states.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property, lru_cache

import sympy as sp

from ..interactions.ends import has_velocities
from ..mechanics.components import Edge, Node
from ..mechanics.rows import MOST_JOINED, Law, Row, Surface, added_rates, rows_of

MOST_JOINED_NODES = 16
"""Most nodes of a network with rows in links (a choice): its steps are written out, and longer ones compile slowly."""


@dataclass(frozen=True, slots=True)
class Member:
    """A node of a network, with the symbols and places that the network has for its own."""

    node: Node
    at: Mapping[sp.Symbol, sp.Symbol]  # for each state and each parameter that differs from node to node
    places: tuple[int, ...]  # of its continuous states


@dataclass(frozen=True, slots=True)
class PartLink:
    """A link with rows; its ends are places in the part, or in the network, from 0."""

    edge: Edge
    target: int
    source: int
    weight: Fraction
    modes: tuple[int, ...]  # places of the modes of its rows among `Node.joined` of the source
    numbered: tuple[str, ...]  # parameters with a value for each link


@dataclass(frozen=True, slots=True)
class PartTemplate:
    """The rows of all parts of one shape."""

    state: tuple[sp.Symbol, ...]  # the continuous states of all nodes
    rates: tuple[sp.Symbol | None, ...]  # the rate of each state without rows; None for coordinates
    rows: tuple[Row, ...]
    added: tuple[sp.Expr, ...]  # what the rows add to the rate of each state
    owners: tuple[tuple[int, int], ...]  # for each row the node, and its number among the rows of this node


class Cached:
    """Give a dataclass with slots a dictionary for cached properties; pickles omit this dictionary."""


@dataclass(frozen=True, slots=True)
class Part(Cached):
    """A part of a network: its nodes, and the symbols and states of the network for its template."""

    nodes: tuple[int, ...]
    template: PartTemplate
    at: Mapping[sp.Symbol, sp.Symbol]  # for each state and parameter of the template the symbol of the network
    places: tuple[int, ...]  # for each state of the template its index in the state of the network
    rates: Mapping[sp.Symbol, sp.Expr]  # for each symbol of a rate in the template the rate without rows

    @property
    def owners(self) -> list[tuple[int, int]]:
        """The node of the network, and the number in the node, of each row."""
        return [(self.nodes[m], a) for m, a in self.template.owners]

    @cached_property
    def rows(self) -> tuple[Row, ...]:
        """The rows in the symbols of the network."""
        return tuple(row.map(self._placed) for row in self.template.rows)

    @cached_property
    def added(self) -> tuple[sp.Expr, ...]:
        """What the rows add to the rate of each state, in the symbols of the network."""
        return tuple(map(self._placed, self.template.added))

    def _placed(self, e: sp.Expr) -> sp.Expr:
        return e.xreplace({**self.at, **self.rates})


def parts_of(
    members: Sequence[Member],
    links: Sequence[tuple[PartLink, Mapping[str, sp.Symbol]]],
    rates: Sequence[sp.Expr],
    varied: tuple[str, ...],
) -> tuple[Part, ...]:
    """Return the parts of a network with rows in links, in the order of their first nodes.

    `links`: links between `members`, with the symbol of each numbered parameter; `rates`: without rows, in state order.
    """
    part_of = list(range(len(members)))
    for link, _ in links:
        merged = part_of[link.source]
        part_of = [part_of[link.target] if k == merged else k for k in part_of]
    parts = []
    for number in dict.fromkeys(part_of):
        nodes = tuple(i for i in range(len(members)) if part_of[i] == number)
        at: dict[sp.Symbol, sp.Symbol] = {}
        for m, i in enumerate(nodes):
            at |= {local(s, m): e for s, e in members[i].at.items()}
        shape = list[PartLink]()
        for link, symbols in (each for each in links if each[0].target in nodes):
            at |= {of_link(name, len(shape)): s for name, s in symbols.items()}
            shape.append(replace(link, target=nodes.index(link.target), source=nodes.index(link.source)))
        template = part_template(tuple(members[i].node for i in nodes), tuple(shape), varied)
        if template.rows:
            places = tuple(k for i in nodes for k in members[i].places)
            plain = {s: rates[k] for s, k in zip(template.rates, places, strict=True) if s is not None}
            parts.append(Part(nodes, template, at, places, plain))
    return tuple(parts)


def local(s: sp.Symbol, m: int) -> sp.Symbol:
    """Return the symbol of a state or parameter at node `m` of a part."""
    return sp.Symbol(f"{s.name}_{m + 1}", real=True)


def of_link(name: str, k: int) -> sp.Symbol:
    """Return the symbol of a parameter with a value for each link, at link `k` of a part."""
    return sp.Symbol(f"{name} of link {k + 1}", real=True)


@lru_cache(maxsize=64)
def part_template(nodes: tuple[Node, ...], links: tuple[PartLink, ...], varied: tuple[str, ...]) -> PartTemplate:
    """Solve the rows of some nodes and of the links between them."""
    state: list[sp.Symbol] = []
    rates: list[sp.Expr] = []
    unknown: list[sp.Symbol | None] = []
    speeds: dict[sp.Symbol, sp.Symbol] = {}
    firsts: list[int] = []
    for m, node in enumerate(nodes):
        firsts.append(len(state))
        symbols = [local(s, m) for s in node.continuous]
        half = len(symbols) // 2 if has_velocities(node) else 0
        free = [sp.Symbol(f"rate of {s}", real=True) for s in symbols[half:]]
        state += symbols
        rates += [*symbols[half : 2 * half], *free]
        unknown += [*[None] * half, *free]
        speeds |= dict(zip(symbols[half:], symbols[:half], strict=False))

    surfaces: list[Surface] = []
    modes: list[sp.Symbol] = []
    owners: list[tuple[int, int]] = []

    def add(
        surface: Surface, values: Mapping[sp.Symbol, sp.Expr], pushed: Sequence[int], mode: sp.Symbol | None
    ) -> None:
        placed = surface.map(lambda e: e.xreplace(dict(values)))
        column = [sp.S.Zero] * len(state)
        for k, e in zip(pushed, placed.push, strict=False):
            column[k] = e
        surfaces.append(replace(placed, push=tuple(column)))
        modes.extend([] if mode is None else [mode])

    def places(m: int) -> range:
        return range(firsts[m], firsts[m] + len(nodes[m].continuous))

    def own(m: int) -> dict[sp.Symbol, sp.Expr]:
        differing = (s for s in nodes[m].parameters if s.name in varied)
        return {s: local(s, m) for s in (*nodes[m].state, *differing)}

    for m, node in enumerate(nodes):
        joined = iter(node.joined)
        for a, surface in enumerate(node.surfaces):
            mode = None if surface.law is Law.RESET else local(next(joined), m)
            add(surface, own(m), places(m), mode)
            owners.append((m, a))
    for k, link in enumerate(links):
        edge, source = link.edge, nodes[link.source]
        values: dict[sp.Symbol, sp.Expr] = {edge.weight: sp.Rational(link.weight.numerator, link.weight.denominator)}
        values |= {s: e for s, e in own(link.target).items() if s in edge.parameters}
        for ends, m in ((edge.here, link.target), (edge.there, link.source)):
            values |= {s: local(named, m) for s, named in zip(ends, nodes[m].state, strict=True)}
        values |= {s: local(parameter, link.source) for s, parameter in edge.theirs}
        values |= {s: of_link(s.name, k) for s in edge.parameters if s.name in link.numbered}
        pushed = [*places(link.target), *places(link.source)]
        held = sum(surface.law is not Law.RESET for surface in source.surfaces)
        for surface, number in zip(edge.surfaces, link.modes, strict=True):
            add(surface, values, pushed, local(source.joined[number], link.source))
            owners.append((link.source, len(source.surfaces) + number - held))
    if len(modes) > MOST_JOINED:
        raise ValueError(
            f"rows in links: found {len(modes)} contacts and stops that share nodes; expected at most {MOST_JOINED}, which are "
            "decided together"
        )
    rows = rows_of(state, rates, surfaces, modes, speeds)
    return PartTemplate(tuple(state), tuple(unknown), rows, tuple(added_rates(rows, len(state))), tuple(owners))
