"""Expressions of users: SymPy or text becomes an exact expression of real symbols that can be written as text again."""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from typing import Any, NoReturn

import sympy as sp

from ..inputs.checks import check_text, short_repr, typed_repr
from ..inputs.reader import Algebra, NoMeaning, parse

__all__ = ["exact", "read"]

LENGTH, DEPTH, BITS, LARGEST = 4000, 60, 4000, 10**6
"""Most characters and nested operations of a text, bits of a number, and largest constant that a function takes."""

_ONE: Mapping[str, Any] = {
    name: getattr(sp, name)
    for name in ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh", "exp",
                 "log", "sqrt", "erf", "Abs", "sign", "floor", "ceiling")
}  # fmt: skip

_TWO: Mapping[str, Any] = {"atan2": sp.atan2, "Mod": sp.Mod, "Min": sp.Min, "Max": sp.Max}

CONSTANTS: Mapping[str, Any] = {"pi": sp.pi, "E": sp.E}

_KNOWN = ("numbers, names, pi, + - * / **, parentheses and", *_ONE, *_TWO)


def exact(what: str, value: object) -> sp.Expr:
    """Return an expression with rationals for decimals and real symbols, in the form that its text has.

    Parameters
    ----------
    what : str
        The subject of errors.
    value : Expr or number
        The expression; 0.1 in it means 1/10.

    Raises
    ------
    TypeError
        If it is no expression.
    ValueError
        If it is not finite, or has a function that no text has.
    """
    if isinstance(value, bool) or not isinstance(value, sp.Expr | int | float):
        raise TypeError(f"{what}: found {typed_repr(value)}; expected an expression of symbols")
    e = sp.sympify(value)
    if e.has(sp.nan, sp.zoo, sp.oo, -sp.oo, sp.I):
        raise ValueError(f"{what}: found {short_repr(e)}; expected a real, finite expression")
    taken = sorted(s.name for s in e.free_symbols if s.name in CONSTANTS or s.name in _ONE or s.name in _TWO)
    if taken:
        raise ValueError(f"{what}: the symbol {taken[0]!r} has the name of a constant or a function; rename it")
    decimals = {number: sp.Rational(repr(float(number))) for number in e.atoms(sp.Float)}
    return read(what, str(e.xreplace(decimals)))


def read(what: str, text: object) -> sp.Expr:
    """Return the expression of a text; nothing in it is run.

    Parameters
    ----------
    what : str
        The subject of errors.
    text : str
        Numbers, names, arithmetic and the usual functions; decimals are exact.

    Raises
    ------
    TypeError
        If it is no text.
    ValueError
        If it is too long or too deep, has anything else in it, or is not finite.
    """
    words = check_text(what, text, LENGTH)
    expression = parse(words)
    if expression is None:
        raise ValueError(f"{what}: cannot read {short_repr(words)}; expected an expression, e.g. 'K*W*sin(x_j - x_i)'")
    found = expression.evaluate(_Expressions(what))
    if found.has(sp.nan, sp.zoo, sp.oo, -sp.oo, sp.I):
        raise ValueError(f"{what}: found {short_repr(words)}, which is {found}; expected a real, finite expression")
    return found


class _Expressions(Algebra[sp.Expr]):
    """Expressions of real symbols."""

    deepest = DEPTH

    def __init__(self, what: str) -> None:
        self.what = what

    def refuse(self, node: ast.expr, reason: str) -> NoReturn:
        raise ValueError(
            f"{self.what}: found {short_repr(ast.unparse(node))}{reason and f', {reason}'}; expected {' '.join(_KNOWN)}"
        )

    def refuse_depth(self) -> NoReturn:
        raise ValueError(f"{self.what}: found more than {DEPTH} nested operations; write it shorter")

    def number(self, value: int | float) -> sp.Expr:
        return self._bounded(sp.Rational(repr(value)) if abs(value) < float("inf") else sp.oo)

    def name(self, name: str) -> sp.Expr:
        if name in _ONE or name in _TWO:
            raise NoMeaning("a function without arguments")
        return CONSTANTS.get(name) or sp.Symbol(name, real=True)

    def positive(self, value: sp.Expr) -> sp.Expr:
        return value

    def negative(self, value: sp.Expr) -> sp.Expr:
        return -value

    def add(self, a: sp.Expr, b: sp.Expr) -> sp.Expr:
        return self._bounded(a + b)

    def multiply(self, a: sp.Expr, b: sp.Expr) -> sp.Expr:
        return self._bounded(a * b)

    def divide(self, a: sp.Expr, b: sp.Expr) -> sp.Expr:
        return self._bounded(a / b)

    def power(self, base: sp.Expr, exponent: sp.Expr) -> sp.Expr:
        if exponent.is_number and (not exponent.is_Rational or abs(exponent) > 1000):
            raise NoMeaning("an exponent that is too large")
        if base.is_Rational and exponent.is_Rational and _bits(base) * abs(exponent) > BITS:
            raise NoMeaning("a number that is too large")
        return base**exponent

    def arguments(self, function: str, count: int, options: Sequence[str]) -> Sequence[Algebra[Any] | None]:
        wanted = 1 if function in _ONE else 2 if function in _TWO else 0
        many = function in ("Min", "Max") and 2 <= count <= 8
        if not wanted or options or (count != wanted and not many):
            raise NoMeaning
        return (self,) * count

    def call(self, function: str, arguments: Sequence[sp.Expr], options: Mapping[str, str]) -> sp.Expr:
        if any(a.is_number and abs(sp.N(a)) > LARGEST for a in arguments):
            raise NoMeaning("a function of a large constant")
        return (_ONE.get(function) or _TWO[function])(*arguments)

    def _bounded(self, e: sp.Expr) -> sp.Expr:
        if e.is_Rational and _bits(e) > BITS:
            raise NoMeaning("a number that is too large")
        return e


def _bits(number: sp.Rational) -> int:
    """The length of a rational number."""
    return int(max(abs(number.p).bit_length(), number.q.bit_length()))
