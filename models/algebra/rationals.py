"""Rational numbers between the standard library, SymPy and flint."""

from __future__ import annotations

from fractions import Fraction

import sympy as sp
from flint import fmpq

__all__ = ["as_fmpq", "as_fraction"]


def as_fmpq(x: Fraction | sp.Rational) -> fmpq:
    """Return a rational number as a flint.fmpq."""
    return fmpq(int(x.numerator), int(x.denominator))


def as_fraction(x: fmpq | sp.Rational) -> Fraction:
    """Return a rational number as a Fraction."""
    return Fraction(int(x.numerator), int(x.denominator))
