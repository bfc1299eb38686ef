"""From the right-hand sides of equations to series: one graph, in which equal subexpressions are one series.

A template of a node or a link is read for each of them in the same way, so that equal oscillators have equal bits.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from functools import reduce
from typing import TypeGuard, TypeVar, cast

import sympy as sp
from sympy.functions.elementary.piecewise import Piecewise

from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.calculus import derivative
from synchain.models.mechanics.components import TIME
from synchain.models.mechanics.jumps import JUMPING, KINKED

from ..program.expressions import ONE, ZERO, Expression, Name, Negation, Number
from ..program.lowering import lower
from ..program.passes import Names
from ..program.statements import Assign, let
from .jump_series import Jump, changing, leaping, templates, unpassed
from .series import (
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

STARTS: dict[type[sp.Expr], str] = {
    sp.exp: "exp", sp.log: "log", sp.sin: "sin", sp.cos: "cos", sp.tan: "tan", sp.sinh: "sinh", sp.cosh: "cosh",
    sp.tanh: "tanh", sp.atan: "atan", sp.asin: "asin", sp.acos: "acos", sp.asinh: "asinh", sp.acosh: "acosh",
    sp.atanh: "atanh", sp.erf: "erf",
}  # fmt: skip
"""The analytic functions, and the function of lanes that gives the first coefficient.

