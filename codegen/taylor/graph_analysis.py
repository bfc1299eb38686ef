"""Analyse the graph of series: operands, degrees, and series that are hidden from the choice of the step length.

The step length follows from the last coefficients of the states (`step_length`).  A series can be zero in double
precision now and large soon after, such as exp(-1/x**2) near 0 or exp(-x**2) far from 0; the coefficients of the states
do not show such a series.  `hidden` finds these series, and the writers compare the high coefficients of each with its
low coefficients (`step_length.unseen`).
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
"""Functions whose first two coefficients never vanish together; only their arguments need a check."""

PLAIN = 3
"""Largest degree of a polynomial of states that needs no check: its low coefficients show its size.  A choice."""


def needed(roots: Iterable[Series]) -> set[Series]:
    """Return the roots and all series whose coefficients enter those of the roots."""
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
    """Return terms of the roots, and of arguments of functions, that are no polynomials of degree PLAIN or less."""
    result, seen, pending = set[Series](), set[Series](), list(roots)
    while pending:
        s = pending.pop()
        if s in seen:
            continue
        seen.add(s)
        # continue with terms of sums, branches of choices, and arguments of functions
        match s:
            case Linear() | Choice() | Leaping():
                pending += s.linear
                continue
            case Integral() | QuotientIntegral():
                pending.append(s.argument)
            case Product() | Square() | Ratio() | SquareRoot() | Power():
                # from the factors of a product, take the terms of sums and all functions inside
                parts = {*s.linear, *s.convolved} - {s}
                pending += [part for factor in parts for part in factor.linear if isinstance(factor, Linear)]
                pending += [part for part in needed(parts) if isinstance(part, Integral | QuotientIntegral)]
            case _:
                continue
        if _degree(s) > PLAIN:
            result.add(s)
    return result


def _degree(series: Series) -> float:
    """Return the degree of a polynomial in states, time, and sines and cosines of these; inf for other series."""
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
