"""Isolation of the roots of polynomials that have real roots only: Laguerre's method finds, signs prove.

From the left of all roots Laguerre's iteration climbs to the smallest one and never beyond it (A. S. Householder,
The Numerical Treatment of a Single Nonlinear Equation, McGraw-Hill, 1970, section 4.3); each root found is divided out
by subtracting its part from the logarithmic derivative (H. J. Maehly, Z. angew. Math. Phys. 5, 260, 1954).  Nothing
of this is trusted: a bracket counts only where the signs at its ends, certified by Arb, differ.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from flint import arb, arb_poly, fmpq, fmpz, fmpz_poly

from .balls import Ball, precision

__all__ = ["dyadic", "real_brackets", "sign"]

Bracket = tuple[fmpq, fmpq]

_STEPS = 100
"""Steps of the iteration towards one root; about seven are taken."""
_ATTEMPTS = 4
"""Each with brackets of twice as many digits as the one before."""


def real_brackets(f: fmpz_poly) -> list[Bracket] | None:
    """Disjoint brackets of all roots, ascending, of an irreducible polynomial of degree >= 2; None where some are complex.

    As many sign changes as the degree are all the roots there are.
    """
    if not _newton_inequalities(f):
        return None
    centre = -f[f.degree() - 1] // (f.degree() * f[f.degree()])  # values cancel least about the mean of the roots
    found = _centred(f(fmpz_poly([centre, 1])))
    return None if found is None else [(low + centre, high + centre) for low, high in found]


def _centred(f: fmpz_poly) -> list[Bracket] | None:
    """The brackets, with few bits first; then with as many as the coefficients have, and finer ones."""
    full = 2 * f.degree() + f.height_bits()
    tried = [(min(_usual(f), full), 128), *((full, 128 * 2**attempt) for attempt in range(_ATTEMPTS))]
    for bits, width in tried:
        with precision(bits + 3 * width):
            found = _climb(f, width)
        if found is not None:
            brackets = [_around(root, width) for root in found]
            if _proved(f, brackets):
                return brackets
    return None


def sign(f: fmpz_poly, x: fmpq) -> int:
    """The sign of f(x): certified by a ball, or exact where the ball cannot tell."""
    full = f.height_bits() + 2 * f.degree()
    for bits in sorted({min(_usual(f), full), full}):
        with precision(bits + 320):
            value = arb_poly(f)(arb(x))
            if value > 0 or value < 0:
                return 1 if value > 0 else -1
    exact = f(x)
    return (exact > 0) - (exact < 0)


def _usual(f: fmpz_poly) -> int:
    """Bits that usually cancel in a value of f between its roots: some per root, however large the roots are."""
    return 4 * f.degree() + 64


def dyadic(ball: arb) -> fmpq:
    """The midpoint of a ball, exactly."""
    mantissa, exponent = ball.mid().man_exp()
    return fmpq(mantissa) * fmpq(2) ** int(exponent)


def _newton_inequalities(f: fmpz_poly) -> bool:
    """False where c_k² < c_(k-1) c_(k+1) (1 + 1/k) (1 + 1/(d - k)) for some k: then some roots are complex."""
    c, d = f.coeffs(), f.degree()
    return all(c[k] * c[k] * k * (d - k) >= c[k - 1] * c[k + 1] * (k + 1) * (d - k + 1) for k in range(1, d))


def _climb(f: fmpz_poly, width: int) -> list[Ball] | None:
    """The roots, ascending, within about 2**-width; None where an iteration does not end or leaves the real line."""
    first = f.derivative()
    values = [arb_poly(p) for p in (f, first, first.derivative())]
    scale = arb(_root_bound(f))
    start, found = -scale, list[Ball]()
    for left in range(f.degree(), 0, -1):
        root = _laguerre(values, start, found, left, scale * arb(2) ** -(width + 32))
        if root is None:
            return None
        found.append(root)
        start = (root + scale * arb(2) ** -(width - 32)).mid()
    return found


def _laguerre(values: Sequence[arb_poly], start: Ball, found: Sequence[Ball], left: int, small: Ball) -> Ball | None:
    """Climb from `start` to the smallest of the `left` roots that are not divided out yet."""
    x, last = start, None
    for _ in range(_STEPS):
        f, first, second = (p(x).mid() for p in values)
        if f == 0:
            return x
        slope = first / f
        curve = slope * slope - second / f
        for root in found:
            part = 1 / (x - root)
            slope, curve = (slope - part).mid(), (curve - part * part).mid()
        spread = ((left - 1) * (left * curve - slope * slope)).mid()
        if spread < 0:
            if left > 1 and abs(spread) > slope * slope * arb(2) ** -48:
                return None
            spread = arb(0)
        step = (-left / (slope + spread.sqrt() * (1 if slope > 0 else -1))).mid()  # back if rounding passed a root
        if not step.is_finite():
            return None
        x = (x + step).mid()
        if abs(step) < small or (last is not None and abs(step) < small * arb(2) ** 48 and abs(step) >= last):
            return x
        last = abs(step)
    return None


def _root_bound(f: fmpz_poly) -> int:
    """A power of two beyond all roots (Fujiwara's bound, Tohoku Math. J. 10, 167, 1916)."""
    c, d = f.coeffs(), f.degree()
    lead = int(abs(c[d])).bit_length() - 1
    return 2 ** (
        1 + max((int(abs(c[d - k])).bit_length() - lead + k - 1) // k for k in range(1, d + 1) if c[d - k] != 0)
    )


def _around(root: Ball, width: int) -> Bracket:
    """The root, rounded, with 2**-width on either side."""
    near = fmpq((dyadic(root) * fmpz(2) ** (width + 2)).floor(), fmpz(2) ** (width + 2))
    half = fmpq(1, fmpz(2) ** width)
    return near - half, near + half


def _proved(f: fmpz_poly, brackets: Sequence[Bracket]) -> bool:
    """True where the brackets are disjoint and the polynomial changes its sign in each."""
    if any(first[1] >= second[0] for first, second in pairwise(brackets)):
        return False
    return len(brackets) == f.degree() and all(sign(f, low) * sign(f, high) < 0 for low, high in brackets)
