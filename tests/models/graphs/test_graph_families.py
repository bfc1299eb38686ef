"""Families of graphs with options: against networkx, against their closed spectra, and what they refuse."""

from __future__ import annotations

import hashlib
import inspect
import pickle
from collections import Counter
from fractions import Fraction
from itertools import product

import networkx as nx
import numpy as np
import pytest
import sympy as sp
from effort import effort
from family_sizes import size, sizes

import synchain
from synchain.models.graphs.closed_forms import closed_form
from synchain.models.graphs.families import TOPOLOGY, Family, family, names, topology
from synchain.models.graphs.topology import Topology
from synchain.models.scenes.scene import Scene
from synchain.models.spectra.solve import Proof, spectrum

fresh = spectrum.__wrapped__

CLOSED = [name for name in names() if family(name).spectrum]
THOUSAND = {"hamming": 1024, "hypercube": 1024, "johnson": 990, "kneser": 990, "paley": 1009}
"""The numbers of nodes near a thousand of families that have no graph of a thousand nodes, or a dull one."""

COUNTED = [name for name in names() if family(name).count]


def shrikhande() -> nx.Graph:
    """The graph of S. S. Shrikhande, Ann. Math. Stat. 30, 781 (1959): Z4 x Z4 joined along 1,0, 0,1 and 1,1."""
    nodes = [(a, b) for a in range(4) for b in range(4)]
    steps = [(1, 0), (0, 1), (1, 1)]
    return nx.Graph([((a, b), ((a + c) % 4, (b + d) % 4)) for a, b in nodes for c, d in steps])


SAME = [
    (("complete_bipartite", 9), nx.complete_bipartite_graph(4, 5)),
    (("complete_bipartite", 7, {"left": 2}), nx.complete_bipartite_graph(2, 5)),
    (("wheel", 8), nx.wheel_graph(8)),
    (("ladder", 10), nx.ladder_graph(5)),
    (("torus", 12), nx.grid_graph([3, 4], periodic=True)),
    (("torus", 60, {"shape": (3, 4, 5)}), nx.grid_graph([5, 4, 3], periodic=True)),
    (("torus", 7), nx.cycle_graph(7)),
    (("torus", 4), nx.cycle_graph(4)),
    (("grid", 24, {"shape": [2, 3, 4]}), nx.grid_graph([4, 3, 2])),
    (("grid", 12, {"shape": "2x6"}), nx.grid_graph([6, 2])),
    (("grid", 5, {"shape": (1, 5, 1)}), nx.path_graph(5)),
    (("circulant", 9), nx.circulant_graph(9, [1, 2])),
    (("circulant", 10, {"offsets": (1, 3, 5)}), nx.circulant_graph(10, [1, 3, 5])),
    (("circulant", 10, {"offsets": "9,2,12"}), nx.circulant_graph(10, [1, 2])),
    (("circulant", 3), nx.cycle_graph(3)),
    (("small_world", 9, {"p": 0}), nx.circulant_graph(9, [1, 2])),
    (("erdos_renyi", 6, {"p": 1}), nx.complete_graph(6)),
    (("erdos_renyi", 6, {"p": 0}), nx.empty_graph(6)),
    (("random_regular", 6, {"degree": 5}), nx.complete_graph(6)),
    (("path", 5), nx.path_graph(5)),
    (("cycle", 6), nx.cycle_graph(6)),
    (("prism", 12), nx.circular_ladder_graph(6)),
    (("kneser", 10), nx.petersen_graph()),
    (("kneser", 35, {"k": 3}), nx.kneser_graph(7, 3)),
    (("kneser", 6), nx.kneser_graph(4, 2)),
    (("johnson", 10), nx.complement(nx.petersen_graph())),
    (("johnson", 15), nx.line_graph(nx.complete_graph(6))),
    (("hamming", 16), nx.line_graph(nx.complete_bipartite_graph(4, 4))),
    (("hamming", 16, {"d": 4}), nx.hypercube_graph(4)),
    (("hamming", 7, {"d": 1}), nx.complete_graph(7)),
    (("paley", 13), nx.circulant_graph(13, [1, 3, 4])),
    (("paley", 9), nx.line_graph(nx.complete_bipartite_graph(3, 3))),
    (("complete_multipartite", 9, {"parts": (2, 3, 4)}), nx.complete_multipartite_graph(2, 3, 4)),
    (("complete_multipartite", 8), nx.turan_graph(8, 3)),
    (("petersen", 10), nx.petersen_graph()),
    (("petersen", 16, {"step": 3}), nx.moebius_kantor_graph()),
    (("petersen", 20, {"step": 2}), nx.dodecahedral_graph()),
    (("petersen", 20, {"step": 3}), nx.desargues_graph()),
    (("cayley_abelian", 12, {"shape": (3, 4)}), nx.grid_graph([4, 3], periodic=True)),
    (("cayley_abelian", 10, {"generators": [1, 3, 5]}), nx.circulant_graph(10, [1, 3, 5])),
    (("cayley_abelian", 16, {"shape": (4, 4), "generators": "1,0,0,1,1,1"}), shrikhande()),
    (("cayley_abelian", 8, {"shape": "2x2x2"}), nx.hypercube_graph(3)),
    (("cayley_dihedral", 12), nx.circular_ladder_graph(6)),
    (("cayley_dihedral", 12, {"rotations": (), "reflections": (0, 1)}), nx.cycle_graph(12)),
    (("cayley_dihedral", 14, {"rotations": (), "reflections": "0,1,3"}), nx.heawood_graph()),
    (("cayley_dihedral", 12, {"rotations": "1,2,3", "reflections": "0,1,2,3,4,5"}), nx.complete_graph(12)),
]


