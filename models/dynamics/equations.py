"""Equations of motion of a network: templates of its nodes and links, and the list of its links.

Printing, code generation, spectra and variational equations read only `Equations`.  A template holds the equations of
one node or one link in symbols.  It does not depend on the size of the network, so a large network costs no algebra.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from itertools import chain, compress, count

import sympy as sp

from ..graphs.links import AllPairs, Link, Links
from ..inputs.display import HasLatex
from ..inputs.names import LinkName
from ..interactions.ends import has_velocities
from ..interactions.separation import separated
from ..mechanics.calculus import derivative
from ..mechanics.components import TIME, Block, Edge, Node
from ..mechanics.events import Event
from ..mechanics.rows import Law, Row
from .parts import MOST_JOINED_NODES, Cached, Member, Part, PartLink, parts_of

Ends = tuple[int, int]
"""The kinds of a link's target and source."""

Entry = tuple[tuple[int, int], sp.Expr]

Triad = tuple[int, int, Fraction, int]
"""Target, source, weight and second source of a link of three ends."""

DIGEST_LIMIT = 10_000
"""Most links of a complete graph that a digest lists one by one (a choice).

Up to this number a complete graph and a list of the same links have equal digests.
"""


@dataclass(frozen=True, slots=True)
class Layer:
    """The links of one coupling on one graph."""

    edge_of: tuple[tuple[Ends, Edge], ...]  # the templates of the links, by the kinds of their targets and sources
    # Target and source (0-based) and weight of each link. `AllPairs` stands for all links of a complete graph, which
    # act by mean fields (`synchain.models.interactions.separation`).
    links: Links
    varied: tuple[str, ...] = ()  # parameters with a value for each link: k_1_2 for the link from node 2 to node 1
    mutual: bool = False  # True if the links i -> j and j -> i share the values of `varied`
    beyond: tuple[int, ...] = ()  # the second source (0-based) of each link of three ends; empty for links of two ends
    # The links with rows, one direction of each, and the places of the modes of these rows in `Node.joined` of the source.
    held: tuple[tuple[Link, tuple[int, ...]], ...] = ()

    def each(self) -> Iterator[Link | Triad]:
        """Yield each link; the second source of a link of three ends follows the weight."""
        yield from (zip_links(self.links, self.beyond) if self.beyond else self.links)

    def map(self, change: Callable[[Edge], Edge], renamed: Mapping[sp.Symbol, sp.Symbol] | None = None) -> Layer:
        """Return the same links with changed templates; drop names of `varied` that no template has any more."""
        edge_of = tuple((ends, change(edge)) for ends, edge in self.edge_of)
        names = {s.name for _, edge in edge_of for s in edge.parameters}
        varied = tuple(name for name in _renamed(self.varied, renamed) if name in names)
        return replace(self, edge_of=edge_of, varied=varied)

    def name(self, parameter: str, link: Link) -> str:
        """Return the name of a parameter of `varied` at one link."""
        target, source, _ = link
        ends = (source, target) if self.mutual and source < target else (target, source)
        return str(LinkName(parameter, *ends))

    def names(self, parameter: str) -> tuple[str, ...]:
        """Return the distinct names of a parameter of `varied` at all links."""
        return tuple(dict.fromkeys(self.name(parameter, link) for link in self.links))


