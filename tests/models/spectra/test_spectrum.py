"""Exact spectra: right, proved, evaluated to any accuracy, written so that SymPy reads them back."""

from __future__ import annotations

import json
import pickle
import random
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise, product

import flint
import mpmath
import numpy as np
import pytest
import sympy as sp
from catalogue import floats, nameless_one_way_ring
from effort import effort
from family_sizes import size, sizes
from hypothesis import given, settings
from hypothesis import strategies as st

from synchain.graphs import Spectrum, Topology, from_graph, from_matrix, topology
from synchain.models.algebra.cosines import biquadratic, cosine, linear_cosine, minimal_polynomial
from synchain.models.algebra.isolation import discs, sign
from synchain.models.algebra.roots import ComplexRoot, RealRoot, roots
from synchain.models.graphs.families import family, names
from synchain.models.spectra.characteristic import characteristic
from synchain.models.spectra.eigenvalue import Eigenvalue, ProofError, ordered
from synchain.models.spectra.solve import Proof, spectrum
from synchain.models.spectra.spectrum import table

ONE = Fraction(1)
fresh: Callable[..., Spectrum] = spectrum.__wrapped__


def anonymous(graph: Topology) -> Topology:
    """The same graph under a name that has no closed form."""
    return Topology("matrix", graph.n, graph.links)


def expanded(spectrum: Spectrum) -> np.ndarray:
    return np.repeat(spectrum.values, spectrum.multiplicities)


PUBLISHED = {2: "0, -2", 3: "0, -1, -3", 4: "0, -2 + sqrt(2), -2, -2 - sqrt(2)"}


@pytest.mark.parametrize("disguise", [lambda graph: graph, anonymous])
@pytest.mark.parametrize("n", PUBLISHED)
def test_the_published_chains(n: int, disguise: Callable[[Topology], Topology]) -> None:
    spectrum = disguise(topology("chain", n)).spectrum
    assert spectrum.exact == tuple(sp.sympify(f"[{PUBLISHED[n]}]"))
    assert spectrum.multiplicities == (1,) * n
    assert spectrum.verified


def test_the_first_lines_a_user_types() -> None:
    assert repr(topology("star", 6).spectrum) == "{0: 1, -1: 4, -6: 1}"
    assert topology("chain", 4).spectrum.largest == -2 - sp.sqrt(2)
    assert repr(topology("complete", 5).spectrum) == "{0: 1, -5: 4}"
    assert repr(topology("ring", 6).spectrum) == "{0: 1, -1: 2, -3: 2, -4: 1}"
    assert repr(topology("chain", 1).spectrum) == "{0: 1}"


@pytest.mark.parametrize("name", names())
def test_closed_forms_agree_with_the_characteristic_polynomial_route(name: str) -> None:
    tried = list(sizes(name, range(1, 31)))
    for n in [*tried[:12], *tried[12::4]]:
        closed = topology(name, n)
        other = anonymous(closed).spectrum
        assert closed.spectrum.verified
        assert other.verified
        assert closed.spectrum.multiplicities == other.multiplicities, n
        assert closed.spectrum.values == pytest.approx(other.values, rel=1e-15, abs=1e-15), n
        assert closed.spectrum.evaluate(40) == other.evaluate(40), n


@pytest.mark.parametrize("name", names())
def test_closed_forms_agree_with_numpy(name: str) -> None:
    for n in (size(name, 5), size(name, 40)):
        graph = topology(name, n)
        values = np.linalg.eigvalsh(floats(graph)) if graph.symmetric else np.linalg.eigvals(floats(graph))
        eigenvalues = np.array(expanded(graph.spectrum), complex)
        gap = np.abs(eigenvalues[:, None] - values[None, :])
        assert gap.min(axis=0).max() < 1e-11
        assert np.sum(eigenvalues) == pytest.approx(np.trace(floats(graph)))
        assert np.sum(eigenvalues**2) == pytest.approx(np.trace(floats(graph) @ floats(graph)))


@pytest.mark.parametrize("n", [7, 9])
@pytest.mark.parametrize("disguise", [lambda graph: graph, anonymous])
def test_seven_and_nine_oscillators_are_written_without_complex_radicals(
    n: int, disguise: Callable[[Topology], Topology]
) -> None:
    spectrum = disguise(topology("chain", n)).spectrum
    for eigenvalue in spectrum.eigenvalues:
        again = sp.sympify(eigenvalue.text)
        assert not again.has(sp.I)
        assert abs(sp.N(again, 30) - eigenvalue.evaluate(30)) < sp.Float("1e-28")
    assert spectrum.eigenvalues[1].text == f"-4*sin(pi/{2 * n})**2"


@pytest.mark.parametrize("n", range(2, 26))
def test_every_text_is_read_back_by_sympy(n: int) -> None:
    for eigenvalue in topology("chain", n).spectrum.eigenvalues:
        assert len(eigenvalue.text) < 40
        assert abs(sp.N(sp.sympify(eigenvalue.text), 20) - eigenvalue.evaluate(20)) < sp.Float("1e-18")


