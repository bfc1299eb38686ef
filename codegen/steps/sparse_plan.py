"""Plan the sparse elimination for a large network; integer arrays hold the plan, and a few small loops execute it.

    Equations ─patterns of the blocks of nodes and links─▶ _Network ─pivots and fill─▶ SparsePlan

Chains, rings, stars and trees cause little fill or none: their elimination is exact, and its cost is proportional to
the number of links. In large grids and random graphs, fill grows faster than the network. If the fill exceeds
FILL_LIMIT, the factors are incomplete: only the first level of fill is stored (J. A. Meijerink, H. A. van der Vorst,
Math. Comput. 31, 148, 1977; levels: Y. Saad, Iterative Methods for Sparse Linear Systems, SIAM, 2003, section 10.3.3).
The kernel then refines every solution iteratively, to rounding.
"""

from __future__ import annotations

import heapq
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import accumulate, pairwise

import numpy as np
import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.graphs.links import Link
from synchain.models.mechanics.components import Edge, Node

from .elimination import EliminationPlan, Entry
from .mass_solve import added_masses, momentum_slopes, turned_masses
from .places import by_joint, by_kind, joint_numbers, where_table

# Largest ratio of entries of the exact factors to entries of the matrix; above, factors are incomplete. A choice.
FILL_LIMIT = 3.0
Pattern = tuple[Entry, ...]  # row and column of the non-zero entries of a small block


@dataclass(frozen=True, slots=True)
class SparsePlan:
    """The plan of an elimination: integer arrays in the order of NAMES, weights of links, number of matrix entries."""

    # target, source (links,): ends of each link. node_slot (size**2 * n,): matrix slots of the entries of each node's
    # block; -1 for zeros. `size` is the largest number of states of a node. here_slot, there_slot (size**2 * links,):
    # the same for each link's two blocks, the derivatives by the states of the target and of the source. order
    # (dimension,): the pivots. place (dimension,): the inverse permutation of `order`. row_start (dimension + 1,): the
    # off-diagonal entries in the row of pivot order[q] have the numbers row_start[q] … row_start[q + 1] - 1.
    # after_start (dimension,): entries from after_start[q] on lie in columns of later pivots. column (entries,): the
    # column of each entry. where: see codegen/steps/places.py.

    arrays: tuple[np.ndarray, ...]
    weights: np.ndarray
    entries: int
    exact: bool


@dataclass(frozen=True, slots=True)
class _NetworkPattern:
    """The pattern of the matrix. Equations that differ only in symbols or numbers share one pattern and one plan."""

    # size: largest number of states of a node. kinds, joints: the block patterns of each kind of node and of each
    # joint, with the number of blocks. links: in the order of the kernel. where: the array of that name; the first
    # size*n entries are indices of states.

    n: int
    size: int
    kinds: tuple[tuple[Pattern, int], ...]
    joints: tuple[tuple[tuple[Pattern, Pattern], int], ...]
    links: tuple[Link, ...]
    mixed: bool
    where: tuple[int, ...]


def block_pattern(block: Iterable[Iterable[object]]) -> Pattern:
    """Return row and column of the non-zero entries of a small block."""
    return tuple((a, b) for a, row in enumerate(block) for b, e in enumerate(row) if e != 0)


def sparse_plan(equations: Equations, fill: float = FILL_LIMIT, solves: bool = True) -> SparsePlan:
    """Plan the elimination of (s - J) for a network; time and memory are proportional to the number of links."""
    # The factors are exact unless they have more than `fill` entries per entry of the matrix. If the method `solves` no
    # linear equations, the matrix has no entries.
    edges = [edge for layer in equations.listed for _, edge in layer.edge_of]
    of_nodes = [_node_pattern(node) if solves else () for node in equations.nodes]
    of_links = [_link_patterns(edge) if solves else ((), ()) for edge in edges]
    numbers = {i: k for k, i in enumerate(by_kind(equations))}
    joints = joint_numbers(equations)
    network = _NetworkPattern(
        equations.n,
        max(len(node.state) for node in equations.nodes),
        tuple((pattern, equations.kind_of.count(k)) for k, pattern in enumerate(of_nodes)),
        tuple((patterns, joints.count(k)) for k, patterns in enumerate(of_links)),
        tuple((numbers[link[0]], numbers[link[1]], link[2]) for link, _ in by_joint(equations)),
        equations.mixed,
        tuple(where_table(equations).tolist()),
    )
    return _plan(network, fill)


