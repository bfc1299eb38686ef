"""Isolation of all roots, real and complex, of an irreducible polynomial.

Aberth's method improves all roots at once by Newton steps for f divided by the other factors (O. Aberth,
Math. Comp. 27, 339, 1973).  Start values lie on circles with radii estimated from the coefficients (D. A.
Bini, Numer. Algorithms 13, 179, 1996), or on the real axis if Newton's inequalities allow all roots to be
real.  The proof: for f of degree d, a root of f lies within d |f/f'| of any point (D. A. Bini,
G. Fiorentino, Numer. Algorithms 23, 127, 2000), so d discs that do not touch contain one root each.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from flint import acb, acb_poly, arb, arb_poly, fmpq, fmpz, fmpz_poly

from .balls import Ball, disjoint, precision

# Aberth's method stops after this many steps without a newly converged root; 10 and 70 suffice in tests.
_IDLE = {arb: 30, acb: 200}
_DIGITS = 2.0**-44  # relative step size below which a root has converged in floats; Newton's method in balls follows
_SHARP = 160  # relative accuracy of the discs in bits
_LARGE = 900.0  # start radii must lie between 2**-_LARGE and 2**_LARGE, so that no float overflows


@dataclass(frozen=True, slots=True)
class Disc:
    """A disc in the complex plane that contains exactly one root; if the centre is real, the root is real."""

    x: fmpq
    y: fmpq
    radius: fmpq

    @property
    def ball(self) -> acb:
        return self.within(1)

    def within(self, times: int) -> acb:
        """Return a ball that contains the disc enlarged by the factor `times`."""
        return acb(_wide(self.x, times * self.radius), _wide(self.y, times * self.radius))


def discs(f: fmpz_poly) -> list[Disc] | None:
    """Return one disc for each root of a polynomial, real roots first; None if isolation fails."""
    # No two discs touch, even if enlarged four times.
    #
    # Shift the origin to the mean of the roots, where evaluating the polynomial cancels least.
    mean = -f[f.degree() - 1] // (f.degree() * f[f.degree()])
    shifted = [(middle, f(fmpz_poly([middle, 1]))) for middle in (mean, fmpz(0))]
    real = all(_may_be_real(g) for _, g in shifted)
    full = 2 * f.degree() + f.height_bits()
    for bits in sorted({min(_usual(f), full), full}):
        with precision(bits + _SHARP + 64):
            for middle, g in shifted:
                isolated = _isolated(g, real)
                if isolated is not None:
                    moved = [Disc(disc.x + middle, disc.y, disc.radius) for disc in isolated]
                    return sorted(moved, key=lambda disc: (disc.y != 0, disc.x, disc.y))
    return None


def sharpened(f: fmpz_poly, disc: Disc, room: fmpq, bits: int) -> acb:
    """Return a ball around a root, of radius below 2**-bits times its modulus."""
    with precision(2 * f.degree() + f.height_bits() + 2 * bits + 64):
        start = acb(disc.x, disc.y)
        isolated = _sharp(acb_poly(f), acb_poly(f.derivative()), start, bits + 4)
        if isolated is None or not abs(acb(isolated.x, isolated.y) - start) + arb(isolated.radius) < arb(room):
            raise ValueError(f"no root near {complex(start)}; expected one within {float(arb(room)):.3g}")
        return isolated.ball


def sign(f: fmpz_poly, x: fmpq) -> int:
    """Return the sign of f(x), from a ball, or exactly if the ball contains 0."""
    full = f.height_bits() + 2 * f.degree()
    for bits in sorted({min(_usual(f), full), full}):
        with precision(bits + 320):
            value = arb_poly(f)(arb(x))
            if value > 0 or value < 0:
                return 1 if value > 0 else -1
    exact = f(x)
    return int(exact > 0) - int(exact < 0)


def dyadic(ball: arb) -> fmpq:
    """Return the midpoint of a ball, exactly."""
    mantissa, exponent = ball.mid().man_exp()
    return fmpq(mantissa) * fmpq(2) ** int(exponent)


def _usual(f: fmpz_poly) -> int:
    """Estimate the bits lost to cancellation when f is evaluated between its roots: four for each root."""
    return 4 * int(f.degree()) + 64


def _isolated(f: fmpz_poly, real: bool) -> list[Disc] | None:
    """Return one proved disc for each root, from starts on the real axis if `real`, else on circles."""
    radii = _radii(f)
    if radii is None:
        return None
    if real:  # distinct starts on both sides of 0
        starts: list[complex] = [r * (1 + 1e-3 * k / len(radii)) * (-1) ** k for k, r in enumerate(radii)]
        isolated = _proved(f, arb, starts)
        if isolated:
            return isolated
    # Start at equal angles on each circle.
    starts = [cmath.rect(r, 2 * math.pi * k / radii.count(r) + 0.7 + radii.index(r)) for k, r in enumerate(radii)]
    return _proved(f, acb, starts)


def _proved(f: fmpz_poly, kind: type, starts: Sequence[complex]) -> list[Disc] | None:
    """Compute all roots by Aberth's method and prove disjoint discs around them; None if the proof fails."""
    value, slope = (arb_poly(p) if kind is arb else acb_poly(p) for p in (f, f.derivative()))
    isolated = []
    for z in _aberth(value, slope, kind, list(starts)) or ():
        disc = _sharp(value, slope, _point(kind, z), _SHARP)
        if disc is None:
            return None
        isolated.append(disc)
    if len(isolated) != f.degree() or not disjoint([disc.within(4) for disc in isolated]):
        return None
    # A disc that meets the real axis contains a real root: its mirror image contains the conjugate root, and no other
    # disc is near, so root and conjugate are equal.
    return [
        disc if abs(disc.y) > disc.radius else Disc(disc.x, fmpq(0), disc.radius + abs(disc.y)) for disc in isolated
    ]


