"""complete graph: all to all."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

from ..graphs.families import Family

if TYPE_CHECKING:
    from ..graphs.closed_forms import ClosedForm


def formula() -> ClosedForm:
    """0, -n."""
    from sympy import KroneckerDelta, S

    from ..graphs.closed_forms import NODE, ClosedForm, M, N, Term

    pairs = KroneckerDelta(NODE, 0) - KroneckerDelta(NODE, M)
    terms = (Term(S.Zero, vector=S.One), Term(-N, N - 1, (), pairs, ((M, S.One, N - 1),)))
    return ClosedForm(terms, degree=N - 1)


TOPOLOGY = Family(
    # Join each pair of nodes.
    lambda n: ((i, j, 1) for i, j in combinations(range(n), 2)),
    minimum=1,
    count=lambda n: n * (n - 1) // 2,
    spectrum=lambda n: [(0, 1), (-n, n - 1)][: min(n, 2)],
    formula=formula,
    all_to_all=True,
    source="A. E. Brouwer, W. H. Haemers, Spectra of Graphs (Springer, 2012), section 1.4.1",
)
