"""Grid: rows and columns of nodes, each joined to its neighbours left, right, above and below."""

from __future__ import annotations

from collections.abc import Iterator
from math import isqrt

SUMMARY = "two-dimensional grid with open ends, as square as n allows (a prime n leaves one row: a chain)"
MINIMUM = 1
SOURCE = "A. E. Brouwer, W. H. Haemers, Spectra of Graphs (Springer, 2012), section 1.4.6 (Cartesian product of paths)"


def shape(n: int) -> tuple[int, int]:
    """Rows and columns: the two factors of n that are closest to each other, rows <= columns."""
    rows = next(r for r in range(isqrt(n), 0, -1) if n % r == 0)
    return rows, n // rows


def edges(n: int) -> Iterator[tuple[int, int, int]]:
    """Row by row: each node with the next of its row and the one below."""
    _, columns = shape(n)
    for i in range(n):
        if (i + 1) % columns:
            yield i, i + 1, 1
        if i + columns < n:
            yield i, i + columns, 1
