"""Read the user's expressions with a whitelist of `ast` nodes; no text is run.

`parse` turns a text into a `ParsedText`.  `ParsedText.evaluate` walks the syntax tree, and an `Algebra`
computes the value of every number, name and operation.  There are algebras of floats, exact numbers,
sums of cosines, symbolic weights and graphs.
"""

from __future__ import annotations

import ast
import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, NoReturn, TypeVar, cast

V = TypeVar("V")

_ARITHMETIC = re.compile(r"[0-9A-Za-z_.+\-*/() \t]*")


_SIGNS: Mapping[type[ast.cmpop], str] = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
}


_PARTNERS: Mapping[str, str] = {")": "(", "]": "["}


class NoMeaning(Exception):
    """Raised by an algebra for an operation, name or call that it does not support."""

    def __init__(self, reason: str = "") -> None:
        super().__init__(reason)
        self.reason = reason


class Algebra(Generic[V]):
    """Compute the values, of any type V, of numbers, names, operations and calls; raise errors for the others.

    A method that a subclass does not define raises NoMeaning; the reader then calls `refuse` with the
    piece of the expression.  A method whose result may be slow or large checks the sizes of its operands
    first.

    Attributes
    ----------
    deepest : int
        Most operations that may be nested.
    """

    deepest: int

    def refuse(self, node: ast.expr, reason: str) -> NoReturn:
        """Raise the error for a piece of the expression that has no meaning here."""
        raise NoMeaning(reason)

    def refuse_depth(self) -> NoReturn:
        """Raise the error for more than `deepest` nested operations."""
        raise NoMeaning

    def number(self, value: int | float) -> V:
        raise NoMeaning

    def name(self, name: str) -> V:
        raise NoMeaning

    def positive(self, value: V) -> V:
        raise NoMeaning

    def negative(self, value: V) -> V:
        raise NoMeaning

    def add(self, a: V, b: V) -> V:
        raise NoMeaning

    def subtract(self, a: V, b: V) -> V:
        return self.add(a, self.negative(b))

    def multiply(self, a: V, b: V) -> V:
        raise NoMeaning

    def divide(self, a: V, b: V) -> V:
        raise NoMeaning

    def remainder(self, a: V, b: V) -> V:
        raise NoMeaning

    def power(self, base: V, exponent: V) -> V:
        raise NoMeaning

    def whole_power(self, base: V, exponent: int) -> V:
        """base ** exponent, with a literal integer as exponent."""
        return self.power(base, self.number(exponent))

    def arguments(self, function: str, count: int, options: Sequence[str]) -> Sequence[Algebra[Any] | None]:
        """Return an algebra for each argument of a call, None for an argument passed on as text."""
        # Raise NoMeaning for an unknown function or a wrong number of arguments.
        raise NoMeaning

    def call(self, function: str, arguments: Sequence[Any], options: Mapping[str, str]) -> V:
        """Return the value of a call; `options` are the keyword arguments as text."""
        raise NoMeaning

    def compare(self, sign: str, a: V, b: V) -> V:
        """Return the condition `a sign b`, where `sign` is one of < <= > >= == !=."""
        raise NoMeaning

    def junction(self, word: str, conditions: Sequence[V]) -> V:
        """Join conditions by `word`, "and" or "or"."""
        raise NoMeaning

    def contrary(self, condition: V) -> V:
        """Return the condition "not condition"."""
        raise NoMeaning

    def choice(self, condition: V, value: V, otherwise: V) -> V:
        """Return "value if condition else otherwise"."""
        raise NoMeaning


class Arithmetic(Algebra[V]):
    """An algebra of values with Python's + and *; the results are checked."""

    def checked(self, value: Any) -> V:
        """Return the result of an operation; raise an error if it is too large."""
        raise NoMeaning

    def positive(self, value: V) -> V:
        return value

    def negative(self, value: Any) -> V:
        return cast("V", -value)

    def add(self, a: Any, b: Any) -> V:
        return self.checked(a + b)

    def multiply(self, a: Any, b: Any) -> V:
        return self.checked(a * b)


