"""Cluster states of a small graph: clusters of nodes with equal states, and the equations of differences within them.

A symmetry of the graph maps solutions to solutions, so nodes in one orbit of a group of symmetries can
stay equal.  To first order, the differences within clusters obey linear equations that contain no other
variables.  These equations separate into the finest blocks that the matrices of all layers and the
projectors on the clusters leave invariant (`blocks`).  Because the row sums of G are zero, the invariant
partitions of G are the external equitable partitions.

Sources: Pecora, Sorrentino, Hagerstrom, Murphy & Roy, Nat. Commun. 5, 4079 (2014): clusters from
symmetries, blocks, isolated desynchronisation; Golubitsky & Stewart, Bull. Amer. Math. Soc. 43, 305
(2006): balanced partitions; Zhang & Motter, SIAM Rev. 62, 817 (2020), and Zhang, Latora & Motter, Commun.
Phys. 4, 195 (2021): finest blocks without symmetries, several layers.
"""

from __future__ import annotations

from collections.abc import Collection, Hashable, Mapping, Sequence, Set
from dataclasses import dataclass
from functools import lru_cache

from flint import fmpq, fmpq_mat

from ..algebra.rationals import to_flint
from ..graphs.links import join, numbered
from ..graphs.readers import as_topology
from ..graphs.topology import Topology
from ..inputs.checks import typed_repr
from .automorphisms import automorphisms
from .irreducible import Generator, Rows, irreducible_subspaces
from .partitions import class_links

NODE_LIMIT = 64  # most nodes of a graph whose symmetries are searched, a choice
PARTITION_LIMIT = 5000  # most partitions in a list, a choice
Graphs = Topology | Sequence[Topology]  # a graph, or the graphs of several layers of links on the same nodes


@dataclass(frozen=True, slots=True)
class Block:
    """A set of differences that influence each other, and no differences outside the set."""

    cluster_of: tuple[int, ...]  # for each of the b coordinates, the cluster whose nodes differ
    nodes: tuple[int, ...]  # the nodes that differ in any set with these equations, ascending
    matrices: tuple[Rows, ...]  # for each layer b x b exact numbers; they replace G in the variational equation
    multiplicity: int = 1  # number of sets of differences with these equations

    @property
    def clusters(self) -> tuple[int, ...]:
        """The intertwined clusters."""
        return tuple(sorted(set(self.cluster_of)))


@dataclass(frozen=True, slots=True)
class Clusters:
    """A partition that is balanced in every layer.

    With a single layer, the eigenvalues of the quotient and of all blocks, each as often as its multiplicity, are those
    of G.

    Parameters
    ----------
    classes : tuple of int
        The cluster of each node; clusters are numbered by their first nodes.
    graphs : tuple of Topology
        The graph of each layer.

    See Also
    --------
    synchain.graphs.clusters
    synchain.graphs.orbital_partitions
    synchain.cluster_exponents

    Examples
    --------
    >>> import synchain as sc
    >>> found = sc.graphs.clusters(sc.graphs.star(4), [0, 1, 1, 1])
    >>> found.classes
    (0, 1, 1, 1)
    """

    classes: tuple[int, ...]
    graphs: tuple[Topology, ...]

    def __post_init__(self) -> None:
        _ = self.quotients  # ValueError for a partition that is not balanced

    @property
    def quotients(self) -> tuple[Topology, ...]:
        """For each layer the graph whose nodes are the clusters."""
        count, classes = max(self.classes) + 1, self.classes
        links = (class_links(graph.n, graph.links, classes) for graph in self.graphs)
        return tuple(Topology(f"{g.name} quotient", count, own) for g, own in zip(self.graphs, links, strict=True))

    @property
    def blocks(self) -> tuple[Block, ...]:
        """The differences within clusters, in the finest blocks; computed on first use."""
        return _blocks(self.graphs, self.classes)

    @property
    def members(self) -> tuple[tuple[int, ...], ...]:
        """The nodes of each cluster, ascending."""
        return tuple(tuple(i for i, k in enumerate(self.classes) if k == c) for c in range(max(self.classes) + 1))


def orbital_partitions(
    graph: Graphs,
    limit: int = 20_000,
    partition_limit: int = PARTITION_LIMIT,
    kinds: Sequence[Hashable] | None = None,
) -> tuple[Clusters, ...]:
    """Return all partitions into orbits of groups of symmetries, the finest first.

    The orbits of one symmetry are its cycles.  The orbits of a group are the join of the orbits of its
    elements.

    Parameters
    ----------
    graph : Topology or sequence of Topology
        The graph, or the graphs of several layers; a symmetry preserves the weights of every layer.
    limit : int, optional
        Most automorphisms.
    partition_limit : int, optional
        Most partitions.
    kinds : sequence, optional
        The kind of each node, if nodes differ; a symmetry maps nodes to nodes of the same kind.

    Returns
    -------
    tuple of Clusters
        The partitions; the first is the finest, in which every cluster is a single node.

    Raises
    ------
    ValueError
        On more than NODE_LIMIT nodes, `limit` automorphisms or `partition_limit` partitions.

    See Also
    --------
    synchain.graphs.clusters
    synchain.cluster_exponents

    Examples
    --------
    >>> from synchain.graphs import orbital_partitions, ring, star
    >>> [state.classes for state in orbital_partitions([ring(4), star(4)])]
    [(0, 1, 2, 3), (0, 1, 2, 1)]
    """
    graphs = _layers("orbital_partitions", graph)
    first = graphs[0]
    if first.n > NODE_LIMIT:
        raise ValueError(
            f"{first.name}({first.n}): expected at most {NODE_LIMIT} nodes to look for symmetries; describe single "
            "partitions with `clusters`"
        )
    # Start from the partitions into cycles of one symmetry; all orbital partitions are joins of these.  Close the set
    # under joins, in the order from fine to coarse.
    cycles = {join(first.n, enumerate(g)) for g in automorphisms(graphs, limit, kinds=kinds)}
    closed = {tuple(range(first.n))}
    for partition in sorted(cycles, key=_fine_first):
        if partition not in closed:  # otherwise already made as a join
            closed |= {join(first.n, [*_stars(partition), *_stars(other)]) for other in closed}
        if len(closed) > partition_limit:
            raise ValueError(
                f"{first.name}({first.n}) has more than {partition_limit} orbital partitions; describe single ones with "
                "`clusters`"
            )
    return tuple(Clusters(partition, graphs) for partition in sorted(closed, key=_fine_first))


