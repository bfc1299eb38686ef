"""Minimal polynomials of algebraic numbers, and products of (z - number) over sets of conjugates.

Numbers a + 2 b cos(2πk/m) with common a, b > 0 and m (k/m in lowest terms) are conjugate.  Their common
minimal polynomial follows from a, b and m without numerical values.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from functools import lru_cache

import sympy as sp
from flint import fmpq, fmpq_poly, fmpz, fmpz_poly

from . import cosine_sums, cosines
from .cosine_sums import AngleSum
from .rationals import to_flint
from .roots import Root

_X = sp.Symbol("x")


def multiplied(numbers: Iterable[tuple[AngleSum, int]]) -> fmpq_poly | None:
    """Return the product of (z - number)^multiplicity; None if a set of conjugates is incomplete."""
    rationals: dict[Fraction, int] = {}
    # Group the numbers by sets of conjugates (a, b, m); make b > 0 by -2b cos(2πt) = 2b cos(2π(1/2 - t)).
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
        # The product over a set is rational if the set is complete, with one multiplicity for all.
        counts = set(members.values())
        if len(counts) != 1 or 2 * len(members) != int(fmpz(m).euler_phi()):
            return None
        product *= _factor(a, b, m) ** counts.pop()
    return product


@lru_cache(maxsize=1024)
def _factor(a: Fraction, b: Fraction, m: int) -> fmpq_poly:
    return cosines.minimal_polynomial(a, b, m)


def monic(coefficients: Sequence[int]) -> fmpq_poly:
    """Make a polynomial with integer coefficients (the constant first) monic."""
    return fmpq_poly(list(coefficients)) / coefficients[-1]


def minimal_polynomial(number: sp.Expr | Root) -> fmpq_poly:
    """Return the monic minimal polynomial of a number over the rationals."""
    if isinstance(number, Root):
        return monic(number.polynomial)
    if number.is_Rational:
        return fmpq_poly([to_flint(-number), 1])
    # Try the forms with known polynomials first; a general radical is the slowest case.
    form = cosines.linear_cosine(number)
    if form is not None:
        a, b, _, m = form
        return fmpq_poly(list(_cosine(a, b, m)))
    form = cosines.linear_exponential(number)
    if form is not None:
        a, b, _, m = form
        return cosines.minimal_polynomial(a, b, m, fmpz_poly.cyclotomic(m))
    surd = _surd(number)
    if surd is not None:
        return surd
    terms = cosine_sums.read(number)
    if terms is not None:
        return cosine_sums.minimal_polynomial(terms)
    return fmpq_poly(list(_radical(number)))


def _surd(number: sp.Expr) -> fmpq_poly | None:
    """Return the minimal polynomial of a + b sqrt(c) with rational a, b and c > 0; None for any other number."""
    a, scaled_root = number.as_coeff_Add()
    b, root = scaled_root.as_coeff_Mul()
    if not (a.is_Rational and b.is_Rational and root.is_Pow and root.exp == sp.S.Half and root.base.is_Rational):
        return None
    return fmpq_poly([to_flint(a**2 - b**2 * root.base), to_flint(-2 * a), 1])


@lru_cache(maxsize=256)
def _cosine(a: Fraction, b: Fraction, m: int) -> tuple[fmpq, ...]:
    return tuple(cosines.minimal_polynomial(a, b, m).coeffs())


@lru_cache(maxsize=1024)
def _radical(number: sp.Expr) -> tuple[fmpq, ...]:
    polynomial = sp.Poly(sp.minimal_polynomial(number, _X), _X).monic()
    return tuple(to_flint(c) for c in polynomial.all_coeffs()[::-1])
