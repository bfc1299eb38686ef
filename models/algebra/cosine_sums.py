"""Exact arithmetic of sums of cosines of rational angles with rational factors.

Such sums lie in a cyclotomic field: two are equal if the cyclotomic polynomial divides the
difference, and the conjugates of one are had by multiplying all its angles (L. C. Washington,
Introduction to Cyclotomic Fields, Springer, 1997, chapter 2).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cmp_to_key, lru_cache
from itertools import combinations_with_replacement, product
from math import cos, factorial, fsum, gcd, inf, lcm, pi, prod

import sympy as sp
from flint import arb, arb_poly, fmpq, fmpq_poly, fmpz_poly

from . import cosines
from .balls import Ball, precision
from .lazy import LazyEigenvalues
from .rationals import to_flint, to_fraction, to_sympy

_HUGE = 10**300
"""Rational numbers above it are infinite as floats."""


@dataclass(frozen=True, slots=True)
class AngleSum:
    """shift + Σ 2 b cos(2πt) over `terms` (t, b), 0 < t < 1/2, ascending, each t once, no b = 0."""

    shift: Fraction
    terms: tuple[tuple[Fraction, Fraction], ...] = ()

    @classmethod
    def rational(cls, value: Fraction | int) -> AngleSum:
        """A rational number."""
        return cls(Fraction(value))

    @classmethod
    def cosine(cls, a: Fraction | int, b: Fraction | int, k: int, m: int) -> AngleSum:
        """a + 2 b cos(2πk/m)."""
        return _collected(Fraction(a), [(Fraction(k, m), Fraction(b))])

    def __add__(self, other: AngleSum) -> AngleSum:
        if not other.terms or not self.terms:
            return AngleSum(self.shift + other.shift, self.terms or other.terms)
        return _collected(self.shift + other.shift, [*self.terms, *other.terms])

    def __mul__(self, other: AngleSum) -> AngleSum:
        """2 cos x · 2 cos y = 2 cos(x + y) + 2 cos(x - y)."""
        parts = [(t, self.shift * b) for t, b in other.terms] + [(t, other.shift * b) for t, b in self.terms]
        for (s, a), (t, b) in product(self.terms, other.terms):
            parts += [(s + t, a * b), (s - t, a * b)]
        return _collected(self.shift * other.shift, parts)

    def __neg__(self) -> AngleSum:
        return AngleSum(-self.shift, tuple((t, -b) for t, b in self.terms))

    @property
    def folded(self) -> AngleSum:
        """The number with all angles in the first quarter turn: one form for -cos x, cos(π - x)."""
        return self._turned(lambda t, b: 4 * t > 1)

    @property
    def risen(self) -> AngleSum:
        """The number with all factors positive, as the closed forms of families have them."""
        return self._turned(lambda t, b: b < 0)

    def _turned(self, when: Callable[[Fraction, Fraction], bool]) -> AngleSum:
        half, counts = Fraction(1, 2), dict[Fraction, Fraction]()
        for t, b in self.terms:
            turn, factor = (half - t, -b) if when(t, b) else (t, b)
            counts[turn] = counts.get(turn, Fraction(0)) + factor
        return AngleSum(self.shift, tuple(sorted((t, b) for t, b in counts.items() if b)))

    @property
    def near(self) -> float:
        """The value as a float, within rounding; infinite if it is too large for one."""
        if abs(self.shift) > _HUGE:
            return inf if self.shift > 0 else -inf
        return float(self.shift) + sum(2 * float(b) * cos(2 * pi * float(t)) for t, b in self.terms)

    @property
    def modulus(self) -> int:
        """The least m such that all angles are multiples of 2π/m."""
        return lcm(*(t.denominator for t, _ in self.terms))

    def sign(self) -> int:
        """-1, 0 or 1, decided exactly.

        Certified balls decide, and the cyclotomic polynomial if they hold 0.
        """
        number = self.folded
        if not number.terms:
            return (number.shift > 0) - (number.shift < 0)
        bits = 64
        while True:
            with precision(bits):
                ball = _conjugate(number, 1, 1)
                if ball > 0 or ball < 0:
                    return 1 if ball > 0 else -1
            if bits == 256 and number.vanishes():
                return 0
            bits *= 2

    def vanishes(self) -> bool:
        """Return whether the number is 0, decided exactly."""
        if not self.terms:
            return self.shift == 0
        m = self.modulus
        coefficients = [fmpq(0)] * m
        coefficients[0] = to_flint(self.shift)
        for t, b in self.terms:
            k = int(t * m)
            coefficients[k] += to_flint(b)
            coefficients[m - k] += to_flint(b)
        remainder = fmpq_poly(coefficients) % fmpq_poly(fmpz_poly.cyclotomic(m))
        return bool(remainder.degree() < 0)


def _collected(shift: Fraction, parts: Iterable[tuple[Fraction, Fraction]]) -> AngleSum:
    """Add up parts: angles in the first half turn, rational cosines in the shift."""
    turns = [(turn, b) for turn, b in parts]
    unit = lcm(*(turn.denominator for turn, _ in turns))
    return folded_sum(shift, [(int(turn * unit) % unit, b) for turn, b in turns], unit)


def folded_sum(shift: Fraction, parts: Iterable[tuple[int, Fraction]], unit: int) -> AngleSum:
    """shift + Σ 2 b cos(2πr/unit) over (r, b), 0 <= r < unit."""
    counts: dict[Fraction, Fraction] = {}
    for r, b in parts:
        t = Fraction(min(r, unit - r), unit)
        if t.denominator in _RATIONAL:
            shift += b * _RATIONAL[t.denominator]
        else:
            counts[t] = counts[t] + b if t in counts else b
    return AngleSum(shift, tuple(sorted((t, b) for t, b in counts.items() if b)))


_RATIONAL = {1: 2, 2: -2, 3: -1, 4: 0, 6: 1}
"""2 cos(2πt) by the denominator of t if it is rational."""


def merged(numbers: Iterable[tuple[AngleSum, int]]) -> list[tuple[AngleSum, int]]:
    """Return equal numbers once, descending, their multiplicities added.

    Nearly equal numbers are told apart exactly.
    """
    counts: dict[AngleSum, int] = {}
    for number, times in numbers:
        counts[number] = counts.get(number, 0) + times
    ordered = sorted(counts, key=lambda number: number.near, reverse=True)
    groups: list[list[AngleSum]] = []
    for number in ordered:
        if groups and groups[-1][-1].near - number.near < 1e-9 * (1 + abs(number.near)):
            groups[-1].append(number)
        else:
            groups.append([number])
    found = []
    for group in groups:
        different: dict[AngleSum, int] = {}
        for number in group:
            same = next((other for other in different if (other + -number).vanishes()), number)
            different[same] = different.get(same, 0) + counts[number]
        found += list(different.items())
    return found


def box(sizes: Sequence[int], closed: Sequence[bool]) -> LazyEigenvalues[tuple[sp.Expr, int]]:
    """Return the spectrum of the Cartesian product of chains and rings: sums of -4 sin² of each.

    Directions of one kind and size are taken in one order only.  Only numbers whose floats are too
    near to each other are compared exactly.
    """
    kinds = Counter(zip(sizes, closed, strict=True))
    unit = lcm(*(size if ring else 2 * size for size, ring in kinds))
    waves = [list(combinations_with_replacement(_waves(*kind, unit), times)) for kind, times in kinds.items()]
    counts: dict[tuple[int, ...], int] = {}
    for choice in product(*waves):
        folded, times = list[int](), 1
        for group in choice:
            times *= factorial(len(group))
            for (r, often), same in Counter(group).items():
                folded += [r] * same
                times = times * often**same // factorial(same)
        key = _cancelled(folded, unit)
        counts[key] = counts.get(key, 0) + times
    near = [2 * cos(2 * pi * r / unit) for r in range(unit // 2 + 1)]
    places = sorted(((fsum(near[r] for r in key), key) for key in counts), reverse=True)
    shift = -2 * len(sizes)

    def number(key: tuple[int, ...]) -> AngleSum:
        return folded_sum(Fraction(shift), [(r, Fraction(1)) for r in key], unit)

    found: list[tuple[tuple[int, ...], int]] = []
    start = 0
    for end in range(1, len(places) + 1):  # the sums of cosines in `near` are within 2 each
        if end == len(places) or places[end - 1][0] - places[end][0] > 1e-12 * len(sizes):
            found += _told_apart([(number(key), key, counts[key]) for _, key in places[start:end]])
            start = end
    return LazyEigenvalues(len(found), prod(sizes), lambda k: (expression(number(found[k][0])), found[k][1]))


def _waves(size: int, ring: bool, unit: int) -> list[tuple[int, int]]:
    """(r, how often) for each 2 cos(2πr/unit) of a chain or ring, 0 <= r <= unit/2."""
    if ring:
        return [(k * (unit // size), 1 if k in (0, size - k) else 2) for k in range(size // 2 + 1)]
    return [(k * (unit // (2 * size)), 1) for k in range(size)]


def _cancelled(turns: Sequence[int], unit: int) -> tuple[int, ...]:
    """The turns, ascending; pairs r, unit/2 - r, whose cosines add up to 0, are written alike."""
    left = sorted(turns)
    found = list[int]()
    while left:
        r = left.pop()
        if 2 * r != unit - 2 * r and unit % 2 == 0 and unit // 2 - r in left:
            left.remove(unit // 2 - r)
            found += [0, unit // 2]
        else:
            found.append(r)
    return tuple(sorted(found))


def _told_apart(group: Sequence[tuple[AngleSum, tuple[int, ...], int]]) -> list[tuple[tuple[int, ...], int]]:
    """Nearly equal numbers, descending, equal ones once, multiplicities added; decided exactly."""
    if len(group) == 1:
        return [group[0][1:]]
    different: list[tuple[AngleSum, tuple[int, ...], int]] = []
    for a, key, times in group:
        place = next((i for i, (b, _, _) in enumerate(different) if (a + -b).vanishes()), None)
        if place is None:
            different.append((a, key, times))
        else:
            different[place] = (*different[place][:2], different[place][2] + times)

    def order(x: tuple[AngleSum, tuple[int, ...], int], y: tuple[AngleSum, tuple[int, ...], int]) -> int:
        return (y[0] + -x[0]).sign()

    ordered = sorted(different, key=cmp_to_key(order))
    return [(key, times) for _, key, times in ordered]


def expression(number: AngleSum) -> sp.Expr:
    """Return the number with short radicals, and -4 b sin² for all other cosines."""
    shift, short, long = number.shift, [], []
    for t, b in number.terms:
        k, m = t.numerator, t.denominator
        if cosines.is_short(k, m):
            short.append(cosines.cosine(Fraction(0), b, k, m))
        else:
            shift += 2 * b
            long.append(cosines.minus_four_sine_squared(k, m) * to_sympy(b))
    return sp.Add(to_sympy(shift), *short, *long)


def expressions(numbers: Iterable[tuple[AngleSum, int]]) -> list[tuple[sp.Expr, int]]:
    """Return numbers with multiplicities as `expression` writes them, equal ones once, descending."""
    return [(expression(number), times) for number, times in merged(numbers)]


def read(number: sp.Expr) -> AngleSum | None:
    """Return a SymPy expression as such a sum.

    None if it is none, or has radicals other than those of `cosines.cosine`.
    """
    found = AngleSum.rational(0)
    for part in sp.Add.make_args(number):
        factor, core = part.as_coeff_Mul()
        if not factor.is_Rational:
            return None
        b = to_fraction(factor)
        known = _atoms().get(core)
        if known is not None:
            found += AngleSum(known.shift * b, tuple((t, x * b) for t, x in known.terms))
            continue
        form = cosines.linear_cosine(part)
        if form is None:
            return None
        found += AngleSum.cosine(*form)
    return found


@lru_cache(maxsize=1)
def _atoms() -> dict[sp.Expr, AngleSum]:
    """1 and the radicals that `cosines.cosine` writes.

    √5 = 1 + 4 cos(2π/5), √6 = 2 cos(π/12) + 2 cos(5π/12).
    """

    def c(*turns: tuple[int, int]) -> AngleSum:
        return sum((AngleSum.cosine(0, 1, k, m) for k, m in turns), AngleSum.rational(0))

    root = sp.sqrt
    return {
        sp.S.One: AngleSum.rational(1),
        root(2): c((1, 8)),
        root(3): c((1, 12)),
        root(5): AngleSum.rational(1) + c((1, 5), (1, 5)),
        root(6): c((1, 24), (5, 24)),
        root(2 + root(2)): c((1, 16)),
        root(2 - root(2)): c((3, 16)),
        root(sp.Rational(5, 2) + root(5) / 2): c((1, 20)),
        root(sp.Rational(5, 2) - root(5) / 2): c((3, 20)),
    }


def minimal_polynomial(number: AngleSum) -> fmpq_poly:
    """Return the monic irreducible polynomial over the rationals of which the number is a root.

    The product of (z - conjugate) over all multiples of the angles is a power of it.  Times a
    common denominator the number is an algebraic integer, so balls around the coefficients of that
    product give them exactly.
    """
    if not number.terms:
        return fmpq_poly([-to_flint(number.shift), 1])
    scale = lcm(number.shift.denominator, *(b.denominator for _, b in number.terms))
    m = number.modulus
    units = [u for u in range(1, m // 2 + 1) if gcd(u, m) == 1]
    bits = 64
    while True:
        with precision(bits):
            power = arb_poly.from_roots([_conjugate(number, u, scale) for u in units]).unique_fmpz_poly()
        if power is not None:
            break
        bits *= 2
    whole = fmpq_poly(power)
    part = whole / whole.gcd(whole.derivative())
    scaled = part(fmpq_poly([0, scale]))
    return scaled / scaled[scaled.degree()]


def _conjugate(number: AngleSum, unit: int, scale: int) -> Ball:
    total = arb(to_flint(number.shift * scale))
    for t, b in number.terms:
        total += 2 * arb(to_flint(b * scale)) * arb.cos_pi_fmpq(to_flint(2 * unit * t))
    return total
