"""The verdict on a claimed spectrum: every number compared exactly, errors named in sentences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import sympy as sp
from flint import acb, arb

from ..algebra.balls import enclose, precision
from ..algebra.cosine_sums import AngleSum, read
from ..algebra.equality import equal
from ..algebra.minimal_polynomials import multiplied
from ..algebra.rationals import to_flint, to_sympy
from ..algebra.roots import Root
from ..spectra.characteristic import characteristic
from ..spectra.eigenvalue import Eigenvalue, entry, times, words
from ..spectra.solve import Proof, spectrum
from .language import Claim, Claimed
from .parts import verify_parts


@dataclass(frozen=True, slots=True)
class Verdict:
    """The result of the comparison of a claim."""

    claim: Claim
    problems: tuple[str, ...]  # a sentence for each error
    proved: bool = True  # whether the spectrum was proved; False if a closed form was taken on trust
    parts: str = ""  # the claimed parts as they are, in words

    @property
    def right(self) -> bool:
        """Whether the claim is exactly the spectrum (to its digits if it is approximate)."""
        return not self.problems

    @property
    def eigenvalues(self) -> Sequence[Eigenvalue]:
        """The eigenvalues of the graph."""
        return spectrum(self.claim.graph, Proof.EXACT if self.problems else Proof.NONE).eigenvalues

    @property
    def expected(self) -> str:
        """What would be right, in the words of a claims file."""
        return self.parts or ", ".join(entry(e) for e in self.eigenvalues)


def verify(claim: Claim) -> Verdict:
    """Compare a claim with the proved spectrum of its graph."""
    if claim.parts:
        return Verdict(claim, *verify_parts(claim.graph, claim.parts))
    if _multiplies_out(claim):
        return Verdict(claim, ())
    return Verdict(claim, _compared(claim))


def _multiplies_out(claim: Claim) -> bool:
    """Whether the claimed numbers are seen to multiply to the characteristic polynomial."""
    numbers = [(claimed.sum, claimed.count) for claimed in claim.numbers]
    if sum(count for _, count in numbers) != claim.graph.n:
        return False
    known = [(number, count) for number, count in numbers if number is not None]
    return len(known) == len(numbers) and multiplied(known) == characteristic(claim.graph)


def _compared(claim: Claim) -> tuple[str, ...]:
    """What is wrong with a claim, number by number."""
    found = spectrum(claim.graph, Proof.EXACT).eigenvalues
    tally, problems = [0] * len(found), []
    known = _angles(found) if any(c.angle is not None for c in claim.numbers) else {}
    middles: list[complex] = []
    for claimed in claim.numbers:
        place = known.get(claimed.angle.folded) if claimed.angle is not None else None
        if place is None and claimed.interval is None and claimed.number is not None:
            middles = middles or [_middle(e.number) for e in found]
            place = _find(claimed.number, found, middles)
            if place is None:
                near = found[_nearest(_middle(claimed.number), middles)]
                problems.append(f"claimed {claimed.words}: no eigenvalue; the nearest is {words(near)}")
        if place is not None:
            tally[place] += claimed.count
    exact = tuple(tally)
    problems += _assign([c for c in claim.numbers if c.interval is not None], found, tally)
    return (*problems, *_miscounted(found, exact, tally))


def _miscounted(found: Sequence[Eigenvalue], exact: Sequence[int], tally: Sequence[int]) -> Iterator[str]:
    """What is wrong with the multiplicities: `exact` times by its number, `tally` times in all."""
    for e, before, count in zip(found, exact, tally, strict=True):
        if count == 0:
            yield f"not claimed: {words(e)}, {times(e.multiplicity)}"
        elif count != e.multiplicity:
            how = "claimed" if before else "claimed (approximately)"
            yield f"{how} {words(e)} {times(count)}; it occurs {times(e.multiplicity)}"


def _angles(found: Sequence[Eigenvalue]) -> dict[AngleSum, int]:
    """The places of the eigenvalues that are sums of cosines.

    Equal sums are equal numbers; different sums may be equal numbers too.
    """
    forms = ((None if isinstance(e.number, Root) else read(e.number), i) for i, e in enumerate(found))
    return {form.folded: i for form, i in forms if form is not None}


def _find(number: sp.Expr, found: Sequence[Eigenvalue], middles: Sequence[complex]) -> int | None:
    """The place of the eigenvalue that is this number; None if there is none."""
    middle = _middle(number)
    for i, e in enumerate(found):
        if abs(middles[i] - middle) <= 1e-9 * max(1.0, abs(middle)) and equal(number, e.number):
            return i
    return None


def _middle(number: sp.Expr | Root) -> complex:
    """A number to more digits than are needed to tell which eigenvalues it may be."""
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


def _nearest(middle: complex, middles: Sequence[complex]) -> int:
    return min(range(len(middles)), key=lambda i: abs(middles[i] - middle))


def _assign(claims: Sequence[Claimed], found: Sequence[Eigenvalue], tally: list[int]) -> list[str]:
    """Give each approximation an eigenvalue of its own, and name those that have none.

    Intervals by their upper end take the smallest free eigenvalue each: so as many as possible find
    one.
    """
    problems = []
    rising = sorted(
        (i for i, e in enumerate(found) if not isinstance(e.value, complex)), key=lambda i: found[i].value.real
    )
    for claimed in sorted(claims, key=lambda c: c.ends[1]):
        inside = [i for i in rising if _rounds_to(found[i], claimed)]
        left = claimed.count
        for i in inside:
            taken = min(left, max(0, found[i].multiplicity - tally[i]))
            tally[i] += taken
            left -= taken
        if not inside:
            near = found[min(rising, key=lambda i: abs(found[i].value.real - _centre(claimed)))] if rising else found[0]
            problems.append(f"claimed {claimed.text}: no eigenvalue rounds to it; the nearest is {words(near)}")
        elif left:
            problems.append(f"claimed {claimed.text} {times(left)} more than eigenvalues are left that round to it")
    return problems


def _centre(claimed: Claimed) -> float:
    low, high = claimed.ends
    return float((low + high) / 2)


def _rounds_to(e: Eigenvalue, claimed: Claimed) -> bool:
    """Whether a real eigenvalue lies in the closed interval of an approximation."""
    low, high = map(to_sympy, claimed.ends)
    if not isinstance(e.number, Root) and e.number.is_Rational:
        return bool(low <= e.number <= high)
    for bits in (64, 512, 4096):
        with precision(bits + 16):
            ball = arb(0) if e.number == 0 else e.enclosure(bits)
            below, above = (arb(to_flint(end)) for end in claimed.ends)
            if ball > below and ball < above:
                return True
            if ball < below or ball > above:
                return False
    return equal(e.number, low) or equal(e.number, high)
