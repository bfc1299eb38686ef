"""Locate the first time in a step at which a series changes sign: functions for kinks and contacts, and their calls.

Between kinks the solution is analytic.  A step that would pass a kink ends just behind the kink.  The next step then
finds the series on the other side of zero, so that no side is stored between steps.  A contact keeps its mode until one
of its gaps closes.  In slip the gap is the sliding velocity; in stick the gaps are the distances between the load and
the limits of static friction.

`passage` finds the first zero of a polynomial p in 0 < x <= ratio.  The sum B = sum k (k - 1) |p_k| ratio**(k - 2)
bounds |p''|, so the parabola p(x) + p'(x) d - B d**2/2 lies below p(x + d).  The first zero of the parabola lies before
the first zero of p, so that iterating never skips a zero.  Near a simple zero the distances shrink quadratically, as in
Newton's method.

The constants in the texts below are choices.  ROUNDING = 1e-15 is about four units in the last place of 1: a series
whose first coefficient is smaller than ROUNDING times the sum of its terms begins at zero.  PASSED = 1e-10: the step
ends where the series has passed zero by this share of its change in the step; the neglected effect behind the kink is
then of the order of 1e-20.  NEAREST = 1e-8 is the smallest share of a step after which a passage may end the step.
60 iterations are far more than quadratic convergence needs.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ..program.expressions import ONE, Expression, Name, Negation, Value, call, plus
from ..program.statements import Statement, let

PASSAGE = '''
PASSED, ROUNDING, NEAREST = 1e-10, 1e-15, 1e-8


@njit(error_model='numpy', forceinline=True)
def side_of(value, least):
    """The side of zero on which a value lies, 0 within `least` of zero."""
    return select(value > least, 1.0, select(value < -least, -1.0, 0.0*value))


@njit(error_model='numpy')
def passage(side, size, part, nearest, dense, first, degree, ratio):
    """How far, from `nearest` at most to `ratio`, until a series has just left its side of zero; 0 is no side.

    Its coefficients stand from group `first` on. What bounds the bend of the series bounds it
    from below by a parabola, whose zero lies before its own, so that the first passage is found whatever comes later; the
    zeros converge like those of Newton's method. A passage counts once it has gone a small `part` of the way that the series
    goes in the step, and more than rounding of `size`; the step ends there. What is neglected is of the order of that part
    squared.  Products are added by `fma`, so that every width has the same bits.
    """
    bend, spread = 0.0*ratio, 0.0*ratio
    for k in range(degree, 1, -1):
        term = absolute(load(dense, first + k, WIDTH))
        bend, spread = fma(bend, ratio, k*(k - 1.0)*term), fma(spread, ratio, term)
    spread = fma(spread, ratio, absolute(load(dense, first + 1, WIDTH)))*ratio
    start = load(dense, first, WIDTH)
    active = (absolute(side) > 0.5) & (side*start <= 1.0001*spread)  # no other series comes as far as zero
    if not any_lane(active):
        return ratio
    unit = side/maximum(fma(0.0*ratio + 1e-4, size, spread), 1e-300)
    bend = absolute(unit)*bend
    value, slope = fma(unit, start, 0.75*part), unit*load(dense, first + 1, WIDTH)
    place, active = select(active, 0.0, ratio), active & (value > 0.25*part)
    for _ in range(60):
        if not any_lane(active):
            break
        root, rises = sqrt(fma(slope, slope, 2.0*bend*value)), slope > 0.0
        reach = select(rises, slope + root, 2.0*value)/select(rises, bend, root - slope)
        place = select(active, minimum(place + reach, ratio), place)
        active = active & (place < ratio)
        value, slope = 0.0*ratio, 0.0*ratio
        for k in range(degree, 0, -1):
            term = load(dense, first + k, WIDTH)
            value, slope = fma(value, place, term), fma(slope, place, 1.0*k*term)
        value, slope = fma(unit, fma(value, place, start), 0.75*part), unit*slope
        active = active & (value > 0.25*part)
    return minimum(maximum(place, nearest), ratio)
'''.strip()

CLOSING = '''
@njit(error_model='numpy')
def closing(side, late, size, nearest, dense, first, room, degree, ratio):
    """`passage` of the gap of a contact, from above; a gap that begins at zero is divided by the time.

    The rate of a velocity jumps where slip ends, so the passage is as exact as rounding lets it be, or to a part `late`.
    """
    start = load(dense, first, WIDTH)
    begins, side = absolute(start) <= ROUNDING*size, select(start >= -ROUNDING*size, side, 0.0*side)
    if not any_lane(side > 0.5):
        return ratio
    if any_lane(begins):
        for k in range(degree):
            term = load(dense, first + k, WIDTH)
            store(dense, room + k, select(begins, load(dense, first + (k + 1), WIDTH), term))
        store(dense, room + degree, select(begins, 0.0, load(dense, first + degree, WIDTH)))
        first = room
    return passage(side, 1e4*size, 1e-14 + late, nearest, dense, first, degree, ratio)
'''.strip()

ROW_CLOSING = '''
NOTHING = 1e-9


@njit(error_model='numpy')
def row_closing(side, late, size, nearest, dense, first, room, degree, ratio):
    """`passage` of a gap of a row, from above; a gap that begins at zero is divided by the time, as often as it does.

    The modes of rows are decided before a step: a gap at zero or below has just opened, and its first coefficients are
    zero to rounding.  A gap that falls from there closes at once.
    """
    begins = load(dense, first, WIDTH) <= ROUNDING*size
    if not any_lane(begins & (side > 0.5)):
        return passage(side, 1e4*size, 1e-14 + late, nearest, dense, first, degree, ratio)
    way, power = 0.0*ratio, ratio
    for k in range(degree, 0, -1):
        way = fma(way, ratio, absolute(load(dense, first + k, WIDTH)))
    way = way*ratio
    for k in range(degree + 1):
        store(dense, room + k, load(dense, first + k, WIDTH))
    for _ in range(3):
        for k in range(degree):
            store(dense, room + k, select(begins, load(dense, room + (k + 1), WIDTH), load(dense, room + k, WIDTH)))
        store(dense, room + degree, select(begins, 0.0, load(dense, room + degree, WIDTH)))
        start = load(dense, room, WIDTH)*power
        begins = begins & (start <= 0.0) & (start > -NOTHING*way)
        power = power*ratio
        if not any_lane(begins):
            break
    falls = (load(dense, room, WIDTH) < 0.0) & ~begins & (side > 0.5)
    passed = passage(side, 1e4*size, 1e-14 + late, nearest, dense, room, degree, ratio)
    return select(falls, minimum(nearest, ratio), passed)
'''.strip()

SIDES = '''
@njit(error_model='numpy', forceinline=True)
def side_or(value, hint):
    """The side of zero on which a value lies, that of a hint at zero."""
    return select(value > 0.0, 1.0, select(value < 0.0, -1.0, hint))


@njit(error_model='numpy', forceinline=True)
def found_side(begun, side):
    """The side of a series that begins at zero, if its coefficients have just told it, else 0."""
    return select((absolute(begun) < 0.5) & (absolute(side) > 0.5), side, 0.0*side)
'''.strip()

FUNCTIONS = {
    PASSAGE: {"side_of", "passage", "closing", "row_closing"},
    CLOSING: {"closing"},
    ROW_CLOSING: {"row_closing"},
    SIDES: {"side_or", "found_side"},
}
"""For each text, the names of the functions that need the text; a step that calls one of them includes the text."""

LATE = 1e-10
"""If slip begins without a jump: the load may pass the limit by this share of its change in the step."""


class Stored(NamedTuple):
    """A series in memory: size of the terms of coefficient 0, first group of the coefficients, order."""

    size: Expression
    first: Expression
    order: int

    def passage(self, side: Expression, size: Expression, part: Value, nearest: Expression) -> Statement:
        """Return the statement that ends a step where the series passes zero."""
        coefficients = ("dense", self.first, self.order, "passed")
        return let("passed", call("passage", side, size, part, nearest, *coefficients))


def closings(
    mode: str, exact: bool, gaps: Sequence[Stored], stuck: str, room: Expression, rounds: int
) -> list[Statement]:
    """Return the statements that end a step where one of the gaps of a contact or row closes.

    stuck: name of the variable that is 1 in stick and 0 in slip; room: memory for the coefficients of a gap.
    rounds: a second search ends at the first passage, and is as exact as the shorter way to it allows.
    """
    late = 0.0 * Name("t") if exact else LATE * Name(stuck)
    statements: list[Statement] = []
    if len(gaps) > 1:
        statements.append(let(stuck, plus(ONE, Negation(Name(mode) * Name(mode)))))
    # the first gap can close in stick and in slip, the second gap only in stick
    for side, gap in zip((ONE + 0.0 * Name("t"), Name(stuck)), gaps, strict=False):
        coefficients = ("dense", gap.first, room, gap.order, "passed")
        closing = "closing" if rounds == 1 else "row_closing"
        statements += [let("passed", call(closing, side, late, gap.size, "nearest", *coefficients))] * rounds
    return statements


def side_by(coefficient: Expression) -> Statement:
    """Return the statement that sets `side` to the sign of a coefficient, if all earlier coefficients were zero."""
    return let("side", call("side_or", "side", call("side_of", coefficient, 0.0)))