@dataclass(frozen=True, slots=True, repr=False)
class Equations(Cached, HasLatex):
    """The equations of motion of a network, M d(state)/dt = rhs.

    M is the identity unless nodes or links have inertia.  The state is ordered by components: x_1 … x_n, v_1 … v_n.
    Components that all kinds of nodes have come first.
    """

    nodes: tuple[Node, ...]  # the templates of the nodes, by kind; one for equal nodes
    kind_of: tuple[int, ...]  # the kind of each of the n nodes
    layers: tuple[Layer, ...] = ()  # the links, coupling by coupling
    varied: tuple[str, ...] = ()  # parameters with a value for each node, a_1 … a_n

    def __post_init__(self) -> None:
        check(self)

    def __repr__(self) -> str:
        kinds = f", {len(self.nodes)} kinds of nodes" if self.mixed else ""
        names = f"states {', '.join(self.components)}, {len(self.parameters)} parameters"
        return f"Equations({self.n} node{'s' * (self.n > 1)}, {self.link_count} links, {names}{kinds})"

    @classmethod
    def of_equal_nodes(
        cls, node: Node, edge: Edge | None, n: int, links: Links = (), varied: tuple[str, ...] = ()
    ) -> Equations:
        """Return the equations of a network of equal nodes."""
        if edge is None and links:
            raise ValueError(f"{len(links)} links but no edge equations; give a coupling")
        return cls((node,), (0,) * n, () if edge is None else (Layer((((0, 0), edge),), links),), varied)

    @property
    def n(self) -> int:
        """Number of nodes."""
        return len(self.kind_of)

    @property
    def mixed(self) -> bool:
        """True if nodes are of several kinds."""
        return len(self.nodes) > 1

    @property
    def node(self) -> Node:
        """The template of a network of equal nodes; ValueError for several kinds."""
        if self.mixed:
            raise ValueError("the template of all nodes: found nodes of several kinds; expected equal nodes")
        return self.nodes[0]

    @property
    def edge(self) -> Edge | None:
        """The template of the links between equal nodes, None without any; else ValueError."""
        if self.mixed:
            raise ValueError("the template of all links: found nodes of several kinds; expected equal nodes")
        if len(self.layers) > 1:
            raise ValueError(f"the template of all links: found {len(self.layers)} layers of links; expected one")
        return self.layers[0].edge_of[0][1] if self.layers else None

    @property
    def links(self) -> Links:
        """Target, source and weight of each link, layer by layer."""
        if len(self.layers) == 1:
            return self.layers[0].links
        return tuple(link for layer in self.layers for link in layer.links)

    @property
    def link_count(self) -> int:
        """Number of links, without listing them."""
        return sum(len(layer.links) for layer in self.layers)

    @property
    def listed(self) -> tuple[Layer, ...]:
        """The layers with a list of links, without mean fields."""
        return tuple(layer for layer in self.layers if layer.links and not isinstance(layer.links, AllPairs))

    @property
    def fields(self) -> tuple[tuple[Edge, AllPairs], ...]:
        """The mean fields: templates with the links of all pairs."""
        pairs = ((layer.edge_of[0][1], layer.links) for layer in self.layers)
        return tuple((edge, links) for edge, links in pairs if isinstance(links, AllPairs) and links)

    def without_fields(self) -> Equations:
        """Return the same equations with every link in a list; ValueError for more than LINK_LIMIT links."""
        layers = (replace(layer, links=tuple(layer.links)) for layer in self.layers)
        return replace(self, layers=tuple(layers)) if self.fields else self

    @cached_property
    def edge_of(self) -> tuple[tuple[Ends, Edge], ...]:
        """The templates that links use, with the kinds of their ends, layer by layer."""
        return tuple(pair for layer in self.layers if layer.links for pair in layer.edge_of)

    @property
    def edges(self) -> tuple[Edge, ...]:
        """The templates that links use."""
        return tuple(edge for _, edge in self.edge_of)

    @property
    def templates(self) -> tuple[Node | Edge, ...]:
        """The templates of nodes and of links."""
        return *self.nodes, *self.edges

    def linked(self) -> Iterator[tuple[Link | Triad, Edge]]:
        """Yield each link with its template, layer by layer."""
        for layer in self.layers:
            templates = dict(layer.edge_of)
            for link in layer.each():
                yield link, templates[self.ends(link)]

    def node_at(self, i: int) -> Node:
        """Return the template of node `i` (0-based)."""
        return self.nodes[self.kind_of[i]]

    def ends(self, link: Link | Triad) -> Ends:
        """Return the kinds of the target and the source of a link."""
        return self.kind_of[link[0]], self.kind_of[link[1]]

    def map_templates(
        self,
        of_node: Callable[[Node], Node],
        of_edge: Callable[[Edge], Edge],
        renamed: Mapping[sp.Symbol, sp.Symbol] | None = None,
    ) -> Equations:
        """Return the same network of changed templates."""
        nodes = tuple(map(of_node, self.nodes))
        names = {s.name for node in nodes for s in node.parameters}
        return replace(
            self,
            nodes=nodes,
            layers=tuple(layer.map(of_edge, renamed) for layer in self.layers),
            varied=tuple(name for name in _renamed(self.varied, renamed) if name in names),
        )

    def expect_alike(
        self, what: str, *, varied_too: bool = False, inertia_too: bool = False, layers_too: bool = False
    ) -> None:
        """Raise ValueError unless the nodes are equal, the links are of one layer and M is the identity."""
        if not varied_too:
            self.expect_exact_links(what)
        # Each message with its condition; the first condition that is true is raised.
        problems = {
            "nodes of several kinds": self.mixed,
            f"nodes that differ in {', '.join(self.varied)}": bool(self.varied) and not varied_too,
            "links with inertia": self.inertial_links and not inertia_too,
            "nodes with a mass matrix (more than three coupled coordinates)": any(node.inertia for node in self.nodes),
            f"{len(self.layers)} layers of links": len(self.layers) > 1 and not layers_too,
        }
        problem = next((text for text, holds in problems.items() if holds), None)
        if problem is not None:
            expected = "links of one layer" if problem.endswith("layers of links") else "links that have no inertia"
            if problem.startswith("nodes that differ"):
                expected += "; `mismatch` computes how far nearly equal nodes stay apart"
            raise ValueError(f"{what}: found {problem}; expected equal nodes with {expected}")

    def expect_pairs(self, what: str) -> None:
        """Raise ValueError for links of three ends; the message begins with `what`."""
        if self.triadic:
            raise ValueError(f"{what}: found links of three ends; expected links of two")

    @cached_property
    def triadic(self) -> bool:
        """True if links have three ends."""
        return any(edge.beyond for edge in self.edges)

    @cached_property
    def projected(self) -> Equations:
        """The network with links of two ends that has the same synchronous motion, and the same deviations from it.

        A link of three ends h(x_i, x_j, x_k) becomes h(x_i, x_j, x_j), and the weights of all second sources are added.
        Between equal states, D2 h + D3 h is the derivative by the source of the new link.

        References
        ----------
        Gambuzza et al., Nat. Commun. 12, 1255 (2021): generalised Laplacians.
        """
        if not self.triadic:
            return self
        layers = []
        for layer in self.layers:
            if layer.beyond:
                weights: dict[tuple[int, int], Fraction] = {}
                for target, source, weight in layer.links:
                    weights[target, source] = weights.get((target, source), Fraction(0)) + weight
                links = tuple((*pair, weight) for pair, weight in sorted(weights.items()) if weight)
                edge_of = tuple((ends, _of_two_ends(edge)) for ends, edge in layer.edge_of)
                layer = replace(layer, edge_of=edge_of, links=links, beyond=())
            layers.append(layer)
        return replace(self, layers=tuple(layers))

    def expect_exact_links(self, what: str) -> None:
        """Raise ValueError if a parameter differs from link to link; the message begins with `what`."""
        if self.numbered:
            raise ValueError(
                f"{what}: found links that differ in {', '.join(self.numbered)}; expected links that differ in the weights of "
                "their graph alone"
            )

    @cached_property
    def inertial(self) -> bool:
        """True if nodes or links have inertia, so that M is not the identity."""
        return self.inertial_links or any(node.inertia for node in self.nodes)

    @cached_property
    def inertial_links(self) -> bool:
        """True if links have inertia, so that M couples nodes."""
        return any(edge.inertia for edge in self.edges)

    @cached_property
    def constant_mass(self) -> bool:
        """True if M depends on parameters alone."""
        return all(node.constant_inertia for node in self.nodes) and all(edge.constant_inertia for edge in self.edges)

    @property
    def forced(self) -> bool:
        """True if time occurs explicitly."""
        return any(node.forced for node in self.nodes) or any(edge.forced for edge in self.edges)

    @property
    def sticks(self) -> bool:
        """True if nodes have events, such as the stick and slip of set-valued friction."""
        return any(node.sticks for node in self.nodes)

    @property
    def has_rows(self) -> bool:
        """True if events are rows (`synchain.models.mechanics.rows`)."""
        return self.joined or any(node.rows for node in self.nodes)

    @property
    def joined(self) -> bool:
        """True if links have rows, so that rows of several nodes are solved together."""
        return any(node.joined or node.surfaces for node in self.nodes)

    @property
    def modes(self) -> frozenset[str]:
        """The components that change only at events."""
        return frozenset(mode.name for node in self.nodes for mode in node.modes)

    @cached_property
    def dimension(self) -> int:
        """Number of state variables of the whole network."""
        return sum(len(self.nodes[k].state) for k in self.kind_of)

    @cached_property
    def continuous_dimension(self) -> int:
        """Number of continuous state variables, which are all but the modes of events."""
        return sum(len(self.nodes[k].continuous) for k in self.kind_of)

    @cached_property
    def parameters(self) -> tuple[str, ...]:
        """Names of all parameters, nodes first.

        A parameter with a value for each node is a_1 … a_n; one with a value for each link is k_1_2 …
        """
        names: list[str] = []
        for name in dict.fromkeys(s.name for node in self.nodes for s in node.parameters):
            names += [f"{name}_{i + 1}" for i in self.holders(name)] if name in self.varied else [name]
        of_nodes = {*names, *self.varied}
        for name in dict.fromkeys(s.name for edge in self.edges for s in edge.parameters):
            if name not in of_nodes:
                names += self.numbered[name].names(name) if name in self.numbered else [name]
        return tuple(names)

    @cached_property
    def numbered(self) -> Mapping[str, Layer]:
        """The layer of each parameter that has a value for each link."""
        return {name: layer for layer in self.layers for name in layer.varied}

    @property
    def differing(self) -> tuple[str, ...]:
        """The parameters with a value for each node or for each link."""
        return (*self.varied, *self.numbered)

    @cached_property
    def single(self) -> frozenset[str]:
        """The parameters of single nodes and links, a_1 … a_n and k_1_2 …"""
        of_nodes = {f"{name}_{i + 1}" for name in self.varied for i in range(self.n)}
        return frozenset(of_nodes.union(*(layer.names(name) for name, layer in self.numbered.items())))

    def holders(self, name: str) -> tuple[int, ...]:
        """Return the nodes (0-based) that have a parameter or a state of that name."""
        has = [any(s.name == name for s in (*node.state, *node.parameters)) for node in self.nodes]
        return tuple(compress(count(), map(has.__getitem__, self.kind_of)))

    @cached_property
    def components(self) -> tuple[str, ...]:
        """Names of the states of the nodes, such as ("x", "v"): first those that all kinds have."""
        names = dict.fromkeys(s.name for node in self.nodes for s in node.state)
        return tuple(sorted(names, key=lambda name: name not in self.common))

    @cached_property
    def common(self) -> frozenset[str]:
        """The components that nodes of all kinds have."""
        first, *others = ({s.name for s in node.state} for node in self.nodes)
        return frozenset(first.intersection(*others))

    @property
    def compared(self) -> tuple[str, ...]:
        """The components that are compared between nodes in the synchronisation error."""
        return tuple(s.name for s in self.nodes[0].continuous if s.name in self.common)

    @cached_property
    def state(self) -> tuple[str, ...]:
        """Names of the state variables: x_1 … x_n, v_1 … v_n."""
        return tuple(f"{name}_{i + 1}" for name in self.components for i in self.holders(name))

    @cached_property
    def places(self) -> tuple[tuple[int, ...], ...]:
        """For each node the indices of its states in the state of the network."""
        indices: list[dict[str, int]] = [{} for _ in self.kind_of]
        ordered = ((i, name) for name in self.components for i in self.holders(name))
        for index, (i, name) in enumerate(ordered):
            indices[i][name] = index
        return tuple(tuple(of_node[s.name] for s in self.node_at(i).state) for i, of_node in enumerate(indices))

    def symbols(self, i: int) -> tuple[sp.Symbol, ...]:
        """Return the state symbols of node `i` (0-based)."""
        return tuple(_numbered(s, i) for s in self.node_at(i).state)

    def at_node(self, i: int) -> dict[sp.Symbol, sp.Symbol]:
        """Return the substitution that turns the node template into node `i`."""
        node = self.node_at(i)
        states = dict(zip(node.state, self.symbols(i), strict=True))
        return states | {s: _numbered(s, i) for s in node.parameters if s.name in self.varied}

    def at_link(self, link: Link | Triad, edge: Edge) -> dict[sp.Symbol, sp.Expr]:
        """Return the substitution that turns an edge template into one link."""
        target, source, weight, *second = link
        values: dict[sp.Symbol, sp.Expr] = {edge.weight: sp.Rational(weight.numerator, weight.denominator)}
        values |= zip(edge.here, self.symbols(target), strict=True)
        values |= zip(edge.there, self.symbols(source), strict=True)
        if edge.beyond:
            values |= zip(edge.beyond, self.symbols(second[0]), strict=True)
        for s in edge.parameters:
            if s.name in self.varied:
                values[s] = _numbered(s, target)
            if s.name in self.numbered:
                values[s] = sp.Symbol(self.numbered[s.name].name(s.name, (target, source, weight)), real=True)
        return values | {s: _numbered(parameter, source) for s, parameter in edge.theirs}

    def events_at(self, i: int) -> tuple[Event, ...]:
        """Return the events of node `i` (0-based) under the forces of its links, in the symbols of the network."""
        node = self.node_at(i)
        if not node.events:
            return ()
        velocity, at_node = self.symbols(i)[1], self.at_node(i)
        links = [pair for pair in self.linked() if pair[0][0] == i]
        force = sp.Add(*(edge.rhs[1].xreplace(self.at_link(link, edge)) for link, edge in links))
        events = (event.map(lambda e: e.xreplace(at_node)) for event in node.events)
        # Rates of links contain mode**2, so that links move only a body in slip. For the load on a body in stick the
        # mode is set to 1.
        return tuple(e.under(force.xreplace({e.mode: sp.S.One, velocity: e.target})) for e in events)

    def rows_at(self, i: int) -> tuple[Row, ...]:
        """Return the rows of node `i` (0-based) under the rates that its links add, in the symbols of the network."""
        node = self.node_at(i)
        if not node.rows:
            return ()
        at_node, off = self.at_node(i), dict.fromkeys(map(self.at_node(i).__getitem__, node.modes), sp.S.One)
        size = len(node.continuous)
        added = [sp.S.Zero] * size
        for link, edge in self.linked():
            if link[0] == i:
                # links are projected where rows are held: with no row held they have their full rates
                rates = (e.xreplace(self.at_link(link, edge)).xreplace(off) for e in edge.rhs[:size])
                added = [a + e for a, e in zip(added, rates, strict=True)]
        return tuple(row.map(lambda e: e.xreplace(at_node)).under(added) for row in node.rows)

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        """The parts of a network with rows in links, in the order of their first nodes."""
        if not self.joined:
            return ()
        sizes = [len(self.node_at(i).continuous) for i in range(self.n)]
        members = [Member(self.node_at(i), self.at_node(i), self.places[i][:size]) for i, size in enumerate(sizes)]
        links = []
        for layer in self.layers:
            templates = dict(layer.edge_of)
            for link, modes in layer.held:
                symbols = {name: sp.Symbol(layer.name(name, link), real=True) for name in layer.varied}
                links.append((PartLink(templates[self.ends(link)], *link, modes, layer.varied), symbols))
        return parts_of(members, links, self._plain_rhs, self.varied)

    @cached_property
    def _plain_rhs(self) -> list[sp.Expr]:
        """The right-hand side without the rows of parts."""
        rates = self._of_nodes([node.rhs for node in self.nodes])
        for link, edge in self.linked():
            values = self.at_link(link, edge)
            for k, e in zip(self.places[link[0]], edge.rhs, strict=True):
                rates[k] += e.xreplace(values)
        return rates

    def rhs(self) -> tuple[sp.Expr, ...]:
        """Return the right-hand side in state order; meant for small n, since the algebra grows with n."""
        rates = [*self._plain_rhs]
        for k, e in self._added_rates():
            rates[k] += e
        return tuple(rates)

    def _added_rates(self) -> Iterator[tuple[int, sp.Expr]]:
        """Yield (row, rate) for each rate that the rows of a part add."""
        return ((k, e) for part in self.parts for k, e in zip(part.places, part.added, strict=True) if e != 0)

    def _of_nodes(self, by_kind: list[tuple[sp.Expr, ...]]) -> list[sp.Expr]:
        """Return expressions for each state of a kind of node in state order, in the symbols of the network."""
        column = [sp.S.Zero] * self.dimension
        for i, places in enumerate(self.places):
            for k, e in zip(places, by_kind[self.kind_of[i]], strict=True):
                column[k] = e.xreplace(self.at_node(i))
        return column

    def mass(self) -> dict[tuple[int, int], sp.Expr]:
        """Return the non-zero entries of M by (row, column); empty if M is the identity."""
        if not self.inertial:
            return {}
        places = self.places
        entries: dict[tuple[int, int], sp.Expr] = {}
        for i, rows in enumerate(places):
            inertia = self.node_at(i).inertia
            # M is the identity in the rows of nodes without inertia.
            entries |= _block(inertia, rows, rows, self.at_node(i)) if inertia else {(k, k): sp.S.One for k in rows}
        for link, edge in self.linked():
            values = self.at_link(link, edge)
            for block, end in zip(edge.inertia, link[:2], strict=False):
                for key, e in _block(block, places[link[0]], places[end], values):
                    entries[key] = entries.get(key, sp.S.Zero) + e
        return {key: entries[key] for key in sorted(entries) if entries[key] != 0}

    def jacobian(self) -> dict[tuple[int, int], sp.Expr]:
        """Return the non-zero entries of d(rhs)/d(state) by (row, column), in state order."""
        entries: dict[tuple[int, int], sp.Expr] = {}
        blocks = [node.jacobian() for node in self.nodes]
        for i, places in enumerate(self.places):
            entries.update(_block(blocks[self.kind_of[i]], places, places, self.at_node(i)))
        for key, value in self.link_jacobian():
            entries[key] = entries.get(key, sp.S.Zero) + value
        return {key: entries[key] for key in sorted(entries) if entries[key] != 0}

    def link_jacobian(self) -> Iterator[Entry]:
        """Yield ((row, column), entry) for the term of each link in the Jacobian; keys repeat."""
        places = self.places
        blocks = {edge: (edge.jacobian_here(), edge.jacobian_there(), edge.jacobian_beyond()) for edge in self.edges}
        for link, edge in self.linked():
            here, there, beyond = blocks[edge]
            values = self.at_link(link, edge)
            yield from _block(here, places[link[0]], places[link[0]], values)
            yield from _block(there, places[link[0]], places[link[1]], values)
            for k in link[3:]:
                yield from _block(beyond, places[link[0]], places[k], values)
        states = {sp.Symbol(name, real=True): k for k, name in enumerate(self.state)}
        for row, e in self._added_rates():
            moving = sorted(e.free_symbols & set(states), key=states.__getitem__)
            yield from (((row, states[s]), derivative(e, s)) for s in moving)

    def time_derivative(self) -> tuple[sp.Expr, ...]:
        """Return the partial derivative of the right-hand side with respect to time, in state order."""
        rates = self._of_nodes([node.time_derivative() for node in self.nodes])
        for k, e in self.link_time_derivative():
            rates[k] += e
        return tuple(rates)

    def link_time_derivative(self) -> Iterator[tuple[int, sp.Expr]]:
        """Yield (row, entry) for the term of each link in the partial derivative by time; rows repeat."""
        slopes = {edge: edge.time_derivative() for edge in self.edges if edge.forced}
        for link, edge in self.linked() if slopes else ():
            for k, e in zip(self.places[link[0]], slopes.get(edge, ()), strict=False):
                if e != 0:
                    yield k, e.xreplace(self.at_link(link, edge))
        yield from ((k, derivative(e, TIME)) for k, e in self._added_rates() if e.has(TIME))

    @cached_property
    def digest(self) -> str:
        """Hexadecimal SHA-256 of the equations; equal equations have equal digests."""
        # A feature adds its part only to equations that have it, so that digests of all other equations stay the same.
        first, *others = self.nodes
        large = any(len(pairs) > DIGEST_LIMIT for _, pairs in self.fields)
        links = repr([layer.links for layer in self.layers] if large else tuple(self.links))
        parts = [_text(first.state, first.rhs, first.parameters), str(self.n), links]
        parts += ["; ".join(map(sp.srepr, event.expressions)) for event in first.events]
        parts += [f"{row.law} {'; '.join(map(sp.srepr, row.expressions))}" for node in self.nodes for row in node.rows]
        surfaces = [s for template in self.templates for s in template.surfaces]
        parts += [f"{s.law} {'; '.join(map(sp.srepr, s.expressions))}" for s in surfaces]
        parts += [f"rows in links {[layer.held for layer in self.layers]}"] if self.joined else []
        parts += [sp.srepr(sp.Matrix(node.inertia)) for node in self.nodes if node.inertia]
        parts += [f"varied {' '.join(self.varied)}"] if self.varied else []
        if others:  # several kinds of nodes
            parts += [repr(self.kind_of), *(_text(node.state, node.rhs, node.parameters) for node in others)]
            parts += [repr(ends) for layer in self.layers for ends, _ in layer.edge_of]
        parts += [f"layers {[len(layer.links) for layer in self.layers]}"] if len(self.layers) > 1 else []
        parts += [f"links {name} {layer.mutual}" for name, layer in self.numbered.items()]
        for edge in self.edges:
            parts.append(_text((*edge.here, *edge.there, edge.weight), edge.rhs, edge.parameters))
            parts += [sp.srepr(sp.Matrix(block)) for block in edge.inertia]
            parts += [f"theirs {edge.theirs}"] if edge.theirs else []
            parts += [f"beyond {edge.beyond}"] if edge.beyond else []
        parts += [f"second sources {layer.beyond}" for layer in self.layers if layer.beyond]
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def zip_links(links: Links, beyond: tuple[int, ...]) -> Iterator[Triad]:
    """Yield links of three ends: target, source, weight, second source."""
    return ((*link, k) for link, k in zip(links, beyond, strict=True))


