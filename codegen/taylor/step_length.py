"""How long a Taylor step may be.

A series whose last coefficients have size s_k, in units of the error that it may have, reaches s_k**(-1/k) of `scale`: there
its term of order k is as large as that error.  This is the step length of A. Jorba & M. Zou, Experimental Mathematics 14, 99
(2005), section 3.2, from the last three coefficients instead of two, because series with zeros at every second or third
place would pass for exact ones.

Three more limits follow: no step is longer than FARTHEST times the `scale` of its coefficients; none goes behind the place
where the terms of a watched series stop falling (`unseen`); none goes on to where an exponential rises that is zero in
double precision now (`distant`).
"""

from __future__ import annotations

from collections.abc import Sequence

from ..program.expressions import ZERO, Call, Compare, Conditional, Expression, Junction, Name, Negation, Number, call
from ..program.statements import If, Statement, let
from .simplify import absolute, add, extreme, largest, times

FARTHEST = 16.0
"""The longest step, in units of `scale`; a choice."""

NEXT = 2.0
"""The longest step where series are watched, so that a series that is zero in double precision now is seen when it begins.

Contacts end their slips by events: the first steps behind one would be a third of all steps.
"""

LOW = (1, 2, 3)
"""The low orders with which high ones are compared, beside the last one below half the highest.

The series of x' = v, v' = -x**n from x = 0 has its coefficients n + 1 orders apart: of those of x**n, n or 2 n + 1 is high.
"""

HIDDEN, LOST = 1e-9, 1e-110
"""Least size of the low coefficients of a series, as shares of the high ones and of the absolute tolerance; choices.

The first is for zeros of the low ones alone, the second for zeros of high order, which no step would reach otherwise.
"""

REMOTE, NEARER = 230.0, 100.0
"""Exponentials of less than -REMOTE (1e-100) are in no coefficient; least rise of the exponent in a step from there."""

SEEN = let("unseen", 0.0 * Name("scale"))
"""The initial value of `unseen`."""


def last_orders(order: int) -> tuple[int, int, int]:
    """Return the orders whose coefficients decide how far a series reaches."""
    return order, order - 1, order - 2


def reach(orders: Sequence[int]) -> Expression:
    """Return the logarithm of the share of `scale` that a step may go, from `size_…` of some orders."""
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
    return [
        let("high", largest(high)),
        let("low", largest(low)),
        let("unseen", call("maximum", "unseen", Name("high") / (Name("low") + least))),
    ]


def bounded(coefficients: Sequence[Expression]) -> list[Statement]:
    """Return the statements for `way`; way * ratio bounds the change of a series within a step.

    `coefficients` are those of order 1 and more: way = |c_1| + |c_2| ratio + … by Horner's rule.
    """
    sizes = [absolute(e) if e != ZERO else e for e in coefficients]
    while sizes and sizes[-1] == ZERO:
        sizes.pop()
    statements = list[Statement]()
    for e in reversed(sizes):
        statements.append(let("way", add(e, times(Name("way"), Name("ratio"))) if statements else e))
    return statements


def distant(start: Expression, coefficients: Sequence[Expression]) -> list[Statement]:
    """Return the statements that end a step before an exponential rises which is far too small to be seen.

    It is zero to every digit, with all its coefficients; its exponent, `start` and `coefficients` from order 1 on, tells
    where it rises.
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
    """Return the statements for `length` and `ratio` from `reach`, the logarithm of the step's share of `scale`."""
    falling = call("minimum", *(times(Number(-1.0 / k), call("log", "unseen")) for k in (order - 2, order // 2)))
    farthest = NEXT if watched and not contacts else FARTHEST
    far = call("truncated", Name("scale") * call("exp", "reach"))
    return [
        *([let("reach", call("minimum", "reach", falling))] if watched else []),
        # weights are those of a step as long as `scale`; a shorter one changes the states less
        let("reach", call("minimum", "reach", (order - 2) / (order - 4) * Name("reach"))),
        let("length", call("minimum", far, farthest * Name("scale"))),
        let("length", call("minimum", "length", "h")),
        let("ratio", Name("length") / "scale"),
    ]
