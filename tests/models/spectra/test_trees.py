"""Spanning trees and resistances, by known numbers, by networkx, and by all trees of small graphs."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations
from math import comb, prod

import networkx as nx
import numpy as np
import pytest
from catalogue import UNDIRECTED, UNEVEN
from family_sizes import size

from synchain.graphs import chain, complete, complete_bipartite, hypercube, kneser, one_way_ring, ring, star, wheel
from synchain.models.graphs.families import topology
from synchain.models.graphs.graph_products import union, weighted
from synchain.models.graphs.readers import from_edges
from synchain.models.graphs.topology import Topology


@pytest.mark.parametrize("n", [1, 2, 3, 4, 7, 20, 60])
def test_known_numbers(n: int) -> None:
    assert chain(n).spanning_trees == star(n).spanning_trees == 1
    assert complete(n).spanning_trees == Fraction(n) ** (n - 2)  # A. Cayley, Q. J. Math. 23, 376 (1889)
    assert chain(n).kirchhoff_index == comb(n + 1, 3)  # Klein and Randić 1993
    assert complete(n).kirchhoff_index == n - 1
    assert star(n).kirchhoff_index == (n - 1) ** 2
    if n > 2:
        assert ring(n).spanning_trees == n
        assert ring(n).kirchhoff_index == Fraction(n**3 - n, 12)
        p, q = n // 2, n - n // 2
        assert complete_bipartite(n).spanning_trees == p ** (q - 1) * q ** (p - 1)
    if n > 3:
        lucas = [2, 1]
        while len(lucas) <= 2 * (n - 1):
            lucas.append(lucas[-1] + lucas[-2])
        assert wheel(n).spanning_trees == lucas[2 * (n - 1)] - 2  # J. Sedláček, Čas. Pěst. Mat. 94, 217 (1969)


def test_those_of_famous_graphs() -> None:
    assert kneser(10).spanning_trees == 2000
    assert hypercube(8).spanning_trees == 384
    assert topology("petersen", 20).spanning_trees == 5_184_000  # the dodecahedron


@pytest.mark.parametrize("name", UNDIRECTED)
def test_numbers_are_those_of_networkx_and_of_the_eigenvalues(name: str) -> None:
    graph = topology(name, size(name, 8))
    if graph.components > 1:
        assert graph.spanning_trees == 0
        return
    assert float(graph.spanning_trees) == pytest.approx(nx.number_of_spanning_trees(graph.to_networkx()), rel=1e-9)
    mu = -np.repeat(graph.spectrum.values, graph.spectrum.multiplicities)[1:]
    assert float(graph.kirchhoff_index) == pytest.approx(graph.n * np.sum(1 / mu), rel=1e-12)


@pytest.mark.parametrize(
    "graph", [UNEVEN, ring(5), weighted(complete(5), "-2/3"), topology("erdos_renyi", 6, seed=3)], ids=str
)
def test_weights_of_all_trees_are_added_up(graph: Topology) -> None:
    edges = [(i, j, weight) for i, j, weight in graph.links if i < j]
    trees = (chosen for chosen in combinations(edges, graph.n - 1) if from_edges(chosen, n=graph.n).components == 1)
    assert graph.spanning_trees == sum(prod(weight for _, _, weight in chosen) for chosen in trees)


def test_resistances_of_all_pairs_are_added_up() -> None:
    rows = np.array(UNEVEN.laplacian.rows, float)
    inverse = np.linalg.pinv(rows)
    pairs = [inverse[i, i] + inverse[j, j] - 2 * inverse[i, j] for i, j in combinations(range(4), 2)]
    assert float(UNEVEN.kirchhoff_index) == pytest.approx(sum(pairs), rel=1e-12)
    assert isinstance(UNEVEN.kirchhoff_index, Fraction)


def test_what_has_none_is_refused() -> None:
    parts = union(ring(3), chain(2))
    assert parts.spanning_trees == 0
    with pytest.raises(
        ValueError, match=r"Kirchhoff index: found union.* on which 0 is a multiple eigenvalue; expected a con"
    ):
        _ = parts.kirchhoff_index
    with pytest.raises(
        ValueError, match=r"Kirchhoff index: found one-way links, first from .* in one_way_ring; expected an undirected"
    ):
        _ = one_way_ring(4).kirchhoff_index
    with pytest.raises(ValueError, match="spanning trees: found one-way links"):
        _ = one_way_ring(4).spanning_trees
    with pytest.raises(ValueError, match="spanning trees: found 1001 nodes; expected at most 1000"):
        _ = ring(1001).spanning_trees