def _of_two_ends(edge: Edge) -> Edge:
    """Return a link of three ends with equal sources as a link of two ends."""
    swap = dict(zip(edge.beyond, edge.there, strict=True))
    # The weights of all second sources are added, so that the link must be proportional to them.
    if any(sp.simplify(e - edge.weight * e.xreplace({edge.weight: sp.S.One})) != 0 for e in edge.rhs):
        raise ValueError("a link of three ends is not proportional to its weight; expected the weight as a factor")
    return replace(edge, rhs=tuple(e.xreplace(swap) for e in edge.rhs), beyond=())


def _renamed(names: Iterable[str], renamed: Mapping[sp.Symbol, sp.Symbol] | None) -> Iterator[str]:
    """Yield the names of parameters under a renaming of symbols."""
    for name in names:
        s = sp.Symbol(name, real=True)
        yield name if renamed is None else renamed.get(s, s).name


def _numbered(s: sp.Symbol, i: int) -> sp.Symbol:
    """Return the symbol of the network for a symbol of the node template at node `i` (0-based)."""
    return sp.Symbol(f"{s.name}_{i + 1}", real=True)


def _block(
    block: Block, rows: tuple[int, ...], columns: tuple[int, ...], values: Mapping[sp.Symbol, sp.Expr]
) -> Iterator[Entry]:
    for r, line in zip(rows, block, strict=True):
        for c, entry in zip(columns, line, strict=True):
            if entry != 0:
                yield (r, c), entry.xreplace(dict(values))


