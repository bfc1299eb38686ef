"""Equality of algebraic numbers: the bound on how near to zero a difference can be, by hand and by near misses."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest
import sympy as sp

from synchain.models.algebra import equality
from synchain.models.algebra.equality import Number, _bits, _Field, _measure, check_size, equal, sign
from synchain.models.algebra.roots import roots

ROOTS = roots((1, -5, 0, 3))  # of 3 x^3 - 5 x + 1
PAIR = roots((3, 1, 2))  # of 2 x^2 + x + 3
LOG3, LOG5 = math.log2(3), math.log2(5)


@pytest.mark.parametrize(
    ("number", "up", "low", "degree"),
    [
        (sp.S.Zero, 0.0, 0.0, 1),
        (sp.Rational(-3, 5), LOG3, LOG5, 1),
        (sp.I, 0.0, 0.0, 2),
        (sp.sqrt(2), 0.5, 0.0, 2),
        (sp.Integer(2) ** sp.Rational(-1, 3), 2 / 3, 1.0, 3),  # the cube root of 4, over 2
        (sp.sqrt(1 + sp.sqrt(2)), 0.75, 0.0, 4),
        (1 / (1 + sp.sqrt(2)), 0.0, 1.5, 2),
        ((1 + sp.sqrt(2)) ** -2, 0.0, 3.0, 2),
        (sp.sqrt(sp.Rational(1, 3) + sp.sqrt(2)), (1.5 + 2 * LOG3) / 2, LOG3, 4),
        (sp.Rational(1, 3) + sp.sqrt(2), 0.5 + LOG3 + 1, LOG3, 2),
        (sp.Rational(1, 3) + sp.sqrt(2) / 5, LOG5 + 1, LOG3 + LOG5, 2),
        (sp.sqrt(2) / 3, 0.5, LOG3, 2),
        (sp.cos(sp.pi / 7), 1.0, 1.0, 12),  # 2 cos is an integer of the field of the 28th roots of unity
        (sp.sin(sp.pi / 7), 1.0, 1.0, 12),
        (sp.exp(2 * sp.pi * sp.I / 5), 0.0, 0.0, 8),
        (ROOTS[0], 3.0, LOG3, 3),
        (PAIR[0], LOG5, 1.0, 2),
    ],
)
def test_sizes_of_numerators_and_denominators(number: Number, up: float, low: float, degree: int) -> None:
    generated = _Field()
    assert _measure(number, generated) == (pytest.approx(up), pytest.approx(low))
    assert generated.degree == degree


@pytest.mark.parametrize(
    ("values", "bits"),
    [
        ((sp.cos(sp.pi / 7), sp.cbrt(2)), 35 * 7 / 3 + 1),  # 12 times 3; u: 1/3 + 1 + 1, l: 1
        ((sp.cos(sp.pi / 7), sp.sin(sp.pi / 11)), 119 * 3 + 2),  # the 308th roots of unity
        ((sp.sqrt(2), sp.sqrt(2)), 1 * 1.5 + 0),  # one radical, counted once
        ((ROOTS[0], ROOTS[1]), 8 * (3 + LOG3 + 1) + 2 * LOG3),  # two roots of a cubic
        ((ROOTS[0], ROOTS[0]), 2 * (3 + LOG3 + 1) + 2 * LOG3),
    ],
)
def test_bits_that_tell_a_sum_from_zero(values: tuple[Number, ...], bits: float) -> None:
    assert bits + 8 <= _bits(tuple((x,) for x in values)) <= bits + 9.01


@pytest.mark.parametrize("steps", [20, 150, 600])
def test_a_convergent_of_the_root_of_two_is_not_that_root(steps: int) -> None:
    """p/q comes as near as 1/(2.83 q^2), just above the bound, which gives all bits that this takes."""
    p, q = 1, 1
    for _ in range(steps):
        p, q = p + 2 * q, p + q
    near = sp.Rational(p, q)
    assert not equal(near, sp.sqrt(2))
    assert not equal(sp.sqrt(2) + near, 2 * near)
    above = 1 if p * p > 2 * q * q else -1
    assert sign((near, sp.Integer(3)), (sp.sqrt(2), sp.Integer(3))) == above == -sign((sp.sqrt(2),), (near,))
    assert sign((near, near), (near**2,)) == 0
    gap = math.log2(2.83) + 2 * math.log2(q)
    assert gap <= _bits(((near,), (sp.sqrt(2),))) <= gap + 12
    assert equal((1 + sp.sqrt(2)) ** 2 * near, near * 3 + 2 * near * sp.sqrt(2))


def test_roots_of_polynomials_meet_their_equals_and_not_their_neighbours() -> None:
    golden = roots((-1, -1, 1))
    assert equal(golden[1], (1 + sp.sqrt(5)) / 2)
    assert not equal(golden[0], (1 + sp.sqrt(5)) / 2)
    assert equal(golden[1], 2 * sp.cos(sp.pi / 5))
    assert not equal(golden[1], sp.Rational(10946, 6765))
    assert equal(PAIR[0], (-1 - sp.I * sp.sqrt(23)) / 4) != equal(PAIR[1], (-1 - sp.I * sp.sqrt(23)) / 4)
    assert [equal(a, b) for a in ROOTS for b in ROOTS] == [i == j for i in range(3) for j in range(3)]
    assert Fraction(ROOTS[0].low) < Fraction(ROOTS[0].high)


@pytest.mark.parametrize(
    ("number", "error", "message"),
    [
        (sp.pi, TypeError, "pi is not an algebraic number"),
        (sp.cos(1), TypeError, "1/pi times pi is no rational multiple"),
        (sp.exp(1), TypeError, "not an algebraic number|no rational multiple"),
        (sp.Integer(2) ** sp.sqrt(2), TypeError, "is not an algebraic number"),
        (sum(sp.cos(sp.pi / p) for p in (101, 103, 107, 109)), ValueError, r"needs .* bits .* at most 524288"),
    ],
)
def test_numbers_that_cannot_be_compared(number: sp.Expr, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        check_size(number)
    with pytest.raises(error, match=message):
        equal(number, sp.S.One)


def test_the_largest_number_of_bits_is_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(equality, "MOST_BITS", 100)
    check_size(sp.Rational(1, 2**100))
    with pytest.raises(ValueError, match=r"needs 101 bits .* at most 100"):
        check_size(sp.Rational(1, 2**101))
