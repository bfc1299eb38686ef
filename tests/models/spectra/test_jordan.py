"""Jordan blocks: against matrices whose blocks are known, against SymPy's Jordan form, and in what is printed."""

from __future__ import annotations

import json
from fractions import Fraction

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from synchain.graphs import chain, complete, feed_forward, ring
from synchain.models.graphs.families import topology
from synchain.models.graphs.graph_products import cartesian, kronecker, union
from synchain.models.graphs.topology import Topology, from_matrix
from synchain.models.spectra.characteristic import characteristic
from synchain.models.spectra.eigenvalue import Blocks, Eigenvalue
from synchain.models.spectra.jordan import geometric_multiplicity, nullity
from synchain.models.spectra.solve import Proof, spectrum
from synchain.models.spectra.spectrum import Spectrum, table
from synchain.runtime.cli import main
from synchain.runtime.prediction.mode_windows import defective_rows

ONE = Fraction(1)


def structure(spectrum: Spectrum) -> dict[sp.Expr, Blocks | None]:
    return {e.exact: e.blocks for e in spectrum.eigenvalues}


def driven(lengths: tuple[int, ...]) -> Topology:
    """A root that drives one feed-forward chain of each length: a Jordan block of that size for -1."""
    links, start = [], 1
    for length in lengths:
        links += [(start + i, start + i - 1 if i else 0, ONE) for i in range(length)]
        start += length
    return Topology("driven", start, tuple(sorted(links)))


def stacked(graph: Topology, layers: int) -> Topology:
    """A root drives a copy of the graph, that copy a second one and so on: blocks of size `layers` for each gamma - 1."""
    n, links = graph.n, []
    for layer in range(layers):
        start = 1 + layer * n
        links += [(start + i, start + j, weight) for i, j, weight in graph.links]
        links += [(start + i, start + i - n if layer else 0, ONE) for i in range(n)]
    return Topology("stacked", layers * n + 1, tuple(sorted(links)))


@pytest.mark.parametrize("lengths", [(1,), (4,), (3, 1, 1), (2, 2), (5, 3, 3, 1), (1, 1, 1), (30, 28)])
def test_chains_from_one_root_are_blocks_of_their_lengths(lengths: tuple[int, ...]) -> None:
    """A chain that hangs on the root is a block; the root's own eigenvalue is 0."""
    blocks = structure(driven(lengths).spectrum)
    expected = tuple((size, lengths.count(size)) for size in sorted(set(lengths), reverse=True))
    assert blocks == {sp.S(0): ((1, 1),), sp.S(-1): expected}


