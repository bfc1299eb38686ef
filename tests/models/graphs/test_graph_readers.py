"""Graphs from edges, networkx, SciPy and files; wrong and hostile input is refused in plain words."""

from __future__ import annotations

import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pytest
import scipy.sparse
import sympy as sp

from synchain.models.graphs.families import topology
from synchain.models.graphs.graph_products import cartesian, complement, weighted
from synchain.models.graphs.readers import as_topology, from_edges, from_graph, from_sparse, read_edges, read_graphml
from synchain.models.graphs.topology import Topology, from_matrix
from synchain.models.inputs.rational_text import FILE_LIMIT
from synchain.models.networks.model import union_of
from synchain.models.scenes.file import load_scene
from synchain.models.scenes.scene import Scene
from synchain.models.symmetries.clusters import orbital_partitions

ONE = Fraction(1)


def adjacency(graph: Topology) -> np.ndarray:
    found = np.array([[float(x) for x in row] for row in graph.rows])
    return found - np.diag(np.diag(found))


def test_edges_by_hand() -> None:
    assert from_edges([(0, 1), (1, 2)]).links == topology("chain", 3).links
    assert from_edges([(0, 1, "1/2"), [2, 1, 0.1]], directed=True).links == ((1, 0, ONE / 2), (1, 2, ONE / 10))
    assert from_edges([(0, 1)], n=4).n == 4
    assert from_edges([], n=2).links == ()
    assert from_edges((i, i + 1) for i in range(3)).links == topology("chain", 4).links
    assert from_edges(np.array([[0, 1], [1, 2]])).n == 3


@pytest.mark.parametrize(
    ("edges", "labels"),
    [
        ([(1, 2), (2, 3), (3, 1)], [1, 2, 3]),
        ([(7, 3), (3, 5.0)], [3, 5, 7]),
        (np.array([[10, 30], [30, 20]]), [10, 20, 30]),
        ([("b", "a"), ("a", "c")], ["b", "a", "c"]),
        ([((0, 0), (0, 1)), ((0, 1), "x")], ["(0, 0)", "(0, 1)", "x"]),
        ([(1, "1")], ["1", "'1'"]),
    ],
)
def test_nodes_are_labels(edges: Any, labels: list, tmp_path: Path) -> None:
    graph = from_edges(edges)
    assert list(graph.labels) == labels
    assert graph.components == 1
    found = from_graph(nx.Graph([*map(tuple, edges)]))
    assert set(found.labels) == set(labels)
    assert found.components == 1
    again = from_graph(graph.to_networkx(), name=graph.name)
    assert again == graph
    scene = Scene("mass", "spring", graph)
    assert Scene.from_dict(scene.as_dict()) == scene
    scene.save(tmp_path / "scene.toml")
    assert load_scene(tmp_path / "scene.toml") == scene


def test_a_file_and_the_same_edges_make_one_graph(tmp_path: Path) -> None:
    (tmp_path / "edges").write_text("5 2\n2 9 1/2\n")
    assert read_edges(tmp_path / "edges") == from_edges([(5, 2), (2, 9, "1/2")], name="edges")


def test_layers_with_different_labels() -> None:
    first, second = from_edges([("a", "b")]), from_edges([("b", "a")])
    with pytest.raises(ValueError, match=r"nodes \('a', 'b'\) and \('b', 'a'\); expected one order of the same labels"):
        union_of((first, second), "both")
    assert list(union_of((first, topology("chain", 2)), "both").labels) == ["a", "b"]


@pytest.mark.parametrize(
    ("edges", "n", "error", "words"),
    [
        ([(0, 0)], None, ValueError, "edges: edge 0 - 0 joins a node to itself"),
        ([(0, 1), (1, 0)], None, ValueError, "edge 1 - 0 is given twice; expected each edge once: add the weights up"),
        ([(0, 1, 0)], None, ValueError, "edge 0 - 1 has weight 0"),
        ([(0, 1, "x")], None, ValueError, "is 'x', not a number"),
        ([(0, 1, float("nan"))], None, ValueError, "not finite"),
        ([(0,)], None, ValueError, "edge 1 is (0,); expected (i, j) or (i, j, weight)"),
        (["01"], None, ValueError, "edge 1 is '01'"),
        ([(0, -1)], 3, ValueError, "edge 1: found the node -1; expected one of 0, 1, 2"),
        ([(0, [1])], None, TypeError, "edge 1: node: found [1] (list); expected a label: a number, a text or a tuple"),
        ([(0, None)], None, TypeError, "edge 1: node: found None"),
        ([(1, 2), (2, 3)], 3, ValueError, "edge 2: found the node 3; expected one of 0, 1, 2"),
        ([("a", "b")], 9, ValueError, "edge 1: found the node 'a'; expected one of 0 … 8"),
        ([], None, ValueError, "n = 0; expected at least one node"),
    ],
)
def test_wrong_edges(edges: list, n: int | None, error: type[Exception], words: str) -> None:
    with pytest.raises(error) as caught:
        from_edges(edges, n)
    assert words in str(caught.value)


