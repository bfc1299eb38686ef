"""Balanced partitions: nodes of one class receive equal sums of weights from every class."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Hashable, Iterable, Sequence
from fractions import Fraction

from ..graphs.links import Link, numbered


def class_links(n: int, links: Iterable[Link], classes: Sequence[int]) -> tuple[Link, ...]:
    """Return the links between the classes of a balanced partition."""
    felt: list[dict[int, Fraction]] = [{} for _ in range(n)]
    for target, source, weight in links:
        k = classes[source]
        if k != classes[target]:
            felt[target][k] = felt[target].get(k, Fraction(0)) + weight
    chosen: dict[int, tuple[int, dict[int, Fraction]]] = {}
    for i, found in enumerate(felt):
        total = {k: weight for k, weight in found.items() if weight != 0}
        first, expected = chosen.setdefault(classes[i], (i, total))
        if total != expected:
            k = min(k for k in {*total, *expected} if total.get(k) != expected.get(k))
            raise ValueError(
                f"partition is not balanced: nodes {first + 1} and {i + 1} are of one class, but feel class {k} with the "
                f"total weights {expected.get(k, 0)} and {total.get(k, 0)}"
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
    columns = _columns(n, tuple(links))
    of = list(numbered(colours))
    members: list[set[int]] = [set() for _ in {*of}]
    for i, k in enumerate(of):
        members[k].add(i)
    queue = deque(range(len(members)))
    while queue:
        for k, parts in _felt(members[queue.popleft()], columns, of).items():
            for part in _split(members, k, parts):
                queue.append(len(members))
                for i in part:
                    of[i] = len(members)
                members.append(part)
    return numbered(of)


def _columns(n: int, links: tuple[Link, ...]) -> list[list[tuple[int, int]]]:
    """For each source its targets with whole weights; the diagonal is minus the sum of the row."""
    scale = math.lcm(*(weight.denominator for _, _, weight in links))
    columns: list[list[tuple[int, int]]] = [[] for _ in range(n)]
    rows = [0] * n
    for target, source, weight in links:
        whole = weight.numerator * (scale // weight.denominator)
        columns[source].append((target, whole))
        rows[target] += whole
    for i, total in enumerate(rows):
        columns[i].append((i, -total))
    return columns


def _felt(sources: set[int], columns: list[list[tuple[int, int]]], of: list[int]) -> dict[int, list[set[int]]]:
    """For each class the sets of its nodes that feel the sources with equal totals other than 0."""
    totals: dict[int, int] = {}
    for j in sources:
        for i, weight in columns[j]:
            totals[i] = totals.get(i, 0) + weight
    found: dict[int, dict[int, set[int]]] = {}
    for i, total in totals.items():
        if total != 0:
            found.setdefault(of[i], {}).setdefault(total, set()).add(i)
    return {k: list(parts.values()) for k, parts in found.items()}


def _split(members: list[set[int]], k: int, parts: list[set[int]]) -> list[set[int]]:
    """Split class k into parts and the rest; return all but the largest, which stays k."""
    left = len(members[k]) - sum(map(len, parts))
    parts.sort(key=len)
    if left == 0 and len(parts) == 1:
        return []
    if left >= len(parts[-1]):
        members[k].difference_update(*parts)
        return parts
    members[k], rest = parts.pop(), members[k]
    rest.difference_update(members[k], *parts)
    return [*parts, rest] if rest else parts
