"""Hypercubes: powers of two against bit flips, other sizes against products of complete graphs."""

from __future__ import annotations

from math import comb

import networkx as nx
import pytest

from synchain.models.graphs.families import topology
from synchain.models.graphs.topology import Topology


@pytest.mark.parametrize("d", range(8))
def test_nodes_of_a_hypercube_differ_in_one_bit(d: int) -> None:
    found = {(i, j) for i, j, weight in topology("hypercube", 2**d).links if weight == 1}
    assert found == {(i, i ^ 2**k) for i in range(2**d) for k in range(d)}


def test_the_spectrum_of_ten_dimensions_is_binomial() -> None:
    found = topology("hypercube", 1024).spectrum
    assert dict(zip(found.exact, found.multiplicities, strict=True)) == {-2 * k: comb(10, k) for k in range(11)}


@pytest.mark.parametrize(("n", "radices"), [(1, []), (7, [7]), (12, [2, 2, 3]), (45, [3, 3, 5]), (97, [97])])
def test_other_sizes_are_products_of_complete_graphs(n: int, radices: list[int]) -> None:
    expected = nx.complete_graph(1)
    for p in radices:
        expected = nx.cartesian_product(expected, nx.complete_graph(p))
    found = nx.Graph((i, j) for i, j, _ in topology("hypercube", n).links)
    found.add_nodes_from(range(n))
    assert nx.is_isomorphic(found, expected)


@pytest.mark.parametrize("n", [12, 45, 72])
def test_the_closed_spectrum_of_other_sizes_is_that_of_the_matrix(n: int) -> None:
    graph = topology("hypercube", n)
    other = Topology("matrix", n, graph.links).spectrum
    assert graph.spectrum.exact == other.exact
    assert graph.spectrum.multiplicities == other.multiplicities