def test_networkx_graphs() -> None:
    graph = nx.petersen_graph()
    assert repr(from_graph(graph).spectrum) == "{0: 1, -2: 5, -5: 4}"
    named = nx.Graph()
    named.add_weighted_edges_from([("b", "a", 0.1), ("a", "c", 2)])
    found = from_graph(named)
    assert found.links == ((0, 1, ONE / 10), (1, 0, ONE / 10), (1, 2, ONE * 2), (2, 1, ONE * 2))
    assert from_graph(named, weight=None).links[0][2] == 1
    with pytest.raises(ValueError, match="no edge has the attribute 'weigth'; found weight"):
        from_graph(named, weight="weigth")
    many = nx.MultiGraph([(0, 1), (0, 1), (1, 2)])
    assert from_graph(many).links[0] == (0, 1, ONE * 2)
    empty = nx.Graph()
    empty.add_nodes_from("xyz")
    assert from_graph(empty) == Topology("graph", 3, (), labels="xyz") != Topology("graph", 3, ())


def test_an_edge_of_a_directed_graph_acts_on_its_second_node() -> None:
    graph = nx.DiGraph([(0, 1), (1, 2)])
    assert from_graph(graph).links == topology("feed_forward", 3).links
    assert adjacency(from_graph(graph)) == pytest.approx(nx.to_numpy_array(graph).T)


@pytest.mark.parametrize(
    ("graph", "error", "words"),
    [
        (nx.Graph([(0, 0)]), ValueError, "edge 0 - 0 joins a node to itself"),
        (nx.Graph([("a", "b", {"weight": "heavy"})]), ValueError, "weight of edge 'a' - 'b' is 'heavy', not a number"),
        (nx.Graph([(0, 1, {"weight": None})]), TypeError, "is None"),
        (nx.Graph(), ValueError, "n = 0"),
        ([[0, 1], [1, 0]], TypeError, "graph is a list; expected a networkx graph"),
    ],
)
def test_wrong_networkx_graphs(graph: Any, error: type[Exception], words: str) -> None:
    with pytest.raises(error) as caught:
        from_graph(graph)
    assert words in str(caught.value)


@pytest.mark.parametrize("kind", ["coo_array", "csr_matrix", "csc_array", "lil_array", "dok_array"])
def test_sparse_matrices(kind: str) -> None:
    make = getattr(scipy.sparse, kind)
    rows = np.array([[-0.5, 0.5, 0], [0.1, -0.3, 0.2], [0, 0, 0]])
    graph = from_sparse(make(rows))
    assert graph.links == from_matrix(rows).links == ((0, 1, ONE / 2), (1, 0, ONE / 10), (1, 2, ONE / 5))
    assert from_sparse(make(rows - np.diag(np.diag(rows))), adjacency=True).links == graph.links
    assert from_sparse(make(-nx.laplacian_matrix(nx.path_graph(5)))).links == topology("chain", 5).links


def test_sparse_entries_that_are_stored_twice_add_up() -> None:
    matrix = scipy.sparse.coo_array(([1, 1, -2, 2, -2], ([0, 0, 0, 1, 1], [1, 1, 0, 0, 1])), shape=(2, 2))
    assert from_sparse(matrix).links == ((0, 1, ONE * 2), (1, 0, ONE * 2))
    thirds = np.full((3, 3), 1 / 3) - np.eye(3)
    assert from_sparse(scipy.sparse.coo_array(thirds)).components == 1


@pytest.mark.parametrize(
    ("matrix", "adjacent", "error", "words"),
    [
        (np.eye(2), False, TypeError, "matrix is a ndarray; expected a SciPy sparse matrix"),
        (scipy.sparse.coo_array([[1, -1]]), False, ValueError, "1 rows and 2 columns; expected a square matrix"),
        (scipy.sparse.coo_array([[-1, 2], [0, 0]]), False, ValueError, "row 1 sums to 1; expected 0"),
        (scipy.sparse.coo_array([[-1, 1], [0, 0]]), True, ValueError, "entry (1, 1) is -1; expected no diagonal"),
        (scipy.sparse.coo_array([[-1j, 1j], [0, 0]]), False, ValueError, "is complex"),
    ],
)
def test_wrong_sparse_matrices(matrix: Any, adjacent: bool, error: type[Exception], words: str) -> None:
    with pytest.raises(error) as caught:
        from_sparse(matrix, adjacency=adjacent)
    assert words in str(caught.value)


