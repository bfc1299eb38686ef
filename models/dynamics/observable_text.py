"""Observables as text, such as ``mean(nodes.mean(v**2/2))``; the text is parsed and never executed."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import sympy as sp

from ..inputs.checks import check_text, short_repr
from ..inputs.expression_text import COMPOSED, FUNCTIONS, Expressions
from ..inputs.reader import Algebra, NoMeaning, ParsedText, parse, unpaired
from .observable import Observable, ObservedWindow, nodes, rate, real

LENGTH = 4000
"""Most characters of a text (a choice)."""

VALUE_FUNCTIONS: Mapping[str, Callable[..., sp.Expr]] = {
    **FUNCTIONS,
    **COMPOSED,
    "rate": rate,
    **{f"nodes.{name}": getattr(nodes, name) for name in ("sum", "mean", "maximum", "minimum", "std")},
    "nodes[3]": nodes[3],
}
"""The functions of observables, by their names in text."""

SPELLINGS = {"Abs": "abs", "Max": "max", "Min": "min", "Mod": "mod"}
"""SymPy's printed names of functions, with the corresponding names of `VALUE_FUNCTIONS`."""

_ONE_NODE = re.compile(r"nodes\[(\d+)\]")


def as_observable(what: str, value: object) -> Observable:
    """Return an observable, from an observable or a text, in the form that survives printing and reading."""
    if isinstance(value, Observable):
        return _read(what, str(value))
    if not isinstance(value, str):
        raise TypeError(
            f"{what}: found {short_repr(value)} ({type(value).__name__}); "
            "expected an observable, e.g. mean(nodes.mean(x**2)), or its text"
        )
    return _read(what, check_text(what, value, LENGTH))


def as_value(what: str, value: object) -> sp.Expr:
    """Return an expression of states, from an expression or a text, in the form that survives printing and reading.

    Parameters and errors are those of `as_observable`, but there is no reduction over the window.
    """
    if isinstance(value, str):
        text = check_text(what, value, LENGTH)
    else:
        try:
            text = sp.sstr(real(value), order="lex")
        except (TypeError, ValueError) as error:
            raise type(error)(f"{what}: {str(error).removeprefix('observable: ')}") from None
    return _real(what, _parsed(what, text, "x_1 - x_2"))


@dataclass(frozen=True, slots=True)
class Condition:
    """A condition on observables, such as ``mean(v_1) > 0.1 and maximum(x_1) < P/alpha``."""

    text: str
    truth: sp.Basic  # a relation of the symbols in `observed` and of parameters
    observed: tuple[tuple[sp.Symbol, Observable], ...]  # the symbol of each observable


def as_condition(what: str, value: object) -> Condition:
    """Return the condition of a text: comparisons of observables, parameters and numbers, joined by and, or, not."""
    text = check_text(what, value, LENGTH)
    expression, reader = _parsed(what, text, "mean(x_1) > 0"), _OfWindow(what)
    truth = reader.meaning(expression, lambda truth: truth)
    if not reader.observed or isinstance(truth, sp.Expr):
        raise ValueError(f"{what}: found {short_repr(text)}; expected a comparison of observables, e.g. mean(x_1) > 0")
    return Condition(text, truth, tuple((symbol, observable) for observable, symbol in reader.observed.items()))


def _read(what: str, text: str) -> Observable:
    expression = _parsed(what, text, "mean(x_1 - x_2)")
    match expression.tree:
        case ast.Call(func=ast.Name(id=name), args=[value], keywords=[]) if name in tuple(ObservedWindow):
            return Observable(ObservedWindow(name), _real(what, ParsedText(expression.text, value)))
    windows = ", ".join(ObservedWindow)
    raise ValueError(f"{what}: found {short_repr(text)}; expected one of {windows} of an expression outermost")


def _parsed(what: str, text: str, example: str) -> ParsedText:
    """Parse a text; raise ValueError with an example if it is no expression."""
    if len(text) > LENGTH:
        raise ValueError(f"{what}: found {len(text)} characters; expected at most {LENGTH}; define parts of it")
    expression = parse(text)
    if expression is None:
        raise ValueError(
            f"{what}: unreadable expression {short_repr(text)}{unpaired(text)}; expected such as {example!r}"
        )
    return expression


