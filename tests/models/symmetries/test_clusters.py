"""Symmetries and cluster states of small graphs: counts known by hand, brute force, exact blocks."""

from __future__ import annotations

from fractions import Fraction
from itertools import product

import networkx as nx
import numpy as np
import pytest

from synchain.models.graphs.families import topology
from synchain.models.graphs.topology import Topology, from_matrix
from synchain.models.symmetries.automorphisms import automorphisms
from synchain.models.symmetries.clusters import Block, clusters, orbital_partitions

ONE = Fraction(1)


def one_way_ring(n: int) -> Topology:
    return Topology("one-way ring", n, tuple((i, (i + 1) % n, ONE) for i in range(n)))


def of_networkx(graph: nx.Graph) -> Topology:
    return from_matrix(-nx.laplacian_matrix(graph).toarray().astype(int))


def directed(graph: Topology) -> nx.DiGraph:
    made = nx.DiGraph()
    made.add_nodes_from(range(graph.n))
    made.add_edges_from((source, target, {"weight": weight}) for target, source, weight in graph.links)
    return made


def random_graph(n: int, seed: int, one_way: bool) -> Topology:
    random = np.random.default_rng(seed)
    a = random.integers(0, 2, (n, n)) * (1 + (random.random((n, n)) < 0.2))
    a = np.triu(a, 1)
    a = a if one_way else a + a.T
    if one_way:
        a = a + (random.random((n, n)) < 0.3).T * np.tril(np.ones((n, n), int), -1)
    return from_matrix((a - np.diag(a.sum(axis=1))).tolist())


def canonical(classes) -> tuple[int, ...]:
    order: dict[int, int] = {}
    return tuple(order.setdefault(k, len(order)) for k in classes)


def orbits(n: int, generators) -> tuple[int, ...]:
    """By closing the set of images of each node."""
    label = list(range(n))
    for _ in range(n):
        for g in generators:
            for i in range(n):
                label[i] = label[g[i]] = min(label[i], label[g[i]])
    return canonical(label)


GRAPHS = [
    topology("chain", 5), topology("ring", 6), topology("complete", 5), topology("tree", 7), topology("hypercube", 8),
    one_way_ring(6), of_networkx(nx.petersen_graph()), of_networkx(nx.disjoint_union(nx.path_graph(2), nx.cycle_graph(3))),
    *(random_graph(n, seed, one_way) for n in (4, 5, 6) for seed in range(4) for one_way in (False, True)),
]  # fmt: skip


@pytest.mark.parametrize("graph", GRAPHS, ids=repr)
def test_automorphisms_are_those_that_networkx_finds(graph: Topology) -> None:
    group = automorphisms([graph])
    same = nx.isomorphism.DiGraphMatcher(
        directed(graph), directed(graph), edge_match=lambda a, b: a["weight"] == b["weight"]
    )
    expected = sorted(tuple(g[i] for i in range(graph.n)) for g in same.isomorphisms_iter())
    assert list(group) == expected
    assert group[0] == tuple(range(graph.n))


@pytest.mark.parametrize(
    ("graph", "count"),
    [
        (topology("chain", 3), 2),
        (topology("chain", 8), 2),
        (topology("star", 4), 5),  # partitions of three leaves
        (topology("star", 6), 52),  # of five: Bell number
        (topology("complete", 5), 52),
        (topology("ring", 4), 7),
        (topology("ring", 6), 13),
        (one_way_ring(4), 3),  # orbits of the rotations only: one for each divisor
        (one_way_ring(12), 6),
        (topology("tree", 3), 2),
        (topology("random_cubic", 30), 1),
    ],
    ids=repr,
)
def test_counts_known_by_hand(graph: Topology, count: int) -> None:
    partitions = orbital_partitions(graph)
    assert len(partitions) == count
    assert partitions[0].classes == tuple(range(graph.n))
    assert [len(c.members) for c in partitions] == sorted((len(c.members) for c in partitions), reverse=True)
    assert len({c.classes for c in partitions}) == count


