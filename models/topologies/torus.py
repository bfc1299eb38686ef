"""grid with joined ends, as square as n allows (a prime n: a ring); shape: nodes in each of any number of
directions.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import isqrt, prod
from typing import TYPE_CHECKING

from ..graphs.families import Eigenvalues, Family
from ..inputs.options import integers_option

if TYPE_CHECKING:
    from ..graphs.closed_forms import ClosedForm


def settle(n: int, shape: object) -> dict[str, object]:
    """Three or more nodes in each direction, n in all."""
    if shape is None:
        return {}
    sizes = integers_option("shape", shape, 3)
    if prod(sizes) != n:
        raise ValueError(f"shape = {sizes} has {prod(sizes)} nodes; expected n = {n}")
    return {"shape": sizes}


def sides(n: int) -> tuple[int, ...]:
    """The two closest factors of n that are 3 or more; n alone, a ring, if there are none."""
    rows = next((r for r in range(isqrt(n), 2, -1) if n % r == 0), None)
    return (n,) if rows is None else (rows, n // rows)


def edges(n: int, *, shape: tuple[int, ...] | None = None) -> Iterator[tuple[int, int, int]]:
    """Each node and the next one in every direction; the last direction varies fastest."""
    for i in range(n):
        step = 1
        for size in reversed(shape or sides(n)):
            position = i // step % size
            j = i + step if position + 1 < size else i - step * (size - 1)
            yield min(i, j), max(i, j), 1
            step *= size


def spectrum(n: int, *, shape: tuple[int, ...] | None = None) -> Eigenvalues:
    """Sums of -4 sin²(kπ/m), one for each direction of m nodes, k = 0 … m - 1."""
    from ..algebra.cosine_sums import box

    sizes = shape or sides(n)
    return box(sizes, (True,) * len(sizes))


def formula(shape: str | Iterable[object] = ("p", "q")) -> ClosedForm:
    """Sums of -4 sin² of each direction, sizes as letters or numbers; the last varies fastest."""
    from dataclasses import replace

    from ..graphs.closed_forms import entries
    from ..graphs.closed_products import box, counters
    from .ring import formula as one

    sizes = entries("shape", shape)
    return replace(box(one(), sizes, counters(sizes)), options={"shape": sizes})


TOPOLOGY = Family(
    edges,
    minimum=3,
    settle=settle,
    count=lambda n, *, shape=None: n * len(shape or sides(n)),
    spectrum=spectrum,
    formula=formula,
    sides=sides,
    source="A. E. Brouwer, W. H. Haemers, Spectra of Graphs (Springer, 2012), section 1.4.6 (Cartesian product of "
    "cycles)",
)
