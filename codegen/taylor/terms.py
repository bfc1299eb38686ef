"""The expressions of a recurrence: sums and products of names and numbers, folded where they are made.

They are small and never rearranged, because a step of order 24 has thousands of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

__all__ = ["ONE", "ZERO", "Assign", "Call", "Expr", "Name", "Number", "Product", "Quotient", "Sum", "add", "over",
           "show", "statement", "times"]  # fmt: skip

WIDEST = 110
"""Columns of a statement on one line."""


@dataclass(frozen=True, slots=True)
class Number:
    """A constant."""

    value: float


@dataclass(frozen=True, slots=True)
class Name:
    """A value that was computed before, or a piece of text that holds together as one."""

    text: str


@dataclass(frozen=True, slots=True)
class Sum:
    """At least two terms."""

    terms: tuple[Expr, ...]


@dataclass(frozen=True, slots=True)
class Product:
    """A number and further factors."""

    number: float
    factors: tuple[Expr, ...]


@dataclass(frozen=True, slots=True)
class Quotient:
    """above/below."""

    above: Expr
    below: Expr


@dataclass(frozen=True, slots=True)
class Call:
    """The value of a function."""

    function: str
    arguments: tuple[Expr, ...]


Expr = Number | Name | Sum | Product | Quotient | Call

ZERO, ONE = Number(0.0), Number(1.0)


@dataclass(frozen=True, slots=True)
class Assign:
    """target = value; a target may be several names."""

    target: str
    value: Expr


def add(*terms: Expr) -> Expr:
    """The sum, without zeros, its numbers together at the end."""
    number = 0.0
    rest: list[Expr] = []
    for term in _flat(terms):
        if isinstance(term, Number):
            number += term.value
        else:
            rest.append(term)
    if number or not rest:
        rest.append(Number(number))
    return rest[0] if len(rest) == 1 else Sum(tuple(rest))


def _flat(terms: tuple[Expr, ...]) -> Iterator[Expr]:
    for term in terms:
        if isinstance(term, Sum):
            yield from term.terms
        else:
            yield term


def times(*factors: Expr) -> Expr:
    """The product; its numbers become one in front."""
    number = 1.0
    rest: list[Expr] = []
    for factor in factors:
        if isinstance(factor, Number):
            number *= factor.value
        elif isinstance(factor, Product):
            number *= factor.number
            rest += factor.factors
        else:
            rest.append(factor)
    if not rest or number == 0.0:
        return Number(number)
    return rest[0] if number == 1.0 and len(rest) == 1 else Product(number, tuple(rest))


def over(above: Expr, below: Expr) -> Expr:
    """The quotient."""
    if isinstance(above, Number) and isinstance(below, Number):
        return Number(above.value / below.value)
    if above == ZERO or below == ONE:
        return above
    return Quotient(above, below)


# -- text ---------------------------------------------------------------------------------------------------------

SUM, TERM, FACTOR = range(3)
"""How tightly a piece of text holds together."""


def show(e: Expr) -> str:
    """The expression as Python text with as few parentheses as it can have."""
    return _text(e, SUM)


def _text(e: Expr, level: int) -> str:
    text, tight = _piece(e)
    return text if tight >= level else f"({text})"


def _piece(e: Expr) -> tuple[str, int]:
    match e:
        case Number(value):
            return repr(value), FACTOR if value >= 0.0 else SUM
        case Name(text):
            return text, FACTOR
        case Sum(terms):
            return _joined(_signed(terms)), SUM
        case Product(number, factors):
            if number < 0.0:
                return f"-{_text(times(Number(-number), *factors), TERM)}", SUM
            parts = [] if number == 1.0 else [repr(number)]
            return "*".join([*parts, *(_text(f, FACTOR) for f in factors)]), TERM
        case Quotient(above, below):
            return f"{_text(above, TERM)}/{_text(below, FACTOR)}", TERM
        case Call(function, arguments):
            return f"{function}({', '.join(map(show, arguments))})", FACTOR


def _signed(terms: tuple[Expr, ...]) -> list[tuple[str, str]]:
    """The sign and the text of each term, in their order: equal oscillators are summed alike."""
    parts = []
    for term in terms:
        below = (isinstance(term, Number) and term.value < 0.0) or (isinstance(term, Product) and term.number < 0.0)
        parts.append(("-" if below else "+", _text(times(Number(-1.0), term) if below else term, TERM)))
    return parts


def _joined(parts: list[tuple[str, str]]) -> str:
    (sign, first), *rest = parts
    return ("-" if sign == "-" else "") + first + "".join(f" {s} {text}" for s, text in rest)


def statement(assign: Assign) -> list[str]:
    """The lines of an assignment; a long sum is broken between terms."""
    line = f"{assign.target} = {show(assign.value)}"
    if len(line) <= WIDEST:
        return [line]
    words = show(assign.value).split(" ")
    lines, row = [f"{assign.target} = ("], "   "
    for word in words:
        if len(row) + 1 + len(word) > WIDEST and word not in "+-":
            sign = row[-2:] if row[-2:] in (" +", " -") else ""
            lines.append(row.removesuffix(sign) if sign else row)
            row = "   " + sign
        row += f" {word}"
    return [*lines, row, ")"]