def test_sympy_matrices_and_numbers() -> None:
    half = sp.Rational(1, 2)
    graph = from_matrix(sp.ImmutableSparseMatrix([[-half, half], [1, -1]]))
    assert graph.links == ((0, 1, ONE / 2), (1, 0, ONE))
    assert from_edges([(0, 1, half)]).links[0][2] == ONE / 2


# ---- edge lists ----


def test_edge_files(tmp_path: Path) -> None:
    path = tmp_path / "graph.edges"
    path.write_text("\ufeff# three, and one alone\n10 2 1/2\n2, 3  # no weight\n\n7\n", encoding="utf-8")
    graph = read_edges(path)
    assert (graph.name, graph.n) == ("graph.edges", 4)
    assert graph.links == ((0, 1, ONE), (0, 3, ONE / 2), (1, 0, ONE), (3, 0, ONE / 2))
    path.write_text("zoe adam 2\nadam 10\n")
    assert read_edges(str(path), directed=True).links == ((1, 0, ONE * 2), (2, 1, ONE))
    nx.write_weighted_edgelist(nx.Graph([(0, 1, {"weight": 0.25}), (1, 2, {"weight": 4})]), path)
    assert read_edges(path).links == ((0, 1, ONE / 4), (1, 0, ONE / 4), (1, 2, ONE * 4), (2, 1, ONE * 4))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (b"", "n = 0; expected at least one node"),
        (b"1 2 3 4\n", "line 1 has 4 words; expected two nodes and perhaps a weight"),
        (b"1 2 {'weight': 3}\n", "line 1 has 4 words"),
        (b"1 2 heavy\n", "line 1 is 'heavy', not a number"),
        (b"1 2\n2 1\n", "edge 2 - 1 is given twice"),
        (b"1 1\n", "edge 1 - 1 joins a node to itself"),
        (b"\xff\xfe\x00", "is not UTF-8"),
    ],
)
def test_wrong_edge_files(tmp_path: Path, text: bytes, words: str) -> None:
    path = tmp_path / "graph.edges"
    path.write_bytes(text)
    with pytest.raises(ValueError, match=r"graph\.edges") as caught:
        read_edges(path)
    assert words in str(caught.value)


@pytest.mark.parametrize("read", [read_edges, read_graphml])
def test_missing_folders_and_huge_files(tmp_path: Path, read: Any) -> None:
    with pytest.raises(FileNotFoundError, match="does not exist"):
        read(tmp_path / "absent")
    with pytest.raises(ValueError, match="is a folder or device"):
        read(tmp_path)
    huge = tmp_path / "huge"
    with huge.open("wb") as stream:
        stream.truncate(FILE_LIMIT + 1)
    with pytest.raises(ValueError, match=f"expected at most {FILE_LIMIT}"):
        read(huge)


# ---- GraphML ----


@pytest.mark.parametrize("kind", [nx.Graph, nx.DiGraph])
def test_graphml_files_of_networkx(tmp_path: Path, kind: type) -> None:
    graph = kind()
    graph.add_nodes_from(["c", "a", "b", "alone"])
    graph.add_weighted_edges_from([("a", "b", 0.1), ("b", "c", 3), ("a", "c", 1.5)])
    path = tmp_path / "graph.graphml"
    nx.write_graphml(graph, path)
    found = read_graphml(path)
    assert found.links == from_graph(graph).links
    assert (found.n, found.name) == (4, "graph.graphml")
    assert {weight for _, _, weight in read_graphml(path, weight="other").links} == {1}


HEAD = '<graphml xmlns="http://graphml.graphdrawing.org/xmlns">'
NODES = '<node id="a"/><node id="b"/>'


def test_graphml_by_hand(tmp_path: Path) -> None:
    path = tmp_path / "g.graphml"
    path.write_text(
        f'<?xml version="1.0" encoding="UTF-8"?><!-- by hand -->{HEAD}'
        '<key id="w" for="edge" attr.name="weight" attr.type="string"><default>2</default></key>'
        f'<graph edgedefault="undirected">{NODES}<node id="c"><data key="w">9</data></node>'
        '<edge source="a" target="b"/><edge source="b" target="c" directed="true"><data key="w"> 1/3 </data></edge>'
        "</graph></graphml>",
        encoding="utf-8",
    )
    assert read_graphml(path).links == ((0, 1, ONE * 2), (1, 0, ONE * 2), (2, 1, ONE / 3))


