"""Roots of irreducible polynomials that can be written briefly: rationals, real radicals, cosines, exponentials."""

from __future__ import annotations

import sympy as sp
from flint import fmpq_poly

from . import angles

__all__ = ["biquadratic", "written"]


def written(factor: fmpq_poly) -> list[sp.Expr] | None:
    """The roots of an irreducible polynomial in closed form, where a short one is known."""
    monic = factor / factor[factor.degree()]
    c = [sp.Rational(int(x.p), int(x.q)) for x in monic.coeffs()]
    if len(c) == 2:
        return [-c[0]]
    if len(c) == 3:
        root = sp.sqrt(c[1] ** 2 / 4 - c[0])
        return [sp.expand(-c[1] / 2 + root), sp.expand(-c[1] / 2 - root)]
    quartic = biquadratic(monic) if len(c) == 5 else None
    return angles.cosine_roots(monic) or quartic or angles.exponential_roots(monic)


def biquadratic(monic: fmpq_poly) -> list[sp.Expr] | None:
    """Real nested roots a ± sqrt(b ± sqrt(c)), or a ± sqrt(b) ± sqrt(c), of a quartic that has them."""
    shift = monic[3] / 4
    even = monic(fmpq_poly([-shift, 1]))
    p, q, discriminant = even[2], even[0], even[2] ** 2 - 4 * even[0]
    if even[1] != 0 or discriminant < 0 or p > 0 or q < 0:
        return None
    a, b, c = (sp.Rational(int(x.p), int(x.q)) for x in (-shift, -p / 2, discriminant / 4))
    product = sp.sqrt(sp.Rational(int(q.p), int(q.q)))
    if product.is_Rational:
        parts = [sp.sqrt((b + product) / 2), sp.sqrt((b - product) / 2)]
        roots = [a + s * parts[0] + t * parts[1] for s in (1, -1) for t in (1, -1)]
    else:
        roots = [a + s * sp.sqrt(b + t * sp.sqrt(c)) for s in (1, -1) for t in (1, -1)]
    return roots if all(len(sp.sstr(root)) <= 60 for root in roots) else None