@pytest.mark.parametrize(
    "graph", [topology("ring", 6), topology("star", 5), topology("complete", 4), one_way_ring(6)], ids=repr
)
def test_all_groups_of_symmetries_are_covered(graph: Topology) -> None:
    """All subgroups of these groups have three generators or fewer."""
    group = automorphisms([graph])
    expected = {orbits(graph.n, generators) for generators in product(group, repeat=3 if len(group) < 13 else 2)}
    if len(group) >= 13:
        expected |= {orbits(graph.n, [*pair, g]) for pair in product(group[:12], repeat=2) for g in group}
    assert {c.classes for c in orbital_partitions(graph)} == expected


def test_orbits_of_many_generators_are_joined() -> None:
    """The hypercube of 16 has partitions that are no join of two cycles: joined with further cycles all stay in the list."""
    graph = topology("hypercube", 16)
    names_found = {c.classes for c in orbital_partitions(graph)}
    group = automorphisms([graph])
    for classes in sorted(names_found)[::10]:
        last: dict[int, int] = {}
        turned = list(range(16))  # a permutation whose cycles are these classes
        for i, k in enumerate(classes):
            if k in last:
                turned[i], turned[last[k]] = turned[last[k]], i
            last[k] = i
        assert orbits(16, [turned]) == classes
        assert all(orbits(16, [turned, g]) in names_found for g in group[::7])


def floats(block: Block, layer: int = 0) -> np.ndarray:
    return np.array([[float(x) for x in row] for row in block.matrices[layer]])


def polynomial(state, layer: int = 0) -> np.ndarray:
    """Characteristic polynomial of quotient and blocks together."""
    product = np.poly(np.array(state.quotients[layer].rows, dtype=float))
    for block in state.blocks:
        for _ in range(block.multiplicity):
            product = np.polymul(product, np.poly(floats(block, layer)))
    return product


@pytest.mark.parametrize("graph", GRAPHS, ids=repr)
def test_quotient_and_blocks_have_the_eigenvalues_of_the_network(graph: Topology) -> None:
    expected = np.poly(np.array(graph.rows, dtype=float))
    for state in orbital_partitions(graph):
        assert polynomial(state) == pytest.approx(expected, rel=1e-8, abs=1e-6 * np.abs(expected).max())
        sizes = sum(len(b.cluster_of) * b.multiplicity for b in state.blocks)
        assert sizes == graph.n - state.quotients[0].n


@pytest.mark.parametrize("graph", [graph for graph in GRAPHS if graph.symmetric], ids=repr)
def test_one_cluster_of_an_undirected_graph_has_its_modes(graph: Topology) -> None:
    """A single matrix has blocks of one coordinate: its eigenvalues, each once."""
    blocks = clusters(graph, [0] * graph.n).blocks
    assert {len(b.cluster_of) for b in blocks} <= {1}
    expected = [(float(e), e.multiplicity) for e in graph.spectrum]
    expected[0] = (0.0, expected[0][1] - 1)
    found = sorted(((floats(b)[0, 0], b.multiplicity) for b in blocks), reverse=True)
    np.testing.assert_allclose(found, [pair for pair in expected if pair[1]], atol=1e-12)


def dimension_of_algebra(matrices: list[np.ndarray]) -> int:
    """Dimension of the algebra that matrices generate, by words until none is new."""
    words = [np.eye(len(matrices[0]))]
    basis = np.array([words[0].ravel()])
    while words:
        new = []
        for word in words:
            for m in matrices:
                product = m @ word
                product = product / max(np.abs(product).max(), 1e-300)
                if np.linalg.matrix_rank(np.vstack([basis, product.ravel()]), tol=1e-7) > len(basis):
                    basis = np.vstack([basis, product.ravel()])
                    new.append(product)
        words = new
    return len(basis)


