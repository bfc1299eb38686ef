"""Claims about parts of a spectrum, for graphs of any size: chain 1000000: largest = -4*cos(pi/(2*n))**2.

largest, slowest        the eigenvalues of largest modulus, and of smallest modulus other than 0
ratio                   their quotient, of real eigenvalues
distinct                how many different eigenvalues there are
multiplicity(number)    how often a number is an eigenvalue, 0 where it is none

Each stands before =, <, >, <= or >= and an exact number; behind = an approximation such as ~-3.414 may stand, elsewhere a
decimal, which is then exact.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import TypeAlias

import sympy as sp

from ..algebra.cosine_sums import AngleSum, read
from ..algebra.cosine_text import angle_number
from ..algebra.number_text import exact_number

__all__ = ["WORDS", "Exact", "Part", "interval", "is_part", "read_part"]

WORDS = ("largest", "slowest", "ratio", "distinct", "multiplicity")
Exact: TypeAlias = AngleSum | sp.Expr

_PART = re.compile(rf"({'|'.join(WORDS)})\b\s*(.*?)\s*(<=|>=|==?|<|>)\s*(.+)")
_ROUNDED = re.compile(r"~\s*([+-]?[0-9]{1,40}(?:\.[0-9]{1,60})?(?:[eE][+-]?[0-9]{1,3})?)")
_DECIMAL = re.compile(r"[+-]?[0-9]{1,40}\.[0-9]{1,60}")


@dataclass(frozen=True, slots=True)
class Part:
    """What is claimed of `word`, or of the multiplicity of `of`: a relation and a number, or a rounded one as interval."""

    text: str
    word: str
    relation: str
    number: Exact | None = None
    interval: tuple[Fraction, Fraction] | None = None
    of: Exact | None = None


def is_part(text: str) -> bool:
    """True where a text begins with a word of WORDS."""
    return re.match(rf"({'|'.join(WORDS)})\b", text) is not None


def read_part(text: str, values: Mapping[str, int]) -> Part:
    """The claim in a text such as "ratio < 37.9"; ValueError on anything else."""
    found = _PART.fullmatch(text)
    if found is None:
        raise ValueError(f"found {text[:60]!r}; expected e.g. largest = -4, ratio < 37.9 or multiplicity(-2) = 3")
    word, inner, relation, right = found.groups()
    relation = "=" if relation == "==" else relation
    of = None
    if word == "multiplicity":
        if not (inner.startswith("(") and inner.endswith(")")):
            raise ValueError(f"found {text[:60]!r}; expected a number in parentheses, e.g. multiplicity(-2) = 3")
        of = exact(inner[1:-1], values)
    elif inner:
        raise ValueError(f"found {inner[:40]!r} behind {word}; expected one of = < > <= >=")
    if right.startswith("~"):
        if relation != "=":
            raise ValueError(f"found {text[:60]!r}; expected an approximation behind = only; leave out the ~")
        return Part(text, word, relation, interval=interval(right), of=of)
    if relation != "=" and _DECIMAL.fullmatch(right):
        return Part(text, word, relation, AngleSum.rational(Fraction(right)), of=of)
    return Part(text, word, relation, exact(right, values), of=of)


def exact(text: str, values: Mapping[str, int]) -> Exact:
    """A number as a sum of cosines where it is one, else as a SymPy expression."""
    found = angle_number(text, values)
    if found is not None:
        return found
    number = exact_number(text, values)
    as_sum = read(number)
    return number if as_sum is None else as_sum


def interval(text: str) -> tuple[Fraction, Fraction]:
    """The numbers that round to an approximation such as ~-3.414; ValueError where the text is none."""
    rounded = _ROUNDED.fullmatch(text)
    if not rounded:
        raise ValueError(f"unreadable approximation {text[:60]!r}; expected ~ and a real decimal, e.g. ~-3.414")
    mantissa, _, exponent = rounded[1].lower().partition("e")
    power = int(exponent or 0) - len(mantissa.partition(".")[2])
    value, half = Fraction(rounded[1]), Fraction(10) ** power / 2
    return value - half, value + half
