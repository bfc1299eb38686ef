"""What one node or one link contributes, as assignments that every exported language can write."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, TypeAlias

import sympy as sp

from .equations import Equations
from .export_expression import Dialect, decimal, write

__all__ = ["LARGEST_UNROLLED", "Body", "Place", "Store", "Syntax", "link_body", "link_places", "node_body", "node_places",
           "parameters", "weights", "wrapped"]  # fmt: skip

LARGEST_UNROLLED = 8
"""Networks up to this size are written node by node, larger ones as loops."""

Place = tuple[int, int]
"""(row, column) of an entry in the block of one node or link, by component of the state."""

Store: TypeAlias = Callable[[Any, str], str]
"""Makes the statement that stores the text of a value at a component or place."""


@dataclass(frozen=True, slots=True)
class Body:
    """Temporaries in order, then the results that are not zero, with the component or place that each belongs to."""

    steps: tuple[tuple[sp.Symbol, sp.Expr], ...]
    results: tuple[tuple[Any, sp.Expr], ...]

    def uses(self, symbols: Iterable[sp.Symbol]) -> list[sp.Symbol]:
        """Those of the symbols that occur."""
        found: set[sp.Symbol] = set().union(*(e.free_symbols for _, e in (*self.steps, *self.results)))
        return [s for s in symbols if s in found]


@dataclass(frozen=True, slots=True)
class Syntax:
    """How a language declares a number and a whole number, assigns, comments, and names an entry of a matrix.

    `braces` where blocks are in braces; `reads` where parameters come in an array.
    """

    dialect: Dialect
    declare: str
    whole: str
    assign: str
    comment: str
    entry: str
    braces: bool = False
    reads: bool = True

    def body(self, body: Body, loads: dict[sp.Symbol, str], store: Store) -> list[str]:
        """Read what is used, compute, and store; `loads` says where each state is, `store` writes a result."""
        lines = [self.declare.format(s.name, loads[s]) for s in body.uses(loads)]
        lines += [self.declare.format(s.name, write(e, self.dialect)) for s, e in body.steps]
        return lines + [store(place, write(e, self.dialect)) for place, e in body.results]


def node_body(equations: Equations, jacobian: bool = False) -> Body:
    """The right-hand side of one node (component -> value), or its block of the Jacobian (place -> value)."""
    if jacobian:
        return _body(equations, {place: e for place, e in node_places(equations).items()})
    return _body(equations, dict(enumerate(equations.node.rhs)), every=True)


def node_places(equations: Equations) -> dict[Place, sp.Expr]:
    """The entries of a node's own block of the Jacobian that are not zero."""
    return _places(equations.node.jacobian())


def link_places(equations: Equations) -> tuple[dict[Place, sp.Expr], dict[Place, sp.Expr]]:
    """The entries that a link adds to the block of its target, and those in the block (target, source)."""
    edge = equations.edge if equations.links else None
    return ({}, {}) if edge is None else (_places(edge.jacobian_here()), _places(edge.jacobian_there()))


def link_body(equations: Equations, weight: sp.Expr | None = None, jacobian: bool = False) -> Body:
    """What a link adds to its target (component -> value), or to the Jacobian ((False or True for there, place) -> value).

    `weight` is put in where it is given; else the weight stays a symbol.
    """
    edge = equations.edge
    if edge is None or not equations.links:
        return Body((), ())
    table: dict[Any, sp.Expr] = dict(enumerate(edge.rhs))
    if jacobian:
        table = {(there, place): e for there in (False, True) for place, e in link_places(equations)[there].items()}
    if weight is not None:
        table = {place: e.xreplace({edge.weight: weight}) for place, e in table.items()}
    return _body(equations, table)


def parameters(equations: Equations, bodies: Iterable[Body]) -> list[int]:
    """The places, in Equations.parameters, of the parameters that some bodies use."""
    used = {s.name for body in bodies for s in body.uses(_parameter_symbols(equations))}
    return [k for k, name in enumerate(equations.parameters) if name in used]


def _parameter_symbols(equations: Equations) -> list[sp.Symbol]:
    return [sp.Symbol(name, real=True) for name in equations.parameters]


def _places(block: tuple[tuple[sp.Expr, ...], ...]) -> dict[Place, sp.Expr]:
    table = {(r, c): _settled(e) for r, row in enumerate(block) for c, e in enumerate(row)}
    return {place: e for place, e in table.items() if e != 0}


def _settled(e: sp.Expr) -> sp.Expr:
    """Derivatives of Max and Min as choices, of floor and ceiling as 0: right away from their kinks and jumps."""
    jumps = (sp.floor, sp.ceiling)
    e = e.replace(lambda part: isinstance(part, sp.Derivative) and part.has(*jumps), lambda part: sp.S.Zero)
    e = e.replace(lambda part: isinstance(part, sp.Subs), lambda part: part.doit())
    return e.replace(sp.Heaviside, lambda x, *_: sp.Piecewise((sp.S.One, x > 0), (sp.S.Zero, True)))


def _body(equations: Equations, table: dict, every: bool = False) -> Body:
    """Common parts are computed once: w1, w2, …, which no symbol of a portable model is called."""
    kept = {place: sp.sympify(e) for place, e in table.items() if every or e != 0}
    names = (sp.Symbol(f"w{k}", real=True) for k in range(1, 1_000_000))
    conditions = {pair.cond for e in kept.values() for choice in e.atoms(sp.Piecewise) for pair in choice.args}
    hidden = {
        c: sp.Symbol(f"condition {k}") for k, c in enumerate(sorted(conditions - {sp.true}, key=sp.default_sort_key))
    }
    shown = {symbol: c for c, symbol in hidden.items()}  # a temporary is a number: conditions stay where they are
    steps, results = sp.cse([e.xreplace(hidden) for e in kept.values()], symbols=names, order="canonical")
    values = [e.xreplace(shown) for e in results]
    return Body(tuple((s, e.xreplace(shown)) for s, e in steps), tuple(zip(kept, values, strict=True)))


def wrapped(numbers: Iterable[str], indent: str = "    ", width: int = 110) -> list[str]:
    """Numbers of a long table with commas between them, broken into lines."""
    lines, line = [], indent
    for number in numbers:
        if len(line) + len(number) > width:
            lines.append(line.rstrip())
            line = indent
        line += f"{number}, "
    return [*lines, line.rstrip()]


def weights(equations: Equations) -> list[str]:
    """The weights of the links as decimals."""
    return [decimal(weight) for _, _, weight in equations.links]
