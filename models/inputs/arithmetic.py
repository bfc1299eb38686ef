"""Numbers written as text in a scene file, read by a whitelist over `ast`: a scene file cannot run code.

Accepted: decimal numbers, ``pi``, ``+ - * / **``, parentheses and ``sqrt exp log sin cos`` of one argument.
"""

from __future__ import annotations

import ast
import math
import operator
import re
import warnings
from collections.abc import Callable

__all__ = ["constant"]

LENGTH, DEPTH, EXPONENT, MAGNITUDE = 200, 24, 100.0, 1e100
FUNCTIONS: dict[str, Callable[[float], float]] = {
    "cos": math.cos,
    "exp": math.exp,
    "log": math.log,
    "sin": math.sin,
    "sqrt": math.sqrt,
}
OPERATORS: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
GRAMMAR = "numbers, pi, + - * / **, parentheses and " + " ".join(FUNCTIONS)
_ALLOWED = re.compile(r"[0-9A-Za-z_.+\-*/() \t]*")


def constant(text: str) -> float:
    """Return the value of a constant expression such as ``"2*pi/1.15"``, in floating point.

    Raises ValueError on anything but a finite constant built from GRAMMAR, on more than LENGTH characters or
    DEPTH nested operations, an exponent beyond EXPONENT or an intermediate value beyond MAGNITUDE.
    """
    if len(text) > LENGTH:
        raise ValueError(f"number written as {len(text)} characters; expected at most {LENGTH}; give its value")
    stray = text[_match_length(text) :]
    if stray:
        power = "; write ** for a power" if stray[0] == "^" else ""
        raise ValueError(f"character {stray[0]!r} in the number {text!r}; expected {GRAMMAR}{power}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ValueError(f"unreadable number {text!r}; expected {GRAMMAR}, e.g. '2*pi/1.15'") from None
    return _value(tree.body, text, 0)


def _match_length(text: str) -> int:
    found = _ALLOWED.match(text)
    return found.end() if found else 0


def _value(node: ast.AST, text: str, depth: int) -> float:
    if depth > DEPTH:
        raise ValueError(f"number {text!r} nests more than {DEPTH} operations; write it shorter")
    try:
        value = _evaluate(node, text, depth + 1)
    except (OverflowError, ZeroDivisionError) as error:
        raise ValueError(f"number {text!r}: {error}; expected a finite value") from None
    if isinstance(value, complex) or not abs(value) <= MAGNITUDE:
        found = "a complex value" if isinstance(value, complex) else f"an intermediate value of {value:g}"
        raise ValueError(f"number {text!r} has {found}; expected real values up to {MAGNITUDE:g}")
    return value


def _evaluate(node: ast.AST, text: str, depth: int) -> float:
    match node:
        case ast.Constant(value=bool()):
            pass
        case ast.Constant(value=int() | float() as value):
            return float(value)
        case ast.Name(id="pi"):
            return math.pi
        case ast.UnaryOp(op=ast.USub() | ast.UAdd() as sign, operand=operand):
            inner = _value(operand, text, depth)
            return -inner if isinstance(sign, ast.USub) else inner
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
            a, b = _value(left, text, depth), _value(right, text, depth)
            if isinstance(op, ast.Pow) and abs(b) > EXPONENT:
                raise ValueError(f"exponent {b:g} in the number {text!r}; expected at most {EXPONENT:g}")
            return OPERATORS[type(op)](a, b)
        case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]) if name in FUNCTIONS:
            return _call(name, _value(argument, text, depth), text)
    found = ast.unparse(node)
    raise ValueError(f"{found!r} in the number {text!r} is not a constant; expected {GRAMMAR}")


def _call(name: str, argument: float, text: str) -> float:
    try:
        return FUNCTIONS[name](argument)
    except ValueError:
        raise ValueError(f"{name}({argument:g}) in the number {text!r} is not real; give another number") from None
