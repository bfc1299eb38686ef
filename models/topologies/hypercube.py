"""hypercube where n is a power of two; for other n one digit for each prime factor (a prime n: all to all).

Hypercube: nodes are joined if their places differ in one digit.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import comb
from typing import TYPE_CHECKING

from ..graphs.families import Eigenvalues, Family

if TYPE_CHECKING:
    from ..graphs.closed_forms import ClosedForm


def _radices(n: int) -> list[int]:
    """Return the prime factors of n, ascending; each is the base of one digit of a node's number."""
    factors, p = [], 2
    while p * p <= n:
        if n % p:
            p += 1
        else:
            factors.append(p)
            n //= p
    return factors + ([n] if n > 1 else [])


def edges(n: int) -> Iterator[tuple[int, int, int]]:
    """Join each node to the nodes with one larger digit."""
    bases = _radices(n)
    for i in range(n):
        index, value = i, 1
        for base in bases:
            index, digit = divmod(index, base)
            yield from ((i, i + step * value, 1) for step in range(1, base - digit))
            value *= base


def spectrum(n: int) -> Eigenvalues:
    """-2 k, C(d, k) times, for n = 2**d; else sums of 0 or -p over the prime factors p of n."""
    bases = _radices(n)
    counts = {0: 1}
    for p in sorted(set(bases)):
        d, more = bases.count(p), dict[int, int]()
        for k in range(d + 1):
            for value, count in counts.items():
                more[value - p * k] = more.get(value - p * k, 0) + count * comb(d, k) * (p - 1) ** k
        counts = more
    return list(counts.items())


def formula() -> ClosedForm:
    """-2 k, C(d, k) times; eigenvectors are Walsh functions (J. L. Walsh, Am. J. Math. 45, 5, 1923)."""
    from sympy import Eq, Mod, Product, S, Sum, binomial, floor

    from ..graphs.closed_forms import NODE, ClosedForm, D, J, K, M, Term

    both = Mod(floor(NODE / 2**J), 2) * Mod(floor(M / 2**J), 2)
    digits = Eq(Sum(Mod(floor(M / 2**J), 2), (J, 0, D - 1)), K)
    walsh = Product((-1) ** both, (J, 0, D - 1))
    term = Term(-2 * K, binomial(D, K), ((K, S.Zero, D),), walsh, ((M, S.Zero, 2**D - 1),), digits)
    return ClosedForm((term,), 2**D, note="d dimensions; m has k binary digits 1", degree=D)


TOPOLOGY = Family(
    edges,
    minimum=1,
    # Number of edges: half of n (p - 1) for each prime factor p.
    count=lambda n: n * sum(p - 1 for p in _radices(n)) // 2,
    spectrum=spectrum,
    formula=formula,
    source="A. E. Brouwer, W. H. Haemers, Spectra of Graphs (Springer, 2012), sections 1.4.6 and 1.4.1 (Cartesian "
    "product of complete graphs); any n: L. N. Bhuyan, D. P. Agrawal, IEEE Trans. Comput. C-33, 323 (1984)",
)
