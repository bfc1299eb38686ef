"""random graph: each pair joined with probability p (1/2), fixed by seed (0); it may fall into parts."""

from __future__ import annotations

import random
from collections.abc import Iterator
from fractions import Fraction
from math import log1p

from ..graphs.families import Family
from ..inputs.options import integer_option, probability_option


def settle(n: int, p: object, seed: object) -> dict[str, object]:
    return {"p": probability_option("p", p), "seed": integer_option("seed", seed, 0)}


def edges(n: int, *, p: str = "1/2", seed: int = 0) -> Iterator[tuple[int, int, int]]:
    """Join each pair with probability p; draw the number of pairs skipped before the next edge (geometric law)."""
    stream = random.Random(seed)
    top, _, bottom = p.partition("/")
    chance = int(top) / int(bottom or 1)
    if chance == 1:
        yield from ((i, j, 1) for j in range(n) for i in range(j))
    elif chance:
        i, j, scale, pairs = -1, 1, log1p(-chance), n * (n - 1) // 2
        while j < n:
            left_out = log1p(-stream.random()) / scale
            if left_out >= pairs:  # left_out may be infinite for tiny p
                return
            i += 1 + int(left_out)
            while i >= j and j < n:
                i, j = i - j, j + 1
            if j < n:
                yield i, j, 1


TOPOLOGY = Family(
    edges,
    minimum=1,
    settle=settle,
    # The mean number of edges.
    expected=lambda n, *, p="1/2", seed=0: int(Fraction(p) * (n * (n - 1) // 2)),
    connected=False,
    source="E. N. Gilbert, Ann. Math. Stat. 30, 1141 (1959); P. Erdős, A. Rényi, Publ. Math. Debrecen 6, 290 (1959); "
    "drawn as V. Batagelj, U. Brandes, Phys. Rev. E 71, 036113 (2005)",
)
