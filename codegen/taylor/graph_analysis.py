"""Questions about series that decide how far a step may go: what they need, their degree, and what they may hide.

The step length follows from the last coefficients of the states (`step_length`).  They miss a series that is zero in double
precision now and large soon after, such as exp(-1/x**2) near 0 or exp(-x**2) far from it.  `hidden` finds such series; the
writers compare their high coefficients with their low ones (`step_length.unseen`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from .series import (
    Choice,
    Constant,
    Integral,
    Leaping,
    Linear,
    Power,
    Product,
    QuotientIntegral,
    Ratio,
    Series,
    Square,
    SquareRoot,
    State,
    Time,
)

STEADY = ("sin", "cos")
"""sin and cos: their first coefficients never vanish together, so they need no check beyond that of their argument."""

PLAIN = 3
"""Degree up to which the low coefficients of a polynomial of states show how large the high ones become; a choice."""


def needed(roots: Iterable[Series]) -> set[Series]:
    """Return the roots and all series that they need for a coefficient."""
    result, pending = set[Series](), list(roots)
    while pending:
        s = pending.pop()
        if s not in result:
            result.add(s)
            pending += [*s.linear, *s.convolved, *s.started]
    return result


def is_affine(series: Series) -> bool:
    """Return True for a sum of states and time with constant factors."""
    if isinstance(series, Linear):
        return all(map(is_affine, series.linear))
    return isinstance(series, State | Time | Constant)


def hidden(roots: Iterable[Series]) -> set[Series]:
    """Return the terms of the roots, and of arguments of their functions, that are polynomials of no low degree."""
    result, seen, pending = set[Series](), set[Series](), list(roots)
    while pending:
        s = pending.pop()
        if s in seen:
            continue
        seen.add(s)
        # terms of sums and choices, and what functions are functions of
        match s:
            case Linear() | Choice() | Leaping():
                pending += s.linear
                continue
            case Integral() | QuotientIntegral():
                pending.append(s.argument)
            case Product() | Square() | Ratio() | SquareRoot() | Power():
                # of factors: the terms of sums, and all functions below them
                parts = {*s.linear, *s.convolved} - {s}
                pending += [part for factor in parts for part in factor.linear if isinstance(factor, Linear)]
                pending += [part for part in needed(parts) if isinstance(part, Integral | QuotientIntegral)]
            case _:
                continue
        if _degree(s) > PLAIN:
            result.add(s)
    return result


def _degree(series: Series) -> float:
    """Return the degree of a polynomial in states, time, and sines and cosines of such; inf for any other series."""
    match series:
        case Linear() | Choice() | Leaping():
            return max(map(_degree, series.linear), default=0.0)
        case Product():
            return _degree(series.left) + _degree(series.right)
        case Square():
            return 2.0 * _degree(series.base)
        case Integral() if series.function in STEADY:
            return _degree(series.argument)
        case Integral() | QuotientIntegral() | Ratio() | SquareRoot() | Power():
            return math.inf
    return 1.0
