"""Find fast changes of an observed value between two sample points.

A value jumps or has a kink where a gap passes zero.  A value changes quickly where the depth of an exponential passes
zero.
"""

from __future__ import annotations

from collections.abc import Iterable

import sympy as sp

from synchain.models.mechanics.jumps import JUMPING, KINKED, gaps_of

from .rounding import magnitude

# Rounding error of a value relative to its `magnitude`; codegen/recorders/crossings.py uses the same number.
NOISE = sp.Rational(3, 2) / 10**14
# Functions f with f(u) or 1/f(u) constant up to a term of the order exp(-|u|) for large |u|.
SATURATING = (sp.tanh, sp.erf, sp.cosh)


def gaps_in(values: Iterable[sp.Expr]) -> tuple[sp.Expr, ...]:
    """Return expressions that pass zero where one of the values jumps or has a kink."""
    parts = (part for e in values for part in e.atoms(*KINKED, *JUMPING, sp.atan2))
    gaps = (gap for part in parts for gap in gaps_of(part))
    return _once(-gap if gap.could_extract_minus_sign() else gap for gap in gaps)


def depths_in(values: Iterable[sp.Expr]) -> tuple[sp.Expr, ...]:
    """Return the distances, in e-folds, of the exponential parts of the values from the size one."""
    depths: list[sp.Expr] = []
    for e in values:
        # exp(u) vanishes on one side of u = 0 and dominates on the other
        depths += [-part.args[0] for part in e.atoms(sp.exp)]
        # tanh(u) or 1/(1 + exp(u)) is constant on both sides
        powers = {part for power in e.atoms(sp.Pow) for part in power.base.atoms(sp.exp)}
        depths += [sp.Abs(part.args[0]) for part in {*e.atoms(*SATURATING), *powers}]
    return _once(depths)


def _once(expressions: Iterable[sp.Expr]) -> tuple[sp.Expr, ...]:
    """Drop numbers and repetitions, and sort."""
    return tuple(sorted({e for e in expressions if not e.is_number}, key=sp.default_sort_key))


def calmed(e: sp.Expr) -> sp.Expr:
    """Remove rounding from arguments of `sign`: sign(x_1 - x_2) is 0 for two synchronous oscillators."""
    return e.replace(sp.sign, lambda argument: sp.sign(settled(argument)))


def settled(e: sp.Expr) -> sp.Expr:
    """Return an expression that is 0 where its value is only rounding error of its terms."""
    size = magnitude(e)
    return e if size == sp.Abs(e) else sp.Piecewise((sp.S.Zero, sp.Abs(e) <= NOISE * size), (e, True))
