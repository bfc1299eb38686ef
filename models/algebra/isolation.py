"""Isolation of all roots, real and complex, of an irreducible polynomial.

Aberth's method improves all roots at once, each as if the others were divided out (O. Aberth, Math.
Comp. 27, 339, 1973).  It starts on the circles that the sizes of the coefficients suggest (D. A.
Bini, Numer. Algorithms 13, 179, 1996), or on the real axis if Newton's inequalities allow that all
roots are real.  Nothing of this is trusted: within d |f/f'| of any point lies a root of f, of degree
d (D. A. Bini, G. Fiorentino, Numer. Algorithms 23, 127, 2000), and d discs that do not touch hold
one root each.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from flint import acb, acb_poly, arb, arb_poly, fmpq, fmpz, fmpz_poly

from .balls import Ball, disjoint, precision

_IDLE = {arb: 30, acb: 200}
"""Steps without another root that settles, after which the iteration ends; 10 and 70 suffice."""
_DIGITS = 2.0**-44
"""Relative size of the step after which Newton's method takes over."""
_SHARP = 160
"""Bits of the discs."""
_LARGE = 900.0
"""Radii of starts are floats from 2**-900 to 2**900."""


@dataclass(frozen=True, slots=True)
class Disc:
    """A disc in the complex plane that holds exactly one root; a real centre: the root is real."""

    x: fmpq
    y: fmpq
    radius: fmpq

    @property
    def ball(self) -> acb:
        """A ball that holds the disc."""
        return self.within(1)

    def within(self, times: int) -> acb:
        """A ball that holds the disc of so many times the radius."""
        return acb(_wide(self.x, times * self.radius), _wide(self.y, times * self.radius))


def discs(f: fmpz_poly) -> list[Disc] | None:
    """Return one disc for each root of a polynomial, real roots first; None if this finds none.

    No two discs touch, not even at four times their size.
    """
    # values of the polynomial cancel least about the mean of its roots
    mean = -f[f.degree() - 1] // (f.degree() * f[f.degree()])
    shifted = [(middle, f(fmpz_poly([middle, 1]))) for middle in (mean, fmpz(0))]
    real = all(_newton_inequalities(g) for _, g in shifted)
    full = 2 * f.degree() + f.height_bits()
    for bits in sorted({min(_usual(f), full), full}):
        with precision(bits + _SHARP + 64):
            for middle, g in shifted:
                found = _isolated(g, real)
                if found is not None:
                    moved = [Disc(disc.x + middle, disc.y, disc.radius) for disc in found]
                    return sorted(moved, key=lambda disc: (disc.y != 0, disc.x, disc.y))
    return None


def sharpened(f: fmpz_poly, disc: Disc, room: fmpq, bits: int) -> acb:
    """Return a ball around a root, of radius below 2**-bits times its modulus."""
    with precision(2 * f.degree() + f.height_bits() + 2 * bits + 64):
        start = acb(disc.x, disc.y)
        found = _sharp(acb_poly(f), acb_poly(f.derivative()), start, bits + 4)
        if found is None or not abs(acb(found.x, found.y) - start) + arb(found.radius) < arb(room):
            raise ValueError(f"no root near {complex(start)}; expected one within {float(arb(room)):.3g}")
        return found.ball


def sign(f: fmpz_poly, x: fmpq) -> int:
    """Return the sign of f(x): certified by a ball, or exact if the ball cannot tell."""
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
    """Bits that usually cancel in a value of f between its roots: a few for each root."""
    return 4 * int(f.degree()) + 64


def _isolated(f: fmpz_poly, real: bool) -> list[Disc] | None:
    """One proved disc for each root, from starts on the axis (if `real`), then on circles."""
    radii = _radii(f)
    if radii is None:
        return None
    found = _proved(f, arb, _on_axis(radii)) if real else None
    return found or _proved(f, acb, _on_circles(radii))


def _proved(f: fmpz_poly, kind: type, starts: Sequence[complex]) -> list[Disc] | None:
    """Discs that do not touch each other, by Aberth's method; None if one is missing."""
    value, slope = (arb_poly(p) if kind is arb else acb_poly(p) for p in (f, f.derivative()))
    found = []
    for z in _aberth(value, slope, kind, list(starts)) or ():
        disc = _sharp(value, slope, _point(kind, z), _SHARP)
        if disc is None:
            return None
        found.append(disc)
    if len(found) != f.degree() or not disjoint([disc.within(4) for disc in found]):
        return None
    return [_on_its_side(disc) for disc in found]


def _on_its_side(disc: Disc) -> Disc:
    """The disc, its centre put on the real axis if it meets the axis: then its root is real.

    The mirror image of the disc holds the mirror image of its root, and no other disc is near: the
    two are one root.
    """
    return disc if abs(disc.y) > disc.radius else Disc(disc.x, fmpq(0), disc.radius + abs(disc.y))


def _newton_inequalities(f: fmpz_poly) -> bool:
    """Whether all roots may be real.

    Some are complex if c_k² < c_(k-1) c_(k+1) (1 + 1/k) (1 + 1/(d - k)) for some k.
    """
    c, d = f.coeffs(), f.degree()
    return all(c[k] * c[k] * k * (d - k) >= c[k - 1] * c[k + 1] * (k + 1) * (d - k + 1) for k in range(1, d))


def _aberth(value: Ball, slope: Ball, kind: type, z: list[complex]) -> list[complex] | None:
    """All roots to about 2**-44 of themselves.

    None if the iteration does not settle, or the precision is too low.
    """
    number = float if kind is arb else complex
    moving, idle = list(range(len(z))), 0
    while idle < _IDLE[kind]:
        still = []
        for k in moving:
            at = _point(kind, z[k])
            try:
                ball = value(at) / slope(at)
                newton = number(ball.mid())
                others = sum([1 / (z[k] - w) for w in z[:k] + z[k + 1 :]])
                step = newton / (1 - newton * others)
            except (ZeroDivisionError, OverflowError, ValueError):
                return None
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
    """The approximate modulus of each root, ascending; None if one is beyond the range of floats.

    They are slopes of the upper hull of log |coefficient| over its place.
    """
    points = [(k, _log2(int(c))) for k, c in enumerate(f.coeffs()) if c != 0]
    hull: list[tuple[int, float]] = []
    for k, y in points:
        while len(hull) > 1 and (hull[-1][1] - hull[-2][1]) * (k - hull[-2][0]) <= (y - hull[-2][1]) * (
            hull[-1][0] - hull[-2][0]
        ):
            hull.pop()
        hull.append((k, y))
    found = [0.0] * hull[0][0]
    for (i, low), (j, high) in pairwise(hull):
        size = (low - high) / (j - i)
        if abs(size) > _LARGE:
            return None
        found += [2.0**size] * (j - i)
    return found


def _on_circles(radii: Sequence[float]) -> list[complex]:
    """Starts at equal angles on each circle."""
    return [cmath.rect(r, 2 * math.pi * k / radii.count(r) + 0.7 + radii.index(r)) for k, r in enumerate(radii)]


def _on_axis(radii: Sequence[float]) -> list[complex]:
    """Starts on both sides of 0, no two of them equal."""
    return [r * (1 + 1e-3 * k / len(radii)) * (-1) ** k for k, r in enumerate(radii)]


def _log2(c: int) -> float:
    shift = max(abs(c).bit_length() - 60, 0)
    return math.log2(abs(c) >> shift) + shift


def _sharp(value: Ball, slope: Ball, z: Ball, bits: int) -> Disc | None:
    """Newton's method until d |f/f'| is at most 2**-bits of the modulus."""
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
