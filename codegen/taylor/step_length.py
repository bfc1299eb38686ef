"""Compute the length of a Taylor step.

Let s_k be the size of coefficient k of a series in units of the allowed error.  After s_k**(-1/k) times `scale`, the
term of order k is as large as the allowed error, so the step must end there.  This is the step length of A. Jorba & M.
Zou, Experimental Mathematics 14, 99 (2005), section 3.2.  Here the last three coefficients are used instead of the last
two: a series in which every second or third coefficient is zero would seem exact otherwise.

Three further limits hold.  No step is longer than FARTHEST times `scale`.  No step goes beyond the point where the
terms of a watched series stop decreasing (`unseen`).  No step goes beyond the point where an exponential rises that is
zero in double precision now (`distant`).
"""

from __future__ import annotations

from collections.abc import Sequence

from ..program.expressions import ZERO, Call, Compare, Conditional, Expression, Junction, Name, Negation, Number, call
from ..program.statements import If, Statement, let
from .simplify import absolute, add, extreme, largest, times

FARTHEST = 16.0
"""The longest step, in units of `scale`; a choice."""

NEXT = 2.0
"""The longest step with watched series, in units of `scale`: a series that is zero in double precision now appears in
time.

Equations with contacts are exempt: events end each slip, and short first steps would be a third of all steps.
"""

LOW = (1, 2, 3)
"""The low orders; high orders are compared with these, and with the last order below half of the highest.

Example: for x' = v, v' = -x**n from x = 0, the nonzero coefficients are n + 1 orders apart, so that of the coefficients
of x**n, order n or order 2 n + 1 is a high order.
"""

HIDDEN, LOST = 1e-9, 1e-110
"""Least size of the low coefficients: HIDDEN times the high coefficients, plus LOST times the absolute tolerance;
choices.

HIDDEN applies if only the low coefficients vanish.  LOST applies at zeros of high order, which no step would reach
without LOST.
"""

NOISE = 1e-13
"""High coefficients below this part of the first one, with low ones below this part of them, are rounding errors; a
choice."""

REMOTE, NEARER = 230.0, 100.0
"""REMOTE: exponentials below exp(-REMOTE) = 1e-100 affect no coefficient.  NEARER: a step may always raise them by
this.

Both are exponents.
"""

SEEN = let("unseen", 0.0 * Name("scale"))
"""Sets `unseen` to zero at the beginning of a step."""


def last_orders(order: int) -> tuple[int, int, int]:
    """Return the three orders whose coefficients determine the step length."""
    return order, order - 1, order - 2


def reach(orders: Sequence[int]) -> Expression:
    """Return the logarithm of (step length)/scale, computed from the variables `size_…` of some orders."""
    return extreme("minimum", [times(Number(-1.0 / k), Call("log", (Name(f"size_{k}"),))) for k in orders])


def unseen(coefficients: Sequence[Expression]) -> list[Statement]:
    """Return the statements that raise `unseen` to the ratio of the high coefficients of a series to its low ones."""
    half = len(coefficients) // 2
    low, high = (
        [absolute(e) for k in orders if (e := coefficients[k]) != ZERO]
        for orders in ((*LOW, half - 1), range(half, len(coefficients)))
    )
    if not (low and high):
        return []
    least = HIDDEN * Name("high") + LOST * Name("atol")
    statements = [let("high", largest(high)), let("low", largest(low))]
    if (first := coefficients[0]) != ZERO:
        # a series that is constant to rounding, as the radius of a circle, would shorten step after step
        bound = call(
            "minimum", NOISE * absolute(first) + Negation(Name("high")), NOISE * Name("high") + Negation(Name("low"))
        )
        cut = call("select", Compare(">", bound, Number(0.0)), 0.0 * Name("high"), Name("high"))
        statements.append(let("high", cut))
    return [*statements, let("unseen", call("maximum", "unseen", Name("high") / (Name("low") + least)))]


def bounded(coefficients: Sequence[Expression]) -> list[Statement]:
    """Return the statements that compute `way`; way * ratio bounds the change of a series within a step.

    `coefficients` begin with order 1: way = |c_1| + |c_2| ratio + … by Horner's rule.
    """
    sizes = [absolute(e) if e != ZERO else e for e in coefficients]
    while sizes and sizes[-1] == ZERO:
        sizes.pop()
    statements = list[Statement]()
    for e in reversed(sizes):
        statements.append(let("way", add(e, times(Name("way"), Name("ratio"))) if statements else e))
    return statements


def distant(start: Expression, coefficients: Sequence[Expression]) -> list[Statement]:
    """Return the statements that end a step before an exponential rises that is zero in double precision now.

    All coefficients of the exponential are zero too.  The series of the exponent shows where the exponential rises:
    `start` is its coefficient 0, `coefficients` are those from order 1 on.
    """
    bound = bounded(coefficients)
    if not bound:
        return []
    remote, far = Compare("<", start, Number(-REMOTE)), Compare(">", Name("way"), Name("room"))
    shorter = call("truncated", Name("length") * (Name("room") / "way"))
    inner = (
        *bound,
        let("way", Name("way") * "ratio"),
        let("room", call("maximum", Number(-REMOTE) + Negation(start), Number(NEARER))),
        let("length", Conditional(Junction("and", (remote, far)), shorter, Name("length"))),
        let("ratio", Name("length") / "scale"),
    )
    return [If(call("any_lane", remote), inner)]


def finished(order: int, watched: bool, contacts: bool) -> list[Statement]:
    """Return the statements that compute `ratio` = exp(reach), the share of `scale`, and the step's `length`."""
    falling = call("minimum", *(times(Number(-1.0 / k), call("log", "unseen")) for k in (order - 2, order // 2)))
    farthest = NEXT if watched and not contacts else FARTHEST
    far = call("truncated", Name("scale") * call("exp", "reach"))
    return [
        *([let("reach", call("minimum", "reach", falling))] if watched else []),
        # weights hold for a step of length `scale`; in a shorter step the states change less
        let("reach", call("minimum", "reach", (order - 2) / (order - 4) * Name("reach"))),
        let("length", call("minimum", far, farthest * Name("scale"))),
        let("length", call("minimum", "length", "h")),
        let("ratio", Name("length") / "scale"),
    ]
