"""Characteristic polynomials det(z - G); chains, rings and forests need no dense matrix.

Let a_j be the diagonal entries of a tridiagonal matrix, b_j and c_j the entries beside the diagonal.
Its leading minors of z - G obey K_j = (z - a_j) K_(j-1) - b_(j-1) c_(j-1) K_(j-2).  With entries in
the two corners, the polynomial is the trace of the product of the transfer matrices minus the products
of the entries along both directions of the cycle (F. R. Gantmacher, M. G. Krein, Oscillation Matrices
and Kernels, AMS Chelsea, 2002, chapter II; L. G. Molinari, Linear Algebra Appl. 429, 2221, 2008).
Leaves of a forest are eliminated one by one (D. P. Jacobs, V. Trevisan, Linear Algebra Appl. 434, 81,
2011).  Factors are multiplied pairwise: n = 500 takes milliseconds, python-flint's dense matrix a second.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import lcm, prod
from typing import Any, TypeAlias, TypeVar

from flint import fmpq, fmpq_poly, fmpz_mat, fmpz_poly

from .matrix import Matrix

T = TypeVar("T")

Entries: TypeAlias = Mapping[tuple[int, int], int]

Polynomial: TypeAlias = Any  # a flint polynomial (flint has no types)
Transfer: TypeAlias = tuple[Polynomial, Polynomial, Polynomial, Polynomial]  # a 2 x 2 matrix of polynomials, row by row

Branch: TypeAlias = tuple[Polynomial, Polynomial]
"""(Π P_k, Σ_k b_k Q_k Π_(j != k) P_j) over some branches k of a node; see `forest`."""


def characteristic(graph: Matrix) -> fmpq_poly:
    """Return the exact characteristic polynomial det(z - G)."""
    # Scale the matrix to whole numbers; scale the polynomial back below.
    fractions = graph.entries
    scale = lcm(*(entry.denominator for _, _, entry in fractions))
    entries = {(i, i): 0 for i in range(graph.n)}
    entries |= {(i, j): entry.numerator * (scale // entry.denominator) for i, j, entry in fractions}
    polynomial = sparse(graph.n, entries, fmpz_poly)
    if polynomial is None:
        rows = [[entries.get((i, j), 0) for j in range(graph.n)] for i in range(graph.n)]
        polynomial = fmpz_mat(rows).charpoly()
    exact = fmpq_poly(polynomial)
    return exact if scale == 1 else exact(fmpq_poly([0, scale])) / fmpq(scale) ** graph.n


def sparse(n: int, entries: Entries, polynomial: Callable[[list[int]], Polynomial]) -> Polynomial | None:
    """Return the characteristic polynomial of a chain, ring or forest; None for any other matrix."""
    # `polynomial` makes a polynomial of integer coefficients, over the integers or modulo a prime.
    if banded(n, entries):
        return cyclic(n, entries, polynomial)
    return forest(n, entries, polynomial)


def banded(n: int, entries: Entries) -> bool:
    """Return whether n >= 3 and all off-diagonal entries join neighbours of a chain, or its two ends."""
    return n >= 3 and all(abs(i - j) in (0, 1, n - 1) for i, j in entries)


def cyclic(n: int, entries: Entries, polynomial: Callable[[list[int]], Polynomial] = fmpz_poly) -> Polynomial:
    """Return the characteristic polynomial of a `banded` matrix; the arguments are those of `sparse`."""

    def at(i: int, j: int) -> int:
        return entries.get((i % n, j % n), 0)

    # Multiply the transfer matrices ((z - a_j, -b_(j-1) c_(j-1)), (1, 0)); take the trace minus both cycle products.
    one, zero = polynomial([1]), polynomial([0])
    steps: list[Transfer] = [
        (polynomial([-at(j, j), 1]), polynomial([-at(j - 1, j) * at(j, j - 1)]), one, zero) for j in range(n)
    ]
    product_matrix = pairwise_product(steps, lambda first, last: _times(last, first))
    down, up = prod(at(i, i - 1) for i in range(n)), prod(at(i - 1, i) for i in range(n))
    return product_matrix[0] + product_matrix[3] - polynomial([down + up])


def forest(n: int, entries: Entries, polynomial: Callable[[list[int]], Polynomial] = fmpz_poly) -> Polynomial | None:
    """Return the characteristic polynomial of a matrix whose links form a forest, else None."""
    # The arguments are those of `sparse`. The polynomial of a branch whose root has the diagonal entry a is (z - a) Π_k
    # P_k - Σ_k b_k Q_k Π_(j != k) P_j. Here k runs over the branches at the root, P_k is the polynomial of branch k,
    # Q_k the polynomial of branch k without the root of k, and b_k the product of the two entries of the link to k.
    order = _parents_first(n, entries)
    if order is None:
        return None
    none: Branch = (polynomial([1]), polynomial([0]))
    branches: dict[int, list[Branch]] = {}
    for i, parent in reversed(order):
        product, links = pairwise_product(branches.pop(i, [none]), _side_by_side)
        link = entries.get((i, parent), 0) * entries.get((parent, i), 0)
        branch = polynomial([-entries.get((i, i), 0), 1]) * product - links
        branches.setdefault(parent, []).append((branch, polynomial([link]) * product))
    return pairwise_product(branches[-1], _side_by_side)[0]


def _parents_first(n: int, entries: Entries) -> list[tuple[int, int]] | None:
    """Return (node, parent) for all nodes of a forest, parents first (-1 for a root); None if there is a cycle."""
    near: list[set[int]] = [set() for _ in range(n)]
    for i, j in entries:
        if i != j:
            near[i].add(j)
            near[j].add(i)
    # Search each component depth first; a second way to a node is a cycle.
    parents: dict[int, int] = {}
    for start in range(n):
        waiting = [start] if parents.setdefault(start, -1) == -1 else []
        while waiting:
            i = waiting.pop()
            for j in near[i] - {parents[i]}:
                if j in parents:
                    return None
                parents[j] = i
                waiting.append(j)
    return list(parents.items())


def _side_by_side(first: Branch, second: Branch) -> Branch:
    return first[0] * second[0], first[0] * second[1] + first[1] * second[0]


def _times(x: Transfer, y: Transfer) -> Transfer:
    a, b, c, d = x
    e, f, g, h = y
    return a * e + b * g, a * f + b * h, c * e + d * g, c * f + d * h


def pairwise_product(factors: Sequence[T], times: Callable[[T, T], T]) -> T:
    """Multiply factors in their order as a balanced tree, so that most products are short."""
    while len(factors) > 1:
        odd = factors[-1:] if len(factors) % 2 else []
        factors = [*(times(a, b) for a, b in zip(factors[::2], factors[1::2], strict=False)), *odd]
    return factors[0]