def _text(state: tuple[sp.Symbol, ...], rhs: tuple[sp.Expr, ...], parameters: tuple[sp.Symbol, ...]) -> str:
    return " | ".join([", ".join(map(str, state)), "; ".join(map(sp.srepr, rhs)), ", ".join(map(str, parameters))])


def check(eq: Equations) -> None:
    """Raise ValueError if nodes, links and names do not fit together (see `Equations`)."""
    if eq.n < 1:
        raise ValueError(f"a network needs at least one node, found n = {eq.n}")
    if set(eq.kind_of) != set(range(len(eq.nodes))):
        raise ValueError(f"kinds of nodes: found {len(eq.nodes)} templates and the kinds {sorted(set(eq.kind_of))}")
    if eq.sticks:
        _check_friction(eq)
    _check_links(eq)
    _check_gaps(eq)
    _check_numbered(eq)

    # Each name has one meaning.
    of_nodes = {s.name for node in eq.nodes for s in node.parameters}
    for name in eq.varied:
        if name not in of_nodes:
            raise ValueError(f"{name!r} has a value for each node, but no node has it as a parameter")
    twice = next((name for name, times in Counter(eq.parameters).items() if times > 1), None)
    if twice is not None:
        raise ValueError(f"the name {twice!r} stands for two parameters; rename one")
    states = chain(eq.state, (s.name for node in eq.nodes for s in node.state))
    taken = sorted(set(eq.parameters).intersection(states))
    if taken:
        raise ValueError(f"the parameter {taken[0]!r} has the name of a state variable; rename it")


