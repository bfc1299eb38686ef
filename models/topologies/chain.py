"""Open chain: every node is joined to its neighbours."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import sympy as sp

    from ..graphs.closed_forms import ClosedForm

SUMMARY = "open chain (path graph)"
MINIMUM = 1
SOURCE = "A. E. Brouwer, W. H. Haemers, Spectra of Graphs (Springer, 2012), section 1.4.4"


def edges(n: int) -> Iterator[tuple[int, int, int]]:
    """Node i and node i + 1."""
    return ((i, i + 1, 1) for i in range(n - 1))


def count(n: int) -> int:
    """Number of edges."""
    return n - 1


def spectrum(n: int) -> Sequence[tuple[sp.Expr, int]]:
    """-4 sin²(kπ/2n), k = 0 … n - 1, each once."""
    from ..algebra.cosines import minus_four_sine_squared
    from ..algebra.lazy import LazyEigenvalues

    return LazyEigenvalues(n, n, lambda k: (minus_four_sine_squared(k, 2 * n), 1))


def formula() -> ClosedForm:
    """-4 sin²(kπ/2n) and its cosine wave."""
    from sympy import S, cos, pi, sin

    from ..graphs.closed_forms import NODE, ClosedForm, K, N, Term

    wave = cos(pi * K * (2 * NODE + 1) / (2 * N))
    return ClosedForm((Term(-4 * sin(pi * K / (2 * N)) ** 2, S.One, ((K, S.Zero, N - 1),), wave),))
