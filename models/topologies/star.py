"""star: a hub (the first node) and n - 1 leaves."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..graphs.families import Family

if TYPE_CHECKING:
    from ..graphs.closed_forms import ClosedForm


def formula() -> ClosedForm:
    """0, -1, -n."""
    from sympy import Integer, KroneckerDelta, S

    from ..graphs.closed_forms import NODE, ClosedForm, M, N, Term

    hub = N * KroneckerDelta(NODE, 0) - 1
    leaves = KroneckerDelta(NODE, 1) - KroneckerDelta(NODE, M)
    middle = Term(S.NegativeOne, N - 2, (), leaves, ((M, Integer(2), N - 1),))
    return ClosedForm((Term(S.Zero, vector=S.One), middle, Term(-N, vector=hub)), least=2)


TOPOLOGY = Family(
    # Join the hub to each leaf.
    lambda n: ((0, i, 1) for i in range(1, n)),
    minimum=1,
    count=lambda n: n - 1,
    spectrum=lambda n: [(0, 1), (-1, n - 2), (-n, 1)] if n > 2 else [(0, 1), (-n, 1)][:n],
    formula=formula,
    source="A. E. Brouwer, W. H. Haemers, Spectra of Graphs (Springer, 2012), section 1.4.2 (K_{1,n-1})",
)
