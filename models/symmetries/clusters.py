"""Cluster states of a small graph: clusters of nodes with equal states, and the equations of differences within them.

A symmetry of the graph maps solutions to solutions, so nodes in one orbit of a group of symmetries can
stay equal.  To first order, the differences within clusters obey linear equations that contain no other
variables.  In the coordinates x_i - x_first(cluster) these equations have rational coefficients and
separate into blocks, one for each set of intertwined clusters.  Because the row sums of G are zero, the
invariant partitions of G are the external equitable partitions.

Sources: Pecora, Sorrentino, Hagerstrom, Murphy & Roy, Nat. Commun. 5, 4079 (2014): clusters from
symmetries, blocks, isolated desynchronisation; Golubitsky & Stewart, Bull. Amer. Math. Soc. 43, 305
(2006): balanced partitions.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence, Set
from dataclasses import dataclass
from fractions import Fraction

from flint import fmpq_mat, fmpq_poly

from ..algebra.rationals import to_flint
from ..graphs.links import join, numbered
from ..graphs.readers import as_topology
from ..graphs.topology import Topology
from ..inputs.checks import typed_repr
from ..spectra.eigenvalue import ProofError
from .automorphisms import automorphisms
from .partitions import class_links

NODE_LIMIT = 64
"""Most nodes of a graph whose symmetries are searched, a choice."""

PARTITION_LIMIT = 5000
"""Most partitions in a list, a choice."""

Rows = tuple[tuple[Fraction, ...], ...]


@dataclass(frozen=True, slots=True)
class Block:
    """A set of differences that influence each other, and no differences outside the set."""

    clusters: tuple[int, ...]  # the intertwined clusters
    nodes: tuple[int, ...]  # for each of the b coordinates, the cluster that contains its nodes
    pairs: tuple[tuple[int, int], ...]  # coordinate k is x_i - x_j for ``pairs[k] = (i, j)``
    matrix: Rows  # b x b; replaces G in the variational equation


@dataclass(frozen=True, slots=True)
class Clusters:
    """A balanced partition.  The eigenvalues of the quotient and of all blocks together are those of G.

    Parameters
    ----------
    classes : tuple of int
        The cluster of each node; clusters are numbered by their first nodes.
    quotient : Topology
        The graph whose nodes are the clusters.
    blocks : tuple of Block
        The differences within clusters.
    """

    classes: tuple[int, ...]
    quotient: Topology
    blocks: tuple[Block, ...]

    @property
    def members(self) -> tuple[tuple[int, ...], ...]:
        """The nodes of each cluster, ascending."""
        return tuple(tuple(i for i, k in enumerate(self.classes) if k == c) for c in range(self.quotient.n))


def orbital_partitions(
    graph: Topology, limit: int = 20_000, partition_limit: int = PARTITION_LIMIT
) -> tuple[Clusters, ...]:
    """Return all partitions into orbits of groups of symmetries, the finest first.

    The orbits of one symmetry are its cycles.  The orbits of a group are the join of the orbits of its
    elements.

    Parameters
    ----------
    graph : Topology
        The graph.
    limit : int, optional
        Most automorphisms.
    partition_limit : int, optional
        Most partitions.

    Returns
    -------
    tuple of Clusters
        The partitions; the first is the finest, in which every cluster is a single node.

    Raises
    ------
    ValueError
        On more than NODE_LIMIT nodes, `limit` automorphisms or `partition_limit` partitions.
    """
    graph = as_topology("orbital_partitions", graph)
    if graph.n > NODE_LIMIT:
        raise ValueError(
            f"{graph.name}({graph.n}): expected at most {NODE_LIMIT} nodes to look for symmetries; describe single "
            "partitions with `clusters`"
        )
    # Start from the partitions into cycles of one symmetry; all orbital partitions are joins of these.  Close the set
    # under joins, in the order from fine to coarse.
    cycles = {join(graph.n, enumerate(g)) for g in automorphisms(graph, limit)}
    closed = {tuple(range(graph.n))}
    for partition in sorted(cycles, key=_fine_first):
        if partition not in closed:  # otherwise already made as a join
            closed |= {join(graph.n, [*_stars(partition), *_stars(other)]) for other in closed}
        if len(closed) > partition_limit:
            raise ValueError(
                f"{graph.name}({graph.n}) has more than {partition_limit} orbital partitions; describe single ones with "
                "`clusters`"
            )
    characteristic = _polynomial(graph.rows)
    return tuple(_described(graph, partition, characteristic) for partition in sorted(closed, key=_fine_first))


def clusters(graph: Topology, classes: Sequence[int]) -> Clusters:
    """Return the cluster state of any balanced partition, with or without symmetry.

    Parameters
    ----------
    graph : Topology
        The graph.
    classes : sequence
        The cluster of each node.

    Returns
    -------
    Clusters

    Raises
    ------
    ValueError
        If the partition is not balanced, or does not give one cluster for each node.
    TypeError
        If `classes` is no sequence.
    """
    graph = as_topology("clusters", graph)
    if not isinstance(classes, Collection) or isinstance(classes, Set | Mapping):
        raise TypeError(f"partition: found {typed_repr(classes)}; expected the cluster of each node, e.g. [0, 0, 1]")
    if len(classes) != graph.n:
        raise ValueError(f"partition: found {len(classes)} classes for {graph.n} nodes; expected one for each node")
    return _described(graph, numbered(classes), _polynomial(graph.rows))


def _described(graph: Topology, classes: tuple[int, ...], characteristic: fmpq_poly) -> Clusters:
    """Compute quotient and blocks of a balanced partition and check them against det(x - G)."""
    quotient = Topology(f"{graph.name} quotient", max(classes) + 1, class_links(graph.n, graph.links, classes))
    state = Clusters(classes, quotient, _blocks(graph, classes))
    check(state, graph, characteristic)
    return state


def check(state: Clusters, graph: Topology, characteristic: fmpq_poly) -> None:
    """Raise ProofError unless the characteristic polynomials of quotient and blocks multiply to that of G."""
    product = _polynomial(state.quotient.rows)
    for block in state.blocks:
        product *= _polynomial(block.matrix)
    if product != characteristic:
        raise ProofError(
            f"clusters {state.classes} of {graph.name}({graph.n}): quotient and blocks multiply out to {product}; "
            f"expected the characteristic polynomial {characteristic}"
        )


def _blocks(graph: Topology, classes: tuple[int, ...]) -> tuple[Block, ...]:
    """Separate the differences from the first nodes of clusters into blocks."""
    # Coordinates y_k = x_i - x_j, where j is the first node of the cluster of i: y = T x.  The embedding L sets
    # x_i = y_k, and 0 on first nodes.  Then y' = T G L y, because the partition is balanced and the common motion of
    # a cluster drops out (Pecora et al. 2014, the lower right block of T G T^-1).
    first = _first_members(classes)
    pairs = [(i, first[k]) for i, k in enumerate(classes) if i != first[k]]
    rows = graph.rows
    matrix = [[rows[i][column] - rows[j][column] for column, _ in pairs] for i, j in pairs]

    # Clusters are intertwined, and share a block, if the rates of one's differences contain the other's differences.
    cluster_of = [classes[i] for i, _ in pairs]
    coupled = [(cluster_of[a], cluster_of[b]) for a, row in enumerate(matrix) for b, entry in enumerate(row) if entry]
    group = join(max(classes) + 1, coupled)
    blocks = []
    for part in sorted({group[k] for k in cluster_of}):
        members = [a for a, k in enumerate(cluster_of) if group[k] == part]
        nodes = tuple(cluster_of[a] for a in members)
        block = tuple(tuple(matrix[a][b] for b in members) for a in members)
        blocks.append(Block(tuple(sorted(set(nodes))), nodes, tuple(pairs[a] for a in members), block))
    return tuple(blocks)


def _first_members(classes: tuple[int, ...]) -> dict[int, int]:
    return {k: i for i, k in reversed(list(enumerate(classes)))}


def _stars(classes: tuple[int, ...]) -> list[tuple[int, int]]:
    """Pair each node with the first node of its class; the join of the pairs is the partition."""
    first = _first_members(classes)
    return [(i, first[k]) for i, k in enumerate(classes)]


def _fine_first(classes: tuple[int, ...]) -> tuple[int, tuple[int, ...]]:
    return -max(classes), classes


def _polynomial(rows: Rows) -> fmpq_poly:
    return fmpq_mat([[to_flint(x) for x in row] for row in rows]).charpoly()
