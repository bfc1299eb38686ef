"""Where a series leaves its side of zero: the functions of a step with kinks or contacts, and the statements that call them.

Between kinks the solution is analytic. A step that would pass a kink ends just behind it, and the next one finds itself on
the other side: nothing has to be remembered. A contact keeps its mode until its gap closes: the sliding velocity while it
slips, and while it sticks the distances of its load from the limits of static friction.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from synchain.models.dynamics.equations import Equations

from ..program.expressions import ONE, ZERO, Compare, Conditional, Expression, Name, Negation, Number, Value, call, plus
from ..program.statements import Comment, If, Repeat, Statement, called, let, mentioned
from .simplify import absolute
from .step_length import bounded

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

FUNCTIONS = {PASSAGE: {"side_of", "passage", "closing"}, CLOSING: {"closing"}, SIDES: {"side_or", "found_side"}}
"""What a step calls that needs some functions."""

LATE = 1e-10
"""How late a body may be set free, as a part of the way that its load goes in a step, if slip begins without a jump."""

SOONEST = let("nearest", 1e-13 * call("maximum", "t", 1.0) / "scale")
"""How soon a step may end at a contact or a jump."""


def jumps(equations: Equations) -> bool:
    """True if slip of some contact begins with a jump of acceleration."""
    return any(event.jumps for node in equations.nodes for event in node.events)


def loose(exact: bool) -> Statement:
    """The tolerance of loads.

    One that is wrong by some part sets a body free too early or late, with less than the power 3/2 of it as velocity, unless
    friction falls at once.
    """
    return let("loose", "rtol" if exact else call("math.sqrt", Name("rtol") * call("math.sqrt", "rtol")))


def closed(mode: str, exact: bool, gaps: Sequence[Stored], stuck: str, room: Expression) -> list[Statement]:
    """The statements that end a step where one of the two gaps of a contact closes.

    `stuck` is what they call 1 in stick, 0 in slip; `room` is memory for the coefficients of a gap.
    """
    late = 0.0 * Name("t") if exact else LATE * Name(stuck)
    found: list[Statement] = [let(stuck, plus(ONE, Negation(Name(mode) * Name(mode))))]
    for side, gap in zip((ONE + 0.0 * Name("t"), Name(stuck)), gaps, strict=True):
        where = ("dense", gap.first, room, gap.order, "passed")
        found.append(let("passed", call("closing", side, late, gap.size, "nearest", *where)))
    return found


class Stored(NamedTuple):
    """A series whose coefficients stand in memory: the size of the terms that it begins with, and where."""

    size: Expression
    first: Expression
    order: int

    def passage(self, side: Expression, size: Expression, part: Value, nearest: Expression) -> Statement:
        """The statement that ends a step where it passes zero."""
        where = ("dense", self.first, self.order, "passed")
        return let("passed", call("passage", side, size, part, nearest, *where))


def approached(coefficients: Sequence[Expression], ends: Sequence[Statement]) -> list[Statement]:
    """The statements that end a step at a kink, if any lane of the series goes as far as zero; `way` bounds how far."""
    found = bounded(coefficients[1:])
    start = absolute(coefficients[0]) if coefficients[0] != ZERO else ZERO
    near = Compare("<=", start, 1.0001 * Name("way") * Name("ratio"))
    return [*found, If(call("any_lane", near), tuple(ends))]


def settled(
    hints: Sequence[Statement], coefficients: Sequence[Statement], sides: Sequence[Statement]
) -> list[Statement]:
    """The statements that make coefficients anew as long as they tell on which sides series lie that begin at zero.

    Each turn tells one more side at least: what one jump sets off may leave the next one.
    """
    if not hints:
        return [*coefficients]
    inner = (*coefficients, Comment("sides of what begins at zero"), let("news", 0.0 * Name("t")), *sides)
    return [*hints, Repeat(inner, call("any_lane", Compare(">", Name("news"), Number(0.5))))]


def told(begun: Expression, sides: Sequence[Statement], note: Statement) -> Statement:
    """The statement that takes note of the `new` side that the coefficients of a series tell if it begins at zero."""
    begins = Compare("<", absolute(begun), Number(0.5))
    found = [let("new", call("found_side", begun, "side")), let("news", Name("news") + absolute(Name("new"))), note]
    return If(call("any_lane", begins), (let("side", 0.0 * Name("t")), *sides, *found))


def further(coefficient: Expression) -> Statement:
    """The statement that finds the `side` of zero on which a series lies by the first coefficient that is not zero."""
    return let("side", call("side_or", "side", call("side_of", coefficient, 0.0)))


def first_passage(found: Sequence[Statement]) -> list[Statement]:
    """The statements that end a step at the first of the passages that are `found` one after another."""
    if not found:
        return []
    until = Conditional(Compare("<", Name("passed"), Name("ratio")), Name("passed") * "scale", Name("length"))
    soonest = [SOONEST] if "nearest" in mentioned(found) else []
    begun: list[Statement] = [Comment("first passage"), let("passed", "ratio"), *soonest]
    return [*begun, *found, let("until", until), let("ratio", "passed")]


def functions(statements: Sequence[Statement]) -> list[str]:
    """The functions that statements call which end a step."""
    names = called(statements)
    return [text for text, those in FUNCTIONS.items() if names & those]
