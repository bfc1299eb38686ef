"""What one node or one link contributes, as assignments that every exported language can write."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.graphs.links import Link
from synchain.models.mechanics.calculus import derivative
from synchain.models.mechanics.components import Block, Edge, Node

from ..program.expressions import Expression
from ..program.lowering import Library, number
from ..program.passes import real
from ..program.statements import Statement, let

LARGEST_UNROLLED = 8
"""Networks up to this size are written node by node, larger ones as loops."""

Place = tuple[int, int]
"""(row, column) of an entry in the block of one node or link, by component of the state."""

Linked: TypeAlias = tuple[Link, Edge]
"""A link with its template."""

Storing: TypeAlias = Callable[[Any, Expression], Statement]
"""Makes the statement that stores a value at a component or place."""

lower = Library()
"""All exported languages have a mathematical library."""


@dataclass(frozen=True, slots=True)
class ExportBody:
    """Temporaries in order, then the results that are not zero, with the component or place that each belongs to."""

    steps: tuple[tuple[sp.Symbol, sp.Expr], ...]
    results: tuple[tuple[Any, sp.Expr], ...]

    def uses(self, symbols: Iterable[sp.Symbol]) -> list[sp.Symbol]:
        """Those of the symbols that occur."""
        found: set[sp.Symbol] = set().union(*(e.free_symbols for _, e in (*self.steps, *self.results)))
        return [s for s in symbols if s in found]

    def statements(self, loads: Mapping[sp.Symbol, Expression], storing: Storing) -> list[Statement]:
        """Read what is used, compute, and store; `loads` says where each state is."""
        found: list[Statement] = [let(s.name, loads[s]) for s in self.uses(loads)]
        found += [let(s.name, lower(e)) for s, e in self.steps]
        return found + [storing(place, lower(e)) for place, e in self.results]


def node_body(equations: Equations, jacobian: bool = False, i: int = 0) -> ExportBody:
    """The right-hand side of node `i` (component -> value), or its block of the Jacobian (place -> value)."""
    if jacobian:
        return _body({place: e for place, e in node_places(equations, i).items()})
    return _body(dict(enumerate(equations.node_at(i).rhs)), every=True)


def node_places(equations: Equations, i: int = 0) -> dict[Place, sp.Expr]:
    """The entries of a node's own block of d(rhs)/d(state) - d(M rates)/d(state) at fixed rates that are not zero."""
    node = equations.node_at(i)
    if not node.inertia:
        return _places(node.jacobian())
    push = sp.Matrix(node.inertia) * sp.Matrix(node_rate_symbols(node))
    return _places(_less(node.jacobian(), push, node.state))


def node_mass_body(equations: Equations, i: int = 0) -> ExportBody:
    """The entries of a node's block of M that are not those of the identity (place -> value)."""
    block = equations.node_at(i).inertia
    table = {(r, c): e for r, row in enumerate(block) for c, e in enumerate(row) if e != sp.Integer(r == c)}
    return _body(table, every=True)


def node_rate_symbols(node: Node) -> tuple[sp.Symbol, ...]:
    """Symbols for the rates of the states of a node."""
    return tuple(real(f"rate_i{k}") for k in range(len(node.state)))


def link_places(equations: Equations, link: Linked | None = None) -> dict[tuple[bool, Place], sp.Expr]:
    """The entries that a link adds to the block of its target, False, and those in the block (target, source), True."""
    edge = _edge(equations, link)
    if edge is None:
        return {}
    blocks = ((False, edge.jacobian_here(), edge.here), (True, edge.jacobian_there(), edge.there))
    found = ((there, _places(_at_rates(edge, block, states))) for there, block, states in blocks)
    return {(there, place): e for there, block in found for place, e in block.items()}


def rate_symbols(edge: Edge) -> tuple[sp.Symbol, ...]:
    """Symbols for the rates of the states at both ends of a link."""
    ends = (("i", edge.here), ("j", edge.there))
    return tuple(real(f"rate_{end}{k}") for end, states in ends for k in range(len(states)))


def _at_rates(edge: Edge, block: Block, states: tuple[sp.Symbol, ...]) -> Block:
    """A block of d(rhs)/d(state) - d(M rates)/d(state) at fixed rates, the derivatives by some states of a link."""
    if not edge.inertia:
        return block
    masses = sp.Matrix.hstack(*(sp.Matrix(part) for part in edge.inertia))
    return _less(block, masses * sp.Matrix(rate_symbols(edge)), states)


def _less(block: Block, push: sp.Matrix, states: tuple[sp.Symbol, ...]) -> Block:
    """A block less the derivatives of M rates by some states."""
    return tuple(
        tuple(e - derivative(push[r], s) for e, s in zip(row, states, strict=True)) for r, row in enumerate(block)
    )


def mass_body(equations: Equations, link: Linked | None = None) -> ExportBody:
    """What a link adds to M in M d(state)/dt = rhs, ((False or True for there, place) -> value)."""
    edge = _edge(equations, link)
    if edge is None:
        return ExportBody((), ())
    weight, blocks = _weight(link), enumerate(edge.inertia)
    return _body(
        {(bool(end), place): e.xreplace(weight) for end, block in blocks for place, e in _places(block).items()}
    )