def made(name: str, n: int, options: dict[str, object] | None = None) -> Topology:
    return topology(name, n, **(options or {}))


def undirected(graph: Topology) -> nx.Graph:
    found = nx.Graph()
    found.add_nodes_from(range(graph.n))
    found.add_edges_from((i, j) for i, j, weight in graph.links if weight == 1)
    return found


@pytest.mark.parametrize(("words", "expected"), SAME)
def test_families_are_those_of_networkx(words: tuple, expected: nx.Graph) -> None:
    graph = made(*words)
    assert graph.symmetric
    assert len(graph.links) == 2 * expected.number_of_edges()
    assert nx.is_isomorphic(undirected(graph), expected)


@pytest.mark.parametrize(("words", "expected"), SAME)
def test_spectra_of_families_with_options_are_proved(words: tuple, expected: nx.Graph) -> None:
    found = made(*words).spectrum
    assert found.verified
    numbers = -np.sort(-np.linalg.eigvalsh(-nx.laplacian_matrix(expected).toarray().astype(float)))
    assert np.repeat(found.values, found.multiplicities) == pytest.approx(numbers, abs=1e-10)


def test_one_way_graphs_by_hand() -> None:
    one = Fraction(1)
    assert topology("one_way_ring", 3).links == ((0, 1, one), (1, 2, one), (2, 0, one))
    assert topology("feed_forward", 4).links == ((1, 0, one), (2, 1, one), (3, 2, one))
    assert repr(topology("feed_forward", 5).spectrum) == "{0: 1, -1: 4}"
    jordan = topology("feed_forward", 5).matrix + sp.eye(5)
    assert jordan.rank() == 4
    four = topology("one_way_ring", 4).spectrum.exact
    assert set(four) == {sp.S.Zero, -1 + sp.I, sp.S(-2), -1 - sp.I}
    third = topology("one_way_ring", 3).spectrum.exact
    assert set(third) == {
        sp.S.Zero,
        sp.Rational(-3, 2) + sp.sqrt(3) * sp.I / 2,
        sp.Rational(-3, 2) - sp.sqrt(3) * sp.I / 2,
    }


@pytest.mark.parametrize("name", COUNTED)
def test_counts_are_those_of_the_edges(name: str) -> None:
    for n in sizes(name, range(1, 31)):
        graph = topology(name, n)
        promised = graph.link_count
        assert len(graph.links) == promised, n


