"""The verdict on a claimed spectrum: every number compared exactly, what is wrong in sentences, and what is right."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal, localcontext
from fractions import Fraction

import sympy as sp
from flint import acb, arb, fmpq

from .algebraic import ComplexRoot, RealRoot
from .angle_sums import AngleSum, read
from .balls import enclose, precision
from .claims import Claim, Claimed
from .separation import equal
from .spectrum import Eigenvalue, spectrum

__all__ = ["Verdict", "verify"]


@dataclass(frozen=True, slots=True)
class Verdict:
    """What is wrong with a claim, in sentences, and the eigenvalues of its graph."""

    claim: Claim
    problems: tuple[str, ...]
    eigenvalues: Sequence[Eigenvalue]

    @property
    def right(self) -> bool:
        """True where the claim is exactly the spectrum (to its digits where it is approximate)."""
        return not self.problems

    @property
    def expected(self) -> str:
        """The spectrum of the graph in the words of a claims file."""
        return ", ".join(_entry(e) for e in self.eigenvalues)


def verify(claim: Claim) -> Verdict:
    """Compare a claim with the proved spectrum of its graph.

    Raises ValueError where a number is too involved to be compared, ProofError where the proof of the spectrum fails.
    """
    found = spectrum(claim.graph, prove=True).eigenvalues
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
                problems.append(f"claimed {claimed.words}: no eigenvalue; the nearest is {_words(near)}")
        if place is not None:
            tally[place] += claimed.count
    exact = tuple(tally)
    problems += _assign([c for c in claim.numbers if c.interval is not None], found, tally)
    for e, before, count in zip(found, exact, tally, strict=True):
        if count == 0:
            problems.append(f"not claimed: {_words(e)}, {_times(e.multiplicity)}")
        elif count != e.multiplicity:
            how = "claimed" if before else "claimed (approximately)"
            problems.append(f"{how} {_words(e)} {_times(count)}; it occurs {_times(e.multiplicity)}")
    return Verdict(claim, tuple(problems), found)


def _angles(found: Sequence[Eigenvalue]) -> dict[AngleSum, int]:
    """The places of the eigenvalues that are sums of cosines; equal sums are equal numbers, not the other way round."""
    forms = (
        (None if isinstance(e.number, (RealRoot, ComplexRoot)) else read(e.number), i) for i, e in enumerate(found)
    )
    return {form.folded: i for form, i in forms if form is not None}


def _find(number: sp.Expr, found: Sequence[Eigenvalue], middles: Sequence[complex]) -> int | None:
    """The place of the eigenvalue that is this number, None where there is none."""
    middle = _middle(number)
    for i, e in enumerate(found):
        if abs(middles[i] - middle) <= 1e-9 * max(1.0, abs(middle)) and equal(number, e.number):
            return i
    return None


def _middle(number: sp.Expr | RealRoot | ComplexRoot) -> complex:
    """A number to more digits than are needed to tell which eigenvalues it may be."""
    bits = 128
    while True:
        ball = acb(number.enclosure(bits) if isinstance(number, (RealRoot, ComplexRoot)) else enclose(number, bits))
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
    """Give each approximation an eigenvalue of its own where that is possible, and say where it is not.

    Intervals by their upper end take the smallest free eigenvalue each: then as many as possible find one.
    """
    problems = []
    rising = sorted(
        (i for i, e in enumerate(found) if not isinstance(e.value, complex)), key=lambda i: found[i].value.real
    )
    for claimed in sorted(claims, key=lambda c: (c.interval or (0, 0))[1]):
        inside = [i for i in rising if _rounds_to(found[i], claimed)]
        left = claimed.count
        for i in inside:
            taken = min(left, max(0, found[i].multiplicity - tally[i]))
            tally[i] += taken
            left -= taken
        if not inside:
            near = found[min(rising, key=lambda i: abs(found[i].value.real - _centre(claimed)))] if rising else found[0]
            problems.append(f"claimed {claimed.text}: no eigenvalue rounds to it; the nearest is {_words(near)}")
        elif left:
            problems.append(f"claimed {claimed.text} {_times(left)} more than eigenvalues are left that round to it")
    return problems


def _centre(claimed: Claimed) -> float:
    low, high = claimed.interval or (0, 0)
    return float((low + high) / 2)


def _rounds_to(e: Eigenvalue, claimed: Claimed) -> bool:
    """Whether a real eigenvalue lies in the closed interval of an approximation."""
    low, high = (sp.Rational(end.numerator, end.denominator) for end in claimed.interval or (0, 0))
    if not isinstance(e.number, (RealRoot, ComplexRoot)) and e.number.is_Rational:
        return bool(low <= e.number <= high)
    for bits in (64, 512, 4096):
        with precision(bits + 16):
            ball = arb(0) if e.number == 0 else e.enclosure(bits)
            below, above = (arb(fmpq(int(end.p), int(end.q))) for end in (low, high))
            if ball > below and ball < above:
                return True
            if ball < below or ball > above:
                return False
    return equal(e.number, low) or equal(e.number, high)


def _entry(e: Eigenvalue) -> str:
    """An eigenvalue in the words of a claims file; decimals where no short exact form is known."""
    text = e.text
    if isinstance(e.number, RealRoot):
        text = f"~{_rounded(e)}"
    elif isinstance(e.number, ComplexRoot):
        text = f"({e.evaluate(12)})"
    return text if e.multiplicity == 1 else f"{text}^{e.multiplicity}"


def _rounded(e: Eigenvalue, digits: int = 12) -> str:
    """A real eigenvalue rounded to so many digits, each of them right."""
    mantissa, exponent = e.enclosure(256).mid().man_exp()
    value = Fraction(int(mantissa)) * Fraction(2) ** int(exponent)
    with localcontext() as context:
        context.prec = digits
        return str(Decimal(value.numerator) / Decimal(value.denominator))


def _words(e: Eigenvalue) -> str:
    if isinstance(e.number, (RealRoot, ComplexRoot)):
        value = _rounded(e) if isinstance(e.number, RealRoot) else e.evaluate(12)
        return f"{value} (a root of degree {len(e.number.polynomial) - 1})"
    if e.number.is_Rational:
        return e.text
    return f"{e.text} = {e.evaluate(12) if isinstance(e.value, complex) else _rounded(e)}"


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"
