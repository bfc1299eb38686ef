"""Derivatives of expressions that contain kinks and jumps, taken on either side of them.

``sympy.diff`` turns ``sign(w)`` into ``2*DiracDelta(w)``.  A dry-friction law multiplies its kinks by functions
that vanish there, or is used away from them; in both cases the one-sided derivative is the right one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import sympy as sp

LARGEST_CANCELLED = 200
"""Operations of an expression up to which it is cancelled: longer ones are products of minors, which grow by it."""

MOST_TERMS = 5000
"""Terms of the expanded expression up to which it is cancelled or expanded: that multiplies out all powers of sums."""


def operations(expressions: Sequence[sp.Expr]) -> int:
    """The number of operations that evaluate the expressions together, what they share once."""
    shared, left = sp.cse(expressions)
    return sum(int(sp.count_ops(e)) for e in (*(e for _, e in shared), *left))


def cancelled(expressions: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
    """The expressions over their common denominators without common factors, if that saves operations; else unchanged."""
    if any(sp.count_ops(e) > LARGEST_CANCELLED or expanded_terms(e) > MOST_TERMS for e in expressions):
        return tuple(expressions)
    found = tuple(map(sp.cancel, expressions))
    return found if operations(found) < operations(expressions) else tuple(expressions)


def expanded(expressions: Sequence[sp.Expr]) -> tuple[sp.Expr, ...]:
    """The expressions multiplied out, each that gets shorter by it."""
    return tuple(e if expanded_terms(e) > MOST_TERMS else min(e, sp.expand(e), key=sp.count_ops) for e in expressions)


def expanded_terms(e: sp.Expr) -> int:
    """Return at most how many terms an expression has when its products and powers of sums are multiplied out."""
    if isinstance(e, sp.Add):
        return sum(map(expanded_terms, e.args))
    if isinstance(e, sp.Mul):
        return math.prod(map(expanded_terms, e.args))
    if isinstance(e, sp.Pow) and e.exp.is_Integer:
        terms, times = expanded_terms(e.base), abs(int(e.exp))
        return math.comb(terms + times - 1, times)
    return 1


@lru_cache(maxsize=4096)
def derivative(expression: sp.Expr, symbol: sp.Symbol) -> sp.Expr:
    """Return d(expression)/d(symbol) with d|w| = sign(w) dw and d sign(w) = 0, exact wherever w != 0.

    Derivatives of Max and Min are choices, those of floor and ceiling 0: exact wherever there is no kink and no jump.
    """
    expression = sp.sympify(expression)
    if symbol not in expression.free_symbols:
        return sp.S.Zero
    kinks = sorted(expression.atoms(sp.Abs, sp.sign), key=sp.default_sort_key)
    hidden = {kink: sp.Dummy(f"kink{i}", real=True) for i, kink in enumerate(kinks)}
    smooth = expression.xreplace(hidden)  # from the outside in: of |a + |b|| only the outer kink is hidden
    shown = {dummy: kink for kink, dummy in hidden.items()}
    # SymPy differentiates all terms of a sum, also those without the symbol, in tenths of a millisecond each
    moving = [term for term in sp.Add.make_args(smooth) if symbol in term.free_symbols]
    total = sp.Add(*(term.diff(symbol) for term in moving)).xreplace(shown)
    for kink, dummy in hidden.items():
        if isinstance(kink, sp.Abs) and kink.has(symbol):
            inner = kink.args[0]
            outer = smooth.diff(dummy).xreplace(shown)
            total += outer * sp.sign(inner) * derivative(inner, symbol)
    return _joined(_settled(total))


def _joined(e: sp.Expr) -> sp.Expr:
    """An expression whose products have one power of each base: w sign(w) |w|**p/|w| is |w|**p, which is a number at w = 0."""
    powers = [p for p in e.atoms(sp.Pow) if p.base.free_symbols and not p.exp.is_Integer]
    if not any(p.exp.free_symbols or p.base.has(sp.Abs, sp.Max, sp.Min) for p in powers):
        return e

    def joined(product: sp.Mul) -> sp.Expr:
        factors = set(product.args)
        for sign in sorted(factors & product.atoms(sp.sign), key=sp.default_sort_key):
            inner = next((w for w in (sign.args[0], -sign.args[0]) if w in factors), None)
            if inner is not None:
                product = product / sign / inner * sp.Abs(inner) * (1 if inner == sign.args[0] else -1)
        return sp.powsimp(product, combine="exp")

    return e.replace(lambda part: isinstance(part, sp.Mul), joined)


def _settled(e: sp.Expr) -> sp.Expr:
    """What SymPy leaves behind of Max, Min, floor and ceiling, as choices and zeros."""
    jumps = (sp.floor, sp.ceiling)
    if not e.has(sp.Heaviside, sp.Derivative, sp.Subs):
        return e
    e = e.replace(lambda part: isinstance(part, sp.Derivative) and part.has(*jumps), lambda part: sp.S.Zero)
    e = e.replace(lambda part: isinstance(part, sp.Subs), lambda part: part.doit())
    e = e.replace(lambda part: isinstance(part, sp.Mul), _without_steps)
    return e.replace(sp.Heaviside, lambda x, *_: sp.Piecewise((sp.S.One, x > 0), (sp.S.Zero, True)))


def _without_steps(product: sp.Mul) -> sp.Expr:
    """A product without steps beside what is zero below them: Max(0, x) Heaviside(x) is Max(0, x)."""
    bases = {factor.as_base_exp()[0] for factor in product.args}
    needless = [
        factor
        for factor in product.args
        if isinstance(factor, sp.Heaviside) and bases & {sp.Max(0, factor.args[0]), sp.Min(0, -factor.args[0])}
    ]
    return product if not needless else sp.Mul(*(factor for factor in product.args if factor not in needless))
