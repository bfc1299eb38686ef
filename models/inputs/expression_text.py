"""Read a text as an expression of SymPy; subclasses of `Expressions` define the allowed names and functions."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NoReturn, TypeVar

import sympy as sp

from .checks import short_repr, suggestion
from .reader import Algebra, NoMeaning, ParsedText

# Largest numeric exponent, and largest constant: choices that keep expressions short and doubles finite.
EXPONENT, MAGNITUDE = 16, 1e100

# Name in text -> function that a model may call; generated code has the same functions.
FUNCTIONS: Mapping[str, Any] = {
    "abs": sp.Abs, "acos": sp.acos, "acosh": sp.acosh, "asin": sp.asin, "asinh": sp.asinh, "atan": sp.atan,
    "atan2": sp.atan2, "atanh": sp.atanh, "ceiling": sp.ceiling, "cos": sp.cos, "cosh": sp.cosh, "erf": sp.erf,
    "exp": sp.exp, "floor": sp.floor, "log": sp.log, "max": sp.Max, "min": sp.Min, "sign": sp.sign, "sin": sp.sin, "sinh": sp.sinh,
    "sqrt": sp.sqrt, "tan": sp.tan, "tanh": sp.tanh,
}  # fmt: skip


def _expm1(x: sp.Expr) -> sp.Expr:
    """Return exp(x) - 1 without cancellation, as a product that overflows only where exp(x) does."""
    return sp.tanh(x / 2) * (sp.exp(x) + 1)


def _log1p(x: sp.Expr) -> sp.Expr:
    """Return log(1 + x) = 2 asinh((w - 1/w)/2) with w = sqrt(1 + x): accurate near 0, undefined below -1."""
    return 2 * sp.asinh(x / (2 * sp.sqrt(1 + x)))


def exprel(x: sp.Expr | float) -> sp.Expr:
    """Return (exp(x) - 1)/x, with the value 1 at x = 0, as an expression that is accurate for all x.

    Rates of ion channels contain this function: x/(1 - exp(-x)) is 1/exprel(-x).  In text the name is ``exprel`` too.

    Parameters
    ----------
    x : Expr or number
        Any expression of the states, parameters and time of a model.

    Returns
    -------
    Expr
        An expression of exp, tanh, max and abs.

    Examples
    --------
    >>> import sympy as sp
    >>> from synchain import Field, exprel
    >>> V = sp.Symbol("V")
    >>> Field({V: 1/exprel(-V) - V}) == Field({"V": "1/exprel(-V) - V"})
    True

    See Also
    --------
    Field : A vector field of such expressions.
    """
    # Let m = max(1, |x|), c = x/m and d = x - c, so that |c| <= 1, and d = 0 for |x| <= 1.
    # Use exp(x) - 1 = (exp(c) - 1) + exp(c) (exp(d) - 1).  Both terms have the same sign: no cancellation.
    # (exp(c) - 1)/c = exp(c/2) sinh(c/2)/(c/2); sinh(y)/y is a power series in c**2, cut at an error of 5e-17.
    x = sp.sympify(x)
    m = sp.Max(1, sp.Abs(x))
    c = x / m
    z = c**2 / 4
    series: sp.Expr = sp.S.Zero
    for k in range(6, -1, -1):
        series = series * z + sp.Rational(1, sp.factorial(2 * k + 1))
    return sp.exp(c / 2) / m * (series + sp.exp(c / 2) * c * _expm1(x - c))


def _modulo(x: sp.Expr, m: sp.Expr) -> sp.Expr:
    """Return the remainder of x/m, with the sign of m."""
    return x - m * sp.floor(x / m)


# Further functions that text may call; each returns an expression of `FUNCTIONS`.
COMPOSED: Mapping[str, Callable[..., sp.Expr]] = {"expm1": _expm1, "exprel": exprel, "log1p": _log1p, "mod": _modulo}
# Number of arguments of functions that do not take exactly one; None means two or more.
_COUNTS: Mapping[Any, int | None] = {sp.atan2: 2, _modulo: 2, sp.Max: None, sp.Min: None}


class _Refusal(Exception):
    """An error with a complete message."""


B = TypeVar("B", bound=sp.Basic)


@dataclass(frozen=True, slots=True)
class Expressions(Algebra[sp.Basic]):
    """Algebra of SymPy expressions; operands are checked before each operation, so that constants stay bounded."""

    # A subclass defines the names and functions.

    what: str  # the subject of errors
    deepest = 100
    whole: ClassVar[float] = MAGNITUDE  # largest integer, also as numerator or denominator
    numbers: ClassVar[str] = "finite numbers"  # the condition on constants, for messages
    functions: ClassVar[Mapping[str, Callable[..., sp.Expr]]]  # by name, in the order of messages

    def read(self, expression: ParsedText) -> sp.Expr:
        value = self.meaning(expression, self.value)
        steep = [e for e in value.atoms(sp.Pow) if e.exp.is_number and not abs(e.exp) <= EXPONENT]
        if steep:
            raise ValueError(
                f"{self.what}: found the power {short_repr(steep[0])}; expected exponents up to {EXPONENT}"
            )
        return value

    def meaning(self, expression: ParsedText, checked: Callable[[sp.Basic], B]) -> B:
        """Return a value or a condition as `checked` returns it; errors become ValueError."""
        try:
            return checked(expression.evaluate(self))
        except _Refusal as refusal:
            raise ValueError(str(refusal)) from None
        except NoMeaning as error:
            raise ValueError(f"{self.what}: {error.reason}") from None
        except Exception as error:  # an error inside SymPy, e.g. for an undecidable comparison
            text, reason = short_repr(expression.text), " ".join(str(error).split())[:200]
            raise ValueError(f"{self.what}: {text} has no value: {reason or type(error).__name__}") from None

    def pieces(self) -> str:
        """List, for messages, the names and functions that expressions may contain."""
        raise NotImplementedError

    def function(self, name: str) -> Callable[..., sp.Expr] | None:
        """Return the function with a name; None for an unknown name."""
        return self.functions.get(name)

    def _known(self, name: str) -> Callable[..., sp.Expr]:
        function = self.function(name)
        if function is None:
            close = suggestion(name, self.functions)
            raise NoMeaning(f"unknown function {short_repr(name)}; known: {', '.join(self.functions)}{close}")
        return function

    def refuse(self, node: ast.expr, reason: str) -> NoReturn:
        piece = short_repr(ast.unparse(node))
        raise _Refusal(f"{self.what}: {reason or f'found {piece}; expected numbers, {self.pieces()}'}")

    def refuse_depth(self) -> NoReturn:
        raise _Refusal(f"{self.what}: more than {self.deepest} nested operations; expected fewer; add parentheses")

    def number(self, value: int | float) -> sp.Basic:
        if not abs(value) <= (self.whole if isinstance(value, int) else MAGNITUDE):
            raise NoMeaning(f"found {short_repr(value)}; expected numbers up to {MAGNITUDE:g}")
        return sp.Integer(value) if isinstance(value, int) else sp.Rational(repr(value))

    def positive(self, value: sp.Basic) -> sp.Basic:
        return value

    def negative(self, value: sp.Basic) -> sp.Basic:
        return -self.value(value)

    def add(self, a: sp.Basic, b: sp.Basic) -> sp.Basic:
        return self.value(a) + self.value(b)

    def subtract(self, a: sp.Basic, b: sp.Basic) -> sp.Basic:
        return self.value(a) - self.value(b)

    def multiply(self, a: sp.Basic, b: sp.Basic) -> sp.Basic:
        return self.value(a) * self.value(b)

    def divide(self, a: sp.Basic, b: sp.Basic) -> sp.Basic:
        if b == 0:
            raise NoMeaning(f"found a division by zero; expected {self.numbers}")
        return self.value(a) / self.value(b)

    def remainder(self, a: sp.Basic, b: sp.Basic) -> sp.Basic:
        if b == 0:
            raise NoMeaning(f"found a division by zero; expected {self.numbers}")
        return _modulo(self.value(a), self.value(b))

    def power(self, base: sp.Basic, exponent: sp.Basic) -> sp.Basic:
        lower, upper = self.value(base), self.value(exponent)
        if upper.is_number and not abs(upper) <= EXPONENT:
            raise NoMeaning(f"found the exponent {short_repr(upper)}; expected at most {EXPONENT}")
        if lower.is_number and not lower.is_positive and not upper.is_number:
            raise NoMeaning(f"found the power {short_repr(lower**upper)} of a number; expected a positive one")
        return lower**upper

    def arguments(self, function: str, count: int, options: Sequence[str]) -> Sequence[Algebra[Any] | None]:
        called = self._known(function)
        wanted = _COUNTS.get(called, 1)
        if options or (count < 2 if wanted is None else count != wanted):
            raise NoMeaning(f"{function} has {count + len(options)} arguments; expected {wanted or 'at least 2'}")
        return (self,) * count

    def call(self, function: str, arguments: Sequence[sp.Basic], options: Mapping[str, str]) -> sp.Basic:
        return self._known(function)(*map(self.value, arguments))

    def value(self, e: sp.Basic) -> sp.Expr:
        """Return the expression; NoMeaning if it is a condition, or a constant that is infinite or too large."""
        if not isinstance(e, sp.Expr):
            raise NoMeaning(f"found the condition {short_repr(e)}, which is no value; expected a value")
        large = next((number for number in _constants(e) if not self.fits(number)), None)
        if large is not None:
            raise NoMeaning(f"found {short_repr(large)}; expected {self.numbers} up to {MAGNITUDE:g}")
        return e

    def fits(self, number: sp.Expr) -> bool:
        """Return True for a constant that is finite and not too large."""
        if number.is_Rational:
            return bool(max(abs(number.p), number.q) <= self.whole)
        size = sp.N(number)
        return bool(size.is_finite and abs(size) <= MAGNITUDE)


def _constants(e: sp.Expr) -> Iterator[sp.Expr]:
    """Yield the constants of an expression: the expression, or the constant ones of its terms, factors or powers."""
    if e.is_number:
        yield e
    elif isinstance(e, sp.Mul | sp.Add | sp.Pow):
        yield from (part for part in e.args if part.is_number)
