"""grid with joined ends, as square as n allows (a prime n: a ring); shape: nodes in each of any number of
directions.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import isqrt

from ..graphs.families import Eigenvalues, Family
from .grid import box_formula, settle_shape
from .ring import formula as ring_formula


def sides(n: int) -> tuple[int, ...]:
    """Return the two closest factors of n, each 3 or more; (n,), a ring, if there are none."""
    rows = next((r for r in range(isqrt(n), 2, -1) if n % r == 0), None)
    return (n,) if rows is None else (rows, n // rows)


def edges(n: int, *, shape: tuple[int, ...] | None = None) -> Iterator[tuple[int, int, int]]:
    """Join each node to the next node in every direction; the index of the last direction varies fastest."""
    for i in range(n):
        step = 1
        for size in reversed(shape or sides(n)):
            position = i // step % size
            j = i + step if position + 1 < size else i - step * (size - 1)
            yield min(i, j), max(i, j), 1
            step *= size


def spectrum(n: int, *, shape: tuple[int, ...] | None = None) -> Eigenvalues:
    """Sum -4 sin²(kπ/m), k = 0 … m - 1, over the directions; m is the number of nodes in a direction."""
    from ..algebra.cosine_sums import box

    sizes = shape or sides(n)
    return box(sizes, (True,) * len(sizes))


TOPOLOGY = Family(
    edges,
    minimum=3,
    settle=lambda n, shape: settle_shape(n, shape, 3),
    count=lambda n, *, shape=None: n * len(shape or sides(n)),
    spectrum=spectrum,
    formula=lambda shape=("p", "q"): box_formula(ring_formula(), shape),
    sides=sides,
    source="A. E. Brouwer, W. H. Haemers, Spectra of Graphs (Springer, 2012), section 1.4.6 (Cartesian product of "
    "cycles)",
)
