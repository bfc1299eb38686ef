"""Discs around all roots: against Arb's own isolation and known roots; what cannot be isolated is left to Arb."""

from __future__ import annotations

import cmath
import math
import random
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from effort import effort
from flint import acb, arb, fmpq, fmpz_poly
from hypothesis import given, settings
from hypothesis import strategies as st

from synchain.models.algebra import roots as algebraic
from synchain.models.algebra.balls import disjoint, precision
from synchain.models.algebra.isolation import Disc, discs, sharpened
from synchain.models.algebra.roots import ComplexRoot, RealRoot, roots


def inside(disc: Disc, ball: acb) -> bool:
    """True where a ball is surely in a disc."""
    return bool(abs(ball - acb(disc.x, disc.y)) < arb(disc.radius) + arb(2) ** -150)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(-(10**6), 10**6), min_size=3, max_size=14))
def test_every_root_of_arb_is_in_a_disc_of_its_own(coefficients: list[int]) -> None:
    f = fmpz_poly(coefficients)
    if f.degree() < 2 or f.gcd(f.derivative()).degree() > 0:
        return
    isolated = discs(f)
    if isolated is None:
        return
    assert len(isolated) == f.degree()
    with precision(256):
        for root, count in f.complex_roots():
            assert count == 1
            assert sum(inside(disc, root) for disc in isolated) == 1
            assert any(inside(disc, root) and (disc.y == 0) == (root.imag == 0) for disc in isolated)


def test_most_random_polynomials_are_isolated() -> None:
    """Nothing would be left of the speed if discs gave up: 60 polynomials of degree 20, all isolated."""
    stream = random.Random(3)
    for _ in range(60):
        f = fmpz_poly([stream.randint(-1000, 1000) for _ in range(20)] + [1])
        assert f.gcd(f.derivative()).degree() > 0 or discs(f) is not None


def test_the_roots_of_unity() -> None:
    isolated = discs(fmpz_poly.cyclotomic(101))
    assert isolated is not None
    angles = sorted(cmath.phase(complex(disc.ball)) % (2 * math.pi) for disc in isolated)
    assert angles == pytest.approx([2 * math.pi * k / 101 for k in range(1, 101)], abs=1e-14)


@pytest.mark.parametrize("gap", [10**3, 10**6])
def test_near_roots_are_told_apart_or_left(gap: int) -> None:
    """Mignotte's polynomials have two real roots a distance of about gap**-4 apart."""
    f = fmpz_poly([-2, 4 * gap, -2 * gap * gap, 0, 0, 0, 0, 1])
    isolated = roots(tuple(int(c) for c in f.coeffs()))
    reals = [root for root in isolated if isinstance(root, RealRoot)]
    assert len(isolated) == 7
    assert len(reals) == 3
    assert all(first.high <= second.low for first, second in pairwise(reals))


def test_arb_takes_what_discs_leave(monkeypatch: pytest.MonkeyPatch) -> None:
    polynomial = (7, 3, -1, 5, 1, 1)
    quick = roots(polynomial)
    monkeypatch.setattr(algebraic, "discs", lambda f: None)
    slow = roots(polynomial)
    assert [type(root) for root in quick] == [type(root) for root in slow]
    for a, b in zip(quick, slow, strict=True):
        assert a.index == b.index
        assert abs(complex(a.enclosure(80)) - complex(b.enclosure(80))) < 1e-15


def test_any_number_of_digits() -> None:
    root = next(r for r in roots((1, 1, 0, 0, 0, 1, 0, 3)) if isinstance(r, ComplexRoot))
    for bits in (60, 600, 6000):
        ball = root.enclosure(bits)
        with precision(2 * bits):
            assert (ball.real.rad() + ball.imag.rad()) * arb(2) ** bits < abs(ball)
            assert fmpz_poly(list(root.polynomial))(ball).contains(0)


def test_a_disc_without_its_root_is_refused() -> None:
    f = fmpz_poly([1, 0, 1])
    with pytest.raises(ValueError, match="expected one within"):
        sharpened(f, Disc(fmpq(5), fmpq(1), fmpq(0)), fmpq(1, 10), 60)


def test_a_hundred_complex_roots_take_the_fast_route(monkeypatch: pytest.MonkeyPatch) -> None:
    """Arb alone took minutes at degree 200."""
    stream = random.Random(5)
    f = fmpz_poly([stream.randint(-(10**9), 10**9) for _ in range(100)] + [1])
    monkeypatch.setattr(algebraic, "discs", lambda f: discs(f) or pytest.fail("Arb is slow"))
    isolated, calls = effort(lambda: roots(tuple(int(c) for c in f.coeffs())))
    assert len(isolated) == 100
    assert calls < 4_000_000


@pytest.mark.parametrize("coefficients", [[-2, 0, 0, 1], [1, 1, 0, 0, 1], [-1, -1, 0, 0, 0, 1]])
def test_arb_isolates_the_roots_that_discs_cannot(coefficients: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    by_discs = roots(tuple(coefficients))
    monkeypatch.setattr(algebraic, "discs", lambda f: None)
    by_arb = roots(tuple(coefficients))
    assert [(type(root), root.index) for root in by_arb] == [(type(root), root.index) for root in by_discs]
    assert all(0 < root.high - root.low < Fraction(1, 2**59) for root in by_arb if isinstance(root, RealRoot))
    balls = [(acb(a.enclosure(80)), acb(b.enclosure(80))) for a, b in zip(by_arb, by_discs, strict=True)]
    assert all(abs(a - b) < arb(2) ** -60 for a, b in balls)
    points = [complex(float(a.real.mid()), float(a.imag.mid())) for a, _ in balls]
    assert len(points) == len(coefficients) - 1
    assert all(min(abs(z - points)) < 1e-12 for z in np.roots(coefficients[::-1]))


def test_a_real_root_beside_one_that_is_far_larger_is_seen_to_be_real() -> None:
    """Roots near -1e12, -2.2 and 3.3 ± 1.4i: counted from their mean, three have few right digits at first."""
    f = fmpz_poly(
        [
            3038999999988875000000000459,
            -194999999996335999999999703,
            -467999999998371000000000504,
            107999999999136000000000108,
            108000000000000,
        ]
    )
    isolated = discs(f)
    assert isolated is not None
    assert [disc.y == 0 for disc in isolated] == [True, True, False, False]
    assert [type(root) for root in roots(tuple(int(c) for c in f.coeffs()))] == [RealRoot] * 2 + [ComplexRoot] * 2


def test_roots_beyond_the_range_of_floats_are_left_to_arb() -> None:
    f = fmpz_poly([-(10**1000), 0, 1, 1])
    assert discs(f) is None
    isolated = roots(tuple(int(c) for c in f.coeffs()))
    assert [type(root) for root in isolated] == [RealRoot, ComplexRoot, ComplexRoot]


def test_balls_are_disjoint_or_not_at_any_scale() -> None:
    for scale in (fmpq(1), fmpq(1, 10**30), fmpq(10**30)):
        ball = [acb(arb(k * scale, scale / 3), arb(0, scale / 3)) for k in range(4)]
        assert disjoint(ball)
        assert not disjoint([*ball, acb(arb(fmpq(5, 2) * scale, scale / 3), arb(0, scale / 3))])
        assert disjoint([*ball, acb(arb(fmpq(5, 2) * scale, scale / 3), arb(scale, scale / 3))])