The others follow from the derivative that SymPy knows.
"""

S = TypeVar("S", bound=Series)


class InverseSum(sp.Function):
    """InverseSum(c, d, a): 1/(c + d exp(a))."""


class InverseCosh(sp.Function):
    """InverseCosh(a): 1/cosh(a)."""


ODD = (sp.sin, sp.tan, sp.sinh, sp.tanh, sp.atan, sp.asin, sp.asinh, sp.atanh, sp.erf)
EVEN = (sp.cos, sp.cosh)

SINGULAR = (sp.log, sp.tan, sp.asin, sp.acos, sp.acosh, sp.atanh)
"""Functions with a pole, or with arguments for which they have no value."""

STEEP = (sp.asin, sp.acos, sp.acosh)
"""Functions with a value and no slope at the ends of their arguments."""

BOUNDED = (sp.sin, sp.cos, sp.tanh, sp.erf, sp.asinh)
"""Functions that stay small, or nearly so, where their argument has a pole."""

STEADY = ("sin", "cos")
"""Functions of which some low coefficient is always as large as the argument makes the high ones."""

PLAIN = 3
"""Degree up to which the low coefficients of a polynomial of states tell how large the high ones become."""


def jump(equations: Equations) -> sp.Expr | None:
    """Return a part of some equations that no Taylor step passes; None if there is none."""
    return next(iter(_obstacles(equations)), None)


def check_jumps(equations: Equations) -> None:
    """Raise ValueError for equations with a part that no Taylor step passes."""
    for part, why in _obstacles(equations).items():
        raise ValueError(
            f"taylor: found {part}, {why}; expected functions with a series between zeros, and jumps that motion passes; "
            "use integrator dop853 or rodas5p"
        )


def _obstacles(equations: Equations) -> dict[sp.Expr, str]:
    """The parts that no Taylor step passes, in a fixed order, and why."""
    found = dict.fromkeys(
        unpassed(equations), "along which motion may slide, or which a contact or a mass matrix feels"
    )
    for own, ends in templates(equations):
        found |= dict.fromkeys(_unserial(own, changing(ends)), "which has no series")
        found |= dict.fromkeys(_guarding(own, changing(ends)), "a part of which has a pole, or no value, somewhere")
    return {part: found[part] for part in sorted(found, key=sp.default_sort_key)}


def may_cross_singularity(equations: Equations) -> bool:
    """True if motion may pass a place where some part has no series: the end of an arc, log|x| at 0, tanh(1/x) at its pole."""
    return any(
        _ends_series(part, changing(ends))
        for own, ends in templates(equations)
        for e in own
        for part in e.atoms(sp.Function, sp.Pow)
    )


def _ends_series(e: sp.Expr, moving: Set[sp.Symbol]) -> bool:
    """True for a part that stays finite, or has a finite integral, where its series ends.

    exp(-1/x) is not among them, as that of a temperature never comes near 0; exp(-1/x**2) and exp(-1/cos(t)) are.
    """
    argument = e.args[0]
    if isinstance(e, STEEP):
        return bool(argument.free_symbols & moving)
    if isinstance(e, sp.log):
        return isinstance(argument, sp.Abs) and bool(argument.free_symbols & moving)
    poles = [p for p in argument.atoms(sp.Pow, sp.tan) if _is_pole(p) and _is_singular(p, moving)]
    if isinstance(e, sp.exp):
        return any(p.free_symbols & moving == {TIME} or (p.is_Pow and p.exp.is_even) for p in poles)
    return bool(poles) and (isinstance(e, BOUNDED) or (_is_pole(e) and _inverse(argument) is not None))


def _is_pole(e: sp.Expr) -> bool:
    """True for a negative power or a tangent."""
    return bool(isinstance(e, sp.tan) or (e.is_Pow and e.exp.is_negative))


def is_analytic(equations: Equations) -> bool:
    """True if no rate has a jump or a kink in the states or in time."""
    return not any(
        part.free_symbols & changing(ends) and type(part) not in STARTS
        for own, ends in templates(equations)
        for e in own
        for part in e.atoms(sp.Function, *KINKED)
    )


def is_linear(equations: Equations) -> bool:
    """True if the rates are sums of states with constant coefficients and of terms of time."""
    parts = [(node.rhs, node.state, {TIME, *node.state}) for node in equations.nodes]
    parts += [(e.rhs, (*e.here, *e.there), {TIME, *e.here, *e.there}) for e in equations.edges]
    # the first slope that moves is enough: those of large nodes take seconds
    slopes = ((derivative(e, s), moving) for rates, own, moving in parts for e in rates for s in own)
    return not any(slope.free_symbols & moving for slope, moving in slopes) and equations.constant_mass


def _unserial(expressions: Sequence[sp.Expr], moving: Set[sp.Symbol]) -> set[sp.Expr]:
    """The parts without series: roots at a kink, and functions without a recurrence."""
    sided = (*KINKED, *JUMPING, Piecewise)
    functions = {part for e in expressions for part in e.atoms(sp.Function) if not isinstance(part, (*STARTS, *sided))}
    powers = {part for e in expressions for part in e.atoms(sp.Pow) if part.base.free_symbols & moving}
    roots = {p for p in powers if p.exp.is_integer is not True}
    roots = {p for p in roots if any(isinstance(f, sided) for f in sp.Mul.make_args(p.base))}
    return roots | {part for part in functions if part.free_symbols & moving}


def _guarding(expressions: Sequence[sp.Expr], moving: Set[sp.Symbol]) -> set[sp.Expr]:
    """Choices and jumps whose parts have no series at some places, and arcs, which series carry on over a pole.

    All pieces of a choice have series, chosen or not, so that a piece without a value ends a step.
    """
    parts = {part for e in expressions for part in e.atoms(Piecewise, *JUMPING, sp.atan)}
    return {
        part for part in parts if any(_is_singular(e, moving) for a in part.args for e in a.atoms(sp.Pow, sp.Function))
    }


def _is_singular(e: sp.Expr, moving: Set[sp.Symbol]) -> bool:
    """True for a root, a quotient or a function that has a pole, or no value, at some values of its argument."""
    argument = e.args[0]
    if not argument.free_symbols & moving or argument.is_positive:
        return False
    if isinstance(e, sp.Pow):
        return bool(e.exp.is_integer is not True or e.exp.is_negative)
    return isinstance(e, SINGULAR)


@dataclass(frozen=True, slots=True)
class Template:
    """Expressions with their repeated parts named: statements first, results last."""

    statements: tuple[tuple[sp.Symbol, sp.Expr], ...]
    results: tuple[sp.Expr, ...]

    @classmethod
    def of(cls, expressions: Sequence[sp.Expr], moving: Iterable[sp.Symbol], supply: Iterator[sp.Symbol]) -> Template:
        """Share the repeated parts under names of the supply; of those, and of symbols, some are `moving`."""
        symbols = frozenset(moving)
        shared, reduced = sp.cse(leaping(expressions, symbols), symbols=supply, order="canonical")
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
    """Makes series of templates; `names` supplies what they are called.

    Attributes
    ----------
    series : list of Series
        All that were made, each behind those whose coefficients of the same order it needs.
    inline, inline_start : set of Series
        Those whose coefficients, or first coefficients, are written where they are used.
    watched : list of Series
        Those that can be small to all orders and large soon after, such as exp(-x**2) far from 0: no step is right behind
        the place where their terms stop falling, however small these are now.
    constants : list of Assign
        What depends on parameters alone, computed once.
    """

    def __init__(self, names: Names) -> None:
        self.series: list[Series] = []
        self.inline: set[Series] = set()
        self.inline_start: set[Series] = set()
        self.watched: list[Series] = []
        self.constants: list[Assign] = []
        self.known: dict[tuple[object, ...], Series] = {}
        self.numbers: dict[Series, int] = {}
        self.fixed: dict[sp.Expr, Name] = {}
        self.supplies = {what: names.fresh(what) for what in ("p", *_words())}
        self.moving: dict[sp.Symbol, Series] = {}
        self.swap: dict[sp.Symbol, sp.Expr] = {}
        self.made: dict[sp.Expr, Series] = {}

    def read(
        self, template: Template, moving: Mapping[sp.Symbol, Series], swap: Mapping[sp.Symbol, sp.Expr]
    ) -> list[Series]:
        """The series of a template's results; `moving` symbols stand for series, constant ones are swapped."""
        self.moving, self.swap, self.made = dict(moving), dict(swap), {}
        for symbol, e in template.statements:
            self.moving[symbol] = self.of(e)
        return [self.of(e) for e in template.results]

    def settle(self, roots: Sequence[Series]) -> None:
        """Leave out what no root needs, name the rest, and find sums that are used once."""
        self.series = self.behind(roots)
        hiding = _hiding([*roots, *(kink.base for kink in self.kinks)])
        self.watched = [s for s in self.series if s in hiding]
        uses = Counter([*roots, *(used for s in self.series for used in s.linear)])
        starts = uses + Counter(used for s in self.series for used in s.started)
        convolved = {used for s in self.series for used in s.convolved}
        for s in self.series:
            s.name = s.name or self.fresh(type(s).__name__.lower())
            if isinstance(s, Linear | Slope) and s not in convolved:
                if uses[s] < 2:
                    self.inline.add(s)
                if starts[s] < 2:
                    self.inline_start.add(s)

    def fresh(self, what: str) -> str:
        """A name that is not yet taken."""
        return next(self.supplies[what]).name

    # -- series that are made once ----------------------------------------------------------------------------

    def put(self, kind: type[S], *parts: object) -> S:
        """The series of this kind with these parts."""
        key = (kind, *parts)
        return cast("S", self.known[key]) if key in self.known else self.enter(key, kind(*parts))

    def enter(self, key: tuple[object, ...], series: S) -> S:
        """Take up a series that is new."""
        self.known[key] = series
        self.series.append(series)
        return series

    def sum(self, terms: Sequence[tuple[Expression, Series]], constant: Expression = ZERO) -> Series:
        """constant + sum of factor * series; a difference and its negative share a series."""
        pairs = []
        for factor, series in terms:
            if isinstance(series, Constant):
                constant = add(constant, times(factor, series.value))
            else:
                own, inner = split(series)
                pairs.append((times(factor, own), inner))
        if not pairs:
            return Constant(constant)
        if len(pairs) == 1 and pairs[0][0] == ONE and constant == ZERO:
            return pairs[0][1]
        if len(pairs) == 2 and constant == ZERO and all(isinstance(factor, Number) for factor, _ in pairs):
            pairs.sort(key=lambda pair: self.number(pair[1]))
            if _negative(pairs[0][0]):
                turned = tuple((times(Number(-1.0), factor), series) for factor, series in pairs)
                return self.put(Linear, ((Number(-1.0), self.put(Linear, turned, ZERO)),), ZERO)
        return self.put(Linear, tuple(pairs), constant)

    def number(self, series: Series) -> int:
        """The place of a series among those that have been asked for it."""
        return self.numbers.setdefault(series, len(self.numbers))

    def product(self, left: Series, right: Series) -> Series:
        """left * right, constant factors in front; a sum of a constant and one scaled series is multiplied out."""
        if isinstance(left, Constant):
            return self.sum([(left.value, right)])
        if isinstance(right, Constant):
            return self.sum([(right.value, left)])
        (a, left), (b, right) = split(left), split(right)
        for one, other in ((left, right), (right, left)):
            if left is not right and _is_scaled(one):
                ((factor, moving),) = one.terms
                parts = [(one.constant, other), (factor, self.product(moving, other))]
                return self.sum([(times(a, b, weight), part) for weight, part in parts])
        inner = self.put(Square, left) if left is right else self.put(Product, left, right)
        return self.sum([(times(a, b), inner)])

    def choice(self, gap: Series, *values: Series) -> Series:
        """One of some values: above where a series is positive, below where it is negative, between them where it is zero.

        Two values agree where the series is zero.
        """
        if isinstance(gap, Constant) and isinstance(gap.value, Number):
            size, middle = gap.value.value, values[len(values) // 2]
            return values[0] if size > 0.0 else values[-1] if size < 0.0 else middle
        factor, inner = split(gap)
        side, kind = (Kink, Choice) if len(values) == 2 else (Brink, Leaping)
        if not isinstance(factor, Number):
            return self.put(kind, self.put(side, gap), *values)
        return self.put(kind, self.put(side, inner), *(reversed(values) if _negative(factor) else values))

    def whole(self, series: Series) -> Series:
        """The whole number below a series."""
        factor, inner = split(series)
        part = self.put(Fraction, series, inner if factor == Number(-1.0) else series)
        rest = self.sum([(Number(-1.0), part)], ONE)
        return self.put(Whole, series, self.put(Brink, part), self.put(Brink, rest))

    def larger(self, left: Series, right: Series) -> Series:
        """The larger one of two series."""
        return self.choice(self.sum([(ONE, left), (Number(-1.0), right)]), left, right)

    def smaller(self, left: Series, right: Series) -> Series:
        """The smaller one of two series."""
        return self.choice(self.sum([(ONE, left), (Number(-1.0), right)]), right, left)

    @property
    def kinks(self) -> list[Kink]:
        """The kinks of all series; what does not move has none."""
        return [s for s in self.series if isinstance(s, Kink) and not isinstance(s.base, Constant)]

    @property
    def gaps(self) -> list[Series]:
        """The series in which kinks are looked for, less those that are as right as the states."""
        return list(dict.fromkeys(kink.base for kink in self.kinks if not _is_affine(kink.base)))

    @property
    def positive(self) -> list[Series]:
        """The series that cannot pass zero: roots, and what roots, powers and logarithms are taken of."""
        found: list[Series] = []
        for s in self.series:
            match s:
                case SquareRoot():
                    found.append(s)
                case Power():
                    found += [s, s.base]
                case QuotientIntegral() if s.function == "log":
                    found.append(s.argument)
        return list(dict.fromkeys(found))

    def behind(self, roots: Iterable[Series]) -> list[Series]:
        """The series that some need for a coefficient, and they themselves, in the order of `series`."""
        needed = _needed(roots)
        return [s for s in self.series if s in needed]

    # -- expressions ------------------------------------------------------------------------------------------

    def moves(self, e: sp.Expr) -> bool:
        """True if an expression changes within a step."""
        return any(s in self.moving for s in e.free_symbols)

    def of(self, e: sp.Expr) -> Series:
        """The series of an expression."""
        if e not in self.made:
            self.made[e] = self.make(e)
        return self.made[e]

    def make(self, e: sp.Expr) -> Series:
        if not self.moves(e):
            return Constant(self.constant(e.xreplace(self.swap)))
        if e.is_Symbol:
            return self.moving[e]
        if e.is_Add:
            parts = [self.scaled(a) for a in e.args if self.moves(a)]
            rest = sp.Add(*(a for a in e.args if not self.moves(a)))
            return self.sum(parts, self.constant(rest.xreplace(self.swap)))
        if e.is_Mul:
            return self.term(e)
        if e.is_Pow:
            return self.power(e.base, e.exp)
        if isinstance(e, (*KINKED, Piecewise)):
            return self.kinked(e)
        if isinstance(e, Jump):
            return self.choice(*map(self.of, e.args))
        if isinstance(e, sp.floor):
            return self.whole(self.of(e.args[0]))
        if isinstance(e, InverseSum):
            return self.sigmoid(self.of(e.args[2]), (float(e.args[0]), float(e.args[1])))
        if isinstance(e, InverseCosh):
            return self.secant(self.of(e.args[0]))
        return self.function(e)

    def constant(self, e: sp.Expr) -> Expression:
        """What does not change within a step: a number, a parameter or a name for what is computed once."""
        if e.is_number:
            return Number(float(e if e.is_Rational else e.evalf(30)))
        if e.is_Symbol:
            return Name(e.name)
        number, rest = e.as_coeff_Mul()
        if number != 1:
            return times(self.constant(number), self.constant(rest))
        return self.named(e, lower(e))

    def named(self, e: sp.Expr, value: Expression) -> Name:
        """The name of a constant, which is computed once."""
        if e not in self.fixed:
            name = self.fresh("p")
            self.constants.append(let(name, value))
            self.fixed[e] = Name(name)
        return self.fixed[e]

    def scaled(self, e: sp.Expr) -> tuple[Expression, Series]:
        """Constant factor and series of a term."""
        factors = sp.Mul.make_args(e)
        constant = sp.Mul(*(f for f in factors if not self.moves(f)))
        return self.constant(constant.xreplace(self.swap)), self.of(sp.Mul(*(f for f in factors if self.moves(f))))

    def term(self, e: sp.Expr) -> Series:
        """A product with a constant, or of series."""
        if not all(self.moves(f) for f in e.args):
            return self.sum([self.scaled(e)])
        above = [self.of(f) for f in _sorted(e.args) if not _is_divisor(f)]
        below = [self.of(1 / f) for f in _sorted(e.args) if _is_divisor(f)]
        top = reduce(self.product, above) if above else Constant(ONE)
        return self.put(Ratio, top, reduce(self.product, below)) if below else top

    def power(self, base: sp.Expr, exponent: sp.Expr) -> Series:
        if self.moves(exponent):
            return self.of(sp.exp(exponent * sp.log(base), evaluate=False))
        if not (2 * exponent).is_Integer:
            inner = self.of(base)
            return self.put(Power, inner, self.put(Slope, inner), self.constant(exponent.xreplace(self.swap)))
        if exponent.is_negative:
            if (inverse := _inverse(base)) is not None and exponent.is_Integer:
                return self.of(inverse**-exponent)
            return self.put(Ratio, Constant(ONE), self.of(base**-exponent))
        if exponent == sp.S.Half:
            return self.put(SquareRoot, self.of(base))
        if not exponent.is_Integer:
            return self.product(self.of(base ** (exponent - sp.S.Half)), self.of(sp.sqrt(base)))
        half = self.of(base ** (exponent // 2))
        if exponent % 2 == 0:
            return self.product(half, half)
        return self.product(self.of(base ** (exponent - 1)), self.of(base))

    def kinked(self, e: sp.Expr) -> Series:
        """An absolute value, the largest or smallest of some, or a choice."""
        if isinstance(e, Piecewise):
            (piece, condition), *rest = e.args
            pieces = self.of(piece), self.of(Piecewise(*rest))
            rises = isinstance(condition, sp.StrictGreaterThan | sp.GreaterThan)
            return self.choice(self.of(condition.lhs - condition.rhs), *(pieces if rises else reversed(pieces)))
        parts = [self.of(a) for a in _sorted(e.args)]
        if isinstance(e, sp.Abs):
            return self.choice(parts[0], parts[0], self.sum([(Number(-1.0), parts[0])]))
        return reduce(self.larger if isinstance(e, sp.Max) else self.smaller, parts)

    def function(self, e: sp.Expr) -> Series:
        """A function of one argument, even and odd ones of the argument without its sign."""
        argument = self.of(e.args[0])
        factor, inner = split(argument)
        if factor == Number(-1.0) and type(e) in (*ODD, *EVEN):
            found = self.solved(type(e), inner)
            return found if type(e) in EVEN else self.sum([(factor, found)])
        return self.solved(type(e), argument)

    def solved(self, function: type[sp.Expr], argument: Series) -> Series:
        """A function of a series, by the differential equation that its derivative makes."""
        name, key = STARTS[function], (function, argument)
        if key in self.known:
            return self.known[key]
        if function is sp.tanh:
            return self.tanh(argument)
        place = sp.Dummy("a", real=True)
        derivative = function(place).diff(place)
        number = sp.Mul(*(f for f in sp.Mul.make_args(derivative) if f.is_number))
        derivative = derivative / number
        value = float(number.evalf(30))
        if _is_divisor(derivative):
            divisor = self.inside(1 / derivative, place, argument)
            quotient = self.enter(key, QuotientIntegral(name, argument, divisor, value, name=self.fresh(name)))
            quotient.slope = self.put(Slope, quotient)
            return quotient
        slope, kind = self.put(Slope, argument), Exponential if function is sp.exp else Integral
        integral = self.enter(key, kind(name, argument, slope, value, name=self.fresh(name)))
        integral.factor = self.inside(derivative, place, argument)
        return integral

    def tanh(self, argument: Series) -> Series:
        """tanh of a series; the slope is a series of its own, which has digits where 1 - tanh**2 has none."""
        slope = self.put(Slope, argument)
        found = self.enter((sp.tanh, argument), Integral("tanh", argument, slope, name=self.fresh("tanh")))
        bell = SquaredSecant("cosh", argument, slope, -2.0, name=self.fresh("squaredsecant"))
        self.series.append(bell)
        found.factor, bell.factor = bell, self.product(found, bell)
        return found

    def sigmoid(self, argument: Series, ends: tuple[float, float]) -> Series:
        """1/(c + d exp(a)) of a series, which neither the overflow nor the underflow of exp(a) spoils."""
        key = (Sigmoid, argument, ends)
        if key not in self.known:
            slope = self.put(Slope, argument)
            found = self.enter(key, Sigmoid("exp", argument, slope, -1.0, ends=ends, name=self.fresh("sigmoid")))
            crest = Crest("exp", argument, slope, ends=ends, name=self.fresh("crest"))
            self.series.append(crest)
            found.factor = crest
            crest.factor = self.product(self.sum([(Number(2.0 * ends[0]), found)], Number(-1.0)), crest)
        return self.known[key]

    def secant(self, argument: Series) -> Series:
        """1/cosh(a) of a series, as `sigmoid`."""
        key = (Secant, argument)
        if key not in self.known:
            slope, tilt = self.put(Slope, argument), self.solved(sp.tanh, argument)
            found = self.enter(key, Secant("cosh", argument, slope, -1.0, name=self.fresh("secant")))
            found.factor = self.product(tilt, found)
        return self.known[key]

    def inside(self, e: sp.Expr, place: sp.Symbol, argument: Series) -> Series:
        """The series of an expression in one symbol that stands for a series."""
        outer, self.moving, self.made = (self.moving, self.made), {place: argument}, {}
        found = self.of(e)
        self.moving, self.made = outer
        return found


def _needed(roots: Iterable[Series]) -> set[Series]:
    """All series that some need, and they themselves."""
    needed, open_ends = set[Series](), list(roots)
    while open_ends:
        s = open_ends.pop()
        if s not in needed:
            needed.add(s)
            open_ends += [*s.linear, *s.convolved, *s.started]
    return needed


def _is_affine(series: Series) -> bool:
    """True for a sum of states and time with constant factors."""
    if isinstance(series, Linear):
        return all(map(_is_affine, series.linear))
    return isinstance(series, State | Time | Constant)


def _hiding(roots: Iterable[Series]) -> set[Series]:
    """The series among the terms of some, and among those of what they are functions of, that are no plain polynomials."""
    found, seen, open_ends = set[Series](), set[Series](), list(roots)
    while open_ends:
        s = open_ends.pop()
        if s in seen:
            continue
        seen.add(s)
        match s:
            case Linear() | Choice() | Leaping():
                open_ends += s.linear
            case Integral() | QuotientIntegral():
                open_ends.append(s.argument)
            case Product() | Square() | Ratio() | SquareRoot() | Power():
                parts = {*s.linear, *s.convolved} - {s}
                open_ends += [part for factor in parts for part in factor.linear if isinstance(factor, Linear)]
                open_ends += [part for part in _needed(parts) if isinstance(part, Integral | QuotientIntegral)]
        if (
            isinstance(s, Integral | QuotientIntegral | Product | Square | Ratio | SquareRoot | Power)
            and _degree(s) > PLAIN
        ):
            found.add(s)
    return found


def _degree(series: Series) -> float:
    """The degree of a series as a polynomial in states, time, and sines and cosines of such; inf if it is none."""
    match series:
        case Linear() | Choice() | Leaping():
            return max(map(_degree, series.linear), default=0.0)
        case Product():
            return _degree(series.left) + _degree(series.right)
        case Square():
            return 2.0 * _degree(series.base)
        case Integral() if series.function in STEADY:
            return _degree(series.argument)
        case Integral() | QuotientIntegral() | Ratio() | SquareRoot() | Power():
            return math.inf
    return 1.0


def split(series: Series) -> tuple[Expression, Series]:
    """The constant factor of a series and the rest."""
    if isinstance(series, Linear) and len(series.terms) == 1 and series.constant == ZERO:
        return series.terms[0]
    return ONE, series


def _is_divisor(e: sp.Expr) -> bool:
    if not (e.is_Pow and e.exp.is_number and e.exp.is_negative and (2 * e.exp).is_Integer):
        return False
    return not e.exp.is_Integer or _inverse(e.base) is None


def _inverse(e: sp.Expr) -> sp.Expr | None:
    """1/e of c + d exp(a), c and d positive numbers, or of cosh(a); None of others."""
    if isinstance(e, sp.cosh):
        return InverseCosh(e.args[0])
    if e.is_Add and len(e.args) == 2:
        constant, moving = e.as_coeff_Add()
        factor, function = moving.as_coeff_Mul()
        if isinstance(function, sp.exp) and constant.is_positive and factor.is_positive:
            return InverseSum(constant, factor, function.args[0])
    return None


def _sorted(factors: Iterable[sp.Expr]) -> list[sp.Expr]:
    return sorted(factors, key=sp.default_sort_key)


def _is_scaled(series: Series) -> TypeGuard[Linear]:
    """True for c + f*s that nothing but a product needs: c*x + f*(s*x) has one series less, and the same rounding.

    A difference from a state or from time can be exact, and stays whole.
    """
    if not isinstance(series, Linear) or len(series.terms) > 1 or series.constant == ZERO:
        return False
    ((factor, moving),) = series.terms
    return factor not in (ONE, Number(-1.0)) and not isinstance(moving, State | Time | Linear)


def _negative(e: Expression) -> bool:
    return (isinstance(e, Number) and e.value < 0.0) or isinstance(e, Negation)


def _words() -> tuple[str, ...]:
    """What names of series begin with."""
    return (*dict.fromkeys(kind.__name__.lower() for kind in _kinds(Series)), *STARTS.values())


def _kinds(kind: type[Series]) -> Iterator[type[Series]]:
    for own in kind.__subclasses__():
        yield own
        yield from _kinds(own)
