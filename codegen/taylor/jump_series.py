"""Replace each jump in an expression by a choice between series according to the sign of a gap.

Between jumps the solution is analytic.  A step therefore uses the series of one side, and ends where the gap passes
zero (`event_location`).
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence, Set

import sympy as sp
from sympy.functions.elementary.piecewise import ExprCondPair, Piecewise

from synchain.models.mechanics.jumps import INEQUALITIES, jumps

RISING, STRICT = (sp.StrictGreaterThan, sp.GreaterThan), (sp.StrictGreaterThan, sp.StrictLessThan)


class Jump(sp.Function):
    """Jump(gap, above, at, below): `above` for gap > 0, `at` for gap = 0, `below` for gap < 0."""

    nargs = 4
    is_extended_real = True


def with_jumps(expressions: Iterable[sp.Expr], moving: Set[sp.Symbol]) -> list[sp.Expr]:
    """Return the expressions with jumps replaced by `Jump` or sp.floor; leave jumps that no step can pass."""
    old = list(expressions)
    parts = {part for part in jumps(old, moving) if decided_by_gaps(part)}
    return [_with_jumps(e, parts) for e in old] if parts else old


def decided_by_gaps(part: sp.Expr) -> bool:
    """Return False for a choice whose conditions are not all inequalities, or that may have no value."""
    if not isinstance(part, Piecewise):
        return True
    *conditions, last = (condition for _, condition in part.args)
    return last == sp.true and all(isinstance(condition, INEQUALITIES) for condition in conditions)


def _with_jumps(e: sp.Basic, parts: Collection[sp.Expr]) -> sp.Basic:
    """Return an expression with the jumps in `parts` replaced, inner jumps first."""
    if not e.args:
        return e
    inner = [_with_jumps(a, parts) for a in e.args]
    if e not in parts or isinstance(e, sp.floor):
        return e.func(*inner)
    if isinstance(e, Piecewise):
        return _choice(inner)
    if isinstance(e, sp.ceiling):
        return -sp.floor(-inner[0])
    at, below = (sp.S.Zero, sp.S.NegativeOne) if isinstance(e, sp.sign) else (inner[1], sp.S.Zero)
    return Jump(inner[0], sp.S.One, at, below)


def _choice(pieces: Sequence[ExprCondPair]) -> sp.Expr:
    """Return a choice between pieces as nested jumps; the first condition is the outermost jump."""
    (piece, condition), *others = pieces
    if condition == sp.true:
        return piece
    otherwise = _choice(others)
    above, below = (piece, otherwise) if isinstance(condition, RISING) else (otherwise, piece)
    at = otherwise if isinstance(condition, STRICT) else piece
    return Jump(condition.lhs - condition.rhs, above, at, below)