@pytest.mark.parametrize("name", CLOSED)
def test_closed_forms_of_a_thousand_nodes_cost_little_a_node(name: str) -> None:
    graph = topology(name, THOUSAND.get(name, 1000))
    counts, calls = effort(lambda: fresh(graph).multiplicities)
    assert sum(counts) == graph.n
    assert calls < (6_500 if name == "grid" else 2_700) * graph.n


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("torus", {}), ("grid", {}), ("ladder", {}), ("circulant", {"offsets": (1, 3, 4)}), ("wheel", {}),
        ("torus", {"shape": (6, 6, 6)}), ("grid", {"shape": (6, 6, 6)}), ("circulant", {"offsets": (2, 108)}),
    ],
)  # fmt: skip
def test_closed_forms_beyond_the_limit_are_proved_on_request(name: str, options: dict) -> None:
    assert spectrum(topology(name, 216, **options), proof=Proof.EXACT).verified


def test_the_largest_eigenvalue_of_a_cube_of_nodes() -> None:
    found = topology("torus", 64, shape=(4, 4, 4)).spectrum
    assert repr(found) == "{0: 1, -2: 6, -4: 15, -6: 20, -8: 15, -10: 6, -12: 1}"
    assert found.largest == -12
    assert found.slowest == -2


# ---- random graphs ----


@pytest.mark.parametrize("name", ["erdos_renyi", "small_world", "random_regular"])
def test_random_families_hang_on_their_seed(name: str) -> None:
    first = topology(name, 30)
    assert topology(name, 30, seed=0) == first
    assert topology(name, 30, seed=0).links == first.links
    others = [topology(name, 30, seed=seed).links for seed in range(8)]
    assert len(set(others)) == 8


def test_random_graphs_are_the_same_on_every_machine() -> None:
    def edges(graph: Topology) -> set[tuple[int, int]]:
        return {(i, j) for i, j, _ in graph.links if i < j}

    assert edges(topology("erdos_renyi", 5)) == PINNED["erdos_renyi"]
    assert edges(topology("small_world", 6, p="1/2")) == PINNED["small_world"]
    assert edges(topology("random_regular", 6, degree=3)) == PINNED["random_regular"]


@pytest.mark.parametrize(
    ("name", "n", "options", "digest"),
    [
        ("random_regular", 50, {"degree": 10, "seed": 1}, "a8fd903585836203"),
        ("random_regular", 30, {"degree": 15, "seed": 2}, "2b2ba5f81183ef43"),
        ("random_regular", 1000, {"degree": 6, "seed": 7}, "c0261a0118521fd9"),
        ("small_world", 60, {"neighbours": 6, "p": "1/4", "seed": 9}, "d8c39453b8481f6b"),
        ("small_world", 20, {"neighbours": 18, "p": "1/2", "seed": 1}, "074cc2dfcd951e95"),
        ("erdos_renyi", 300, {"p": 0.02, "seed": 4}, "51dedea9a9b3df72"),
        ("erdos_renyi", 80, {"p": "0.5", "seed": 6}, "fd2d561431f8fe52"),
    ],
)
def test_seeds_keep_their_graphs(name: str, n: int, options: dict[str, object], digest: str) -> None:
    found = repr(topology(name, n, **options).links)
    assert hashlib.sha256(found.encode()).hexdigest().startswith(digest)


@pytest.mark.parametrize(("n", "degree"), [(100, 98), (100, 97), (200, 198), (7, 4)])
def test_regular_graphs_of_high_degree_are_drawn_by_what_is_missing(n: int, degree: int) -> None:
    graph, other = (topology("random_regular", n, degree=degree, seed=seed) for seed in (0, 1))
    assert len(graph.links) == graph.link_count == n * degree
    assert set(Counter(target for target, _, _ in graph.links).values()) == {degree}
    assert graph.symmetric
    assert graph.links != other.links


def test_the_smallest_probabilities_join_nobody() -> None:
    assert topology("erdos_renyi", 1000, p="1e-320").links == ()
    assert topology("erdos_renyi", 1000, p="1e-999").links == ()


