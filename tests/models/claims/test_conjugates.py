"""Products over complete sets of conjugates, and what is no such set."""

from __future__ import annotations

from fractions import Fraction

import pytest
import sympy as sp
from flint import fmpq_poly

from synchain.graphs import chain, ring, star, wheel
from synchain.models.algebra.cosine_sums import AngleSum, expression, minimal_polynomial
from synchain.models.algebra.minimal_polynomials import multiplied
from synchain.models.claims.cosine_text import cosine_sum
from synchain.models.spectra.characteristic import characteristic

SEVENTH = [AngleSum.cosine(-2, 1, k, 7) for k in (1, 2, 3)]


def ring_numbers(n: int) -> list[tuple[AngleSum, int]]:
    return [(AngleSum.cosine(-2, 1, k, n), 1) for k in range(n)]


@pytest.mark.parametrize("n", [3, 4, 5, 12, 25, 60])
def test_rings_and_chains_multiply_out(n: int) -> None:
    assert multiplied(ring_numbers(n)) == characteristic(ring(n))
    assert multiplied((AngleSum.cosine(-2, 1, k, 2 * n), 1) for k in range(n)) == characteristic(chain(n))


def test_factors_may_be_written_with_either_sign() -> None:
    """-2 cos(2 pi/7) is 2 cos(5 pi/7), a multiple of pi/14 counted in whole turns."""
    mixed = [AngleSum.cosine(-2, 1, 1, 7), AngleSum.cosine(-2, -1, 3, 14), AngleSum.cosine(-2, 1, 3, 7)]
    assert mixed[1].near == pytest.approx(SEVENTH[1].near)
    assert multiplied((x, 2) for x in mixed) == minimal_polynomial(SEVENTH[0]) ** 2


def test_rationals_and_fractions() -> None:
    half = Fraction(1, 2)
    assert multiplied([(AngleSum.rational(half), 2)]) == fmpq_poly([1, -4, 4]) / 4
    assert multiplied([(AngleSum.rational(0), 1), (AngleSum.rational(-1), 2), (AngleSum.rational(-4), 1)]) == (
        characteristic(star(4))
    )
    assert multiplied((AngleSum.cosine(half, half, k, 5), 1) for k in (1, 2)) == fmpq_poly([-1, -2, 4]) / 4


def test_what_is_not_complete_is_left() -> None:
    assert multiplied((x, 1) for x in SEVENTH[:2]) is None
    assert multiplied(zip(SEVENTH, (1, 2, 3), strict=True)) is None
    assert multiplied(zip(SEVENTH, (2, 2, 1), strict=True)) is None
    assert multiplied([(SEVENTH[0] + AngleSum.cosine(0, 1, 1, 5), 1)]) is None
    assert multiplied([*((x, 1) for x in SEVENTH), (SEVENTH[0], 1)]) is None


def test_other_rings_are_other_polynomials() -> None:
    assert multiplied(ring_numbers(12)) != characteristic(wheel(12))
    assert multiplied([(x + AngleSum.rational(1), 1) for x, _ in ring_numbers(12)]) != characteristic(ring(12))


@pytest.mark.parametrize(
    "text",
    [
        "-4*sin(k*pi/n)**2",
        "cos((pi*k)*2/n)",
        "sin((2*k+1)*pi/(2*n))**2",
        "cos(pi*(k/3-1)/2)",
        "cos(-pi*k/7)*cos(pi*k/7)",
        "cos(pi*(3-k)/n)+1/n",
        "(cos(pi*k/5)-sin(pi*k/5))**3",
        "cos(pi*2*k/n)/(n-1)",
        "cos(pi/7)",
        "cos(-k*pi/n)*n",
    ],
)
def test_a_letter_gives_the_numbers_of_floats(text: str) -> None:
    for n in (5, 12):
        sums = [cosine_sum(text, {"n": n, "k": k}) for k in range(-3, 9)]
        value = sp.lambdify(sp.symbols("n k"), sp.sympify(text), "math")
        assert [x and x.near for x in sums] == pytest.approx([value(n, k) for k in range(-3, 9)])


def test_short_sums_are_read_back() -> None:
    sums = [cosine_sum("2*cos(2*pi*k/5)", {"k": k}) for k in (0, 1)]
    assert [x and expression(x) for x in sums] == [2, sp.sqrt(5) / 2 - sp.Rational(1, 2)]


@pytest.mark.parametrize("text", ["cos(k)", "cos(pi*j/7)", "cos(pi/(k-3))"])
def test_other_angles_are_left(text: str) -> None:
    assert cosine_sum(text, {"n": 5, "k": 3}) is None
