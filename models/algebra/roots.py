"""Algebraic numbers, each given by an irreducible integer polynomial and an enclosure of one root.

The enclosure of a real root is an interval with a change of sign of the polynomial; the enclosure of a
complex root is a disc without another root.  Both can be refined to any accuracy.  `isolation.py` isolates
the roots; Arb does if `isolation.py` fails (F. Johansson, IEEE Trans. Comput. 66, 1281, 2017).  Brackets of
real roots are refined by secant guesses, proved by signs (J. Abbott, ACM Commun. Comput. Algebra 48, 3,
2014).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from math import isqrt

import sympy as sp
from flint import acb, arb, fmpq, fmpz_poly
from sympy.printing.precedence import PRECEDENCE
from sympy.printing.pretty.stringpict import prettyForm

from .balls import Ball, nearest, precision
from .isolation import Disc, discs, dyadic, sharpened, sign
from .rationals import to_flint, to_fraction

# Integer coefficients, constant first, of an irreducible primitive polynomial; the leading one is positive.
Polynomial = tuple[int, ...]

_X = sp.Symbol("x")

_WRITTEN = 14_000  # longest integer, in bits, that Python converts to and from decimal text by default (4300 digits)


@dataclass(frozen=True, slots=True)
class Root:
    """One root of an irreducible polynomial of degree >= 2."""

    polynomial: Polynomial  # integer coefficients, constant first; primitive, the leading one positive
    # index of SymPy's CRootOf: real roots ascending, then complex roots.  The text of the number, and with it tables
    # and JSON, contains the index.  `complex_order` computes the index of a complex root without SymPy's isolation,
    # which takes minutes where Aberth's method takes a second.
    index: int

    @property
    def text(self) -> str:
        """This number as text that SymPy reads: CRootOf(…)."""
        return f"CRootOf({polynomial_text(self.polynomial)}, {self.index})"

    @property
    def expression(self) -> sp.Expr:
        """This number as SymPy's CRootOf, printed as a decimal."""
        return _expression(self)

    def enclosure(self, bits: int) -> Ball:
        """Return a ball around this number with a radius below 2**-bits times its modulus."""
        raise NotImplementedError


@dataclass(frozen=True, slots=True)
class RealRoot(Root):
    """The only root of `polynomial` between `low` and `high`."""

    low: Fraction
    high: Fraction

    def __post_init__(self) -> None:
        f = fmpz_poly(list(self.polynomial))
        if not self.low < self.high or sign(f, to_flint(self.low)) * sign(f, to_flint(self.high)) >= 0:
            raise ValueError(
                f"{self.text}: no sign change from {_short(self.low)} to {_short(self.high)}; expected a bracket of "
                "one root"
            )

    def enclosure(self, bits: int) -> arb:
        """Return a ball around this number with a relative radius below 2**-bits."""
        low, high = _refined(self, bits)
        with precision(bits + 16):
            return arb(low).union(arb(high))


@dataclass(frozen=True, slots=True)
class ComplexRoot(Root):
    """The only root of `polynomial` within the distance `room` of `near` = (real, imaginary); the root is not real."""

    near: tuple[Fraction, Fraction]
    room: Fraction

    def enclosure(self, bits: int) -> acb:
        """Return a ball around this number with a radius below 2**-bits times its modulus."""
        return _sharpened(self, bits)


@lru_cache(maxsize=64)
def polynomial_text(polynomial: Polynomial) -> str:
    """Write the polynomial in x like SymPy."""
    # If Python refuses to convert a coefficient to text, write the degree and the size of the coefficients.
    longest = max(abs(c).bit_length() for c in polynomial)
    if longest > _WRITTEN:
        return f"polynomial of degree {len(polynomial) - 1} with coefficients of up to {longest} bits"
    return str(sp.sstr(sp.Poly(list(polynomial[::-1]), _X).as_expr()))


def coefficient_text(c: int) -> str:
    """Write an integer as text for `int(text, 0)`, in hexadecimal if Python refuses to write the decimals."""
    return str(c) if abs(c).bit_length() <= _WRITTEN else hex(c)


