"""The order in which SymPy's CRootOf counts the roots of a polynomial that lie off the real axis.

SymPy sorts them by the lower left corners of the boxes in which its bisection first isolates them
(G. E. Collins, W. Krandick, ISSAC 1992, 189), not by their real parts.  The boxes follow from the roots
alone, so that the order is found here in no time, where SymPy needs minutes from degree 25 on.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import sympy as sp
from flint import acb, arb, fmpq

__all__ = ["complex_order"]


def complex_order(polynomial: tuple[int, ...], upper: Sequence[acb]) -> list[int]:
    """The positions in `upper` (balls around the roots above the real axis) in SymPy's order."""
    if len(upper) < 2:
        return list(range(len(upper)))
    given = sp.Poly(list(polynomial[::-1]), sp.Symbol("x"))
    scale, inner = sp.CRootOf(given, 0).as_coeff_Mul()  # SymPy may count the roots of a rescaled polynomial
    coefficients = [abs(int(c)) for c in inner.poly.all_coeffs()]
    bound = 2 * max(Fraction(c, coefficients[0]) for c in coefficients)
    shrink = acb(fmpq(int(scale.q), int(scale.p)))
    boxes = _leaves({k: ball * shrink for k, ball in enumerate(upper)}, (-bound, Fraction(0), bound, bound))
    if boxes is None:  # a root on the border of a box
        return _ask_sympy(given, upper)
    return [k for _, k in sorted(boxes)]


def _leaves(
    roots: dict[int, acb], box: tuple[Fraction, Fraction, Fraction, Fraction]
) -> list[tuple[tuple[Fraction, Fraction], int]] | None:
    """The lower left corner of the box of each root; None where a root cannot be told from a border."""
    found, boxes = [], [(roots, box)]
    while boxes:
        inside, (left, low, right, top) = boxes.pop()
        if len(inside) == 1:
            found.append(((left, low), next(iter(inside))))
            continue
        upright = right - left > top - low
        middle = (left + right) / 2 if upright else (low + top) / 2
        border = arb(fmpq(middle.numerator, middle.denominator))
        first: dict[int, acb] = {}
        second: dict[int, acb] = {}
        for k, ball in inside.items():
            place = ball.real if upright else ball.imag
            if place.overlaps(border):
                return None
            (first if place < border else second)[k] = ball
        halves = (
            ((left, low, middle, top), (middle, low, right, top))
            if upright
            else ((left, low, right, middle), (left, middle, right, top))
        )
        boxes += [(part, half) for part, half in zip((first, second), halves, strict=True) if part]
    return found


def _ask_sympy(polynomial: sp.Poly, upper: Sequence[acb]) -> list[int]:
    """The same order from SymPy's own values: slow, but it knows on which side of a border a root counts."""
    centres = [complex(float(ball.real.mid()), float(ball.imag.mid())) for ball in upper]
    first = polynomial.degree() - 2 * len(upper)
    values = [complex(sp.CRootOf(polynomial, first + 2 * i + 1).evalf(20)) for i in range(len(upper))]
    return [min(range(len(centres)), key=lambda k: abs(centres[k] - value)) for value in values]
