"""complete bipartite graph: all nodes of one group with all of another (left: size of the first, half of n)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ..graphs.families import Eigenvalues, Family
from ..inputs.options import integer_option

if TYPE_CHECKING:
    from ..graphs.closed_forms import ClosedForm


def settle(n: int, left: object) -> dict[str, object]:
    """Check that 1 … n - 1 nodes are on the left."""
    if left is None:
        return {}
    size = integer_option("left", left, 1)
    if size >= n:
        raise ValueError(f"left = {size} of n = {n} nodes; expected at most {n - 1}, so that both groups have nodes")
    return {"left": size}


def edges(n: int, *, left: int | None = None) -> Iterator[tuple[int, int, int]]:
    """Join each node of the first group to each node of the second."""
    p = left or n // 2
    return ((i, j, 1) for i in range(p) for j in range(p, n))


def count(n: int, *, left: int | None = None) -> int:
    p = left or n // 2
    return p * (n - p)


def spectrum(n: int, *, left: int | None = None) -> Eigenvalues:
    """0; -p, q - 1 times; -q, p - 1 times; -(p + q): for groups of p and q nodes."""
    p = left or n // 2
    counts = {0: 1}
    for value, times in ((p, n - p - 1), (n - p, p - 1), (n, 1)):
        if times:
            counts[value] = counts.get(value, 0) + times
    return [(-value, times) for value, times in sorted(counts.items())]


def formula() -> ClosedForm:
    """0, -p, -q, -(p + q); the first p nodes are one group."""
    from sympy import KroneckerDelta, Piecewise, S

    from ..graphs.closed_forms import NODE, ClosedForm, M, P, Q, Term

    left = KroneckerDelta(NODE, 0) - KroneckerDelta(NODE, M)
    right = KroneckerDelta(NODE, P) - KroneckerDelta(NODE, P + M)
    terms = (
        Term(S.Zero, vector=S.One),
        Term(-P, Q - 1, (), right, ((M, S.One, Q - 1),)),
        Term(-Q, P - 1, (), left, ((M, S.One, P - 1),)),
        Term(-P - Q, vector=Piecewise((Q, NODE < P), (-P, True))),
    )
    return ClosedForm(terms, P + Q, {"left": P}, note="p and q nodes in the two groups")


TOPOLOGY = Family(
    edges,
    minimum=2,
    settle=settle,
    count=count,
    spectrum=spectrum,
    formula=formula,
    source="A. E. Brouwer, W. H. Haemers, Spectra of Graphs (Springer, 2012), section 1.4.2",
)
