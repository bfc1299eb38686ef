"""Adjacency matrix and Laplacians of graphs: their entries, their proved spectra, what has none."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import networkx as nx
import numpy as np
import pytest
import sympy as sp
from family_sizes import size

from synchain.models.graphs import matrices
from synchain.models.graphs.families import family, names, topology
from synchain.models.graphs.graph_products import union, weighted
from synchain.models.graphs.matrices import GraphMatrix, MatrixKind
from synchain.models.graphs.readers import from_edges
from synchain.models.graphs.topology import Topology
from synchain.models.spectra.eigenvalue import ProofError
from synchain.models.spectra.solve import spectrum

UNDIRECTED = [name for name in names() if not family(name).directed]
UNEVEN = from_edges([(0, 1, "1/2"), (1, 2, 3), (2, 3), (3, 0), (0, 2, "2/7")])


def dense(graph: nx.Graph, kind: MatrixKind) -> np.ndarray:
    """The matrix by networkx, the normalised Laplacian in place of the similar one."""
    weights, nodes = nx.to_numpy_array(graph, nodelist=sorted(graph)), sorted(graph)
    match kind:
        case MatrixKind.ADJACENCY:
            return weights
        case MatrixKind.LAPLACIAN:
            return nx.laplacian_matrix(graph, nodes).toarray()
        case MatrixKind.SIGNLESS:
            return np.diag(weights.sum(axis=1)) + weights
    return nx.normalized_laplacian_matrix(graph, nodes).toarray()


@pytest.mark.parametrize("kind", MatrixKind)
@pytest.mark.parametrize(
    "graph", [*(topology(name, size(name, 12)) for name in UNDIRECTED), UNEVEN, union(UNEVEN, Topology("one", 1, ()))],
    ids=str,
)  # fmt: skip
def test_spectra_are_proved_and_those_of_networkx(graph: Topology, kind: MatrixKind) -> None:
    made = GraphMatrix(graph, kind)
    found = made.spectrum
    assert found.verified
    assert found.n == graph.n
    drawn = graph.to_networkx()
    for _, _, data in drawn.edges(data=True):
        data["weight"] = float(data["weight"])
    expected = dense(drawn, kind)
    assert np.repeat(found.values, found.multiplicities)[::-1] == pytest.approx(np.linalg.eigvalsh(expected), abs=1e-12)
    if kind is not MatrixKind.RANDOM_WALK:
        assert np.array(made.rows, float) == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize("kind", MatrixKind)
@pytest.mark.parametrize("name", ["ring", "complete", "petersen", "hypercube", "cayley_abelian", "torus"])
def test_closed_forms_of_regular_graphs_are_those_of_the_characteristic_polynomial(name: str, kind: MatrixKind) -> None:
    graph = topology(name, size(name, 16))
    plain = Topology("plain", graph.n, graph.links)
    assert (GraphMatrix(graph, kind).closed_form() is None) == (graph.closed_form() is None)
    assert GraphMatrix(plain, kind).closed_form() is None
    assert GraphMatrix(graph, kind).spectrum.values == pytest.approx(
        GraphMatrix(plain, kind).spectrum.values, rel=1e-15
    )
    assert GraphMatrix(graph, kind).spectrum.multiplicities == GraphMatrix(plain, kind).spectrum.multiplicities


def test_the_four_matrices_of_a_chain_by_hand() -> None:
    chain, half = topology("chain", 3), Fraction(1, 2)
    assert chain.adjacency.rows == ((0, 1, 0), (1, 0, 1), (0, 1, 0))
    assert chain.laplacian.matrix == -chain.matrix
    assert chain.signless_laplacian.rows == ((1, 1, 0), (1, 2, 1), (0, 1, 1))
    assert chain.random_walk_laplacian.rows == ((1, -1, 0), (-half, 1, -half), (0, -1, 1))
    assert repr(chain.adjacency.spectrum) == "{sqrt(2): 1, 0: 1, -sqrt(2): 1}"
    assert repr(topology("star", 5).adjacency.spectrum) == "{2: 1, 0: 3, -2: 1}"
    assert repr(topology("petersen", 10).adjacency.spectrum) == "{3: 1, 1: 5, -2: 4}"
    assert repr(topology("complete_bipartite", 6).random_walk_laplacian.spectrum) == "{2: 1, 1: 4, 0: 1}"


def test_the_signless_laplacian_of_a_bipartite_graph_has_the_eigenvalues_of_the_laplacian() -> None:
    for graph in (
        topology("chain", 9),
        topology("tree", 12),
        topology("hypercube", 16),
        topology("complete_bipartite", 7),
    ):
        assert graph.signless_laplacian.spectrum.evaluate(30) == graph.laplacian.spectrum.evaluate(30)
        assert graph.signless_laplacian.spectrum.multiplicities == graph.laplacian.spectrum.multiplicities
    odd = topology("ring", 5)
    assert odd.signless_laplacian.spectrum.evaluate(30) != odd.laplacian.spectrum.evaluate(30)


def test_one_way_graphs_have_an_adjacency_matrix_and_a_laplacian_only() -> None:
    graph = topology("one_way_ring", 4)
    assert set(graph.adjacency.spectrum.exact) == {sp.S.One, sp.S.NegativeOne, sp.I, -sp.I}
    assert set(graph.laplacian.spectrum.exact) == {-x for x in graph.spectrum.exact}
    chain = topology("feed_forward", 4)
    assert chain.adjacency.spectrum[0].blocks == ((4, 1),)
    for refused in (lambda: graph.signless_laplacian, lambda: graph.random_walk_laplacian):
        with pytest.raises(
            ValueError, match=r"^one_way_ring, .* Laplacian: found one-way links, first from .*; expected an undirected"
        ):
            refused()


@pytest.mark.parametrize(
    ("edges", "words"),
    [
        ([(0, 1, 1), (1, 2, -1)], "node 1 has the degree 0; expected a positive one"),
        ([(0, 1, -2), (1, 2, 3)], "node 0 has the degree -2; expected a positive one"),
    ],
)
def test_degrees_that_are_not_positive_are_refused(edges: list, words: str) -> None:
    graph = from_edges(edges)
    assert graph.signless_laplacian.spectrum.verified
    with pytest.raises(ValueError, match=words):
        _ = graph.random_walk_laplacian


def test_a_graph_without_links() -> None:
    lonely = Topology("lonely", 3, ())
    for kind in MatrixKind:
        assert repr(GraphMatrix(lonely, kind).spectrum) == "{0: 3}"


@pytest.mark.parametrize("wrong", [lambda mu: mu + 1, lambda mu: 12 - mu, lambda mu: mu - 6])
def test_a_wrong_closed_form_is_no_spectrum(
    wrong: Callable[[sp.Expr], sp.Expr], monkeypatch: pytest.MonkeyPatch
) -> None:
    graph = weighted(topology("ring", 7), 3)
    assert graph.adjacency.spectrum.verified
    pairs = [(wrong(mu), times) for mu, times in graph.adjacency.closed_form() or ()]
    monkeypatch.setattr(matrices.GraphMatrix, "closed_form", lambda self: pairs)
    spectrum.cache_clear()
    with pytest.raises(ProofError, match="adjacency matrix"):
        _ = graph.adjacency.spectrum