def _short(x: Fraction) -> str:
    longest = max(abs(x.numerator).bit_length(), x.denominator.bit_length())
    return str(x) if longest < 100 else f"a fraction of {longest} bits"


class ComplexRootOf(sp.CRootOf):
    """A CRootOf of SymPy that prints as a decimal, because its polynomial may fill pages; equal to SymPy's own."""

    __slots__ = ("shown",)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, sp.CRootOf) and (self.poly, self.index) == (other.poly, other.index)

    __hash__ = sp.CRootOf.__hash__

    @property
    def precedence(self) -> int:
        """Printer precedence of a sum, since the text may be -1.5 - 0.9*I."""
        return int(PRECEDENCE["Add"])

    def _sympystr(self, printer: object) -> str:
        # When SymPy rebuilds an expression, it creates the root anew without its decimal.
        if not hasattr(self, "shown"):
            coefficients = tuple(int(c) for c in self.poly.all_coeffs()[::-1])
            return f"CRootOf({polynomial_text(coefficients)}, {self.index})"
        return str(self.shown)

    _latex = _sympystr

    def _pretty(self, printer: object) -> prettyForm:
        return prettyForm(self._sympystr(printer))


@lru_cache(maxsize=512)
def _expression(root: Root) -> sp.Expr:
    root_of = ComplexRootOf(sp.Poly(list(root.polynomial[::-1]), _X), root.index)
    # For some polynomials SymPy returns a number times a root of a rescaled polynomial.
    factor, part = root_of.as_coeff_Mul()
    if isinstance(part, ComplexRootOf):
        value = nearest(root.enclosure) / float(factor)
        part.shown = f"{value.real:.16g}"
        if isinstance(value, complex):
            part.shown += f" {'-' if value.imag < 0 else '+'} {abs(value.imag):.16g}*I"
    return root_of


@lru_cache(maxsize=4096)
def _sharpened(root: ComplexRoot, bits: int) -> acb:
    disc = Disc(to_flint(root.near[0]), to_flint(root.near[1]), fmpq(0))
    return sharpened(fmpz_poly(list(root.polynomial)), disc, to_flint(root.room), bits)


def _by_arb(f: fmpz_poly) -> list[Disc]:
    """Isolate the roots with Arb, which takes a second at degree 100 and minutes at degree 200."""
    with precision(128):
        balls = [root for root, _ in f.complex_roots()]
        reals = sorted((ball for ball in balls if ball.imag == 0), key=lambda ball: dyadic(ball.real))
        others = [ball for ball in balls if ball.imag != 0]
        radii = [dyadic((ball.real.rad() + ball.imag.rad()).upper()) for ball in reals + others]
    return [
        Disc(dyadic(ball.real), dyadic(ball.imag), radius) for ball, radius in zip(reals + others, radii, strict=True)
    ]


def roots(polynomial: Polynomial) -> tuple[Root, ...]:
    """Return all roots of a polynomial, each with a disc proved to contain no other root."""
    f = fmpz_poly(list(polynomial))
    isolated = discs(f) or _by_arb(f)
    reals = [disc for disc in isolated if disc.y == 0]
    upper = [disc for disc in isolated if disc.y > 0]
    numbers: list[Root] = [
        RealRoot(polynomial, i, to_fraction(d.x - d.radius), to_fraction(d.x + d.radius)) for i, d in enumerate(reals)
    ]
    with precision(256):
        balls = [disc.ball for disc in upper]
    for pair, k in enumerate(complex_order(polynomial, balls)):
        x, y, room = (to_fraction(part) for part in (upper[k].x, upper[k].y, _room(upper[k], isolated)))
        numbers.append(ComplexRoot(polynomial, len(reals) + 2 * pair, (x, -y), room))
        numbers.append(ComplexRoot(polynomial, len(reals) + 2 * pair + 1, (x, y), room))
    return tuple(numbers)


def _room(disc: Disc, others: list[Disc]) -> fmpq:
    """Return a distance within which a disc has no other root: a quarter of the gap to the nearest disc."""
    gaps = (max(abs(disc.x - other.x), abs(disc.y - other.y)) for other in others if other is not disc)
    return max(min(gaps) / 4, disc.radius)


