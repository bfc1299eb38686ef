"""Hypergraphs of triangles: exact generalised Laplacians, lists, cliques of graphs, and what is refused."""

from __future__ import annotations

import pickle
from fractions import Fraction
from itertools import permutations

import networkx as nx
import numpy as np
import pytest

from synchain import Scene
from synchain.graphs import Hypergraph, complete, from_edges, from_graph, one_way_ring, petersen, triangles
from synchain.models.scenes.dictionary import graph_of, graph_table

LISTED = [(1, 2, 3), (2, 3, 4, "1/2"), (5, 2, 4, -3)]


def laplacian(n: int, listed: list) -> np.ndarray:
    """Generalised Laplacian from the tensor B: L_ij = -sum_k B_ijk, L_ii = sum_jk B_ijk, with the sign of G."""
    b = np.zeros((n, n, n))
    for i, j, k, *weight in listed:
        for nodes in permutations((i - 1, j - 1, k - 1)):
            b[nodes] = float(Fraction(weight[0])) if weight else 1.0
    return b.sum(axis=2) - np.diag(b.sum(axis=(1, 2)))


def test_the_generalised_laplacian_is_the_connectivity_matrix() -> None:
    graph = triangles(LISTED)
    expected = laplacian(5, LISTED)
    np.testing.assert_array_equal(np.array(graph.rows, dtype=float), expected)
    values = [float(e) for e in graph.spectrum for _ in range(e.multiplicity)]
    assert sorted(values) == pytest.approx(np.linalg.eigvalsh(expected), abs=1e-12)
    assert repr(graph) == "Hypergraph('triangles', n=5, 3 triangles)"
    assert len(graph.triads) == 18
    assert graph.triads[0] == (0, 1, 1, 2)


def test_a_complete_graph_has_the_spectrum_of_the_paper() -> None:
    """All-to-all triangles: the generalised Laplacian is n - 2 times that of the complete graph (Gambuzza et al. 2021)."""
    graph = triangles(complete(6))
    assert len(graph.triangles) == 20
    assert [(e.number, e.multiplicity) for e in graph.spectrum] == [(0, 1), (-24, 5)]


def test_the_triangles_of_a_graph_are_its_cliques_of_three() -> None:
    made = nx.gnp_random_graph(14, 0.5, seed=3)
    expected = sorted(tuple(sorted(c)) for c in nx.enumerate_all_cliques(made) if len(c) == 3)
    assert [t[:3] for t in triangles(from_graph(made)).triangles] == expected
    assert triangles(petersen(10)).triangles == ()


def test_hypergraphs_are_values() -> None:
    graph = triangles(LISTED)
    assert graph == triangles(reversed(LISTED)) != triangles(LISTED[:2])
    assert hash(graph) == hash(triangles(LISTED))
    # equal links, but other triangles
    assert triangles([(1, 2, 3)]) != from_edges([(1, 2), (1, 3), (2, 3)], name="triangles")
    assert pickle.loads(pickle.dumps(graph)) == graph == graph_of(graph_table(graph))
    assert isinstance(graph_of({"triangles": [[1, 2, 3]], "n": 4}), Hypergraph)
    assert triangles([(1, 2, 3)], n=5).n == 5


def test_what_is_refused() -> None:
    for wrong, message in (
        ([(1, 2, 2)], r"triangle 1 has equal nodes: \(1, 2, 2\)"),
        ([(1, 2, 3), (3, 2, 1)], "triangle 2 is repeated"),
        ([(1, 2, 3, 0)], "has the weight 0"),
        ([(1, 2)], "triangle 1 is"),
        ([(0, 1, 2)], "triangle 1: node"),
        (one_way_ring(4), "expected an undirected graph"),
    ):
        with pytest.raises(ValueError, match=message):
            triangles(wrong)
    with pytest.raises(ValueError, match="found a hypergraph, triangles"):
        Scene("rossler", "x->x", triangles([(1, 2, 3)]))
