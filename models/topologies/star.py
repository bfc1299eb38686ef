"""Star: a hub, node 0, joined to every other node."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import sympy as sp

    from ..graphs.closed_forms import ClosedForm

SUMMARY = "star: a hub (the first node) and n - 1 leaves"
MINIMUM = 1
SOURCE = "A. E. Brouwer, W. H. Haemers, Spectra of Graphs (Springer, 2012), section 1.4.2 (K_{1,n-1})"


def edges(n: int) -> Iterator[tuple[int, int, int]]:
    """The hub and each leaf."""
    return ((0, i, 1) for i in range(1, n))


def count(n: int) -> int:
    """Number of edges."""
    return n - 1


def spectrum(n: int) -> list[tuple[sp.Expr, int]]:
    """0 once, -1 n - 2 times, -n once."""
    from sympy import Integer

    if n == 1:
        return [(Integer(0), 1)]
    middle = [(Integer(-1), n - 2)] if n > 2 else []
    return [(Integer(0), 1), *middle, (Integer(-n), 1)]


def formula() -> ClosedForm:
    """0, -1, -n."""
    from sympy import Integer, KroneckerDelta, S

    from ..graphs.closed_forms import NODE, ClosedForm, M, N, Term

    hub = N * KroneckerDelta(NODE, 0) - 1
    leaves = KroneckerDelta(NODE, 1) - KroneckerDelta(NODE, M)
    middle = Term(S.NegativeOne, N - 2, (), leaves, ((M, Integer(2), N - 1),))
    return ClosedForm((Term(S.Zero, vector=S.One), middle, Term(-N, vector=hub)), least=2)
