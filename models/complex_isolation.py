"""Isolation of all roots, real and complex, of an irreducible polynomial: Aberth's method finds, discs prove.

All roots are improved at once, each as if the others were divided out (O. Aberth, Math. Comp. 27, 339, 1973), from starts
on the circles that the sizes of the coefficients suggest (D. A. Bini, Numer. Algorithms 13, 179, 1996).  Nothing of this is
trusted: within d |f/f'| of any point lies a root of f, of degree d (D. A. Bini, G. Fiorentino, Numer. Algorithms 23, 127,
2000), and d discs that do not touch each other hold one root each.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from flint import acb, acb_poly, arb, fmpq, fmpz, fmpz_poly

from .balls import precision
from .isolation import dyadic

__all__ = ["Disc", "discs", "sharpened"]

_STEPS = 200
"""Steps of the iteration; about fifteen are taken."""
_DIGITS = 2.0**-44
"""Relative size of the step after which Newton's method takes over."""
_SHARP = 160
"""Bits of the discs."""


@dataclass(frozen=True, slots=True)
class Disc:
    """A disc in the complex plane that holds exactly one root; a real centre: the root is real."""

    x: fmpq
    y: fmpq
    radius: fmpq

    @property
    def ball(self) -> acb:
        """A ball that holds the disc."""
        return acb(_wide(self.x, self.radius), _wide(self.y, self.radius))


def discs(f: fmpz_poly) -> list[Disc] | None:
    """One disc for each root of a polynomial without multiple roots, real ones first; None where this finds none.

    Each disc is far smaller than its distance from the others.
    """
    mean = -f[f.degree() - 1] // (f.degree() * f[f.degree()])
    with precision(2 * f.degree() + f.height_bits() + _SHARP + 64):
        for middle in (mean, fmpz(0)):
            near = _aberth(f, middle) or []
            found = [_sharp(f, _snapped(z), _SHARP) for z in near]
            proved = [disc for disc in found if disc is not None]
            if len(proved) == f.degree() and _apart(proved):
                return sorted(proved, key=lambda d: (d.y != 0, d.x, d.y))
    return None


def sharpened(f: fmpz_poly, disc: Disc, room: fmpq, bits: int) -> acb:
    """A ball around the only root within `room` of a disc's centre, of radius below 2**-bits times its modulus.

    Raises ValueError where no such root is found: the disc was wrong.
    """
    with precision(2 * f.degree() + f.height_bits() + 2 * bits + 64):
        start = acb(disc.x, disc.y)
        found = _sharp(f, start, bits + 4)
        if found is None or not abs(acb(found.x, found.y) - start) + arb(found.radius) < arb(room):
            raise ValueError(f"no root near {complex(start)}; expected one within {float(arb(room)):.3g}")
        return found.ball


def _wide(centre: fmpq, radius: fmpq) -> arb:
    return arb(centre) + arb(0, arb(radius).upper())


def _aberth(f: fmpz_poly, middle: fmpz) -> list[acb] | None:
    """All roots to about 2**-44 of their distances from `middle`; None where the iteration does not settle."""
    value, slope = acb_poly(f), acb_poly(f.derivative())
    shift = acb(middle)
    z = _starts(f(fmpz_poly([middle, 1])))
    moving = list(range(len(z)))
    for _ in range(_STEPS):
        still = []
        for k in moving:
            at = acb(z[k].real, z[k].imag) + shift
            try:
                newton = complex((value(at) / slope(at)).mid())
                others = sum(1 / (z[k] - other) for j, other in enumerate(z) if j != k)
                step = newton / (1 - newton * others)
            except (ZeroDivisionError, OverflowError, ValueError):
                return None
            if not cmath.isfinite(step):
                return None
            z[k] -= step
            if abs(step) > _DIGITS * (abs(z[k]) + 1e-12):
                still.append(k)
        moving = still
        if not moving:
            return [acb(w.real, w.imag) + shift for w in z]
    return None


def _starts(f: fmpz_poly) -> list[complex]:
    """Points on circles whose radii are the slopes of the upper hull of log |coefficient| over its place."""
    points = [(k, _log2(int(c))) for k, c in enumerate(f.coeffs()) if c != 0]
    hull: list[tuple[int, float]] = []
    for k, y in points:
        while len(hull) > 1 and (hull[-1][1] - hull[-2][1]) * (k - hull[-2][0]) <= (y - hull[-2][1]) * (
            hull[-1][0] - hull[-2][0]
        ):
            hull.pop()
        hull.append((k, y))
    found = [0j] * hull[0][0]
    for (i, low), (j, high) in pairwise(hull):
        radius = 2.0 ** ((low - high) / (j - i))
        turn = 2 * math.pi / (j - i)
        found += [cmath.rect(radius, turn * k + 0.7 + i) for k in range(j - i)]
    return found


def _log2(c: int) -> float:
    shift = max(abs(c).bit_length() - 60, 0)
    return math.log2(abs(c) >> shift) + shift


def _snapped(z: acb) -> acb:
    """On the real axis where it is next to it; if the root is not there, no disc will say so."""
    return acb(z.real.mid()) if abs(complex(z).imag) < 1e-11 * abs(complex(z)) else z


def _sharp(f: fmpz_poly, z: acb, bits: int) -> Disc | None:
    """Newton's method until d |f/f'| is below 2**-bits of the modulus."""
    value, slope = acb_poly(f), acb_poly(f.derivative())
    for _ in range(bits.bit_length() + 8):
        step = value(z) / slope(z)
        if not step.is_finite():
            return None
        radius = (abs(step) * f.degree()).upper()
        if radius * arb(2) ** bits < abs(z).lower():
            return Disc(dyadic(z.real), dyadic(z.imag), dyadic(radius))
        z = (z - step).mid()
    return None


def _apart(found: Sequence[Disc]) -> bool:
    """True where no two discs touch: floats tell most apart, exact arithmetic the rest; each is far from all others."""
    centres = [complex(float(arb(d.x)), float(arb(d.y))) for d in found]
    return all(
        abs(a - b) > 1e-9 * (abs(a) + abs(b)) > 2**30 * float(arb(d.radius + e.radius))
        for i, (a, d) in enumerate(zip(centres, found, strict=True))
        for b, e in zip(centres[:i], found[:i], strict=True)
    )
