"""Passes over SymPy expressions before lowering: `Hoist` names fixed parts, `share` names common subexpressions.

A fixed part need not be computed again in each loop turn. `Names` supplies numbered names that are not in use.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import sympy as sp
from sympy.functions.elementary.piecewise import ExprCondPair


def real(name: str) -> sp.Symbol:
    """Return the real symbol of this name; all symbols of models are real."""
    return sp.Symbol(name, real=True)


class Names:
    """Symbols ``prefix0, prefix1, …`` that avoid names already taken."""

    def __init__(self, taken: Iterable[str]) -> None:
        self.taken = set(taken)

    def fresh(self, prefix: str) -> Iterator[sp.Symbol]:
        """Yield unused symbols with this prefix, without end."""
        number = 0
        while True:
            name = f"{prefix}{number}"
            number += 1
            if name not in self.taken:
                self.taken.add(name)
                yield real(name)


@dataclass
class Hoist:
    """Replace each largest subexpression without `moving` symbols by a name; equal subexpressions share a name."""

    # table: the name of each replaced expression. A single symbol is replaced only if it is in `renamed`.

    moving: frozenset[sp.Symbol]
    supply: Iterator[sp.Symbol]
    renamed: frozenset[sp.Symbol] = frozenset()
    table: dict[sp.Expr, sp.Symbol] = field(default_factory=dict)

    def apply(self, e: sp.Expr) -> sp.Expr:
        """Return the expression with all fixed parts replaced by names."""
        if not e.free_symbols:
            return e
        if isinstance(e, ExprCondPair):  # a branch of a Piecewise is no value by itself
            return e.func(*(self.apply(a) for a in e.args))
        if e.is_Symbol:
            return e if e in self.moving else self.name(e)
        if not e.free_symbols & self.moving:
            return self.name(e)
        if e.is_Add or e.is_Mul:
            # give all fixed terms (or factors) together one name; leave plain numbers
            fixed = e.func(*(a for a in e.args if not a.free_symbols & self.moving))
            others = [self.apply(a) for a in e.args if a.free_symbols & self.moving]
            return e.func(self.name(fixed) if fixed.free_symbols else fixed, *others)
        return e.func(*(self.apply(a) for a in e.args))

    def name(self, e: sp.Expr) -> sp.Expr:
        """Return the symbol for a fixed expression; e and -e share one symbol."""
        if e.is_Symbol and e not in self.renamed:
            return e
        if e.could_extract_minus_sign() and e.is_Mul:
            return -self.name(-e)
        if e not in self.table:
            self.table[e] = next(self.supply)
        return self.table[e]


@dataclass(frozen=True, slots=True)
class StraightLine:
    """A sequence of assignments, and the result expressions, which may use the assigned symbols."""

    statements: tuple[tuple[sp.Symbol, sp.Expr], ...]
    results: tuple[sp.Expr, ...]

    @property
    def symbols(self) -> set[sp.Symbol]:
        """The symbols that are read but not assigned."""
        expressions = [*self.results, *(e for _, e in self.statements)]
        used: set[sp.Symbol] = set().union(*(e.free_symbols for e in expressions))
        return used - {s for s, _ in self.statements}

    def at(self, values: Mapping[sp.Symbol, sp.Expr]) -> StraightLine:
        """Return the same line with other expressions in place of symbols that it reads."""
        swap = dict(values)
        return StraightLine(
            tuple((s, e.xreplace(swap)) for s, e in self.statements), tuple(e.xreplace(swap) for e in self.results)
        )


def share(results: Sequence[sp.Expr], supply: Iterator[sp.Symbol]) -> StraightLine:
    """Return the results with their common subexpressions computed once."""
    statements, reduced = sp.cse(list(results), symbols=supply, order="canonical")
    return StraightLine(tuple(statements), tuple(reduced))
