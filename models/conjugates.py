"""The polynomial of numbers a + 2 b cos(2πk/m) that come with all their conjugates, without looking at any of their values.

Two such numbers with b > 0 and one a, b and m (k/m in lowest terms) are conjugate; all of them multiply to one polynomial.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from functools import lru_cache

from flint import fmpq_poly, fmpz

from . import angles
from .angle_sums import AngleSum

__all__ = ["multiplied"]


def multiplied(numbers: Iterable[tuple[AngleSum, int]]) -> fmpq_poly | None:
    """The product of (z - number)^times; None where a number has several cosines or not all conjugates as often as itself.

    The same number may be listed several times.
    """
    rationals: dict[Fraction, int] = {}
    classes: dict[tuple[Fraction, Fraction, int], dict[int, int]] = {}
    for number, times in numbers:
        if not number.terms:
            rationals[number.shift] = rationals.get(number.shift, 0) + times
            continue
        ((turn, b),) = number.terms if len(number.terms) == 1 else ((Fraction(0), Fraction(0)),)
        if not b:
            return None
        if b < 0:
            turn, b = Fraction(1, 2) - turn, -b
        members = classes.setdefault((number.shift, b, turn.denominator), {})
        members[turn.numerator] = members.get(turn.numerator, 0) + times
    product = fmpq_poly([1])
    for value, times in rationals.items():
        product *= fmpq_poly([-value.numerator, value.denominator]) ** times / fmpz(value.denominator) ** times
    for (a, b, m), members in classes.items():
        counts = set(members.values())
        if len(counts) != 1 or 2 * len(members) != int(fmpz(m).euler_phi()):
            return None
        product *= _factor(a, b, m) ** counts.pop()
    return product


@lru_cache(maxsize=1024)
def _factor(a: Fraction, b: Fraction, m: int) -> fmpq_poly:
    return angles.minimal_polynomial(a, b, m)