def _node_pattern(node: Node) -> Pattern:
    """Return the pattern of shift M - J of one node; J contains d(M F)/dy for arbitrary rates F."""
    turned = turned_masses(node, [sp.Dummy(real=True) for _ in node.state])
    return tuple(sorted({*block_pattern(node.jacobian()), *block_pattern(added_masses(node)), *block_pattern(turned)}))


def _link_patterns(edge: Edge) -> tuple[Pattern, Pattern]:
    """Return the patterns of shift M - J of one link: derivatives by the states of the target, then of the source."""
    rates = [sp.Dummy(real=True) for _ in (*edge.here, *edge.there)]
    turned = momentum_slopes(edge, rates[: len(edge.here)], rates[len(edge.here) :])
    here, there = set(block_pattern(edge.jacobian_here())), set(block_pattern(edge.jacobian_there()))
    for blocks in (edge.inertia, turned):
        for pattern, block in zip((here, there), blocks, strict=False):
            pattern.update(block_pattern(block))
    return tuple(sorted(here)), tuple(sorted(there))


@lru_cache(maxsize=4)
def _plan(network: _NetworkPattern, fill: float) -> SparsePlan:
    n, size, where = network.n, network.size, np.array(network.where, np.int64)
    # states (size, n): index of each state in the whole state; -1 if a node has fewer states
    states = where[: size * n].reshape(size, n) if network.mixed else np.arange(n * size).reshape(size, n)
    dimension = int((states >= 0).sum())
    # the blocks of nodes, and the blocks of links: derivatives by the target, by the source
    nodes, (target, source) = np.arange(n), (np.array([link[k] for link in network.links], np.int64) for k in (0, 1))
    counts = [count for _, count in network.joints]
    blocks = [
        _Blocks.of(states, nodes, nodes, [pattern for pattern, _ in network.kinds], [c for _, c in network.kinds])
    ]
    for k, end in enumerate((target, source)):
        blocks.append(_Blocks.of(states, target, end, [patterns[k] for patterns, _ in network.joints], counts))
    parts = [np.stack([rows, columns]) for each in blocks for *_, rows, columns in each.entries()]
    pattern = np.unique(np.concatenate(parts, axis=1), axis=1) if parts else np.zeros((2, 0), np.int64)
    # choose pivots; sort the off-diagonal entries of the factors by pivot of the row, then of the column
    pivots, entries, exact = _factors(dimension, pattern, fill)
    place = np.empty(dimension, np.int64)
    place[pivots] = np.arange(dimension)
    keys = np.unique(place[entries[0]] * dimension + place[entries[1]])
    starts = np.searchsorted(keys, np.arange(dimension + 1) * dimension)
    middles = np.searchsorted(keys, np.arange(dimension) * (dimension + 1))
    slots = [each.slots(place, keys) for each in blocks]
    arrays = (target, source, *slots, pivots, place, starts, middles, pivots[keys % dimension], where)
    weights = np.array([float(link[2]) for link in network.links])
    return SparsePlan(tuple(np.ascontiguousarray(a, np.int64) for a in arrays), weights, dimension + len(keys), exact)


@dataclass(frozen=True, slots=True)
class _Blocks:
    """The positions of many blocks in the matrix: blocks of nodes, or of one end of links."""

    # states (size, n): index of each state in the whole state. rows, columns (blocks,): the nodes whose states are the
    # rows and columns of each block. parts: ranges of blocks with the same pattern.

    states: np.ndarray
    rows: np.ndarray
    columns: np.ndarray
    parts: tuple[tuple[Pattern, slice], ...]

    @classmethod
    def of(
        cls, states: np.ndarray, rows: np.ndarray, columns: np.ndarray, patterns: list[Pattern], counts: list[int]
    ) -> _Blocks:
        """Make the blocks; each pattern holds for `counts` consecutive blocks."""
        ranges = [slice(a, b) for a, b in pairwise(accumulate(counts, initial=0))]
        return cls(states, rows, columns, tuple(zip(patterns, ranges, strict=True)))

    def entries(self) -> Iterator[tuple[int, int, slice, np.ndarray, np.ndarray]]:
        """Yield each entry: row and column in the block, range of blocks, rows and columns in the matrix."""
        for pattern, part in self.parts:
            for a, b in pattern:
                yield a, b, part, self.states[a][self.rows[part]], self.states[b][self.columns[part]]

    def slots(self, place: np.ndarray, keys: np.ndarray) -> np.ndarray:
        """Return the slot of every entry in the matrix, -1 for zeros: (a*size + b)*blocks + number of the block."""
        size, dimension = len(self.states), len(place)
        table = np.full((size * size, len(self.rows)), -1, np.int64)
        for a, b, part, rows, columns in self.entries():
            # the matrix stores the diagonal first, by state, then the other entries, sorted by key
            off = dimension + np.searchsorted(keys, place[rows] * dimension + place[columns])
            table[a * size + b, part] = np.where(rows == columns, rows, off)
        return table.reshape(-1)