PINNED: dict[str, set[tuple[int, int]]] = {
    "erdos_renyi": {(0, 4), (1, 2), (1, 4), (2, 3), (3, 4)},
    "small_world": {(0, 1), (0, 2), (0, 5), (1, 2), (1, 3), (1, 4), (1, 5), (2, 3), (2, 4), (2, 5), (3, 4), (4, 5)},
    "random_regular": {(0, 1), (0, 2), (0, 3), (1, 4), (1, 5), (2, 4), (2, 5), (3, 4), (3, 5)},
}


def test_erdos_renyi_graphs_have_the_density_they_promise() -> None:
    pairs = 200 * 199 / 2
    for p in ("1/10", 0.5, "9/10"):
        found = len(topology("erdos_renyi", 200, p=p, seed=3).links) / 2
        share = float(Fraction(str(p)))
        assert abs(found - pairs * share) < 4 * (pairs * share * (1 - share)) ** 0.5


def test_every_pair_of_an_erdos_renyi_graph_is_equally_likely() -> None:
    graphs = (topology("erdos_renyi", 5, p="1/3", seed=seed) for seed in range(3000))
    counts = Counter((i, j) for graph in graphs for i, j, _ in graph.links if i < j)
    assert len(counts) == 10
    assert all(abs(found - 1000) < 4 * (3000 * 2 / 9) ** 0.5 for found in counts.values())


def test_sparse_erdos_renyi_graphs_are_drawn_without_looking_at_every_pair() -> None:
    links, calls = effort(lambda: topology("erdos_renyi", 100_000, p="1/100000").links)
    assert abs(len(links) / 2 - 50_000) < 1000
    assert calls < 10 * len(links)


@pytest.mark.parametrize(("n", "degree"), [(5, 4), (10, 3), (10, 7), (50, 6), (31, 2), (1000, 5)])
def test_random_regular_graphs_are_regular(n: int, degree: int) -> None:
    graph = topology("random_regular", n, degree=degree)
    assert set(Counter(i for i, _, _ in graph.links).values()) == {degree}


def test_random_regular_graphs_of_six_nodes_are_all_found_and_about_equally_often() -> None:
    """Cubic graphs of six nodes: the prism has 60 labellings, K33 has 10."""
    kinds = Counter(
        nx.is_bipartite(undirected(topology("random_regular", 6, degree=3, seed=seed))) for seed in range(700)
    )
    assert 60 < kinds[True] < 140


def test_small_worlds_keep_their_number_of_edges_and_rewire_as_many_as_promised() -> None:
    ring = topology("small_world", 500, p=0)
    world = topology("small_world", 500, p="1/5", seed=2)
    assert len(world.links) == len(ring.links) == 2000
    moved = len(set(ring.links) - set(world.links)) / 2
    assert abs(moved - 200) < 4 * (1000 * 0.2 * 0.8) ** 0.5
    assert len(topology("small_world", 5, p=1).links) == 20


# ---- options ----


def test_options_are_stored_in_one_form() -> None:
    assert topology("circulant", 10, offsets=[13, 1]).options == (("offsets", (1, 3)),)
    assert topology("circulant", 10, offsets="1,3") == topology("circulant", 10, offsets=(3, 9))
    assert topology("erdos_renyi", 9, p=0.25, seed="4").options == (("p", "1/4"), ("seed", 4))
    assert topology("grid", 12).options == ()
    assert topology("grid", 12, shape="3x4") != topology("grid", 12)
    assert topology("circulant", 9).options == (("offsets", (1, 2)),)
    by_text = topology("cayley_abelian", 12, shape="3x4", generators="2,1,0,2")
    assert by_text.options == (("generators", (0, 2, 1, 3)), ("shape", (3, 4)))
    assert topology("cayley_abelian", 12, shape=[3, 4], generators=[(0, 2), (1, 3), (2, 1)]) == by_text
    assert topology("cayley_dihedral", 12, rotations=[5, 7], reflections=6).options == (
        ("reflections", (0,)),
        ("rotations", (1,)),
    )
    for name, options in [
        ("cayley_abelian", {"shape": (3, 3), "generators": (1, 0, 1, 1)}),
        ("hamming", {"d": 2}),
        ("circulant", {"offsets": (1, 4)}),
        ("torus", {"shape": (3, 3)}),
        ("small_world", {"p": "1/3"}),
    ]:
        graph = topology(name, 9, **options)
        assert topology(name, 9, **dict(graph.options)) == graph
        assert pickle.loads(pickle.dumps(graph)) == graph
        assert pickle.loads(pickle.dumps(graph)).spectrum == graph.spectrum


