"""The proof of a spectrum: the product of (z - γ) over all eigenvalues is the characteristic polynomial.

Each claimed number has an exact minimal polynomial.  Where the claims that share one are as many distinct
numbers as its degree, with one multiplicity, their factors (z - γ) multiply to that polynomial: nothing is
ever compared in floating point.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Protocol

import sympy as sp
from flint import fmpq_poly

from ..algebra.balls import Ball, disjoint, precision
from ..algebra.minimal_polynomials import _monic, minimal_polynomial
from ..algebra.roots import RealRoot, Root

__all__ = ["ProofError", "check", "distinct"]


class ProofError(RuntimeError):
    """A claimed spectrum is wrong: a mistake in the program or in a topology file, not the user's."""


class Claim(Protocol):
    """An eigenvalue that can be proved."""

    @property
    def number(self) -> sp.Expr | Root: ...
    @property
    def multiplicity(self) -> int: ...
    def enclosure(self, bits: int) -> Ball: ...


def check(claims: Iterable[Claim], characteristic: fmpq_poly, name: str) -> None:
    """Multiply the claims out; ProofError where that is not the exact characteristic polynomial."""
    groups: dict[tuple[int, ...], list[Claim]] = {}
    for claim in claims:
        groups.setdefault(_key(claim.number), []).append(claim)
    product = fmpq_poly([1])
    for coefficients, members in groups.items():
        factor = _monic(coefficients)
        counts = {claim.multiplicity for claim in members}
        if len(members) != factor.degree() or len(counts) != 1 or not distinct(members):
            shown = ", ".join(str(claim) for claim in members[:4])
            raise ProofError(
                f"spectrum of {name}: {len(members)} eigenvalues ({shown}, …) of multiplicities "
                f"{sorted(counts)} have the minimal polynomial {factor}; expected {factor.degree()} distinct "
                "ones of one multiplicity: correct the closed form"
            )
        product *= factor ** counts.pop()
    if product != characteristic:
        raise ProofError(
            f"spectrum of {name}: the eigenvalues multiply out to a polynomial of degree {product.degree()}; "
            f"expected the characteristic one, of degree {characteristic.degree()}: correct the closed form"
        )


def _key(number: sp.Expr | Root) -> tuple[int, ...]:
    """The minimal polynomial with coprime integer coefficients, the leading one positive."""
    if isinstance(number, Root):
        return number.polynomial
    return tuple(int(c) for c in minimal_polynomial(number).numer().coeffs())


def distinct(claims: Sequence[Claim]) -> bool:
    """True once brackets or balls around all claims are disjoint; False where two agree to 4000 bits."""
    numbers = [claim.number for claim in claims]
    brackets = sorted((number.low, number.high) for number in numbers if isinstance(number, RealRoot))
    if len(brackets) == len(numbers) and all(first[1] <= second[0] for first, second in pairwise(brackets)):
        return True  # no end is a root
    for bits in (64, 256, 1024, 4096):
        balls = [claim.enclosure(bits) for claim in claims]
        with precision(bits):
            if disjoint(balls):
                return True
    return False
