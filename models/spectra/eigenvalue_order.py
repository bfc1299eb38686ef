"""Exact comparison of the coupling strengths at which modes of a network become unstable.

A mode with the real eigenvalue gamma reaches the effective strength alpha = sigma |gamma| at the
coupling strength sigma = alpha / |gamma|.  Certified balls prove two values different; minimal
polynomials prove two values equal.
"""

from __future__ import annotations

from fractions import Fraction

from flint import arb, arb_poly, fmpq_poly

from ..algebra.balls import precision
from ..algebra.minimal_polynomials import minimal_polynomial
from ..algebra.rationals import to_flint
from .eigenvalue import Eigenvalue


def compare(alpha: Fraction, gamma: Eigenvalue, other_alpha: Fraction, other_gamma: Eigenvalue) -> int:
    """Compare the coupling strengths sigma = alpha / |gamma| of two modes exactly."""
    for strength, mode in ((alpha, gamma), (other_alpha, other_gamma)):
        if strength < 0 or isinstance(mode.value, complex) or not mode.value < 0:
            raise ValueError(
                f"alpha = {strength} of the eigenvalue {mode}: expected alpha >= 0 and a real eigenvalue < 0"
            )
    if alpha == 0 or other_alpha == 0 or gamma.number == other_gamma.number:
        return (alpha > other_alpha) - (alpha < other_alpha)
    bits, polynomial = 64, None
    while True:
        here, there = gamma.enclosure(bits), other_gamma.enclosure(bits)
        with precision(bits + 16):
            scaled = there * arb(to_flint(alpha / other_alpha))
            if scaled < here or scaled > here:
                return 1 if scaled < here else -1
        if bits == 256:
            # Equal numbers have equal minimal polynomials: compare those of gamma and factor * other_gamma.
            p, q = minimal_polynomial(gamma.number), minimal_polynomial(other_gamma.number)
            ratio = to_flint(alpha / other_alpha)
            polynomial = p if p == q(fmpq_poly([0, 1 / ratio])) * ratio ** q.degree() else None
        if polynomial is not None:
            # If the polynomial is monotone on the ball around both numbers, both are its only root there.
            with precision(2 * bits + 64):
                slope = arb_poly(polynomial.derivative())(here.union(scaled))
                if slope > 0 or slope < 0:
                    return 0
        bits *= 2
