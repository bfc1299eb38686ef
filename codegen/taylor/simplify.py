"""Make sums, products and quotients, and simplify each as it is made.

Recurrences are built from these functions.  A step of order 24 has thousands of terms, so no later pass rearranges
them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ..program.expressions import (
    ONE,
    ZERO,
    Call,
    Expression,
    Negation,
    Number,
    Quotient,
    factors_of,
    negative,
    plus,
    product,
    terms_of,
)


def add(*terms: Expression) -> Expression:
    """Return the sum without zero terms; add up all numbers to one last term."""
    number = 0.0
    others: list[Expression] = []
    for term in (part for e in terms for part in terms_of(e)):
        if isinstance(term, Number):
            number += term.value
        else:
            others.append(term)
    if number or not others:
        others.append(Number(number))
    return plus(*others)


def times(*factors: Expression) -> Expression:
    """Return the product; multiply all numbers to one first factor, and all signs to one negation."""
    number = 1.0
    others: list[Expression] = []
    for factor in factors:
        if isinstance(factor, Negation):
            number, factor = -number, factor.value
        for part in factors_of(factor):
            if isinstance(part, Number):
                number *= part.value
            else:
                others.append(part)
    if not others or number == 0.0:
        return Number(number)
    size = product(others if abs(number) == 1.0 else [Number(abs(number)), *others])
    return negative(size) if number < 0.0 else size


def over(above: Expression, below: Expression) -> Expression:
    """Return the quotient."""
    if isinstance(above, Number) and isinstance(below, Number):
        return Number(above.value / below.value)
    if above == ZERO or below == ONE:
        return above
    return Quotient(above, below)


def absolute(e: Expression) -> Expression:
    return Call("absolute", (e,))


def within(size: Expression, period: float | None) -> Expression:
    """Return a size, at most the period of an angle."""
    return size if period is None else Call("minimum", (size, Number(period)))


def largest(values: Iterable[Expression]) -> Expression:
    return extreme("maximum", list(values))


def extreme(function: str, values: Sequence[Expression]) -> Expression:
    """Return nested calls of a function of two values as a balanced tree, which has short chains of dependences."""
    if len(values) == 1:
        return values[0]
    half = len(values) // 2
    return Call(function, (extreme(function, values[:half]), extreme(function, values[half:])))
