"""circulant graph: every node joined to those at given distances round a ring (offsets, 1 and 2)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from fractions import Fraction
from typing import TYPE_CHECKING

from ..graphs.families import Eigenvalues, Family
from ..inputs.options import integers_option

if TYPE_CHECKING:
    from ..graphs.closed_forms import ClosedForm


def settle(n: int, offsets: object) -> dict[str, object]:
    """Check the distances: 1 … n/2, distinct; n - s stands for s."""
    distances = integers_option("offsets", offsets, 1)
    for s in distances:
        if s % n == 0:
            raise ValueError(f"offsets = {distances}: {s} joins nodes of a ring of {n} to themselves; leave it out")
    return {"offsets": tuple(sorted({min(s % n, -s % n) for s in distances}))}


def edges(n: int, *, offsets: tuple[int, ...] = (1, 2)) -> Iterator[tuple[int, int, int]]:
    """Join each node i to i + s for every offset s; for s = n/2 only the first half of the nodes."""
    for s in offsets:
        for i in range(n // 2 if 2 * s == n else n):
            j = (i + s) % n
            yield min(i, j), max(i, j), 1


def spectrum(n: int, *, offsets: tuple[int, ...] = (1, 2)) -> Eigenvalues:
    """Sums of -4 sin²(ksπ/n) over the offsets s (half of it for s = n/2), k = 0 … n - 1."""
    from ..algebra.cosine_sums import AngleSum, expressions

    weights = [(s, Fraction(1, 2) if 2 * s == n else Fraction(1)) for s in offsets]
    sums = []
    for k in range(n // 2 + 1):
        parts = [AngleSum.cosine(-2 * weight, weight, k * s, n) for s, weight in weights]
        sums.append((sum(parts, AngleSum.rational(0)), 1 if k in (0, n - k) else 2))
    return expressions(sums)


def formula(offsets: str | Iterable[object] = (1, 2)) -> ClosedForm:
    """Sums of -4 sin²(ksπ/n) over the distances s: whole numbers or letters, each below n/2."""
    from itertools import combinations

    from sympy import Add, And, I, Integer, Ne, S, exp, pi, sin, true

    from ..graphs.closed_forms import NODE, ClosedForm, K, N, Term, entries

    chosen = tuple(dict.fromkeys(entries("offsets", offsets)))
    if any(s == 0 or s in (N, K) for s in chosen):
        raise ValueError(f"offsets = {offsets}; expected numbers from 1 and letters other than n and k")
    value = Add(*(-4 * sin(pi * K * s / N) ** 2 for s in chosen))
    wave = exp(2 * pi * I * NODE * K / N)
    letters = any(s.is_Symbol for s in chosen)
    limits = [2 * s < N for s in chosen] + [Ne(s, t) for s, t in combinations(chosen, 2)]
    shown = "each below n/2" + ", no two equal" * letters
    note = f"for the distances {', '.join(map(str, chosen))}, {shown}; a distance n/2 adds half of its -4 sin²"
    least = max([1, *(int(s) for s in chosen if s.is_Integer)]) * 2 + 1
    return ClosedForm(
        (Term(value, S.One, ((K, S.Zero, N - 1),), wave),),
        options={"offsets": chosen},
        least=1 if letters else least,
        note=note,
        degree=Integer(2 * len(chosen)),
        where=And(*limits) if letters else true,
        lowest={N: least},
    )


TOPOLOGY = Family(
    edges,
    minimum=3,
    settle=settle,
    count=lambda n, *, offsets=(1, 2): sum(n // 2 if 2 * s == n else n for s in offsets),
    spectrum=spectrum,
    formula=formula,
    connected=False,
    source="A. E. Brouwer, W. H. Haemers, Spectra of Graphs (Springer, 2012), section 6.4 (Cayley graphs)",
)
