"""How long a Taylor step may be: the statements that follow those of the sizes of the last coefficients.

The step length is that of A. Jorba & M. Zou, Experimental Mathematics 14, 99 (2005), section 3.2, from the last three
coefficients, so that no series that has zeros at every second or third place is taken for an exact one.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..program.expressions import ZERO, Call, Compare, Conditional, Expression, Junction, Name, Negation, Number, call
from ..program.statements import If, Statement, let
from .simplify import absolute, add, extreme, largest, times

FARTHEST = 16.0
"""How many times longer than `scale` a step may be."""

NEXT = 2.0
"""The same where series are watched, so that what is zero in double precision now is seen when it has begun.

Contacts end their slips by events: the first steps behind one would be a third of all steps.
"""

LOW = (1, 2, 3)
"""The low orders with which high ones are compared, beside the last one below half the highest.

The series of x' = v, v' = -x**n from x = 0 has its coefficients n + 1 orders apart: of those of x**n, n or 2 n + 1 is high.
"""

HIDDEN, LOST = 1e-9, 1e-110
"""Least that the low coefficients of a series are taken for: shares of the high ones, and of the absolute tolerance.

The first is for zeros of the low ones alone, the second for zeros of high order, which no step would reach otherwise.
"""


REMOTE, NEARER = 230.0, 100.0
"""Below minus the first, exponentials are not seen in any coefficient; least that an exponent may rise by from there."""

SEEN = let("unseen", 0.0 * Name("scale"))
"""What `unseen` begins with."""


def last_orders(order: int) -> tuple[int, int, int]:
    """The orders whose coefficients say how far a series reaches."""
    return order, order - 1, order - 2


def reach(orders: Sequence[int]) -> Expression:
    """The logarithm of the share of `scale` that a step may go by its `size_…` of some orders."""
    return extreme("minimum", [times(Number(-1.0 / k), Call("log", (Name(f"size_{k}"),))) for k in orders])


def unseen(coefficients: Sequence[Expression]) -> list[Statement]:
    """How much larger the high coefficients of a series are than its low ones, the largest so far."""
    half = len(coefficients) // 2
    low, high = (
        [absolute(e) for k in places if (e := coefficients[k]) != ZERO]
        for places in ((*LOW, half - 1), range(half, len(coefficients)))
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
    """The statements for `way`: it times the share of `scale` that a step goes bounds the change of a series within it.

    `coefficients` are those of the series but the first.
    """
    further = [absolute(e) if e != ZERO else e for e in coefficients]
    while further and further[-1] == ZERO:
        further.pop()
    way, found = Name("way"), list[Statement]()
    for e in reversed(further):
        found.append(let(way.text, add(e, times(way, Name("ratio"))) if found else e))
    return found


def distant(start: Expression, further: Sequence[Expression]) -> list[Statement]:
    """Shorten a step that might go on to where an exponential is seen that is not, because it is far too small.

    Zero to every digit, with all its coefficients, it says nothing of where it rises; its exponent does.
    """
    bound = bounded(further)
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
    """The length of the step from the logarithm of its share of `scale`.

    No step goes on behind the place where the terms of a watched series stop falling.
    """
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
