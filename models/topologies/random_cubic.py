"""random graph: three neighbours each (where n is odd, one node has two), always the same for one n.

Random cubic graph: a ring whose nodes are also joined in random pairs.
"""

from __future__ import annotations

import random
from collections.abc import Iterator

from ..graphs.families import Family

_SEED = 1988


def edges(n: int) -> Iterator[tuple[int, int, int]]:
    """Yield the edges of the ring, then the random pairs."""
    yield from ((i, i + 1, 1) for i in range(n - 1))
    yield 0, n - 1, 1
    yield from ((min(pair), max(pair), 1) for pair in _pairs(n))


def _pairs(n: int) -> list[tuple[int, int]]:
    """Draw a perfect matching of the nodes (all but one if n is odd) without edges of the ring."""
    # While a pair consists of neighbours in the ring, swap its second node with that of a random pair.
    stream = random.Random(_SEED)

    def below(count: int) -> int:
        return int(stream.random() * count)  # reproducible: Python guarantees the values of random()

    nodes = list(range(n))
    for i in range(n - 1, 0, -1):
        j = below(i + 1)
        nodes[i], nodes[j] = nodes[j], nodes[i]
    first, second = nodes[: n // 2], nodes[n // 2 : 2 * (n // 2)]
    wrong = [k for k in range(n // 2) if _adjacent(first[k], second[k], n)]
    while wrong:
        for k in wrong:
            j = below(n // 2)
            second[k], second[j] = second[j], second[k]
        wrong = [k for k in range(n // 2) if _adjacent(first[k], second[k], n)]
    return list(zip(first, second, strict=True))


def _adjacent(i: int, j: int, n: int) -> bool:
    """True for neighbours in the ring."""
    return (i - j) % n in (1, n - 1)


TOPOLOGY = Family(
    edges,
    minimum=4,
    source="B. Bollobás, F. R. K. Chung, SIAM J. Discrete Math. 1, 328 (1988); in the limit of many nodes like a "
    "uniformly random cubic graph: R. W. Robinson, N. C. Wormald, Random Struct. Algorithms 3, 117 (1992)",
)