@pytest.mark.parametrize(("graph", "layers"), [(chain(4), 2), (ring(5), 3), (chain(7), 2), (complete(3), 4)])
def test_blocks_of_irrational_eigenvalues(graph: Topology, layers: int) -> None:
    """Square roots, cosines and a complete graph's multiple eigenvalue, each in as many blocks as it occurs."""
    spectrum = stacked(graph, layers).spectrum
    times = {sp.expand(e.exact - 1): e.multiplicity for e in graph.spectrum.eigenvalues}
    others = [e for e in spectrum.eigenvalues if e.exact != 0]
    assert len(others) == len(times)
    assert sorted(e.multiplicity for e in others) == sorted(layers * count for count in times.values())
    assert all(e.blocks == ((layers, e.multiplicity // layers),) for e in others)
    assert all(geometric_multiplicity(stacked(graph, layers), e) == e.geometric for e in others)
    assert spectrum.defective == tuple(others)


@settings(max_examples=25)
@given(st.data())
def test_random_one_way_graphs_have_the_blocks_of_sympy(data: st.DataObject) -> None:
    n = data.draw(st.integers(2, 6))
    rows = [[data.draw(st.sampled_from([0, 0, 1, 1, 2])) if j < i else 0 for j in range(n)] for i in range(n)]
    for i in range(n):
        rows[i][i] -= sum(rows[i])
    blocks = structure(from_matrix(rows).spectrum)
    _, jordan = sp.Matrix(rows).jordan_form()
    sizes: dict[sp.Expr, list[int]] = {}
    start = 0
    for k in range(n):
        if k == n - 1 or jordan[k, k + 1] == 0:
            sizes.setdefault(jordan[k, k], []).append(k + 1 - start)
            start = k + 1
    expected = {g: tuple((s, sizes[g].count(s)) for s in sorted(set(sizes[g]), reverse=True)) for g in sizes}
    assert blocks == expected


def test_products_of_defective_graphs() -> None:
    """Blocks a and b of a Cartesian product make blocks a + b - 1, a + b - 3, … (A. C. Aitken, 1935)."""
    blocks = structure(cartesian(feed_forward(3), feed_forward(3)).spectrum)
    assert blocks == {sp.S(0): ((1, 1),), sp.S(-1): ((2, 2),), sp.S(-2): ((3, 1), (1, 1))}
    both = structure(union(feed_forward(3), feed_forward(5)).spectrum)
    assert both == {sp.S(0): ((1, 2),), sp.S(-1): ((4, 1), (2, 1))}


def test_weights_and_fractions() -> None:
    half = from_matrix([[0, 0, 0], ["1/3", "-1/3", 0], [0, "1/3", "-1/3"]])
    assert structure(half.spectrum) == {sp.S(0): ((1, 1),), sp.Rational(-1, 3): ((2, 1),)}
    apart = from_matrix([[0, 0, 0], ["1/3", "-1/3", 0], [0, "1/4", "-1/4"]])
    assert all(e.blocks == ((1, 1),) for e in apart.spectrum.eigenvalues)
    balanced = from_matrix([["-1/2", "1/2", 0], ["1/3", "-2/3", "1/3"], [0, "1/2", "-1/2"]])
    assert apart.spectrum.defective == balanced.spectrum.defective == ()


def test_undirected_graphs_are_never_defective() -> None:
    for graph in (complete(7), kronecker(complete(3), complete(3)), topology("hypercube", 16)):
        assert graph.undirected
        assert all(e.blocks == ((1, e.multiplicity),) for e in graph.spectrum.eigenvalues)
    assert topology("chain", 10**6).spectrum[7].blocks == ((1, 1),)
    assert not feed_forward(3).undirected


def test_nothing_is_said_where_nobody_looked() -> None:
    last = feed_forward(300).spectrum.eigenvalues[1]
    assert (last.blocks, last.geometric, last.defective) == (None, None, False)
    looked = spectrum(feed_forward(300), proof=Proof.EXACT).eigenvalues[1]
    assert (looked.blocks, looked.geometric, looked.defective) == (((299, 1),), 1, True)


def test_nullities_count_all_roots_of_a_polynomial() -> None:
    graph = stacked(chain(3), 2)
    factor = next(f for f, count in characteristic(graph).factor()[1] if count == 2)
    assert nullity(graph, factor) == 1
    assert nullity(graph, characteristic(graph)) == graph.n


def test_blocks_that_do_not_add_up_are_refused() -> None:
    with pytest.raises(ValueError, match="do not add up to multiplicity 3"):
        Eigenvalue(sp.S(-1), 3, ((2, 1),))


def test_what_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["spectrum", "feed_forward", "5"]) == 0
    out = capsys.readouterr().out.splitlines()
    assert out[0].split() == ["exact", "decimal", "multiplicity", "Jordan", "blocks"]
    assert out[2].split() == ["-1", "-1", "4", "4"]
    assert out[-1].startswith("defective: ")
    assert main(["spectrum", "feed_forward", "5", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)["eigenvalues"]
    assert [(e["geometric_multiplicity"], e["jordan_blocks"]) for e in listed] == [(1, [[1, 1]]), (1, [[4, 1]])]
    assert "2, 1 (2 times)" in table(driven((2, 1, 1)).spectrum)
    assert "defective" not in table(chain(4).spectrum)


def test_the_projection_says_how_errors_of_missing_eigenvectors_go() -> None:
    assert defective_rows(feed_forward(5)) == [("defective", "gamma = -1: growth t^3 e^(lambda t)")]
    assert defective_rows(driven((2, 1))) == [("defective", "gamma = -1: growth t e^(lambda t)")]
    assert defective_rows(chain(5)) == []
