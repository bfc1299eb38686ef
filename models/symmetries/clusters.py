"""Cluster states of a small graph: nodes that can move as one, and the equations of their differences.

A symmetry of the graph maps solutions to solutions: the nodes of an orbit of a group of symmetries
may stay equal.  The differences within the clusters obey a linear equation among themselves.  With
x_i - x_first(cluster) as coordinates it is rational, and it falls into blocks, one for each set of
intertwined clusters.  The row sums of G are zero, so the partitions that G leaves invariant are the
external equitable ones.

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
"""Largest graph with a search for symmetries, a choice."""

PARTITION_LIMIT = 5000
"""Most partitions that are listed, a choice."""

Rows = tuple[tuple[Fraction, ...], ...]


@dataclass(frozen=True, slots=True)
class Block:
    """Differences that influence each other and no others."""

    clusters: tuple[int, ...]  # the intertwined clusters
    nodes: tuple[int, ...]  # the cluster on whose orbit each of the b coordinates lives
    pairs: tuple[tuple[int, int], ...]  # coordinate k is x_i - x_j for ``pairs[k] = (i, j)``
    matrix: Rows  # b x b; takes the place of G in the variational equation


@dataclass(frozen=True, slots=True)
class Clusters:
    """A balanced partition.  The eigenvalues of quotient and blocks are together those of G.

    Parameters
    ----------
    classes : tuple of int
        The cluster of each node; clusters are numbered by their first nodes.
    quotient : Topology
        The network of the clusters.
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
    """Return all partitions into orbits of groups of symmetries, from single nodes upwards.

    The orbits of one symmetry are its cycles; those of a group are the join of the orbits of its
    elements.

    Parameters
    ----------
    graph : Topology
        The graph.
    limit : int, optional
        Greatest number of automorphisms.
    partition_limit : int, optional
        Greatest number of partitions.

    Returns
    -------
    tuple of Clusters
        The finest one, of single nodes, first.

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
    # Partitions into cycles of one symmetry; all others are joins of these.  Close them under joins, the finest first.
    cycles = {join(graph.n, enumerate(g)) for g in automorphisms(graph, limit)}
    closed = {tuple(range(graph.n))}
    for partition in sorted(cycles, key=_fine_first):
        if partition not in closed:  # else a join of finer ones
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
        If the partition is not balanced, or has not one class for each node.
    TypeError
        If it is no sequence.
    """
    graph = as_topology("clusters", graph)
    if not isinstance(classes, Collection) or isinstance(classes, Set | Mapping):
        raise TypeError(f"partition: found {typed_repr(classes)}; expected the cluster of each node, e.g. [0, 0, 1]")
    if len(classes) != graph.n:
        raise ValueError(f"partition: found {len(classes)} classes for {graph.n} nodes; expected one for each node")
    return _described(graph, numbered(classes), _polynomial(graph.rows))


def _described(graph: Topology, classes: tuple[int, ...], characteristic: fmpq_poly) -> Clusters:
    """Return quotient and blocks of a balanced partition, checked against det(x - G)."""
    quotient = Topology(f"{graph.name} quotient", max(classes) + 1, class_links(graph.n, graph.links, classes))
    state = Clusters(classes, quotient, _blocks(graph, classes))
    check(state, graph, characteristic)
    return state


def check(state: Clusters, graph: Topology, characteristic: fmpq_poly) -> None:
    """Raise ProofError if quotient and blocks do not multiply out to the polynomial of G."""
    product = _polynomial(state.quotient.rows)
    for block in state.blocks:
        product *= _polynomial(block.matrix)
    if product != characteristic:
        raise ProofError(
            f"clusters {state.classes} of {graph.name}({graph.n}): quotient and blocks multiply out to {product}; "
            f"expected the characteristic polynomial {characteristic}"
        )


def _blocks(graph: Topology, classes: tuple[int, ...]) -> tuple[Block, ...]:
    """Return the blocks of the differences from the first nodes of clusters."""
    # Coordinates y_k = x_i - x_j, j the first node of the cluster of i.  With T the matrix of these differences and L
    # the embedding x_i = y_k (0 on first nodes), the rates are T G L y: the partition is balanced, so the
    # common part of a cluster drops out (Pecora et al. 2014, the lower right block of T G T^-1).
    first = _first_members(classes)
    pairs = [(i, first[k]) for i, k in enumerate(classes) if i != first[k]]
    rows = graph.rows
    matrix = [[rows[i][column] - rows[j][column] for column, _ in pairs] for i, j in pairs]

    # Clusters whose differences enter each other's rates are intertwined and share a block.
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
    """Return each node with the first of its class: the pairs whose join is the partition."""
    first = _first_members(classes)
    return [(i, first[k]) for i, k in enumerate(classes)]


def _fine_first(classes: tuple[int, ...]) -> tuple[int, tuple[int, ...]]:
    return -max(classes), classes


def _polynomial(rows: Rows) -> fmpq_poly:
    return fmpq_mat([[to_flint(x) for x in row] for row in rows]).charpoly()