BOMB = '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (f"{BOMB}{HEAD}<graph>&b;</graph></graphml>", "declares a document type or entities"),
        (f'<!DOCTYPE g SYSTEM "file:///etc/passwd">{HEAD}<graph/></graphml>', "declares a document type"),
        (f"<?a <!-- ?>{BOMB}<?b --> ?>{HEAD}<graph/></graphml>", "declares a document type"),
        (f"{HEAD}<graph>&x;</graph></graphml>", "is no XML: undefined entity"),
        ("a b\n", "is no XML"),
        ("", "is no XML"),
        ("<svg/>", "holds 0 graphs in <svg>; expected one, not nested, in <graphml>"),
        (f"{HEAD}</graphml>", "holds 0 graphs"),
        (f'{HEAD}<graph><node id="a"><graph/></node></graph></graphml>', "holds 2 graphs"),
        (f"{HEAD}<graph/></graphml>", "n = 0; expected at least one node"),
        (f"{HEAD}<graph><node/></graph></graphml>", "<node> has no 'id'"),
        (f'{HEAD}<graph>{NODES}<node id="a"/></graph></graphml>', "two nodes of one id"),
        (f'{HEAD}<graph>{NODES}<edge source="a"/></graph></graphml>', "<edge> has no 'target'"),
        (f'{HEAD}<graph>{NODES}<edge source="a" target="z"/></graph></graphml>', "to node 'z', which it does not list"),
        (f'{HEAD}<graph>{NODES}<edge source="a" target="a"/></graph></graphml>', "joins a node to itself"),
        (f"{HEAD}<graph>{NODES}<hyperedge/></graph></graphml>", "has a hyperedge; expected edges of two nodes"),
    ],
)
def test_wrong_graphml(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "g.graphml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=r"g\.graphml") as caught:
        read_graphml(path)
    assert words in str(caught.value)


def test_utf_16_hides_no_document_type(tmp_path: Path) -> None:
    path = tmp_path / "g.graphml"
    path.write_bytes(f'<?xml version="1.0" encoding="UTF-16"?>{BOMB}{HEAD}<graph/></graphml>'.encode("utf-16"))
    with pytest.raises(ValueError, match="is not UTF-8"):
        read_graphml(path)


# ---- one door for all of them ----


def test_everything_that_stands_for_a_graph_is_taken_where_a_graph_is() -> None:
    chain = topology("chain", 3)
    rows = [[-1, 1, 0], [1, -2, 1], [0, 1, -1]]
    given = [
        nx.path_graph(3),
        scipy.sparse.csr_array(np.array(rows)),
        scipy.sparse.lil_matrix(np.array(rows)),
        np.array(rows),
        np.array(rows, float),
        np.matrix(rows),
        sp.Matrix(rows),
        sp.ImmutableMatrix(rows),
    ]
    assert as_topology("graph", chain) is chain
    for value in given:
        assert as_topology("graph", value).links == chain.links
        assert Scene(topology=value).topology.links == chain.links
        assert cartesian(value, chain).links == cartesian(chain, chain).links
        assert complement(value).links == complement(chain).links
        assert weighted(value, 3).links == weighted(chain, 3).links
        assert len(orbital_partitions(value)) == len(orbital_partitions(chain))
    pair = Scene(topology=chain, oscillator="harmonic", initial={"x": [0.1, 0.2, 0.3], "v": 0.0})
    kept = pair.replace(topology=nx.cycle_graph(3))
    assert kept.topology.links == topology("ring", 3).links
    assert kept.initial == pair.initial  # as many nodes as before


@pytest.mark.parametrize("value", [None, 3, "chain", [(0, 1)], [[-1, 1], [1, -1]], {0: [1]}])
def test_what_stands_for_no_graph_is_refused(value: object) -> None:
    with pytest.raises(TypeError, match=r"^graph: found .*; expected a graph, e\.g\. chain\(4\), a networkx graph or"):
        as_topology("graph", value)


def test_an_adjacency_matrix_is_no_connectivity_matrix() -> None:
    for value in (np.array([[0, 1], [1, 0]]), scipy.sparse.csr_array([[0, 1], [1, 0]])):
        with pytest.raises(ValueError, match="row 1 sums to 1; expected 0"):
            Scene(topology=value)


def test_graphs_go_to_networkx_and_back() -> None:
    for graph in (topology("petersen", 10), topology("feed_forward", 4), weighted(topology("ring", 5), "2/3")):
        made = graph.to_networkx()
        assert made.is_directed() != graph.symmetric
        assert list(made) == list(range(graph.n))
        assert from_graph(made).links == graph.links
    assert Topology("lonely", 3, ()).to_networkx().number_of_nodes() == 3
    assert {type(data["weight"]) for _, _, data in topology("chain", 3).to_networkx().edges(data=True)} == {int}
    one_way = from_edges([(0, 1)], directed=True).to_networkx()
    assert list(one_way.edges) == [(0, 1)]  # 1 feels 0


def test_without_networkx_the_remedy_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "networkx", None)
    with pytest.raises(ModuleNotFoundError, match=r'install it: python -m pip install "synchain\[graphs\]"'):
        topology("chain", 3).to_networkx()
