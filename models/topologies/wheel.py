"""wheel: a hub (the first node) joined to every node of a ring."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from typing import TYPE_CHECKING

from ..graphs.families import Eigenvalues, Family

if TYPE_CHECKING:
    import sympy as sp

    from ..graphs.closed_forms import ClosedForm


def edges(n: int) -> Iterator[tuple[int, int, int]]:
    """Yield the spokes, then the rim."""
    spokes = ((0, i, 1) for i in range(1, n))
    return chain(spokes, ((i, i + 1, 1) for i in range(1, n - 1)), [(1, n - 1, 1)])


def spectrum(n: int) -> Eigenvalues:
    """0, -n, and -1 - 4 sin²(kπ/(n - 1)) for k = 1 … n - 2; for n <= 5 some of the last equal -n."""
    from sympy import Integer

    from ..algebra.cosine_sums import AngleSum, expression
    from ..algebra.lazy import LazyEigenvalues

    rim = (n - 1) // 2
    apart = n > 5

    def make(k: int) -> tuple[sp.Expr, int]:
        if k == 0 or k > rim:
            return Integer(-n if k else 0), 1
        times = (1 if 2 * k == n - 1 else 2) + (k == rim and not apart)
        return expression(AngleSum.cosine(-3, 1, k, n - 1)), times

    return LazyEigenvalues(rim + 1 + apart, n, make)


def formula() -> ClosedForm:
    """0, -n, -1 - 4 sin²(kπ/(n - 1))."""
    from sympy import I, KroneckerDelta, S, exp, pi, sin

    from ..graphs.closed_forms import NODE, ClosedForm, K, N, Term

    wave = (1 - KroneckerDelta(NODE, 0)) * exp(2 * pi * I * K * (NODE - 1) / (N - 1))
    rim = Term(-1 - 4 * sin(pi * K / (N - 1)) ** 2, S.One, ((K, S.One, N - 2),), wave)
    hub = N * KroneckerDelta(NODE, 0) - 1
    return ClosedForm((Term(S.Zero, vector=S.One), Term(-N, vector=hub), rim), least=4)


TOPOLOGY = Family(
    edges,
    minimum=4,
    count=lambda n: 2 * (n - 1),
    spectrum=spectrum,
    formula=formula,
    source="A. E. Brouwer, W. H. Haemers, Spectra of Graphs (Springer, 2012), section 1.4.3, with the join of section "
    "1.4.5",
)
