"""feed-forward (one-way) chain: every node but the first feels the one before it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..graphs.families import Family

if TYPE_CHECKING:
    from ..graphs.closed_forms import ClosedForm


def formula() -> ClosedForm:
    """0, -1; one Jordan block."""
    from sympy import KroneckerDelta, S

    from ..graphs.closed_forms import NODE, ClosedForm, N, Term

    last = KroneckerDelta(NODE, N - 1)
    blocks = "one Jordan block of n - 1 for -1: one eigenvector"
    return ClosedForm((Term(S.Zero, vector=S.One), Term(S.NegativeOne, N - 1, (), last)), least=2, blocks=blocks)


TOPOLOGY = Family(
    # Node i feels node i - 1.
    lambda n: ((i, i - 1, 1) for i in range(1, n)),
    minimum=1,
    count=lambda n: n - 1,
    # -1 has one Jordan block of size n - 1.
    spectrum=lambda n: [(0, 1), (-1, n - 1)][: min(n, 2)],
    formula=formula,
    directed=True,
    source="T. Nishikawa, A. E. Motter, Phys. Rev. E 73, 065106 (2006)",
)
