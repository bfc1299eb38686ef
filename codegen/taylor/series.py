"""Power series in time and the recurrences of their coefficients.

Coefficient k of a series is that of ((t' - t)/scale)**k, t' the time within the step.  Every recurrence below is
homogeneous in `scale`, so that only the states and time itself know it.

A recurrence is written once.  It asks an `Order` for coefficients and convolutions: the part of a step that is written out
answers with sums of names at a certain k, that of one in loops with loops over orders.

Sources: R. E. Moore, Methods and Applications of Interval Analysis (SIAM, 1979), section 3.4; A. Griewank & A. Walther,
Evaluating Derivatives (2nd ed., SIAM, 2008), section 13.2.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Protocol

from ..program import expressions
from ..program.expressions import ONE, ZERO, Call, Compare, Expression, Name, Number
from ..program.statements import Statement
from .event_location import Stored
from .simplify import absolute, add, over, times


class Order(Protocol):
    """What a recurrence can ask for while coefficient k is made."""

    @property
    def inverse(self) -> Expression:
        """1/k, for k > 0."""

    @property
    def number(self) -> Expression:
        """k > 0."""

    def of(self, series: Series) -> Expression:
        """Coefficient k of a series."""

    def sum(self, left: Series, right: Series, first: int, last: int) -> Expression:
        """Sum of left_j * right_(k-j) for j = first … k + last."""

    def square(self, base: Series, first: int) -> Expression:
        """Sum of base_j * base_(k-j) for j = first … k - first."""

    def keep(self, what: str, value: Expression) -> Name:
        """Compute something once, with coefficient 0; returns its name."""

    def hint(self, series: Series) -> Expression:
        """The side of zero on which a series that begins at zero lies just after, 1 or -1; 0 while that is not known."""


@dataclass(eq=False, slots=True)
class Series:
    """A power series under a name.

    `linear` are the series of which coefficient k enters its own coefficient k once, `convolved` those that it multiplies,
    `started` those of which it needs the coefficient 0 alone.
    """

    name: str = field(default="", kw_only=True)

    @property
    def linear(self) -> tuple[Series, ...]:
        return ()

    @property
    def convolved(self) -> tuple[Series, ...]:
        return ()

    @property
    def started(self) -> tuple[Series, ...]:
        return ()

    def begin(self, at: Order) -> Expression:
        """Coefficient 0, unless it is like the others."""
        return self.coefficient(at)

    def coefficient(self, at: Order) -> Expression:
        """Coefficient k > 0."""
        raise NotImplementedError


@dataclass(eq=False, slots=True)
class Constant(Series):
    """A number, or what depends on parameters alone."""

    value: Expression

    def begin(self, at: Order) -> Expression:
        return self.value

    def coefficient(self, at: Order) -> Expression:
        return ZERO


@dataclass(eq=False, slots=True)
class State(Series):
    """A state variable: its coefficient k comes from coefficient k - 1 of its rate, outside this file.

    period: that of an angle, None for any other state.
    """

    period: float | None = field(default=None, kw_only=True)


@dataclass(eq=False, slots=True)
class Time(Series):
    """Time: t, scale, 0, 0, …"""


@dataclass(eq=False, slots=True)
class Linear(Series):
    """constant + sum of factor * series."""

    terms: tuple[tuple[Expression, Series], ...]
    constant: Expression = ZERO

    @property
    def linear(self) -> tuple[Series, ...]:
        return tuple(series for _, series in self.terms)

    def begin(self, at: Order) -> Expression:
        return add(*(times(factor, at.of(series)) for factor, series in self.terms), self.constant)

    def coefficient(self, at: Order) -> Expression:
        return add(*(times(factor, at.of(series)) for factor, series in self.terms))


@dataclass(eq=False, slots=True)
class Product(Series):
    """left * right."""

    left: Series
    right: Series

    @property
    def convolved(self) -> tuple[Series, ...]:
        return self.left, self.right

    def coefficient(self, at: Order) -> Expression:
        return at.sum(self.left, self.right, 0, 0)


@dataclass(eq=False, slots=True)
class Square(Series):
    """base**2, by half the products."""

    base: Series

    @property
    def convolved(self) -> tuple[Series, ...]:
        return (self.base,)

    def coefficient(self, at: Order) -> Expression:
        return at.square(self.base, 0)


@dataclass(eq=False, slots=True)
class SquareRoot(Series):
    """u = sqrt(a) from u u = a."""

    base: Series
    inverse: Expression = ONE

    @property
    def linear(self) -> tuple[Series, ...]:
        return (self.base,)

    @property
    def convolved(self) -> tuple[Series, ...]:
        return (self,)

    def begin(self, at: Order) -> Expression:
        root = Call("sqrt", (at.of(self.base),))
        self.inverse = at.keep(f"half_{self.name}", over(Number(0.5), root))
        return root

    def coefficient(self, at: Order) -> Expression:
        return times(add(at.of(self.base), times(Number(-1.0), at.square(self, 1))), self.inverse)


@dataclass(eq=False, slots=True)
class Ratio(Series):
    """u = a/b from u b = a."""

    above: Series
    below: Series
    inverse: Expression = ONE

    @property
    def linear(self) -> tuple[Series, ...]:
        return (self.above,)

    @property
    def convolved(self) -> tuple[Series, ...]:
        return self, self.below

    def begin(self, at: Order) -> Expression:
        self.inverse = at.keep(f"i_{self.below.name}", over(ONE, at.of(self.below)))
        return times(at.of(self.above), self.inverse)

    def coefficient(self, at: Order) -> Expression:
        known = at.sum(self.below, self, 1, 0)
        return times(add(at.of(self.above), times(Number(-1.0), known)), self.inverse)


@dataclass(eq=False, slots=True)
class Slope(Series):
    """k a_k, the coefficients of a' times (t' - t)."""

    of: Series

    @property
    def linear(self) -> tuple[Series, ...]:
        return (self.of,)

    def begin(self, at: Order) -> Expression:
        return ZERO

    def coefficient(self, at: Order) -> Expression:
        return times(at.number, at.of(self.of))


@dataclass(eq=False, slots=True)
class Integral(Series):
    """u = f(a) from u' = c g a' with f'(a) = c g, c a number: exp, sin, tan, sinh, tanh, erf and the like.

    The factor g is set after the series was made, because it may hold u itself.
    """

    function: str
    argument: Series
    slope: Slope
    number: float = 1.0
    factor: Series | None = None

    @property
    def convolved(self) -> tuple[Series, ...]:
        return (self.slope,) if self.factor is None else (self.slope, self.factor)

    @property
    def started(self) -> tuple[Series, ...]:
        return (self.argument,)

    def begin(self, at: Order) -> Expression:
        return Call(self.function, (at.of(self.argument),))

    def coefficient(self, at: Order) -> Expression:
        if self.factor is None:
            raise RuntimeError(f"{self.name} has no derivative yet; this is a mistake in the program")
        return times(Number(self.number), at.inverse, at.sum(self.slope, self.factor, 1, 0))


@dataclass(eq=False, slots=True)
class Exponential(Integral):
    """u = exp(a) from u' = u a'; where the exponent begins is kept for the length of the step.

    steepness: of the exponent, as a multiple of a.
    """

    steepness: ClassVar[float] = 1.0

    def begin(self, at: Order) -> Expression:
        return Call(self.function, (at.keep(self.exponent, at.of(self.argument)),))

    @property
    def exponent(self) -> str:
        """What the exponent at the beginning is called."""
        return f"n_{self.name}"


@dataclass(eq=False, slots=True)
class Sigmoid(Integral):
    """u = 1/(c + d exp(a)), c and d positive numbers, from u' = -w a', w the `Crest` of the same; exp(a) may overflow."""

    ends: tuple[float, float] = (1.0, 1.0)

    def begin(self, at: Order) -> Expression:
        c, d = map(Number, self.ends)
        return over(ONE, add(c, times(d, Call("exp", (at.of(self.argument),)))))


@dataclass(eq=False, slots=True)
class Peak(Exponential):
    """A function of a that falls like an exponential on either side of 0."""

    def begin(self, at: Order) -> Expression:
        start = at.of(self.argument)
        at.keep(self.exponent, times(Number(-self.steepness), absolute(start)))
        return self.value(start)

    def value(self, start: Expression) -> Expression:
        """Its value where a is `start`."""
        raise NotImplementedError


@dataclass(eq=False, slots=True)
class Crest(Peak):
    """w = d exp(a) u**2, u the `Sigmoid`, from w' = (2 c u - 1) w a'; the smaller one of two exponentials makes its digits."""

    ends: tuple[float, float] = (1.0, 1.0)

    def value(self, start: Expression) -> Expression:
        c, d = map(Number, self.ends)
        rising, falling = Call("exp", (start,)), Call("exp", (times(Number(-1.0), start),))
        return over(d, times(add(c, times(d, rising)), add(d, times(c, falling))))


@dataclass(eq=False, slots=True)
class Secant(Peak):
    """u = 1/cosh(a) from u' = -u tanh(a) a'; cosh(a) may overflow."""

    def value(self, start: Expression) -> Expression:
        return over(ONE, Call("cosh", (start,)))


@dataclass(eq=False, slots=True)
class SquaredSecant(Peak):
    """u = 1/cosh(a)**2 from u' = -2 u tanh(a) a', which has digits where tanh(a) is 1 to the last one."""

    steepness = 2.0

    def value(self, start: Expression) -> Expression:
        secant = over(ONE, Call("cosh", (start,)))
        return times(secant, secant)


@dataclass(eq=False, slots=True)
class QuotientIntegral(Series):
    """u = f(a) from u' w = c a' with f'(a) = c/w, c a number: log, atan, asin, acos and the like."""

    function: str
    argument: Series
    divisor: Series
    sign: float
    slope: Slope | None = None
    inverse: Expression = ONE

    @property
    def linear(self) -> tuple[Series, ...]:
        return (self.argument,)

    @property
    def convolved(self) -> tuple[Series, ...]:
        return (self.divisor,) if self.slope is None else (self.slope, self.divisor)

    def begin(self, at: Order) -> Expression:
        self.inverse = at.keep(f"i_{self.divisor.name}", over(ONE, at.of(self.divisor)))
        return Call(self.function, (at.of(self.argument),))

    def coefficient(self, at: Order) -> Expression:
        if self.slope is None:
            raise RuntimeError(f"{self.name} has no slope yet; this is a mistake in the program")
        known = times(Number(-1.0), at.inverse, at.sum(self.slope, self.divisor, 1, -1))
        return times(add(times(Number(self.sign), at.of(self.argument)), known), self.inverse)


