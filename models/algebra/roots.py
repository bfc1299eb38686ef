"""Algebraic numbers: an irreducible integer polynomial and an enclosure of one of its roots.

A real root lies between two rationals where the polynomial changes sign, a complex root in a disc
without another root; both are refined to any accuracy.  `isolation.py` isolates the roots, or Arb if
`isolation.py` fails (F. Johansson, IEEE Trans. Comput. 66, 1281, 2017).  Real roots are refined
exactly: secant guesses, proved by signs (J. Abbott, ACM Commun. Comput. Algebra 48, 3, 2014).
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

Polynomial = tuple[int, ...]
"""Integer coefficients, constant first; irreducible and primitive, the leading one positive."""

_X = sp.Symbol("x")

_WRITTEN = 14_000
"""Longest integer in bits that Python converts to decimals and back by default (4300 digits)."""


@dataclass(frozen=True, slots=True)
class Root:
    """One root of an irreducible polynomial of degree >= 2."""

    polynomial: Polynomial  # integer coefficients, constant first; primitive, the leading one positive
    # index of the root among SymPy's CRootOf: real roots ascending, then complex ones. The text of the number, and so
    # tables and JSON, contain it. `complex_order` computes it without SymPy's isolation, which takes minutes where
    # Aberth's method takes a second
    index: int

    @property
    def text(self) -> str:
        """SymPy's text of this number."""
        return f"CRootOf({polynomial_text(self.polynomial)}, {self.index})"

    @property
    def expression(self) -> sp.Expr:
        """This number as SymPy's CRootOf, which prints a decimal."""
        return _expression(self)

    def enclosure(self, bits: int) -> Ball:
        """Return a ball that holds this number, of radius below 2**-bits times its modulus."""
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
        """Return a ball that holds this number, of relative radius below 2**-bits."""
        low, high = _refined(self, bits)
        with precision(bits + 16):
            return arb(low).union(arb(high))


@dataclass(frozen=True, slots=True)
class ComplexRoot(Root):
    """The only root of `polynomial` within `room` of `near` = (real, imaginary); not real."""

    near: tuple[Fraction, Fraction]
    room: Fraction

    def enclosure(self, bits: int) -> acb:
        """Return a ball that holds this number, of radius below 2**-bits times its modulus."""
        return _sharpened(self, bits)


@lru_cache(maxsize=64)
def polynomial_text(polynomial: Polynomial) -> str:
    """Return the polynomial in x as SymPy prints it.

    If Python refuses to write or read its coefficients, its degree and their size are named
    instead.
    """
    longest = max(abs(c).bit_length() for c in polynomial)
    if longest > _WRITTEN:
        return f"polynomial of degree {len(polynomial) - 1} with coefficients of up to {longest} bits"
    return str(sp.sstr(sp.Poly(list(polynomial[::-1]), _X).as_expr()))


def coefficient_text(c: int) -> str:
    """Return a whole number as text for `int(text, 0)`.

    It is hexadecimal if Python refuses to write so many decimals.
    """
    return str(c) if abs(c).bit_length() <= _WRITTEN else hex(c)


def _short(x: Fraction) -> str:
    longest = max(abs(x.numerator).bit_length(), x.denominator.bit_length())
    return str(x) if longest < 100 else f"a fraction of {longest} bits"


class ComplexRootOf(sp.CRootOf):
    """SymPy's CRootOf, equal to it, printed as a decimal: polynomials fill pages."""

    __slots__ = ("shown",)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, sp.CRootOf) and (self.poly, self.index) == (other.poly, other.index)

    __hash__ = sp.CRootOf.__hash__

    @property
    def precedence(self) -> int:
        """The precedence of the printed text: that of a sum, -1.5 - 0.9*I."""
        return int(PRECEDENCE["Add"])

    def _sympystr(self, printer: object) -> str:
        # SymPy creates such roots anew, without their decimal, when it rebuilds an expression.
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
    # SymPy takes a factor out of some polynomials: their root is a number times that of another one.
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
    """Isolate the roots by Arb: a second at degree 100, minutes at degree 200."""
    with precision(128):
        balls = [root for root, _ in f.complex_roots()]
        reals = sorted((ball for ball in balls if ball.imag == 0), key=lambda ball: dyadic(ball.real))
        others = [ball for ball in balls if ball.imag != 0]
        radii = [dyadic((ball.real.rad() + ball.imag.rad()).upper()) for ball in reals + others]
    return [
        Disc(dyadic(ball.real), dyadic(ball.imag), radius) for ball, radius in zip(reals + others, radii, strict=True)
    ]