def _check_friction(eq: Equations) -> None:
    """Raise ValueError for networks in which set-valued friction is not supported."""
    if eq.inertial_links:
        raise ValueError("links with inertia: found set-valued friction; expected a smooth contact; use contact 'atan'")
    if eq.has_rows:
        return
    if len(eq.layers) > 1 or any(edge.forced or edge.theirs for edge in eq.edges):
        found = "several layers" if len(eq.layers) > 1 else "time, or a parameter of the source that differs,"
        raise ValueError(
            f"links with set-valued friction: found {found}; expected one layer of links of the states; use contact 'atan'"
        )


def _check_gaps(eq: Equations) -> None:
    """Raise ValueError for links that change the rate of a coordinate in the level of a row: rows move it by its velocity."""
    if eq.joined and eq.n > MOST_JOINED_NODES:
        raise ValueError(
            f"rows in links: found {eq.n} nodes; expected at most {MOST_JOINED_NODES}, whose steps are written out"
        )
    pairs = [pair for layer in eq.layers for pair in layer.edge_of]
    # the levels that hold coordinates, by the kind of the node, in the symbols of the node
    levels = [
        [row.level for row in node.rows if row.law is Law.STOP]
        + [s.level for s in node.surfaces if s.law is not Law.RESET]
        for node in eq.nodes
    ]
    for kinds, edge in pairs:
        for kind, states in zip(kinds, edge.end_states, strict=False):
            swap = dict(zip(states, eq.nodes[kind].state, strict=True))
            levels[kind] += [surface.level.xreplace(swap) for surface in edge.surfaces]
    for (target, _), edge in pairs:
        node = eq.nodes[target]
        coordinates = node.state[: len(node.continuous) // 2] if has_velocities(node) else ()
        moved = {s for s, e in zip(coordinates, edge.rhs, strict=False) if e != 0}
        for level in levels[target]:
            if both := level.free_symbols & moved:
                raise ValueError(
                    f"events: found a link that changes the rate of {min(s.name for s in both)}, which is in {level}; "
                    "expected forces, which change velocities"
                )


def _check_links(eq: Equations) -> None:
    """Raise ValueError for templates that do not fit their nodes, and for links between nodes that do not exist."""
    if eq.triadic:
        _check_triads(eq)
    for (target, source), edge in (pair for layer in eq.layers for pair in layer.edge_of):
        for end, symbols in ((target, edge.here), (source, edge.there)):
            states = len(eq.nodes[end].state)
            if len(symbols) != states:
                raise ValueError(f"the edge joins nodes of {len(symbols)} states, the node has {states}")
        for s, parameter in edge.theirs:
            if parameter.name not in eq.varied:
                raise ValueError(
                    f"the edge takes {parameter.name!r} of its source as {s.name!r}, but all nodes share it"
                )
    for edge, pairs in eq.fields:
        if pairs.n != eq.n or eq.mixed or separated(edge, eq.varied) is None:
            raise ValueError(
                f"links of all pairs: found {pairs.n} of {eq.n} nodes; expected all of them, of one kind, and an edge that is "
                "a finite sum of products of target and source"
            )
    existing = set(range(eq.n))
    for layer in eq.listed:
        seen = set()
        if any(bool(edge.beyond) != bool(layer.beyond) for _, edge in layer.edge_of):
            raise ValueError("links of three ends: found a template of two ends, or a list without second sources")
        for target, source, _, *second in layer.each():
            nodes = (target, source, *second)
            if not existing.issuperset(nodes) or len(set(nodes)) < len(nodes):
                raise ValueError(f"link {target} <- {source}: expected different nodes of 0 … {eq.n - 1}")
            if nodes in seen:
                raise ValueError(f"link {target} <- {source} occurs twice; add the weights up")
            seen.add(nodes)
        if {eq.ends(link) for link in layer.links} - {ends for ends, _ in layer.edge_of}:
            raise ValueError(f"{len(layer.links)} links but no edge equations; give a coupling")


def _check_triads(eq: Equations) -> None:
    """Raise ValueError for networks in which links of three ends are not supported."""
    edges = [edge for edge in eq.edges if edge.beyond]
    problems = {
        "nodes of several kinds": eq.mixed,
        "links with inertia": any(edge.inertia for edge in edges),
        "set-valued friction": eq.sticks,
        "parameters of a source that differ from node to node": any(edge.theirs for edge in edges),
    }
    problem = next((text for text, holds in problems.items() if holds), None)
    if problem is not None:
        raise ValueError(f"links of three ends: found {problem}; expected none of these")


def _check_numbered(eq: Equations) -> None:
    """Raise ValueError for a link parameter that no link has, that two layers have, or that lacks a link back."""
    for name, layer in eq.numbered.items():
        if sum(name in each.varied for each in eq.layers) > 1 or isinstance(layer.links, AllPairs):
            raise ValueError(f"{name!r} has a number for each link of two layers, or of all pairs; expected one list")
        if not any(s.name == name for _, edge in layer.edge_of for s in edge.parameters):
            raise ValueError(f"{name!r} has a number for each link, but no link of its layer has it as a parameter")
    for layer in (layer for layer in eq.layers if layer.mutual):
        pairs = {link[:2] for link in layer.links}
        # A value that both directions share needs a link in each direction.
        back = next(((i, j) for i, j in pairs if (j, i) not in pairs), None)
        if back is not None:
            raise ValueError(f"numbers of edges: link {back[0]} <- {back[1]} has none that runs back")
