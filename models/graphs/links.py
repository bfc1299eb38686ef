"""Links of a graph, as a list or as all pairs of nodes; in-degrees and connected components."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import islice
from typing import TypeAlias

LINK_LIMIT = 4_000_000  # most links of a graph, a choice: 4 million tuples take about 600 MB in Python
# (target, source, weight): node `target` feels node `source`; indices start at 0.
Link: TypeAlias = tuple[int, int, Fraction]


@dataclass(frozen=True, slots=True)
class AllPairs:
    """The sorted links between all pairs of nodes, with one common weight; computed on iteration, not stored."""

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
        """Return the first `count` links."""
        return tuple(islice(self._all(), count))


Links: TypeAlias = tuple[Link, ...] | AllPairs  # links as a tuple, or the links between all pairs of nodes


def one_degree(n: int, links: Iterable[Link]) -> Fraction | None:
    """Return the common in-degree of n nodes, the sum of the weights that a node feels; None if nodes differ."""
    sums = [Fraction(0)] * n
    for target, _, weight in links:
        sums[target] += weight
    return sums[0] if len(set(sums)) == 1 else None


def join(n: int, pairs: Iterable[tuple[int, int]]) -> tuple[int, ...]:
    """Return the class of each node in the finest partition with every pair in one class."""
    # R. E. Tarjan, J. Assoc. Comput. Mach. 22, 215 (1975): union-find with path compression.
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
    """Number the classes from 0 by their first members; return the number of each node's class."""
    order: dict[Hashable, int] = {}
    return tuple(order.setdefault(label, len(order)) for label in classes)
