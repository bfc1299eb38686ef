"""Compute the contributions of one node or one link to an exported text: tables of expressions, and assignments.

Networks of up to LARGEST_UNROLLED nodes are written node by node and link by link.  For larger networks, one template
of a node and one template of a link are written as loops (C, Numba) or as array operations (Python).  `link` = None
denotes the template of all links, whose weight is a symbol.

With a mass matrix, M d(state)/dt = rhs, the Jacobian of the rates is M^-1 (d(rhs)/d(state) - d(M rates)/d(state)) at
fixed rates.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.graphs.links import Link
from synchain.models.mechanics.calculus import derivative
from synchain.models.mechanics.components import Block, Edge, Node

from ..program.expressions import Expression
from ..program.lowering import Library, number
from ..program.passes import real
from ..program.statements import Statement, let

# Largest number of nodes of a network that is written node by node. A choice: 8 nodes fill a page of text.
LARGEST_UNROLLED = 8
LINE = 110  # largest width of the lines of a table, in columns
Linked: TypeAlias = tuple[Link, Edge]  # a link and its template
lower = Library()  # translates SymPy expressions for exported languages, all of which have a mathematical library


class Entry(NamedTuple):
    """A matrix entry: row: component of a node (or target); column: component of the same node or of the `source`."""

    row: int
    column: int
    source: bool = False


# Returns the statement that stores a value at a component of the state, or at an `Entry`.
Storing: TypeAlias = Callable[[Any, Expression], Statement]


@dataclass(frozen=True, slots=True)
class ExportBody:
    """Temporaries in order of computation, and results, each with its component of the state or its `Entry`."""

    steps: tuple[tuple[sp.Symbol, sp.Expr], ...]
    results: tuple[tuple[Any, sp.Expr], ...]

    @classmethod
    def of(cls, table: Mapping[Any, Any]) -> ExportBody:
        """Name common subexpressions w1, w2, …; no symbol of a portable model has such a name."""
        expressions = [sp.sympify(e) for e in table.values()]
        # temporaries are numbers, so hide the conditions of choices during the search for common subexpressions
        conditions = {pair.cond for e in expressions for choice in e.atoms(sp.Piecewise) for pair in choice.args}
        ordered = sorted(conditions - {sp.true}, key=sp.default_sort_key)
        hidden = {condition: sp.Symbol(f"condition {k}") for k, condition in enumerate(ordered)}
        shown = {symbol: condition for condition, symbol in hidden.items()}
        names = (real(f"w{k}") for k in range(1, 1_000_000))
        steps, results = sp.cse([e.xreplace(hidden) for e in expressions], symbols=names, order="canonical")
        values = [e.xreplace(shown) for e in results]
        return cls(tuple((s, e.xreplace(shown)) for s, e in steps), tuple(zip(table, values, strict=True)))

    def uses(self, symbols: Iterable[sp.Symbol]) -> list[sp.Symbol]:
        used: set[sp.Symbol] = set().union(*(e.free_symbols for _, e in (*self.steps, *self.results)))
        return [s for s in symbols if s in used]

    def statements(self, loads: Mapping[sp.Symbol, Expression], storing: Storing) -> list[Statement]:
        """Return statements that load the used symbols, compute the temporaries, and store the results."""
        statements: list[Statement] = [let(s.name, loads[s]) for s in self.uses(loads)]
        statements += [let(s.name, lower(e)) for s, e in self.steps]
        return statements + [storing(key, lower(e)) for key, e in self.results]


# -- tables of a node -------------------------------------------------------------------------------------------------


def node_rhs(equations: Equations, i: int = 0) -> dict[int, sp.Expr]:
    """Return the right-hand side of node `i` by component."""
    return dict(enumerate(equations.node_at(i).rhs))


def node_jacobian(equations: Equations, i: int = 0) -> dict[Entry, sp.Expr]:
    """Return the entries of a node's block of the Jacobian that are not zero."""
    node = equations.node_at(i)
    block = node.jacobian()
    if node.inertia:
        block = _less(block, sp.Matrix(node.inertia) * sp.Matrix(node_rate_symbols(node)), node.state)
    return _entries(block)


def node_mass(equations: Equations, i: int = 0) -> dict[Entry, sp.Expr]:
    """Return the entries of a node's block of M that differ from the identity."""
    block = equations.node_at(i).inertia
    entries = {Entry(r, c): e for r, row in enumerate(block) for c, e in enumerate(row)}
    return {entry: e for entry, e in entries.items() if e != sp.Integer(entry.row == entry.column)}


def node_rate_symbols(node: Node) -> tuple[sp.Symbol, ...]:
    """Return symbols for the rates of the states of a node."""
    return tuple(real(f"rate_i{k}") for k in range(len(node.state)))


# -- tables of a link -------------------------------------------------------------------------------------------------


def link_rhs(equations: Equations, link: Linked | None = None) -> dict[int, sp.Expr]:
    """Return the terms that a link adds to the right-hand side of its target, by component."""
    edge = _edge(equations, link)
    return {} if edge is None else _weighted(enumerate(edge.rhs), link)


