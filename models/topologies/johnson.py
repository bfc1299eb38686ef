"""Johnson graph: the subsets of k (2) elements of a set, joined if they differ in one (k = 2: triangular graph)."""

from __future__ import annotations

from collections.abc import Iterator
from math import comb
from typing import TYPE_CHECKING

from ..graphs.families import Eigenvalues, Family
from ..graphs.subsets import ground_set, multiplicity, numbered, size
from ..inputs.options import integer_option

if TYPE_CHECKING:
    from ..graphs.closed_forms import ClosedForm


def settle(n: int, k: object) -> dict[str, object]:
    """Check that n is a number of k-subsets of a set."""
    chosen = integer_option("k", k, 1)
    ground_set(n, chosen)
    return {"k": chosen}


def edges(n: int, *, k: int = 2) -> Iterator[tuple[int, int, int]]:
    """Join each subset to the subsets with one element replaced by a larger one."""
    m = ground_set(n, k)
    index = numbered(m, k)
    for subset, i in index.items():
        for old in subset:
            others = [e for e in subset if e != old]
            yield from ((i, index[tuple(sorted((*others, e)))], 1) for e in range(old + 1, m) if e not in subset)


def spectrum(n: int, *, k: int = 2) -> Eigenvalues:
    """-j (m + 1 - j), C(m, j) - C(m, j - 1) times, j = 0 … min(k, m - k), for the k-subsets of m elements."""
    m = ground_set(n, k)
    return [(0, 1), *((-j * (m + 1 - j), comb(m, j) - comb(m, j - 1)) for j in range(1, min(k, m - k) + 1))]


def formula(k: object = 2) -> ClosedForm:
    """-j (p + 1 - j), j = 0 … k, for the k-subsets of p elements; k is a number."""
    from sympy import Integer, S

    from ..graphs.closed_forms import ClosedForm, J, P, Term

    chosen = integer_option("k", k, 1)
    term = Term(-J * (P + 1 - J), multiplicity(), ((J, S.Zero, Integer(chosen)),))
    note = f"the subsets of {chosen} of p elements"
    degree, lowest = chosen * (P - chosen), {P: 2 * chosen}
    return ClosedForm((term,), size(chosen), {"k": Integer(chosen)}, note=note, degree=degree, lowest=lowest)


TOPOLOGY = Family(
    edges,
    minimum=1,
    settle=settle,
    # Number of edges: each subset has k (m - k) neighbours.
    count=lambda n, *, k=2: n * k * (ground_set(n, k) - k) // 2,
    spectrum=spectrum,
    formula=formula,
    source="A. E. Brouwer, A. M. Cohen, A. Neumaier, Distance-Regular Graphs (Springer, 1989), section 9.1",
)