def clusters(graph: Graphs, classes: Sequence[int]) -> Clusters:
    """Return the cluster state of any balanced partition, with or without symmetry.

    Parameters
    ----------
    graph : Topology or sequence of Topology
        The graph, or the graphs of several layers of links.
    classes : sequence
        The cluster of each node.

    Returns
    -------
    Clusters

    Raises
    ------
    ValueError
        If the partition is not balanced in every layer, or does not give one cluster for each node.
    TypeError
        If `classes` is no sequence.

    See Also
    --------
    synchain.graphs.orbital_partitions
    synchain.graphs.Clusters
    synchain.cluster_exponents
    synchain.transition

    Examples
    --------
    Two layers that do not commute: the differences of all nodes separate into blocks of one and two.

    >>> from synchain.graphs import clusters, ring, star
    >>> [(len(block.cluster_of), block.multiplicity) for block in clusters([ring(4), star(4)], [0] * 4).blocks]
    [(1, 1), (2, 1)]
    """
    graphs = _layers("clusters", graph)
    n = graphs[0].n
    if not isinstance(classes, Collection) or isinstance(classes, Set | Mapping):
        raise TypeError(f"partition: found {typed_repr(classes)}; expected the cluster of each node, e.g. [0, 0, 1]")
    if len(classes) != n:
        raise ValueError(f"partition: found {len(classes)} classes for {n} nodes; expected one for each node")
    return Clusters(numbered(classes), graphs)


def _layers(what: str, value: object) -> tuple[Topology, ...]:
    """Return the graphs of all layers, which have the same number of nodes."""
    several = isinstance(value, Sequence) and all(isinstance(graph, Topology) for graph in value)
    graphs = tuple(value) if several and isinstance(value, Sequence) else (as_topology(what, value),)
    sizes = sorted({graph.n for graph in graphs})
    if len(sizes) != 1:
        found = " and ".join(map(str, sizes)) or "no"
        raise ValueError(f"{what}: found graphs of {found} nodes; expected graphs on the same nodes")
    return graphs


@lru_cache(maxsize=256)
def _blocks(graphs: tuple[Topology, ...], classes: tuple[int, ...]) -> tuple[Block, ...]:
    """Separate the differences within clusters into the finest blocks."""
    # Coordinates y_k = x_i minus the mean of the cluster of i, for all nodes i but the first of each cluster.  These
    # vectors are orthogonal to all that is constant on clusters, so adjoint and transpose are the same.
    first = _first_members(classes)
    nodes = [i for i, k in enumerate(classes) if i != first[k]]
    if not nodes:
        return ()
    embed, sizes = fmpq_mat(len(classes), len(nodes)), [classes.count(k) for k in range(max(classes) + 1)]
    part = fmpq_mat(len(nodes), len(classes))
    for c, i in enumerate(nodes):
        embed[i, c], embed[first[classes[i]], c] = 1, -1
        for j, k in enumerate(classes):
            part[c, j] = fmpq(int(i == j)) - (fmpq(1, sizes[k]) if k == classes[i] else 0)
    layers = []
    for graph in graphs:
        g = fmpq_mat([[to_flint(x) for x in row] for row in graph.rows])
        layers.append(Generator(part * g * embed, part * g.transpose() * embed))
    of_nodes = [classes[i] for i in nodes]
    projectors = [
        fmpq_mat([[int(r == c and k == cluster) for c in range(len(nodes))] for r, k in enumerate(of_nodes)])
        for cluster in sorted(set(of_nodes))
    ]
    blocks = []
    for space in irreducible_subspaces(layers, projectors if len(projectors) > 1 else [], len(nodes)):
        # The first node of a cluster differs unless the others add up to zero in every vector.
        differing = {i for row in space.hull for i, x in zip(nodes, row, strict=True) if x}
        for cluster, i in first.items():
            inside = [c for c, k in enumerate(of_nodes) if k == cluster]
            differing |= {i} if any(sum(row[c] for c in inside) for row in space.hull) else set()
        cluster_of = tuple(of_nodes[pivot] for pivot in space.pivots)
        blocks.append(Block(cluster_of, tuple(sorted(differing)), space.matrices, space.multiplicity))
    return tuple(blocks)


def _first_members(classes: tuple[int, ...]) -> dict[int, int]:
    return {k: i for i, k in reversed(list(enumerate(classes)))}


def _stars(classes: tuple[int, ...]) -> list[tuple[int, int]]:
    """Pair each node with the first node of its class; the join of the pairs is the partition."""
    first = _first_members(classes)
    return [(i, first[k]) for i, k in enumerate(classes)]


def _fine_first(classes: tuple[int, ...]) -> tuple[int, tuple[int, ...]]:
    return -max(classes), classes
