"""Sparse Gaussian elimination of (s - J), planned from the pattern of J and written out as statements.

The plan picks pivots on the diagonal by least fill (Markowitz, Management Science 3, 255, 1957), so positions of a
mechanical network are eliminated before velocities, a chain or any tree causes no fill, and a ring or a star costs
what it must.  No numerical pivoting: s is chosen by the step control, and a bad pivot shows up as a rejected step.
An infinite pivot, as of sqrt(x) at 0, would make the step and its error 0; its inverse is NaN, and so the error is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import sympy as sp

from ..program.expressions import ONE, ZERO, Expression, Name, Negation, Product, negative, plus
from ..program.lowering import lower
from ..program.statements import Statement, let

Entry = tuple[int, int]
Entries = dict[Entry, sp.Expr]


@dataclass(frozen=True, slots=True)
class EliminationPlan:
    """Elimination order with, for each pivot, the rows below it and the columns after it in its row."""

    order: tuple[int, ...]
    below: tuple[tuple[int, ...], ...]
    after: tuple[tuple[int, ...], ...]


def plan(size: int, pattern: set[Entry]) -> EliminationPlan:
    """Order the pivots 0 … size-1 and list the fill.

    Two orders are tried, by least Markowitz cost from the start or after all rows without a diagonal entry of J, whose
    pivots need no division; the one with fewer multiplications is taken, the second where they are equal.
    """
    first = frozenset(k for k in range(size) if (k, k) not in pattern)
    return min((_order(size, pattern, first), _order(size, pattern, frozenset())), key=_multiplications)


def _multiplications(steps: EliminationPlan) -> int:
    """Cost of one factorisation and eight solves."""
    pairs = list(zip(steps.below, steps.after, strict=True))
    return sum(len(b) * (1 + len(a)) for b, a in pairs) + 8 * sum(1 + len(b) + len(a) for b, a in pairs)


def _order(size: int, pattern: set[Entry], first: frozenset[int]) -> EliminationPlan:
    rows = {i: {i} | {c for r, c in pattern if r == i} for i in range(size)}
    columns = {i: {i} | {r for r, c in pattern if c == i} for i in range(size)}
    left = set(range(size))
    order, below, after = [], [], []
    while left:
        pivot = min(left, key=lambda k: (k not in first, (len(rows[k]) - 1) * (len(columns[k]) - 1), k))
        left.remove(pivot)
        down, right = sorted(columns[pivot] - {pivot}), sorted(rows[pivot] - {pivot})
        for r in down:
            rows[r] |= set(right)
            rows[r].discard(pivot)
        for c in right:
            columns[c] |= set(down)
            columns[c].discard(pivot)
        order.append(pivot)
        below.append(tuple(down))
        after.append(tuple(right))
    return EliminationPlan(tuple(order), tuple(below), tuple(after))


class _FactorWriter:
    """Statements of the factors; equal right-hand sides share one name."""

    def __init__(self, labels: tuple[str, ...]) -> None:
        self.labels = labels
        self.statements: list[Statement] = []
        self.names: dict[Expression, Name] = {}

    def let(self, name: str, e: Expression) -> Name:
        if e not in self.names:
            self.names[e] = Name(name)
            self.statements.append(let(name, e))
        return self.names[e]

    def entry(self, kind: str, r: int, c: int) -> str:
        return f"{kind}_{self.labels[r]}" if r == c else f"{kind}_{self.labels[r]}_{self.labels[c]}"

    def inverse(self, k: int, e: Expression) -> Name:
        """The inverse of a pivot, NaN of an infinite one."""
        pivot = self.let(self.entry("pivot", k, k), e)
        return self.let(self.entry("inv", k, k), 1.0 / pivot + 0.0 * pivot)

    def atomic(self, name: str, e: Expression) -> Expression:
        """A name for an entry, or itself where that is a unit or already a name."""
        return e if e in (ONE, negative(ONE)) or isinstance(e, Name) else self.let(name, e)


@dataclass(frozen=True, slots=True)
class Factors:
    """Statements that factorise, and the names (or 1.0, -1.0) that the solution uses."""

    statements: tuple[Statement, ...]
    lower: dict[Entry, Expression]
    upper: dict[Entry, Expression]
    inverse: dict[int, Expression]


def write_factors(
    steps: EliminationPlan,
    jacobian: Mapping[Entry, sp.Expr],
    labels: tuple[str, ...],
    mass: Mapping[Entry, sp.Expr] | None = None,
) -> Factors:
    """Write the elimination of (shift M - J), `mass` the entries of M, None or empty where it is the identity.

    `reach` is 1/shift, the inverse of the pivot shift where J has no diagonal entry.
    """
    shift = sp.Symbol("shift")
    scaled = {(k, k): shift for k in steps.order} if not mass else {key: shift * e for key, e in mass.items()}
    return write_elimination(steps, scaled, jacobian, labels)


def write_elimination(
    steps: EliminationPlan, matrix: Mapping[Entry, sp.Expr], taken: Mapping[Entry, sp.Expr], labels: tuple[str, ...]
) -> Factors:
    """Write the elimination of `matrix` minus `taken`; a symmetric matrix alone takes half the operations, L D L^T."""
    writer = _FactorWriter(labels)
    entries = {key: lower(matrix.get(key, sp.S.Zero) - taken.get(key, sp.S.Zero)) for key in sorted({*matrix, *taken})}
    value = {
        key: writer.atomic(writer.entry("m", *key), e) for key, e in entries.items() if key[0] != key[1] and e != ZERO
    }
    symmetric = not taken and all(entries.get((c, r), ZERO) == e for (r, c), e in entries.items())
    diagonal = {k: entries[k, k] for k in steps.order}
    below: dict[Entry, Expression] = {}
    inverse: dict[int, Expression] = {}
    for k, down, right in zip(steps.order, steps.below, steps.after, strict=True):
        pivot = diagonal[k]
        inverse[k] = Name("reach") if pivot == Name("shift") else writer.inverse(k, pivot)
        for r in down:
            below[r, k] = writer.let(writer.entry("l", r, k), times(value[r, k], inverse[k]))
            for c in right:
                old = diagonal[r] if r == c else value.get((r, c))
                new = less(old, below[r, k], value[k, c])
                if r == c:
                    diagonal[r] = new
                elif symmetric and c < r:
                    value[r, c] = value[c, r]
                else:
                    value[r, c] = writer.let(writer.entry("m", r, c) + f"_{k}", new)
    upper = {(k, c): value[k, c] for k, right in zip(steps.order, steps.after, strict=True) for c in right}
    return Factors(tuple(writer.statements), below, upper, inverse)


def write_solve(
    steps: EliminationPlan, factors: Factors, right: Mapping[int, str], result: Mapping[int, str]
) -> list[Statement]:
    """Write the solution: names `right` of the right-hand sides are overwritten, `result` names the unknowns."""
    found: list[Statement] = []
    for k, down in zip(steps.order, steps.below, strict=True):
        found += [let(right[r], less(Name(right[r]), factors.lower[r, k], Name(right[k]))) for r in down]
    for k, after in zip(reversed(steps.order), reversed(steps.after), strict=True):
        rest: Expression = Name(right[k])
        for c in after:
            rest = less(rest, factors.upper[k, c], Name(result[c]))
        found.append(let(result[k], Product((rest, factors.inverse[k]))))
    return found


def times(x: Expression, y: Expression) -> Expression:
    """x*y with signs and unit factors folded."""
    for one, other in ((x, y), (y, x)):
        if one == ONE:
            return other
        if one == negative(ONE):
            return negative(other)
    if isinstance(x, Negation):
        return negative(times(x.value, y))
    return x * y


def less(start: Expression | None, x: Expression, y: Expression) -> Expression:
    """start - x*y, tidied; without a start -x*y."""
    change = negative(times(x, y))
    return change if start is None else plus(start, change)
