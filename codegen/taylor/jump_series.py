"""Jumps that Taylor steps pass: of functions of time and of states whose own rates do not jump."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence, Set

import sympy as sp
from sympy.functions.elementary.piecewise import ExprCondPair, Piecewise

from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME
from synchain.models.mechanics.jumps import INEQUALITIES, gaps_of, jumps

RISING, STRICT = (sp.StrictGreaterThan, sp.GreaterThan), (sp.StrictGreaterThan, sp.StrictLessThan)


class Jump(sp.Function):
    """Leap(gap, above, at, below): one of three values by the sign of a gap, which do not agree at zero."""

    nargs = 4
    is_extended_real = True


def templates(equations: Equations) -> Iterator[tuple[Sequence[sp.Expr], tuple[tuple[sp.Symbol, ...], ...]]]:
    """Right-hand sides and masses of each kind of node and link, and its states, at each end."""
    for node in equations.nodes:
        yield (*node.rhs, *(e for row in node.inertia for e in row)), (node.state,)
    for edge in equations.edges:
        yield edge.expressions, (edge.here, edge.there)


def changing(ends: Iterable[Iterable[sp.Symbol]]) -> set[sp.Symbol]:
    """What moves within a step: time, and the states at each end."""
    return {TIME, *(s for end in ends for s in end)}


def unpassed(equations: Equations) -> Iterator[sp.Expr]:
    """Yield the parts of some equations with a jump that no Taylor step passes.

    Motion can slide along a jump that enters the rate of what it depends on: sign(v) in the rate of v, not in that of x.
    Contacts take the loads of bodies that stick as continuous, and the solution of a mass matrix jumps as a whole.
    """
    known = [(own, ends, jumps(own, changing(ends))) for own, ends in templates(equations)]
    jumping = {c for own, ends, parts in known for c in range(len(ends[0])) if own[c].has(*parts)}
    for _, ends, parts in known:
        for part in parts:
            gaps = list(gaps_of(part))
            depends = {c for end in ends for c, s in enumerate(end) if any(gap.has(s) for gap in gaps)}
            if not _passable(part) or depends & jumping or equations.sticks or equations.inertial:
                yield part


def leaping(expressions: Iterable[sp.Expr], moving: Set[sp.Symbol]) -> list[sp.Expr]:
    """Some expressions with their jumps as `Jump` or sp.floor, parts that no step passes as they are."""
    given = list(expressions)
    parts = {part for part in jumps(given, moving) if _passable(part)}
    return [_leaping(e, parts) for e in given] if parts else given


def _leaping(e: sp.Basic, parts: Collection[sp.Expr]) -> sp.Basic:
    if not e.args:
        return e
    inner = [_leaping(a, parts) for a in e.args]
    if e not in parts or isinstance(e, sp.floor):
        return e.func(*inner)
    if isinstance(e, Piecewise):
        return _choice(inner)
    if isinstance(e, sp.ceiling):
        return -sp.floor(-inner[0])
    at, below = (sp.S.Zero, sp.S.NegativeOne) if isinstance(e, sp.sign) else (inner[1], sp.S.Zero)
    return Jump(inner[0], sp.S.One, at, below)


def _choice(pieces: Sequence[ExprCondPair]) -> sp.Expr:
    """One piece of several by the signs of their gaps."""
    (piece, condition), *others = pieces
    if condition == sp.true:
        return piece
    rest = _choice(others)
    above, below = (piece, rest) if isinstance(condition, RISING) else (rest, piece)
    return Jump(condition.lhs - condition.rhs, above, rest if isinstance(condition, STRICT) else piece, below)


def _passable(part: sp.Expr) -> bool:
    """False for a choice that is not made by inequalities alone, or that may have no value."""
    if not isinstance(part, Piecewise):
        return True
    *conditions, last = (condition for _, condition in part.args)
    return last == sp.true and all(isinstance(condition, INEQUALITIES) for condition in conditions)
