"""Products, unions, complements and scaled graphs: against networkx and their own characteristic polynomials."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from fractions import Fraction
from itertools import product

import networkx as nx
import numpy as np
import pytest
import sympy as sp
from flint import fmpq_poly
from hypothesis import given, settings
from hypothesis import strategies as st

from synchain.models.algebra.cosine_sums import AngleSum, expression, merged, minimal_polynomial, read
from synchain.models.graphs.families import topology
from synchain.models.graphs.graph_products import cartesian, complement, kronecker, union, weighted
from synchain.models.graphs.topology import Topology, from_matrix
from synchain.models.spectra.solve import Proof, spectrum

OTHERS = [
    topology("chain", 5),
    topology("ring", 5),
    topology("star", 4),
    topology("one_way_ring", 3),
    topology("random_cubic", 8),
    from_matrix([[-3, 2, 1], [2, "-5/2", "1/2"], [1, "1/2", "-3/2"]]),
]


def undirected(graph: Topology) -> nx.Graph:
    found = nx.Graph()
    found.add_nodes_from(range(graph.n))
    found.add_edges_from((i, j) for i, j, _ in graph.links)
    return found


def dense(graph: Topology) -> np.ndarray:
    return np.array([[float(x) for x in row] for row in graph.rows])


def agrees(graph: Topology) -> bool:
    """The closed form and the route through the matrix give one spectrum."""
    other = Topology("matrix", graph.n, graph.links).spectrum
    found = graph.spectrum
    assert found.verified
    return found.multiplicities == other.multiplicities and found.evaluate(30) == other.evaluate(30)


@pytest.mark.parametrize(("first", "second"), list(product(OTHERS, OTHERS)), ids=str)
def test_cartesian_products(first: Topology, second: Topology) -> None:
    graph = cartesian(first, second)
    eye = [np.eye(g.n) for g in (first, second)]
    assert dense(graph) == pytest.approx(np.kron(dense(first), eye[1]) + np.kron(eye[0], dense(second)))
    assert graph.n == first.n * second.n
    assert agrees(graph)


@pytest.mark.parametrize(("first", "second"), list(product(OTHERS, OTHERS)), ids=str)
def test_kronecker_products(first: Topology, second: Topology) -> None:
    graph = kronecker(first, second)
    a, b = (dense(g) - np.diag(np.diag(dense(g))) for g in (first, second))
    found = dense(graph)
    assert found - np.diag(np.diag(found)) == pytest.approx(np.kron(a, b))
    assert agrees(graph)


@pytest.mark.parametrize(("first", "second"), list(product(OTHERS, OTHERS)), ids=str)
def test_unions(first: Topology, second: Topology) -> None:
    graph = union(first, second)
    assert graph.components == first.components + second.components
    assert graph.spectrum.multiplicities[graph.spectrum.exact.index(0)] == 2
    assert agrees(graph)


UNDIRECTED = [
    topology("chain", 1), topology("chain", 7), topology("ring", 8), topology("star", 5), topology("complete", 5),
    topology("complete_bipartite", 7), topology("hypercube", 8), topology("random_cubic", 10), topology("wheel", 7),
    union(topology("complete", 3), topology("complete", 4)),
]  # fmt: skip


@pytest.mark.parametrize("graph", UNDIRECTED, ids=str)
def test_complements(graph: Topology) -> None:
    other = complement(graph)
    assert undirected(other).edges == nx.complement(undirected(graph)).edges
    assert agrees(other)
    assert complement(other).links == graph.links
    assert complement(other).spectrum.exact == graph.spectrum.exact


@pytest.mark.parametrize("factor", [2, "1/3", -1, 0.1, Fraction(-5, 7)])
@pytest.mark.parametrize("graph", OTHERS, ids=str)
def test_scaled_graphs(graph: Topology, factor: object) -> None:
    assert agrees(weighted(graph, factor))
    assert dense(weighted(graph, factor)) == pytest.approx(float(Fraction(str(factor))) * dense(graph))


def test_products_that_are_families_have_their_spectra() -> None:
    grid = cartesian(topology("chain", 4), topology("chain", 6))
    assert grid.links == topology("grid", 24).links
    assert grid.spectrum.exact == topology("grid", 24).spectrum.exact
    cube = topology("chain", 2)
    for _ in range(4):
        cube = cartesian(cube, topology("chain", 2))
    assert cube.links == topology("hypercube", 32).links
    assert cube.spectrum.exact == topology("hypercube", 32).spectrum.exact


def test_the_petersen_graph_is_the_complement_of_the_line_graph_of_five() -> None:
    """Brouwer & Haemers, section 1.3.8: 0, 2 (5 times), 5 (4 times)."""
    pairs = [(i, j) for i in range(5) for j in range(i)]
    links = sorted((a, b, Fraction(1)) for a, p in enumerate(pairs) for b, q in enumerate(pairs) if len({*p, *q}) == 3)
    petersen = complement(Topology("triangular", 10, tuple(links)))
    assert repr(petersen.spectrum) == "{0: 1, -2: 5, -5: 4}"
    assert nx.is_isomorphic(undirected(petersen), nx.petersen_graph())


def test_large_products_need_no_matrix() -> None:
    graph = cartesian(topology("ring", 40), topology("chain", 50))
    found = graph.spectrum
    assert not found.verified
    assert found.n == 2000
    assert found.slowest == topology("chain", 50).spectrum.exact[1]
    assert spectrum(cartesian(topology("ring", 15), topology("star", 15)), proof=Proof.EXACT).verified


def test_products_travel() -> None:
    for graph in (
        cartesian(topology("ring", 4), topology("chain", 3)),
        complement(topology("ring", 5)),
        weighted(topology("ring", 5), 2),
        union(topology("ring", 5), topology("chain", 2)),
        kronecker(topology("ring", 5), topology("chain", 2)),
    ):
        again = pickle.loads(pickle.dumps(graph))
        assert again == graph
        assert again.spectrum == graph.spectrum


def test_names_tell_how_a_graph_was_made() -> None:
    ring = topology("circulant", 6, offsets=(1, 3))
    assert cartesian(ring, topology("chain", 2)).name == "cartesian(circulant(6, offsets=(1, 3)), chain(2))"
    assert weighted(complement(topology("ring", 5)), "1/2").name == "weighted(complement(ring(5)), 1/2)"


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: weighted(topology("chain", 3), 0), ValueError, "weighted(chain(3)): factor = 0; expected another"),
        (lambda: weighted(topology("chain", 3), "x"), ValueError, "factor is 'x', not a number"),
        (
            lambda: complement(topology("feed_forward", 3)),
            ValueError,
            "found one-way links, first from 1 to 2; expected undirected",
        ),
        (lambda: complement(weighted(topology("chain", 3), 2)), ValueError, "found a link of weight 2"),
        (
            lambda: cartesian(topology("complete", 2000), topology("chain", 9)),
            ValueError,
            "36014000 links; expected at most 4000000: take smaller graphs",
        ),
        (lambda: kronecker(topology("complete", 99), topology("complete", 99)), ValueError, "94128804 links; expected"),
    ],
)
def test_wrong_operands(make: Callable[[], Topology], error: type[Exception], words: str) -> None:
    with pytest.raises(error) as caught:
        make()
    assert words in str(caught.value)


# ---- sums of cosines ----

turns = st.builds(Fraction, st.integers(0, 60), st.sampled_from([5, 7, 8, 9, 12, 15, 16, 20, 24, 30]))
sums = st.lists(st.tuples(turns, st.fractions(-3, 3, max_denominator=4)), max_size=4).map(
    lambda parts: sum((AngleSum.cosine(1, b, t.numerator, t.denominator) for t, b in parts), AngleSum.rational(0))
)


@settings(max_examples=60)
@given(sums, sums)
def test_sums_and_products_of_cosines(a: AngleSum, b: AngleSum) -> None:
    assert (a + b).near == pytest.approx(a.near + b.near, abs=1e-9)
    assert (a * b).near == pytest.approx(a.near * b.near, abs=1e-9)
    assert (a + -a).vanishes()
    assert ((a + b) * (a + -b) + -(a * a) + b * b).vanishes()
    written = expression(a)
    assert float(sp.N(written)) == pytest.approx(a.near, abs=1e-9)
    again = read(written)
    assert again is not None
    assert (again + -a).vanishes()


def test_equal_sums_are_told_from_nearly_equal_ones() -> None:
    """cos(π/5) - cos(2π/5) = 1/2, and three cosines of sevenths: -1/2; a rational 10**-12 off is another number."""
    fifth = AngleSum.cosine(0, 1, 1, 10) + AngleSum.cosine(0, -1, 1, 5)
    seventh = AngleSum.rational(2) + sum((AngleSum.cosine(0, 1, k, 7) for k in (1, 2, 3)), AngleSum.rational(0))
    near = AngleSum.rational(1 + Fraction(1, 10**12))
    assert fifth.terms
    assert seventh.terms
    assert sorted(times for _, times in merged([(fifth, 1), (near, 10), (seventh, 100), (AngleSum.rational(1), 1000)])) == [
        10, 1101,
    ]  # fmt: skip


@settings(max_examples=40)
@given(sums)
def test_minimal_polynomials_of_sums(a: AngleSum) -> None:
    found = minimal_polynomial(a)
    assert [count for _, count in found.factor()[1]] == [1]
    assert found[found.degree()] == 1
    value, scale = 0.0, 1.0
    for k, c in enumerate(found.coeffs()):
        value += int(c.p) / int(c.q) * a.near**k
        scale += abs(int(c.p) / int(c.q) * a.near**k)
    assert abs(value) < 1e-9 * scale


def test_known_minimal_polynomials() -> None:
    assert minimal_polynomial(AngleSum.cosine(0, 1, 1, 8) + AngleSum.cosine(0, 1, 1, 12)) == fmpq_poly(
        [1, 0, -10, 0, 1]
    )
    assert minimal_polynomial(AngleSum.cosine(0, Fraction(1, 2), 1, 7)) == fmpq_poly([-1, -4, 4, 8]) / 8


@pytest.mark.parametrize(
    "text", ["sqrt(7)", "exp(2*I*pi/7)", "cos(1)", "sqrt(2)*sqrt(5)", "2**(1/3)", "sqrt(2)*cos(pi/7)"]
)
def test_other_numbers_are_no_sums_of_cosines(text: str) -> None:
    assert read(sp.sympify(text)) is None
