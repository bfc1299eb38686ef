"""Graphs by name, from matrices and from files; wrong input is refused in plain words."""

from __future__ import annotations

import subprocess
import sys
from collections import Counter
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from itertools import product
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from effort import effort
from family_sizes import cases, has
from hypothesis import given, settings
from hypothesis import strategies as st

from synchain.models.graphs.families import family, names, topology
from synchain.models.graphs.topology import Topology, from_matrix, read_matrix
from synchain.models.inputs.rational_text import FILE_LIMIT
from synchain.models.scenes.scene import Scene
from synchain.models.scenes.warnings import zero_multiplicity

ONE = Fraction(1)
PAIRS_OF_EIGHT = {(0, 2), (1, 6), (3, 5), (4, 7)}


@pytest.mark.parametrize("name", names())
def test_every_family_says_what_it_is_and_where_it_comes_from(name: str) -> None:
    made = family(name)
    assert made.summary
    assert made.source
    assert made.minimum >= 1
    graph = topology(name, made.minimum)
    assert graph.n == made.minimum
    with pytest.raises(ValueError, match=f"topology {name}: n = {made.minimum - 1}; expected at least"):
        topology(name, made.minimum - 1)


@pytest.mark.parametrize("name", names())
def test_every_family_has_the_sizes_that_it_should(name: str) -> None:
    for n in range(family(name).minimum, 56):
        if has(name, n):
            assert topology(name, n).n == n
        else:
            with pytest.raises(ValueError, match=f"topology {name}: found n = {n}.*; expected "):
                topology(name, n)


def test_float_rows_are_closed_exactly_and_real_errors_stay_errors() -> None:
    random = np.random.default_rng(3).random((4, 4))
    np.fill_diagonal(random, 0.0)
    graph = from_matrix(random - np.diag(random.sum(axis=1)))
    assert all(sum(row) == 0 for row in graph.rows)
    assert abs(graph.rows[0][1] - Fraction(float(random[0, 1]))) < Fraction(1, 10**15)
    with pytest.raises(ValueError, match="row 1 sums to"):
        from_matrix([[-0.1, 0.1001], [0.1, -0.1]])
    with pytest.raises(ValueError, match="row 1 sums to"):
        from_matrix([[-(10**14), 10**14 + 1], [1, -1]])


@pytest.mark.parametrize(("name", "n"), cases(3, 4, 9))
def test_every_family_gives_a_connected_graph_with_zero_row_sums(name: str, n: int) -> None:
    graph = topology(name, n)
    assert graph.components == 1 or not family(name).connected
    assert all(sum(row) == 0 for row in graph.rows)
    assert graph.symmetric == (graph.matrix == graph.matrix.T)
    assert graph.symmetric != family(name).directed
    assert from_matrix(graph.matrix).links == graph.links
    assert graph.matrix == sp.ImmutableDenseMatrix(
        n, n, lambda i, j: sp.Rational(graph.rows[i][j].numerator, graph.rows[i][j].denominator)
    )


def test_the_four_families_by_hand() -> None:
    def neighbours(name: str) -> set[tuple[int, int]]:
        return {(i, j) for i, j, weight in topology(name, 4).links if weight == 1}

    both = {(0, 1), (1, 0), (1, 2), (2, 1), (2, 3), (3, 2)}
    assert neighbours("chain") == both
    assert neighbours("ring") == both | {(0, 3), (3, 0)}
    assert neighbours("star") == {(0, 1), (0, 2), (0, 3), (1, 0), (2, 0), (3, 0)}
    assert neighbours("complete") == {(i, j) for i in range(4) for j in range(4) if i != j}


def undirected(name: str, n: int) -> set[tuple[int, int]]:
    return {(i, j) for i, j, _ in topology(name, n).links if i < j}


def test_tree_and_grid_by_hand() -> None:
    assert undirected("tree", 6) == {(0, 1), (0, 2), (1, 3), (1, 4), (2, 5)}
    assert undirected("grid", 6) == {(0, 1), (1, 2), (3, 4), (4, 5), (0, 3), (1, 4), (2, 5)}
    assert topology("grid", 7).links == topology("chain", 7).links


@pytest.mark.parametrize(
    ("n", "shape"), [(1, (1, 1)), (12, (3, 4)), (16, (4, 4)), (13, (1, 13)), (100_000, (250, 400))]
)
def test_the_grid_is_as_square_as_its_number_of_nodes_allows(n: int, shape: tuple[int, int]) -> None:
    assert family("grid").sides(n) == shape