@pytest.mark.parametrize("seed", [1, 2])
def test_algebraic_numbers_are_read_back_by_sympy(seed: int) -> None:
    spectrum = integer_graph(12, 0.4, seed).spectrum
    assert any(isinstance(e.number, RealRoot) for e in spectrum.eigenvalues)
    for eigenvalue in spectrum.eigenvalues:
        again = sp.sympify(eigenvalue.text)
        assert again == eigenvalue.exact
        assert abs(sp.N(again, 30) - eigenvalue.evaluate(30)) < sp.Float("1e-27")


# ---- the proof ----


def root_two(n: int) -> list[tuple[sp.Expr, int]]:
    return [(sp.S.Zero, 1), (-2 + sp.sqrt(2), 1), (sp.S(-2), 1), (-2 - sp.sqrt(2), 1)]


@pytest.mark.parametrize(
    "wrong",
    [
        lambda right: right[:-1],
        lambda right: [*right, (sp.S(-5), 1)],
        lambda right: [(number, 2) for number, _ in right],
        lambda right: [right[0], right[1], right[2], right[1]],
        lambda right: [right[0], (right[1][0], 2), right[2]],
        lambda right: [right[0], (right[1][0], 2), right[2], right[3]],
        lambda right: [(number + sp.Rational(1, 10**30), 1) for number, _ in right],
        lambda right: [(-number, 1) for number, _ in right],
        lambda right: [(sp.Rational(str(sp.N(number, 50))), 1) for number, _ in right],
        lambda right: [(-4 * sp.sin(k * sp.pi / 7, evaluate=False) ** 2, 1) for k in range(4)],
    ],
)
def test_a_wrong_closed_form_is_refused(
    wrong: Callable[[list[tuple[sp.Expr, int]]], list[tuple[sp.Expr, int]]],
) -> None:
    chain = family("chain")
    assert fresh(replace(chain, spectrum=root_two)(4)).verified
    wrong_chain = replace(chain, spectrum=lambda n: wrong(root_two(n)))
    with pytest.raises(ProofError, match=r"spectrum of chain 4: .* correct the closed form"):
        fresh(wrong_chain(4))


def test_a_wrong_angle_is_refused() -> None:
    chain = family("chain")
    right = chain.spectrum(7)
    for wrong in ([*right[:-1], right[1]], [*right[:-1], (right[1][0] + sp.Rational(1, 10**20), 1)]):
        wrong_chain = replace(chain, spectrum=lambda n, wrong=wrong: wrong)
        with pytest.raises(ProofError, match="correct the closed form"):
            fresh(wrong_chain(7))


def test_large_closed_forms_say_that_they_are_not_proved() -> None:
    unproved = fresh(topology("ring", 11), Proof.of_size(11, exact=10, modular=10))
    assert fresh(topology("ring", 10), Proof.of_size(10, exact=10, modular=10)).verified
    assert not unproved.verified
    assert fresh(topology("ring", 11), proof=Proof.EXACT).verified
    assert "not proved" in table(unproved)
    assert fresh(anonymous(topology("ring", 11))).verified


def test_a_matrix_called_chain_gets_no_closed_form_of_the_chain() -> None:
    spectrum = Topology("chain", 3, topology("complete", 3).links).spectrum
    assert repr(spectrum) == "{0: 1, -3: 2}"
    assert repr(Topology("ring", 2, topology("chain", 2).links).spectrum) == "{0: 1, -2: 1}"


def test_large_matrices_without_a_closed_form_are_refused() -> None:
    with pytest.raises(ValueError, match=r"n = 1001 without a closed form; expected at most 1000"):
        anonymous(topology("chain", 1001)).spectrum  # noqa: B018


# ---- any rational matrix ----


@pytest.mark.parametrize("largest", [6, pytest.param(7, marks=pytest.mark.long)])
def test_all_connected_graphs_of_few_nodes_against_numpy(largest: int) -> None:
    """R. C. Read, R. J. Wilson, An Atlas of Graphs (Oxford, 1998): 1, 1, 2, 6, 21, 112 and 853 of them."""
    atlas = pytest.importorskip("networkx.generators.atlas")
    networkx = pytest.importorskip("networkx")
    counts: Counter[int] = Counter()
    for graph in atlas.graph_atlas_g():
        n = graph.number_of_nodes()
        if not 0 < n <= largest or not networkx.is_connected(graph):
            continue
        counts[n] += 1
        network = from_graph(graph, name="atlas")
        exact = fresh(network)
        assert exact.verified
        assert exact.n == n
        assert exact.eigenvalues[0] == Eigenvalue(sp.S.Zero, 1)
        expected = np.linalg.eigvalsh(-networkx.laplacian_matrix(graph).toarray().astype(float))
        assert np.sort(expanded(exact)) == pytest.approx(expected, rel=1e-12, abs=1e-12)
    assert [counts[n] for n in range(1, largest + 1)] == [1, 1, 2, 6, 21, 112, 853][:largest]


