"""circular ladder, or prism: two rings joined node by node (n is even)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ..graphs.families import Eigenvalues, Family

if TYPE_CHECKING:
    from ..graphs.closed_forms import ClosedForm


def settle(n: int) -> dict[str, object]:
    """Check that the number of nodes is even."""
    if n % 2:
        raise ValueError(f"found n = {n}; expected an even number, such as {n - 1} or {n + 1}")
    return {}


def edges(n: int) -> Iterator[tuple[int, int, int]]:
    """Yield the edges; nodes 0, 2, 4 … are one ring, nodes 1, 3, 5 … the other."""
    for i in range(n):
        j = (i + 2) % n
        yield min(i, j), max(i, j), 1
        if i % 2 == 0:
            yield i, i + 1, 1


def spectrum(n: int) -> Eigenvalues:
    """-4 sin²(2kπ/n) and -2 - 4 sin²(2kπ/n), k = 0 … n/2 - 1."""
    from ..algebra.cosine_sums import box

    return box((2, n // 2), (False, True))


def formula() -> ClosedForm:
    """-4 sin²(kπ/p), in which both rings move alike, and -2 - 4 sin²(kπ/p), in which they move against each other."""
    from sympy import I, Integer, S, exp, floor, pi, sin

    from ..graphs.closed_forms import NODE, ClosedForm, K, P, Term

    value, rungs = -4 * sin(pi * K / P) ** 2, ((K, S.Zero, P - 1),)
    wave = exp(2 * pi * I * K * floor(NODE / 2) / P)
    terms = (Term(value, S.One, rungs, wave), Term(value - 2, S.One, rungs, (-1) ** NODE * wave))
    return ClosedForm(terms, 2 * P, note="p rungs", degree=Integer(3), lowest={P: 3})


TOPOLOGY = Family(
    edges,
    minimum=6,
    settle=settle,
    count=lambda n: n + n // 2,
    spectrum=spectrum,
    formula=formula,
    source="A. E. Brouwer, W. H. Haemers, Spectra of Graphs (Springer, 2012), section 1.4.6 (Cartesian product of a "
    "cycle and a path)",
)
