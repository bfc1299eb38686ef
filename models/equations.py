"""The checked product of a derivation: node and edge equations, and the network they make on a graph.

Everything downstream (printing, code generation, spectra, tangent dynamics) reads these values and nothing else.
A network is stored as a template (one node, one edge) and a list of links, so its size costs no algebra.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction

import sympy as sp

from .calculus import derivative
from .contact import SLIP, Contact

__all__ = ["TIME", "Edge", "Equations", "Link", "Node"]

TIME = sp.Symbol("t", real=True)
"""Non-dimensional time, the one time symbol of all equations."""

Link = tuple[int, int, Fraction]
"""(target, source, weight): node `target` feels node `source`; indices start at 0."""


@dataclass(frozen=True, slots=True)
class Node:
    """One uncoupled oscillator: d(state)/dt = rhs(state, t; parameters).

    Raises ValueError where the right-hand side uses a symbol that is not declared, contains a floating-point number
    (numbers are parameters or rationals), has not one entry for each state symbol, or where two names are the same.
    With set-valued friction (`contact`) the third state is the mode, which only events change.
    """

    state: tuple[sp.Symbol, ...]
    rhs: tuple[sp.Expr, ...]
    parameters: tuple[sp.Symbol, ...]
    contact: Contact | None = None

    def __post_init__(self) -> None:
        _differ("node", (TIME, *self.state, *self.parameters))
        known = {TIME, *self.state, *self.parameters}
        _check("node", self.rhs, len(self.state), known)
        if self.contact is not None:
            if len(self.state) != 3 or self.state[2] != SLIP:
                raise ValueError(f"a node with set-valued friction has the states x, v, slip; found {self.state}")
            _check("contact", self.contact.expressions, len(self.contact.expressions), known)

    @property
    def forced(self) -> bool:
        """True where time occurs explicitly."""
        return any(e.has(TIME) for e in self.rhs)

    def jacobian(self) -> tuple[tuple[sp.Expr, ...], ...]:
        """d(rhs)/d(state), one-sided at kinks (see `synchain.models.calculus`)."""
        return tuple(tuple(derivative(e, s) for s in self.state) for e in self.rhs)

    def time_derivative(self) -> tuple[sp.Expr, ...]:
        """The partial derivative of rhs with respect to time."""
        return tuple(derivative(e, TIME) for e in self.rhs)


@dataclass(frozen=True, slots=True)
class Edge:
    """What one link adds to the right-hand side of its target: rhs(here, there; weight, parameters).

    `here` are the state symbols of the target, `there` those of the source, both in the order of Node.state.
    """

    here: tuple[sp.Symbol, ...]
    there: tuple[sp.Symbol, ...]
    weight: sp.Symbol
    rhs: tuple[sp.Expr, ...]
    parameters: tuple[sp.Symbol, ...]

    def __post_init__(self) -> None:
        if len(self.here) != len(self.there):
            raise ValueError(f"edge: {len(self.here)} symbols at the target but {len(self.there)} at the source")
        _differ("edge", (TIME, self.weight, *self.here, *self.there, *self.parameters))
        known = {self.weight, *self.here, *self.there, *self.parameters}
        _check("edge", self.rhs, len(self.here), known)

    def jacobian_here(self) -> tuple[tuple[sp.Expr, ...], ...]:
        """d(rhs)/d(here)."""
        return tuple(tuple(derivative(e, s) for s in self.here) for e in self.rhs)

    def jacobian_there(self) -> tuple[tuple[sp.Expr, ...], ...]:
        """d(rhs)/d(there)."""
        return tuple(tuple(derivative(e, s) for s in self.there) for e in self.rhs)

    @property
    def diffusive(self) -> bool:
        """True where the link vanishes between equal states, so that synchronous motion solves the network."""
        equal = dict(zip(self.there, self.here, strict=True))
        return all(sp.simplify(e.xreplace(equal)) == 0 for e in self.rhs)


@dataclass(frozen=True, slots=True)
class Equations:
    """The equations of motion of `n` equal nodes joined by `links`.

    State order is component by component: x_1 … x_n, v_1 … v_n.  Raises ValueError on a link outside the nodes,
    a link from a node to itself, a repeated link, links without an edge, or a parameter named like a state variable.
    """

    node: Node
    edge: Edge | None
    n: int
    links: tuple[Link, ...] = ()

    def __post_init__(self) -> None:
        if self.n < 1:
            raise ValueError(f"a network needs at least one node, found n = {self.n}")
        if self.links and self.edge is None:
            raise ValueError(f"{len(self.links)} links but no edge equations; give a coupling")
        if self.edge is not None and len(self.edge.here) != len(self.node.state):
            raise ValueError(
                f"the edge joins nodes of {len(self.edge.here)} states, the node has {len(self.node.state)}"
            )
        seen = set()
        for target, source, _ in self.links:
            if not (0 <= target < self.n and 0 <= source < self.n) or target == source:
                raise ValueError(f"link {target} <- {source}: expected two different nodes of 0 … {self.n - 1}")
            if (target, source) in seen:
                raise ValueError(f"link {target} <- {source} occurs twice; add the weights up")
            seen.add((target, source))
        states = {*self.state, *(s.name for s in self.node.state)}
        taken = sorted(states.intersection(self.parameters))
        if taken:
            raise ValueError(f"the parameter {taken[0]!r} has the name of a state variable; rename it")

    @property
    def dimension(self) -> int:
        """Number of state variables of the whole network."""
        return self.n * len(self.node.state)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of all parameters, node first, in a fixed order."""
        names = [s.name for s in self.node.parameters]
        if self.links and self.edge is not None:
            names += [s.name for s in self.edge.parameters if s.name not in names]
        return tuple(names)

    @property
    def state(self) -> tuple[str, ...]:
        """Names of the state variables: x_1 … x_n, v_1 … v_n."""
        return tuple(f"{s.name}_{i + 1}" for s in self.node.state for i in range(self.n))

    def symbols(self, i: int) -> tuple[sp.Symbol, ...]:
        """The state symbols of node `i` (0-based)."""
        return tuple(sp.Symbol(f"{s.name}_{i + 1}", real=True) for s in self.node.state)

    def at_node(self, i: int) -> dict[sp.Symbol, sp.Symbol]:
        """The substitution that turns the node template into node `i`."""
        return dict(zip(self.node.state, self.symbols(i), strict=True))

    def at_link(self, link: Link) -> dict[sp.Symbol, sp.Expr]:
        """The substitution that turns the edge template into one link."""
        if self.edge is None:
            raise ValueError("these equations have no edge")
        target, source, weight = link
        here = dict(zip(self.edge.here, self.symbols(target), strict=True))
        there = dict(zip(self.edge.there, self.symbols(source), strict=True))
        return {**here, **there, self.edge.weight: sp.Rational(weight.numerator, weight.denominator)}

    def contact_at(self, i: int) -> Contact | None:
        """What decides between stick and slip for node `i`, with the forces of its links; None without a contact."""
        contact = self.node.contact
        if contact is None:
            return None
        _, velocity, mode = self.symbols(i)
        own = contact.map(lambda e: e.xreplace(self.at_node(i)))
        links = sp.S.Zero
        if self.edge is not None:
            links = sp.Add(*(self.edge.rhs[1].xreplace(self.at_link(link)) for link in self.links if link[0] == i))
        links = links.xreplace({mode: sp.S.One, velocity: own.speed})
        return own.under(links)

    def rhs(self) -> tuple[sp.Expr, ...]:
        """The whole right-hand side, in state order (algebra grows with n: meant for small n)."""
        table = [[e.xreplace(self.at_node(i)) for e in self.node.rhs] for i in range(self.n)]
        if self.edge is not None:
            for link in self.links:
                values = self.at_link(link)
                for c, e in enumerate(self.edge.rhs):
                    table[link[0]][c] += e.xreplace(values)
        return tuple(table[i][c] for c in range(len(self.node.state)) for i in range(self.n))

    def jacobian(self) -> dict[tuple[int, int], sp.Expr]:
        """The non-zero entries (row, column) of d(rhs)/d(state), rows and columns in state order."""
        entries: dict[tuple[int, int], sp.Expr] = {}
        own = self.node.jacobian()
        for i in range(self.n):
            for key, value in _block(own, i, i, self.n, self.at_node(i)):
                entries[key] = value
        for key, value in self.link_jacobian():
            entries[key] = entries.get(key, sp.S.Zero) + value
        return {key: entries[key] for key in sorted(entries) if entries[key] != 0}

    def link_jacobian(self) -> Iterator[tuple[tuple[int, int], sp.Expr]]:
        """Yield ((row, column), entry) for each link's share of the Jacobian; keys repeat where links meet."""
        if self.edge is None or not self.links:
            return
        here, there = self.edge.jacobian_here(), self.edge.jacobian_there()
        for link in self.links:
            values = self.at_link(link)
            yield from _block(here, link[0], link[0], self.n, values)
            yield from _block(there, link[0], link[1], self.n, values)

    def time_derivative(self) -> tuple[sp.Expr, ...]:
        """The partial derivative of the right-hand side with respect to time, in state order."""
        own = self.node.time_derivative()
        return tuple(e.xreplace(self.at_node(i)) for e in own for i in range(self.n))

    def latex(self) -> str:
        """The equations in LaTeX (see `synchain.models.present`)."""
        from .present import latex

        return latex(self)

    def text(self) -> str:
        """The equations in plain text with Greek letters."""
        from .present import text

        return text(self)

    @property
    def digest(self) -> str:
        """Hexadecimal SHA-256 of the equations: equal equations have equal digests, whatever made them."""
        edge = self.edge if self.links else None
        parts = [_text(self.node.state, self.node.rhs, self.node.parameters), str(self.n), repr(self.links)]
        if self.node.contact is not None:
            parts.append("; ".join(map(sp.srepr, self.node.contact.expressions)))
        if edge is not None:
            parts.append(_text((*edge.here, *edge.there, edge.weight), edge.rhs, edge.parameters))
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def _block(
    block: tuple[tuple[sp.Expr, ...], ...], row: int, column: int, n: int, values: Mapping[sp.Symbol, sp.Expr]
) -> Iterator[tuple[tuple[int, int], sp.Expr]]:
    for r, line in enumerate(block):
        for c, entry in enumerate(line):
            if entry != 0:
                yield (r * n + row, c * n + column), entry.xreplace(dict(values))


