"""Passes over expressions before they are lowered: names, common subexpressions, what need not be computed again.

Repeated subexpressions get numbered names that cannot collide with the user's symbols.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import sympy as sp
from sympy.functions.elementary.piecewise import ExprCondPair


def real(name: str) -> sp.Symbol:
    """Return the symbol of that name that models have."""
    return sp.Symbol(name, real=True)


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
                yield real(name)


@dataclass
class Hoist:
    """Replaces maximal subexpressions that are free of `moving` symbols by names; equal ones share a name."""

    moving: frozenset[sp.Symbol]
    supply: Iterator[sp.Symbol]
    renamed: frozenset[sp.Symbol] = frozenset()
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
        """The symbol that stands for a fixed expression; a bare symbol gets one only if it is `renamed`."""
        if e.is_Symbol and e not in self.renamed:
            return e
        if e.could_extract_minus_sign() and e.is_Mul:
            return -self.name(-e)
        if e not in self.table:
            self.table[e] = next(self.supply)
        return self.table[e]


@dataclass(frozen=True, slots=True)
class StraightLine:
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


def share(results: Sequence[sp.Expr], supply: Iterator[sp.Symbol]) -> StraightLine:
    """Return the results with their common subexpressions computed once."""
    statements, reduced = sp.cse(list(results), symbols=supply, order="canonical")
    return StraightLine(tuple(statements), tuple(reduced))