@lru_cache(maxsize=4096)
def _refined(root: RealRoot, bits: int) -> tuple[fmpq, fmpq]:
    """Narrow the bracket of a real root to 2**-bits times its modulus (Abbott 2014)."""
    f, low, high = fmpz_poly(list(root.polynomial)), to_flint(root.low), to_flint(root.high)
    if low * high > 0 and (high - low) * 2**bits <= min(abs(low), abs(high)):
        return low, high
    at_low, at_high = f(low), f(high)
    pieces = 2**16
    while low * high <= 0 or (high - low) * 2**bits > min(abs(low), abs(high)):
        # Divide the bracket into `pieces` equal parts; the secant selects one part.
        step = (high - low) / pieces
        guess = (at_low / (at_low - at_high) * pieces + fmpq(1, 2)).floor()
        end = low + step * min(max(guess, 1), pieces - 1)
        value = f(end)
        other = end + step if value * at_low > 0 else end - step
        at_other = f(other)
        if value * at_other < 0:  # right guess: square the number of parts
            (low, at_low), (high, at_high) = sorted([(end, value), (other, at_other)])
            pieces = min(pieces * pieces, 2**bits)
        else:  # wrong guess: fewer parts, and bisect
            pieces = max(4, isqrt(pieces))
            middle = (low + high) / 2
            value = f(middle)
            if value * at_low < 0:
                high, at_high = middle, value
            else:
                low, at_low = middle, value
    return low, high


def complex_order(polynomial: tuple[int, ...], upper: Sequence[acb]) -> list[int]:
    """Return the rank of each root above the real axis in SymPy's order."""
    if len(upper) < 2:
        return list(range(len(upper)))
    as_sympy = sp.Poly(list(polynomial[::-1]), sp.Symbol("x"))
    # SymPy may order the roots of a rescaled polynomial.
    scale, inner = sp.CRootOf(as_sympy, 0).as_coeff_Mul()
    coefficients = [abs(int(c)) for c in inner.poly.all_coeffs()]
    bound = 2 * max(Fraction(c, coefficients[0]) for c in coefficients)
    shrink = acb(to_flint(1 / scale))
    boxes = _leaves({k: ball * shrink for k, ball in enumerate(upper)}, (-bound, Fraction(0), bound, bound))
    if boxes is None:
        # SymPy's own isolation: slow, but exact for a root on the border of a box.
        centres = [complex(float(ball.real.mid()), float(ball.imag.mid())) for ball in upper]
        first = as_sympy.degree() - 2 * len(upper)
        values = [complex(sp.CRootOf(as_sympy, first + 2 * i + 1).evalf(20)) for i in range(len(upper))]
        return [min(range(len(centres)), key=lambda k: abs(centres[k] - value)) for value in values]
    return [k for _, k in sorted(boxes)]


def _leaves(
    roots: dict[int, acb], box: tuple[Fraction, Fraction, Fraction, Fraction]
) -> list[tuple[tuple[Fraction, Fraction], int]] | None:
    """Halve the box of all roots until each part has one; return lower left corners, None for a root on a border."""
    corners, boxes = [], [(roots, box)]
    while boxes:
        inside, (left, low, right, top) = boxes.pop()
        if len(inside) == 1:
            corners.append(((left, low), next(iter(inside))))
            continue
        # Halve the longer side.
        upright = right - left > top - low
        middle = (left + right) / 2 if upright else (low + top) / 2
        border = arb(to_flint(middle))
        first: dict[int, acb] = {}
        second: dict[int, acb] = {}
        for k, ball in inside.items():
            coordinate = ball.real if upright else ball.imag
            if coordinate.overlaps(border):
                return None
            (first if coordinate < border else second)[k] = ball
        halves = (
            ((left, low, middle, top), (middle, low, right, top))
            if upright
            else ((left, low, right, middle), (left, middle, right, top))
        )
        boxes += [(part, half) for part, half in zip((first, second), halves, strict=True) if part]
    return corners
