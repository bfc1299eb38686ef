"""Cayley graph of the dihedral group of a polygon with n/2 corners; generators: rotations (1) and reflections (0),
each by its number of corners.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

from ..graphs.families import Eigenvalues, Family
from ..inputs.options import integers_option


def settle(n: int, rotations: object, reflections: object) -> dict[str, object]:
    """Check that n is even, and that rotations (1 … n/4) and reflections (0 … n/2 - 1) are distinct."""
    if n % 2:
        raise ValueError(f"found n = {n}; expected an even number, such as {n - 1} or {n + 1}")
    m, turns, mirrors = n // 2, _numbers("rotations", rotations), _numbers("reflections", reflections)
    if any(a % m == 0 for a in turns):
        raise ValueError(
            f"rotations = {turns}: one of them by {m} corners or none joins nodes to themselves; leave it out"
        )
    if not turns and not mirrors:
        raise ValueError("found neither rotations nor reflections; expected at least one generator")
    return {
        "rotations": tuple(sorted({min(a % m, -a % m) for a in turns})),
        "reflections": tuple(sorted({b % m for b in mirrors})),
    }


def _numbers(what: str, value: object) -> tuple[int, ...]:
    """Read whole numbers from 0 on; an empty list or text gives none."""
    return () if isinstance(value, str | list | tuple) and not value else integers_option(what, value, 0)


def edges(
    n: int, *, rotations: tuple[int, ...] = (1,), reflections: tuple[int, ...] = (0,)
) -> Iterator[tuple[int, int, int]]:
    """Node i is the rotation by i corners; node n/2 + i is that rotation combined with a fixed reflection."""
    m = n // 2
    for start in (0, m):
        for a in rotations:
            for i in range(m // 2 if 2 * a == m else m):
                j = (i + a) % m
                yield start + min(i, j), start + max(i, j), 1
    yield from ((i, m + (i + b) % m, 1) for i in range(m) for b in reflections)


def count(n: int, *, rotations: tuple[int, ...] = (1,), reflections: tuple[int, ...] = (0,)) -> int:
    """Return the number of edges: n for each rotation, n/2 for a half turn and for each reflection."""
    return sum(n // 2 if 4 * a == n else n for a in rotations) + n // 2 * len(reflections)


def spectrum(n: int, *, rotations: tuple[int, ...] = (1,), reflections: tuple[int, ...] = (0,)) -> Eigenvalues:
    """Return Σ_a -4 sin²(πka/m) - r ± |Σ_b exp(2πikb/m)| over rotations a and the r reflections b, m = n/2."""
    # The term of a half turn a = m/2 counts half. For two reflections the modulus is a cosine; for more than two return
    # None.
    from ..algebra.cosine_sums import AngleSum, expressions

    if len(reflections) > 2:
        return None
    m, sums = n // 2, []
    gap = abs(reflections[-1] - reflections[0]) if len(reflections) == 2 else 0
    half = Fraction(len(reflections), 2)
    for k in range(m):
        value = AngleSum.rational(-len(reflections))
        for a in rotations:
            weight = Fraction(1, 2) if 2 * a == m else Fraction(1)
            value += AngleSum.cosine(-2 * weight, weight, k * a % m, m)
        sums += [(value + AngleSum.cosine(0, sign * half, k * gap, 2 * m), 1) for sign in (1, -1)]
    return expressions(sums)


TOPOLOGY = Family(
    edges,
    minimum=4,
    settle=settle,
    count=count,
    spectrum=spectrum,
    connected=False,
    source="L. Babai, J. Comb. Theory B 27, 180 (1979); J.-P. Serre, Linear Representations of Finite Groups "
    "(Springer, 1977), section 5.3",
)