def _may_be_real(f: fmpz_poly) -> bool:
    """Test Newton's inequalities c_k² >= c_(k-1) c_(k+1) (1 + 1/k) (1 + 1/(d - k)), necessary for real roots only."""
    c, d = f.coeffs(), f.degree()
    return all(c[k] * c[k] * k * (d - k) >= c[k - 1] * c[k + 1] * (k + 1) * (d - k + 1) for k in range(1, d))


def _aberth(value: Ball, slope: Ball, kind: type, z: list[complex]) -> list[complex] | None:
    """Return all roots to about 2**-44 of their moduli; None if the iteration fails or precision is too low."""
    number = float if kind is arb else complex
    moving, idle = list(range(len(z))), 0
    while idle < _IDLE[kind]:
        still = []
        for k in moving:
            at = _point(kind, z[k])
            try:  # Newton's step, corrected for all other roots
                ball = value(at) / slope(at)
                newton = number(ball.mid())
                others = sum([1 / (z[k] - w) for w in z[:k] + z[k + 1 :]])
                step = newton / (1 - newton * others)
            except (ZeroDivisionError, OverflowError, ValueError):
                return None
            # Require a ball of f/f' that is narrow compared with the step, or a negligible step.
            error = float(abs(ball - ball.mid()).upper())
            if not (cmath.isfinite(step) and error <= 2.0**-8 * abs(newton) + _DIGITS * abs(z[k])):
                return None
            z[k] -= step
            if abs(step) > _DIGITS * abs(z[k]):
                still.append(k)
        idle = idle + 1 if len(still) == len(moving) else 0
        moving = still
        if not moving:
            return z
    return None


def _radii(f: fmpz_poly) -> list[float] | None:
    """Estimate the modulus of each root, ascending; None if a modulus exceeds the range of floats."""
    # Points (k, log2 |c_k|) of the coefficients c_k; take the logarithm from the leading 60 bits.
    points = []
    for k, c in enumerate(f.coeffs()):
        if c != 0:
            shift = max(abs(int(c)).bit_length() - 60, 0)
            points.append((k, math.log2(abs(int(c)) >> shift) + shift))

    # Slopes of the upper convex hull of the points estimate the moduli.
    hull: list[tuple[int, float]] = []
    for k, y in points:
        while len(hull) > 1 and (hull[-1][1] - hull[-2][1]) * (k - hull[-2][0]) <= (y - hull[-2][1]) * (
            hull[-1][0] - hull[-2][0]
        ):
            hull.pop()
        hull.append((k, y))
    moduli = [0.0] * hull[0][0]
    for (i, low), (j, high) in pairwise(hull):
        size = (low - high) / (j - i)
        if abs(size) > _LARGE:
            return None
        moduli += [2.0**size] * (j - i)
    return moduli


def _sharp(value: Ball, slope: Ball, z: Ball, bits: int) -> Disc | None:
    """Iterate Newton's method until d |f/f'| is at most 2**-bits times the modulus; None without convergence."""
    for _ in range(bits.bit_length() + 8):
        step = value(z) / slope(z)
        if not step.is_finite():
            return None
        radius = (abs(step) * value.degree()).upper()
        if radius * arb(2) ** bits <= abs(z).lower():
            x, y = (z, arb(0)) if isinstance(z, arb) else (z.real, z.imag)
            return Disc(dyadic(x), dyadic(y), dyadic(radius))
        z = (z - step).mid()
    return None


def _point(kind: type, z: complex) -> Ball:
    return arb(z.real) if kind is arb else acb(z.real, z.imag)


def _wide(centre: fmpq, radius: fmpq) -> arb:
    return arb(centre) + arb(0, arb(radius).upper())
