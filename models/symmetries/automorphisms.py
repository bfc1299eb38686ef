"""Symmetries of a small graph: permutations of the nodes that preserve every weight."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator

from ..graphs.topology import Topology
from .partitions import coarsest_balanced

Permutation = tuple[int, ...]
"""The image of each node."""

STEP_LIMIT = 2_000_000
"""Most images that a search tries (a few seconds), a choice."""


def automorphisms(graph: Topology, limit: int = 20_000, step_limit: int = STEP_LIMIT) -> tuple[Permutation, ...]:
    """Return all automorphisms of a graph with weights and directions, the identity first."""
    permutations: list[Permutation] = []
    for permutation in _search(graph, step_limit):
        if len(permutations) == limit:
            raise ValueError(
                f"{graph.name}({graph.n}) has more than {limit} automorphisms; expected at most {limit}: raise "
                "the limit, or describe single partitions with `clusters`"
            )
        permutations.append(permutation)
    return tuple(sorted(permutations))


def _search(graph: Topology, step_limit: int) -> Iterator[Permutation]:
    """Yield the automorphisms by backtracking: choose the image of one node after the other, neighbours first."""
    # An automorphism preserves the classes of the coarsest balanced partition: try only images of the same class.
    weights = graph.rows
    colour = coarsest_balanced(graph.n, graph.links, [row[i] for i, row in enumerate(weights)])
    order, anchor = _order(graph, colour)
    near = _neighbours(graph)
    image: dict[int, int] = {}
    used: set[int] = set()
    steps = 0

    def extend(depth: int) -> Iterator[Permutation]:
        nonlocal steps
        if depth == graph.n:
            yield tuple(image[i] for i in range(graph.n))
            return
        i = order[depth]
        for j in near[image[anchor[i]]] if i in anchor else range(graph.n):
            steps += 1
            if steps > step_limit:
                raise ValueError(
                    f"{graph.name}({graph.n}): automorphisms not found in {step_limit} steps; describe "
                    "single partitions with `clusters`"
                )
            if j in used or colour[i] != colour[j]:
                continue
            # The weights to and from all nodes that have an image must agree.
            if all(weights[i][o] == weights[j][p] and weights[o][i] == weights[p][j] for o, p in image.items()):
                image[i] = j
                used.add(j)
                yield from extend(depth + 1)
                used.discard(image.pop(i))

    return extend(0)


def _order(graph: Topology, colour: tuple[int, ...]) -> tuple[list[int], dict[int, int]]:
    """Order the nodes breadth first, from rare colours; map each to an earlier neighbour, if it has one."""
    near = _neighbours(graph)
    # Nodes of rare colours have few possible images: start there to keep the search short.
    rare = sorted(range(graph.n), key=lambda i: (colour.count(colour[i]), i))
    order: list[int] = []
    anchor: dict[int, int] = {}
    seen: set[int] = set()
    for start in rare:
        queue = deque([start] if start not in seen else [])
        seen.add(start)
        while queue:
            i = queue.popleft()
            order.append(i)
            for j in near[i]:
                if j not in seen:
                    seen.add(j)
                    anchor[j] = i
                    queue.append(j)
    return order, anchor


def _neighbours(graph: Topology) -> list[list[int]]:
    """Return for each node its neighbours by links in either direction, ascending."""
    near: list[set[int]] = [set() for _ in range(graph.n)]
    for target, source, _ in graph.links:
        near[target].add(source)
        near[source].add(target)
    return [sorted(nodes) for nodes in near]