def test_the_grid_has_the_eigenvalues_of_a_sum_of_chains() -> None:
    rows, columns = (np.array(topology("chain", k).spectrum.evaluate(17), float) for k in (3, 4))
    found = topology("grid", 12).spectrum
    listed = np.repeat(np.array(found.values), found.multiplicities)
    assert np.sort(listed) == pytest.approx(np.sort((rows[:, None] + columns[None, :]).ravel()), abs=1e-14)


@pytest.mark.parametrize("n", [4, 5, 6, 7, 50, 1001])
def test_random_cubic_nodes_have_three_neighbours(n: int) -> None:
    degree = Counter(i for i, _, _ in topology("random_cubic", n).links)
    assert sorted(degree.values()) == [2] * (n % 2) + [3] * (n - n % 2)


def test_random_cubic_graphs_are_the_same_on_every_machine() -> None:
    assert undirected("random_cubic", 8) - undirected("ring", 8) == PAIRS_OF_EIGHT


def test_random_cubic_pairs_are_random() -> None:
    """No pattern: the distances round the ring of a random matching are spread evenly."""
    n = 4000
    pairs = undirected("random_cubic", n) - undirected("ring", n)
    distance = [min((j - i) % n, (i - j) % n) for i, j in pairs]
    assert abs(np.mean(distance) - n / 4) < 4 * n / np.sqrt(48 * len(distance))


def test_the_connectivity_matrix_of_the_chain_is_the_published_one() -> None:
    assert topology("chain", 4).matrix == sp.Matrix([[-1, 1, 0, 0], [1, -2, 1, 0], [0, 1, -2, 1], [0, 0, 1, -1]])


def test_a_long_chain_is_built_at_once() -> None:
    links, calls = effort(lambda: topology("chain", 10_000).links)
    assert len(links) == 19_998
    assert calls < 8 * len(links)


def test_too_many_links_are_refused() -> None:
    random, complete = (replace(family(name), link_limit=100) for name in ("erdos_renyi", "complete"))
    with pytest.raises(ValueError, match="erdos_renyi: n = 30 has too many links, 434 or more; expected at most 100"):
        random(30)
    regular = replace(family("random_regular"), link_limit=100)
    with pytest.raises(
        ValueError, match="random_regular: n = 30 has too many links, 120 or more; expected at most 100"
    ):
        regular(30, degree=4)
    assert len(regular(25, degree=4).links) == 100
    assert len(complete(10).links) == 90
    with pytest.raises(ValueError, match="complete: n = 11 has too many links, 110 or more; expected at most 100"):
        complete(11).links  # noqa: B018
    assert complete(5000).spectrum.largest == -5000


@pytest.mark.parametrize(
    ("name", "n", "error", "words"),
    [
        (
            "rnig",
            3,
            ValueError,
            f"unknown topology 'rnig'; known: cayley_abelian, cayley_dihedral, chain, {', '.join(names()[3:])}",
        ),
        ("", 3, ValueError, "unknown topology ''; known: "),
        ("clique", 3, ValueError, "; did you mean 'complete'?"),
        ("cycel", 3, ValueError, "; did you mean 'ring'?"),
        ("latice", 9, ValueError, "; did you mean 'grid'?"),
        ("../scene", 3, ValueError, "unknown topology '../scene'; known: "),
        (7, 3, TypeError, "topology name 7 is no text"),
        ("ring", 2, ValueError, "ring: n = 2; expected at least 3: a ring of two would join one pair twice"),
        ("chain", -1, ValueError, "n = -1; expected at least 1"),
        ("chain", 2.0, TypeError, "n = 2.0 is a float; expected an integer"),
        ("chain", True, TypeError, "n = True is a bool; expected an integer"),
        ("chain", "4", TypeError, "n = '4' is a str; expected an integer"),
    ],
)
def test_wrong_names_and_sizes(name: str, n: int, error: type[Exception], words: str) -> None:
    with pytest.raises(error) as caught:
        topology(name, n)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("n", "links", "words"),
    [
        (0, (), "n = 0; expected at least one node"),
        (2, ((0, 2, ONE),), "link 0 <- 2; expected two different nodes of 0 … 1"),
        (2, ((1, 1, ONE),), "link 1 <- 1; expected two different nodes"),
        (2, ((0, 1, ONE), (0, 1, ONE)), "link 0 <- 1 is repeated"),
        (2, ((1, 0, ONE), (0, 1, ONE)), "link 0 <- 1 is repeated or out of order"),
        (2, ((0, 1, Fraction(0)),), "has weight Fraction(0, 1); expected a Fraction other than 0"),
        (2, ((0, 1, 0.5),), "has weight 0.5; expected a Fraction"),
    ],
)
def test_a_topology_checks_itself(n: int, links: tuple, words: str) -> None:
    with pytest.raises(ValueError, match="topology x") as caught:
        Topology("x", n, links)
    assert words in str(caught.value)


