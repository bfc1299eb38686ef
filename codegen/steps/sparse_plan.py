"""The elimination of a large network as integer arrays that a few small loops run through.

Chains, rings, stars and trees have an elimination without or almost without fill: it is exact, and its cost grows with the
number of links.  Where the fill of the exact elimination exceeds FILL_LIMIT (large grids, random graphs: it grows faster
than the network), the factors keep no more than the first level of fill (J. A. Meijerink, H. A. van der Vorst, Math.
Comput. 31, 148, 1977; levels: Y. Saad, Iterative Methods for Sparse Linear Systems, SIAM, 2003, section 10.3.3), and the
kernel refines every solution to rounding.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import accumulate, pairwise

import numpy as np
import sympy as sp

from synchain.models.dynamics.equations import Equations
from synchain.models.graphs.links import Link
from synchain.models.mechanics.components import Edge, Node

from .elimination import EliminationPlan, Entry
from .fields import link_sums, mean_fields
from .mass_solve import added_masses, momentum_slopes, turned_masses
from .places import by_joint, by_kind, joint_numbers, link_table, places, table
from .step import StepWriter

FILL_LIMIT = 3.0
"""Entries of the exact factors for each entry of the matrix, above which the elimination is incomplete."""

Pattern = tuple[Entry, ...]


@dataclass(frozen=True, slots=True)
class SparsePlan:
    """Integer arrays in the order of NAMES, weights of the links, the number of matrix entries, exact or incomplete.

    target, source (links,): ends of each link.  node_slot (components**2 * n,), here_slot, there_slot
    (components**2 * links,): where the entries of the node's block and of a link's two blocks stand in the matrix, -1 where
    there is none; where nodes are of several kinds, components are those of the node that has most, nodes and links are
    numbered as codegen/steps/places.py says, and `where` is its table, also of links that differ in a parameter.
    order (dimension,): pivots; place (dimension,): its inverse.  The off-diagonal entries of pivot order[q] are row_start[q] … row_start[q + 1] - 1, those from after_start[q]
    on belong to later pivots; column: of each entry.
    """

    arrays: tuple[np.ndarray, ...]
    weights: np.ndarray
    entries: int
    exact: bool


def block_pattern(block: Iterable[Iterable[object]]) -> tuple[Entry, ...]:
    """Row and column of the non-zero entries of a small block."""
    return tuple((a, b) for a, row in enumerate(block) for b, e in enumerate(row) if e != 0)


def program(equations: Equations, fill: float = FILL_LIMIT, solves: bool = True) -> SparsePlan:
    """Plan the elimination of (s - J) for a network; time and memory grow with its links.

    Equations that differ only in what their symbols are called, or in numbers, share the program.  The factors are exact
    unless they would have more than `fill` entries for each entry of the matrix.  A method that `solves` nothing has a
    matrix without entries.
    """
    size = max(len(node.state) for node in equations.nodes)
    edges = [edge for layer in equations.listed for _, edge in layer.edge_of]
    own = tuple(_node_pattern(node) if solves else () for node in equations.nodes)
    joined = tuple(
        tuple(tuple(sorted(pattern)) if solves else () for pattern in _link_patterns(edge)) for edge in edges
    )
    where = tuple(table(equations).tolist()) if equations.mixed else ()
    numbers = {i: k for k, i in enumerate(by_kind(equations))}
    links = tuple((numbers[target], numbers[source], weight) for target, source, weight in by_joint(equations))
    counts = tuple(map(equations.kind_of.count, range(len(own))))
    shares = tuple(map(joint_numbers(equations).count, range(len(joined))))
    found = _program(equations.n, size, own, joined, links, fill, counts, shares, where)
    if not equations.numbered:
        return found
    *arrays, places = found.arrays
    return replace(found, arrays=(*arrays, np.concatenate([places, link_table(equations)])))


def _node_pattern(node: Node) -> Pattern:
    """Where a node has entries of shift M - J."""
    turned = turned_masses(node, [sp.Dummy(real=True) for _ in node.state])
    return tuple(sorted({*block_pattern(node.jacobian()), *block_pattern(added_masses(node)), *block_pattern(turned)}))


def _link_patterns(edge: Edge) -> tuple[set[Entry], set[Entry]]:
    """Where a link has entries of shift M - J, by its target and by its source."""
    here, there = set(block_pattern(edge.jacobian_here())), set(block_pattern(edge.jacobian_there()))
    rates = [sp.Dummy(real=True) for _ in (*edge.here, *edge.there)]
    turned = momentum_slopes(edge, rates[: len(edge.here)], rates[len(edge.here) :])
    for blocks in (edge.inertia, turned):
        for pattern, block in zip((here, there), blocks, strict=False):
            pattern.update(block_pattern(block))
    return here, there


@lru_cache(maxsize=4)
def _program(
    n: int,
    size: int,
    own: tuple[Pattern, ...],
    joined: tuple[tuple[Pattern, Pattern], ...],
    links: tuple[Link, ...],
    fill: float,
    counts: tuple[int, ...],
    shares: tuple[int, ...],
    where: tuple[int, ...],
) -> SparsePlan:
    """The program of a network of `counts` nodes of each kind and `shares` links of each joint."""
    stands = np.array(where, np.int64).reshape(-1, n)[:size] if where else np.arange(n * size).reshape(size, n)
    dimension = int((stands >= 0).sum())
    nodes, (target, source) = np.arange(n), (np.array([link[side] for link in links], np.int64) for side in (0, 1))
    alike = _Blocks(stands, nodes, nodes, own, _spans(counts))
    spans = _spans(shares)
    ends = [
        _Blocks(stands, target, end, tuple(pair[k] for pair in joined), spans) for k, end in enumerate((target, source))
    ]
    parts = [part for blocks in (alike, *ends) for part in blocks.entries()]
    pattern = np.unique(np.concatenate(parts, axis=1), axis=1) if parts else np.zeros((2, 0), np.int64)
    pivots, entries, exact = _factors(dimension, pattern, fill)
    place = np.empty(dimension, np.int64)
    place[pivots] = np.arange(dimension)
    keys = np.unique(place[entries[0]] * dimension + place[entries[1]])
    columns = keys % dimension
    starts = np.searchsorted(keys, np.arange(dimension + 1) * dimension)
    middles = np.searchsorted(keys, np.arange(dimension) * (dimension + 1))
    slots = [blocks.slots(place, keys) for blocks in (alike, *ends)]
    arrays = (target, source, *slots, pivots, place, starts, middles, pivots[columns], where)
    weights = np.array([float(link[2]) for link in links])
    return SparsePlan(tuple(np.ascontiguousarray(a, np.int64) for a in arrays), weights, dimension + len(keys), exact)


@dataclass(frozen=True, slots=True)
class _Blocks:
    """The blocks of nodes, or of one end of links: rows and columns by node, a pattern for each of some spans of them.

    where (most states of a node, nodes): the place of a state in the whole state.
    """

    where: np.ndarray
    rows: np.ndarray
    columns: np.ndarray
    patterns: tuple[Pattern, ...]
    spans: tuple[slice, ...]

    def entries(self) -> Iterator[np.ndarray]:
        """Rows and columns (2, count) of the entries, one place in the pattern after another."""
        for pattern, span in zip(self.patterns, self.spans, strict=False):
            for a, b in pattern:
                yield np.stack([self.where[a][self.rows[span]], self.where[b][self.columns[span]]])

    def slots(self, place: np.ndarray, keys: np.ndarray) -> np.ndarray:
        """Slots of every block entry: (a * size + b) * count + number of the node or link."""
        size, dimension = len(self.where), len(place)
        table = np.full((size * size, len(self.rows)), -1, np.int64)
        for pattern, span in zip(self.patterns, self.spans, strict=False):
            for a, b in pattern:
                rows, columns = self.where[a][self.rows[span]], self.where[b][self.columns[span]]
                found = dimension + np.searchsorted(keys, place[rows] * dimension + place[columns])
                table[a * size + b, span] = np.where(rows == columns, rows, found)
        return table.reshape(-1)


def _spans(counts: Sequence[int]) -> tuple[slice, ...]:
    """Parts of a numbering of these lengths, one after another."""
    ends = list(accumulate(counts, initial=0))
    return tuple(slice(a, b) for a, b in pairwise(ends))


def _factors(dimension: int, pattern: np.ndarray, fill: float) -> tuple[np.ndarray, np.ndarray, bool]:
    """Pivots, off-diagonal entries (2, count) of the factors, and whether they are exact."""
    off = pattern[:, pattern[0] != pattern[1]]
    if not off.size:
        return np.arange(dimension), off, True
    rows, columns = off.tolist()
    listed = set(pattern[0, pattern[0] == pattern[1]].tolist())
    found = _eliminate_all(dimension, rows, columns, listed, fill * (dimension + len(rows)) - dimension)
    if found is not None:
        steps = found
        lower = [(r, k) for k, below in zip(steps.order, steps.below, strict=True) for r in below]
        upper = [(k, c) for k, after in zip(steps.order, steps.after, strict=True) for c in after]
        return np.array(steps.order, np.int64), np.array([*lower, *upper], np.int64).reshape(-1, 2).T, True
    late = np.isin(np.arange(dimension), list(listed))
    pivots = np.argsort(late, kind="stable")
    return pivots, _first_level(dimension, off, pivots), False


def _first_level(dimension: int, off: np.ndarray, pivots: np.ndarray) -> np.ndarray:
    """The pattern with the fill that its own entries cause: (r, k) and (k, c) with pivot k before both make (r, c)."""
    place = np.empty(dimension, np.int64)
    place[pivots] = np.arange(dimension)
    rows, columns = place[off]
    below, after = rows > columns, rows < columns
    down = np.argsort(columns[below], kind="stable")
    lower = np.stack([rows[below][down], columns[below][down]])  # by pivot
    right = np.argsort(rows[after], kind="stable")
    upper = np.stack([rows[after][right], columns[after][right]])
    start = np.searchsorted(upper[0], np.arange(dimension + 1))
    counts = (start[1:] - start[:-1])[lower[1]]
    which = np.repeat(np.arange(lower.shape[1]), counts)
    offset = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
    fill = np.stack([lower[0][which], upper[1][start[lower[1][which]] + offset]])
    fill = fill[:, fill[0] != fill[1]]
    keys = np.unique(np.concatenate([rows * dimension + columns, fill[0] * dimension + fill[1]]))
    return pivots[np.stack(np.divmod(keys, dimension))]


def order(size: int, pattern: set[Entry]) -> EliminationPlan:
    """Pivots by least degree in the symmetrised pattern, rows without a diagonal entry of J first; O(fill log n)."""
    off = [(r, c) for r, c in sorted(pattern) if r != c]
    found = _eliminate_all(size, [r for r, _ in off], [c for _, c in off], {r for r, c in pattern if r == c}, np.inf)
    if found is None:
        raise RuntimeError("an elimination without a limit of fill was given up; this is a mistake in the program")
    return found


def _eliminate_all(
    size: int, row_of: list[int], column_of: list[int], listed: set[int], limit: float
) -> EliminationPlan | None:
    """The exact elimination, None as soon as its off-diagonal entries exceed the limit."""
    rows: list[set[int]] = [set() for _ in range(size)]
    columns: list[set[int]] = [set() for _ in range(size)]
    for r, c in zip(row_of, column_of, strict=True):
        rows[r].add(c)
        columns[c].add(r)
    near = [rows[k] | columns[k] for k in range(size)]
    heap = [(k in listed, len(near[k]), k) for k in range(size)]
    heapq.heapify(heap)
    done, found, below, after, count = bytearray(size), [], [], [], len(row_of)
    while heap:
        _, degree, k = heapq.heappop(heap)
        if done[k] or degree != len(near[k]):
            continue  # an outdated entry: the current one is in the heap as well
        done[k] = 1
        found.append(k)
        below.append(tuple(sorted(columns[k])))
        after.append(tuple(sorted(rows[k])))
        count += _eliminate(k, rows, columns, near)
        if count > limit:
            return None
        for j in near[k]:
            heapq.heappush(heap, (j in listed, len(near[j]), j))
        rows[k] = columns[k] = near[k] = set()
    return EliminationPlan(tuple(found), tuple(below), tuple(after))


def _eliminate(k: int, rows: list[set[int]], columns: list[set[int]], near: list[set[int]]) -> int:
    """Take pivot k out of the pattern, add the fill that it causes and return how much that is."""
    fill = 0
    for r in columns[k]:
        fill -= len(rows[r])
        rows[r] |= rows[k]
        rows[r].discard(r)
        fill += len(rows[r])
        rows[r].discard(k)
        near[r] |= rows[k]
        near[r].discard(r)
    for c in rows[k]:
        columns[c].discard(k)
        columns[c] |= columns[k]
        columns[c].discard(c)
        near[c] |= columns[k]
        near[c].discard(c)
    for j in near[k]:
        near[j].discard(k)
    return fill


def workspace(w: StepWriter, elimination: SparsePlan) -> int:
    """Groups of scratch memory: stages, stage state, slopes, time slopes and, for implicit methods, the matrix.

    Factors of an incomplete elimination stand beside the matrix, exact ones replace it.  Where M is not the
    identity, an implicit method keeps it too, and the rates at the start if M depends on the state.  A mean field keeps what nodes are as sources, links that
    are summed by nodes their sums too.
    """
    vectors = (len(w.method.c) + 3) * w.equations.dimension
    vectors += sum(len(field.alike) for field in mean_fields(w.equations)) * w.equations.n
    if not w.method.implicit:
        vectors += sum(links.kept for links in link_sums(w.equations, places(w.equations).joints)[0]) * w.equations.n
    if not w.method.implicit and not w.equations.inertial:
        return vectors
    matrix = elimination.entries if elimination.exact else 2 * elimination.entries
    if not w.method.implicit or not w.equations.inertial:
        return vectors + matrix
    return vectors + 2 * matrix + (0 if w.equations.constant_mass else w.equations.dimension)
