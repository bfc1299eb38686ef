"""closed ring (cycle graph)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ..graphs.families import Eigenvalues, Family

if TYPE_CHECKING:
    from ..graphs.closed_forms import ClosedForm


def edges(n: int) -> Iterator[tuple[int, int, int]]:
    """Join node i to node i + 1, and the first node to the last."""
    yield from ((i, i + 1, 1) for i in range(n - 1))
    yield 0, n - 1, 1


def spectrum(n: int) -> Eigenvalues:
    """-4 sin²(kπ/n), k = 0 … n/2: once for k = 0 and k = n/2, else twice."""
    from ..algebra.cosines import minus_four_sine_squared
    from ..algebra.lazy import LazyEigenvalues

    return LazyEigenvalues(n // 2 + 1, n, lambda k: (minus_four_sine_squared(k, n), 1 if k in (0, n - k) else 2))


def formula() -> ClosedForm:
    """Return the eigenvalues -4 sin²(kπ/n); eigenvectors are the Fourier modes exp(2πijk/n) at node j."""
    from sympy import I, Integer, S, exp, pi, sin

    from ..graphs.closed_forms import NODE, ClosedForm, K, N, Term

    wave = exp(2 * pi * I * NODE * K / N)
    term = Term(-4 * sin(pi * K / N) ** 2, S.One, ((K, S.Zero, N - 1),), wave)
    return ClosedForm((term,), least=3, degree=Integer(2))


TOPOLOGY = Family(
    edges,
    minimum=3,
    too_small="a ring of two would join one pair twice; two nodes joined once are chain 2",
    count=lambda n: n,
    spectrum=spectrum,
    formula=formula,
    source="A. E. Brouwer, W. H. Haemers, Spectra of Graphs (Springer, 2012), section 1.4.3",
)
