"""ring with several neighbours (4), each edge led elsewhere with probability p (1/10), fixed by seed (0)."""

from __future__ import annotations

import random
from collections.abc import Iterator
from fractions import Fraction

from ..graphs.families import Family
from ..inputs.options import integer_option, probability_option

_DRAWS = 10**7  # most random numbers drawn for a graph; a node joined to nearly all others rejects most draws


def settle(n: int, neighbours: object, p: object, seed: object) -> dict[str, object]:
    """Check the number of neighbours (even, below n), the probability, the seed, and the expected number of draws."""
    count = integer_option("neighbours", neighbours, 2)
    if count % 2 or count >= n:
        raise ValueError(f"neighbours = {count} with n = {n}; expected an even number below n")
    chance = probability_option("p", p)
    draws = int(Fraction(chance) * (n * count // 2) * (n - 1) / max(n - 1 - count, 1))
    if draws > _DRAWS:
        raise ValueError(
            f"neighbours = {count} with n = {n} and p = {chance} takes about {draws} random numbers; "
            f"expected at most {_DRAWS}: take fewer neighbours"
        )
    return {"neighbours": count, "p": chance, "seed": integer_option("seed", seed, 0)}


def edges(n: int, *, neighbours: int = 4, p: str = "1/10", seed: int = 0) -> Iterator[tuple[int, int, int]]:
    """Replace the second node of each ring edge with probability p, edges to nearest neighbours first."""
    stream = random.Random(seed)
    top, _, bottom = p.partition("/")
    chance = int(top) / int(bottom or 1)
    near: list[set[int]] = [set() for _ in range(n)]
    laps = range(1, neighbours // 2 + 1)
    for i, s in ((i, s) for s in laps for i in range(n)):
        near[i].add((i + s) % n)
        near[(i + s) % n].add(i)
    for s in laps:
        for i in range(n):
            if stream.random() < chance and len(near[i]) < n - 1:
                old = (i + s) % n
                new = i
                while new == i or new in near[i]:
                    new = int(stream.random() * len(near))
                near[i].remove(old)
                near[old].remove(i)
                near[i].add(new)
                near[new].add(i)
    return ((i, j, 1) for i in range(n) for j in sorted(near[i]) if i < j)


TOPOLOGY = Family(
    edges,
    minimum=5,
    settle=settle,
    # Rewiring keeps the number of edges.
    count=lambda n, *, neighbours=4, p="1/10", seed=0: n * neighbours // 2,
    connected=False,
    source="D. J. Watts, S. H. Strogatz, Nature 393, 440 (1998)",
)