@dataclass(eq=False, slots=True)
class Power(Series):
    """u = a**e for a constant e, from a u' = e a' u."""

    base: Series
    slope: Slope
    exponent: Expression
    inverse: Expression = ONE
    beyond: Expression = ONE

    @property
    def convolved(self) -> tuple[Series, ...]:
        return self, self.slope, self.base

    def begin(self, at: Order) -> Expression:
        base = at.of(self.base)
        self.inverse = at.keep(f"i_{self.base.name}", over(ONE, base))
        self.beyond = at.keep(f"e_{self.name}", add(self.exponent, ONE))
        return Call("power", (base, self.exponent))

    def coefficient(self, at: Order) -> Expression:
        grown = times(at.inverse, self.beyond, at.sum(self.slope, self, 1, 0))
        return times(add(grown, times(Number(-1.0), at.sum(self.base, self, 1, 0))), self.inverse)


@dataclass(eq=False, slots=True)
class Kink(Series):
    """The side of zero on which a series lies just after the start, 1 or -1; 0 while nothing but zeros is known of it.

    It is no series itself, it is the same to all orders.  A series that begins at zero, up to rounding, a small part of the
    terms that it is the sum of, has the side that its coefficients tell, all of which are made anew then.
    """

    base: Series

    @property
    def convolved(self) -> tuple[Series, ...]:
        return (self.base,)

    def begin(self, at: Order) -> Expression:
        return self.side(at, magnitude(at, self.base))

    def side(self, at: Order, terms: Expression) -> Expression:
        """The side just after the start, by the size of the terms that the series begins with."""
        size = at.keep(f"size_{self.name}", terms)
        start = Call("side_of", (at.of(self.base), self.least(size)))
        hint = 0.0 * Name("scale") if isinstance(self.base, Constant) else at.hint(self.base)
        return at.keep(self.name, Call("side_or", (start, hint)))

    def least(self, size: Name) -> Expression:
        """How far from zero it begins if it does not begin there, by the size of its terms."""
        return Name("ROUNDING") * size

    def coefficient(self, at: Order) -> Expression:
        return Name(self.name)

    def passages(self, side: Expression, stored: Stored) -> list[Statement]:
        """The statements that end a step where the series leaves its side."""
        return [stored.passage(side, stored.size, "PASSED", Name("NEAREST") * "passed")]


