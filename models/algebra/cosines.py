"""Numbers a + 2 b cos(2πk/m) and a + b exp(2πik/m) with rational a and b.

Numbers are written as short real radicals if such radicals exist (m = 1 … 6, 8, 10, 12, 16, 20, 24),
otherwise with sine or cosine: the radicals of other angles are long or need complex cube roots (casus
irreducibilis).
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from math import gcd, isqrt

import sympy as sp
from flint import fmpq, fmpq_poly, fmpz_poly

from .rationals import to_flint, to_fraction, to_sympy

# 2 cos(2πk/m) as text for SymPy, by (k, m) in lowest terms.
_SHORT = {
    (0, 1): "2", (1, 2): "-2", (1, 3): "-1", (1, 4): "0", (1, 6): "1",
    (1, 5): "-1/2 + sqrt(5)/2", (2, 5): "-1/2 - sqrt(5)/2",
    (1, 10): "1/2 + sqrt(5)/2", (3, 10): "1/2 - sqrt(5)/2",
    (1, 8): "sqrt(2)", (3, 8): "-sqrt(2)", (1, 12): "sqrt(3)", (5, 12): "-sqrt(3)",
    (1, 16): "sqrt(2 + sqrt(2))", (3, 16): "sqrt(2 - sqrt(2))",
    (5, 16): "-sqrt(2 - sqrt(2))", (7, 16): "-sqrt(2 + sqrt(2))",
    (1, 20): "sqrt(5/2 + sqrt(5)/2)", (3, 20): "sqrt(5/2 - sqrt(5)/2)",
    (7, 20): "-sqrt(5/2 - sqrt(5)/2)", (9, 20): "-sqrt(5/2 + sqrt(5)/2)",
    (1, 24): "sqrt(6)/2 + sqrt(2)/2", (5, 24): "sqrt(6)/2 - sqrt(2)/2",
    (7, 24): "sqrt(2)/2 - sqrt(6)/2", (11, 24): "-sqrt(6)/2 - sqrt(2)/2",
}  # fmt: skip


def is_short(k: int, m: int) -> bool:
    """Return whether cos(2πk/m), 0 <= k/m <= 1/2 in lowest terms, is a short real radical."""
    return (k, m) in _SHORT


def exponential(shift: int, k: int, m: int) -> sp.Expr:
    """Return shift + exp(2πik/m); as radicals if the denominator of k/m is 1, 2, 3, 4 or 6."""
    turn = Fraction(2 * k, m) % 2
    angle = sp.Rational(*(turn - 2 if turn > 1 else turn).as_integer_ratio()) * sp.pi
    if 2 * turn % 1 == 0 or 3 * turn % 1 == 0:
        return shift + sp.cos(angle) + sp.I * sp.sin(angle)
    return shift + sp.exp(sp.I * angle, evaluate=False)


def minus_four_sine_squared(k: int, m: int) -> sp.Expr:
    """Return -4 sin²(kπ/m) = -2 + 2 cos(2πk/m), as radicals if they are short."""
    return cosine(Fraction(-2), Fraction(1), k, m)


def cosine(a: Fraction, b: Fraction, k: int, m: int) -> sp.Expr:
    """Return a + 2 b cos(2πk/m): with short radicals if they exist, else as a multiple of sin² if a = -2 b."""
    k = min(k % m, -k % m)
    k, m = k // gcd(k, m), m // gcd(k, m)
    shift, factor = to_sympy(a), to_sympy(b)
    if (k, m) in _SHORT:
        return sp.expand(shift + factor * sp.sympify(_SHORT[k, m]))
    if a == -2 * b:
        return -4 * factor * sp.sin(sp.Rational(k, m) * sp.pi, evaluate=False) ** 2
    return shift + 2 * factor * sp.cos(sp.Rational(2 * k, m) * sp.pi, evaluate=False)


def linear_cosine(expression: sp.Expr) -> tuple[Fraction, Fraction, int, int] | None:
    """Return (a, b, k, m) for an expression a + 2 b cos(2πk/m), also one with sin² or cos²."""
    # Return None for any other expression.
    shift, scaled = expression.as_coeff_Add()
    factor, core = scaled.as_coeff_Mul()
    squared = isinstance(core, sp.Pow) and core.exp == 2
    function = core.base if squared else core
    if not (shift.is_Rational and factor.is_Rational and isinstance(function, (sp.sin, sp.cos))):
        return None
    turn = function.args[0] / (2 * sp.pi)
    if not turn.is_Rational or (isinstance(function, sp.sin) and not squared):
        return None
    a, b, angle = to_fraction(shift), to_fraction(factor) / 2, turn
    if squared:  # 2 cos² = 1 + cos 2x, 2 sin² = 1 - cos 2x
        a, b, angle = a + b, (-b if isinstance(function, sp.sin) else b) / 2, 2 * turn
    return a, b, int(angle.p) % int(angle.q), int(angle.q)


def linear_exponential(expression: sp.Expr) -> tuple[Fraction, Fraction, int, int] | None:
    """Return (a, b, k, m) for an expression a + b exp(2πik/m); None for any other expression."""
    shift, scaled = expression.as_coeff_Add()
    factor, core = scaled.as_coeff_Mul()
    if not (shift.is_Rational and factor.is_Rational and isinstance(core, sp.exp)):
        return None
    turn = core.args[0] / (2 * sp.pi * sp.I)
    if not turn.is_Rational:
        return None
    a, b = to_fraction(shift), to_fraction(factor)
    return a, b, int(turn.p) % int(turn.q), int(turn.q)


def minimal_polynomial(a: Fraction, b: Fraction, m: int, conjugates: fmpz_poly | None = None) -> fmpq_poly:
    """Return the monic polynomial with the roots a + 2 b cos(2πk/m) for all k prime to m."""
    psi = fmpq_poly(fmpz_poly.cos_minpoly(m) if conjugates is None else conjugates)
    scale = to_flint(b)
    inner = fmpq_poly([-to_flint(a) / scale, 1 / scale])
    return psi(inner) * scale ** psi.degree()


def exponential_roots(polynomial: fmpq_poly) -> list[sp.Expr] | None:
    """Write all roots of a monic irreducible polynomial of degree >= 2 as a + exp(2πik/m)."""
    # Return None if the roots do not have this form.
    degree = polynomial.degree()
    for m in _moduli(degree):
        cyclotomic = fmpz_poly.cyclotomic(m)
        shift = (fmpq(cyclotomic[degree - 1]) - polynomial[degree - 1]) / degree
        if minimal_polynomial(to_fraction(shift), Fraction(1), m, cyclotomic) == polynomial:
            a = to_sympy(shift)
            turns = [sp.Rational(2 * k, m) for k in range(m) if gcd(k, m) == 1]
            return [a + sp.exp(sp.I * sp.pi * turn) for turn in turns]
    return None


def cosine_roots(polynomial: fmpq_poly) -> list[sp.Expr] | None:
    """Write all roots of a monic irreducible polynomial of degree >= 2 as a + 2 b cos(2πk/m), descending."""
    # Return None if the roots do not have this form. For each m with the right degree compute a and b from the mean and
    # the mean square deviation of the roots; comparing polynomials proves the form.
    degree = polynomial.degree()
    for m in _moduli(2 * degree):
        # b² is the ratio of the deviations.  Only b > 0 is needed: -2 cos x = 2 cos(π - x), with another m.
        (mean, spread), (psi_mean, psi_spread) = _moments(polynomial), _moments(fmpq_poly(fmpz_poly.cos_minpoly(m)))
        square = spread / psi_spread
        top, bottom = isqrt(max(int(square.p), 0)), isqrt(int(square.q))
        if not top or top * top != int(square.p) or bottom * bottom != int(square.q):
            continue
        b = Fraction(top, bottom)
        a = to_fraction(mean) - b * to_fraction(psi_mean)
        if minimal_polynomial(a, b, m) == polynomial:
            return [cosine(a, b, k, m) for k in range(m // 2 + 1) if gcd(k, m) == 1]
    return None


def _moduli(value: int) -> Iterator[int]:
    """Yield all m >= 3 with φ(m) = value, by a sieve up to 6 φ(m), a bound for all degrees that occur here."""
    last = 6 * value
    totient = list(range(last + 1))
    for p in range(2, last + 1):
        if totient[p] == p:
            for multiple in range(p, last + 1, p):
                totient[multiple] -= totient[multiple] // p
    return (m for m in range(3, last + 1) if totient[m] == value)


def _moments(polynomial: fmpq_poly) -> tuple[fmpq, fmpq]:
    """Return the mean and the mean square deviation of the roots of a monic polynomial."""
    d = polynomial.degree()
    first, second = polynomial[d - 1], polynomial[d - 2]
    mean = -first / d
    return mean, (first * first - 2 * second) / d - mean * mean


def written(factor: fmpq_poly) -> list[sp.Expr] | None:
    """Return the roots of an irreducible polynomial in closed form; None if there is no short form."""
    monic = factor / factor[factor.degree()]
    c = [to_sympy(x) for x in monic.coeffs()]
    if len(c) == 2:
        return [-c[0]]
    if len(c) == 3:
        root = sp.sqrt(c[1] ** 2 / 4 - c[0])
        return [sp.expand(-c[1] / 2 + root), sp.expand(-c[1] / 2 - root)]
    quartic = biquadratic(monic) if len(c) == 5 else None
    return cosine_roots(monic) or quartic or exponential_roots(monic)


def biquadratic(monic: fmpq_poly) -> list[sp.Expr] | None:
    """Write the real roots of a quartic as a ± sqrt(b ± sqrt(c)) or a ± sqrt(b) ± sqrt(c)."""
    # Return None if the roots do not have this form.
    #
    # Shift z to remove the cubic term; the form exists only if z⁴ + p z² + q remains, without linear term.
    shift = monic[3] / 4
    even = monic(fmpq_poly([-shift, 1]))
    p, q, discriminant = even[2], even[0], even[2] ** 2 - 4 * even[0]
    if even[1] != 0 or discriminant < 0 or p > 0 or q < 0:
        return None
    a, b, c = (to_sympy(x) for x in (-shift, -p / 2, discriminant / 4))
    product = sp.sqrt(to_sympy(q))
    if product.is_Rational:
        parts = [sp.sqrt((b + product) / 2), sp.sqrt((b - product) / 2)]
        roots = [a + s * parts[0] + t * parts[1] for s in (1, -1) for t in (1, -1)]
    else:
        roots = [a + s * sp.sqrt(b + t * sp.sqrt(c)) for s in (1, -1) for t in (1, -1)]
    return roots if all(len(sp.sstr(root)) <= 60 for root in roots) else None