def link_jacobian(equations: Equations, link: Linked | None = None) -> dict[Entry, sp.Expr]:
    """Return the terms that a link adds to the Jacobian, in the blocks (target, target) and (target, source)."""
    edge = _edge(equations, link)
    if edge is None:
        return {}
    here, there = edge.jacobian_here(), edge.jacobian_there()
    if edge.inertia:
        masses = sp.Matrix.hstack(*(sp.Matrix(part) for part in edge.inertia))
        push = masses * sp.Matrix(link_rate_symbols(edge))
        here, there = _less(here, push, edge.here), _less(there, push, edge.there)
    return _weighted((_entries(here) | _entries(there, source=True)).items(), link)


def link_mass(equations: Equations, link: Linked | None = None) -> dict[Entry, sp.Expr]:
    """Return the terms that a link adds to M, in the blocks (target, target) and (target, source)."""
    edge = _edge(equations, link)
    if edge is None:
        return {}
    return _weighted(
        (item for end, block in enumerate(edge.inertia) for item in _entries(block, bool(end)).items()), link
    )


def link_rate_symbols(edge: Edge) -> tuple[sp.Symbol, ...]:
    """Return symbols for the rates of the states at both ends of a link."""
    ends = (("i", edge.here), ("j", edge.there))
    return tuple(real(f"rate_{end}{k}") for end, states in ends for k in range(len(states)))


def _edge(equations: Equations, link: Linked | None) -> Edge | None:
    if link is None:
        return equations.edge if equations.links else None
    return link[1]


def _weighted(items: Iterable[tuple[Any, sp.Expr]], link: Linked | None) -> dict[Any, sp.Expr]:
    """Return a table without zero entries, with the weight of the link inserted as a number."""
    weight = {} if link is None else {link[1].weight: sp.Rational(link[0][2].numerator, link[0][2].denominator)}
    table = {key: sp.sympify(e).xreplace(weight) for key, e in items}
    return {key: e for key, e in table.items() if e != 0}


def _less(block: Block, push: sp.Matrix, states: tuple[sp.Symbol, ...]) -> Block:
    """Return a block minus the derivatives of `push` (M rates) by some states."""
    return tuple(
        tuple(e - derivative(push[r], s) for e, s in zip(row, states, strict=True)) for r, row in enumerate(block)
    )


def _entries(block: Block, source: bool = False) -> dict[Entry, sp.Expr]:
    """Return the entries of a block that are not zero."""
    return {Entry(r, c, source): e for r, row in enumerate(block) for c, e in enumerate(row) if e != 0}


# -- networks ---------------------------------------------------------------------------------------------------------


def is_unrolled(equations: Equations) -> bool:
    """Return True if every node is written out: few nodes, nodes of several kinds, or links of several layers."""
    plain = not equations.mixed and len(equations.layers) < 2 and not any(edge.theirs for edge in equations.edges)
    return not plain or equations.n <= LARGEST_UNROLLED


def check_inertia(equations: Equations, language: str) -> None:
    """Raise ValueError where a source text of many nodes cannot solve for the rates."""
    if equations.inertial and not is_unrolled(equations):
        by_nodes = any(node.inertia for node in equations.nodes)
        if language == "python" and equations.constant_mass and not by_nodes:
            return
        what = "nodes with a mass matrix" if by_nodes else "links with inertia"
        other = "" if by_nodes or language == "python" else "; export Python, which has sparse solvers"
        raise ValueError(f"{what} in {language}: expected at most {LARGEST_UNROLLED} nodes, found {equations.n}{other}")


def node_parameters(equations: Equations, i: int) -> dict[sp.Symbol, int]:
    """Return, for each parameter that differs between nodes, the index of node `i`'s value in Equations.parameters."""
    names = equations.parameters
    symbols = (s for s in equations.node_at(i).parameters if s.name in equations.varied)
    return {s: names.index(f"{s.name}_{i + 1}") for s in symbols}


# -- tables of numbers ------------------------------------------------------------------------------------------------


def wrapped(numbers: Iterable[str]) -> list[str]:
    """Return the numbers of a table, separated by commas and broken into lines."""
    lines, line = [], "    "
    for text in numbers:
        if len(line) + len(text) > LINE:
            lines.append(line.rstrip())
            line = "    "
        line += f"{text}, "
    return [*lines, line.rstrip()]


def link_tables(equations: Equations) -> dict[str, list[str]]:
    """Return the tables of link ends and, if links differ in a parameter, the table of indices of that parameter."""
    tables = {name: [str(link[end]) for link in equations.links] for end, name in enumerate(("TARGET", "SOURCE"))}
    if equations.numbered:
        ((name, layer), *_) = equations.numbered.items()
        index = {text: k for k, text in enumerate(layer.names(name))}
        tables["NUMBER"] = [str(index[layer.name(name, link)]) for link in layer.links]
    return tables


def array_tables(equations: Equations) -> list[str]:
    """Return lines that make NumPy arrays of the tables of links and weights; an empty list without links."""
    tables = {**link_tables(equations), "WEIGHT": weights(equations)} if equations.links else {}
    return [line for name, table in tables.items() for line in (f"{name} = np.array([", *wrapped(table), "])")]


def weights(equations: Equations) -> list[str]:
    return [repr(number(weight).value) for _, _, weight in equations.links]
