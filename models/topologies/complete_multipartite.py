"""complete multipartite graph: all nodes of each group with all of the others (parts: sizes; three, as equal as n
allows).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from ..graphs.families import Eigenvalues, Family
from ..inputs.options import integers_option

if TYPE_CHECKING:
    from ..graphs.closed_forms import ClosedForm


def settle(n: int, parts: object) -> dict[str, object]:
    """Check the sizes: two or more groups, each of one or more nodes, n nodes in total."""
    if parts is None:
        return {}
    sizes = integers_option("parts", parts, 1)
    if sum(sizes) != n or len(sizes) < 2:
        raise ValueError(f"parts = {sizes} are {len(sizes)} of {sum(sizes)} nodes; expected two or more of n = {n}")
    return {"parts": sizes}


def _sizes(n: int, parts: tuple[int, ...] | None) -> tuple[int, ...]:
    """Return the sizes of the groups; by default three nearly equal ones, the larger last (two groups if n = 2)."""
    return parts or tuple((n + k) // 3 for k in range(3) if n + k > 2)


def edges(n: int, *, parts: tuple[int, ...] | None = None) -> Iterator[tuple[int, int, int]]:
    """Join each node of a group to all nodes of later groups."""
    end = 0
    for size in _sizes(n, parts):
        start, end = end, end + size
        yield from ((i, j, 1) for i in range(start, end) for j in range(end, n))


def spectrum(n: int, *, parts: tuple[int, ...] | None = None) -> Eigenvalues:
    """0, once; -n, once less than there are groups; p - n, p - 1 times for each group of p nodes."""
    sizes = _sizes(n, parts)
    counts = {-n: len(sizes) - 1}
    for size in sizes:
        if size > 1:
            counts[size - n] = counts.get(size - n, 0) + size - 1
    return [(0, 1), *sorted(counts.items(), reverse=True)]


def formula(parts: str | Iterable[object] = ("p", "q", "r")) -> ClosedForm:
    """0, -n, and p - n for each group of p nodes; sizes are letters or numbers."""
    from sympy import Add, And, KroneckerDelta, Piecewise, S

    from ..graphs.closed_forms import NODE, ClosedForm, M, Term, entries

    sizes = entries("parts", parts)
    if len(sizes) < 2 or M in sizes or any(size == 0 for size in sizes):
        raise ValueError(f"parts = {parts}; expected two or more numbers from 1 or letters other than m")
    n, first = Add(*sizes), sizes[0]
    terms, start = [Term(S.Zero, vector=S.One)], S.Zero
    for size in sizes:
        alike = KroneckerDelta(NODE, start) - KroneckerDelta(NODE, start + M)
        terms.append(Term(size - n, size - 1, (), alike, ((M, S.One, size - 1),)))
        if start != 0:
            inside = And(start <= NODE, start + size > NODE)
            terms.append(Term(-n, vector=Piecewise((size, first > NODE), (-first, inside), (0, True))))
        start += size
    shown = ", ".join(map(str, sizes))
    return ClosedForm(tuple(terms), n, {"parts": sizes}, note=f"{shown} nodes in the groups")


TOPOLOGY = Family(
    edges,
    minimum=2,
    settle=settle,
    count=lambda n, *, parts=None: (n * n - sum(size * size for size in _sizes(n, parts))) // 2,
    spectrum=spectrum,
    formula=formula,
    source="A. E. Brouwer, W. H. Haemers, Spectra of Graphs (Springer, 2012), section 1.3.2 (the complement of "
    "complete graphs side by side)",
)
