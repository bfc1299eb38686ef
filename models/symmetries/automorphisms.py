"""Symmetries of a small graph: permutations of the nodes that preserve every weight."""

from __future__ import annotations

from collections import deque
from collections.abc import Hashable, Iterator, Sequence

from ..graphs.topology import Topology
from .partitions import balanced_in_all

Permutation = tuple[int, ...]  # the image of each node
STEP_LIMIT = 2_000_000  # most images that a search tries (a few seconds), a choice


def automorphisms(
    graphs: Sequence[Topology],
    limit: int = 20_000,
    step_limit: int = STEP_LIMIT,
    kinds: Sequence[Hashable] | None = None,
) -> tuple[Permutation, ...]:
    """Return all permutations that preserve weights and directions of all layers and kinds, the identity first."""
    graph, permutations = graphs[0], list[Permutation]()
    for permutation in _search(graphs, step_limit, kinds):
        if len(permutations) == limit:
            raise ValueError(
                f"{graph.name}({graph.n}) has more than {limit} automorphisms; expected at most {limit}: raise "
                "the limit, or describe single partitions with `clusters`"
            )
        permutations.append(permutation)
    return tuple(sorted(permutations))


def _search(graphs: Sequence[Topology], step_limit: int, kinds: Sequence[Hashable] | None) -> Iterator[Permutation]:
    """Yield the automorphisms by backtracking: choose the image of one node after the other, neighbours first."""
    # An automorphism preserves the classes of the coarsest balanced partition: try only images of the same class.
    graph, n, layers = graphs[0], graphs[0].n, [each.rows for each in graphs]
    colours = [(kinds[i] if kinds is not None else 0, *(rows[i][i] for rows in layers)) for i in range(n)]
    colour = balanced_in_all(n, [each.links for each in graphs], colours)
    # The weights of a link in all layers.
    weights = [list(zip(*rows, strict=True)) for rows in zip(*layers, strict=True)]
    near = _neighbours(graphs)
    order, anchor = _order(near, colour)
    image: dict[int, int] = {}
    used: set[int] = set()
    steps = 0

    def extend(depth: int) -> Iterator[Permutation]:
        nonlocal steps
        if depth == n:
            yield tuple(image[i] for i in range(n))
            return
        i = order[depth]
        for j in near[image[anchor[i]]] if i in anchor else range(n):
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


def _order(near: list[list[int]], colour: tuple[int, ...]) -> tuple[list[int], dict[int, int]]:
    """Order the nodes breadth first, from rare colours; map each to an earlier neighbour, if it has one."""
    # Nodes of rare colours have few possible images: start there to keep the search short.
    rare = sorted(range(len(near)), key=lambda i: (colour.count(colour[i]), i))
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


def _neighbours(graphs: Sequence[Topology]) -> list[list[int]]:
    """Return for each node its neighbours by links in either direction in any layer, ascending."""
    near: list[set[int]] = [set() for _ in range(graphs[0].n)]
    for graph in graphs:
        for target, source, _ in graph.links:
            near[target].add(source)
            near[source].add(target)
    return [sorted(nodes) for nodes in near]
