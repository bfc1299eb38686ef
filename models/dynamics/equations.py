"""The checked product of a derivation: node and edge equations, and the network they make on a graph.

Everything downstream (printing, code generation, spectra, tangent dynamics) reads these values and nothing else.
A network is stored as templates (one node, one edge; several where its nodes are of several kinds) and a list of links,
so its size costs no algebra.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import sympy as sp

from ..graphs.links import Link
from ..mechanics.components import SLIDING, TIME, Edge, Node
from ..mechanics.stick_slip import Contact

__all__ = ["SLIDING", "TIME", "Edge", "Equations", "Link", "Node", "check"]

Entry = tuple[tuple[int, int], sp.Expr]

Block = tuple[tuple[sp.Expr, ...], ...]


@dataclass(frozen=True, slots=True)
class Equations:
    """The equations of motion of `n` nodes joined by `links`: M d(state)/dt = rhs, M the identity unless links have inertia.

    State order is component by component: x_1 … x_n, v_1 … v_n.  The parameters named in `varied` have one value for each
    node: a_1 … a_n.  Nodes of several kinds: `kinds` says for each node which of (node, *others) it is, and `joints` holds
    ((kind of the target, kind of the source), edge) in place of `edge`; first come the components that all kinds have.
    Raises ValueError on a link outside the nodes, a link from a node to itself, a repeated link, links without an edge,
    or one name for two things.
    """

    node: Node
    edge: Edge | None
    n: int
    links: tuple[Link, ...] = ()
    varied: tuple[str, ...] = ()
    others: tuple[Node, ...] = ()
    kinds: tuple[int, ...] = ()
    joints: tuple[tuple[tuple[int, int], Edge], ...] = ()

    def __post_init__(self) -> None:
        check(self)

    @property
    def mixed(self) -> bool:
        """True where the nodes are of several kinds."""
        return bool(self.kinds)

    @property
    def edges(self) -> tuple[Edge, ...]:
        """The edge templates that links use."""
        if not self.links:
            return ()
        return tuple(edge for _, edge in self.joints) if self.mixed else () if self.edge is None else (self.edge,)

    @property
    def nodes(self) -> tuple[Node, ...]:
        """The node templates, by kind."""
        return (self.node, *self.others)

    def kind(self, i: int) -> int:
        """The kind of node `i` (0-based)."""
        return self.kinds[i] if self.kinds else 0

    def node_at(self, i: int) -> Node:
        """The template of node `i` (0-based)."""
        return self.nodes[self.kind(i)]

    def edge_at(self, link: Link) -> Edge:
        """The template of a link."""
        found = dict(self.joints).get((self.kind(link[0]), self.kind(link[1]))) if self.mixed else self.edge
        if found is None:
            raise ValueError("these equations have no edge")
        return found

    def expect_alike(self, what: str) -> None:
        """Raise ValueError where nodes differ in parameters or kind, or links have inertia: `what` is for others."""
        found = f"nodes that differ in {', '.join(self.varied)}" if self.varied else ""
        found = "nodes of several kinds" if self.mixed else found or ("links with inertia" if self.inertial else "")
        if found:
            raise ValueError(f"{what}: found {found}; expected equal nodes with links that have no inertia")

    @property
    def inertial(self) -> bool:
        """True where links have inertia, so that M is not the identity."""
        return any(edge.inertia for edge in self.edges)

    @property
    def plain(self) -> bool:
        """True where all nodes are of one kind and M is the identity."""
        return not (self.mixed or self.inertial)

    @property
    def dimension(self) -> int:
        """Number of state variables of the whole network."""
        if not self.mixed:
            return self.n * len(self.node.state)
        return sum(len(node.state) * self.kinds.count(k) for k, node in enumerate(self.nodes))

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of all parameters, node first, in a fixed order; a parameter in `varied` is a_1 … a_n."""
        names: list[str] = []
        for name in dict.fromkeys(s.name for node in self.nodes for s in node.parameters):
            names += [f"{name}_{i + 1}" for i in self.holders(name)] if name in self.varied else [name]
        for edge in self.edges:
            names += [s.name for s in edge.parameters if s.name not in (*names, *self.varied)]
        return tuple(names)

    def holders(self, name: str) -> tuple[int, ...]:
        """The nodes (0-based) that have a parameter or a state of that name."""
        has = [any(s.name == name for s in (*node.state, *node.parameters)) for node in self.nodes]
        return tuple(i for i in range(self.n) if has[self.kind(i)])

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the states of the nodes, such as ("x", "v"): first those that all kinds have."""
        names = dict.fromkeys(s.name for node in self.nodes for s in node.state)
        return tuple(sorted(names, key=lambda name: name not in self.common)) if self.mixed else tuple(names)

    @property
    def common(self) -> frozenset[str]:
        """The components that nodes of all kinds have."""
        first, *rest = ({s.name for s in node.state} for node in self.nodes)
        return frozenset(first.intersection(*rest))

    @property
    def state(self) -> tuple[str, ...]:
        """Names of the state variables: x_1 … x_n, v_1 … v_n."""
        return tuple(f"{name}_{i + 1}" for name in self.components for i in self.holders(name))

    def places(self) -> tuple[tuple[int, ...], ...]:
        """For each node where its states stand in the whole state, in the order of its template."""
        if not self.mixed:
            return tuple(tuple(c * self.n + i for c in range(len(self.node.state))) for i in range(self.n))
        index = {name: k for k, name in enumerate(self.state)}
        return tuple(tuple(index[f"{s.name}_{i + 1}"] for s in self.node_at(i).state) for i in range(self.n))

    def symbols(self, i: int) -> tuple[sp.Symbol, ...]:
        """The state symbols of node `i` (0-based)."""
        return tuple(_numbered(s, i) for s in self.node_at(i).state)

    def at_node(self, i: int) -> dict[sp.Symbol, sp.Symbol]:
        """The substitution that turns the node template into node `i`."""
        node = self.node_at(i)
        found = dict(zip(node.state, self.symbols(i), strict=True))
        return found | {s: _numbered(s, i) for s in node.parameters if s.name in self.varied}

    def at_link(self, link: Link) -> dict[sp.Symbol, sp.Expr]:
        """The substitution that turns the edge template into one link."""
        target, source, weight = link
        edge = self.edge_at(link)
        here = dict(zip(edge.here, self.symbols(target), strict=True))
        there = dict(zip(edge.there, self.symbols(source), strict=True))
        own = {s: _numbered(s, target) for s in edge.parameters if s.name in self.varied}
        return {**here, **there, **own, edge.weight: sp.Rational(weight.numerator, weight.denominator)}

    def contact_at(self, i: int) -> Contact | None:
        """What decides between stick and slip for node `i`, with the forces of its links; None without a contact."""
        contact = self.node_at(i).contact
        if contact is None:
            return None
        velocity, mode = self.symbols(i)[1:3]
        own = contact.map(lambda e: e.xreplace(self.at_node(i)))
        felt = [link for link in self.links if link[0] == i]
        links = sp.Add(*(self.edge_at(link).rhs[1].xreplace(self.at_link(link)) for link in felt))
        links = links.xreplace({mode: sp.S.One, velocity: own.speed})
        return own.under(links)

    def rhs(self) -> tuple[sp.Expr, ...]:
        """The right-hand side of M d(state)/dt = rhs, in state order (algebra grows with n: meant for small n)."""
        places, found = self.places(), [sp.S.Zero] * self.dimension
        for i in range(self.n):
            for k, e in zip(places[i], self.node_at(i).rhs, strict=True):
                found[k] = e.xreplace(self.at_node(i))
        for link in self.links:
            values = self.at_link(link)
            for k, e in zip(places[link[0]], self.edge_at(link).rhs, strict=True):
                found[k] += e.xreplace(values)
        return tuple(found)

    def mass(self) -> dict[tuple[int, int], sp.Expr]:
        """The non-zero entries (row, column) of M in M d(state)/dt = rhs; empty where M is the identity."""
        if not self.inertial:
            return {}
        places = self.places()
        found: dict[tuple[int, int], sp.Expr] = {(k, k): sp.S.One for k in range(self.dimension)}
        for link in self.links:
            inertia, values = self.edge_at(link).inertia, self.at_link(link)
            for block, end in zip(inertia, link[:2], strict=False):
                for key, e in _block(block, places[link[0]], places[end], values):
                    found[key] = found.get(key, sp.S.Zero) + e
        return {key: found[key] for key in sorted(found) if found[key] != 0}

    def jacobian(self) -> dict[tuple[int, int], sp.Expr]:
        """The non-zero entries (row, column) of d(rhs)/d(state), rows and columns in state order."""
        entries: dict[tuple[int, int], sp.Expr] = {}
        own, places = [node.jacobian() for node in self.nodes], self.places()
        for i in range(self.n):
            entries.update(_block(own[self.kind(i)], places[i], places[i], self.at_node(i)))
        for key, value in self.link_jacobian():
            entries[key] = entries.get(key, sp.S.Zero) + value
        return {key: entries[key] for key in sorted(entries) if entries[key] != 0}

    def link_jacobian(self) -> Iterator[Entry]:
        """Yield ((row, column), entry) for each link's share of the Jacobian; keys repeat where links meet."""
        places = self.places()
        blocks = {edge: (edge.jacobian_here(), edge.jacobian_there()) for edge in self.edges}
        for link in self.links:
            here, there = blocks[self.edge_at(link)]
            values = self.at_link(link)
            yield from _block(here, places[link[0]], places[link[0]], values)
            yield from _block(there, places[link[0]], places[link[1]], values)

    def time_derivative(self) -> tuple[sp.Expr, ...]:
        """The partial derivative of the right-hand side with respect to time, in state order."""
        own = [node.time_derivative() for node in self.nodes]
        found: dict[int, sp.Expr] = {}
        for i, places in enumerate(self.places()):
            rows = zip(places, own[self.kind(i)], strict=True)
            found |= {k: e.xreplace(self.at_node(i)) for k, e in rows}
        return tuple(found[k] for k in range(self.dimension))

    @property
    def digest(self) -> str:
        """Hexadecimal SHA-256 of the equations: equal equations have equal digests, whatever made them."""
        parts = [_text(self.node.state, self.node.rhs, self.node.parameters), str(self.n), repr(self.links)]
        if self.node.contact is not None:
            parts.append("; ".join(map(sp.srepr, self.node.contact.expressions)))
        parts += [f"varied {' '.join(self.varied)}"] if self.varied else []
        if self.mixed:
            parts += [repr(self.kinds), *(_text(node.state, node.rhs, node.parameters) for node in self.others)]
            parts += [repr(pair) for pair, _ in self.joints]
        for edge in self.edges:
            parts.append(_text((*edge.here, *edge.there, edge.weight), edge.rhs, edge.parameters))
            parts += [sp.srepr(sp.Matrix(block)) for block in edge.inertia]
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def _numbered(s: sp.Symbol, i: int) -> sp.Symbol:
    """The symbol of a template at node `i` (0-based)."""
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
    """Raise ValueError where nodes, links and names do not fit together (see `Equations`)."""
    if eq.n < 1:
        raise ValueError(f"a network needs at least one node, found n = {eq.n}")
    _check_kinds(eq)
    _check_links(eq)
    _check_names(eq)


