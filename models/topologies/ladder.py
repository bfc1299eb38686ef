"""ladder: two chains joined node by node (odd n: the first chain is one node longer)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ..graphs.families import Eigenvalues, Family

if TYPE_CHECKING:
    from ..graphs.closed_forms import ClosedForm


def edges(n: int) -> Iterator[tuple[int, int, int]]:
    """Yield the edges; nodes 0, 2, 4 … are one rail, nodes 1, 3, 5 … the other."""
    for i in range(n):
        if i % 2 == 0 and i + 1 < n:
            yield i, i + 1, 1
        if i + 2 < n:
            yield i, i + 2, 1


def spectrum(n: int) -> Eigenvalues:
    """-4 sin²(kπ/n) and -2 - 4 sin²(kπ/n), k = 0 … n/2 - 1; None for odd n."""
    if n % 2:
        return None
    from ..algebra.cosine_sums import box

    return box((2, n // 2), (False, False))


def formula() -> ClosedForm:
    """-4 sin²(kπ/2p), in which both rails move alike, and -2 - 4 sin²(kπ/2p), in which they move against each other."""
    from sympy import S, cos, floor, pi, sin

    from ..graphs.closed_forms import NODE, ClosedForm, K, P, Term

    value, rungs = -4 * sin(pi * K / (2 * P)) ** 2, ((K, S.Zero, P - 1),)
    wave = cos(pi * K * (2 * floor(NODE / 2) + 1) / (2 * P))
    terms = (Term(value, S.One, rungs, wave), Term(value - 2, S.One, rungs, (-1) ** NODE * wave))
    return ClosedForm(terms, 2 * P, note="p rungs")


TOPOLOGY = Family(
    edges,
    minimum=2,
    count=lambda n: n // 2 + n - 2,
    spectrum=spectrum,
    formula=formula,
    source="A. E. Brouwer, W. H. Haemers, Spectra of Graphs (Springer, 2012), section 1.4.6 (Cartesian product of two "
    "paths)",
)
