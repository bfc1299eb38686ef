"""How claims and verdicts name an eigenvalue: exactly where that is short, else by digits that are all right."""

from __future__ import annotations

from decimal import Decimal, localcontext
from fractions import Fraction

from .algebraic import ComplexRoot, RealRoot
from .eigenvalue import Eigenvalue

__all__ = ["entry", "rounded", "times", "words"]


def entry(e: Eigenvalue) -> str:
    """An eigenvalue in the words of a claims file; decimals where no short exact form is known."""
    text = e.text
    if isinstance(e.number, RealRoot):
        text = f"~{rounded(e)}"
    elif isinstance(e.number, ComplexRoot):
        text = f"({e.evaluate(12)})"
    return text if e.multiplicity == 1 else f"{text}^{e.multiplicity}"


def rounded(e: Eigenvalue, digits: int = 12) -> str:
    """A real eigenvalue rounded to so many digits, each of them right."""
    mantissa, exponent = e.enclosure(256).mid().man_exp()
    value = Fraction(int(mantissa)) * Fraction(2) ** int(exponent)
    with localcontext() as context:
        context.prec = digits
        return str(Decimal(value.numerator) / Decimal(value.denominator))


def words(e: Eigenvalue) -> str:
    """An eigenvalue as a sentence names it."""
    if isinstance(e.number, (RealRoot, ComplexRoot)):
        value = rounded(e) if isinstance(e.number, RealRoot) else e.evaluate(12)
        return f"{value} (a root of degree {len(e.number.polynomial) - 1})"
    if e.number.is_Rational:
        return e.text
    return f"{e.text} = {e.evaluate(12) if isinstance(e.value, complex) else rounded(e)}"


def times(count: int) -> str:
    """A multiplicity as a sentence names it."""
    return "once" if count == 1 else f"{count} times"