def _real(what: str, expression: ParsedText) -> sp.Expr:
    """Return a parsed expression as a SymPy expression with real symbols."""
    try:
        return real(_OfNodes(what).read(expression))
    except ValueError as error:
        raise ValueError(f"{what}: {_reason(error).removeprefix(f'{what}: ')}") from None


def _reason(error: ValueError) -> str:
    return str(error).removeprefix("observable: ")


@dataclass(frozen=True, slots=True)
class _OfNodes(Expressions):
    """Read expressions with arbitrary names; constants may be complex, as in abs(nodes.mean(exp(sqrt(-1)*theta)))."""

    deepest = 60
    functions = VALUE_FUNCTIONS

    def pieces(self) -> str:
        return f"names, pi, + - * / ** and {', '.join(VALUE_FUNCTIONS)}"

    def name(self, name: str) -> sp.Basic:
        return sp.pi if name == "pi" else sp.Symbol(name, real=True)

    def compare(self, sign: str, a: sp.Basic, b: sp.Basic) -> sp.Basic:
        raise NoMeaning(
            f"found the condition {a} {sign} {b}; expected a value, such as the difference {a} - ({b}); "
            "sign, max and min make choices"
        )

    def function(self, name: str) -> Callable[..., sp.Expr] | None:
        one = _ONE_NODE.fullmatch(name)
        if one is None:
            return VALUE_FUNCTIONS.get(SPELLINGS.get(name, name))
        try:
            return nodes[int(one[1])]
        except ValueError as error:
            raise NoMeaning(_reason(error)) from None

    def arguments(self, function: str, count: int, options: Sequence[str]) -> Sequence[Algebra[Any] | None]:
        if function in tuple(ObservedWindow):
            raise NoMeaning(
                f"found {function} inside; expected values of an instant: over the window one is reduced once, outermost"
            )
        return Expressions.arguments(self, function, count, options)

    def call(self, function: str, arguments: Sequence[sp.Basic], options: Mapping[str, str]) -> sp.Basic:
        try:
            return Expressions.call(self, function, arguments, options)
        except ValueError as error:
            raise NoMeaning(_reason(error)) from None


_RELATIONS = {"<": sp.StrictLessThan, "<=": sp.LessThan, ">": sp.StrictGreaterThan, ">=": sp.GreaterThan}


@dataclass(frozen=True, slots=True)
class _OfWindow(Expressions):
    """Read conditions on observables; each observable becomes a symbol."""

    deepest = 60
    functions = FUNCTIONS
    observed: dict[Observable, sp.Symbol] = field(default_factory=dict)

    def pieces(self) -> str:
        return f"parameters, comparisons < <= > >=, and, or, not, and {', '.join((*ObservedWindow, *FUNCTIONS))}"

    def name(self, name: str) -> sp.Basic:
        return sp.pi if name == "pi" else sp.Symbol(name, real=True)

    def compare(self, sign: str, a: sp.Basic, b: sp.Basic) -> sp.Basic:
        if sign not in _RELATIONS:
            raise NoMeaning(f"found {sign}; expected < <= > or >=, as an observable is seldom exactly a number")
        return _RELATIONS[sign](self.value(a), self.value(b))

    def junction(self, word: str, conditions: Sequence[sp.Basic]) -> sp.Basic:
        return (sp.And if word == "and" else sp.Or)(*map(self._truth, conditions))

    def contrary(self, condition: sp.Basic) -> sp.Basic:
        return sp.Not(self._truth(condition))

    def _truth(self, condition: sp.Basic) -> sp.Basic:
        if isinstance(condition, sp.Expr):
            raise NoMeaning(f"found the value {condition} in place of a comparison")
        return condition

    def arguments(self, function: str, count: int, options: Sequence[str]) -> Sequence[Algebra[Any] | None]:
        if function in tuple(ObservedWindow) and count == 1 and not options:
            return (None,)
        return Expressions.arguments(self, function, count, options)

    def call(self, function: str, arguments: Sequence[Any], options: Mapping[str, str]) -> sp.Basic:
        if function not in tuple(ObservedWindow):
            return Expressions.call(self, function, arguments, options)
        try:
            observable = _read(self.what, f"{function}({arguments[0]})")
        except ValueError as error:
            raise NoMeaning(str(error).removeprefix(f"{self.what}: ")) from None
        return self.observed.setdefault(observable, sp.Symbol(f"observed_{len(self.observed)}", real=True))
