"""open chain (path graph)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..graphs.families import Eigenvalues, Family

if TYPE_CHECKING:
    from ..graphs.closed_forms import ClosedForm


def spectrum(n: int) -> Eigenvalues:
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


TOPOLOGY = Family(
    # Join node i to node i + 1.
    lambda n: ((i, i + 1, 1) for i in range(n - 1)),
    minimum=1,
    count=lambda n: n - 1,
    spectrum=spectrum,
    formula=formula,
    source="A. E. Brouwer, W. H. Haemers, Spectra of Graphs (Springer, 2012), section 1.4.4",
)