LAYERS = {
    "ring and star": ([topology("ring", 4), topology("star", 4)], [0] * 4, [(1, 1), (2, 1)]),
    "ring and star of six": ([topology("ring", 6), topology("star", 6)], [0] * 6, [(1, 1), (1, 1), (3, 1)]),
    "commuting": ([topology("ring", 5), topology("complete", 5)], [0] * 5, [(1, 2), (1, 2)]),
    "cube and ring": ([topology("hypercube", 8), topology("ring", 8)], [0] * 8, None),
    "two clusters": ([topology("ring", 6), topology("complete", 6)], [0, 1, 0, 1, 0, 1], None),
    "hub apart": ([topology("ring", 8), topology("hypercube", 8)], [0, 1, 0, 1, 0, 1, 0, 1], None),
    "without symmetry": ([random_graph(6, 1, False), random_graph(6, 3, False)], [0] * 6, None),
    "one-way": ([one_way_ring(6), topology("complete", 6)], [0] * 6, [(1, 1), (2, 1), (2, 1)]),
}
"""Graphs, classes, and the sizes and multiplicities of the blocks where they are known by hand."""


@pytest.mark.parametrize("name", LAYERS)
def test_layers_have_the_finest_blocks(name: str) -> None:
    """The algebra of the blocks has the dimension Σ size², of the matrices themselves: no block is too large.

    For one-way rings a block is of complex type: 2 x 2 with an algebra of dimension 2.
    """
    graphs, classes, expected = LAYERS[name]
    state = clusters(graphs, classes)
    sizes = sorted((len(b.cluster_of), b.multiplicity) for b in state.blocks)
    assert expected is None or sizes == expected
    for layer, graph in enumerate(graphs):
        assert polynomial(state, layer) == pytest.approx(np.poly(np.array(graph.rows, dtype=float)), rel=1e-8, abs=1e-5)
    # The matrices of the differences, independent of the program: orthonormal vectors of zero sum in each cluster.
    rows = [np.array(graph.rows, dtype=float) for graph in graphs]
    means = np.array([[float(k == c) for k in classes] for c in range(max(classes) + 1)])
    away = np.linalg.svd(means)[2][len(means) :]
    inner = [away @ g @ away.T for g in rows]
    inner += [g.T for g in inner] + [away @ np.diag(row) @ away.T for row in means]
    total = sum(
        len(b.cluster_of) ** 2 // (2 if name == "one-way" and len(b.cluster_of) == 2 else 1) for b in state.blocks
    )
    assert dimension_of_algebra(inner) == total


@pytest.mark.parametrize("name", LAYERS)
def test_blocks_of_layers_go_together(name: str) -> None:
    """Traces of words in the layers: equal only if the matrices of one block belong to one subspace."""
    graphs, classes, _ = LAYERS[name]
    state = clusters(graphs, classes)
    for word in ([0, 1], [0, 1, 0], [1, 0, 0, 1], [0, 1, 1, 0, 1]):
        whole = np.linalg.multi_dot([np.array(graphs[k].rows, dtype=float) for k in [*word, word[0]]])
        lumped = np.linalg.multi_dot([np.array(state.quotients[k].rows, dtype=float) for k in [*word, word[0]]])
        inside = sum(
            b.multiplicity * np.trace(np.linalg.multi_dot([floats(b, k) for k in [*word, word[0]]]))
            for b in state.blocks
        )
        assert np.trace(lumped) + inside == pytest.approx(np.trace(whole), rel=1e-9, abs=1e-6)


def test_numbers_of_a_block_are_exact() -> None:
    """The ring of five has the eigenvalues (-5 ± √5)/2, as numbers of one field."""
    blocks = clusters(topology("ring", 5), [0] * 5).blocks
    values = [block.matrices[0][0][0] for block in blocks]
    assert [float(x) for x in values] == [(-5 - 5**0.5) / 2, (-5 + 5**0.5) / 2]
    (number,) = {x.root.polynomial for x in values}
    assert number == (5, 5, 1)


