"""Balanced partitions: nodes of one class receive equal sums of weights from every class."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Hashable, Iterable, Sequence
from fractions import Fraction

from ..graphs.links import Link, numbered


def class_links(n: int, links: Iterable[Link], classes: Sequence[int]) -> tuple[Link, ...]:
    """Return the links between the classes of a balanced partition."""
    # the total weight that each node feels from each other class
    felt: list[dict[int, Fraction]] = [{} for _ in range(n)]
    for target, source, weight in links:
        k = classes[source]
        if k != classes[target]:
            felt[target][k] = felt[target].get(k, Fraction(0)) + weight
    # the first node of a class, and the totals that all others must feel too
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
    """Return the class of each node in the coarsest balanced partition with classes of one colour.

    Notes
    -----
    Colour refinement on the links and the diagonal that makes every row sum to zero: for this
    matrix a partition is equitable exactly if it is balanced.  It takes O(m log n) additions of
    whole numbers for m links, because the largest part of a class need not be looked at again.

    References
    ----------
    J. E. Hopcroft, in: Theory of Machines and Computations (Academic Press, 1971), p. 189.
    """
    if len(colours) != n:
        raise ValueError(f"colours: found {len(colours)} for {n} nodes; expected one for each node")

    # For each source its targets with whole weights; the diagonal is minus the sum of the row.
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

    # Split classes by the totals that their nodes feel from one class, until no class splits another.
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
        parts: dict[int, dict[int, set[int]]] = {}  # of each class, by totals other than 0
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


def _split(members: list[set[int]], k: int, parts: list[set[int]]) -> list[set[int]]:
    """Split class k into parts and its remaining nodes; return all but the largest, which stays k."""
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
