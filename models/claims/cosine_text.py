"""Numbers such as -4*sin(k*pi/n)**2 read as sums of cosines, a hundred times faster than by SymPy.

A letter such as k may stay open: the text is then read once for all its values.  Everything that is
not such a sum for certain, wrong texts too, is left to `number_text.exact_number`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache
from itertools import product
from math import lcm

from ..algebra.cosine_sums import AngleSum, folded_sum
from ..inputs.reader import Algebra, NoMeaning, ParsedText, parse

_CIRCULAR = re.compile(r"[0-9A-Za-z_+\-*/() \t]*\b(?:sin|cos)\([0-9A-Za-z_+\-*/() \t]*", re.ASCII)
LENGTH, DEPTH, TERMS, POWER, WHOLE, DENOMINATOR = 300, 24, 16, 4, 10**10, 10**10

Linear = tuple[Fraction, Fraction]
"""a + b k, k the open letter."""


@dataclass(frozen=True, slots=True)
class Wave:
    """shift + Σ 2 f cos(2π(a + b k)) over `terms`, (a, b): f, of an open whole number k."""

    shift: Fraction
    terms: Mapping[Linear, Fraction] = field(default_factory=dict)

    def __add__(self, other: Wave) -> Wave:
        counts = dict(self.terms)
        for turn, factor in other.terms.items():
            counts[turn] = counts.get(turn, Fraction(0)) + factor
        return Wave(self.shift + other.shift, {turn: factor for turn, factor in counts.items() if factor})

    def __neg__(self) -> Wave:
        return Wave(-self.shift, {turn: -factor for turn, factor in self.terms.items()})

    def __mul__(self, other: Wave) -> Wave:
        """2 cos x · 2 cos y = 2 cos(x + y) + 2 cos(x - y); a cosine of 0 goes into the shift."""
        found = Wave(self.shift * other.shift)
        for shift, terms in ((self.shift, other.terms), (other.shift, self.terms)):
            found += Wave(Fraction(0), {turn: shift * factor for turn, factor in terms.items() if shift})
        for ((a, b), f), ((c, d), g) in product(self.terms.items(), other.terms.items()):
            found += Wave(Fraction(0), {_even(a + c, b + d): f * g})
            found += Wave(2 * f * g) if (a, b) == (c, d) else Wave(Fraction(0), {_even(a - c, b - d): f * g})
        return found

    def at(self, low: int, high: int) -> list[AngleSum]:
        """The numbers for k = low … high."""
        unit = lcm(*(part.denominator for turn in self.terms for part in turn))
        steps = [(int(a * unit), int(b * unit), factor) for (a, b), factor in self.terms.items()]
        return [
            folded_sum(self.shift, [((a + b * k) % unit, factor) for a, b, factor in steps], unit)
            for k in range(low, high + 1)
        ]


def _even(a: Fraction, b: Fraction) -> Linear:
    """One form for the angles of equal cosines, but for those of constants.

    Whole turns are taken off, and the factor of k is positive.
    """
    return (-a % 1, -b) if b < 0 else (a % 1, b)


def angle_number(text: str, values: Mapping[str, int]) -> AngleSum | None:
    """Return a number as a sum of cosines."""
    wave = angle_wave(text, values)
    return None if wave is None else wave.at(0, 0)[0]


def angle_wave(text: str, values: Mapping[str, int], letter: str = "") -> Wave | None:
    """Return a number for all values of an open letter."""
    expression = _parsed(text.strip())
    try:
        return None if expression is None else expression.evaluate(_Waves(values, letter))
    except (NoMeaning, ZeroDivisionError):
        return None


@lru_cache(maxsize=64)
def _parsed(text: str) -> ParsedText | None:
    return parse(text) if len(text) <= LENGTH and _CIRCULAR.fullmatch(text) else None


@dataclass(frozen=True, slots=True)
class _Waves(Algebra[Wave]):
    """Sums of cosines of at most TERMS terms."""

    values: Mapping[str, int]
    letter: str
    deepest = DEPTH

    def number(self, value: int | float) -> Wave:
        return Wave(_fraction_of(value))

    def name(self, name: str) -> Wave:
        if name not in self.values:
            raise NoMeaning
        return Wave(Fraction(self.values[name]))

    def negative(self, value: Wave) -> Wave:
        return -value

    def add(self, a: Wave, b: Wave) -> Wave:
        return _short(a + b)

    def multiply(self, a: Wave, b: Wave) -> Wave:
        return _short(a * b)

    def divide(self, a: Wave, b: Wave) -> Wave:
        if b.terms:
            raise NoMeaning
        return a * Wave(1 / b.shift)

    def power(self, base: Wave, exponent: Wave) -> Wave:
        raise NoMeaning

    def whole_power(self, base: Wave, exponent: int) -> Wave:
        if not 0 < exponent <= POWER:
            raise NoMeaning
        result = base
        for _ in range(exponent - 1):
            result = _short(result * base)
        return result

    def arguments(self, function: str, count: int, options: Sequence[str]) -> Sequence[Algebra[_Angle]]:
        if function not in ("sin", "cos") or count != 1 or options:
            raise NoMeaning
        return (_Angles(self.values, self.letter),)

    def call(self, function: str, arguments: Sequence[_Angle], options: Mapping[str, str]) -> Wave:
        (angle,) = arguments
        if not angle.of_pi:
            raise NoMeaning
        a, b = angle.a / 2, angle.b / 2
        if function == "sin":  # sin x = cos(π/2 - x)
            a, b = Fraction(1, 4) - a, -b
        if max(a.denominator, b.denominator) > DENOMINATOR:
            raise NoMeaning
        return Wave(Fraction(0), {_even(a, b): Fraction(1, 2)})


def _short(wave: Wave) -> Wave:
    if len(wave.terms) > TERMS:
        raise NoMeaning
    return wave


def _fraction_of(value: int | float) -> Fraction:
    if isinstance(value, float) or value >= WHOLE:
        raise NoMeaning
    return Fraction(value)


@dataclass(frozen=True, slots=True)
class _Angle:
    """a + b k, times pi if `of_pi`; k is the open letter."""

    a: Fraction
    b: Fraction = Fraction(0)
    of_pi: bool = False


@dataclass(frozen=True, slots=True)
class _Angles(Algebra[_Angle]):
    """Angles that are linear in the open letter, and rational or a multiple of pi."""

    values: Mapping[str, int]
    letter: str
    deepest = DEPTH

    def number(self, value: int | float) -> _Angle:
        return _Angle(_fraction_of(value))

    def name(self, name: str) -> _Angle:
        if name == "pi":
            return _Angle(Fraction(1), of_pi=True)
        if name == self.letter:
            return _Angle(Fraction(0), Fraction(1))
        if name not in self.values:
            raise NoMeaning
        return _Angle(Fraction(self.values[name]))

    def negative(self, value: _Angle) -> _Angle:
        return _Angle(-value.a, -value.b, value.of_pi)

    def add(self, a: _Angle, b: _Angle) -> _Angle:
        if a.of_pi or b.of_pi:
            raise NoMeaning
        return _Angle(a.a + b.a, a.b + b.b)

    def multiply(self, a: _Angle, b: _Angle) -> _Angle:
        if (a.b and b.b) or (a.of_pi and b.of_pi):
            raise NoMeaning
        return _Angle(a.a * b.a, a.a * b.b + a.b * b.a, a.of_pi or b.of_pi)

    def divide(self, a: _Angle, b: _Angle) -> _Angle:
        if b.b or b.of_pi:
            raise NoMeaning
        return _Angle(a.a / b.a, a.b / b.a, a.of_pi)

    def power(self, base: _Angle, exponent: _Angle) -> _Angle:
        raise NoMeaning

    def whole_power(self, base: _Angle, exponent: int) -> _Angle:
        if base.b or base.of_pi or not 0 < exponent <= POWER:
            raise NoMeaning
        return _Angle(base.a**exponent)
