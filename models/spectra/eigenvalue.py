"""One exact eigenvalue: number, multiplicity, nearest float, decimals to any precision."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from decimal import Decimal, localcontext
from fractions import Fraction
from functools import cmp_to_key
from itertools import pairwise
from typing import TypeAlias

import sympy as sp
from flint import acb, fmpq

from ..algebra.balls import Ball, accurate, decimals, disjoint, enclose, nearest, precision
from ..algebra.equality import equal, sign
from ..algebra.rationals import to_fraction
from ..algebra.roots import ComplexRoot, RealRoot, Root

NEAR = 1e-12  # numbers are compared exactly if their floats differ by less than this relative difference

Number: TypeAlias = sp.Expr | Root

Blocks: TypeAlias = tuple[tuple[int, int], ...]  # (size, number of Jordan blocks of that size), the largest size first


class ProofError(RuntimeError):
    """A computed or given spectrum is wrong: a mistake of the program or of a topology file."""


@dataclass(frozen=True, slots=True)
class Eigenvalue:
    """An exact number with its algebraic multiplicity."""

    number: Number  # exact number: an expression, or a Root if there is no short one
    multiplicity: int  # algebraic multiplicity, at least 1
    # sizes of Jordan blocks with their numbers, the largest size first; None if they are not known
    blocks: Blocks | None = field(default=None, compare=False)
    value: float | complex = field(init=False, compare=False)  # the nearest float

    def __post_init__(self) -> None:
        count = self.multiplicity
        if isinstance(count, bool) or not isinstance(count, int) or count < 1:
            raise ValueError(f"eigenvalue {self.text}: multiplicity {count!r}; expected an integer >= 1")
        if self.blocks is None and count == 1:
            object.__setattr__(self, "blocks", ((1, 1),))
        if self.blocks is not None and sum(size * times for size, times in self.blocks) != count:
            raise ValueError(f"eigenvalue {self.text}: blocks {self.blocks} do not add up to multiplicity {count}")
        object.__setattr__(self, "value", nearest(self._ball))

    @property
    def exact(self) -> sp.Expr:
        """The number as a SymPy expression (CRootOf if no shorter form is known)."""
        return self.number.expression if isinstance(self.number, Root) else self.number

    @property
    def text(self) -> str:
        """The exact number as text that SymPy reads back."""
        return self.number.text if isinstance(self.number, Root) else sp.sstr(self.number)

    @property
    def geometric(self) -> int | None:
        """Number of independent eigenvectors (one for each Jordan block); None if not known."""
        return None if self.blocks is None else sum(times for _, times in self.blocks)

    @property
    def defective(self) -> bool:
        """True if eigenvectors are known to be missing: a Jordan block is larger than 1."""
        return self.blocks is not None and self.blocks[0][0] > 1

    def enclosure(self, bits: int) -> Ball:
        """Return a certified ball (flint.arb or acb) of radius below 2**-bits times the modulus."""
        return accurate(self._ball, bits)

    def evaluate(self, digits: int) -> sp.Expr:
        """Return a SymPy Float, within one unit of the last of `digits` significant digits."""
        if isinstance(digits, bool) or not isinstance(digits, int) or digits < 1:
            raise ValueError(f"digits = {digits!r}; expected a positive integer")
        return decimals(self._ball, digits)

    def _ball(self, bits: int) -> Ball:
        if isinstance(self.number, Root):
            return self.number.enclosure(bits)
        return enclose(self.number, bits)

    def __eq__(self, other: object) -> bool:
        """Compare number and multiplicity with another eigenvalue; compare the number alone with a number."""
        if isinstance(other, Eigenvalue):
            return (self.number, self.multiplicity) == (other.number, other.multiplicity)
        if isinstance(other, bool) or not isinstance(other, int | float | complex | Fraction | sp.Expr):
            return NotImplemented
        if self.exact == other:
            return True
        number = _number(other)
        near = number is not None and abs(self.value - number.value) <= NEAR * abs(self.value)
        return number is not None and near and equal(self.number, number.number)

    def __hash__(self) -> int:
        number = self.number
        return hash(Fraction(number.p, number.q) if isinstance(number, sp.Rational) else number)

    def __lt__(self, other: Eigenvalue | float) -> bool:
        return self._difference(other) < 0

    def __le__(self, other: Eigenvalue | float) -> bool:
        return self._difference(other) <= 0

    def __gt__(self, other: Eigenvalue | float) -> bool:
        return self._difference(other) > 0

    def __ge__(self, other: Eigenvalue | float) -> bool:
        return self._difference(other) >= 0

    def _difference(self, other: Eigenvalue | float) -> float:
        """Return a float with the sign of self - other; for close real numbers the sign is computed exactly."""
        number = other if isinstance(other, Eigenvalue) else _number(other)
        if number is None:
            return float(self) - float(other)
        for e in (self, number):
            if isinstance(e.value, complex):
                raise TypeError(
                    f"eigenvalue {e}: found a complex number; complex numbers have no order; take e.value.real"
                )
        gap = float(self) - float(number)
        return gap if abs(gap) > NEAR * abs(float(self)) else sign((self.number,), (number.number,))

    def __complex__(self) -> complex:
        return complex(self.value)

    def __float__(self) -> float:
        if isinstance(self.value, complex):
            raise TypeError(
                f"eigenvalue {self}: found a complex number; expected a real one; take complex(eigenvalue.value)"
            )
        return self.value

    def __repr__(self) -> str:
        times = f", multiplicity {self.multiplicity}" if self.multiplicity > 1 else ""
        return f"Eigenvalue({self}{times})"

    def __str__(self) -> str:
        text = self.text
        if len(text) <= 60 or not isinstance(self.number, Root):
            return text
        return f"{decimal(self.value)} (degree {len(self.number.polynomial) - 1})"


def _number(value: float | complex | Fraction | sp.Expr) -> Eigenvalue | None:
    """Convert a number to an eigenvalue of multiplicity 1; None if the number is not finite."""
    if isinstance(value, complex):
        real, imaginary = _number(value.real), _number(value.imag)
        return None if real is None or imaginary is None else Eigenvalue(real.number + sp.I * imaginary.number, 1)
    if not isinstance(value, sp.Expr):
        if not math.isfinite(value):
            return None
        value = sp.Rational(Fraction(value))
    return Eigenvalue(value, 1)


def distinct(claims: Sequence[Eigenvalue]) -> bool:
    """Return True if certified enclosures separate all eigenvalues, False if two agree to 4096 bits."""
    values = [claim.number for claim in claims]
    brackets = sorted((number.low, number.high) for number in values if isinstance(number, RealRoot))
    if len(brackets) == len(values) and all(first[1] <= second[0] for first, second in pairwise(brackets)):
        return True  # brackets may touch: no end of a bracket is a root
    for bits in (64, 256, 1024, 4096):
        balls = [claim.enclosure(bits) for claim in claims]
        with precision(bits):
            if disjoint(balls):
                return True
    return False


def ordered(claims: Sequence[Eigenvalue]) -> tuple[Eigenvalue, ...]:
    """Sort eigenvalues by decreasing real part, conjugates side by side."""
    # Where floats are too close to decide, compare certified balls.
    if any(isinstance(e.value, complex) for e in claims):
        return tuple(sorted(claims, key=cmp_to_key(_complex_order)))
    if len({e.value for e in claims}) == len(claims):
        return tuple(sorted(claims, key=lambda e: e.value.real, reverse=True))
    if not distinct(claims):
        raise ProofError(f"two of {len(claims)} eigenvalues coincide; expected distinct ones")
    return tuple(sorted(claims, key=_midpoint, reverse=True))


def _complex_order(a: Eigenvalue, b: Eigenvalue) -> int:
    """Compare for sorting: decreasing real part, then |imaginary part|, then the lower conjugate first."""
    # Use floats if they differ by more than rounding; count parts that agree to 1024 bits as equal.
    gap, room = b.value.real - a.value.real, 2.0**-50 * (abs(a.value) + abs(b.value))
    if room < abs(gap) < math.inf:
        return 1 if gap > 0 else -1
    if a.value != b.value.conjugate() or not _conjugate(a, b):
        for imaginary in (False, True):
            for bits in (72, 256, 1024):
                with precision(2 * bits):
                    balls = [acb(e.enclosure(bits)) for e in (a, b)]
                    first, second = (abs(ball.imag) if imaginary else -ball.real for ball in balls)
                    if not first.overlaps(second):
                        return -1 if first < second else 1
    return -1 if a.value.imag < b.value.imag else 1


def _conjugate(a: Eigenvalue, b: Eigenvalue) -> bool:
    """Return whether two numbers are complex conjugates, to 256 bits."""
    with precision(512):
        return bool(acb(a.enclosure(256)).conjugate().overlaps(acb(b.enclosure(256))))


def _midpoint(e: Eigenvalue, bits: int = 4200) -> fmpq:
    """Return the exact midpoint of a ball around a real eigenvalue."""
    mantissa, exponent = e.enclosure(bits).mid().man_exp()
    return fmpq(mantissa) * fmpq(2) ** int(exponent)


def decimal(value: float | complex) -> str:
    if isinstance(value, complex):
        return f"{value.real:.15g} {'-' if value.imag < 0 else '+'} {abs(value.imag):.15g}i"
    return f"{value:.16g}"


def entry(e: Eigenvalue) -> str:
    """Write an eigenvalue as in a claims file: exact if a short form exists, else as a decimal."""
    text = e.text
    if isinstance(e.number, RealRoot):
        text = f"~{rounded(e)}"
    elif isinstance(e.number, ComplexRoot):
        text = f"({e.evaluate(12)})"
    return text if e.multiplicity == 1 else f"{text}^{e.multiplicity}"


def rounded(e: Eigenvalue, digits: int = 12) -> str:
    """Round a real eigenvalue correctly to `digits` significant digits."""
    value = to_fraction(_midpoint(e, 256))
    with localcontext() as context:
        context.prec = digits
        return str(Decimal(value.numerator) / Decimal(value.denominator))


def words(e: Eigenvalue) -> str:
    """Write an eigenvalue for a sentence of a message."""
    if isinstance(e.number, Root):
        value = rounded(e) if isinstance(e.number, RealRoot) else e.evaluate(12)
        return f"{value} (a root of degree {len(e.number.polynomial) - 1})"
    if e.number.is_Rational:
        return e.text
    return f"{e.text} = {e.evaluate(12) if isinstance(e.value, complex) else rounded(e)}"


def times(count: int) -> str:
    """Write a multiplicity for a sentence: "once", "3 times"."""
    return "once" if count == 1 else f"{count} times"
