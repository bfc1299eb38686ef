"""Sparse Gaussian elimination of (shift M - J), planned from the pattern of J and written out as statements.

    pattern ─plan─▶ EliminationPlan;  entries ─write_factors─▶ Factors;  right-hand side ─write_solve─▶ statements

The plan picks diagonal pivots by least fill (Markowitz, Management Science 3, 255, 1957). Positions of a mechanical
network are therefore eliminated before velocities, and a chain or any other tree causes no fill. Pivots are never
exchanged by size: a bad pivot gives a large error, and step control rejects the step and changes the shift. An infinite
pivot, such as that of sqrt(x) at 0, would make the step and its error 0. The inverse of an infinite pivot is therefore
NaN, which makes the error NaN.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import sympy as sp

from ..program.expressions import ONE, ZERO, Expression, Name, Negation, ProductExpr, negative, plus
from ..program.lowering import lower
from ..program.statements import Statement, let

Entry = tuple[int, int]  # row and column of an entry of a matrix

Entries = dict[Entry, sp.Expr]

SOLVES = 8  # number of solves per factorisation that the cost of a plan assumes: the stages of rodas5p


@dataclass(frozen=True, slots=True)
class EliminationPlan:
    """The order of the pivots; for each pivot, the rows it is eliminated from and the later columns in its row."""

    order: tuple[int, ...]
    below: tuple[tuple[int, ...], ...]
    after: tuple[tuple[int, ...], ...]

    @property
    def multiplications(self) -> int:
        """Number of multiplications of one factorisation and SOLVES solutions."""
        pairs = list(zip(self.below, self.after, strict=True))
        return sum(len(b) * (1 + len(a)) for b, a in pairs) + SOLVES * sum(1 + len(b) + len(a) for b, a in pairs)


def plan(size: int, pattern: set[Entry]) -> EliminationPlan:
    """Order the pivots 0 … size-1 by least Markowitz cost and list the fill."""
    # A second candidate begins with the rows without a diagonal entry of J, because their pivots need no division. The
    # second candidate is returned unless it costs more.
    first = frozenset(k for k in range(size) if (k, k) not in pattern)
    plans = (_ordered(size, pattern, first), _ordered(size, pattern, frozenset()))
    return min(plans, key=lambda each: each.multiplications)


def _ordered(size: int, pattern: set[Entry], first: frozenset[int]) -> EliminationPlan:
    """Order the pivots, those in `first` before others."""
    rows = {i: {i} | {c for r, c in pattern if r == i} for i in range(size)}
    columns = {i: {i} | {r for r, c in pattern if c == i} for i in range(size)}
    remaining = set(range(size))
    order, below, after = [], [], []
    while remaining:
        pivot = min(remaining, key=lambda k: (k not in first, (len(rows[k]) - 1) * (len(columns[k]) - 1), k))
        remaining.remove(pivot)
        down, right = sorted(columns[pivot] - {pivot}), sorted(rows[pivot] - {pivot})
        # elimination adds the entries of the pivot's row to each row below: fill
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


@dataclass(frozen=True, slots=True)
class Factors:
    """The statements of a factorisation, and the factors: names, or the numbers 1.0 and -1.0."""

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
    """Write the elimination of (shift M - J). `mass` holds the entries of M; None or empty stands for the identity."""
    shift = sp.Symbol("shift")
    scaled = {(k, k): shift for k in steps.order} if not mass else {key: shift * e for key, e in mass.items()}
    return write_elimination(steps, scaled, jacobian, labels)


def write_elimination(
    steps: EliminationPlan,
    matrix: Mapping[Entry, sp.Expr],
    subtracted: Mapping[Entry, sp.Expr],
    labels: tuple[str, ...],
) -> Factors:
    """Write the elimination of `matrix` - `subtracted`, L D L^T if `symmetric`, which halves the operations."""
    statements: list[Statement] = []
    names: dict[Expression, Name] = {}

    def assign(name: str, e: Expression) -> Name:
        # equal nodes give equal expressions: they share one name
        if e not in names:
            names[e] = Name(name)
            statements.append(let(name, e))
        return names[e]

    def label(kind: str, r: int, c: int) -> str:
        return f"{kind}_{labels[r]}" if r == c else f"{kind}_{labels[r]}_{labels[c]}"

    both = sorted({*matrix, *subtracted})
    entries = {key: lower(matrix.get(key, sp.S.Zero) - subtracted.get(key, sp.S.Zero)) for key in both}
    symmetric = not subtracted and all(entries.get((c, r), ZERO) == e for (r, c), e in entries.items())
    diagonal = {k: entries[k, k] for k in steps.order}
    # give each off-diagonal entry a name, unless it is a unit or a name already
    value: dict[Entry, Expression] = {}
    for key, e in entries.items():
        if key[0] != key[1] and e != ZERO:
            value[key] = e if e in (ONE, negative(ONE)) or isinstance(e, Name) else assign(label("m", *key), e)
    below: dict[Entry, Expression] = {}
    inverse: dict[int, Expression] = {}
    for k, down, right in zip(steps.order, steps.below, steps.after, strict=True):
        if diagonal[k] == Name("shift"):
            inverse[k] = Name("reach")  # 1/shift, computed at the start of the step
        else:
            pivot = assign(label("pivot", k, k), diagonal[k])
            inverse[k] = assign(label("inv", k, k), 1.0 / pivot + 0.0 * pivot)  # NaN if the pivot is infinite
        for r in down:
            below[r, k] = assign(label("l", r, k), times(value[r, k], inverse[k]))
            for c in right:
                new = less(diagonal[r] if r == c else value.get((r, c)), below[r, k], value[k, c])
                if r == c:
                    diagonal[r] = new
                elif symmetric and c < r:
                    value[r, c] = value[c, r]
                else:
                    value[r, c] = assign(label("m", r, c) + f"_{k}", new)
    upper = {(k, c): value[k, c] for k, right in zip(steps.order, steps.after, strict=True) for c in right}
    return Factors(tuple(statements), below, upper, inverse)


def write_solve(
    steps: EliminationPlan, factors: Factors, right: Mapping[int, str], result: Mapping[int, str]
) -> list[Statement]:
    """Write the solution. The right-hand sides (variables `right`) are overwritten; `result` names the unknowns."""
    statements: list[Statement] = []
    for k, down in zip(steps.order, steps.below, strict=True):
        statements += [let(right[r], less(Name(right[r]), factors.lower[r, k], Name(right[k]))) for r in down]
    for k, after in zip(reversed(steps.order), reversed(steps.after), strict=True):
        value: Expression = Name(right[k])
        for c in after:
            value = less(value, factors.upper[k, c], Name(result[c]))
        statements.append(let(result[k], ProductExpr((value, factors.inverse[k]))))
    return statements


def times(x: Expression, y: Expression) -> Expression:
    """Return x*y with signs and unit factors folded."""
    for one, other in ((x, y), (y, x)):
        if one == ONE:
            return other
        if one == negative(ONE):
            return negative(other)
    if isinstance(x, Negation):
        return negative(times(x.value, y))
    return x * y


def less(start: Expression | None, x: Expression, y: Expression) -> Expression:
    """Return start - x*y with signs and unit factors folded; return -x*y if `start` is None."""
    change = negative(times(x, y))
    return change if start is None else plus(start, change)