def _check_kinds(eq: Equations) -> None:
    if bool(eq.others or eq.joints) != eq.mixed or (eq.mixed and set(eq.kinds) != set(range(len(eq.nodes)))):
        raise ValueError(f"kinds of nodes: found {len(eq.nodes)} templates and the kinds {sorted(set(eq.kinds))}")
    if eq.mixed and len(eq.kinds) != eq.n:
        raise ValueError(f"kinds of nodes: found {len(eq.kinds)} for {eq.n} nodes; expected one for each")
    if eq.mixed and any(node.contact is not None for node in eq.nodes):
        raise ValueError(
            "nodes of several kinds: found set-valued friction; expected smooth contacts; use contact 'atan'"
        )
    if eq.inertial and eq.node.contact is not None:
        raise ValueError("links with inertia: found set-valued friction; expected a smooth contact; use contact 'atan'")
    sizes = eq.joints or (() if eq.edge is None else (((0, 0), eq.edge),))
    for (target, source), edge in sizes:
        for end, symbols in ((target, edge.here), (source, edge.there)):
            if len(symbols) != len(eq.nodes[end].state):
                states = len(eq.nodes[end].state)
                raise ValueError(f"the edge joins nodes of {len(symbols)} states, the node has {states}")


def _check_links(eq: Equations) -> None:
    seen = set()
    for link in eq.links:
        target, source, _ = link
        if not (0 <= target < eq.n and 0 <= source < eq.n) or target == source:
            raise ValueError(f"link {target} <- {source}: expected two different nodes of 0 … {eq.n - 1}")
        if (target, source) in seen:
            raise ValueError(f"link {target} <- {source} occurs twice; add the weights up")
        seen.add((target, source))
    pairs = {(eq.kind(target), eq.kind(source)) for target, source, _ in eq.links}
    lacking = sorted(pairs - {pair for pair, _ in eq.joints}) if eq.mixed else [(0, 0)] if pairs and not eq.edge else []
    if lacking:
        raise ValueError(f"{len(eq.links)} links but no edge equations; give a coupling")


def _check_names(eq: Equations) -> None:
    own = {s.name for node in eq.nodes for s in node.parameters}
    for name in eq.varied:
        if name not in own:
            raise ValueError(f"{name!r} has a value for each node, but no node has it as a parameter")
    twice = _repeated(eq.parameters)
    if twice is not None:
        raise ValueError(f"the name {twice!r} stands for two parameters; rename one")
    states = {*eq.state, *(s.name for node in eq.nodes for s in node.state)}
    taken = sorted(states.intersection(eq.parameters))
    if taken:
        raise ValueError(f"the parameter {taken[0]!r} has the name of a state variable; rename it")


def _repeated(names: Iterable[str]) -> str | None:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            return name
        seen.add(name)
    return None