def test_components_and_symmetry() -> None:
    one_way = Topology("x", 5, ((1, 0, ONE), (4, 3, ONE)))
    assert one_way.components == 3
    assert not one_way.symmetric
    uneven = Topology("x", 2, ((0, 1, ONE), (1, 0, Fraction(2))))
    assert not uneven.symmetric
    assert one_way.asymmetry == "one-way links, first from 1 to 2"
    assert uneven.asymmetry == "the weights 2 from 1 to 2 and 1 back"
    assert topology("complete", 3).asymmetry == topology("ring", 3).asymmetry == ""
    assert Topology("x", 3, ()).components == 3
    assert Topology("x", 3, ()).symmetric


@pytest.mark.parametrize(
    "half",
    ["1/2", " 0.5 ", "5e-1", ".5", 0.5, Decimal("0.5"), Fraction(1, 2), sp.Rational(1, 2), sp.Float("0.5"),
     np.float64(0.5), np.float32(0.5)],
)  # fmt: skip
def test_every_kind_of_number_is_read_exactly(half: object) -> None:
    graph = from_matrix([["-1/2", half], [1, -1]])
    assert graph.links == ((0, 1, Fraction(1, 2)), (1, 0, ONE))


def test_floats_mean_their_shortest_decimal() -> None:
    assert from_matrix([[-0.1, 0.1], [0.3, -0.3]]).links[0][2] == Fraction(1, 10)
    assert from_matrix(np.array([[-0.1, 0.1], [0.3, -0.3]], dtype=np.float32)).links[1][2] == Fraction(3, 10)
    assert from_matrix(np.array([[-2, 2], [2, -2]], dtype=np.int8)).links[0][2] == 2


@pytest.mark.parametrize(
    ("rows", "error", "words"),
    [
        ([], ValueError, "matrix is empty"),
        ([[]], ValueError, "row 1 has 0 entries; expected 1"),
        ([[0, 0]], ValueError, "row 1 has 2 entries; expected 1"),
        ([[0, 0], [0]], ValueError, "row 2 has 1 entries; expected 2"),
        (sp.zeros(2, 3), ValueError, "row 1 has 3 entries; expected 2"),
        ([[-1, 1], [1, 0]], ValueError, "row 2 sums to 1; expected 0, or the synchronous state"),
        ([[-1, 1], [1, 0]], ValueError, "set its diagonal entry 0 to -1"),
        (
            [[0, 1], [1, 0]],
            ValueError,
            "of an adjacency matrix take from_sparse(scipy.sparse.coo_array(A), adjacency=True)",
        ),
        ([[-1, "1/3"], [1, -1]], ValueError, "row 1 sums to -2/3"),
        ([[0, float("nan")], [0, 0]], ValueError, "entry (1, 2) is nan, not finite"),
        ([[0, 0], [float("-inf"), 0]], ValueError, "entry (2, 1) is -inf, not finite"),
        ([[np.float64("nan")]], ValueError, "is nan, not finite"),
        ([[sp.nan]], ValueError, "nan"),
        ([[sp.oo]], ValueError, "oo"),
        ([[Decimal("NaN")]], ValueError, "not finite"),
        ([["inf"]], ValueError, "is inf, not finite"),
        ([[1j]], ValueError, "is complex: 1j"),
        ([[sp.I]], ValueError, "is I, not a rational number"),
        ([[sp.sqrt(2)]], ValueError, "is sqrt(2), not a rational number"),
        ([[sp.Symbol("x")]], ValueError, "is x, not a rational number"),
        ([["1/0"]], ValueError, "a division by zero"),
        ([["1e999999999"]], ValueError, "not a number"),
        ([["1" * 5000]], ValueError, "(5000 characters)"),
        ([["1_000"]], ValueError, "'1_000', not a number"),
        ([["__import__('os')"]], ValueError, "not a number"),
        ([["2-2"]], ValueError, "'2-2', not a number"),
        ([[None]], TypeError, "is None, a NoneType"),
        ([[True]], TypeError, "is True, a bool"),
        (["01", "10"], TypeError, "row 1 is '01'; expected a list of numbers"),
        ([1, 2], TypeError, "row 1 is 1; expected a list of numbers"),
        ("chain", TypeError, "matrix is a str; expected rows of numbers"),
        (5, TypeError, "matrix is a int; expected rows of numbers"),
    ],
)
def test_wrong_matrices(rows: object, error: type[Exception], words: str) -> None:
    with pytest.raises(error) as caught:
        from_matrix(rows)  # type: ignore[arg-type]
    assert words in str(caught.value)


