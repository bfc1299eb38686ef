"""From expressions to blocks of statements: what depends on parameters alone, on time, and on the state is parted.

A block of the first kind runs once a step, one of the second once for each stage time, the third once for each node
and stage.  Repeated subexpressions get numbered names that cannot collide with the user's symbols.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import sympy as sp
from sympy.functions.elementary.piecewise import ExprCondPair

from synchain.models.mechanics.components import TIME, Node

__all__ = ["Body", "Hoist", "Names", "NodeBlocks", "analyse"]


class Names:
    """A supply of symbols ``prefix0, prefix1, …`` that avoids the names already taken."""

    def __init__(self, taken: Iterable[str]) -> None:
        self.taken = set(taken)

    def fresh(self, prefix: str) -> Iterator[sp.Symbol]:
        """Yield unused symbols with this prefix, for ever."""
        number = 0
        while True:
            name = f"{prefix}{number}"
            number += 1
            if name not in self.taken:
                self.taken.add(name)
                yield sp.Symbol(name, real=True)


@dataclass
class Hoist:
    """Replaces maximal subexpressions that are free of `moving` symbols by names; equal ones share a name."""

    moving: frozenset[sp.Symbol]
    supply: Iterator[sp.Symbol]
    table: dict[sp.Expr, sp.Symbol] = field(default_factory=dict)

    def apply(self, e: sp.Expr) -> sp.Expr:
        """Return the expression with its fixed parts named."""
        if not e.free_symbols:
            return e
        if isinstance(e, ExprCondPair):  # one branch of a choice is no value of its own
            return e.func(*(self.apply(a) for a in e.args))
        if e.is_Symbol:
            return e if e in self.moving else self.name(e)
        if not e.free_symbols & self.moving:
            return self.name(e)
        if e.is_Add or e.is_Mul:
            fixed = [a for a in e.args if not a.free_symbols & self.moving]
            rest = [self.apply(a) for a in e.args if a.free_symbols & self.moving]
            whole = e.func(*fixed)
            if whole.free_symbols:
                return e.func(self.name(whole), *rest)
            return e.func(whole, *rest)
        return e.func(*(self.apply(a) for a in e.args))

    def name(self, e: sp.Expr) -> sp.Expr:
        """The symbol that stands for a fixed expression; time itself gets one, since it differs from stage to stage."""
        if e.is_Symbol and e != TIME:
            return e
        if e.could_extract_minus_sign() and e.is_Mul:
            return -self.name(-e)
        if e not in self.table:
            self.table[e] = next(self.supply)
        return self.table[e]


@dataclass(frozen=True, slots=True)
class Body:
    """Straight-line statements and the expressions that they end in."""

    statements: tuple[tuple[sp.Symbol, sp.Expr], ...]
    results: tuple[sp.Expr, ...]

    @property
    def symbols(self) -> set[sp.Symbol]:
        """Everything that the body reads and does not define."""
        used: set[sp.Symbol] = set().union(*(e.free_symbols for e in self.results)) if self.results else set()
        for _, e in self.statements:
            used |= e.free_symbols
        return used - {s for s, _ in self.statements}


@dataclass(frozen=True, slots=True)
class NodeBlocks:
    """One node, sorted by how often its parts must run.

    `constants` and `timed` are statements; `rhs` gives d(state)/dt; `linear` gives rhs, then the entries of the Jacobian
    row by row, then the partial time derivative; `local` the same without the latter.  Results may be plain symbols or
    numbers: those need no code.
    """

    constants: tuple[tuple[sp.Symbol, sp.Expr], ...]
    timed: tuple[tuple[sp.Symbol, sp.Expr], ...]
    rhs: Body
    linear: Body
    local: Body


def analyse(node: Node, names: Names, varied: Iterable[str] = ()) -> NodeBlocks:
    """Part the equations of a node into constants, time terms and state terms.

    What depends on parameters with a value for each node, `varied`, is computed with the state.
    """
    size = len(node.state)
    entries = [e for row in node.jacobian() for e in row]
    outputs = [*node.rhs, *entries, *node.time_derivative()]
    moving = frozenset(node.state) | {sp.Symbol(name, real=True) for name in varied}
    waves = Hoist(moving, names.fresh("hoisted_"))
    outputs = [waves.apply(e) for e in outputs]
    steady = Hoist(moving | {TIME} | set(waves.table.values()), names.fresh("fixed_"))
    timed: dict[sp.Symbol, sp.Expr] = {}
    fixed: dict[sp.Symbol, sp.Expr] = {}
    for e, symbol in waves.table.items():
        (timed if e.has(TIME) else fixed)[symbol] = e
    timed = {symbol: steady.apply(e) for symbol, e in timed.items()}
    constants = {**fixed, **{s: e for e, s in steady.table.items()}}
    rename = _number(list(constants), names.fresh("p")) | _number(list(timed), names.fresh("w"))
    inner = names.fresh("z")
    rhs = _share([e.xreplace(rename) for e in outputs[:size]], inner)
    linear = _share([e.xreplace(rename) for e in outputs], inner)
    local = _share([e.xreplace(rename) for e in outputs[: size + size * size]], inner)
    return NodeBlocks(
        constants=tuple((rename[s], e) for s, e in constants.items()),
        timed=tuple((rename[s], e.xreplace(rename)) for s, e in timed.items()),
        rhs=rhs,
        linear=linear,
        local=local,
    )


def _number(symbols: list[sp.Symbol], supply: Iterator[sp.Symbol]) -> dict[sp.Symbol, sp.Symbol]:
    """New names in one numbering for symbols that came from two tables."""
    return {symbol: next(supply) for symbol in symbols}


def _share(results: list[sp.Expr], supply: Iterator[sp.Symbol]) -> Body:
    statements, reduced = sp.cse(results, symbols=supply, order="canonical")
    return Body(tuple(statements), tuple(reduced))
