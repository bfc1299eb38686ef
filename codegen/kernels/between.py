"""What tells that an observed value changes between points at which it seems not to: zeros of gaps, and depths."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import sympy as sp

from synchain.models.mechanics.jumps import JUMPING, KINKED, gaps_of

from .rounding import magnitude

NOISE = sp.Rational(3, 2) / 10**14
"""Rounding of a value, as a part of the size of its terms (codegen/recorders/crossings.py)."""

SATURATING = (sp.tanh, sp.erf, sp.cosh)
"""Functions f of which f(u), or 1/f(u), is constant but for exp(-|u|) where the size of u is large."""


def gaps_in(values: Iterable[sp.Expr]) -> tuple[sp.Expr, ...]:
    """Return what passes zero where one of some values jumps or has a kink."""
    parts = (part for e in values for part in e.atoms(*KINKED, *JUMPING, sp.atan2))
    gaps = (gap for part in parts for gap in gaps_of(part))
    return _once(-gap if gap.could_extract_minus_sign() else gap for gap in gaps)


def depths_in(values: Iterable[sp.Expr]) -> tuple[sp.Expr, ...]:
    """Return how many e-folds parts of some values lie below or above the size one.

    An exponential below is nothing, and one above is large; one in a denominator, and what saturates, are a constant on
    both sides.
    """
    return _once(depth for e in values for depth in _depths(e))


def _depths(e: sp.Expr) -> Iterator[sp.Expr]:
    """The depths of one value."""
    yield from (-part.args[0] for part in e.atoms(sp.exp))
    both = {*e.atoms(*SATURATING), *(part for power in e.atoms(sp.Pow) for part in power.base.atoms(sp.exp))}
    yield from (sp.Abs(part.args[0]) for part in both)


def _once(found: Iterable[sp.Expr]) -> tuple[sp.Expr, ...]:
    """Those of some expressions that are no numbers, each once, in a fixed order."""
    return tuple(sorted({e for e in found if not e.is_number}, key=sp.default_sort_key))


def calmed(e: sp.Expr) -> sp.Expr:
    """Return a value whose jumps do not see rounding: the sign of x_1 - x_2 is 0 of oscillators that move as one."""
    return e.replace(sp.sign, lambda argument: sp.sign(settled(argument)))


def settled(e: sp.Expr) -> sp.Expr:
    """Return an expression that is 0 where its value is rounding of its terms."""
    size = magnitude(e)
    return e if size == sp.Abs(e) else sp.Piecewise((sp.S.Zero, sp.Abs(e) <= NOISE * size), (e, True))