weights = st.fractions(min_value=-3, max_value=3, max_denominator=12)


@settings(max_examples=40)
@given(st.integers(2, 7), st.data())
def test_random_rational_symmetric_matrices(n: int, data: st.DataObject) -> None:
    links = []
    for i, j in product(range(n), repeat=2):
        if i < j and (weight := data.draw(weights)):
            links += [(i, j, weight), (j, i, weight)]
    graph = Topology("random", n, tuple(sorted(links)))
    spectrum = graph.spectrum
    assert spectrum.verified
    assert list(spectrum.values) == sorted(spectrum.values, reverse=True)
    assert np.sort(expanded(spectrum)) == pytest.approx(np.linalg.eigvalsh(floats(graph)), rel=1e-9, abs=1e-9)


@settings(max_examples=30)
@given(st.integers(2, 6), st.data())
def test_random_one_way_graphs(n: int, data: st.DataObject) -> None:
    pairs = [(i, j) for i, j in product(range(n), repeat=2) if i != j]
    chosen = data.draw(st.lists(st.sampled_from(pairs), unique=True))
    graph = Topology("random", n, tuple((i, j, ONE) for i, j in sorted(chosen)))
    spectrum = graph.spectrum
    assert spectrum.verified
    assert spectrum.n == n
    power = np.array([np.sum(expanded(spectrum) ** k) for k in range(1, n + 1)])  # safe for Jordan blocks
    traces = [np.trace(np.linalg.matrix_power(floats(graph), k)) for k in range(1, n + 1)]
    assert power == pytest.approx(np.array(traces), rel=1e-10, abs=1e-10)


def test_disconnected_graphs_have_a_multiple_zero() -> None:
    graph = Topology("two pairs", 5, ((0, 1, ONE), (1, 0, ONE), (2, 3, ONE), (3, 2, ONE)))
    assert repr(graph.spectrum) == "{0: 3, -2: 2}"
    assert graph.spectrum.nonzero == (Eigenvalue(sp.S(-2), 2),)


def test_a_feed_forward_chain_counts_its_jordan_block() -> None:
    graph = Topology("feed forward", 6, tuple((i, i - 1, ONE) for i in range(1, 6)))
    assert repr(graph.spectrum) == "{0: 1, -1: 5}"


@pytest.mark.parametrize("n", [3, 5, 7, 8, 12, 30])
def test_one_way_rings_have_the_textbook_spectrum(n: int) -> None:
    spectrum = nameless_one_way_ring(n).spectrum
    expected = np.exp(2j * np.pi * np.arange(n) / n) - 1
    assert spectrum.verified
    assert np.sort_complex(np.round(expanded(spectrum), 12)) == pytest.approx(
        np.sort_complex(np.round(expected, 12)), abs=1e-11
    )
    pairs = [e.value for e in spectrum.eigenvalues if isinstance(e.value, complex)]
    assert all(a == b.conjugate() for a, b in zip(pairs[::2], pairs[1::2], strict=True))
    for eigenvalue in spectrum.eigenvalues:
        again = complex(sp.sympify(eigenvalue.text).evalf())
        assert again == pytest.approx(complex(eigenvalue.value), abs=1e-14)


def test_complex_eigenvalues_without_a_closed_form() -> None:
    rows = [[-2, 1, 0, 1, 0], [0, -1, 1, 0, 0], [0, 0, -1, 0, 1], [1, 0, 1, -2, 0], [1, 1, 0, 0, -2]]
    spectrum = from_matrix(rows).spectrum
    assert any(isinstance(e.number, ComplexRoot) for e in spectrum.eigenvalues)
    expected = np.sort_complex(np.linalg.eigvals(np.array(rows, float)))
    assert np.sort_complex(np.array(spectrum.values, complex)) == pytest.approx(expected, abs=1e-12)
    for eigenvalue in spectrum.eigenvalues:
        assert complex(sp.sympify(eigenvalue.text).evalf(15)) == pytest.approx(complex(eigenvalue.value))
        distance = abs(complex(eigenvalue.evaluate(30)) - complex(eigenvalue.value))
        assert distance < 1e-14


@pytest.mark.parametrize(
    "coefficients",
    [
        pytest.param((8, -7, 9, 6, 1, 1), marks=pytest.mark.long),  # SymPy's order is not that of the real parts
        (2, 0, 2, 0, 1),  # roots on the border of SymPy's boxes
        pytest.param((-972, 486, 135, 72, 12, 1), marks=pytest.mark.long),  # SymPy rescales this one
    ],
)
def test_the_index_of_a_complex_root_is_that_of_sympy(coefficients: tuple[int, ...]) -> None:
    isolated = roots(coefficients)
    assert sorted(root.index for root in isolated) == list(range(len(coefficients) - 1))
    for root in isolated:
        ball = root.enclosure(60)
        here = complex(float(ball.real.mid()), float(ball.imag.mid()))
        assert complex(root.expression.evalf(15)) == pytest.approx(here, rel=1e-12)