def _differ(what: str, symbols: tuple[sp.Symbol, ...]) -> None:
    names = [s.name for s in symbols]
    twice = next((name for i, name in enumerate(names) if name in names[:i]), None)
    if twice is not None:
        meaning = "is the time" if twice == TIME.name else "stands for two things"
        raise ValueError(f"{what}: the name {twice!r} {meaning}; rename that state or parameter")


def _check(what: str, rhs: tuple[sp.Expr, ...], size: int, known: set[sp.Symbol]) -> None:
    if len(rhs) != size:
        raise ValueError(f"{what}: {len(rhs)} equations for {size} states; expected one each")
    for expression in rhs:
        unknown = sorted(s.name for s in expression.free_symbols - known)
        if unknown:
            raise ValueError(
                f"{what}: undeclared symbol {unknown[0]!r} in {expression}; declare it as a state or parameter"
            )
        floats = sorted(expression.atoms(sp.Float), key=str)
        if floats:
            raise ValueError(
                f"{what}: floating-point number {floats[0]} in {expression}; use a parameter or a Rational"
            )


def _text(state: tuple[sp.Symbol, ...], rhs: tuple[sp.Expr, ...], parameters: tuple[sp.Symbol, ...]) -> str:
    return " | ".join([", ".join(map(str, state)), "; ".join(map(sp.srepr, rhs)), ", ".join(map(str, parameters))])
