"""Read numbers such as -4*sin(k*pi/n)**2 as sums of cosines, thirty times faster than SymPy.

Ranges of sizes need the speed: one line `ring n=3..200: …` claims 20 000 numbers.  For any other text,
also a wrong one, return None: the caller then uses `number_text.exact_number`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

from flint import fmpq_poly

from ..algebra.cosine_sums import AngleSum
from ..algebra.rationals import to_fraction
from ..inputs.reader import Algebra, Arithmetic, NoMeaning, ParsedText, parse
from .number_text import DEPTH, LENGTH

# Most cosines of a sum, and highest power; both are choices, since SymPy is faster for longer products.
TERMS, POWER = 16, 4
LARGEST = 10**10  # bound for integers and for denominators of angles, a choice that keeps sums of 16 cosines short

_CIRCULAR = re.compile(r"[0-9A-Za-z_+\-*/() \t]*\b(?:sin|cos)\([0-9A-Za-z_+\-*/() \t]*", re.ASCII)
_PI = fmpq_poly([0, 1])


def cosine_sum(text: str, values: Mapping[str, int]) -> AngleSum | None:
    """Read a number as a sum of cosines; None if the text has no sin or cos, or only SymPy can read it."""
    expression = _parsed(text.strip())
    try:
        return None if expression is None else expression.evaluate(_CosineSums(values))
    except (NoMeaning, ZeroDivisionError):
        return None


@lru_cache(maxsize=64)  # parse a text once for all values of its letters
def _parsed(text: str) -> ParsedText | None:
    return parse(text) if len(text) <= LENGTH and _CIRCULAR.fullmatch(text) else None


def _whole(value: int | float) -> int:
    if isinstance(value, float) or value >= LARGEST:
        raise NoMeaning
    return value


@dataclass(frozen=True, slots=True)
class _CosineSums(Arithmetic[AngleSum]):
    """Algebra of sums of at most TERMS cosines; `values` maps letters to integers."""

    values: Mapping[str, int]
    deepest = DEPTH

    def checked(self, value: AngleSum) -> AngleSum:
        if len(value.terms) > TERMS:
            raise NoMeaning
        return value

    def number(self, value: int | float) -> AngleSum:
        return AngleSum.rational(_whole(value))

    def name(self, name: str) -> AngleSum:
        if name not in self.values:
            raise NoMeaning
        return AngleSum.rational(self.values[name])

    def divide(self, a: AngleSum, b: AngleSum) -> AngleSum:
        if b.terms:
            raise NoMeaning
        return a * AngleSum.rational(1 / b.shift)

    def whole_power(self, base: AngleSum, exponent: int) -> AngleSum:
        if not 0 < exponent <= POWER:
            raise NoMeaning
        result = base
        for _ in range(exponent - 1):
            result = self.multiply(result, base)
        return result

    def arguments(self, function: str, count: int, options: Sequence[str]) -> Sequence[Algebra[fmpq_poly]]:
        if function not in ("sin", "cos") or count != 1 or options:
            raise NoMeaning
        return (_Angles(self.values),)

    def call(self, function: str, arguments: Sequence[fmpq_poly], options: Mapping[str, str]) -> AngleSum:
        (angle,) = arguments
        if angle != angle[1] * _PI:
            raise NoMeaning
        turn = to_fraction(angle[1]) / 2
        if function == "sin":  # sin x = cos(π/2 - x)
            turn = Fraction(1, 4) - turn
        if turn.denominator > LARGEST:
            raise NoMeaning
        return AngleSum.cosine(0, Fraction(1, 2), turn.numerator, turn.denominator)


@dataclass(frozen=True, slots=True)
class _Angles(Arithmetic[fmpq_poly]):
    """Algebra of angles a + b pi with rational a and b, stored as polynomials in pi."""

    values: Mapping[str, int]
    deepest = DEPTH

    def checked(self, value: fmpq_poly) -> fmpq_poly:
        if value.degree() > 1:
            raise NoMeaning
        return value

    def number(self, value: int | float) -> fmpq_poly:
        return fmpq_poly([_whole(value)])

    def name(self, name: str) -> fmpq_poly:
        if name == "pi":
            return _PI
        if name not in self.values:
            raise NoMeaning
        return fmpq_poly([self.values[name]])

    def divide(self, a: fmpq_poly, b: fmpq_poly) -> fmpq_poly:
        if b.degree() != 0:  # pi, or 0
            raise NoMeaning
        return a / b[0]

    def whole_power(self, base: fmpq_poly, exponent: int) -> fmpq_poly:
        if not 0 < exponent <= POWER:
            raise NoMeaning
        return self.checked(base**exponent)
