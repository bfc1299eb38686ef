"""random graph with the same number of neighbours at each node (degree, 4), fixed by seed (0)."""

from __future__ import annotations

import random
from collections.abc import Iterator
from itertools import combinations

from ..graphs.families import Family
from ..inputs.options import integer_option

_ATTEMPTS = 1000  # most attempts at a pairing; at the highest degree that is drawn, n/2, one attempt in five succeeds

_Edges = set[tuple[int, int]]


def settle(n: int, degree: object, seed: object) -> dict[str, object]:
    """Check that the degree is below n and that n times the degree is even."""
    neighbours = integer_option("degree", degree, 1)
    if neighbours >= n or n * neighbours % 2:
        raise ValueError(f"degree = {neighbours} with n = {n}; expected less than n, and n times degree even")
    return {"degree": neighbours, "seed": integer_option("seed", seed, 0)}


def edges(n: int, *, degree: int = 4, seed: int = 0) -> Iterator[tuple[int, int, int]]:
    """Pair free ends of edges at random; start again if the remaining ends cannot be paired."""
    # For a degree above n/2 draw the complement, whose degree is smaller.
    stream = random.Random(seed)
    dense = 2 * degree > n
    drawn = _drawn(n, n - 1 - degree if dense else degree, stream)
    if dense:
        return ((i, j, 1) for i, j in combinations(range(n), 2) if (i, j) not in drawn)
    return ((i, j, 1) for i, j in sorted(drawn))


def _drawn(n: int, degree: int, stream: random.Random) -> _Edges:
    """Return the edges of the first successful attempt."""
    for _ in range(_ATTEMPTS):
        joined = _paired(n, degree, stream)
        if joined is not None:
            return joined
    raise ValueError(
        f"random_regular: found no graph of {n} nodes of degree {degree} in {_ATTEMPTS} attempts; choose another seed"
    )


def _paired(n: int, degree: int, stream: random.Random) -> _Edges | None:
    """Pair all ends in one attempt; None if no two of the remaining ends can be joined."""
    ends = [i for i in range(n) for _ in range(degree)]
    joined: _Edges = set()
    while ends:
        # Shuffle by Fisher and Yates with random(), whose values are the same in all versions of Python.
        for k in range(len(ends) - 1, 0, -1):
            j = int(stream.random() * (k + 1))
            ends[k], ends[j] = ends[j], ends[k]
        # Join neighbours in the list; collect ends that would form a loop or a repeated edge for the next round.
        left: list[int] = []
        for a, b in zip(ends[::2], ends[1::2], strict=True):
            pair = (min(a, b), max(a, b))
            if a == b or pair in joined:
                left += pair
            else:
                joined.add(pair)
        if left and not _possible(left, joined):
            return None
        ends = left
    return joined


def _possible(ends: list[int], joined: _Edges) -> bool:
    """Return whether two of the free ends can still be joined."""
    nodes = sorted(set(ends))
    return any((a, b) not in joined for k, a in enumerate(nodes) for b in nodes[k + 1 :])


TOPOLOGY = Family(
    edges,
    minimum=5,
    settle=settle,
    count=lambda n, *, degree=4, seed=0: n * degree // 2,
    connected=False,
    source="A. Steger, N. C. Wormald, Comb. Probab. Comput. 8, 377 (1999)",
)
