"""Graphs whose nodes are the k-subsets of a set: how many there are, and which is which."""

from __future__ import annotations

from itertools import combinations
from math import comb
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import sympy as sp


def ground_set(n: int, k: int) -> int:
    """Return the number of elements of a set that has n subsets of k elements."""
    low, high = k, k + 1
    while comb(high, k) < n:
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if comb(middle, k) >= n else (middle, high)
    found = next((m for m in (low, high) if comb(m, k) == n), None)
    if found is None:
        raise ValueError(
            f"found n = {n} with k = {k}; expected a number of {k}-subsets, such as {comb(low, k)} (of a set of {low}) "
            f"or {comb(high, k)} (of a set of {high})"
        )
    return found


def numbered(m: int, k: int) -> dict[tuple[int, ...], int]:
    """Return the k-subsets of 0 … m - 1 in the order of the dictionary, with their numbers."""
    return {subset: i for i, subset in enumerate(combinations(range(m), k))}


def size(k: int) -> sp.Expr:
    """Return the number of k-subsets of p elements as a polynomial in the symbol p."""
    from sympy import factorial, prod

    from .closed_forms import P

    return prod(P - i for i in range(k)) / factorial(k)


def multiplicity() -> sp.Expr:
    """Return C(p, j) - C(p, j - 1), the dimension of the j-th common eigenspace, in symbols p and j."""
    from sympy import binomial

    from .closed_forms import J, P

    return binomial(P, J) - binomial(P, J - 1)
