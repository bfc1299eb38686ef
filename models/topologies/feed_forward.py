"""Feed-forward chain: every node but the first feels the one before it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import sympy as sp

    from ..graphs.closed_forms import ClosedForm

SUMMARY = "feed-forward (one-way) chain: every node but the first feels the one before it"
MINIMUM = 1
SOURCE = "T. Nishikawa, A. E. Motter, Phys. Rev. E 73, 065106 (2006)"

DIRECTED = True


def edges(n: int) -> Iterator[tuple[int, int, int]]:
    """Node i feels node i - 1."""
    return ((i, i - 1, 1) for i in range(1, n))


def count(n: int) -> int:
    """Number of links."""
    return n - 1


def spectrum(n: int) -> list[tuple[sp.Expr, int]]:
    """0 once, -1 n - 1 times: one Jordan block of that size."""
    from sympy import Integer

    return [(Integer(0), 1)] + ([(Integer(-1), n - 1)] if n > 1 else [])


def formula() -> ClosedForm:
    """0, -1; one Jordan block."""
    from sympy import KroneckerDelta, S

    from ..graphs.closed_forms import NODE, ClosedForm, N, Term

    last = KroneckerDelta(NODE, N - 1)
    blocks = "one Jordan block of n - 1 for -1: one eigenvector"
    return ClosedForm((Term(S.Zero, vector=S.One), Term(S.NegativeOne, N - 1, (), last)), least=2, blocks=blocks)