@dataclass(eq=False, slots=True)
class Choice(Series):
    """One of two series that agree where `kink` has its zero: `above` where the side is 1, `below` elsewhere."""

    kink: Kink
    above: Series
    below: Series

    @property
    def linear(self) -> tuple[Series, ...]:
        return self.kink, self.above, self.below

    def coefficient(self, at: Order) -> Expression:
        return _chosen(at.of(self.kink), at.of(self.above), at.of(self.below))


@dataclass(eq=False, slots=True)
class Brink(Kink):
    """The side of zero on which a series lies where another one jumps; it begins at zero at zero itself alone."""

    def least(self, size: Name) -> Expression:
        return ZERO

    def passages(self, side: Expression, stored: Stored) -> list[Statement]:
        """The statements that end a step where the series leaves its side.

        A passage is as exact as rounding lets it be, of the way until there, not of that of a step without it.
        """
        return 2 * [stored.passage(side, 1e4 * stored.size, 2e-15, 0.01 * Name("nearest"))]


@dataclass(eq=False, slots=True)
class Leaping(Series):
    """One of three series by the side, 1, 0 or -1, of a series with a brink."""

    brink: Brink
    above: Series
    at: Series
    below: Series

    @property
    def linear(self) -> tuple[Series, ...]:
        return self.brink, self.above, self.at, self.below

    def coefficient(self, at: Order) -> Expression:
        return _one(at.of(self.brink), at.of(self.above), at.of(self.at), at.of(self.below))