def test_short_nested_radicals_are_found() -> None:
    edges = [(0, 1), (0, 3), (0, 4), (1, 2), (1, 4), (2, 5), (2, 6)]
    links = sorted((i, j, ONE) for edge in edges for i, j in (edge, edge[::-1]))
    graph = Topology("seven nodes", 7, tuple(links))
    assert repr(graph.spectrum) == (
        "{0: 1, -5/2 + sqrt(sqrt(2) + 13/4): 1, -1: 1, -5/2 + sqrt(13/4 - sqrt(2)): 1, -3: 1, "
        "-5/2 - sqrt(13/4 - sqrt(2)): 1, -5/2 - sqrt(sqrt(2) + 13/4): 1}"
    )
    assert np.sort(graph.spectrum.values) == pytest.approx(np.linalg.eigvalsh(floats(graph)), abs=1e-12)


@pytest.mark.parametrize(
    ("coefficients", "roots"),
    [
        ((9, 0, -14, 0, 1), {s * sp.sqrt(2) + t * sp.sqrt(5) for s in (1, -1) for t in (1, -1)}),
        ((1, 0, -5, 0, 1), {s * sp.sqrt(3) / 2 + t * sp.sqrt(7) / 2 for s in (1, -1) for t in (1, -1)}),
        ((7, 0, -6, 0, 1), {s * sp.sqrt(3 + t * sp.sqrt(2)) for s in (1, -1) for t in (1, -1)}),
        ((3, 0, 1, 0, 1), None),
        ((3, 0, -2, 0, 1), None),
        ((-7, 0, -6, 0, 1), None),
        ((3, 1, -6, 0, 1), None),
    ],
)
def test_biquadratics(coefficients: tuple[int, ...], roots: set[sp.Expr] | None) -> None:
    roots_of_it = biquadratic(flint.fmpq_poly(list(coefficients)))
    assert (None if roots_of_it is None else set(roots_of_it)) == roots


# ---- values ----


def integer_graph(n: int, share: float, seed: int) -> Topology:
    chance = np.random.default_rng(seed)
    edges = [(i, j) for i in range(n) for j in range(i) if chance.random() < share]
    links = sorted((i, j, ONE) for edge in edges for i, j in (edge, edge[::-1]))
    return Topology("random", n, tuple(links))


@pytest.mark.parametrize("graph", [topology("chain", 13), integer_graph(12, 0.4, 1), nameless_one_way_ring(9)])
def test_fifty_digits_agree_with_mpmath(graph: Topology) -> None:
    with mpmath.workdps(80):
        matrix = mpmath.matrix([[mpmath.mpf(x.numerator) / x.denominator for x in row] for row in graph.rows])
        expected = mpmath.eig(matrix, left=False, right=False)
        for value in graph.spectrum.evaluate(50):
            here = mpmath.mpc(*(mpmath.mpf(str(part)) for part in value.as_real_imag()))
            gap = min(abs(here - other) for other in expected)
            assert gap <= mpmath.mpf(10) ** -49 * max(abs(here), mpmath.mpf(10) ** -10)


@pytest.mark.parametrize("digits", [1, 15, 100, 1000])
def test_any_number_of_digits(digits: int) -> None:
    value = topology("chain", 4).spectrum.evaluate(digits)[1]
    expected = sp.N(-2 + sp.sqrt(2), digits + 10)
    assert abs(value - expected) <= sp.Float(10, digits) ** -digits
    assert value.is_Float


@pytest.mark.parametrize("digits", [0, -3, 2.5, True])
def test_wrong_numbers_of_digits(digits: int) -> None:
    with pytest.raises(ValueError, match=f"digits = {digits}; expected a positive integer"):
        topology("chain", 3).spectrum.evaluate(digits)


def test_floats_are_the_nearest_ones() -> None:
    for graph in (integer_graph(14, 0.4, 2), topology("chain", 14)):
        assert all(e.value == float(e.evaluate(40)) for e in graph.spectrum.eigenvalues)
    assert topology("chain", 1000).spectrum.values[1] == pytest.approx(-((np.pi / 1000) ** 2), rel=1e-6)


def test_brackets_hold_one_sign_change() -> None:
    assert RealRoot((-2, 0, 1), 1, Fraction(1), Fraction(2)).text == "CRootOf(x**2 - 2, 1)"
    with pytest.raises(ValueError, match="no sign change from 2 to 3; expected a bracket"):
        RealRoot((-2, 0, 1), 1, Fraction(2), Fraction(3))


