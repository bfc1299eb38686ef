"""The elimination of a large network as integer arrays that one small loop runs through."""

from __future__ import annotations

import heapq
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from synchain.models.equations import Equations

from .elimination import Entry, Plan

__all__ = ["EMPTY", "NAMES", "Program", "block_pattern", "program"]

NAMES = (
    "target", "source", "node_slot", "here_slot", "there_slot", "order", "below_start", "below_slot", "below_row",
    "update_start", "update_to", "update_from", "after_start", "after_slot", "after_column",
)  # fmt: skip
"""What the arrays of a program are called, in the order in which a kernel takes them."""

EMPTY: tuple[np.ndarray, ...] = tuple(np.zeros(0, np.int64) for _ in NAMES)
"""The program of a kernel that is written out."""


@dataclass(frozen=True, slots=True)
class Program:
    """Integer arrays in the order of NAMES, weights of the links, and the number of matrix entries.

    target, source (links,): ends of each link.  node_slot (components**2 * n,), here_slot, there_slot
    (components**2 * links,): where the entries of the node's block and of a link's two blocks stand in the matrix, -1 where
    there is none.  order (dimension,): pivots; below_*: rows under each pivot; update_*: what each of them changes;
    after_*: columns behind each pivot.
    """

    arrays: tuple[np.ndarray, ...]
    weights: np.ndarray
    entries: int


def block_pattern(block: Iterable[Iterable[object]]) -> list[tuple[int, int]]:
    """Row and column of the non-zero entries of a small block."""
    return [(a, b) for a, row in enumerate(block) for b, e in enumerate(row) if e != 0]


def program(equations: Equations) -> Program:
    """Plan the elimination of (s - J) for a network; the cost grows with its links and the fill they cause."""
    n, links = equations.n, equations.links
    own = block_pattern(equations.node.jacobian())
    here = block_pattern(equations.edge.jacobian_here()) if equations.edge and links else []
    there = block_pattern(equations.edge.jacobian_there()) if equations.edge and links else []
    pattern = {(a * n + i, b * n + i) for a, b in own for i in range(n)}
    pattern |= {(a * n + link[0], b * n + link[0]) for a, b in here for link in links}
    pattern |= {(a * n + link[0], b * n + link[1]) for a, b in there for link in links}
    steps = order(equations.dimension, pattern)
    slots = _slots(equations.dimension, steps)
    size = len(equations.node.state)
    node_slot = _block_slots(size, own, [(i, i) for i in range(n)], n, slots)
    here_slot = _block_slots(size, here, [(link[0], link[0]) for link in links], n, slots)
    there_slot = _block_slots(size, there, [(link[0], link[1]) for link in links], n, slots)
    ends = [np.array([link[side] for link in links], np.int64) for side in (0, 1)]
    arrays = (*ends, node_slot, here_slot, there_slot, *_loops(steps, slots))
    return Program(arrays, np.array([float(link[2]) for link in links]), len(slots))


def order(size: int, pattern: set[Entry]) -> Plan:
    """Pivots by least degree in the symmetrised pattern, rows without a diagonal entry of J first; O(fill log n)."""
    rows: list[set[int]] = [set() for _ in range(size)]
    columns: list[set[int]] = [set() for _ in range(size)]
    for r, c in pattern:
        if r != c:
            rows[r].add(c)
            columns[c].add(r)
    near = [rows[k] | columns[k] for k in range(size)]
    late = [(k, k) in pattern for k in range(size)]
    heap = [(late[k], len(near[k]), k) for k in range(size)]
    heapq.heapify(heap)
    left, found, below, after = set(range(size)), [], [], []
    while left:
        _, degree, k = heapq.heappop(heap)
        if k not in left or degree != len(near[k]):
            continue  # an outdated entry: the current one is in the heap as well
        left.remove(k)
        found.append(k)
        below.append(tuple(sorted(columns[k])))
        after.append(tuple(sorted(rows[k])))
        _eliminate(k, rows, columns, near)
        for j in near[k]:
            heapq.heappush(heap, (late[j], len(near[j]), j))
    return Plan(tuple(found), tuple(below), tuple(after))


def _eliminate(k: int, rows: list[set[int]], columns: list[set[int]], near: list[set[int]]) -> None:
    """Take pivot k out of the pattern and add the fill that it causes."""
    for r in columns[k]:
        rows[r].discard(k)
        rows[r] |= rows[k] - {r}
        near[r] |= rows[k] - {r}
    for c in rows[k]:
        columns[c].discard(k)
        columns[c] |= columns[k] - {c}
        near[c] |= columns[k] - {c}
    for j in near[k]:
        near[j].discard(k)


def _slots(size: int, steps: Plan) -> dict[Entry, int]:
    """Where each entry of the factors stands: the diagonal first, then in order of elimination."""
    slots = {(k, k): k for k in range(size)}
    for k, down, right in zip(steps.order, steps.below, steps.after, strict=True):
        for key in [*((r, k) for r in down), *((k, c) for c in right)]:
            slots.setdefault(key, len(slots))
    return slots


def _block_slots(
    size: int, pattern: list[tuple[int, int]], places: list[tuple[int, int]], n: int, slots: dict[Entry, int]
) -> np.ndarray:
    """Slots of every block entry: (a * size + b) * len(places) + place."""
    table = np.full((size * size, len(places)), -1, np.int64)
    for a, b in pattern:
        table[a * size + b] = [slots[a * n + i, b * n + j] for i, j in places]
    return table.reshape(-1)


def _loops(steps: Plan, slots: dict[Entry, int]) -> tuple[np.ndarray, ...]:
    """The arrays that the elimination loop runs through."""
    below_start, below_slot, below_row = [0], [], []
    update_start, update_to, update_from = [0], [], []
    after_start, after_slot, after_column = [0], [], []
    for k, down, right in zip(steps.order, steps.below, steps.after, strict=True):
        for r in down:
            below_slot.append(slots[r, k])
            below_row.append(r)
            for c in right:
                update_to.append(slots[r, c])
                update_from.append(slots[k, c])
            update_start.append(len(update_to))
        for c in right:
            after_slot.append(slots[k, c])
            after_column.append(c)
        below_start.append(len(below_slot))
        after_start.append(len(after_slot))
    parts = (
        steps.order, below_start, below_slot, below_row, update_start, update_to, update_from,
        after_start, after_slot, after_column,
    )  # fmt: skip
    return tuple(np.array(part, np.int64) for part in parts)
