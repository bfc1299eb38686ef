"""Exact comparison of algebraic numbers by a lower bound on non-zero differences.

Write a number as U/L with algebraic integers U and L.  Let u and l bound all conjugates of U and L, and
let D bound the degree of a field that contains U and L.  If U is not 0, its norm is a non-zero integer,
so |U| >= u**(1 - D), and the modulus of the number is at least 1/(l u**(D - 1)).  A certified ball
smaller than this bound decides whether the number is 0.

After Burnikel, Funke, Mehlhorn, Schirra & Schmitt, Algorithmica 55, 14 (2009).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import sympy as sp
from flint import acb, arb

from .balls import Ball, enclose, precision
from .roots import Root

# Expressions of rationals, roots, I, sin and cos of rational multiples of pi, exp of rational multiples of I*pi.
Number: TypeAlias = sp.Expr | Root
MOST_BITS = 2**19  # largest precision of a comparison in bits; numbers that need more raise an error


@dataclass(slots=True)
class _Field:
    """Generators of a number field: a root of unity, radicals (base, q), roots of polynomials."""

    unity: int = 1
    radicals: set[tuple[sp.Expr, int]] = field(default_factory=set)
    roots: dict[tuple[tuple[int, ...], int], int] = field(default_factory=dict)

    @property
    def degree(self) -> int:
        """An upper bound of the degree of the field."""
        return int(sp.totient(self.unity)) * math.prod(q for _, q in self.radicals) * math.prod(self.roots.values())


def equal(a: Number, b: Number) -> bool:
    if a is b or (isinstance(a, sp.Expr) and isinstance(b, sp.Expr) and a == b):
        return True
    return bool(_compared((a,), (b,)) == 0)


def sign(a: tuple[Number, ...], b: tuple[Number, ...]) -> int:
    """Return the exact sign of the difference of two products of numbers."""
    gap = _compared(a, b)
    if isinstance(gap, acb) and not gap.imag.contains(0):
        raise ValueError(f"{_shown(a[0])} or {_shown(b[0])} is complex; expected real numbers")
    return 0 if gap == 0 else 1 if gap.real > 0 else -1


def _compared(a: tuple[Number, ...], b: tuple[Number, ...]) -> Ball:
    """Return a ball around the difference of two products that excludes 0, or 0 if they are equal."""
    needed = _bits((a, b))
    bits = 64
    while True:
        with precision(bits):
            gap = _product_ball(a, bits) - _product_ball(b, bits)
            if abs(gap).lower() > 0:
                return gap
            if abs(gap).upper() < arb(2) ** (-needed):
                return 0
        if bits > 4 * MOST_BITS:
            raise ValueError(
                f"{_shown(a[0])} and {_shown(b[0])} cannot be told apart at {bits} bits; write them simpler"
            )
        bits = min(4 * bits, 2 * bits + needed)


def _product_ball(factors: tuple[Number, ...], bits: int) -> acb:
    product = acb(1)
    for factor in factors:
        product = product * acb(_ball(factor, bits))
    return product


def check_size(number: sp.Expr) -> None:
    """Raise an error unless a number is simple enough to be compared."""
    _bits(((number,),))


def _bits(products: tuple[tuple[Number, ...], ...]) -> int:
    """Compute `bits` such that a sum or difference of these products with modulus below 2**-bits is 0."""
    generated = _Field()
    up, low = _sum([_product([_measure(x, generated) for x in factors]) for factors in products])
    needed = (generated.degree - 1) * up + low
    if needed > MOST_BITS:
        raise ValueError(
            f"{_shown(products[0][0])} needs {needed:.3g} bits to be compared exactly; expected at most {MOST_BITS}; "
            "write it simpler, or as an approximation such as ~-3.414"
        )
    return math.ceil(needed * (1 + 1e-9)) + 8


def _product(parts: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Return (log2 u, log2 l) of a product from the (log2 u, log2 l) of its factors."""
    return sum(up for up, _ in parts), sum(low for _, low in parts)


def _measure(x: Number, generated: _Field) -> tuple[float, float]:
    """Return (log2 u, log2 l) of a number, both at least 0; add its generators to the field."""
    if isinstance(x, Root):
        generated.roots[(x.polynomial, x.index)] = len(x.polynomial) - 1
        leading = x.polynomial[-1]  # leading * root is an algebraic integer; Cauchy's bound
        return math.log2(leading + max(map(abs, x.polynomial))), math.log2(leading)
    if x.is_Rational:
        return math.log2(max(abs(int(x.p)), 1)), math.log2(int(x.q))
    if x is sp.I:
        generated.unity = math.lcm(generated.unity, 4)
        return 0.0, 0.0
    if isinstance(x, (sp.Add, sp.Mul)):
        parts = [_measure(part, generated) for part in x.args]
        return _sum(parts) if isinstance(x, sp.Add) else _product(parts)
    if isinstance(x, (sp.sin, sp.cos)):
        _unity(x.args[0] / sp.pi, generated)
        return 1.0, 1.0
    if isinstance(x, sp.exp):
        _unity(x.args[0] / (sp.pi * sp.I), generated)
        return 0.0, 0.0
    if isinstance(x, sp.Pow) and x.exp.is_Rational:
        return _power(x, generated)
    raise TypeError(
        f"{_shown(x)} is not an algebraic number of rationals, roots, I, sin, cos and exp of multiples of pi"
    )


def _sum(parts: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Return (log2 u, log2 l) of a sum; over the common denominator each U is multiplied by the L of all others."""
    low = sum(low for _, low in parts)
    return max(up + low - own_low for up, own_low in parts) + math.log2(len(parts)), low


def _unity(turn: sp.Expr, generated: _Field) -> None:
    if not turn.is_Rational:
        raise TypeError(f"{turn} times pi is no rational multiple of pi; expected one, so that the number is algebraic")
    generated.unity = math.lcm(generated.unity, 4, 2 * int(turn.q))  # 4: sines contain I


def _power(x: sp.Pow, generated: _Field) -> tuple[float, float]:
    up, low = _measure(x.base, generated)
    p, q = int(x.exp.p), int(x.exp.q)
    if p < 0:  # L/U
        up, low = low, up
    up, low = up * abs(p), low * abs(p)
    if q > 1:  # (U/L)^(1/q) = (U L^(q-1))^(1/q) / L
        generated.radicals.add((x.base, q))
        up = (up + (q - 1) * low) / q
    return up, low


def _ball(x: Number, bits: int) -> Ball:
    return x.enclosure(bits) if isinstance(x, Root) else enclose(x, bits)


def _shown(x: Number) -> str:
    text = x.text if isinstance(x, Root) else sp.sstr(x)
    return text if len(text) <= 60 else f"{text[:57]}..."