@dataclass(eq=False, slots=True)
class Fraction(Series):
    """A series less the whole number below it just after its start; `turned` is it, or a sum that it is the negative of."""

    base: Series
    turned: Series

    @property
    def linear(self) -> tuple[Series, ...]:
        return (self.base,)

    def begin(self, at: Order) -> Expression:
        return add(at.of(self.base), times(Number(-1.0), below(at, self.base, self)))

    def coefficient(self, at: Order) -> Expression:
        return at.of(self.base)


@dataclass(eq=False, slots=True)
class Whole(Series):
    """The whole number below a series just after its start; the brinks are those of its distances from this and the next one."""

    base: Series
    lower: Brink
    upper: Brink

    @property
    def linear(self) -> tuple[Series, ...]:
        return self.lower, self.upper

    @property
    def started(self) -> tuple[Series, ...]:
        return (self.base,)

    def begin(self, at: Order) -> Expression:
        return below(at, self.base, self.lower.base)

    def coefficient(self, at: Order) -> Expression:
        return ZERO


def below(at: Order, series: Series, part: Series) -> Expression:
    """The whole number below a series just after its start; `part` is what lies above."""
    return add(Call("floor", (at.of(series),)), Call("minimum", (at.hint(part), ZERO)))


def magnitude(at: Order, series: Series) -> Expression:
    """The sum of the sizes of the terms that a series begins with: rounding is a small part of it."""
    if isinstance(series, Fraction):
        return magnitude(at, series.turned)
    parts = [at.of(series)]
    if isinstance(series, Linear):
        parts = [
            times(factor, magnitude(at, inner) if isinstance(inner, Fraction) else at.of(inner))
            for factor, inner in series.terms
        ]
        parts += [] if series.constant == ZERO else [series.constant]
    return add(*(Number(abs(e.value)) if isinstance(e, Number) else absolute(e) for e in parts))