def test_a_bracket_far_off_is_refined_as_well() -> None:
    ball = RealRoot((-2, 0, 1), 1, Fraction(-1), Fraction(10**6)).enclosure(200)
    assert abs(ball * ball - 2).upper() < 2**-50
    root = Eigenvalue(RealRoot((-2, 0, 1), 1, Fraction(-1), Fraction(9)), 1)
    assert abs(root.evaluate(40) ** 2 - 2) < 1e-38


@pytest.mark.parametrize(
    ("polynomial", "reals"), [((-2, 0, 0, 1), 1), ((1, 0, 1), 0), ((2, 0, -2, 0, 1), 0), ((1, -1, -3, 1, 1, 7), 1)]
)
def test_real_and_complex_roots_are_told_apart(polynomial: tuple[int, ...], reals: int) -> None:
    kinds = [type(root) for root in roots(polynomial)]
    assert kinds == [RealRoot] * reals + [ComplexRoot] * (len(polynomial) - 1 - reals)


def test_roots_that_nearly_coincide_are_isolated() -> None:
    """(x² - 2)² (x² - 3) shifted by 10**-60: pairs of roots 10**-30 apart."""
    polynomial = flint.fmpz_poly([-2, 0, 1]) ** 2 * flint.fmpz_poly([-3, 0, 1]) * 10**60 + 1
    assert [f.degree() for f, _ in polynomial.factor()[1]] == [6]
    isolated = roots(tuple(int(c) for c in polynomial.coeffs()))
    assert len(isolated) == 6
    assert all(a.high < b.low for a, b in pairwise(isolated))
    assert all(
        abs(float(a.low) - x) < 1e-12 for a, x in zip(isolated[::2], (-(3**0.5), -(2**0.5), 2**0.5), strict=True)
    )


@pytest.mark.parametrize(
    "coefficients",
    [[-2, 0, 1], [1, -5, 0, 3], [2, 4, 1], [-1, -3, 0, 1], [-1, -2, 1, 1], [2, -6, 0, 5], [1, 0, -10, 0, 1]],
)
def test_an_iteration_that_rounding_carries_past_a_root_comes_back(coefficients: list[int]) -> None:
    """Steps end on a root as near as numbers go: a step to the next root from there would leave roots out."""
    f = flint.fmpz_poly(coefficients)
    isolated = discs(f)
    assert isolated is not None
    expected = sorted(float(root.real.mid()) for root, _ in f.complex_roots())
    assert [float(flint.arb(disc.x)) for disc in isolated] == pytest.approx(expected, rel=1e-12)


def test_every_factor_of_an_undirected_graph_is_isolated_on_the_real_axis() -> None:
    random = np.random.default_rng(3)
    degrees = set()
    for n in random.integers(2, 13, 40):
        a = np.triu(random.integers(0, 4, (n, n)) * (random.random((n, n)) < 0.5), 1)
        a = a + a.T
        f = flint.fmpz_mat((a - np.diag(a.sum(axis=1))).tolist()).charpoly()
        for factor, _ in f.factor()[1]:
            if factor.degree() >= 2:
                degrees.add(factor.degree())
                assert [disc.y for disc in discs(factor) or ()] == [0] * factor.degree()
    assert len(degrees) > 8


def test_roots_far_from_zero_and_near_one_another_are_isolated() -> None:
    """Some per root, once they are counted from their mean; the coefficients have more than twice as many."""
    stream, n = random.Random(1), 40
    upper = [[10**9 + stream.randint(1, 10**4) if j > i else 0 for j in range(n)] for i in range(n)]
    rows = [[upper[min(i, j)][max(i, j)] for j in range(n)] for i in range(n)]
    for i, row in enumerate(rows):
        row[i] = -sum(row)
    f = flint.fmpz_mat(rows).charpoly().factor()[1][-1][0]
    assert f.degree() == 39
    assert f.height_bits() > 1200
    isolated = discs(f)
    assert isolated is not None
    assert [disc.y for disc in isolated] == [0] * 39
    assert all(sign(f, disc.x - disc.radius) * sign(f, disc.x + disc.radius) < 0 for disc in isolated)


def test_largest_and_slowest_of_long_chains_and_of_small_graphs() -> None:
    long = spectrum(topology("chain", 5000))
    assert float(long.largest) == pytest.approx(-2 - 2 * np.cos(np.pi / 5000), rel=1e-14)
    assert float(long.slowest) == pytest.approx(-4 * np.sin(np.pi / 10000) ** 2, rel=1e-12)
    assert [spectrum(topology(name, 6)).slowest for name in ("ring", "star", "complete")] == [-1, -1, -6]
    one_way = spectrum(from_matrix([[-1, 1, 0], [0, -1, 1], [1, 0, -1]]))
    assert complex(one_way.slowest) == pytest.approx(-1.5 - 0.5j * 3**0.5)
    with pytest.raises(ValueError, match="all eigenvalues are 0"):
        _ = spectrum(from_matrix([[0, 0], [0, 0]])).slowest


