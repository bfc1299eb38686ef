"""Complete graph: every node is joined to every other."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import sympy as sp

    from ..graphs.closed_forms import ClosedForm

SUMMARY = "complete graph: all to all"
MINIMUM = 1
ALL_TO_ALL = True
SOURCE = "A. E. Brouwer, W. H. Haemers, Spectra of Graphs (Springer, 2012), section 1.4.1"


def edges(n: int) -> Iterator[tuple[int, int, int]]:
    """Each pair once."""
    return ((i, j, 1) for i, j in combinations(range(n), 2))


def count(n: int) -> int:
    """Number of edges."""
    return n * (n - 1) // 2


def spectrum(n: int) -> list[tuple[sp.Expr, int]]:
    """0 once, -n n - 1 times."""
    from sympy import Integer

    return [(Integer(0), 1)] + ([(Integer(-n), n - 1)] if n > 1 else [])


def formula() -> ClosedForm:
    """0, -n."""
    from sympy import KroneckerDelta, S

    from ..graphs.closed_forms import NODE, ClosedForm, M, N, Term

    pairs = KroneckerDelta(NODE, 0) - KroneckerDelta(NODE, M)
    terms = (Term(S.Zero, vector=S.One), Term(-N, N - 1, (), pairs, ((M, S.One, N - 1),)))
    return ClosedForm(terms, degree=N - 1)