def _factors(dimension: int, pattern: np.ndarray, fill: float) -> tuple[np.ndarray, np.ndarray, bool]:
    """Return pivots, off-diagonal entries (2, count) of the factors, and True if the factors are exact."""
    off = pattern[:, pattern[0] != pattern[1]]
    if not off.size:
        return np.arange(dimension), off, True
    steps = order(dimension, list(zip(*pattern.tolist(), strict=True)), fill * (dimension + off.shape[1]) - dimension)
    if steps is not None:
        lower = [(r, k) for k, below in zip(steps.order, steps.below, strict=True) for r in below]
        upper = [(k, c) for k, after in zip(steps.order, steps.after, strict=True) for c in after]
        return np.array(steps.order, np.int64), np.array([*lower, *upper], np.int64).reshape(-1, 2).T, True
    # too much fill: take rows without a diagonal entry of J first, then all other rows in their order
    pivots = np.argsort(np.isin(np.arange(dimension), pattern[0, pattern[0] == pattern[1]]), kind="stable")
    return pivots, _first_level(dimension, off, pivots), False


def _first_level(dimension: int, off: np.ndarray, pivots: np.ndarray) -> np.ndarray:
    """Return the pattern with first-level fill: entries (r, k) and (k, c), pivot k before r and c, add (r, c)."""
    place = np.empty(dimension, np.int64)
    place[pivots] = np.arange(dimension)
    rows, columns = place[off]
    below, after = rows > columns, rows < columns
    down = np.argsort(columns[below], kind="stable")
    lower = np.stack([rows[below][down], columns[below][down]])  # by pivot
    right = np.argsort(rows[after], kind="stable")
    upper = np.stack([rows[after][right], columns[after][right]])
    # pair each entry (r, k) below with each entry (k, c) after: `left` repeats (r, k), `offset` counts (k, c)
    start = np.searchsorted(upper[0], np.arange(dimension + 1))
    counts = (start[1:] - start[:-1])[lower[1]]
    left = np.repeat(np.arange(lower.shape[1]), counts)
    offset = np.arange(len(left)) - np.repeat(np.cumsum(counts) - counts, counts)
    fill = np.stack([lower[0][left], upper[1][start[lower[1][left]] + offset]])
    fill = fill[:, fill[0] != fill[1]]
    keys = np.unique(np.concatenate([rows * dimension + columns, fill[0] * dimension + fill[1]]))
    return pivots[np.stack(np.divmod(keys, dimension))]


def order(size: int, pattern: Collection[Entry], limit: float = np.inf) -> EliminationPlan | None:
    """Order pivots by least degree in the symmetrised pattern; rows without a diagonal entry of J come first."""
    # The cost is O(fill log n). Return None as soon as the factors have more off-diagonal entries than the limit.
    rows: list[set[int]] = [set() for _ in range(size)]
    columns: list[set[int]] = [set() for _ in range(size)]
    on_diagonal, count = set[int](), 0
    for r, c in pattern:
        if r == c:
            on_diagonal.add(r)
        else:
            rows[r].add(c)
            columns[c].add(r)
            count += 1
    near = [rows[k] | columns[k] for k in range(size)]
    heap = [(k in on_diagonal, len(near[k]), k) for k in range(size)]
    heapq.heapify(heap)
    done, pivots, below, after = bytearray(size), [], [], []
    while heap:
        _, degree, k = heapq.heappop(heap)
        if done[k] or degree != len(near[k]):
            continue  # outdated degree; the heap also holds the current degree of this row
        done[k] = 1
        pivots.append(k)
        below.append(tuple(sorted(columns[k])))
        after.append(tuple(sorted(rows[k])))
        # each row with an entry in column k gains the entries of row k and loses entry k
        for r in columns[k]:
            count -= len(rows[r])
            rows[r] |= rows[k]
            rows[r].discard(r)
            count += len(rows[r])
            rows[r].discard(k)
            near[r] |= rows[k]
            near[r].discard(r)
        for c in rows[k]:
            columns[c].discard(k)
            columns[c] |= columns[k]
            columns[c].discard(c)
            near[c] |= columns[k]
            near[c].discard(c)
        if count > limit:
            return None
        for j in near[k]:
            near[j].discard(k)
            heapq.heappush(heap, (j in on_diagonal, len(near[j]), j))
        rows[k] = columns[k] = near[k] = set()
    return EliminationPlan(tuple(pivots), tuple(below), tuple(after))