def test_many_eigenvalues_are_shown_in_part() -> None:
    values = [Eigenvalue(sp.Integer(-k), k + 1, None) for k in range(5)]
    assert Spectrum(values).text(4) == "{0: 1, -1: 2, -2: 3, … (1 more), -4: 5}"
    assert Spectrum(values[:4]).text(4) == repr(Spectrum(values[:4])) == "{0: 1, -1: 2, -2: 3, -3: 4}"


def test_the_characteristic_polynomial_of_fractions_is_monic() -> None:
    graph = from_matrix([["-1/2", "1/2", "0"], ["1/3", "-1/3", "0"], ["0", "2/5", "-2/5"]])
    z = sp.Symbol("z")
    expected = sp.Poly((z**2 + sp.Rational(5, 6) * z) * (z + sp.Rational(2, 5)), z)
    assert [sp.Rational(int(c.p), int(c.q)) for c in characteristic(graph).coeffs()] == expected.all_coeffs()[::-1]


@pytest.mark.parametrize(("name", "n"), [("chain", 7), ("ring", 5), ("star", 4), ("complete", 9)])
def test_a_graph_by_the_name_and_links_of_a_family_has_its_closed_form(name: str, n: int) -> None:
    family = topology(name, n)
    eigenvalues = family.spectrum
    assert spectrum(Topology(name, n, family.links)) is eigenvalues


@pytest.mark.parametrize(("name", "n"), [("chain", 7), ("ring", 2), ("hypercube", 6)])
def test_a_graph_of_another_kind_is_not_believed_its_name(name: str, n: int) -> None:
    star = topology("star", n) if n > 2 else topology("chain", 2)
    assert spectrum(Topology(name, n, star.links)).exact == star.spectrum.exact


def test_a_sign_is_exact_where_balls_cannot_tell() -> None:
    f = flint.fmpz_poly([-2, 1])
    tiny = flint.fmpq(1, 2**5000)
    assert [sign(f, 2 + tiny), sign(f, 2 - tiny), sign(f, flint.fmpq(2))] == [1, -1, 0]
    assert [sign(f, flint.fmpq(3)), sign(f, flint.fmpq(1))] == [1, -1]


def test_cancellation_costs_no_digits() -> None:
    number = sp.sqrt(10**60 + 1) - 10**30
    assert Eigenvalue(number, 1).value == 5e-31
    zero = sp.Add((1 + sp.sqrt(2)) ** 2, -3, -2 * sp.sqrt(2), evaluate=False)
    with pytest.raises(ValueError, match="write it as 0 if it is zero"):
        Eigenvalue(zero, 1)
    with pytest.raises(TypeError, match=r"gamma\(1/3\) has no certified value; expected rationals"):
        Eigenvalue(sp.gamma(sp.Rational(1, 3)), 1)


def test_conjugates_stay_together_where_real_parts_agree() -> None:
    values = [-1 + 2 * sp.I, sp.S(-3), -1 - sp.I, sp.S.Zero, -1 - 2 * sp.I, -1 + sp.I]
    eigenvalues = ordered([Eigenvalue(number, 1) for number in values])
    assert [e.value for e in eigenvalues] == [0, -1 - 1j, -1 + 1j, -1 - 2j, -1 + 2j, -3]


def test_numbers_closer_than_floats_are_ordered_and_told_apart() -> None:
    tiny = sp.Rational(1, 10**40)
    values = [-sp.sqrt(2) - tiny, -sp.sqrt(2) + tiny, -sp.sqrt(2)]
    eigenvalues = ordered([Eigenvalue(number, 1) for number in values])
    assert [e.number for e in eigenvalues] == [values[1], values[2], values[0]]
    assert Spectrum(eigenvalues).largest == values[0]
    with pytest.raises(ProofError, match="two of 2 eigenvalues coincide"):
        ordered([Eigenvalue(sp.S(-2), 1), Eigenvalue(sp.S(-2), 1)])


def test_cosines_are_recognised_in_every_spelling() -> None:
    for m, k in product(range(1, 31), range(31)):
        number = cosine(Fraction(-3, 2), Fraction(2, 3), k, m)
        value = -1.5 + 4 / 3 * np.cos(2 * np.pi * k / m)
        assert float(sp.N(number)) == pytest.approx(value, abs=1e-12)
        form = linear_cosine(number)
        if form is not None:
            a, b, turn, modulus = form
            assert a + 2 * b * np.cos(2 * np.pi * turn / modulus) == pytest.approx(value)
            coefficients = [int(c.p) / int(c.q) for c in minimal_polynomial(a, b, modulus).coeffs()]
            assert np.polyval(coefficients[::-1], value) == pytest.approx(0, abs=1e-6)
    assert linear_cosine(sp.sqrt(2) + 1) is None
    assert linear_cosine(2 * sp.sin(sp.pi / 7)) is None


# ---- the object ----


