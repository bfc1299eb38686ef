"""Conversions of rational numbers between Python, FLINT and SymPy."""

from __future__ import annotations

from fractions import Fraction

import sympy as sp
from flint import fmpq


def to_fraction(x: fmpq | sp.Rational) -> Fraction:
    return Fraction(int(x.p), int(x.q))


def to_flint(x: Fraction | sp.Rational) -> fmpq:
    return fmpq(int(x.numerator), int(x.denominator))


def to_sympy(x: Fraction | fmpq) -> sp.Rational:
    if isinstance(x, Fraction):
        return sp.Rational(x.numerator, x.denominator)
    return sp.Rational(int(x.p), int(x.q))