def _chosen(side: Expression, above: Expression, below: Expression) -> Expression:
    if above == below:
        return above
    if above == times(Number(-1.0), below):
        return times(side, above)
    return expressions.Conditional(Compare(">", side, ZERO), above, below)


def _one(side: Expression, above: Expression, middle: Expression, below: Expression) -> Expression:
    if middle in (above, below):
        return _chosen(side, above, below) if middle == below else _chosen(times(Number(-1.0), side), below, above)
    if middle == ZERO and above == times(Number(-1.0), below):
        return times(side, above)
    return expressions.Conditional(Compare("<", side, ZERO), below, _chosen(side, above, middle))


@dataclass(eq=False, slots=True)
class Row(Series):
    """One row of L y = r - (M - M_0) a, a the solution of M a = r, with the rows of L and U of M_0 = L U.

    M_0 a_k = r_k - sum of M_j a_(k-j) for j = 1 … k: the factors of M_0 serve all orders.  `entries` are factor and series
    of the row of M by column, rows and columns in the order of elimination.  A symmetric matrix takes half the operations.
    `unknowns`, the whole solution, is set after all rows were made.
    """

    right: Series
    entries: dict[int, tuple[Expression, Series]]
    before: tuple[Row, ...]
    symmetric: bool
    unknowns: tuple[Unknown, ...] = ()
    lower: dict[int, Expression] = field(default_factory=dict)
    upper: dict[int, Expression] = field(default_factory=dict)
    inverse: Expression = ONE

    @property
    def linear(self) -> tuple[Series, ...]:
        return self.right, *self.before

    @property
    def moving(self) -> list[tuple[Expression, Series, Unknown]]:
        """The entries that change within a step, each with the unknown that it multiplies."""
        pairs = [(factor, series, self.unknowns[c]) for c, (factor, series) in self.entries.items()]
        return [found for found in pairs if not isinstance(found[1], Constant)]

    @property
    def convolved(self) -> tuple[Series, ...]:
        return tuple(s for _, series, unknown in self.moving for s in (series, unknown))

    def begin(self, at: Order) -> Expression:
        self.factorise(at)
        return self.coefficient(at)

    def coefficient(self, at: Order) -> Expression:
        pushed = (times(Number(-1.0), factor, at.sum(series, a, 1, 0)) for factor, series, a in self.moving)
        known = (times(Number(-1.0), e, at.of(self.before[k])) for k, e in self.lower.items())
        return add(at.of(self.right), *pushed, *known)

    def factorise(self, at: Order) -> None:
        """Compute the row of L, that of U, and the inverse of its pivot."""
        i = len(self.before)
        row = {c: times(factor, at.of(series)) for c, (factor, series) in self.entries.items()}
        for k, other in enumerate(self.before):
            left = row.pop(k, ZERO)
            left = other.upper.get(i, ZERO) if self.symmetric else left
            if left == ZERO:
                continue
            self.lower[k] = at.keep(f"l_{self.name}_{k}", times(left, other.inverse))
            for c, e in other.upper.items():
                if c >= i or not self.symmetric:
                    row[c] = add(row.get(c, ZERO), times(Number(-1.0), self.lower[k], e))
        self.inverse = at.keep(f"i_{self.name}", over(ONE, row.pop(i)))
        self.upper = {c: at.keep(f"u_{self.name}_{c}", e) for c, e in row.items() if e != ZERO}


@dataclass(eq=False, slots=True)
class Unknown(Series):
    """One unknown a of U a = y; `after` are those of later rows by their columns."""

    row: Row
    after: dict[int, Unknown]

    @property
    def linear(self) -> tuple[Series, ...]:
        return self.row, *self.after.values()

    def coefficient(self, at: Order) -> Expression:
        known = (times(Number(-1.0), e, at.of(self.after[c])) for c, e in self.row.upper.items())
        return times(add(at.of(self.row), *known), self.row.inverse)
