"""grid with open ends, as square as n allows (a prime n: a chain); shape: nodes in each of any number of
directions.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from math import isqrt, prod
from typing import TYPE_CHECKING

from ..graphs.families import Eigenvalues, Family
from ..inputs.options import integers_option
from .chain import formula as chain_formula

if TYPE_CHECKING:
    from ..graphs.closed_forms import ClosedForm


def settle_shape(n: int, shape: object, least: int) -> dict[str, object]:
    """Check the shape: at least `least` nodes in each direction, n nodes in total."""
    if shape is None:
        return {}
    sizes = integers_option("shape", shape, least)
    if prod(sizes) != n:
        raise ValueError(f"shape = {sizes} has {prod(sizes)} nodes; expected n = {n}")
    return {"shape": sizes}


def sides(n: int) -> tuple[int, int]:
    """Return (rows, columns), the two factors of n closest to each other, rows <= columns."""
    rows = next(r for r in range(isqrt(n), 0, -1) if n % r == 0)
    return rows, n // rows


def edges(n: int, *, shape: tuple[int, ...] | None = None) -> Iterator[tuple[int, int, int]]:
    """Join each node to the next node in every direction; the index of the last direction varies fastest."""
    sizes = shape or sides(n)
    for i in range(n):
        step = 1
        for size in reversed(sizes):
            if i // step % size + 1 < size:
                yield i, i + step, 1
            step *= size


def spectrum(n: int, *, shape: tuple[int, ...] | None = None) -> Eigenvalues:
    """Sum -4 sin²(kπ/2m), k = 0 … m - 1, over the directions; m is the number of nodes in a direction."""
    from ..algebra.cosine_sums import box

    sizes = shape or sides(n)
    return box(sizes, (False,) * len(sizes))


def box_formula(one: ClosedForm, shape: str | Iterable[object]) -> ClosedForm:
    """Sum the eigenvalues of the directions; sizes are letters or numbers, the last direction varies fastest."""
    from ..graphs.closed_forms import entries
    from ..graphs.closed_products import box, counters

    sizes = entries("shape", shape)
    return replace(box(one, sizes, counters(sizes)), options={"shape": sizes})


TOPOLOGY = Family(
    edges,
    minimum=1,
    settle=lambda n, shape: settle_shape(n, shape, 1),
    count=lambda n, *, shape=None: sum(n // size * (size - 1) for size in shape or sides(n)),
    spectrum=spectrum,
    formula=lambda shape=("p", "q"): box_formula(chain_formula(), shape),
    sides=sides,
    source="A. E. Brouwer, W. H. Haemers, Spectra of Graphs (Springer, 2012), section 1.4.6 (Cartesian product of "
    "paths)",
)
