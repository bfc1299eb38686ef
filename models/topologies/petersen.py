"""generalised Petersen graph: a ring joined node by node to a star polygon (step, 2); n = 10: the Petersen graph."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ..graphs.families import Family
from ..inputs.options import integer_option

if TYPE_CHECKING:
    from ..graphs.closed_forms import ClosedForm


def settle(n: int, step: object) -> dict[str, object]:
    """Check that n is even and that the step is below n/4."""
    if n % 2:
        raise ValueError(f"found n = {n}; expected an even number, such as {n - 1} or {n + 1}")
    most = (n // 2 - 1) // 2
    return {"step": integer_option("step", step, 1, most)}


def edges(n: int, *, step: int = 2) -> Iterator[tuple[int, int, int]]:
    """Yield the edges; nodes 0 … n/2 - 1 are the ring, node i + n/2 of the star polygon is joined to node i."""
    m = n // 2
    for i in range(m):
        j, k = (i + 1) % m, (i + step) % m
        yield min(i, j), max(i, j), 1
        yield i, m + i, 1
        yield m + min(i, k), m + max(i, k), 1


def formula(step: object = 2) -> ClosedForm:
    """cos a + cos b - 3 ± √((cos a - cos b)² + 1), a = 2πk/p, b = step a; the step is a number."""
    from sympy import I, Integer, Mod, Piecewise, S, cos, exp, pi, sqrt

    from ..graphs.closed_forms import NODE, ClosedForm, K, P, Term

    chosen = integer_option("step", step, 1)
    # On waves exp(2πik·/p), ring and star polygon form the matrix ((2 ring - 3, 1), (1, 2 inside - 3)).
    ring, inside = cos(2 * pi * K / P), cos(2 * pi * K * chosen / P)
    root, indices = sqrt((ring - inside) ** 2 + 1), ((K, S.Zero, P - 1),)
    wave = exp(2 * pi * I * K * Mod(NODE, P) / P)
    terms = tuple(
        Term(
            ring + inside - 3 + s * root,
            S.One,
            indices,
            wave * Piecewise((1, NODE < P), (inside - ring + s * root, True)),
        )
        for s in (1, -1)
    )
    note, lowest = f"p nodes in the ring, {chosen} is the step of those inside", {P: 2 * chosen + 1}
    return ClosedForm(terms, 2 * P, {"step": Integer(chosen)}, note=note, degree=Integer(3), lowest=lowest)


TOPOLOGY = Family(
    edges,
    minimum=10,
    settle=settle,
    # Number of edges: every node has three neighbours.
    count=lambda n, *, step=2: n + n // 2,
    formula=formula,
    source="M. E. Watkins, J. Comb. Theory 6, 152 (1969); spectrum: R. Gera, P. Stănică, Australas. J. Comb. 49, 39 "
    "(2011)",
)
