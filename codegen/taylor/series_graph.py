"""Build the graph of the series of right-hand sides; equal subexpressions become one series.

A `Template` holds the rates of a kind of node or link, with names for repeated parts.  `SeriesGraph.read` reads the
template once for every node or link of the kind.  The series of operands are created before the series that use them,
so that the coefficients of one order can be computed in the order of `SeriesGraph.series`.  Nodes of one kind read the
same template in the same way, so that equal oscillators have equal bits.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import TypeVar, cast

import sympy as sp
from sympy.functions.elementary.piecewise import Piecewise

from synchain.models.mechanics.jumps import KINKED

from ..program.expressions import ONE, ZERO, Expression, Name, Negation, Number
from ..program.lowering import lower
from ..program.passes import Names
from ..program.statements import Assign, let
from .graph_analysis import hidden, is_affine, needed
from .jump_series import Jump, with_jumps
from .series import (
    MINUS,
    Brink,
    Choice,
    Constant,
    Crest,
    Exponential,
    Fraction,
    Integral,
    Kink,
    Leaping,
    Linear,
    Power,
    Product,
    QuotientIntegral,
    Ratio,
    Secant,
    Series,
    Sigmoid,
    Slope,
    Square,
    SquaredSecant,
    SquareRoot,
    State,
    Time,
    Whole,
)
from .simplify import add, times

LANE_FUNCTIONS: dict[type[sp.Expr], str] = {
    sp.exp: "exp", sp.log: "log", sp.sin: "sin", sp.cos: "cos", sp.tan: "tan", sp.sinh: "sinh", sp.cosh: "cosh",
    sp.tanh: "tanh", sp.atan: "atan", sp.asin: "asin", sp.acos: "acos", sp.asinh: "asinh", sp.acosh: "acosh",
    sp.atanh: "atanh", sp.erf: "erf",
}  # fmt: skip
"""Analytic functions, each with the function on lanes for coefficient 0; further coefficients use the derivative."""

ODD = (sp.sin, sp.tan, sp.sinh, sp.tanh, sp.atan, sp.asin, sp.asinh, sp.atanh, sp.erf)
EVEN = (sp.cos, sp.cosh)

DIGITS = 30
"""Decimal digits to which SymPy evaluates a constant before it is rounded to the nearest double."""

S = TypeVar("S", bound=Series)


class InverseSum(sp.Function):
    """InverseSum(c, d, a): 1/(c + d exp(a))."""


class InverseCosh(sp.Function):
    """InverseCosh(a): 1/cosh(a)."""


@dataclass(frozen=True, slots=True)
class Template:
    """Expressions with names for repeated parts: the assignments of the names, then the results."""

    statements: tuple[tuple[sp.Symbol, sp.Expr], ...]
    results: tuple[sp.Expr, ...]

    @classmethod
    def of(cls, expressions: Sequence[sp.Expr], moving: Iterable[sp.Symbol], supply: Iterator[sp.Symbol]) -> Template:
        """Name the repeated parts that change within a step: those with symbols in `moving`; `supply` yields names."""
        symbols = frozenset(moving)
        shared, reduced = sp.cse(with_jumps(expressions, symbols), symbols=supply, order="canonical")
        constant: dict[sp.Symbol, sp.Expr] = {}
        statements = []
        for symbol, e in shared:
            e = e.xreplace(constant)
            if e.free_symbols & symbols:
                symbols |= {symbol}
                statements.append((symbol, e))
            else:
                constant[symbol] = e
        return cls(tuple(statements), tuple(e.xreplace(constant) for e in reduced))


class SeriesGraph:
    """Build and store the series of templates.

    Attributes
    ----------
    series : list of Series
        All series; each follows the series whose coefficients of the same order it needs.
    inline, inline_start : set of Series
        Series whose coefficients (`inline_start`: coefficient 0 only) are written inline where they are used.
    watched : list of Series
        Series whose coefficients can all be tiny although the series is large soon after (`hidden`); they limit the
        step.
    constants : list of Assign
        Assignments of functions of parameters alone, which a step computes once.
    """

    def __init__(self, names: Names) -> None:
        self.names = names
        self.series: list[Series] = []
        self.inline: set[Series] = set()
        self.inline_start: set[Series] = set()
        self.watched: list[Series] = []
        self.constants: list[Assign] = []
        self.supplies: dict[str, Iterator[sp.Symbol]] = {}
        # caches: series by kind and parts, names of constants, and numbers that fix the sign of differences
        self.by_parts: dict[tuple[object, ...], Series] = {}
        self.constant_names: dict[sp.Expr, Name] = {}
        self.numbers: dict[Series, int] = {}
        # state of `read`: series by symbol, values of constant symbols, series by expression
        self.moving: dict[sp.Symbol, Series] = {}
        self.substitutes: dict[sp.Symbol, sp.Expr] = {}
        self.by_expression: dict[sp.Expr, Series] = {}

    def read(
        self, template: Template, moving: Mapping[sp.Symbol, Series], substitutes: Mapping[sp.Symbol, sp.Expr]
    ) -> list[Series]:
        """Return the series of a template's results; `moving` are the series of symbols that depend on time."""
        self.moving, self.substitutes, self.by_expression = dict(moving), dict(substitutes), {}
        for symbol, e in template.statements:
            self.moving[symbol] = self.of(e)
        return [self.of(e) for e in template.results]

    def finish(self, roots: Sequence[Series]) -> None:
        """Drop the series that no root needs, name all others, and choose the series to write inline."""
        self.series = self.behind(roots)
        unseen = hidden([*roots, *(kink.base for kink in self.kinks)])
        self.watched = [s for s in self.series if s in unseen]
        uses = Counter([*roots, *(used for s in self.series for used in s.linear)])
        starts = uses + Counter(used for s in self.series for used in s.started)
        convolved = {used for s in self.series for used in s.convolved}
        for s in self.series:
            s.name = s.name or self.fresh(type(s).__name__.lower())
            # a sum that is used once, at the same order, needs no name; a convolution reads all orders, so it needs one
            if isinstance(s, Linear | Slope) and s not in convolved:
                if uses[s] < 2:
                    self.inline.add(s)
                if starts[s] < 2:
                    self.inline_start.add(s)

    def fresh(self, prefix: str) -> str:
        """Return a name that is not yet taken."""
        if prefix not in self.supplies:
            self.supplies[prefix] = self.names.fresh(prefix)
        return next(self.supplies[prefix]).name

    @property
    def kinks(self) -> list[Kink]:
        """Return the kinks whose series change within a step."""
        return [s for s in self.series if isinstance(s, Kink) and not isinstance(s.base, Constant)]

    @property
    def gaps(self) -> list[Series]:
        """Return the series whose zeros are kinks, except sums of states: the errors of the states limit those."""
        return list(dict.fromkeys(kink.base for kink in self.kinks if not is_affine(kink.base)))

    @property
    def positive(self) -> list[Series]:
        """Return the series that must not pass zero: roots, and arguments of roots, powers and logarithms."""
        series: list[Series] = []
        for s in self.series:
            match s:
                case SquareRoot():
                    series.append(s)
                case Power():
                    series += [s, s.base]
                case QuotientIntegral() if s.function == "log":
                    series.append(s.argument)
        return list(dict.fromkeys(series))

    def behind(self, roots: Iterable[Series]) -> list[Series]:
        """Return the roots and all series that enter their coefficients, in the order of `series`."""
        used = needed(roots)
        return [s for s in self.series if s in used]

    # -- sums, products, choices ------------------------------------------------------------------------------

    def unique(self, kind: type[S], *parts: object) -> S:
        """Return the series of this kind with these parts; create it at the first call."""
        key = (kind, *parts)
        return cast("S", self.by_parts[key]) if key in self.by_parts else self.enter(key, kind(*parts))

    def enter(self, key: tuple[object, ...], series: S) -> S:
        """Append a new series to `series` and to the cache."""
        self.by_parts[key] = series
        self.series.append(series)
        return series

    def sum(self, terms: Sequence[tuple[Expression, Series]], constant: Expression = ZERO) -> Series:
        """Return constant + sum of factor * series."""
        pairs = []
        for factor, series in terms:
            if isinstance(series, Constant):
                constant = add(constant, times(factor, series.value))
            else:
                inner_factor, inner = split(series)
                pairs.append((times(factor, inner_factor), inner))
        if not pairs:
            return Constant(constant)
        if len(pairs) == 1 and pairs[0][0] == ONE and constant == ZERO:
            return pairs[0][1]
        # a difference and its negative share one series: sort terms by first use, and make the first factor positive
        if len(pairs) == 2 and constant == ZERO and all(isinstance(factor, Number) for factor, _ in pairs):
            pairs.sort(key=lambda pair: self.numbers.setdefault(pair[1], len(self.numbers)))
            if _negative(pairs[0][0]):
                turned = tuple((times(MINUS, factor), series) for factor, series in pairs)
                return self.unique(Linear, ((MINUS, self.unique(Linear, turned, ZERO)),), ZERO)
        return self.unique(Linear, tuple(pairs), constant)

    def product(self, left: Series, right: Series) -> Series:
        """Return left * right with constant factors in front."""
        if isinstance(left, Constant):
            return self.sum([(left.value, right)])
        if isinstance(right, Constant):
            return self.sum([(right.value, left)])
        (a, left), (b, right) = split(left), split(right)
        # (c + f s) x becomes c x + f (s x): one series less, and the same rounding error.  exception: if f is 1 or -1
        # and s is a state or time, the difference c + f s can be exact and is not expanded
        for one, other in ((left, right), (right, left)):
            if left is right or not isinstance(one, Linear) or len(one.terms) > 1 or one.constant == ZERO:
                continue
            ((factor, moving),) = one.terms
            if factor not in (ONE, MINUS) and not isinstance(moving, State | Time | Linear):
                parts = [(one.constant, other), (factor, self.product(moving, other))]
                return self.sum([(times(a, b, weight), part) for weight, part in parts])
        inner = self.unique(Square, left) if left is right else self.unique(Product, left, right)
        return self.sum([(times(a, b), inner)])

    def choice(self, gap: Series, *values: Series) -> Series:
        """Return a choice by the sign of a gap: between (above, below) for a kink, or (above, at, below) for a jump."""
        if isinstance(gap, Constant) and isinstance(gap.value, Number):
            size, middle = gap.value.value, values[len(values) // 2]
            return values[0] if size > 0.0 else values[-1] if size < 0.0 else middle
        factor, inner = split(gap)
        side, kind = (Kink, Choice) if len(values) == 2 else (Brink, Leaping)
        if not isinstance(factor, Number):
            return self.unique(kind, self.unique(side, gap), *values)
        return self.unique(kind, self.unique(side, inner), *(reversed(values) if _negative(factor) else values))

    # -- expressions ------------------------------------------------------------------------------------------

    def moves(self, e: sp.Expr) -> bool:
        """Return True if an expression changes within a step."""
        return any(s in self.moving for s in e.free_symbols)

    def of(self, e: sp.Expr) -> Series:
        """Return the series of an expression."""
        if e not in self.by_expression:
            self.by_expression[e] = self.make(e)
        return self.by_expression[e]

    def make(self, e: sp.Expr) -> Series:
        if not self.moves(e):
            return Constant(self.constant(e))
        if e.is_Symbol:
            return self.moving[e]
        if e.is_Add:
            parts = [self.scaled(a) for a in e.args if self.moves(a)]
            return self.sum(parts, self.constant(sp.Add(*(a for a in e.args if not self.moves(a)))))
        if e.is_Mul:
            return self.term(e)
        if e.is_Pow:
            return self.power(e.base, e.exp)
        if isinstance(e, (*KINKED, Piecewise)):
            return self.kinked(e)
        match e:
            case Jump():
                return self.choice(*map(self.of, e.args))
            case sp.floor():
                # watch the distances to the integers below and above
                series = self.of(e.args[0])
                factor, inner = split(series)
                fraction = self.unique(Fraction, series, inner if factor == MINUS else series)
                to_next = self.sum([(MINUS, fraction)], ONE)
                return self.unique(Whole, series, self.unique(Brink, fraction), self.unique(Brink, to_next))
            case InverseSum():
                return self.sigmoid(self.of(e.args[2]), (float(e.args[0]), float(e.args[1])))
            case InverseCosh():
                return self.secant(self.of(e.args[0]))
        # an even or odd function of -a follows from that of a: both share one series
        argument = self.of(e.args[0])
        factor, inner = split(argument)
        if factor != MINUS or type(e) not in (*ODD, *EVEN):
            return self.function(type(e), argument)
        value = self.function(type(e), inner)
        return value if type(e) in EVEN else self.sum([(factor, value)])

    def constant(self, e: sp.Expr) -> Expression:
        """Return the value of a constant expression: a number, a parameter, or a name that the step computes once."""
        e = e.xreplace(self.substitutes)
        if e.is_number:
            return _double(e)
        number, factor = e.as_coeff_Mul()
        if factor.is_Symbol:
            value = Name(factor.name)
        else:
            if factor not in self.constant_names:
                self.constant_names[factor] = Name(self.fresh("p"))
                self.constants.append(let(self.constant_names[factor].text, lower(factor)))
            value = self.constant_names[factor]
        return value if number == 1 else times(_double(number), value)

    def scaled(self, e: sp.Expr) -> tuple[Expression, Series]:
        """Return the constant factor and the series of a term."""
        factors = sp.Mul.make_args(e)
        constant = sp.Mul(*(f for f in factors if not self.moves(f)))
        return self.constant(constant), self.of(sp.Mul(*(f for f in factors if self.moves(f))))

    def term(self, e: sp.Expr) -> Series:
        """Return the series of a product of constants and series."""
        if not all(self.moves(f) for f in e.args):
            return self.sum([self.scaled(e)])
        above = [self.of(f) for f in _sorted(e.args) if not _is_divisor(f)]
        below = [self.of(1 / f) for f in _sorted(e.args) if _is_divisor(f)]
        top = reduce(self.product, above) if above else Constant(ONE)
        return self.unique(Ratio, top, reduce(self.product, below)) if below else top

    def power(self, base: sp.Expr, exponent: sp.Expr) -> Series:
        if self.moves(exponent):
            return self.of(sp.exp(exponent * sp.log(base), evaluate=False))
        if not (2 * exponent).is_Integer:
            inner = self.of(base)
            return self.unique(Power, inner, self.unique(Slope, inner), self.constant(exponent))
        if exponent.is_negative:
            if (inverse := inverse_of(base)) is not None and exponent.is_Integer:
                return self.of(inverse**-exponent)
            return self.unique(Ratio, Constant(ONE), self.of(base**-exponent))
        if exponent == sp.S.Half:
            return self.unique(SquareRoot, self.of(base))
        if not exponent.is_Integer:
            return self.product(self.of(base ** (exponent - sp.S.Half)), self.of(sp.sqrt(base)))
        # integer powers by repeated squaring
        half = self.of(base ** (exponent // 2))
        if exponent % 2 == 0:
            return self.product(half, half)
        return self.product(self.of(base ** (exponent - 1)), self.of(base))

    def kinked(self, e: sp.Expr) -> Series:
        """Return the series of an absolute value, of Max, of Min, or of a choice."""
        if isinstance(e, Piecewise):
            (piece, condition), *others = e.args
            pieces = self.of(piece), self.of(Piecewise(*others))
            rises = isinstance(condition, sp.StrictGreaterThan | sp.GreaterThan)
            return self.choice(self.of(condition.lhs - condition.rhs), *(pieces if rises else reversed(pieces)))
        parts = [self.of(a) for a in _sorted(e.args)]
        if isinstance(e, sp.Abs):
            return self.choice(parts[0], parts[0], self.sum([(MINUS, parts[0])]))
        largest = isinstance(e, sp.Max)

        def extreme(left: Series, right: Series) -> Series:
            difference = self.sum([(ONE, left), (MINUS, right)])
            return self.choice(difference, *((left, right) if largest else (right, left)))

        return reduce(extreme, parts)

    # -- functions by their differential equations ------------------------------------------------------------

    def function(self, function: type[sp.Expr], argument: Series) -> Series:
        """Return a function of a series; the derivative gives the differential equation for the recurrence."""
        name, key = LANE_FUNCTIONS[function], (function, argument)
        if key in self.by_parts:
            return self.by_parts[key]
        # split the derivative with respect to a into a numerical factor and the remaining expression
        a = sp.Dummy("a", real=True)
        derivative = function(a).diff(a)
        number = sp.Mul(*(f for f in sp.Mul.make_args(derivative) if f.is_number))
        derivative, value = derivative / number, float(number.evalf(DIGITS))
        if function is not sp.tanh and _is_divisor(derivative):
            divisor = self.of_argument(1 / derivative, a, argument)
            quotient = self.enter(key, QuotientIntegral(name, argument, divisor, value, name=self.fresh(name)))
            quotient.slope = self.unique(Slope, quotient)
            return quotient
        slope, kind = self.unique(Slope, argument), Exponential if function is sp.exp else Integral
        integral = self.enter(key, kind(name, argument, slope, value, name=self.fresh(name)))
        if function is sp.tanh:
            # for large |a|, a separate series for 1/cosh(a)**2 is accurate; 1 - tanh(a)**2 is not
            bell = SquaredSecant("cosh", argument, slope, -2.0, name=self.fresh("squaredsecant"))
            self.series.append(bell)
            integral.factor, bell.factor = bell, self.product(integral, bell)
        else:
            integral.factor = self.of_argument(derivative, a, argument)
        return integral

    def of_argument(self, e: sp.Expr, symbol: sp.Symbol, argument: Series) -> Series:
        """Return the series of an expression in `symbol`, with `argument` as the series of the symbol."""
        outer = self.moving, self.by_expression
        self.moving, self.by_expression = {symbol: argument}, {}
        series = self.of(e)
        self.moving, self.by_expression = outer
        return series

    def sigmoid(self, argument: Series, ends: tuple[float, float]) -> Series:
        """Return 1/(c + d exp(a)) of a series a, accurate even if exp(a) overflows or underflows."""
        key = (Sigmoid, argument, ends)
        if key not in self.by_parts:
            slope = self.unique(Slope, argument)
            u = self.enter(key, Sigmoid("exp", argument, slope, -1.0, ends=ends, name=self.fresh("sigmoid")))
            crest = Crest("exp", argument, slope, ends=ends, name=self.fresh("crest"))
            self.series.append(crest)
            u.factor = crest
            crest.factor = self.product(self.sum([(Number(2.0 * ends[0]), u)], MINUS), crest)
        return self.by_parts[key]

    def secant(self, argument: Series) -> Series:
        """Return 1/cosh(a) of a series a, accurate even if cosh(a) overflows."""
        key = (Secant, argument)
        if key not in self.by_parts:
            slope, tanh = self.unique(Slope, argument), self.function(sp.tanh, argument)
            u = self.enter(key, Secant("cosh", argument, slope, -1.0, name=self.fresh("secant")))
            u.factor = self.product(tanh, u)
        return self.by_parts[key]


def split(series: Series) -> tuple[Expression, Series]:
    """Return the constant factor of a series and the series that it multiplies."""
    if isinstance(series, Linear) and len(series.terms) == 1 and series.constant == ZERO:
        return series.terms[0]
    return ONE, series


def inverse_of(e: sp.Expr) -> sp.Expr | None:
    """Return 1/e if e is cosh(a), or c + d exp(a) with positive numbers c and d; None otherwise."""
    if isinstance(e, sp.cosh):
        return InverseCosh(e.args[0])
    if e.is_Add and len(e.args) == 2:
        constant, moving = e.as_coeff_Add()
        factor, function = moving.as_coeff_Mul()
        if isinstance(function, sp.exp) and constant.is_positive and factor.is_positive:
            return InverseSum(constant, factor, function.args[0])
    return None


def _double(e: sp.Expr) -> Number:
    """Return the double nearest to a constant."""
    return Number(float(e if e.is_Rational else e.evalf(DIGITS)))


def _is_divisor(e: sp.Expr) -> bool:
    """Return True for a power that becomes the divisor of a `Ratio`."""
    if not (e.is_Pow and e.exp.is_number and e.exp.is_negative and (2 * e.exp).is_Integer):
        return False
    return not e.exp.is_Integer or inverse_of(e.base) is None


def _sorted(factors: Iterable[sp.Expr]) -> list[sp.Expr]:
    return sorted(factors, key=sp.default_sort_key)


def _negative(e: Expression) -> bool:
    return (isinstance(e, Number) and e.value < 0.0) or isinstance(e, Negation)
