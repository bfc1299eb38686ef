"""Minimax polynomials with coefficients in double precision: how those of codegen/elementary.py were made."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import mpmath
from mpmath import mpf

__all__ = ["chebyshev_points", "minimax", "rounded_minimax", "worst"]

Sample = tuple[mpf, mpf, mpf]
"""Argument, target and weight there."""


def chebyshev_points(low: mpf, high: mpf, count: int) -> list[mpf]:
    """The `count` extrema of a Chebyshev polynomial on [low, high], rising."""
    middle, radius = (low + high) / 2, (high - low) / 2
    return [middle - radius * mpmath.cos(mpmath.pi * i / (count - 1)) for i in range(count)]


def _difference(coefficients: Sequence[mpf], sample: Sample) -> mpf:
    x, target, weight = sample
    return weight * (mpmath.polyval(list(reversed(coefficients)), x) - target)


def worst(coefficients: Sequence[float], samples: Sequence[Sample]) -> mpf:
    """The largest weighted difference between the polynomial (lowest coefficient first) and the target."""
    return max(abs(_difference([mpf(c) for c in coefficients], s)) for s in samples)


def _levelled(reference: Sequence[Sample], fixed: Sequence[mpf]) -> list[mpf]:
    """The polynomial beginning with `fixed` whose weighted differences alternate with equal size on the reference."""
    free = range(len(fixed), len(fixed) + len(reference) - 1)
    rows = [[w * x**j for j in free] + [mpf((-1) ** i)] for i, (x, _, w) in enumerate(reference)]
    right = [-_difference(fixed, s) if fixed else s[1] * s[2] for s in reference]
    solution = mpmath.lu_solve(mpmath.matrix(rows), mpmath.matrix(right))
    return [*fixed, *solution[: len(free)]]


def minimax(samples: Sequence[Sample], count: int, fixed: Sequence[mpf] = ()) -> list[mpf]:
    """The polynomial of `count` coefficients, beginning with `fixed`, with the least worst difference on the samples.

    Remez' exchange of all points (Comptes rendus 198, 2063, 1934).  Raises ArithmeticError where 60 exchanges do not
    bring the largest difference to the levelled one: the samples then have one answer, whatever the arithmetic.
    """
    wanted = count - len(fixed) + 1
    reference = [samples[i * (len(samples) - 1) // (wanted - 1)] for i in range(wanted)]
    for _ in range(60):
        coefficients = _levelled(reference, fixed)
        level = min(abs(_difference(coefficients, s)) for s in reference)
        sized = [(_difference(coefficients, s), s) for s in samples]
        if max(abs(size) for size, _ in sized) <= level * (1 + mpf("1e-12")):
            return coefficients
        runs = [
            max(run, key=lambda pair: abs(pair[0])) for _, run in itertools.groupby(sized, lambda pair: pair[0] > 0)
        ]
        while len(runs) > wanted:  # spare alternations: at the end with the smaller difference
            runs.pop(0 if abs(runs[0][0]) < abs(runs[-1][0]) else -1)
        if len(runs) < wanted:
            raise ArithmeticError(f"the differences alternate {len(runs)} times; expected {wanted}")
        reference = [s for _, s in runs]
    raise ArithmeticError("the exchange did not settle in 60 rounds; expected a settled reference")


def rounded_minimax(samples: Sequence[Sample], count: int, held: int) -> tuple[float, ...]:
    """The minimax coefficients in double precision, lowest first.

    The `held` lowest are rounded one at a time and held while the others are fitted anew; the others are rounded together.
    """
    fixed: list[mpf] = []
    while len(fixed) < held:
        fixed.append(mpf(float(minimax(samples, count, fixed)[len(fixed)])))
    return tuple(float(c) for c in minimax(samples, count, fixed))
