"""Links of a graph, listed or between all pairs; sums of their weights, and the parts that they join."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import islice
from typing import TypeAlias

LINK_LIMIT = 4_000_000
"""Greatest number of links of a graph, a choice: these take about 600 MB as tuples of Python."""

Link: TypeAlias = tuple[int, int, Fraction]
"""(target, source, weight): node `target` feels node `source`; indices start at 0."""


@dataclass(frozen=True, slots=True)
class AllPairs:
    """The links between each node and every other one, all of one weight, sorted; they take no memory."""

    n: int  # number of nodes
    weight: Fraction  # the weight of every link

    def __len__(self) -> int:
        return self.n * (self.n - 1)

    def __iter__(self) -> Iterator[Link]:
        if len(self) > LINK_LIMIT:
            raise ValueError(
                f"links of all pairs: found {len(self)} links between {self.n} nodes; expected at most {LINK_LIMIT} where "
                "they are listed; reduce n"
            )
        return self._all()

    def _all(self) -> Iterator[Link]:
        return ((i, j, self.weight) for i in range(self.n) for j in range(self.n) if i != j)

    def first(self, count: int) -> tuple[Link, ...]:
        """Return the first `count` links, however many there are."""
        return tuple(islice(self._all(), count))


Links: TypeAlias = tuple[Link, ...] | AllPairs
"""Links in a list, or those of all pairs."""


def one_degree(n: int, links: Iterable[Link]) -> Fraction | None:
    """Return the in-degree of n nodes, the sum of the weights that each feels; None if they differ."""
    sums = [Fraction(0)] * n
    for target, _, weight in links:
        sums[target] += weight
    return sums[0] if len(set(sums)) == 1 else None


def join(n: int, pairs: Iterable[tuple[int, int]]) -> tuple[int, ...]:
    """Return the class of each node in the finest partition with every pair in one class.

    References
    ----------
    R. E. Tarjan, J. Assoc. Comput. Mach. 22, 215 (1975): sets as trees, with short paths.
    """
    parent = list(range(n))

    def root(i: int) -> int:
        while parent[i] != i:
            parent[i] = parent[parent[i]]  # halve the path
            i = parent[i]
        return i

    for i, j in pairs:
        a, b = root(i), root(j)
        parent[max(a, b)] = min(a, b)
    return numbered(map(root, range(n)))


def numbered(classes: Iterable[Hashable]) -> tuple[int, ...]:
    """Return the class of each node as a number from 0, in the order of the first members."""
    order: dict[Hashable, int] = {}
    return tuple(order.setdefault(label, len(order)) for label in classes)