def test_symmetries_of_layers_preserve_all_of_them_and_the_kinds() -> None:
    ring, star = topology("ring", 6), topology("star", 6)
    assert automorphisms([ring, star]) == ((0, 1, 2, 3, 4, 5), (0, 5, 4, 3, 2, 1))
    assert automorphisms([ring], kinds=[0, 1, 1, 0, 1, 1]) == tuple(
        g for g in automorphisms([ring]) if {g[0], g[3]} == {0, 3}
    )
    states = orbital_partitions([ring, star])
    assert [state.classes for state in states] == [(0, 1, 2, 3, 4, 5), (0, 1, 2, 3, 2, 1)]
    with pytest.raises(ValueError, match="found graphs of 4 and 6 nodes"):
        orbital_partitions([ring, topology("star", 4)])
    with pytest.raises(ValueError, match="partition is not balanced"):
        clusters([ring, star], [0, 1, 0, 1, 0, 1])


def test_the_ends_of_a_chain_of_three() -> None:
    _, state = orbital_partitions(topology("chain", 3))
    assert (state.classes, state.members) == ((0, 1, 0), ((0, 2), (1,)))
    assert state.quotients[0].rows == ((-1, 1), (2, -2))
    assert state.blocks == (Block((0,), (0, 2), (((-1,),),), 1),)


def test_mirrored_pairs_of_a_ring_are_intertwined_and_pairs_of_leaves_are_not() -> None:
    ring = clusters(topology("ring", 6), [0, 1, 2, 3, 2, 1])
    assert ring.blocks == (Block((2, 1), (1, 2, 4, 5), (((-2, 1), (1, -2)),), 1),)
    assert ring.blocks[0].clusters == (1, 2)
    star = clusters(topology("star", 5), "hppqq")
    assert star.blocks == (Block((1,), (1, 2), (((-1,),),), 1), Block((2,), (3, 4), (((-1,),),), 1))
    leaves = clusters(topology("star", 4), [0, 1, 1, 1])
    assert leaves.blocks == (Block((1,), (1, 2, 3), (((-1,),),), 2),)


def test_balanced_partitions_without_symmetry_are_described_too() -> None:
    """A hub that drives two nodes, one of which drives a third: the whole network, balanced for G of any graph."""
    graph = Topology("driven", 4, ((1, 0, ONE), (2, 0, ONE), (3, 1, ONE)))
    assert len(orbital_partitions(graph)) == 1
    state = clusters(graph, [0, 1, 1, 2])
    assert state.blocks[0].matrices == (((-1,),),)
    assert clusters(graph, [5, 5, 5, 5]).quotients[0].links == ()


def test_unbalanced_partitions_are_refused() -> None:
    with pytest.raises(ValueError, match="partition is not balanced: nodes 1 and 2"):
        clusters(topology("chain", 4), [0, 0, 1, 1])
    with pytest.raises(ValueError, match="found 2 classes for 3 nodes"):
        clusters(topology("chain", 3), [0, 1])


def test_limits_are_kept() -> None:
    with pytest.raises(ValueError, match=r"chain\(65\): expected at most 64 nodes"):
        orbital_partitions(topology("chain", 65))
    with pytest.raises(ValueError, match=r"star\(9\) has more than 20000 automorphisms; expected at most 20000"):
        orbital_partitions(topology("star", 9))
    assert len(automorphisms([topology("ring", 8)], limit=16)) == 16
    with pytest.raises(ValueError, match="more than 15 automorphisms"):
        automorphisms([topology("ring", 8)], limit=15)
    with pytest.raises(ValueError, match=r"ring\(6\) has more than 12 orbital partitions"):
        orbital_partitions(topology("ring", 6), partition_limit=12)
    with pytest.raises(ValueError, match="automorphisms not found in 50 steps"):
        automorphisms([topology("ring", 8)], step_limit=50)