def is_unrolled(equations: Equations) -> bool:
    """True if every node is written out: few nodes, nodes of several kinds, and links of several layers."""
    plain = not equations.mixed and len(equations.layers) < 2 and not any(edge.theirs for edge in equations.edges)
    return not plain or equations.n <= LARGEST_UNROLLED


def check_inertia(equations: Equations, language: str) -> None:
    """Raise ValueError where a source text of many nodes cannot solve for the rates."""
    if equations.inertial and not is_unrolled(equations):
        own = any(node.inertia for node in equations.nodes)
        if language == "python" and equations.constant_mass and not own:
            return
        what = "nodes with a mass matrix" if own else "links with inertia"
        other = "" if own or language == "python" else "; export Python, which has sparse solvers"
        raise ValueError(f"{what} in {language}: expected at most {LARGEST_UNROLLED} nodes, found {equations.n}{other}")


def _edge(equations: Equations, link: Linked | None) -> Edge | None:
    if link is None:
        return equations.edge if equations.links else None
    return link[1]


def _weight(link: Linked | None) -> dict[sp.Symbol, sp.Expr]:
    """The weight of a link as a number; that of any link stays a symbol."""
    if link is None:
        return {}
    (_, _, weight), edge = link
    return {edge.weight: sp.Rational(weight.numerator, weight.denominator)}


def link_body(equations: Equations, link: Linked | None = None, jacobian: bool = False) -> ExportBody:
    """What a link adds to its target (component -> value), or to the Jacobian ((False or True for there, place) -> value).

    Without a `link` the weight stays a symbol.
    """
    edge = _edge(equations, link)
    if edge is None:
        return ExportBody((), ())
    table: dict[Any, sp.Expr] = {**link_places(equations, link)} if jacobian else dict(enumerate(edge.rhs))
    return _body({place: e.xreplace(_weight(link)) for place, e in table.items()})


def parameters(equations: Equations, bodies: Iterable[ExportBody]) -> list[int]:
    """The places, in Equations.parameters, of the parameters that all nodes share and some bodies use."""
    used = {s.name for body in bodies for s in body.uses(map(real, equations.parameters))}
    return [k for k, name in enumerate(equations.parameters) if name in used]


def own_parameters(equations: Equations, i: int) -> dict[sp.Symbol, int]:
    """The parameters that node `i` has for itself, with their places in Equations.parameters."""
    names = equations.parameters
    own = (s for s in equations.node_at(i).parameters if s.name in equations.varied)
    return {s: names.index(f"{s.name}_{i + 1}") for s in own}


def _places(block: tuple[tuple[sp.Expr, ...], ...]) -> dict[Place, sp.Expr]:
    table = {(r, c): e for r, row in enumerate(block) for c, e in enumerate(row)}
    return {place: e for place, e in table.items() if e != 0}


def _body(table: dict[Any, Any], every: bool = False) -> ExportBody:
    """Common parts are computed once: w1, w2, …, which no symbol of a portable model is called."""
    kept = {place: sp.sympify(e) for place, e in table.items() if every or e != 0}
    names = (real(f"w{k}") for k in range(1, 1_000_000))
    conditions = {pair.cond for e in kept.values() for choice in e.atoms(sp.Piecewise) for pair in choice.args}
    hidden = {
        c: sp.Symbol(f"condition {k}") for k, c in enumerate(sorted(conditions - {sp.true}, key=sp.default_sort_key))
    }
    shown = {symbol: c for c, symbol in hidden.items()}  # a temporary is a number: conditions stay where they are
    steps, results = sp.cse([e.xreplace(hidden) for e in kept.values()], symbols=names, order="canonical")
    values = [e.xreplace(shown) for e in results]
    return ExportBody(tuple((s, e.xreplace(shown)) for s, e in steps), tuple(zip(kept, values, strict=True)))


def wrapped(numbers: Iterable[str]) -> list[str]:
    """Numbers of a long table with commas between them, broken into lines."""
    lines, line = [], "    "
    for text in numbers:
        if len(line) + len(text) > 110:
            lines.append(line.rstrip())
            line = "    "
        line += f"{text}, "
    return [*lines, line.rstrip()]


def link_tables(equations: Equations) -> dict[str, list[str]]:
    """The ends of the links and, if links differ in a parameter, which of its numbers is that of a link."""
    tables = {name: [str(link[end]) for link in equations.links] for end, name in enumerate(("TARGET", "SOURCE"))}
    if equations.numbered:
        ((name, layer), *_) = equations.numbered.items()
        places = {own: k for k, own in enumerate(layer.names(name))}
        tables["NUMBER"] = [str(places[layer.name(name, link)]) for link in layer.links]
    return tables


def array_tables(equations: Equations) -> list[str]:
    """Lines that make NumPy arrays of the tables of the links and of their weights; none without links."""
    tables = {**link_tables(equations), "WEIGHT": weights(equations)} if equations.links else {}
    return [line for name, table in tables.items() for line in (f"{name} = np.array([", *wrapped(table), "])")]


def weights(equations: Equations) -> list[str]:
    """The weights of the links as decimals."""
    return [repr(number(weight).value) for _, _, weight in equations.links]
