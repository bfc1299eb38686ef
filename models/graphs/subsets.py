"""The k-subsets of a set, which are the nodes of Johnson and Kneser graphs."""

from __future__ import annotations

from itertools import combinations
from math import comb
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import sympy as sp


def ground_set(n: int, k: int) -> int:
    """Find m with C(m, k) = n, the size of a set with n subsets of k elements."""
    # C(m, k) rises with m: double, then bisect to two neighbours C(low, k) < n <= C(high, k)
    low, high = k, k + 1
    while comb(high, k) < n:
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if comb(middle, k) >= n else (middle, high)
    for elements in (low, high):
        if comb(elements, k) == n:
            return elements
    raise ValueError(
        f"found n = {n} with k = {k}; expected a number of {k}-subsets, such as {comb(low, k)} (of a set of {low}) "
        f"or {comb(high, k)} (of a set of {high})"
    )


def numbered(m: int, k: int) -> dict[tuple[int, ...], int]:
    """Number the k-subsets of 0 … m - 1 in lexicographic order."""
    return {subset: i for i, subset in enumerate(combinations(range(m), k))}


def size(k: int) -> sp.Expr:
    """Return the number of k-subsets of p elements as a polynomial in the symbol p."""
    from sympy import factorial, prod

    from .closed_forms import P

    return prod(P - i for i in range(k)) / factorial(k)


def multiplicity() -> sp.Expr:
    """Return C(p, j) - C(p, j - 1) in symbols p and j: the dimension of the j-th eigenspace of the Johnson scheme."""
    from sympy import binomial

    from .closed_forms import J, P

    return binomial(P, J) - binomial(P, J - 1)