def test_as_dict_is_what_the_command_line_prints() -> None:
    answer = topology("chain", 4).spectrum.as_dict()
    once = {"geometric_multiplicity": 1, "jordan_blocks": [[1, 1]], "polynomial": None, "index": None}
    assert json.loads(json.dumps(answer)) == {
        "n": 4,
        "polynomials": [],
        "eigenvalues": [
            {"exact": "0", "value": 0.0, "multiplicity": 1, **once},
            {"exact": "-2 + sqrt(2)", "value": -0.585786437626905, "multiplicity": 1, **once},
            {"exact": "-2", "value": -2.0, "multiplicity": 1, **once},
            {"exact": "-2 - sqrt(2)", "value": -3.414213562373095, "multiplicity": 1, **once},
        ],
        "verified": True,
        "chance": None,
    }
    spiral = nameless_one_way_ring(3).spectrum.as_dict()["eigenvalues"][1]
    assert spiral["exact"] == "-3/2 - sqrt(3)*I/2"
    assert spiral["value"] == pytest.approx([-1.5, -(3**0.5) / 2])


def test_complex_eigenvalues_of_any_size_are_ordered_by_their_real_parts() -> None:
    weights = {(0, 1): 1, (0, 2): 1, (1, 0): 7, (1, 2): 1, (2, 1): 9, (3, 4): 3, (4, 5): 1, (5, 3): 5}
    for scale in (Fraction(1), Fraction(1, 10**15), Fraction(1, 10**30)):
        links = tuple((i, j, weight * scale) for (i, j), weight in sorted(weights.items()))
        values = Topology("scaled", 6, links).spectrum.values
        pair = [complex(-4.5, -(2.75**0.5)), complex(-4.5, 2.75**0.5)]
        assert [z / float(scale) for z in values] == pytest.approx([0, *pair, -9, -10], rel=1e-12)


def test_an_ill_scaled_one_way_graph_is_proved() -> None:
    """A root of size 2 beside one of size 1e12 was held twice, as two conjugates."""
    rows = [
        "-11/6 0.5 1 0 1/3",
        "-2 -999999999996 1e12 -2 0",
        "-2 1/3 19/6 -2 0.5",
        "1 1 1 -1 -2",
        "1e-12 1/3 -2 -2 10999999999997/3000000000000",
    ]
    spectrum = from_matrix([row.split() for row in rows]).spectrum
    assert spectrum.verified
    assert [e.value for e in spectrum if not isinstance(e.value, complex)] == pytest.approx(
        [0, -2.215330009687225, -999999999996.3334], rel=1e-14
    )


def test_polynomials_are_written_once_and_roots_refer_to_them() -> None:
    graph = integer_graph(12, 0.4, 1)
    answer = json.loads(json.dumps(graph.spectrum.as_dict()))
    assert len(answer["polynomials"]) == 1
    coefficients = [int(text, 0) for text in answer["polynomials"][0]]
    p0 = sp.Poly(coefficients[::-1], sp.Symbol("x"))
    of_roots = [e for e in answer["eigenvalues"] if e["polynomial"] is not None]
    assert len(of_roots) == 11
    for e in of_roots:
        root = sp.sympify(e["exact"], locals={"p0": p0})
        assert root == sp.CRootOf(p0, e["index"])
        assert float(root.evalf(17)) == pytest.approx(e["value"], rel=1e-15)


def test_coefficients_that_python_refuses_to_write_are_abbreviated() -> None:
    """Whole numbers of more than 4300 digits cannot be turned into decimals by default."""
    weights = {(i, i + 1): Fraction(1, 10**1500 + i) for i in range(4)}
    links = sorted((*pair, w) for (i, j), w in weights.items() for pair in ((i, j), (j, i)))
    graph = Topology("long", 5, tuple(links))
    spectrum = fresh(graph)
    assert spectrum.verified
    assert "(degree 4)" in repr(spectrum)
    assert "root 0 of a polynomial of degree 4" in table(spectrum)
    assert spectrum[1].text.startswith("CRootOf(polynomial of degree 4 with coefficients of up to ")
    assert len(spectrum[1].text) < 100
    assert float(str(spectrum.largest)) == float(spectrum.largest) == spectrum[-1].value
    listed = json.loads(json.dumps(spectrum.as_dict()))
    coefficients = [int(text, 0) for text in listed["polynomials"][0]]
    assert coefficients == list(spectrum[1].number.polynomial)
    assert max(coefficients) > 10**4300


