"""Jumps and kinks of expressions, at which Taylor series end and small deviations from an orbit jump."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping, Set
from functools import reduce

import sympy as sp
from sympy.core.relational import Relational
from sympy.functions.elementary.piecewise import Piecewise

from .calculus import derivative

JUMPING = (sp.sign, sp.floor, sp.ceiling, sp.Heaviside)
"""Functions that jump."""

KINKED = (sp.Abs, sp.Max, sp.Min)
"""Functions with a kink where an argument, or the difference of two, is zero."""

INEQUALITIES = (sp.StrictGreaterThan, sp.GreaterThan, sp.StrictLessThan, sp.LessThan)
"""Conditions such as lhs < rhs; the pieces on both sides can be compared at lhs = rhs."""

SIDES = {sp.sign: (sp.S.One, sp.S.NegativeOne), sp.Heaviside: (sp.S.One, sp.S.Zero)}
"""The values of a function above and below the zero of its argument."""


def gaps_of(part: sp.Basic) -> Iterator[sp.Expr]:
    """Yield expressions that pass zero where `part` jumps or has a kink."""
    if isinstance(part, Piecewise):
        yield from (gap for _, condition in part.args for r in condition.atoms(Relational) for gap in gaps_of(r))
    elif isinstance(part, Relational):
        yield part.lhs - part.rhs
    elif isinstance(part, sp.Max | sp.Min):
        yield from (a - b for a, b in itertools.combinations(part.args, 2))
    elif isinstance(part, sp.floor | sp.ceiling):
        yield sp.sin(sp.pi * part.args[0])
    else:
        yield part.args[0]


def jumps(expressions: Iterable[sp.Expr], moving: Set[sp.Symbol]) -> list[sp.Expr]:
    """Return the subexpressions that jump as the `moving` symbols change, in a fixed order.

    A `Piecewise` is left out if its pieces are proved to be equal where they meet.
    """
    parts = {part for e in expressions for part in e.atoms(*JUMPING, Piecewise) if part.free_symbols & moving}
    jumping = [part for part in parts if not (isinstance(part, Piecewise) and _joins(part, moving))]
    return sorted(jumping, key=sp.default_sort_key)


def discontinuity(expressions: Iterable[sp.Expr], moving: Set[sp.Symbol]) -> sp.Expr | None:
    """Return a subexpression that makes one of the expressions jump; None if all are proved to be continuous.

    A continuous expression may contain subexpressions that jump, such as sign(v) in sign(v)*v**2.
    """
    for e in expressions:
        for part in jumps([e], moving):
            argument, above, below = _sides(part)
            if argument is None or not _agree(e.xreplace({part: above}), e.xreplace({part: below}), argument, moving):
                return part
    return None


def _sides(part: sp.Expr) -> tuple[sp.Expr | None, sp.Expr, sp.Expr]:
    """Return the expression whose zero is the jump of a part, and the values of the part above and below the zero.

    The expression is None for a part without a single zero, such as a `Piecewise` with more than two pieces.
    """
    if isinstance(part, sp.Abs):
        return part.args[0], part.args[0], -part.args[0]
    if type(part) in SIDES:
        return part.args[0], *SIDES[type(part)]
    if isinstance(part, Piecewise) and len(part.args) == 2:
        (first, condition), (second, _) = part.args
        if isinstance(condition, INEQUALITIES):
            return condition.lhs - condition.rhs, first, second
    return None, part, part


def _joins(choice: Piecewise, moving: Set[sp.Symbol]) -> bool:
    """Return True if the pieces of a `Piecewise` are proved to be equal where they meet."""
    pieces = list(choice.args)
    for k, (piece, condition) in enumerate(pieces[:-1]):
        if not isinstance(condition, INEQUALITIES):
            return False
        if not _agree(piece, Piecewise(*pieces[k + 1 :]), condition.lhs - condition.rhs, moving):
            return False
    return bool(pieces[-1][1] == sp.true)


def _agree(one: sp.Expr, other: sp.Expr, gap: sp.Expr, moving: Set[sp.Symbol]) -> bool:
    """Return True if two expressions are proved to be equal where `gap` is zero."""
    # If the gap has kinks itself, prove the equality on both sides of each kink.
    gap = gap.replace(sp.Max, _larger).replace(sp.Min, _smaller)
    kink = min(
        (part for part in gap.atoms(sp.Abs) if part.free_symbols & moving), key=sp.default_sort_key, default=None
    )
    if kink is not None:
        (inner,) = kink.args
        sides = ({kink: sign * inner, sp.sign(inner): sign} for sign in (sp.S.One, sp.S.NegativeOne))
        return all(_agree(one.xreplace(side), other.xreplace(side), gap.xreplace(side), moving) for side in sides)
    # Solve gap = 0 for a symbol that occurs linearly, and insert the solution into the difference.
    slopes = ((s, gap.diff(s)) for s in sorted(gap.free_symbols & moving, key=str))
    at = next((s for s, slope in slopes if slope != 0 and not slope.free_symbols & moving), None)
    return at is not None and bool(sp.simplify((one - other).subs(at, sp.solve(gap, at)[0])) == 0)


def rough_at(e: sp.Expr, point: Mapping[sp.Symbol, sp.Expr], symbols: Iterable[sp.Symbol]) -> sp.Expr | None:
    """Return a subexpression that makes `e`, or a derivative of `e` by `symbols`, jump at a point; else None."""
    e, symbols = e.replace(sp.Max, _larger).replace(sp.Min, _smaller), tuple(symbols)
    for part in sorted(e.atoms(sp.Abs, *SIDES, Piecewise), key=sp.default_sort_key):
        argument, above, below = _sides(part)
        if argument is None or sp.expand(argument.xreplace(point)) != 0:
            continue
        # Compare the expression and its derivatives for the two values of the part beside its jump.
        sides = [e.xreplace({part: value}) for value in (above, below)]
        slopes = [[side, *(derivative(side, s) for s in symbols)] for side in sides]
        if any(sp.simplify((one - other).xreplace(point)) != 0 for one, other in zip(*slopes, strict=True)):
            return part
    return None


def _larger(*values: sp.Expr) -> sp.Expr:
    return reduce(lambda a, b: (a + b + sp.Abs(a - b)) / 2, values)


def _smaller(*values: sp.Expr) -> sp.Expr:
    return -_larger(*(-value for value in values))
