"""Read exact numbers from text as SymPy expressions.

Accepted are integers, the letters in `values` (such as n), ``pi`` and ``I``, ``+ - * / **``,
parentheses, ``sqrt``, ``sin`` and ``cos`` of rational multiples of pi, and ``exp`` of rational multiples
of I*pi.  Decimals are refused, because they may be rounded.
"""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NoReturn

import sympy as sp

from ..algebra.equality import check_size, equal
from ..inputs.reader import Algebra, Arithmetic, NoMeaning, parse, stray_character

# Limits, chosen so that reading a number takes less than a second: characters, nested operations, digits of a literal,
# bits of a value.
LENGTH, DEPTH, DIGITS, BITS = 300, 24, 30, 20_000

GRAMMAR = "whole numbers, + - * / **, parentheses, sqrt, I, and sin cos exp of rational multiples of pi"

# Replaces pi in arguments of sin, cos and exp, so that SymPy evaluates them only after the angle is reduced.
_PI = sp.Dummy("pi", real=True)

_DECIMAL = re.compile(r"(?<![A-Za-z_])(?:[0-9]+\.[0-9]*|\.[0-9]+|[0-9]+(?=[eE][+-]?[0-9]))(?:[eE][+-]?[0-9]+)?")


def exact_number(text: str, values: Mapping[str, int] | None = None) -> sp.Expr:
    stripped = text.strip()
    if len(stripped) > LENGTH:
        raise ValueError(f"number written as {len(stripped)} characters; expected at most {LENGTH}; shorten it")
    stray = stray_character(stripped)
    if stray:
        raise ValueError(f"character {stray!r} in the number {stripped!r}; expected {GRAMMAR}; correct it")
    decimal = _DECIMAL.search(stripped)
    if decimal:
        raise ValueError(
            f"decimal {decimal[0]!r} in the number {stripped!r}; expected an exact number such as 1/2 or -2-sqrt(2); "
            "write ~ before a decimal to have it compared to its own digits, e.g. ~-3.414"
        )
    expression = parse(stripped)
    if expression is None:
        raise ValueError(f"unreadable number {stripped!r}; expected {GRAMMAR}, e.g. -2-sqrt(2)")
    number = expression.evaluate(_ExactNumbers(stripped, values or {}))
    check_size(number)
    return number


def whole_number(text: str, values: Mapping[str, int] | None = None) -> int:
    """Return the integer value of an expression such as ``"n-2"``; ValueError for any other value."""
    number = exact_number(text, values)
    if not number.is_Integer:
        raise ValueError(f"{text.strip()!r} is {number}; expected a whole number")
    return int(number)


@dataclass(frozen=True, slots=True)
class _ExactNumbers(Arithmetic[sp.Expr]):
    """Algebra of exact SymPy numbers; with `angle`, of arguments of sin, cos or exp, where pi is allowed too."""

    text: str
    values: Mapping[str, int]
    angle: bool = field(default=False, kw_only=True)
    deepest = DEPTH

    def refuse(self, node: ast.expr, reason: str) -> NoReturn:
        if reason:
            raise ValueError(f"{ast.unparse(node)} in the number {self.text!r}; {reason}")
        if isinstance(node, ast.BinOp):
            raise ValueError(f"unknown operation in the number {self.text!r}; expected {GRAMMAR}")
        self._refuse(ast.unparse(node))

    def _refuse(self, piece: str) -> NoReturn:
        letters = f" and the letters {', '.join(self.values)}" if self.values else ""
        hint = "; pi is read inside sin, cos and exp only" if piece == "pi" else ""
        raise ValueError(f"{piece!r} in the number {self.text!r}; expected {GRAMMAR}{letters}{hint}")

    def refuse_depth(self) -> NoReturn:
        raise ValueError(f"number {self.text!r} nests more than {DEPTH} operations; write it shorter")

    def number(self, value: int | float) -> sp.Expr:
        if isinstance(value, float):
            raise NoMeaning
        if value >= 10**DIGITS:
            raise ValueError(f"number {self.text!r} has a part of more than {DIGITS} digits; expected fewer")
        return sp.Integer(value)

    def name(self, name: str) -> sp.Expr:
        if name == "pi" and self.angle:
            return _PI
        if name in self.values:
            return sp.Integer(self.values[name])
        if name == "I":
            return sp.I
        raise NoMeaning

    def divide(self, a: sp.Expr, b: sp.Expr) -> sp.Expr:
        if b.has(_PI):
            raise ValueError(f"number {self.text!r} divides by pi; expected a rational times pi")
        return self.checked(a / self._divisor(b))

    def power(self, base: sp.Expr, exponent: sp.Expr) -> sp.Expr:
        if base.has(_PI) or exponent.has(_PI):
            self._refuse("pi")
        if not exponent.is_Rational or abs(exponent.p) > 64 or exponent.q > 12:
            raise ValueError(
                f"exponent {exponent} in the number {self.text!r}; expected p/q with |p| <= 64 and q <= 12"
            )
        if exponent < 0:
            self._divisor(base)
        if base.is_Rational and abs(exponent.p) * math.log2(max(abs(base.p), base.q, 2)) > BITS:
            self._refuse_size()
        return self.checked(base**exponent)

    def arguments(self, function: str, count: int, options: Sequence[str]) -> Sequence[Algebra[sp.Expr]]:
        if function not in ("sqrt", "sin", "cos", "exp") or count != 1 or options:
            raise NoMeaning
        return (replace(self, angle=function != "sqrt"),)

    def call(self, function: str, arguments: Sequence[sp.Expr], options: Mapping[str, str]) -> sp.Expr:
        (argument,) = arguments
        if function == "sqrt":
            return sp.sqrt(argument)
        unit, unit_text = (sp.I, "I*pi") if function == "exp" else (sp.S.One, "pi")
        turn = argument.coeff(_PI, 1) / unit
        if sp.expand(argument - turn * _PI * unit) != 0 or not turn.is_Rational:
            raise NoMeaning(f"expected a rational times {unit_text}")
        if turn.q > 10_000:
            raise NoMeaning("expected a denominator up to 10000")
        turn -= 2 * sp.floor(turn / 2)  # sin, cos and exp(I x) have the period 2π
        if function == "exp":
            return sp.exp(turn * sp.pi * sp.I)
        # Evaluate only short angles: SymPy writes others as nested radicals, which generate much larger fields.
        short = turn.q in (1, 2, 3, 4, 6)
        return (sp.sin if function == "sin" else sp.cos)(turn * sp.pi, evaluate=short)

    def _divisor(self, b: sp.Expr) -> sp.Expr:
        check_size(b)
        if equal(b, sp.S.Zero):
            raise ValueError(f"number {self.text!r} divides by zero; correct it")
        return b

    def checked(self, result: sp.Expr) -> sp.Expr:
        if result.is_Rational and max(int(result.p).bit_length(), int(result.q).bit_length()) > BITS:
            self._refuse_size()
        return sp.expand(result) if self.angle else result

    def _refuse_size(self) -> NoReturn:
        raise ValueError(f"number {self.text!r} grows beyond {BITS} bits; expected a smaller one")
