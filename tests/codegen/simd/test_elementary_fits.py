"""The polynomials of the elementary functions, made again from what they approximate, and their stated errors."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import NamedTuple

import mpmath
import pytest
from mpmath import mpf
from remez import chebyshev_points, minimax, rounded_minimax, worst

from synchain.codegen.simd import elementary

DIGITS = 40


class Fit(NamedTuple):
    """What a table of coefficients approximates, where, and how it is weighted."""

    target: Callable[[mpf], mpf]
    weight: Callable[[mpf], mpf]
    low: float
    high: float
    held: int
    """So many coefficients are rounded one at a time."""
    stated: str
    """The error in the docstring of the table."""

    def samples(self, points: int) -> list[tuple[mpf, mpf, mpf]]:
        return [(x, self.target(x), self.weight(x)) for x in chebyshev_points(mpf(self.low), mpf(self.high), points)]


def odd(function: Callable[[mpf], mpf]) -> tuple[Callable[[mpf], mpf], Callable[[mpf], mpf]]:
    """Target and weight for an odd function f(t) = t + t z P(z) with z = t**2 and the relative error of f."""

    def ratio(z: mpf) -> mpf:
        return function(mpmath.sqrt(z)) / mpmath.sqrt(z)

    return lambda z: (ratio(z) - 1) / z, lambda z: z / ratio(z)


FITS = {
    "ATAN": Fit(*odd(mpmath.atan), 2**-20, 1.0, 3, "7.1e-18"),
    "SINE": Fit(*odd(mpmath.sin), 2**-20, 2.5, 3, "3.5e-19"),
    "EXP": Fit(lambda r: (mpmath.exp(r) - 1 - r) / r**2, lambda r: r**2 / mpmath.exp(r), -0.3466, 0.3466, 0, "1.1e-17"),
}


@pytest.mark.parametrize("name", FITS)
def test_the_coefficients_come_from_the_fit(name):
    coefficients = getattr(elementary, name)
    with mpmath.workdps(DIGITS):
        assert coefficients == rounded_minimax(FITS[name].samples(120), len(coefficients), FITS[name].held)


@pytest.mark.parametrize("name", FITS)
def test_the_stated_error_is_the_error(name):
    fit = FITS[name]
    assert f" {fit.stated} of it" in inspect.getsource(elementary)
    with mpmath.workdps(DIGITS):
        error = worst(getattr(elementary, name), fit.samples(1500))
    assert 0.9 * float(fit.stated) < error <= float(fit.stated)


@pytest.mark.parametrize("name", FITS)
def test_the_reduced_range_lies_inside_the_fit(name):
    reach = {"ATAN": 1.0, "SINE": (mpmath.pi / 2) ** 2, "EXP": mpmath.log(2) / 2}
    assert reach[name] <= FITS[name].high


def test_minimax_of_a_known_case():
    # the best line for x**2 on [-1, 1] is 1/2, the best cubic for x**4 is x**2 - 1/8
    with mpmath.workdps(DIGITS):
        for power, expected in ((2, (0.5, 0.0)), (4, (-0.125, 0.0, 1.0, 0.0))):
            samples = [(x, x**power, mpf(1)) for x in chebyshev_points(mpf(-1), mpf(1), 129)]
            fit = minimax(samples, len(expected))
            assert max(abs(a - b) for a, b in zip(fit, expected, strict=True)) < 1e-3