def test_roots_print_decimals_and_are_those_of_sympy() -> None:
    spectrum = integer_graph(12, 0.4, 1).spectrum
    root = next(e for e in spectrum if isinstance(e.number, RealRoot))
    plain = sp.CRootOf(root.exact.poly, root.exact.index)
    assert str(root.exact) == f"{root.value:.16g}" == repr(root.exact) == sp.latex(root.exact) == sp.pretty(root.exact)
    assert root.exact == plain
    assert plain == root.exact
    assert root.exact - plain == 0
    assert root.exact != sp.CRootOf(root.exact.poly, root.exact.index - 1)
    assert pickle.loads(pickle.dumps(root.exact)) == plain
    one_way = from_matrix([[-3, 1, 2, 0], [1, -1, 0, 0], [0, 1, -3, 2], [3, 0, 0, -3]]).spectrum
    turned = next(e for e in one_way if isinstance(e.number, ComplexRoot))
    assert complex(str(turned.exact).replace("*I", "j").replace(" ", "")) == turned.value


def test_eigenvalues_are_compared_as_numbers() -> None:
    spectrum = topology("star", 4).spectrum  # 0, -1 twice, -4
    assert spectrum[0] == 0 == spectrum[0]
    assert spectrum[1] == -1.0 != spectrum[2]
    assert spectrum[2] < spectrum[1] < spectrum[0] <= 0 < 1
    assert spectrum[1] >= sp.Rational(-3, 2) >= -1.5 > spectrum[2]
    assert hash(spectrum[1]) == hash(-1)
    assert sorted(spectrum) == list(spectrum)[::-1]
    assert max(spectrum) == 0
    tiny = sp.Rational(1, 10**40)
    a, b = Eigenvalue(-sp.sqrt(2), 1), Eigenvalue(-sp.sqrt(2) + tiny, 1)
    assert a < b
    assert not b <= a
    assert a != -(2.0**0.5)
    assert a == -sp.sqrt(2)
    assert Eigenvalue(-sp.sqrt(2), 2) != a
    assert spectrum[0] != "0"
    eigenvalues = integer_graph(12, 0.4, 1).spectrum
    assert all(b < a for a, b in pairwise(eigenvalues))
    with pytest.raises(TypeError, match=r"found a complex number; .* have no order"):
        sorted(nameless_one_way_ring(3).spectrum)
    assert complex(nameless_one_way_ring(3).spectrum[1]) == nameless_one_way_ring(3).spectrum[1].value


def test_the_table() -> None:
    lines = table(topology("star", 4).spectrum).splitlines()
    assert lines[0].split() == ["exact", "decimal", "multiplicity"]
    assert [line.split() for line in lines[1:4]] == [["0", "0", "1"], ["-1", "-1", "2"], ["-4", "-4", "1"]]
    assert lines[4] == "4 eigenvalues, 3 distinct; characteristic polynomial: proved"
    long = table(integer_graph(12, 0.4, 1).spectrum)
    assert "root 0 of a polynomial of degree 11" in long
    assert max(map(len, long.splitlines())) < 100


@pytest.mark.parametrize("count", [0, -1, 1.0, True])
def test_wrong_multiplicities_are_refused(count: int) -> None:
    with pytest.raises(ValueError, match=r"eigenvalue -2: multiplicity .*; expected an integer >= 1"):
        Eigenvalue(sp.S(-2), count)
    with pytest.raises(ValueError, match="a spectrum without eigenvalues"):
        Spectrum(())


def test_the_largest_of_equal_size_is_the_first() -> None:
    assert nameless_one_way_ring(3).spectrum.largest == sp.Rational(-3, 2) - sp.sqrt(3) * sp.I / 2
    assert topology("chain", 1).spectrum.largest == 0
    mixed = from_matrix([[5, -5, 0], [-5, 5, 0], [0, 0, 0]])
    assert mixed.spectrum.largest == 10
    assert mixed.spectrum.values == (10.0, 0.0)


@pytest.mark.parametrize(("n", "share"), [(100, 0.1), (100, 0.9), pytest.param(200, 0.3, marks=pytest.mark.long)])
def test_large_matrices_take_the_fast_route(n: int, share: float, monkeypatch: pytest.MonkeyPatch) -> None:
    graph = integer_graph(n, share, 3)
    monkeypatch.setattr("synchain.models.algebra.roots.discs", lambda f: discs(f) or pytest.fail("Arb is slow"))
    eigenvalues, calls = effort(lambda: fresh(graph))
    assert calls < 2_000 * n  # 670 with the newest packages, 1900 with the lowest allowed
    assert eigenvalues.verified
    expected = np.linalg.eigvalsh(floats(graph))
    assert np.sort(expanded(eigenvalues)) == pytest.approx(expected, rel=1e-12, abs=1e-11)


@pytest.mark.parametrize("name", ["chain", "ring"])
def test_two_hundred_nodes_of_a_family_are_proved_without_general_algebra(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    graph = topology(name, 200)
    monkeypatch.setattr(sp, "minimal_polynomial", None)
    eigenvalues, calls = effort(lambda: fresh(graph))
    assert calls < 4_200 * graph.n
    assert eigenvalues.verified


def test_the_precision_of_arb_is_left_as_it_was() -> None:
    before = flint.ctx.prec
    topology("chain", 5).spectrum.evaluate(60)
    assert flint.ctx.prec == before
