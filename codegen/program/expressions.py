"""Expressions of a program as a tree; the order of terms never changes, because rounding depends on the order.

As in Python, `a + b` appends b to the sum a, and `a*b` appends b to the product a. If b is a sum (or product) itself, b
becomes a single term (or factor). `plus` flattens both sides.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar, TypeAlias


class Expression:
    """A value, a condition or an element of an array; operators build larger expressions."""

    __slots__ = ()
    __match_args__: ClassVar[tuple[str, ...]] = ()

    @property
    def parts(self) -> tuple[Expression, ...]:
        """The expressions one level below."""
        fields = (getattr(self, name) for name in self.__match_args__)
        listed = (field if isinstance(field, tuple) else (field,) for field in fields)
        return tuple(part for parts in listed for part in parts if isinstance(part, Expression))

    def walk(self) -> Iterator[Expression]:
        yield self
        for part in self.parts:
            yield from part.walk()

    def __add__(self, other: Value) -> Sum:
        return Sum((*terms_of(self), as_expression(other)))

    def __radd__(self, other: Value) -> Sum:
        return Sum((as_expression(other), self))

    def __sub__(self, other: Value) -> Sum:
        return Sum((*terms_of(self), Negation(as_expression(other))))

    def __mul__(self, other: Value) -> ProductExpr:
        return ProductExpr((*factors_of(self), as_expression(other)))

    def __rmul__(self, other: Value) -> ProductExpr:
        return ProductExpr((as_expression(other), self))

    def __truediv__(self, other: Value) -> Quotient:
        return Quotient(self, as_expression(other))

    def __rtruediv__(self, other: Value) -> Quotient:
        return Quotient(as_expression(other), self)


@dataclass(frozen=True, slots=True)
class Number(Expression):
    """A double, or a whole number in indices and exponents."""

    value: float | int


@dataclass(frozen=True, slots=True)
class Name(Expression):
    text: str


@dataclass(frozen=True, slots=True)
class Sum(Expression):
    """Terms, added from left to right."""

    terms: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class ProductExpr(Expression):
    """Factors, multiplied from left to right."""

    factors: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Quotient(Expression):
    top: Expression
    bottom: Expression


@dataclass(frozen=True, slots=True)
class PowerExpr(Expression):
    """A power, for languages with a mathematical library; kernels use products and roots instead."""

    base: Expression
    exponent: Expression


@dataclass(frozen=True, slots=True)
class Negation(Expression):
    value: Expression


@dataclass(frozen=True, slots=True)
class Call(Expression):
    """A call of a function that is listed in `functions` or defined in the kernel."""

    function: str
    arguments: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Conditional(Expression):
    condition: Expression
    yes: Expression
    no: Expression


@dataclass(frozen=True, slots=True)
class Compare(Expression):
    """A comparison of two values by <, <=, > or >=."""

    sign: str
    left: Expression
    right: Expression


@dataclass(frozen=True, slots=True)
class Junction(Expression):
    """Conditions joined by "and" or "or"."""

    word: str
    conditions: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Not(Expression):
    condition: Expression


@dataclass(frozen=True, slots=True)
class Load(Expression):
    """A load of `width` elements of an array into a register; of one element if `width` is None."""

    array: str
    index: Expression
    width: str | None = "WIDTH"


@dataclass(frozen=True, slots=True)
class Slice(Expression):
    """The indices from `start` up to `stop`."""

    start: Expression
    stop: Expression


Value: TypeAlias = Expression | float | int | str  # an expression, a number, or the name of a variable

ZERO, ONE = Number(0.0), Number(1.0)


def as_expression(value: Value) -> Expression:
    if isinstance(value, Expression):
        return value
    return Name(value) if isinstance(value, str) else Number(value)


def call(function: str, *arguments: Value) -> Call:
    return Call(function, tuple(map(as_expression, arguments)))


def plus(first: Expression, *others: Expression) -> Expression:
    """Return the sum of all terms of the expressions, in their order."""
    return Sum(tuple(term for e in (first, *others) for term in terms_of(e))) if others else first


def product(factors: Sequence[Expression]) -> Expression:
    return ProductExpr(tuple(factors)) if len(factors) > 1 else factors[0] if factors else ONE


def negative(e: Expression) -> Expression:
    """Return -e with its sign folded."""
    if isinstance(e, Negation):
        return e.value
    return Number(-e.value) if isinstance(e, Number) else Negation(e)


def scaled(factor: Value, e: Expression) -> Expression:
    """Return factor*e, multiplied from left to right."""
    match e:
        case Negation(value):
            return Negation(scaled(factor, value))
        case Quotient(top, bottom):
            return Quotient(scaled(factor, top), bottom)
    return ProductExpr((as_expression(factor), *factors_of(e)))


def linear(row: Iterable[float], values: Iterable[Value], start: Value | None = None) -> Expression:
    """Return start + sum row_j * value_j without zero terms and unit factors; return `ZERO` if all terms are zero."""
    terms: list[Expression] = [] if start is None else [as_expression(start)]
    for weight, value in zip(row, values, strict=False):
        if weight != 0.0:
            e = as_expression(value)
            term = e if abs(weight) == 1.0 else abs(weight) * e
            terms.append(term if weight > 0 else Negation(term))
    return plus(*terms) if terms else ZERO


def terms_of(e: Expression) -> tuple[Expression, ...]:
    """Return the terms of a sum, or the expression itself."""
    return e.terms if isinstance(e, Sum) else (e,)


def factors_of(e: Expression) -> tuple[Expression, ...]:
    """Return the factors of a product, or the expression itself."""
    return e.factors if isinstance(e, ProductExpr) else (e,)
