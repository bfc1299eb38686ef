"""Symmetries and cluster states of small graphs: counts known by hand, brute force, exact blocks."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from itertools import product

import networkx as nx
import numpy as np
import pytest

from synchain.models.graphs.families import topology
from synchain.models.graphs.topology import Topology, from_matrix
from synchain.models.spectra.characteristic import characteristic
from synchain.models.spectra.eigenvalue import ProofError
from synchain.models.symmetries.automorphisms import automorphisms
from synchain.models.symmetries.clusters import check, clusters, orbital_partitions

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
    group = automorphisms(graph)
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
    group = automorphisms(graph)
    expected = {orbits(graph.n, generators) for generators in product(group, repeat=3 if len(group) < 13 else 2)}
    if len(group) >= 13:
        expected |= {orbits(graph.n, [*pair, g]) for pair in product(group[:12], repeat=2) for g in group}
    assert {c.classes for c in orbital_partitions(graph)} == expected


def test_orbits_of_many_generators_are_joined() -> None:
    """The hypercube of 16 has partitions that are no join of two cycles: joined with further cycles all stay in the list."""
    graph = topology("hypercube", 16)
    names_found = {c.classes for c in orbital_partitions(graph)}
    group = automorphisms(graph)
    for classes in sorted(names_found)[::10]:
        last: dict[int, int] = {}
        turned = list(range(16))  # a permutation whose cycles are these classes
        for i, k in enumerate(classes):
            if k in last:
                turned[i], turned[last[k]] = turned[last[k]], i
            last[k] = i
        assert orbits(16, [turned]) == classes
        assert all(orbits(16, [turned, g]) in names_found for g in group[::7])


@pytest.mark.parametrize("graph", GRAPHS, ids=repr)
def test_quotient_and_blocks_have_the_eigenvalues_of_the_network(graph: Topology) -> None:
    expected = np.poly(np.array(graph.rows, dtype=float))
    for state in orbital_partitions(graph):
        polynomial = np.poly(np.array(state.quotient.rows, dtype=float))
        for block in state.blocks:
            polynomial = np.polymul(polynomial, np.poly(np.array(block.matrix, dtype=float)))
        assert np.real(polynomial) == pytest.approx(np.real(expected), rel=1e-8, abs=1e-6 * np.abs(expected).max())
        assert sum(len(b.matrix) for b in state.blocks) == graph.n - state.quotient.n


@pytest.mark.parametrize("graph", GRAPHS, ids=repr)
def test_blocks_are_the_equations_of_the_differences(graph: Topology) -> None:
    """d/dt of x_i - x_j under dx/dt = G x, at a random state: the part of its own block, and of no other coordinate."""
    g = np.array(graph.rows, dtype=float)
    for seed, state in enumerate(orbital_partitions(graph)):
        x = np.random.default_rng(seed).normal(size=graph.n)
        for block in state.blocks:
            i, j = np.array(block.pairs).T
            assert np.array(block.matrix, dtype=float) @ (x[i] - x[j]) == pytest.approx(
                (g @ x)[i] - (g @ x)[j], abs=1e-12
            )
            assert [state.classes[a] for a in i] == [state.classes[b] for b in j] == list(block.nodes)
            assert block.clusters == tuple(sorted(set(block.nodes)))


def test_the_ends_of_a_chain_of_three() -> None:
    _, state = orbital_partitions(topology("chain", 3))
    assert (state.classes, state.members) == ((0, 1, 0), ((0, 2), (1,)))
    assert state.quotient.rows == ((-1, 1), (2, -2))
    (block,) = state.blocks
    assert (block.clusters, block.nodes, block.pairs, block.matrix) == ((0,), (0,), ((2, 0),), ((-1,),))


def test_mirrored_pairs_of_a_ring_are_intertwined_and_pairs_of_leaves_are_not() -> None:
    ring = clusters(topology("ring", 6), [0, 1, 2, 3, 2, 1])
    (block,) = ring.blocks
    assert (block.clusters, block.pairs) == ((1, 2), ((4, 2), (5, 1)))
    assert block.matrix == ((-2, 1), (1, -2))
    star = clusters(topology("star", 5), "hppqq")
    assert [(b.clusters, b.pairs, b.matrix) for b in star.blocks] == [
        ((1,), ((2, 1),), ((-1,),)),
        ((2,), ((4, 3),), ((-1,),)),
    ]


def test_balanced_partitions_without_symmetry_are_described_too() -> None:
    """A hub that drives two nodes, one of which drives a third: the whole network, balanced for G of any graph."""
    graph = Topology("driven", 4, ((1, 0, ONE), (2, 0, ONE), (3, 1, ONE)))
    assert len(orbital_partitions(graph)) == 1
    state = clusters(graph, [0, 1, 1, 2])
    assert state.blocks[0].matrix == ((-1,),)
    assert clusters(graph, [5, 5, 5, 5]).quotient.links == ()


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
    assert len(automorphisms(topology("ring", 8), limit=16)) == 16
    with pytest.raises(ValueError, match="more than 15 automorphisms"):
        automorphisms(topology("ring", 8), limit=15)
    with pytest.raises(ValueError, match=r"ring\(6\) has more than 12 orbital partitions"):
        orbital_partitions(topology("ring", 6), partition_limit=12)
    with pytest.raises(ValueError, match="automorphisms not found in 50 steps"):
        automorphisms(topology("ring", 8), step_limit=50)


def test_a_wrong_block_does_not_pass_the_proof() -> None:
    graph = topology("chain", 3)
    state = clusters(graph, [0, 1, 0])
    check(state, graph, characteristic(graph))
    with pytest.raises(ProofError, match=r"clusters \(0, 1, 0\) of chain\(3\)"):
        check(replace(state, blocks=state.blocks[:-1]), graph, characteristic(graph))
