"""Power series in time, and the recurrences of their coefficients.

A Taylor method writes each subexpression u of the rates as a series

    u(t') = sum_k u_k ((t' - t)/scale)**k

and computes u_k from coefficients 0 … k of its operands.  `scale` is chosen so that the coefficients of a state have
similar sizes.  No recurrence below contains `scale`: only the states (`x_(k+1) = scale/(k+1) * rate_k`) and time use
it.

Three forms cover all functions.  Here a' is the derivative with respect to (t' - t)/scale, so that k a_k are the
coefficients of (t' - t) a' (`Slope`):

* products; also quotients and roots, which solve a product: u b = a gives u_k = (a_k - sum_{j=1..k} b_j u_(k-j))/b_0;
* functions whose derivative is a product, u' = g a': k u_k = sum_{j=1..k} j a_j g_(k-j) (`Integral`);
* functions whose derivative is a quotient, u' w = a': k u_k w_0 = k a_k - sum_{j=1..k-1} j u_j w_(k-j)
  (`QuotientIntegral`).

Sources: R. E. Moore, Methods and Applications of Interval Analysis (SIAM, 1979), section 3.4; A. Griewank & A. Walther,
Evaluating Derivatives (2nd ed., SIAM, 2008), section 13.2.

Each recurrence is written once, for an `Order` that supplies coefficients and convolutions.  The `Order` of a
written-out step returns sums of names for one k; the `Order` of a looped step returns loops over orders.  In kernel
text, a series is named after its class.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Protocol

from ..program import expressions
from ..program.expressions import ONE, ZERO, Call, Compare, Expression, Name, Number
from ..program.statements import Statement
from .event_location import Stored
from .simplify import absolute, add, over, times

MINUS = Number(-1.0)


class Order(Protocol):
    """The order k that is being written, with the operations from which recurrences are built."""

    @property
    def inverse(self) -> Expression:
        """1/k, for k > 0."""

    @property
    def number(self) -> Expression:
        """The order k > 0 as an expression."""

    def of(self, series: Series) -> Expression:
        """Return coefficient k of a series."""

    def sum(self, left: Series, right: Series, first: int, last: int) -> Expression:
        """Return the sum of left_j * right_(k-j) for j = first … k + last."""

    def square(self, base: Series, first: int) -> Expression:
        """Return the sum of base_j * base_(k-j) for j = first … k - first."""

    def save(self, name: str, value: Expression) -> Name:
        """Compute a value once in a step, at order 0, and return the name of the variable."""

    def hint(self, series: Series) -> Expression:
        """Return, for a series that begins at zero, its sign just afterwards: 1, -1, or 0 if not yet known."""


@dataclass(eq=False, slots=True)
class Series:
    """A power series with a name.

    Coefficient k is computed from coefficient k of the `linear` series, coefficients 0 … k of the `convolved` series,
    and coefficient 0 of the `started` series.  LINEAR, CONVOLVED and STARTED list the fields that hold these series.
    """

    name: str = field(default="", kw_only=True)
    LINEAR: ClassVar[tuple[str, ...]] = ()
    CONVOLVED: ClassVar[tuple[str, ...]] = ()
    STARTED: ClassVar[tuple[str, ...]] = ()

    @property
    def linear(self) -> tuple[Series, ...]:
        return self._parts(self.LINEAR)

    @property
    def convolved(self) -> tuple[Series, ...]:
        return self._parts(self.CONVOLVED)

    @property
    def started(self) -> tuple[Series, ...]:
        return self._parts(self.STARTED)

    def _parts(self, names: tuple[str, ...]) -> tuple[Series, ...]:
        parts = (self if name == "self" else getattr(self, name) for name in names)
        return tuple(part for part in parts if part is not None)  # None: the factor of an integral that is not set yet

    def begin(self, at: Order) -> Expression:
        """Return coefficient 0; by default the formula of all other coefficients."""
        return self.coefficient(at)

    def coefficient(self, at: Order) -> Expression:
        """Return coefficient k > 0."""
        raise NotImplementedError


@dataclass(eq=False, slots=True)
class Constant(Series):
    """A number, or a function of parameters alone."""

    value: Expression

    def begin(self, at: Order) -> Expression:
        return self.value

    def coefficient(self, at: Order) -> Expression:
        return ZERO


@dataclass(eq=False, slots=True)
class State(Series):
    """A state variable: the writers compute its coefficient k from coefficient k - 1 of its rate.

    period: the period of an angle, None for any other state.
    """

    period: float | None = field(default=None, kw_only=True)


@dataclass(eq=False, slots=True)
class Time(Series):
    """Time, whose coefficients are t, scale, 0, 0, …"""


# -- arithmetic -------------------------------------------------------------------------------------------------------


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
    CONVOLVED = ("left", "right")

    def coefficient(self, at: Order) -> Expression:
        return at.sum(self.left, self.right, 0, 0)


@dataclass(eq=False, slots=True)
class Square(Series):
    """base**2, with half the products of `Product`."""

    base: Series
    CONVOLVED = ("base",)

    def coefficient(self, at: Order) -> Expression:
        return at.square(self.base, 0)


@dataclass(eq=False, slots=True)
class SquareRoot(Series):
    """u = sqrt(a) from u u = a: 2 u_0 u_k = a_k - sum_{j=1..k-1} u_j u_(k-j)."""

    base: Series
    inverse: Expression = ONE
    LINEAR, CONVOLVED = ("base",), ("self",)

    def begin(self, at: Order) -> Expression:
        root = Call("sqrt", (at.of(self.base),))
        self.inverse = at.save(f"half_{self.name}", over(Number(0.5), root))
        return root

    def coefficient(self, at: Order) -> Expression:
        return times(add(at.of(self.base), times(MINUS, at.square(self, 1))), self.inverse)


@dataclass(eq=False, slots=True)
class Ratio(Series):
    """u = a/b from u b = a: b_0 u_k = a_k - sum_{j=1..k} b_j u_(k-j)."""

    above: Series
    below: Series
    inverse: Expression = ONE
    LINEAR, CONVOLVED = ("above",), ("self", "below")

    def begin(self, at: Order) -> Expression:
        self.inverse = at.save(f"i_{self.below.name or self.name}", over(ONE, at.of(self.below)))
        return times(at.of(self.above), self.inverse)

    def coefficient(self, at: Order) -> Expression:
        earlier = at.sum(self.below, self, 1, 0)
        return times(add(at.of(self.above), times(MINUS, earlier)), self.inverse)


@dataclass(eq=False, slots=True)
class Slope(Series):
    """k a_k, the coefficients of (t' - t) a'."""

    of: Series
    LINEAR = ("of",)

    def begin(self, at: Order) -> Expression:
        return ZERO

    def coefficient(self, at: Order) -> Expression:
        return times(at.number, at.of(self.of))


# -- functions by their differential equations ------------------------------------------------------------------------


@dataclass(eq=False, slots=True)
class Integral(Series):
    """u = f(a) from u' = c g a' with f'(a) = c g and a number c: exp, sin, tan, sinh, tanh, erf …

    The factor g is set after the series u is created, because g may contain u.
    """

    function: str
    argument: Series
    slope: Slope
    number: float = 1.0
    factor: Series | None = None
    CONVOLVED, STARTED = ("slope", "factor"), ("argument",)

    def begin(self, at: Order) -> Expression:
        return Call(self.function, (at.of(self.argument),))

    def coefficient(self, at: Order) -> Expression:
        if self.factor is None:
            raise RuntimeError(f"{self.name} has no derivative yet; this is a mistake in the program")
        return times(Number(self.number), at.inverse, at.sum(self.slope, self.factor, 1, 0))


@dataclass(eq=False, slots=True)
class Exponential(Integral):
    """u = exp(a) from u' = u a'.  The step saves a_0, to find the time at which u rises even if u is 0 to rounding now.

    steepness: exponent / a.
    """

    steepness: ClassVar[float] = 1.0

    def begin(self, at: Order) -> Expression:
        return Call(self.function, (at.save(self.exponent, at.of(self.argument)),))

    @property
    def exponent(self) -> str:
        """The name of the exponent at the beginning of the step."""
        return f"n_{self.name}"


@dataclass(eq=False, slots=True)
class Sigmoid(Integral):
    """u = 1/(c + d exp(a)) from u' = -w a'; c, d > 0 and w is the `Crest` of the same a, c, d.  exp(a) may overflow."""

    ends: tuple[float, float] = (1.0, 1.0)

    def begin(self, at: Order) -> Expression:
        c, d = map(Number, self.ends)
        return over(ONE, add(c, times(d, Call("exp", (at.of(self.argument),)))))


@dataclass(eq=False, slots=True)
class Peak(Exponential):
    """A function of a that decays exponentially for a to infinity and for a to minus infinity."""

    def begin(self, at: Order) -> Expression:
        start = at.of(self.argument)
        at.save(self.exponent, times(Number(-self.steepness), absolute(start)))
        return self.value(start)

    def value(self, start: Expression) -> Expression:
        """Return the value of the function at a = `start`."""
        raise NotImplementedError


@dataclass(eq=False, slots=True)
class Crest(Peak):
    """w = d exp(a) u**2 from w' = (2 c u - 1) w a'; u is the `Sigmoid`.

    Coefficient 0 is d/((c + d exp(a)) (d + c exp(-a))): this form is accurate even if one of the exponentials is tiny.
    """

    ends: tuple[float, float] = (1.0, 1.0)

    def value(self, start: Expression) -> Expression:
        c, d = map(Number, self.ends)
        rising, falling = Call("exp", (start,)), Call("exp", (times(MINUS, start),))
        return over(d, times(add(c, times(d, rising)), add(d, times(c, falling))))


@dataclass(eq=False, slots=True)
class Secant(Peak):
    """u = 1/cosh(a) from u' = -u tanh(a) a'; cosh(a) may overflow."""

    def value(self, start: Expression) -> Expression:
        return over(ONE, Call("cosh", (start,)))


@dataclass(eq=False, slots=True)
class SquaredSecant(Peak):
    """u = 1/cosh(a)**2 from u' = -2 u tanh(a) a'; accurate for large |a|, unlike 1 - tanh(a)**2."""

    steepness = 2.0

    def value(self, start: Expression) -> Expression:
        secant = over(ONE, Call("cosh", (start,)))
        return times(secant, secant)


@dataclass(eq=False, slots=True)
class QuotientIntegral(Series):
    """u = f(a) from u' w = c a' with f'(a) = c/w and a number c: log, atan, asin, acos …"""

    function: str
    argument: Series
    divisor: Series
    sign: float
    slope: Slope | None = None
    inverse: Expression = ONE
    LINEAR, CONVOLVED = ("argument",), ("slope", "divisor")

    def begin(self, at: Order) -> Expression:
        self.inverse = at.save(f"i_{self.divisor.name}", over(ONE, at.of(self.divisor)))
        return Call(self.function, (at.of(self.argument),))

    def coefficient(self, at: Order) -> Expression:
        if self.slope is None:
            raise RuntimeError(f"{self.name} has no slope yet; this is a mistake in the program")
        earlier = times(MINUS, at.inverse, at.sum(self.slope, self.divisor, 1, -1))
        return times(add(times(Number(self.sign), at.of(self.argument)), earlier), self.inverse)


@dataclass(eq=False, slots=True)
class Power(Series):
    """u = a**e with constant e from a u' = e a' u: k a_0 u_k = sum_{j=1..k} (e j - (k - j)) a_j u_(k-j).

    Since e j - (k - j) = (e + 1) j - k, the sum is (e + 1) sum j a_j u_(k-j) - k sum a_j u_(k-j).
    """

    base: Series
    slope: Slope
    exponent: Expression
    inverse: Expression = ONE
    beyond: Expression = ONE
    CONVOLVED = ("self", "slope", "base")

    def begin(self, at: Order) -> Expression:
        base = at.of(self.base)
        self.inverse = at.save(f"i_{self.base.name}", over(ONE, base))
        self.beyond = at.save(f"e_{self.name}", add(self.exponent, ONE))
        return Call("power", (base, self.exponent))

    def coefficient(self, at: Order) -> Expression:
        grown = times(at.inverse, self.beyond, at.sum(self.slope, self, 1, 0))
        return times(add(grown, times(MINUS, at.sum(self.base, self, 1, 0))), self.inverse)


# -- kinks and jumps --------------------------------------------------------------------------------------------------


@dataclass(eq=False, slots=True)
class Kink(Series):
    """The sign, 1 or -1, of a series just after the start of the step; 0 while all coefficients so far are zero.

    The sign is used unchanged at all orders.  A series begins at zero if coefficient 0 is smaller than the rounding
    error of its terms.  The first nonzero coefficient then decides the sign, and the step computes all coefficients
    again.
    """

    base: Series
    CONVOLVED = ("base",)

    def begin(self, at: Order) -> Expression:
        return self.side(at, magnitude(at, self.base))

    def side(self, at: Order, terms: Expression) -> Expression:
        """Return the sign just after the start; `terms` is the sum of the absolute terms of coefficient 0."""
        size = at.save(f"size_{self.name}", terms)
        start = Call("side_of", (at.of(self.base), self.least(size)))
        hint = 0.0 * Name("scale") if isinstance(self.base, Constant) else at.hint(self.base)
        return at.save(self.name, Call("side_or", (start, hint)))

    def least(self, size: Name) -> Expression:
        """Return the largest |coefficient 0| that counts as zero; `size` is the sum of the absolute terms."""
        return Name("ROUNDING") * size

    def coefficient(self, at: Order) -> Expression:
        return Name(self.name)

    def passages(self, side: Expression, stored: Stored) -> list[Statement]:
        """Return the statements that end a step where the series changes sign."""
        return [stored.passage(side, stored.size, "PASSED", Name("NEAREST") * "passed")]


@dataclass(eq=False, slots=True)
class Choice(Series):
    """One of two series that agree at the zero of `kink`: `above` if the sign is 1, else `below`."""

    kink: Kink
    above: Series
    below: Series
    LINEAR = ("kink", "above", "below")

    def coefficient(self, at: Order) -> Expression:
        return _one_of_two(at.of(self.kink), at.of(self.above), at.of(self.below))


@dataclass(eq=False, slots=True)
class Brink(Kink):
    """The sign of a series at whose zeros another series jumps; only an exact zero counts as zero."""

    def least(self, size: Name) -> Expression:
        return ZERO

    def passages(self, side: Expression, stored: Stored) -> list[Statement]:
        """Return the statements that end a step where the series changes sign.

        A jump changes the rate, so the passage must be exact to rounding (2e-15).  The second call compares with the
        change of the series up to the passage, not with the change over the whole step.
        """
        return 2 * [stored.passage(side, 1e4 * stored.size, 2e-15, 0.01 * Name("nearest"))]


@dataclass(eq=False, slots=True)
class Leaping(Series):
    """One of three series, selected by a `Brink`, that is by the sign 1, 0 or -1 of another series."""

    brink: Brink
    above: Series
    at: Series
    below: Series
    LINEAR = ("brink", "above", "at", "below")

    def coefficient(self, at: Order) -> Expression:
        side, above, middle, below = (at.of(s) for s in self.linear)
        if middle == below:
            return _one_of_two(side, above, below)
        if middle == above:
            return _one_of_two(times(MINUS, side), below, above)
        if middle == ZERO and above == times(MINUS, below):
            return times(side, above)
        return expressions.Conditional(Compare("<", side, ZERO), below, _one_of_two(side, above, middle))


@dataclass(eq=False, slots=True)
class Fraction(Series):
    """A series minus its floor just after the start.  `turned` is the series itself, or minus the series."""

    base: Series
    turned: Series
    LINEAR = ("base",)

    def begin(self, at: Order) -> Expression:
        return add(at.of(self.base), times(MINUS, floor(at, self.base, self)))

    def coefficient(self, at: Order) -> Expression:
        return at.of(self.base)


@dataclass(eq=False, slots=True)
class Whole(Series):
    """The floor of a series just after the start; the brinks watch the distances to this integer and to the next."""

    base: Series
    lower: Brink
    upper: Brink
    LINEAR, STARTED = ("lower", "upper"), ("base",)

    def begin(self, at: Order) -> Expression:
        return floor(at, self.base, self.lower.base)

    def coefficient(self, at: Order) -> Expression:
        return ZERO


def floor(at: Order, series: Series, fraction: Series) -> Expression:
    """Return the floor of a series just after the start: one less than at the start if it falls from an integer."""
    return add(Call("floor", (at.of(series),)), Call("minimum", (at.hint(fraction), ZERO)))


def magnitude(at: Order, series: Series) -> Expression:
    """Return the sum of the absolute values of the terms of coefficient 0, a scale for its rounding error."""
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


def _one_of_two(side: Expression, above: Expression, below: Expression) -> Expression:
    """Return `above` if the side is 1, else `below`; use a product instead of a comparison if possible."""
    if above == below:
        return above
    if above == times(MINUS, below):
        return times(side, above)
    return expressions.Conditional(Compare(">", side, ZERO), above, below)


# -- rates of a mass matrix -------------------------------------------------------------------------------------------


@dataclass(eq=False, slots=True)
class MassRow(Series):
    """One row of the forward substitution L y = r - (M - M_0) a for the equations M a = r, with M_0 = L U.

    Order k of M a = r reads M_0 a_k = r_k - sum_{j=1..k} M_j a_(k-j), so that all orders use the factors of M_0.
    `entries`: factor and series of each entry in this row of M, by column; rows and columns are numbered in the order
    of elimination.  A symmetric matrix takes half the operations.  `unknowns`: the whole solution a, which is set after
    all rows are created.
    """

    right: Series
    entries: dict[int, tuple[Expression, Series]]
    before: tuple[MassRow, ...]
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
        """Return the entries that change within a step, each with the unknown that the entry multiplies."""
        products = [(factor, series, self.unknowns[c]) for c, (factor, series) in self.entries.items()]
        return [(factor, series, a) for factor, series, a in products if not isinstance(series, Constant)]

    @property
    def convolved(self) -> tuple[Series, ...]:
        return tuple(s for _, series, unknown in self.moving for s in (series, unknown))

    def begin(self, at: Order) -> Expression:
        # eliminate this row of M_0 by all earlier rows: compute row i of L, then row i of U
        i = len(self.before)
        row = {c: times(factor, at.of(series)) for c, (factor, series) in self.entries.items()}
        for k, other in enumerate(self.before):
            left = row.pop(k, ZERO)
            left = other.upper.get(i, ZERO) if self.symmetric else left  # l_ik = u_ki/u_kk
            if left == ZERO:
                continue
            self.lower[k] = at.save(f"l_{self.name}_{k}", times(left, other.inverse))
            for c, e in other.upper.items():
                if c >= i or not self.symmetric:
                    row[c] = add(row.get(c, ZERO), times(MINUS, self.lower[k], e))
        self.inverse = at.save(f"i_{self.name}", over(ONE, row.pop(i)))
        self.upper = {c: at.save(f"u_{self.name}_{c}", e) for c, e in row.items() if e != ZERO}
        return self.coefficient(at)

    def coefficient(self, at: Order) -> Expression:
        pushed = (times(MINUS, factor, at.sum(series, a, 1, 0)) for factor, series, a in self.moving)
        eliminated = (times(MINUS, e, at.of(self.before[k])) for k, e in self.lower.items())
        return add(at.of(self.right), *pushed, *eliminated)


@dataclass(eq=False, slots=True)
class Unknown(Series):
    """One unknown a of the back substitution U a = y; `after` holds the unknowns of later rows, by column."""

    row: MassRow
    after: dict[int, Unknown]

    @property
    def linear(self) -> tuple[Series, ...]:
        return self.row, *self.after.values()

    def coefficient(self, at: Order) -> Expression:
        substituted = (times(MINUS, e, at.of(self.after[c])) for c, e in self.row.upper.items())
        return times(add(at.of(self.row), *substituted), self.row.inverse)
