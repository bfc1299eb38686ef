"""Balanced partitions: all nodes of a class feel equal sums of weights from every other class."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Hashable, Iterable, Sequence
from fractions import Fraction

from ..graphs.links import Link, numbered


def class_links(n: int, links: Iterable[Link], classes: Sequence[int]) -> tuple[Link, ...]:
    """Return the links between the classes of a balanced partition; ValueError if the partition is not balanced."""
    # Sum the weights that each node feels from each other class.
    felt: list[dict[int, Fraction]] = [{} for _ in range(n)]
    for target, source, weight in links:
        k = classes[source]
        if k != classes[target]:
            felt[target][k] = felt[target].get(k, Fraction(0)) + weight
    # Compare the totals of each node with those of the first node of its class.
    chosen: dict[int, tuple[int, dict[int, Fraction]]] = {}
    for i, totals in enumerate(felt):
        nonzero = {k: weight for k, weight in totals.items() if weight != 0}
        first, expected = chosen.setdefault(classes[i], (i, nonzero))
        if nonzero != expected:
            k = min(k for k in {*nonzero, *expected} if nonzero.get(k) != expected.get(k))
            raise ValueError(
                f"partition is not balanced: nodes {first + 1} and {i + 1} are of one class, but feel class {k} with the "
                f"total weights {expected.get(k, 0)} and {nonzero.get(k, 0)}"
            )
    return tuple((a, b, weight) for a in sorted(chosen) for b, weight in sorted(chosen[a][1].items()))


def coarsest_balanced(n: int, links: Iterable[Link], colours: Sequence[Hashable]) -> tuple[int, ...]:
    """Return the class of each node in the coarsest balanced partition whose classes have one colour each."""
    # The algorithm is colour refinement of G, the links with the diagonal that makes row sums zero: a partition is
    # equitable for G exactly if it is balanced. m links take O(m log n) additions of integers, because after a split
    # the largest part is not processed again. J. E. Hopcroft, in: Theory of Machines and Computations (Academic Press,
    # 1971), p. 189.
    if len(colours) != n:
        raise ValueError(f"colours: found {len(colours)} for {n} nodes; expected one for each node")

    # List the targets of each source with integer weights; the diagonal entry is minus the row sum.
    listed = tuple(links)
    scale = math.lcm(*(weight.denominator for _, _, weight in listed))
    columns: list[list[tuple[int, int]]] = [[] for _ in range(n)]
    row_sums = [0] * n
    for target, source, weight in listed:
        integer = weight.numerator * (scale // weight.denominator)
        columns[source].append((target, integer))
        row_sums[target] += integer
    for i, total in enumerate(row_sums):
        columns[i].append((i, -total))

    # Split classes by the totals that their nodes feel from one class, until no class causes a split.
    class_of = list(numbered(colours))
    members: list[set[int]] = [set() for _ in {*class_of}]
    for i, k in enumerate(class_of):
        members[k].add(i)
    queue = deque(range(len(members)))
    while queue:
        totals: dict[int, int] = {}
        for j in members[queue.popleft()]:
            for i, weight_ij in columns[j]:
                totals[i] = totals.get(i, 0) + weight_ij
        parts: dict[int, dict[int, set[int]]] = {}  # class -> non-zero total -> nodes
        for i, total in totals.items():
            if total != 0:
                parts.setdefault(class_of[i], {}).setdefault(total, set()).add(i)
        for k, by_total in parts.items():
            for part in _split(members, k, list(by_total.values())):
                queue.append(len(members))
                for i in part:
                    class_of[i] = len(members)
                members.append(part)
    return numbered(class_of)


def balanced_in_all(n: int, layers: Sequence[Iterable[Link]], colours: Sequence[Hashable]) -> tuple[int, ...]:
    """Return the coarsest partition with classes of one colour that is balanced in every layer."""
    classes = coarsest_balanced(n, (), colours)
    while True:  # refining for one layer may unbalance another one
        before = classes
        for links in layers:
            classes = coarsest_balanced(n, links, classes)
        if classes == before or len(layers) < 2:
            return classes


def _split(members: list[set[int]], k: int, parts: list[set[int]]) -> list[set[int]]:
    """Split class k into `parts` and the remaining nodes; class k keeps the largest, return the others."""
    remaining = len(members[k]) - sum(map(len, parts))
    parts.sort(key=len)
    if remaining == 0 and len(parts) == 1:
        return []
    if remaining >= len(parts[-1]):
        members[k].difference_update(*parts)
        return parts
    members[k], others = parts.pop(), members[k]
    others.difference_update(members[k], *parts)
    return [*parts, others] if others else parts
