"""Kneser graph: the subsets of k (2) elements of a set, joined if they are disjoint (n = 10: the Petersen graph)."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from math import comb
from typing import TYPE_CHECKING

from ..graphs.families import Eigenvalues, Family
from ..graphs.subsets import ground_set, multiplicity, numbered, size
from ..inputs.options import integer_option

if TYPE_CHECKING:
    from ..graphs.closed_forms import ClosedForm


def settle(n: int, k: object) -> dict[str, object]:
    """Check that n is the number of k-subsets of a set with 2k or more elements."""
    chosen = integer_option("k", k, 1)
    m = ground_set(n, chosen)
    if m < 2 * chosen:
        least = comb(2 * chosen, chosen)
        raise ValueError(f"found n = {n}, {chosen}-subsets of a set of {m}: no two are disjoint; expected n >= {least}")
    return {"k": chosen}


def edges(n: int, *, k: int = 2) -> Iterator[tuple[int, int, int]]:
    """Join each subset to the later subsets that are disjoint from it."""
    m = ground_set(n, k)
    index = numbered(m, k)
    for subset, i in index.items():
        # In lexicographic order a later disjoint subset begins with a larger element.
        larger = [e for e in range(subset[0] + 1, m) if e not in subset]
        yield from ((i, index[other], 1) for other in combinations(larger, k))


def spectrum(n: int, *, k: int = 2) -> Eigenvalues:
    """(-1)^j C(m - k - j, k - j) - C(m - k, k), C(m, j) - C(m, j - 1) times, j = 0 … k, m the size of the set."""
    m = ground_set(n, k)
    counts: dict[int, int] = {}
    for j in range(k + 1):
        value = (-1) ** j * comb(m - k - j, k - j) - comb(m - k, k)
        counts[value] = counts.get(value, 0) + comb(m, j) - (comb(m, j - 1) if j else 0)
    return sorted(counts.items(), reverse=True)


def formula(k: object = 2) -> ClosedForm:
    """(-1)^j C(p - k - j, k - j) - C(p - k, k), j = 0 … k, for the k-subsets of p elements; k is a number."""
    from sympy import Integer, S, binomial

    from ..graphs.closed_forms import ClosedForm, J, P, Term

    chosen = integer_option("k", k, 1)
    degree = binomial(P - chosen, chosen)
    value = (-1) ** J * binomial(P - chosen - J, chosen - J) - degree
    term = Term(value, multiplicity(), ((J, S.Zero, Integer(chosen)),))
    note = f"the subsets of {chosen} of p elements"
    lowest = {P: 6 if chosen == 1 else 2 * chosen}
    return ClosedForm((term,), size(chosen), {"k": Integer(chosen)}, note=note, degree=degree, lowest=lowest)


TOPOLOGY = Family(
    edges,
    minimum=6,
    settle=settle,
    # Number of edges: each subset has C(m - k, k) neighbours.
    count=lambda n, *, k=2: n * comb(ground_set(n, k) - k, k) // 2,
    spectrum=spectrum,
    formula=formula,
    connected=False,
    source="C. Godsil, G. Royle, Algebraic Graph Theory (Springer, 2001), section 9.4; L. Lovász, IEEE Trans. Inf. "
    "Theory 25, 1 (1979)",
)
