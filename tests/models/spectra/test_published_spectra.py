"""Spectra of named graphs as they are published (A. E. Brouwer, W. H. Haemers, Spectra of Graphs, Springer, 2012).

The tables there give adjacency eigenvalues theta of k-regular graphs; G = A - k has theta - k.
"""

from __future__ import annotations

from itertools import combinations, product

import networkx as nx
import pytest
import sympy as sp

from synchain.models.graphs.readers import from_graph
from synchain.models.spectra.solve import spectrum

R2, R3, R5, R13, R17 = (sp.sqrt(x) for x in (2, 3, 5, 13, 17))


def from_rule(nodes: list, joined) -> nx.Graph:
    """The graph on these nodes that joins the pairs for which the rule holds."""
    graph = nx.Graph()
    graph.add_nodes_from(nodes)
    graph.add_edges_from((a, b) for a, b in combinations(nodes, 2) if joined(a, b))
    return graph


def paley(q: int) -> nx.Graph:
    """Differences that are squares modulo a prime q = 1 mod 4."""
    squares = {x * x % q for x in range(1, q)}
    return from_rule(list(range(q)), lambda a, b: (a - b) % q in squares)


def clebsch() -> nx.Graph:
    """The folded 5-cube: 4-digit words that differ in one digit or in all four."""
    entries = list(product((0, 1), repeat=4))
    return from_rule(entries, lambda a, b: sum(x != y for x, y in zip(a, b, strict=True)) in (1, 4))


def shrikhande() -> nx.Graph:
    """Pairs modulo 4 that differ by ±(1, 0), ±(0, 1) or ±(1, 1)."""
    steps = {(1, 0), (3, 0), (0, 1), (0, 3), (1, 1), (3, 3)}
    nodes = list(product(range(4), repeat=2))
    return from_rule(nodes, lambda a, b: ((a[0] - b[0]) % 4, (a[1] - b[1]) % 4) in steps)


def johnson(n: int, k: int) -> nx.Graph:
    """k-subsets of n points that share all but one."""
    return from_rule(list(combinations(range(n), k)), lambda a, b: len(set(a) & set(b)) == k - 1)


def kneser(n: int, k: int) -> nx.Graph:
    """k-subsets of n points that share none."""
    return from_rule(list(combinations(range(n), k)), lambda a, b: not set(a) & set(b))


def hamming(d: int, q: int) -> nx.Graph:
    """Words of d letters out of q that differ in one."""
    entries = list(product(range(q), repeat=d))
    return from_rule(entries, lambda a, b: sum(x != y for x, y in zip(a, b, strict=True)) == 1)


TABLE = [
    ("Petersen", nx.petersen_graph(), {3: 1, 1: 5, -2: 4}),
    ("Heawood", nx.heawood_graph(), {3: 1, R2: 6, -R2: 6, -3: 1}),
    ("Pappus", nx.pappus_graph(), {3: 1, R3: 6, 0: 4, -R3: 6, -3: 1}),
    ("Desargues", nx.desargues_graph(), {3: 1, 2: 4, 1: 5, -1: 5, -2: 4, -3: 1}),
    ("Moebius-Kantor", nx.moebius_kantor_graph(), {3: 1, R3: 4, 1: 3, -1: 3, -R3: 4, -3: 1}),
    ("dodecahedron", nx.dodecahedral_graph(), {3: 1, R5: 3, 1: 5, 0: 4, -2: 4, -R5: 3}),
    ("icosahedron", nx.icosahedral_graph(), {5: 1, R5: 3, -1: 5, -R5: 3}),
    ("octahedron", nx.octahedral_graph(), {4: 1, 0: 3, -2: 2}),
    ("Clebsch", clebsch(), {5: 1, 1: 10, -3: 5}),
    ("Shrikhande", shrikhande(), {6: 1, 2: 6, -2: 9}),
    ("4 x 4 rook", hamming(2, 4), {6: 1, 2: 6, -2: 9}),
    ("Paley 5", paley(5), {2: 1, (R5 - 1) / 2: 2, (-R5 - 1) / 2: 2}),
    ("Paley 13", paley(13), {6: 1, (R13 - 1) / 2: 6, (-R13 - 1) / 2: 6}),
    ("Paley 17", paley(17), {8: 1, (R17 - 1) / 2: 8, (-R17 - 1) / 2: 8}),
    ("Tutte-Coxeter", nx.LCF_graph(30, [-13, -9, 7, -7, 9, 13], 5), {3: 1, 2: 9, 0: 10, -2: 9, -3: 1}),
    ("Hoffman-Singleton", nx.hoffman_singleton_graph(), {7: 1, 2: 28, -3: 21}),
    ("Coxeter", from_rule(
        [x for x in combinations(range(7), 3)
         if set(x) not in [{i, (i + 1) % 7, (i + 3) % 7} for i in range(7)]],
        lambda a, b: not set(a) & set(b),
    ), {3: 1, 2: 8, R2 - 1: 6, -1: 7, -R2 - 1: 6}),
    ("Johnson 6, 3", johnson(6, 3), {9: 1, 3: 5, -1: 9, -3: 5}),
    ("Kneser 7, 2", kneser(7, 2), {10: 1, 1: 14, -4: 6}),
    ("triangular T(6)", johnson(6, 2), {8: 1, 2: 5, -2: 9}),
    ("Hamming 3, 3", hamming(3, 3), {6: 1, 3: 6, 0: 12, -3: 8}),
]  # fmt: skip


@pytest.mark.parametrize(("name", "graph", "adjacency"), TABLE, ids=[name for name, _, _ in TABLE])
def test_the_spectrum_is_the_published_one(name: str, graph: nx.Graph, adjacency: dict) -> None:
    degree = max(sp.S(theta) for theta in adjacency)
    expected = {sp.expand(theta - degree): count for theta, count in adjacency.items()}
    eigenvalues = spectrum.__wrapped__(from_graph(graph))
    assert eigenvalues.verified
    assert {sp.expand(e.exact): e.multiplicity for e in eigenvalues.eigenvalues} == expected
    assert sum(expected.values()) == graph.number_of_nodes()


def test_cospectral_graphs_that_are_not_the_same() -> None:
    """Shrikhande and the 4 x 4 rook's graph; the star of four and a square with a lonely node by adjacency only."""
    same = [from_graph(graph).spectrum for graph in (shrikhande(), hamming(2, 4))]
    assert same[0].exact == same[1].exact
    assert not nx.is_isomorphic(shrikhande(), hamming(2, 4))
    square = nx.cycle_graph(4)
    square.add_node(4)
    assert from_graph(nx.star_graph(4)).spectrum.exact != from_graph(square).spectrum.exact
