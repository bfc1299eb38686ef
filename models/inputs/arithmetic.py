"""Evaluate numbers written as text in a scene file: constant expressions in floating point.

Accepted: decimal numbers, ``pi``, ``+ - * / **``, parentheses and ``sqrt exp log sin cos`` of one
argument.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NoReturn

from .reader import Algebra, NoMeaning, parse, stray_character, unpaired

# Limits, choices far above the needs of a parameter: characters, nested operations, exponent, value.
LENGTH, DEPTH, EXPONENT, MAGNITUDE = 200, 24, 100.0, 1e100

FUNCTIONS: dict[str, Callable[[float], float]] = {
    "cos": math.cos,
    "exp": math.exp,
    "log": math.log,
    "sin": math.sin,
    "sqrt": math.sqrt,
}
GRAMMAR = "numbers, pi, + - * / **, parentheses and " + " ".join(FUNCTIONS)


def constant(text: str) -> float:
    """Return the value of a constant expression in floating point."""
    if len(text) > LENGTH:
        raise ValueError(f"number written as {len(text)} characters; expected at most {LENGTH}; give its value")
    stray = stray_character(text)
    if stray:
        power = "; write ** for a power" if stray == "^" else ""
        raise ValueError(f"character {stray!r} in the number {text!r}; expected {GRAMMAR}{power}")
    expression = parse(text)
    if expression is None:
        raise ValueError(f"unreadable number {text!r}{unpaired(text)}; expected {GRAMMAR}, e.g. '2*pi/1.15'")
    return expression.evaluate(_Floats(text))


@dataclass(frozen=True, slots=True)
class _Floats(Algebra[float]):
    """Algebra of floating-point numbers up to MAGNITUDE, checked after every operation."""

    text: str
    deepest = DEPTH

    def refuse(self, node: ast.expr, reason: str) -> NoReturn:
        raise ValueError(f"{ast.unparse(node)!r} in the number {self.text!r} is not a constant; expected {GRAMMAR}")

    def refuse_depth(self) -> NoReturn:
        raise ValueError(f"number {self.text!r} nests more than {DEPTH} operations; write it shorter")

    def number(self, value: int | float) -> float:
        return self._checked(float, value)

    def name(self, name: str) -> float:
        if name != "pi":
            raise NoMeaning
        return math.pi

    def positive(self, value: float) -> float:
        return value

    def negative(self, value: float) -> float:
        return -value

    def add(self, a: float, b: float) -> float:
        return self._checked(operator.add, a, b)

    def multiply(self, a: float, b: float) -> float:
        return self._checked(operator.mul, a, b)

    def divide(self, a: float, b: float) -> float:
        return self._checked(operator.truediv, a, b)

    def power(self, base: float, exponent: float) -> float:
        if abs(exponent) > EXPONENT:
            raise ValueError(f"exponent {exponent:g} in the number {self.text!r}; expected at most {EXPONENT:g}")
        return self._checked(operator.pow, base, exponent)

    def arguments(self, function: str, count: int, options: Sequence[str]) -> Sequence[Algebra[float]]:
        if function not in FUNCTIONS or count != 1 or options:
            raise NoMeaning
        return (self,)

    def call(self, function: str, arguments: Sequence[float], options: Mapping[str, str]) -> float:
        (argument,) = arguments
        if (function == "sqrt" and argument < 0) or (function == "log" and argument <= 0):
            raise ValueError(f"{function}({argument:g}) in the number {self.text!r} is not real; give another number")
        return self._checked(FUNCTIONS[function], argument)

    def _checked(self, operation: Callable[..., float | complex], *operands: float) -> float:
        """Compute an operation; ValueError unless the result is real and at most MAGNITUDE."""
        try:
            value = operation(*operands)
        except (OverflowError, ZeroDivisionError) as error:
            raise ValueError(f"number {self.text!r}: {error}; expected a finite value") from None
        if isinstance(value, complex) or not abs(value) <= MAGNITUDE:
            kind = "a complex value" if isinstance(value, complex) else f"an intermediate value of {value:g}"
            raise ValueError(f"number {self.text!r} has {kind}; expected real values up to {MAGNITUDE:g}")
        return value
