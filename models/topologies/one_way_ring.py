"""one-way ring: every node feels the next one only."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..graphs.families import Eigenvalues, Family

if TYPE_CHECKING:
    from ..graphs.closed_forms import ClosedForm


def spectrum(n: int) -> Eigenvalues:
    """-1 + exp(2πik/n), k = 0 … n - 1, each once."""
    from ..algebra.cosines import exponential

    return [(exponential(-1, k, n), 1) for k in range(n)]


def formula() -> ClosedForm:
    """Return the eigenvalues exp(2πik/n) - 1; eigenvectors are the Fourier modes exp(2πijk/n) at node j."""
    from sympy import I, S, exp, pi

    from ..graphs.closed_forms import NODE, ClosedForm, K, N, Term

    value, wave = exp(2 * pi * I * K / N) - 1, exp(2 * pi * I * NODE * K / N)
    return ClosedForm((Term(value, S.One, ((K, S.Zero, N - 1),), wave),), least=2, degree=S.One)


TOPOLOGY = Family(
    # Node i feels node i + 1; the last node feels the first.
    lambda n: ((i, (i + 1) % n, 1) for i in range(n)),
    minimum=2,
    count=lambda n: n,
    spectrum=spectrum,
    formula=formula,
    directed=True,
    source="A. E. Brouwer, W. H. Haemers, Spectra of Graphs (Springer, 2012), section 1.4.3 (directed cycle)",
)