def test_the_options_are_part_of_what_a_graph_says() -> None:
    assert repr(topology("circulant", 10, offsets=(1, 3))) == "Topology('circulant', n=10, offsets=(1, 3), 20 edges)"
    assert repr(topology("one_way_ring", 4)) == "Topology('one_way_ring', n=4, 4 links)"
    a, b = topology("circulant", 10, offsets=(1, 3)), topology("circulant", 10, offsets=(1, 2))
    assert a != b
    assert a.spectrum != b.spectrum
    forged = Topology("circulant", 10, b.links, a.options)
    assert forged.spectrum == Topology("matrix", 10, b.links).spectrum
    assert Topology("circulant", 10, a.links, (("offsets", (10,)),)).spectrum.verified


@pytest.mark.parametrize(
    ("name", "n", "options", "error", "words"),
    [
        ("chain", 4, {"offsets": (1,)}, ValueError, "topology chain: unknown option 'offsets'; this family has none"),
        ("circulant", 9, {"offset": 1}, ValueError, "unknown option 'offset'; known: offsets"),
        ("circulant", 9, {"offsets": (1, 9)}, ValueError, "9 joins nodes of a ring of 9 to themselves"),
        ("circulant", 9, {"offsets": ()}, ValueError, "offsets is empty"),
        ("circulant", 9, {"offsets": (1, -2)}, ValueError, "offsets = -2; expected at least 1"),
        (
            "circulant",
            9,
            {"offsets": (1, 2.5)},
            TypeError,
            "topology circulant: offsets = 2.5; expected a whole number",
        ),
        ("circulant", 9, {"offsets": None}, TypeError, "offsets = None; expected a list of whole numbers"),
        ("grid", 12, {"shape": (3, 5)}, ValueError, "shape = (3, 5) has 15 nodes; expected n = 12"),
        ("torus", 12, {"shape": (2, 6)}, ValueError, "shape = 2; expected at least 3"),
        ("torus", 12, {"shape": (3, 3)}, ValueError, "shape = (3, 3) has 9 nodes; expected n = 12"),
        ("erdos_renyi", 9, {"p": "3/2"}, ValueError, "p = 3/2; expected a probability from 0 to 1"),
        ("erdos_renyi", 9, {"p": "half"}, ValueError, "topology erdos_renyi: p is 'half', not a number"),
        ("erdos_renyi", 9, {"seed": -1}, ValueError, "seed = -1; expected at least 0"),
        ("erdos_renyi", 9, {"seed": True}, TypeError, "seed = True; expected a whole number"),
        ("small_world", 9, {"neighbours": 3}, ValueError, "neighbours = 3 with n = 9; expected an even number below n"),
        ("small_world", 6, {"neighbours": 6}, ValueError, "expected an even number below n"),
        (
            "random_regular",
            9,
            {"degree": 3},
            ValueError,
            "degree = 3 with n = 9; expected less than n, and n times degree",
        ),
        ("random_regular", 9, {"degree": 9}, ValueError, "expected less than n"),
        ("complete_bipartite", 9, {"left": 9}, ValueError, "left = 9 of n = 9 nodes; expected at most 8"),
        ("complete_bipartite", 9, {"left": 0}, ValueError, "left = 0; expected at least 1"),
    ],
)
def test_wrong_options(name: str, n: int, options: dict, error: type[Exception], words: str) -> None:
    with pytest.raises(error) as caught:
        topology(name, n, **options)
    assert words in str(caught.value)


# ---- large and lazy ----


