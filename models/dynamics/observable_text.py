"""Observables as text: ``mean(nodes.mean(v**2/2))``; nothing in a text is run."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NoReturn, TypeVar

import sympy as sp

from ..inputs.checks import check_text, short_repr, suggestion
from ..inputs.reader import Algebra, Arithmetic, Expression, NoMeaning, parse
from .observable import Observable, Window, nodes, rate, real

__all__ = ["FUNCTIONS", "as_observable", "as_value"]

T = TypeVar("T")

LENGTH, DEPTH, EXPONENT, MAGNITUDE = 4000, 60, 16, 1e100
"""Most characters, most nested operations, largest exponent that is a number, largest constant."""

FUNCTIONS: Mapping[str, Callable[..., sp.Expr]] = {
    "abs": sp.Abs, "atan": sp.atan, "cos": sp.cos, "exp": sp.exp, "floor": sp.floor, "log": sp.log, "max": sp.Max,
    "min": sp.Min, "sign": sp.sign, "sin": sp.sin, "sqrt": sp.sqrt, "tanh": sp.tanh,
}  # fmt: skip
"""The functions of observables, by their names in text: those that generated kernels know."""

SPELLINGS = {"Abs": "abs", "Max": "max", "Min": "min"}
"""How SymPy spells some of them."""

OF_NODES: Mapping[str, Callable[[object], sp.Expr]] = {
    f"nodes.{name}": getattr(nodes, name) for name in ("sum", "mean", "maximum", "minimum", "std")
}
ONE_NODE = re.compile(r"nodes\[(\d+)\]")
KNOWN = (*FUNCTIONS, "rate", *OF_NODES, "nodes[3]")


def as_observable(what: str, value: object) -> Observable:
    """Return an observable in the form that its text says, from an observable or from a text.

    Parameters
    ----------
    what : str
        The subject of errors.
    value : Observable or str
        Such as ``mean(nodes.mean(v**2/2))``.

    Raises
    ------
    TypeError
        If the value is neither.
    ValueError
        For unreadable text and for functions that generated code does not know.
    """
    if isinstance(value, Observable):
        return _read(what, str(value))
    if not isinstance(value, str):
        raise TypeError(
            f"{what}: found {short_repr(value)} ({type(value).__name__}); "
            "expected an observable, e.g. mean(nodes.mean(x**2)), or its text"
        )
    return _read(what, check_text(what, value, LENGTH))


def as_value(what: str, value: object) -> sp.Expr:
    """Return an expression of states in the form that its text says, from an expression or from a text.

    Parameters and errors are those of `as_observable`, without a window.
    """
    if isinstance(value, str):
        text = check_text(what, value, LENGTH)
    else:
        try:
            text = sp.sstr(real(value), order="lex")
        except (TypeError, ValueError) as error:
            raise type(error)(f"{what}: {str(error).removeprefix('observable: ')}") from None
    expression = _parsed(what, text)
    if expression is None:
        raise ValueError(f"{what}: unreadable expression {short_repr(text)}; expected such as 'x_1 - x_2'")
    return real(_evaluated(what, text, expression, _Values(what)))


def _read(what: str, text: str) -> Observable:
    expression = _parsed(what, text)
    if expression is not None:
        match expression.tree:
            case ast.Call(func=ast.Name(id=name), args=[_], keywords=[]) if name in tuple(Window):
                return _evaluated(what, text, expression, _Windows(_Values(what)))
    windows = ", ".join(Window)
    raise ValueError(f"{what}: found {short_repr(text)}; expected one of {windows} of an expression outermost")


def _parsed(what: str, text: str) -> Expression | None:
    if len(text) > LENGTH:
        raise ValueError(f"{what}: found {len(text)} characters; expected at most {LENGTH}; define parts of it")
    return parse(text)


def _evaluated(what: str, text: str, expression: Expression, algebra: Algebra[T]) -> T:
    """The value of a text; errors of one line."""
    try:
        return expression.evaluate(algebra)
    except _Refusal as refusal:
        raise ValueError(str(refusal)) from None
    except ValueError as error:
        raise ValueError(f"{what}: {str(error).removeprefix('observable: ')}") from None
    except (TypeError, AttributeError, OverflowError, ArithmeticError) as error:  # of SymPy, which compares in vain
        reason = " ".join(str(error).split())[:200]
        raise ValueError(f"{what}: {short_repr(text)} has no value: {reason or type(error).__name__}") from None


class _Refusal(Exception):
    """An error in the words of this module."""


@dataclass(frozen=True, slots=True)
class _Windows(Algebra[Observable]):
    """The outermost call, which reduces a value over the window."""

    values: _Values
    deepest = DEPTH

    def arguments(self, function: str, count: int, options: Sequence[str]) -> Sequence[Algebra[Any]]:
        return (self.values,) * count

    def call(self, function: str, arguments: Sequence[Any], options: Mapping[str, str]) -> Observable:
        return Observable(Window(function), arguments[0])


@dataclass(frozen=True, slots=True)
class _Values(Arithmetic[sp.Expr]):
    """Expressions of states; constants are checked after every operation, so that none grows."""

    what: str
    deepest = DEPTH

    def refuse(self, node: ast.expr, reason: str) -> NoReturn:
        piece = short_repr(ast.unparse(node))
        expected = f"numbers, names, pi, + - * / ** and {', '.join(KNOWN)}"
        raise _Refusal(f"{self.what}: {reason or f'found {piece}; expected {expected}'}")

    def refuse_depth(self) -> NoReturn:
        raise _Refusal(f"{self.what}: more than {DEPTH} nested operations; expected fewer")

    def number(self, value: int | float) -> sp.Expr:
        if not abs(value) <= MAGNITUDE:
            raise NoMeaning(f"found {short_repr(value)}; expected numbers up to {MAGNITUDE:g}")
        return sp.Integer(value) if isinstance(value, int) else sp.Rational(repr(value))

    def name(self, name: str) -> sp.Expr:
        return sp.pi if name == "pi" else sp.Symbol(name, real=True)

    def divide(self, a: sp.Expr, b: sp.Expr) -> sp.Expr:
        if b == 0:
            raise NoMeaning("found a division by zero; expected finite values")
        return self.checked(a / b)

    def power(self, base: sp.Expr, exponent: sp.Expr) -> sp.Expr:
        if not (exponent.is_Rational and abs(exponent) <= EXPONENT and exponent.q <= 2):
            raise NoMeaning(f"found the exponent {short_repr(exponent)}; expected halves up to {EXPONENT}")
        made = self.checked(base**exponent)
        if made.is_Pow and made.exp.is_Rational and abs(made.exp) > EXPONENT:
            raise NoMeaning(f"found the exponent {made.exp}; expected at most {EXPONENT}")
        return made

    def compare(self, sign: str, a: sp.Expr, b: sp.Expr) -> sp.Expr:
        raise NoMeaning(f"found the condition {a} {sign} {b}; expected a value, such as the difference {a} - ({b})")

    def arguments(self, function: str, count: int, options: Sequence[str]) -> Sequence[Algebra[sp.Expr]]:
        name = SPELLINGS.get(function, function)
        if name not in KNOWN and not ONE_NODE.fullmatch(name):
            hint = suggestion(name, KNOWN)
            if name in tuple(Window):
                hint = "; over the window a value is reduced once, outermost"
            raise NoMeaning(f"unknown function {short_repr(function)}; known: {', '.join(KNOWN)}{hint}")
        if options or (count < 2 if name in ("max", "min") else count != 1):
            wanted = "at least 2" if name in ("max", "min") else "1"
            raise NoMeaning(f"{function} has {count + len(options)} arguments; expected {wanted}")
        return (self,) * count

    def call(self, function: str, arguments: Sequence[sp.Expr], options: Mapping[str, str]) -> sp.Expr:
        name = SPELLINGS.get(function, function)
        if name == "rate":
            return rate(arguments[0])
        if name in OF_NODES:
            return OF_NODES[name](arguments[0])
        if one := ONE_NODE.fullmatch(name):
            return nodes[int(one[1])](arguments[0])
        return self.checked(FUNCTIONS[name](*arguments))

    def checked(self, e: sp.Expr) -> sp.Expr:
        """The expression, if the constants at its top are finite and not too large."""
        parts = (e,) if e.is_number else e.args if isinstance(e, sp.Add | sp.Mul | sp.Pow) else ()
        for number in (part for part in parts if part.is_number):
            if number.is_Rational:
                large = max(abs(number.p), number.q) > MAGNITUDE
            else:
                size = sp.Abs(sp.N(number))
                large = not (size.is_finite and size <= MAGNITUDE)
            if large:
                raise NoMeaning(f"found {short_repr(number)}; expected finite numbers up to {MAGNITUDE:g}")
        return e