def roots(polynomial: Polynomial) -> tuple[Root, ...]:
    """Return all roots of a polynomial, each isolated by a disc that is proved to hold it alone."""
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
    """Return a distance from the disc within which there is no other root: a quarter of the nearest gap."""
    gaps = (max(abs(disc.x - other.x), abs(disc.y - other.y)) for other in others if other is not disc)
    return max(min(gaps) / 4, disc.radius)


@lru_cache(maxsize=4096)
def _refined(root: RealRoot, bits: int) -> tuple[fmpq, fmpq]:
    """Narrow the bracket of a real root to 2**-bits of its modulus (Abbott 2014)."""
    f, low, high = fmpz_poly(list(root.polynomial)), to_flint(root.low), to_flint(root.high)
    if low * high > 0 and (high - low) * 2**bits <= min(abs(low), abs(high)):
        return low, high
    at_low, at_high = f(low), f(high)
    pieces = 2**16
    while low * high <= 0 or (high - low) * 2**bits > min(abs(low), abs(high)):
        # the secant picks one of `pieces` equal parts of the bracket
        step = (high - low) / pieces
        guess = (at_low / (at_low - at_high) * pieces + fmpq(1, 2)).floor()
        end = low + step * min(max(guess, 1), pieces - 1)
        value = f(end)
        other = end + step if value * at_low > 0 else end - step
        at_other = f(other)
        if value * at_other < 0:  # the part holds the root: square the number of parts
            (low, at_low), (high, at_high) = sorted([(end, value), (other, at_other)])
            pieces = min(pieces * pieces, 2**bits)
        else:  # a wrong guess: divide coarser, and bisect
            pieces = max(4, isqrt(pieces))
            middle = (low + high) / 2
            value = f(middle)
            if value * at_low < 0:
                high, at_high = middle, value
            else:
                low, at_low = middle, value
    return low, high


def complex_order(polynomial: tuple[int, ...], upper: Sequence[acb]) -> list[int]:
    """Return the positions of the roots above the real axis in SymPy's order."""
    if len(upper) < 2:
        return list(range(len(upper)))
    as_sympy = sp.Poly(list(polynomial[::-1]), sp.Symbol("x"))
    # SymPy may count the roots of a rescaled polynomial
    scale, inner = sp.CRootOf(as_sympy, 0).as_coeff_Mul()
    coefficients = [abs(int(c)) for c in inner.poly.all_coeffs()]
    bound = 2 * max(Fraction(c, coefficients[0]) for c in coefficients)
    shrink = acb(to_flint(1 / scale))
    boxes = _leaves({k: ball * shrink for k, ball in enumerate(upper)}, (-bound, Fraction(0), bound, bound))
    if boxes is None:  # a root on the border of a box
        return _ask_sympy(as_sympy, upper)
    return [k for _, k in sorted(boxes)]


def _leaves(
    roots: dict[int, acb], box: tuple[Fraction, Fraction, Fraction, Fraction]
) -> list[tuple[tuple[Fraction, Fraction], int]] | None:
    """Return the lower left corner of the box of each root; None if a root may be on a border."""
    corners, boxes = [], [(roots, box)]
    while boxes:
        inside, (left, low, right, top) = boxes.pop()
        if len(inside) == 1:
            corners.append(((left, low), next(iter(inside))))
            continue
        # halve the longer side
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


def _ask_sympy(polynomial: sp.Poly, upper: Sequence[acb]) -> list[int]:
    """Return the same order from SymPy's values: slow, but exact for roots on a border."""
    centres = [complex(float(ball.real.mid()), float(ball.imag.mid())) for ball in upper]
    first = polynomial.degree() - 2 * len(upper)
    values = [complex(sp.CRootOf(polynomial, first + 2 * i + 1).evalf(20)) for i in range(len(upper))]
    return [min(range(len(centres)), key=lambda k: abs(centres[k] - value)) for value in values]