def test_a_million_nodes_cost_nothing_until_asked() -> None:
    def asked() -> None:
        assert topology("wheel", 10**6).spectrum.largest == -(10**6)
        for name in ("chain", "ring"):
            graph = topology(name, 10**6)
            found = graph.spectrum
            assert found.n == 10**6
            assert len(found) == (10**6 if name == "chain" else 500_001)
            assert not found.verified
            assert found[0].number == 0
            assert found[-1].value == pytest.approx(-4)
            assert found.largest == found[-1].exact
            assert found.slowest == found[1].exact
            assert [e.multiplicity for e in found[1:4]] == ([1] * 3 if name == "chain" else [2] * 3)
            assert next(iter(found)).value == 0
            assert hash(graph) == hash(topology(name, 10**6))
            assert graph == topology(name, 10**6)
            assert len(repr(graph)) < 60

    _, calls = effort(asked)
    assert calls < 500_000


def test_lazy_spectra_are_those_that_are_proved() -> None:
    for name, n in product(("chain", "ring", "wheel"), (201, 202)):
        lazy, proved = topology(name, n).spectrum, spectrum(topology(name, n), proof=Proof.EXACT)
        assert tuple(lazy) == tuple(proved)
        assert lazy.values == proved.values
        assert (lazy.n, len(lazy), lazy.largest, lazy.slowest) == (n, len(proved), proved.largest, proved.slowest)
        assert tuple(lazy.nonzero) == tuple(proved.nonzero)
        assert tuple(lazy[2:9:3]) == tuple(proved[2:9:3])


def test_lists_of_tori_and_grids_make_no_expression_until_asked() -> None:
    def asked() -> None:
        for name, distinct in (("torus", 1_301), ("grid", 5_001)):
            found = topology(name, 10_000, shape=(100, 100)).spectrum
            assert (found.n, len(found), found[0].number) == (10_000, distinct, 0)
            assert found[distinct - 1].value == pytest.approx(-8, abs=0.01)

    _, calls = effort(asked)
    assert calls < 2_000_000


@pytest.mark.parametrize(("name", "shape"), [("grid", (12, 12)), ("torus", (12, 12)), ("grid", (6, 6, 3, 2))])
def test_lazy_sums_of_cosines_are_the_proved_ones(name: str, shape: tuple[int, ...]) -> None:
    """Among them are equal sums of different cosines, such as 2 cos 20° + 2 cos 100° + 2 cos 140° = 0."""
    graph = topology(name, int(np.prod(shape)), shape=shape)
    listed, proved = graph.closed_form(), spectrum(graph, proof=Proof.EXACT)
    assert [(number, times) for number, times in listed] == [(e.exact, e.multiplicity) for e in proved]


def test_a_spectrum_in_closed_form_needs_no_links() -> None:
    graph = topology("complete_bipartite", 10**5)
    assert graph.spectrum.as_dict()["n"] == 10**5
    assert repr(graph.spectrum) == "{0: 1, -50000: 99998, -100000: 1}"
    with pytest.raises(ValueError, match="n = 100000 has too many links, 5000000000 or more; expected at most 4000000"):
        graph.links  # noqa: B018
    with pytest.raises(ValueError, match="too many links"):
        topology("erdos_renyi", 10**5, p=1)


def test_long_spectra_are_printed_in_part() -> None:
    text = repr(topology("chain", 3000).spectrum)
    assert "… (2976 more)" in text
    assert text.endswith("-4*sin(2999*pi/6000)**2: 1}")


def test_a_graph_without_links_has_no_slowest_eigenvalue() -> None:
    with pytest.raises(ValueError, match="all eigenvalues are 0"):
        topology("chain", 1).spectrum.slowest  # noqa: B018


