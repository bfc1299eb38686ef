"""Exact spectra of all graphs of up to six nodes (Read & Wilson, An Atlas of Graphs, 1998, as networkx has them)."""

from __future__ import annotations

import networkx as nx
import numpy as np
import pytest
from networkx.generators.atlas import graph_atlas, graph_atlas_g

from synchain.graphs import from_graph

GRAPHS = 209
"""Number of graphs with at most six nodes, the empty one included."""
QUICK = range(2, GRAPHS, 13)


def check(number: int) -> float:
    """Compare exact eigenvalues and multiplicities with NumPy's; return the largest difference."""
    graph = graph_atlas(number)
    laplacian = -nx.laplacian_matrix(graph).toarray().astype(float)
    expected = np.sort(np.linalg.eigvalsh(laplacian))[::-1]
    spectrum = from_graph(graph).spectrum
    exact = np.repeat(np.asarray(spectrum.values), spectrum.multiplicities)
    assert len(exact) == len(expected), f"graph {number}: {exact}; {expected}"
    groups = np.split(expected, np.flatnonzero(np.abs(np.diff(expected)) > 1e-6) + 1)
    assert [len(group) for group in groups] == list(spectrum.multiplicities), f"graph {number}"
    return float(np.abs(exact - expected).max())


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("number", QUICK)
def test_the_spectrum_of_a_graph(number: int) -> None:
    assert check(number) < 1e-12


@pytest.mark.long
@pytest.mark.filterwarnings("ignore")
def test_the_spectra_of_all_graphs() -> None:
    assert sum(len(graph) <= 6 for graph in graph_atlas_g()) == GRAPHS
    assert max(check(number) for number in range(1, GRAPHS)) < 1e-12
