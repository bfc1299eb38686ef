"""Derivatives of expressions that contain kinks and jumps, taken on either side of them.

``sympy.diff`` turns ``sign(w)`` into ``2*DiracDelta(w)``.  A dry-friction law either multiplies each kink by a function
that vanishes at the kink, or is used only away from the kink.  In both cases the one-sided derivative is correct.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import sympy as sp

LARGEST_CANCELLED = 200
"""Most operations of an expression that is cancelled (a choice); products of minors exceed this number."""

NOTHING = sp.Rational(1, 10**150)
"""Added to a denominator that may vanish; it changes no other denominator above 1e-134."""

MOST_TERMS = 5000
"""Most terms of an expression after multiplying out; longer expressions are not cancelled or expanded (a choice)."""


def operations(expressions: Sequence[sp.Expr]) -> int:
    """Return the number of operations that evaluate all expressions, with common subexpressions counted once."""
    shared, reduced = sp.cse(expressions)
    return sum(int(sp.count_ops(e)) for e in (*(e for _, e in shared), *reduced))


def cancelled(expressions: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
    """Cancel common factors of numerators and denominators if this saves operations; else return the expressions."""
    # sp.cancel multiplies out, which takes minutes for long expressions.
    if any(sp.count_ops(e) > LARGEST_CANCELLED or expanded_terms(e) > MOST_TERMS for e in expressions):
        return tuple(expressions)
    fractions = tuple(map(sp.cancel, expressions))
    return fractions if operations(fractions) < operations(expressions) else tuple(expressions)


def expanded(expressions: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
    """Multiply out each expression that becomes shorter by multiplying out."""
    return tuple(e if expanded_terms(e) > MOST_TERMS else min(e, sp.expand(e), key=sp.count_ops) for e in expressions)


def expanded_terms(e: sp.Expr) -> int:
    """Return an upper bound on the number of terms of an expression after multiplying out."""
    if isinstance(e, sp.Add):
        return sum(map(expanded_terms, e.args))
    if isinstance(e, sp.Mul):
        return math.prod(map(expanded_terms, e.args))
    if isinstance(e, sp.Pow) and e.exp.is_Integer:
        terms, times = expanded_terms(e.base), abs(int(e.exp))
        return math.comb(terms + times - 1, times)  # monomials of that degree
    return 1


@lru_cache(maxsize=4096)
def derivative(expression: sp.Expr, symbol: sp.Symbol) -> sp.Expr:
    """Return d(expression)/d(symbol) with d|w| = sign(w) dw and d sign(w) = 0, exact wherever w != 0.

    A derivative of Max or Min is a `Piecewise`, a derivative of floor or ceiling is 0; both are exact wherever there is
    no kink and no jump.
    """
    expression = sp.sympify(expression)
    if symbol not in expression.free_symbols:
        return sp.S.Zero
    # Replace each kink by a constant. xreplace works from the outside in: of |a + |b|| it replaces only the outer kink.
    kinks = sorted(expression.atoms(sp.Abs, sp.sign), key=sp.default_sort_key)
    hidden = {kink: sp.Dummy(f"kink{i}", real=True) for i, kink in enumerate(kinks)}
    smooth = expression.xreplace(hidden)
    shown = {dummy: kink for kink, dummy in hidden.items()}
    # Skip terms without the symbol: SymPy would spend a tenth of a millisecond on each.
    moving = [term for term in sp.Add.make_args(smooth) if symbol in term.free_symbols]
    total = sp.Add(*(term.diff(symbol) for term in moving)).xreplace(shown)
    # Chain rule through the kinks: d|w| = sign(w) dw; d sign(w) = 0 adds nothing.
    for kink, dummy in hidden.items():
        if isinstance(kink, sp.Abs) and kink.has(symbol):
            inner = kink.args[0]
            outer = smooth.diff(dummy).xreplace(shown)
            total += outer * sp.sign(inner) * derivative(inner, symbol)
    return _zero_at_kinks(_joined_powers(_without_distributions(total)))


def _zero_at_kinks(e: sp.Expr) -> sp.Expr:
    """Write sign(w)/|w|**q as sign(w)/(|w|**q + NOTHING), which is 0 in place of 0/0 at w = 0.

    The second derivative of |w|**(3/2) is infinite at w = 0, where slip begins and ends; deviations pass this instant.
    The first derivative of sqrt(|w|) is infinite there; Jacobians of stiff methods are evaluated at this start.
    A power q of parameters may have either sign: sign(w) |w|**q becomes sign(w) (|w| + NOTHING)**q.
    """
    e = e.replace(
        lambda p: isinstance(p, sp.Pow) and bool(p.exp.free_symbols) and kink_of(p.base) is not None,
        lambda p: (p.base + NOTHING) ** p.exp,
    )
    return e.replace(
        lambda p: isinstance(p, sp.Pow) and p.exp.is_negative and not p.exp.is_integer and kink_of(p.base) is not None,
        lambda p: 1 / (p.base**-p.exp + NOTHING),
    )


def kink_of(base: sp.Expr) -> sp.Expr | None:
    """Return w of a base that has the factor |w|; None without such a factor."""
    return next((factor.args[0] for factor in sp.Mul.make_args(base) if isinstance(factor, sp.Abs)), None)


def _joined_powers(e: sp.Expr) -> sp.Expr:
    """Join the powers of each base: w sign(w) |w|**p/|w| becomes |w|**p, which has a value at w = 0."""
    # SymPy has already joined powers if all exponents are integers.
    powers = [p for p in e.atoms(sp.Pow) if p.base.free_symbols and not p.exp.is_Integer]
    if not any(p.exp.free_symbols or p.base.has(sp.Abs, sp.Max, sp.Min) for p in powers):
        return e

    # SymPy joins powers of one base only if bases are equal: write w sign(w) as |w| first.
    def joined(product: sp.Mul) -> sp.Expr:
        factors = set(product.args)
        for sign in sorted(factors & product.atoms(sp.sign), key=sp.default_sort_key):
            inner = next((w for w in (sign.args[0], -sign.args[0]) if w in factors), None)
            if inner is not None:
                product = product / sign / inner * sp.Abs(inner) * (1 if inner == sign.args[0] else -1)
        return sp.powsimp(product, combine="exp")

    return e.replace(lambda part: isinstance(part, sp.Mul), joined)


def _without_distributions(e: sp.Expr) -> sp.Expr:
    """Replace Heaviside functions from derivatives of Max and Min by `Piecewise`, derivatives of floor, ceiling by 0."""
    if not e.has(sp.Heaviside, sp.Derivative, sp.Subs):
        return e
    e = e.replace(lambda part: isinstance(part, sp.Derivative) and part.has(sp.floor, sp.ceiling), lambda _: sp.S.Zero)
    e = e.replace(lambda part: isinstance(part, sp.Subs), lambda part: part.doit())
    e = e.replace(lambda part: isinstance(part, sp.Mul), _without_steps)
    return e.replace(sp.Heaviside, lambda x, *_: sp.Piecewise((sp.S.One, x > 0), (sp.S.Zero, True)))


def _without_steps(product: sp.Mul) -> sp.Expr:
    """Drop a step function beside a factor that is zero below the step: Max(0, x) Heaviside(x) is Max(0, x)."""
    bases = {factor.as_base_exp()[0] for factor in product.args}
    needless = [
        factor
        for factor in product.args
        if isinstance(factor, sp.Heaviside) and bases & {sp.Max(0, factor.args[0]), sp.Min(0, -factor.args[0])}
    ]
    return product if not needless else sp.Mul(*(factor for factor in product.args if factor not in needless))