@pytest.mark.parametrize(
    ("name", "n", "options", "words"),
    [
        ("johnson", 11, {}, "n = 11 with k = 2; expected a number of 2-subsets, such as 10 (of a set of 5) or 15 (of"),
        ("johnson", 10, {"k": 0}, "k = 0; expected at least 1"),
        ("johnson", 10, {"k": "two"}, "k = 'two'; expected a whole number"),
        ("kneser", 10, {"k": 3}, "3-subsets of a set of 5: no two are disjoint; expected n >= 20"),
        ("hamming", 10, {}, "n = 10 with d = 2; expected a whole number to the power 2, such as 9 (words of 2 of 3"),
        ("hamming", 10, {"d": 10**9}, "such as 2^1000000000 or more"),
        ("paley", 11, {}, "n = 11; expected a prime power that leaves 1 on division by 4, such as 9 or 13"),
        ("paley", 45, {}, "such as 41 or 49"),
        ("complete_multipartite", 6, {"parts": (2, 3)}, "parts = (2, 3) are 2 of 5 nodes; expected two or more of n = 6"),
        ("complete_multipartite", 6, {"parts": 6}, "parts = (6,) are 1 of 6 nodes"),
        ("complete_multipartite", 6, {"parts": (6, 0)}, "parts = 0; expected at least 1"),
        ("circular_ladder", 7, {}, "n = 7; expected an even number, such as 6 or 8"),
        ("petersen", 12, {"step": 3}, "step = 3; expected at most 2"),
        ("cayley_abelian", 12, {"shape": (3, 5)}, "shape = (3, 5) has 15 elements; expected n = 12"),
        ("cayley_abelian", 12, {"shape": (3, 4), "generators": "1,2,3"}, "generators = (1, 2, 3); expected 2 numbers for each"),
        ("cayley_abelian", 12, {"shape": (3, 4), "generators": "3,4"}, "found (3, 4), which joins nodes to themselves"),
        ("cayley_abelian", 12, {"shape": (3, 4), "generators": [(1, 0), 2]}, "found 2; expected 2 numbers"),
        ("cayley_abelian", 12, {"generators": []}, "generators is empty; expected at least one"),
        ("cayley_abelian", 12, {"generators": 5.5}, "generators = 5.5; expected a list"),
        ("cayley_dihedral", 12, {"rotations": 6}, "joins nodes to themselves; leave it out"),
        ("cayley_dihedral", 12, {"rotations": (), "reflections": ""}, "found neither rotations nor reflections"),
    ],
)  # fmt: skip
def test_options_that_make_no_graph_are_refused_in_one_line(
    name: str, n: int, options: dict[str, object], words: str
) -> None:
    with pytest.raises((ValueError, TypeError)) as caught:
        topology(name, n, **options)
    assert str(caught.value).startswith(f"topology {name}: ")
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("n", [5, 9, 13, 25, 27 + 2, 49, 81])
def test_paley_graphs_are_strongly_regular_and_their_own_complements(n: int) -> None:
    """All pairs that are joined have (n - 5)/4 common neighbours, all others (n - 1)/4."""
    graph = undirected(topology("paley", n))
    near = {i: set(graph[i]) for i in graph}
    for i in graph:
        for j in range(i):
            assert len(near[i] & near[j]) == ((n - 5) // 4 if j in near[i] else (n - 1) // 4)


def test_the_names_of_networkx_make_equal_graphs() -> None:
    for other, name in TOPOLOGY.also.items():
        n = size(name, 10)
        assert topology(other, n) == topology(name, n)
        assert topology(other, n).name == name
        assert getattr(synchain.graphs, other)(n) == getattr(synchain.graphs, name)(n)
        assert other in dir(synchain.graphs)
        assert other not in names()
    assert {"path": "chain", "cycle": "ring"}.items() <= TOPOLOGY.also.items()
    assert Scene(topology=synchain.graphs.path(3)) == Scene(topology=synchain.graphs.chain(3))
    assert closed_form("path").text == closed_form("chain").text


def test_editors_see_the_options_of_a_family() -> None:
    assert str(inspect.signature(synchain.graphs.circulant)) == "(n: int, *, offsets=(1, 2))"
    assert str(inspect.signature(synchain.graphs.small_world)) == "(n: int, *, neighbours=4, p='1/10', seed=0)"
    assert str(inspect.signature(synchain.graphs.path)) == "(n: int)"
    assert "name" in inspect.signature(type(synchain.graphs.circulant)).parameters


def test_functions_of_a_family_may_have_further_arguments_with_defaults() -> None:
    def edges(n: int) -> list[tuple[int, int, int]]:
        return [(i, i + 1, 1) for i in range(n - 1)]

    path = Family(edges, minimum=1, count=lambda n, step=1: n - step, name="path of test")
    assert path(4).link_count == 6
    with pytest.raises(ValueError, match="count has the argument 'step', which is no option of edges"):
        Family(edges, minimum=1, count=lambda n, step: n - step, name="path of test")