@dataclass(frozen=True, slots=True)
class ParsedText:
    """A text and its syntax tree, made by `parse`."""

    text: str
    tree: ast.expr

    def evaluate(self, algebra: Algebra[V]) -> V:
        """Return the value of the expression in an algebra; raises the errors of the algebra."""
        return self._value(self.tree, algebra, 0)

    def _value(self, node: ast.expr, algebra: Algebra[V], depth: int) -> V:
        if depth > algebra.deepest:
            algebra.refuse_depth()
        try:
            match node:
                case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
                    return algebra.number(number)
                case ast.Name(id=name):
                    return algebra.name(name)
                case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                    return algebra.positive(self._value(operand, algebra, depth + 1))
                case ast.UnaryOp(op=ast.USub(), operand=operand):
                    return algebra.negative(self._value(operand, algebra, depth + 1))
                case ast.BinOp():
                    return self._operation(node, algebra, depth + 1)
                case ast.Call(func=called) if (function := _called(called)) is not None:
                    return self._call(function, node, algebra, depth + 1)
            return self._logic(node, algebra, depth + 1)
        except NoMeaning as error:
            algebra.refuse(node, error.reason)

    def _operation(self, node: ast.BinOp, algebra: Algebra[V], depth: int) -> V:
        if isinstance(node.op, ast.BitXor):
            raise NoMeaning("found the sign ^; expected powers as x**2")
        if not isinstance(node.op, (ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Mod, ast.Pow)):
            raise NoMeaning
        a = self._value(node.left, algebra, depth)
        # Pass a literal integer exponent on as an int: some algebras support no other powers.
        match node.op, node.right:
            case ast.Pow(), ast.Constant(value=int() as exponent) if not isinstance(exponent, bool):
                return algebra.whole_power(a, exponent)
        b = self._value(node.right, algebra, depth)
        match node.op:
            case ast.Add():
                return algebra.add(a, b)
            case ast.Sub():
                return algebra.subtract(a, b)
            case ast.Mult():
                return algebra.multiply(a, b)
            case ast.Div():
                return algebra.divide(a, b)
            case ast.Mod():
                return algebra.remainder(a, b)
        return algebra.power(a, b)

    def _logic(self, node: ast.expr, algebra: Algebra[V], depth: int) -> V:
        match node:
            case ast.IfExp():
                parts = (node.test, node.body, node.orelse)
                condition, value, otherwise = (self._value(part, algebra, depth) for part in parts)
                return algebra.choice(condition, value, otherwise)
            case ast.Compare(ops=[op], comparators=[right]) if type(op) in _SIGNS:
                a, b = self._value(node.left, algebra, depth), self._value(right, algebra, depth)
                return algebra.compare(_SIGNS[type(op)], a, b)
            case ast.BoolOp():
                word = "and" if isinstance(node.op, ast.And) else "or"
                return algebra.junction(word, [self._value(part, algebra, depth) for part in node.values])
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return algebra.contrary(self._value(operand, algebra, depth))
        raise NoMeaning

    def _call(self, function: str, node: ast.Call, algebra: Algebra[V], depth: int) -> V:
        names = [keyword.arg for keyword in node.keywords if keyword.arg is not None]
        if len(names) < len(node.keywords):  # f(**options)
            raise NoMeaning
        readers = algebra.arguments(function, len(node.args), names)
        arguments = [
            self._written(argument) if reader is None else self._value(argument, reader, depth)
            for argument, reader in zip(node.args, readers, strict=True)
        ]
        values = (self._written(keyword.value) for keyword in node.keywords)
        return algebra.call(function, arguments, dict(zip(names, values, strict=True)))

    def _written(self, node: ast.expr) -> str:
        """Return the text of a piece in the form of a command line: (3, 4) as 3,4 and 1 / 10 as 1/10."""
        if isinstance(node, ast.Tuple):
            return ",".join(self._written(element) for element in node.elts)
        return (ast.get_source_segment(self.text, node) or "").replace(" ", "")


def _called(node: ast.expr) -> str | None:
    """Return the name of a called function, such as f, nodes.mean or nodes[3]; None for any other expression."""
    match node:
        case ast.Name(id=name):
            return name
        case ast.Attribute(value=ast.Name(id=name), attr=attribute):
            return f"{name}.{attribute}"
        case ast.Subscript(value=ast.Name(id=name), slice=ast.Constant(value=int() as i)) if not isinstance(i, bool):
            return f"{name}[{i}]"
    return None


def parse(text: str) -> ParsedText | None:
    """Parse a text; None if it is no Python expression."""
    stripped = text.strip()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return ParsedText(stripped, ast.parse(stripped, mode="eval").body)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None


def unpaired(text: str) -> str:
    """Describe the first unpaired bracket, as " with a ( that is not closed"; "" if all are paired."""
    waiting: list[str] = []
    for sign in text:
        if sign in _PARTNERS.values():
            waiting.append(sign)
        elif sign in _PARTNERS and (not waiting or waiting.pop() != _PARTNERS[sign]):
            return f" with a {sign} that nothing opens"
    return f" with a {waiting[-1]} that is not closed" if waiting else ""


def stray_character(text: str) -> str:
    """Return the first character that no arithmetic expression contains; "" if there is none."""
    arithmetic = _ARITHMETIC.match(text)
    return text[arithmetic.end() :][:1] if arithmetic else text[:1]
