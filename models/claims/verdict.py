"""The verdict on a claimed spectrum: compare every number exactly, and describe each error in a sentence."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

import sympy as sp
from flint import acb, arb

from ..algebra.balls import enclose, precision
from ..algebra.cosine_sums import AngleSum, read
from ..algebra.equality import equal
from ..algebra.minimal_polynomials import multiplied
from ..algebra.rationals import to_flint, to_fraction, to_sympy
from ..algebra.roots import Root
from ..spectra.characteristic import characteristic
from ..spectra.eigenvalue import Eigenvalue, entry, times, words
from ..spectra.solve import Proof, spectrum
from .language import Claim, Claimed
from .part_claims import verify_parts


@dataclass(frozen=True, slots=True)
class ClaimVerdict:
    claim: Claim
    problems: tuple[str, ...]  # a sentence for each error
    proved: bool = True  # False if a closed form was used without proof
    parts: str = ""  # the true values of the claimed parts

    @property
    def right(self) -> bool:
        """True if the claim equals the spectrum exactly; approximate numbers are compared to their digits."""
        return not self.problems

    @property
    def eigenvalues(self) -> Sequence[Eigenvalue]:
        return spectrum(self.claim.graph, Proof.EXACT if self.problems else Proof.NONE).eigenvalues

    @property
    def expected(self) -> str:
        """The correct claim, in the language of claims files."""
        return self.parts or ", ".join(entry(e) for e in self.eigenvalues)


def verify(claim: Claim) -> ClaimVerdict:
    """Compare a claim with the proved spectrum of its graph."""
    if claim.parts:
        return ClaimVerdict(claim, *verify_parts(claim.graph, claim.parts))
    # Fast path: if all claimed numbers are sums of cosines and multiply out to det(x - G), no roots are needed.
    sums = [(claimed.sum, claimed.count) for claimed in claim.numbers]
    known = [(number, count) for number, count in sums if number is not None]
    complete = sum(count for _, count in sums) == claim.graph.n and len(known) == len(sums)
    if complete and multiplied(known) == characteristic(claim.graph):
        return ClaimVerdict(claim, ())
    return ClaimVerdict(claim, tuple(_problems(claim)))


def _problems(claim: Claim) -> Iterator[str]:
    """Compare the numbers one by one; yield a sentence for each error."""
    eigenvalues = spectrum(claim.graph, Proof.EXACT).eigenvalues
    tally = [0] * len(eigenvalues)  # claimed multiplicity of each eigenvalue

    # Exact numbers: look up equal folded sums first.  Different folded sums may still be equal numbers, so otherwise
    # compare exactly with all eigenvalues whose decimals agree.
    angles: dict[AngleSum, int] = {}
    if any(claimed.angle is not None for claimed in claim.numbers):
        for i, e in enumerate(eigenvalues):
            if not isinstance(e.number, Root) and (form := read(e.number)) is not None:
                angles[form.folded] = i
    middles: list[complex] = []
    for claimed in claim.numbers:
        index = angles.get(claimed.angle.folded) if claimed.angle is not None else None
        if index is None and claimed.number is not None:
            middles = middles or [_middle(e.number) for e in eigenvalues]
            middle = _middle(claimed.number)
            near = [i for i, other in enumerate(middles) if abs(other - middle) <= 1e-9 * max(1.0, abs(middle))]
            index = next((i for i in near if equal(claimed.number, eigenvalues[i].number)), None)
            if index is None:
                nearest = min(range(len(middles)), key=lambda i: abs(middles[i] - middle))
                yield f"claimed {claimed.words}: no eigenvalue; the nearest is {words(eigenvalues[nearest])}"
        if index is not None:
            tally[index] += claimed.count

    exact = tuple(tally)
    yield from _assign_approximations(claim.numbers, eigenvalues, tally)
    for e, before, count in zip(eigenvalues, exact, tally, strict=True):
        if count == 0:
            yield f"not claimed: {words(e)}, {times(e.multiplicity)}"
        elif count != e.multiplicity:
            how = "claimed" if before else "claimed (approximately)"
            yield f"{how} {words(e)} {times(count)}; it occurs {times(e.multiplicity)}"


def _assign_approximations(
    numbers: Sequence[Claimed], eigenvalues: Sequence[Eigenvalue], tally: list[int]
) -> Iterator[str]:
    """Assign approximations to eigenvalues that round to them; yield a sentence for each without an eigenvalue."""
    rising = sorted(
        (i for i, e in enumerate(eigenvalues) if not isinstance(e.value, complex)),
        key=lambda i: eigenvalues[i].value.real,
    )
    # Greedy matching of intervals to points: in the order of upper ends, each interval takes the smallest free points.
    # This order matches as many as possible.
    approximations = [(*claimed.interval, claimed) for claimed in numbers if claimed.interval is not None]
    for low, high, claimed in sorted(approximations, key=lambda approximation: approximation[1]):
        inside = [i for i in rising if _is_between(low, eigenvalues[i], high)]
        left = claimed.count
        for i in inside:
            taken = min(left, max(0, eigenvalues[i].multiplicity - tally[i]))
            tally[i] += taken
            left -= taken
        if not inside:
            centre = float((low + high) / 2)
            nearest = min(rising, key=lambda i: abs(eigenvalues[i].value.real - centre)) if rising else 0
            near = words(eigenvalues[nearest])
            yield f"claimed {claimed.text}: no eigenvalue rounds to it; the nearest is {near}"
        elif left:
            yield f"claimed {claimed.text} {times(left)} more than eigenvalues are left that round to it"


def _middle(number: sp.Expr | Root) -> complex:
    """Return a number to a relative error of 1e-18, so that few eigenvalues need an exact comparison."""
    bits = 128
    while True:
        ball = acb(number.enclosure(bits) if isinstance(number, Root) else enclose(number, bits))
        with precision(bits):
            radius = float(ball.real.rad() + ball.imag.rad())
        if radius < 1e-18 * max(1.0, abs(complex(ball))):
            return complex(ball)
        if bits > 2**17:
            raise ValueError(f"{number} loses all its digits to cancellation; write it simpler")
        bits *= 2


def _is_between(low: Fraction, e: Eigenvalue, high: Fraction) -> bool:
    if not isinstance(e.number, Root) and e.number.is_Rational:
        return low <= to_fraction(e.number) <= high
    for bits in (64, 512, 4096):
        with precision(bits + 16):
            ball = e.enclosure(bits)
            below, above = arb(to_flint(low)), arb(to_flint(high))
            if ball > below and ball < above:
                return True
            if ball < below or ball > above:
                return False
    return equal(e.number, to_sympy(low)) or equal(e.number, to_sympy(high))
