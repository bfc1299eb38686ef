"""One-way ring: every node feels the next one only."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import sympy as sp

SUMMARY = "one-way ring: every node feels the next one only"
MINIMUM = 2
SOURCE = "A. E. Brouwer, W. H. Haemers, Spectra of Graphs (Springer, 2012), section 1.4.3 (directed cycle)"

DIRECTED = True


def edges(n: int) -> Iterator[tuple[int, int, int]]:
    """Node i feels node i + 1, the last one the first."""
    return ((i, (i + 1) % n, 1) for i in range(n))


def count(n: int) -> int:
    """Number of links."""
    return n


def spectrum(n: int) -> list[tuple[sp.Expr, int]]:
    """-1 + exp(2πik/n), k = 0 … n - 1, each once."""
    from ..angles import exponential

    return [(exponential(-1, k, n), 1) for k in range(n)]