@given(st.lists(st.tuples(st.integers(0, 4), st.integers(0, 4), st.fractions()), max_size=12))
def test_links_become_rows_and_rows_become_links(found: list[tuple[int, int, Fraction]]) -> None:
    weights = {(i, j): weight for i, j, weight in found if i != j and weight}
    links = tuple((i, j, weights[i, j]) for i, j in sorted(weights))
    assert from_matrix(Topology("x", 5, links).rows).links == links


def test_a_matrix_file_is_read_exactly(tmp_path: Path) -> None:
    path = tmp_path / "graph.txt"
    path.write_text("\ufeff# three nodes\n-1/2, 0.5 0\n\n1  -1,0   # second\n 0, 3,-3\n", encoding="utf-8")
    graph = read_matrix(path)
    assert graph.name == "graph.txt"
    assert graph.links == ((0, 1, Fraction(1, 2)), (1, 0, ONE), (2, 1, Fraction(3)))
    assert read_matrix(str(path)) == graph


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (b"", "graph.txt is empty"),
        (b"# nothing\n", "graph.txt is empty"),
        (b"hello world\n", "row 1 has 2 entries; expected 1"),
        (b"hello\n", "entry (1, 1) is 'hello', not a number"),
        (b"-1,,1\n", "line 1 has an empty entry between commas"),
        (b"nan\n", "entry (1, 1) is nan, not finite"),
        (b"1\n", "row 1 sums to 1"),
        (b"\xff\xfe\x00", "is not UTF-8"),
        (b"(1).__class__\n", "not a number"),
    ],
)
def test_wrong_matrix_files(tmp_path: Path, text: bytes, words: str) -> None:
    path = tmp_path / "graph.txt"
    path.write_bytes(text)
    with pytest.raises(ValueError, match=r"graph\.txt") as caught:
        read_matrix(path)
    assert words in str(caught.value)


def test_missing_folders_and_huge_files(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="does not exist; expected a text file of rows"):
        read_matrix(tmp_path / "absent.txt")
    with pytest.raises(ValueError, match="is a folder or device"):
        read_matrix(tmp_path)
    huge = tmp_path / "huge.txt"
    with huge.open("wb") as stream:
        stream.truncate(FILE_LIMIT + 1)
    with pytest.raises(ValueError, match=f"has {FILE_LIMIT + 1} bytes; expected at most {FILE_LIMIT}"):
        read_matrix(huge)


def test_a_graph_is_built_without_sympy() -> None:
    code = (
        "import sys; from synchain.models.graphs.families import topology; topology('ring', 5);"
        "print([m for m in ('sympy', 'flint', 'numpy') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout == "[]\n"


@settings(max_examples=60)
@given(st.integers(1, 9), st.data())
def test_leading_groups_are_as_many_as_zero_eigenvalues(n: int, data: st.DataObject) -> None:
    pairs = [(i, j) for i, j in product(range(n), repeat=2) if i != j]
    chosen = sorted(data.draw(st.lists(st.sampled_from(pairs), unique=True, max_size=2 * n))) if pairs else []
    graph = Topology("random", n, tuple((i, j, Fraction(1)) for i, j in chosen))
    assert graph.leading_groups == graph.spectrum.zeros
    assert graph.leading_groups >= graph.components


def test_warnings_need_no_spectrum_of_a_large_graph() -> None:
    """1200 nodes without a closed form are too many for a spectrum, not for a run."""
    for weight in (1, -1):
        links = [(i, (i + step) % 1200, Fraction(weight)) for i in range(1200) for step in (1, 7)]
        graph = Topology("large", 1200, tuple(sorted(links)))
        sentences = Scene(oscillator="lorenz", coupling="x->x", topology=graph).warnings
        assert len(sentences) == (weight < 0)
        assert zero_multiplicity(graph) == 1
