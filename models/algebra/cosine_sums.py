"""Exact arithmetic of sums of cosines of rational angles with rational factors.

Such sums lie in a cyclotomic field.  Two sums are equal if the cyclotomic polynomial divides their
difference, written as a polynomial in the root of unity.  Multiplying all angles of a sum by an integer
prime to the order gives a conjugate (L. C. Washington, Introduction to Cyclotomic Fields, Springer,
1997, chapter 2).
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

_HUGE = 10**300  # `near` returns infinity for rational numbers above this bound; the largest float is 1.8e308


@dataclass(frozen=True, slots=True)
class AngleSum:
    """The number shift + Σ 2 b cos(2πt) over `terms` (t, b), with distinct ascending t, 0 < t < 1/2, and b != 0."""

    shift: Fraction
    terms: tuple[tuple[Fraction, Fraction], ...] = ()

    @classmethod
    def rational(cls, value: Fraction | int) -> AngleSum:
        return cls(Fraction(value))

    @classmethod
    def cosine(cls, a: Fraction | int, b: Fraction | int, k: int, m: int) -> AngleSum:
        return _collected(Fraction(a), [(Fraction(k, m), Fraction(b))])

    def __add__(self, other: AngleSum) -> AngleSum:
        if not other.terms or not self.terms:
            return AngleSum(self.shift + other.shift, self.terms or other.terms)
        return _collected(self.shift + other.shift, [*self.terms, *other.terms])

    def __mul__(self, other: AngleSum) -> AngleSum:
        """Multiply two sums by the rule 2 cos x · 2 cos y = 2 cos(x + y) + 2 cos(x - y)."""
        parts = [(t, self.shift * b) for t, b in other.terms] + [(t, other.shift * b) for t, b in self.terms]
        for (s, a), (t, b) in product(self.terms, other.terms):
            parts += [(s + t, a * b), (s - t, a * b)]
        return _collected(self.shift * other.shift, parts)

    def __neg__(self) -> AngleSum:
        return AngleSum(-self.shift, tuple((t, -b) for t, b in self.terms))

    @property
    def folded(self) -> AngleSum:
        """The same number with all angles in the first quarter turn, by cos x = -cos(π - x)."""
        return self._turned(lambda t, b: 4 * t > 1)

    @property
    def risen(self) -> AngleSum:
        """The same number with all factors b positive, the form used by closed forms of families."""
        return self._turned(lambda t, b: b < 0)

    def _turned(self, when: Callable[[Fraction, Fraction], bool]) -> AngleSum:
        # cos(2πt) = -cos(2π(1/2 - t))
        half, counts = Fraction(1, 2), dict[Fraction, Fraction]()
        for t, b in self.terms:
            turn, factor = (half - t, -b) if when(t, b) else (t, b)
            counts[turn] = counts.get(turn, Fraction(0)) + factor
        return AngleSum(self.shift, tuple(sorted((t, b) for t, b in counts.items() if b)))

    @property
    def near(self) -> float:
        """The value as a float, within rounding; infinite if the value is too large for a float."""
        if abs(self.shift) > _HUGE:
            return inf if self.shift > 0 else -inf
        return float(self.shift) + sum(2 * float(b) * cos(2 * pi * float(t)) for t, b in self.terms)

    @property
    def modulus(self) -> int:
        """The smallest m such that all angles are multiples of 2π/m."""
        return lcm(*(t.denominator for t, _ in self.terms))

    def sign(self) -> int:
        """Return the exact sign: -1, 0 or 1."""
        # Evaluate certified balls; if they contain 0, test the number for 0 with the cyclotomic polynomial.
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
        if not self.terms:
            return self.shift == 0
        # Write the sum as a polynomial in exp(2πi/m): the sum is 0 if the cyclotomic polynomial divides this one.
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
    """Make a sum of (t, b) with any t: fold angles into the first half turn, add rational cosines to the shift."""
    turns = list(parts)
    unit = lcm(*(turn.denominator for turn, _ in turns))
    return folded_sum(shift, [(int(turn * unit) % unit, b) for turn, b in turns], unit)


def folded_sum(shift: Fraction, parts: Iterable[tuple[int, Fraction]], unit: int) -> AngleSum:
    """Return shift + Σ 2 b cos(2πr/unit) over (r, b), 0 <= r < unit."""
    counts: dict[Fraction, Fraction] = {}
    for r, b in parts:
        t = Fraction(min(r, unit - r), unit)
        if t.denominator in _RATIONAL:
            shift += b * _RATIONAL[t.denominator]
        else:
            counts[t] = counts[t] + b if t in counts else b
    return AngleSum(shift, tuple(sorted((t, b) for t, b in counts.items() if b)))


# Denominator of t -> 2 cos(2πt), for all t with a rational cosine (Niven's theorem).
_RATIONAL = {1: 2, 2: -2, 3: -1, 4: 0, 6: 1}


def merged(numbers: Iterable[tuple[AngleSum, int]]) -> list[tuple[AngleSum, int]]:
    """Merge equal numbers and add their multiplicities; return them in descending order."""
    # Nearly equal numbers are compared exactly.
    counts: dict[AngleSum, int] = {}
    for number, times in numbers:
        counts[number] = counts.get(number, 0) + times
    # Numbers differ if their floats differ by more than rounding; collect all others in groups.
    ordered = sorted(counts, key=lambda number: number.near, reverse=True)
    groups: list[list[AngleSum]] = []
    for number in ordered:
        if groups and groups[-1][-1].near - number.near < 1e-9 * (1 + abs(number.near)):
            groups[-1].append(number)
        else:
            groups.append([number])
    distinct = []
    # Compare the numbers of a group exactly.
    for group in groups:
        different: dict[AngleSum, int] = {}
        for number in group:
            same = next((other for other in different if (other + -number).vanishes()), number)
            different[same] = different.get(same, 0) + counts[number]
        distinct += list(different.items())
    return distinct


def box(sizes: Sequence[int], closed: Sequence[bool]) -> LazyEigenvalues[tuple[sp.Expr, int]]:
    """Return the spectrum of the Cartesian product of chains and rings: sums of -4 sin², one for each direction."""
    # `closed[k]` is True if direction k is a ring. Numbers are compared exactly only if their floats are too close.
    #
    # A wave (r, multiplicity) is one 2 cos(2πr/unit) of a direction.  Equal directions form multisets of waves.
    kinds = Counter(zip(sizes, closed, strict=True))
    unit = lcm(*(size if ring else 2 * size for size, ring in kinds))
    waves = [list(combinations_with_replacement(_waves(*kind, unit), times)) for kind, times in kinds.items()]

    # Multiplicity of a multiset of waves: number of orders, len!/Π(repetitions)!, times multiplicities of the waves.
    counts: dict[tuple[int, ...], int] = {}
    for choice in product(*waves):
        folded, times = list[int](), 1
        for group in choice:
            times *= factorial(len(group))
            for (r, often), same in Counter(group).items():
                folded += [r] * same
                times = times * often**same // factorial(same)
        # The cosines of r and unit/2 - r cancel: write such pairs as (0, unit/2), so that equal sums merge early.
        left, paired = sorted(folded), list[int]()
        while left:
            r = left.pop()
            if 2 * r != unit - 2 * r and unit % 2 == 0 and unit // 2 - r in left:
                left.remove(unit // 2 - r)
                paired += [0, unit // 2]
            else:
                paired.append(r)
        key = tuple(sorted(paired))
        counts[key] = counts.get(key, 0) + times

    # Sort by floats; compare exactly only within groups of sums that rounding may have swapped.
    near = [2 * cos(2 * pi * r / unit) for r in range(unit // 2 + 1)]
    ordered = sorted(((fsum(near[r] for r in key), key) for key in counts), reverse=True)
    shift = -2 * len(sizes)

    def number(key: tuple[int, ...]) -> AngleSum:
        return folded_sum(Fraction(shift), [(r, Fraction(1)) for r in key], unit)

    eigenvalues: list[tuple[tuple[int, ...], int]] = []
    start = 0
    for end in range(1, len(ordered) + 1):  # a group ends at a gap above rounding
        if end == len(ordered) or ordered[end - 1][0] - ordered[end][0] > 1e-12 * len(sizes):
            eigenvalues += _told_apart([(number(key), key, counts[key]) for _, key in ordered[start:end]])
            start = end
    return LazyEigenvalues(
        len(eigenvalues), prod(sizes), lambda k: (expression(number(eigenvalues[k][0])), eigenvalues[k][1])
    )


def _waves(size: int, ring: bool, unit: int) -> list[tuple[int, int]]:
    """Return (r, multiplicity) for each 2 cos(2πr/unit) of a chain or ring, 0 <= r <= unit/2."""
    if ring:
        return [(k * (unit // size), 1 if k in (0, size - k) else 2) for k in range(size // 2 + 1)]
    return [(k * (unit // (2 * size)), 1) for k in range(size)]


def _told_apart(group: Sequence[tuple[AngleSum, tuple[int, ...], int]]) -> list[tuple[tuple[int, ...], int]]:
    """Sort nearly equal numbers, the largest first; merge equal ones and add their multiplicities."""
    if len(group) == 1:
        return [group[0][1:]]
    different: list[tuple[AngleSum, tuple[int, ...], int]] = []
    for a, key, times in group:
        same = next((i for i, (b, _, _) in enumerate(different) if (a + -b).vanishes()), None)
        if same is None:
            different.append((a, key, times))
        else:
            different[same] = (*different[same][:2], different[same][2] + times)

    def order(x: tuple[AngleSum, tuple[int, ...], int], y: tuple[AngleSum, tuple[int, ...], int]) -> int:
        return (y[0] + -x[0]).sign()

    ordered = sorted(different, key=cmp_to_key(order))
    return [(key, times) for _, key, times in ordered]


def expression(number: AngleSum) -> sp.Expr:
    """Write the number in SymPy: short radicals where they exist, else multiples of sin²."""
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
    """Merge equal numbers, sort them in descending order and write each with `expression`."""
    return [(expression(number), times) for number, times in merged(numbers)]


def read(number: sp.Expr) -> AngleSum | None:
    """Convert a SymPy expression to a sum of cosines."""
    # Return None for an expression that is no such sum, or has radicals other than those of `cosines.cosine`.
    total = AngleSum.rational(0)
    for part in sp.Add.make_args(number):
        factor, core = part.as_coeff_Mul()
        if not factor.is_Rational:
            return None
        b = to_fraction(factor)
        radical = _atoms().get(core)
        if radical is not None:
            total += AngleSum(radical.shift * b, tuple((t, x * b) for t, x in radical.terms))
            continue
        form = cosines.linear_cosine(part)
        if form is None:
            return None
        total += AngleSum.cosine(*form)
    return total


@lru_cache(maxsize=1)
def _atoms() -> dict[sp.Expr, AngleSum]:
    """Map 1 and the radicals that `cosines.cosine` writes to sums of cosines."""

    # √5 = 1 + 4 cos(2π/5), √6 = 2 cos(π/12) + 2 cos(5π/12)
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
    """Return the monic minimal polynomial over the rationals."""
    # Multiply (z - conjugate) over all multiples of the angles; the product is a power of the minimal polynomial.
    # Scaled by a common denominator, the number is an algebraic integer, so the coefficients of the product are
    # integers, which balls determine exactly.
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
    # Take the square-free part and undo the scaling of the variable.
    product = fmpq_poly(power)
    part = product / product.gcd(product.derivative())
    scaled = part(fmpq_poly([0, scale]))
    return scaled / scaled[scaled.degree()]


def _conjugate(number: AngleSum, unit: int, scale: int) -> Ball:
    """Return a ball around scale times the Galois conjugate whose angles are multiplied by `unit`."""
    total = arb(to_flint(number.shift * scale))
    for t, b in number.terms:
        total += 2 * arb(to_flint(b * scale)) * arb.cos_pi_fmpq(to_flint(2 * unit * t))
    return total
