"""Stable ranges projected onto networks: windows, verdicts, exact ties, modes at the ends."""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from synchain.graphs import Topology, from_matrix, topology
from synchain.models.algebra.roots import RealRoot
from synchain.models.spectra.eigenvalue import Eigenvalue
from synchain.models.spectra.eigenvalue_order import compare
from synchain.models.spectra.jordan import geometric_multiplicity
from synchain.runtime.prediction.mode_windows import transversal_modes
from synchain.runtime.prediction.stable_ranges import StableRange, exact_ranges, widen
from synchain.runtime.prediction.synchronisability import verdict, windows
from synchain.runtime.synchronisation.threshold import project

ONE = Fraction(1)


def pieces(windows) -> list[tuple[float, float]]:
    return [(w.low, w.high) for w in windows]


def weighted(n: int, seed: int) -> Topology:
    """A connected random graph with small whole weights."""
    random = np.random.default_rng(seed)
    a = np.triu(random.integers(0, 4, (n, n)), 1) + np.diag(np.ones(n - 1, int), 1)
    a = a + a.T
    return from_matrix((a - np.diag(a.sum(axis=1))).tolist())


def feed_forward(n: int) -> Topology:
    return Topology("feed-forward", n, tuple((i, i - 1, ONE) for i in range(1, n)))


def nested(graph: Topology) -> Topology:
    """A root drives a copy of the graph, node by node, and that copy a second one: every mode gamma - 1 twice, defective."""
    n, links = graph.n, []
    for layer in (0, 1):
        start = 1 + layer * n
        links += [(start + i, start + j, weight) for i, j, weight in graph.links]
        links += [(start + i, 0 if layer == 0 else start + i - n, ONE) for i in range(n)]
    return Topology("nested", 2 * n + 1, tuple(sorted(links)))


# -- windows -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("graph", [topology("chain", 4), topology("ring", 7), topology("star", 6), weighted(6, 1)])
@pytest.mark.parametrize("ranges", [[(0.0, 0.7)], [(0.1, 3.0)], [(0.1, math.inf)], [(0.0, 0.2), (0.5, 9.0)]])
def test_windows_are_the_rounded_projection_of_ranges(graph: Topology, ranges: list[tuple[float, float]]) -> None:
    expected = project(ranges, graph.spectrum)
    assert [list(p) for p in pieces(windows(ranges, graph))] == [pytest.approx(list(p), rel=1e-14) for p in expected]


@settings(max_examples=40)
@given(st.integers(0, 10_000), st.lists(st.integers(0, 400), min_size=2, max_size=6, unique=True))
def test_every_sigma_is_inside_exactly_where_all_modes_are_stable(seed: int, ends: list[int]) -> None:
    ends = sorted(ends)[: len(ends) // 2 * 2]
    ranges = [(a / 40, b / 40) for a, b in zip(ends[::2], ends[1::2], strict=True)]
    graph = weighted(4 + seed % 3, seed)
    found = pieces(windows(ranges, graph))
    gamma = np.abs(np.linalg.eigvalsh(np.array(graph.rows, dtype=float)))[:-1]
    for sigma in np.linspace(0.0003, 5.0, 701):
        stable = all(any(a <= sigma * g <= b for a, b in ranges) for g in gamma)
        assert stable == any(low <= sigma <= high for low, high in found), sigma
    assert all(b < c for (_, b), (c, _) in pairwise(found))


def test_modes_straddle_ranges_and_the_modes_lost_first_are_named() -> None:
    """Star of 3: sigma and 3 sigma each in [1, 2], [4.5, 5] or from 5.4 on: windows worked out by hand."""
    ranges = windows([(1.0, 2.0), (4.5, 5.0), (5.4, math.inf)], topology("star", 3))
    assert pieces(ranges) == [(1.5, 5 / 3), (5.4 / 3, 2.0), (4.5, 5.0), (5.4, math.inf)]
    lost = [tuple(m and int(m.eigenvalue.number) for m in (w.low_mode, w.high_mode)) for w in ranges]
    assert lost == [(-3, -3), (-3, -1), (-1, -1), (-1, None)]


def test_one_range_is_lost_by_the_slowest_mode_below_and_the_fastest_above() -> None:
    graph = topology("chain", 4)
    (window,) = windows([(0.1, 2.0)], graph, [(0.01, 0.3)])
    slow, fast = 2 - math.sqrt(2), 2 + math.sqrt(2)
    assert (window.low, window.high) == pytest.approx((0.1 / slow, 2.0 / fast), rel=1e-14)
    assert (window.low_error, window.high_error) == pytest.approx((0.01 / slow, 0.3 / fast), rel=1e-14)
    assert window.low_mode is not None
    assert window.high_mode is not None
    assert (window.low_mode.number, window.high_mode.number) == (1, 3)
    assert window.low_mode.eigenvalue.exact == -2 + sp.sqrt(2)


def test_ends_at_zero_and_infinity_have_no_mode_and_no_error() -> None:
    (window,) = windows([(0.0, math.inf)], topology("ring", 5), [(0.1, 0.1)])
    assert (window.low, window.high, window.low_mode, window.high_mode) == (0.0, math.inf, None, None)
    assert (window.low_error, window.high_error) == (0.0, 0.0)


@pytest.mark.parametrize("ranges", [[(-3.5, -1.0), (-0.4, 0.9)], [(-2.0, 0.0)], [(-9.0, -0.5), (1.0, 4.0)]])
def test_negative_sigma_is_served_by_negative_alpha(ranges: list[tuple[float, float]]) -> None:
    graph = topology("chain", 3)  # sigma and 3 sigma
    errors = [(0.01 * k, 0.02 * k) for k in range(1, 1 + len(ranges))]
    sigma_windows = windows(ranges, graph, errors)
    back = windows([(0.0 - b, 0.0 - a) for a, b in ranges[::-1]], graph, [e[::-1] for e in errors[::-1]])
    ends = [(w.high, w.low, w.high_error, w.low_error, w.high_mode, w.low_mode) for w in back[::-1]]
    assert [(-w.low, -w.high, w.low_error, w.high_error, w.low_mode, w.high_mode) for w in sigma_windows] == ends
    expected = project(ranges, graph.spectrum, math.inf, -math.inf)
    assert [list(p) for p in pieces(sigma_windows)] == [pytest.approx(list(p), rel=1e-14) for p in expected]


def test_a_window_across_zero_is_one() -> None:
    (window,) = windows([(-0.6, 1.2)], topology("chain", 3), [(0.3, 0.6)])
    assert (window.low, window.high) == pytest.approx((-0.2, 0.4))
    assert (window.low_error, window.high_error) == pytest.approx((0.1, 0.2))
    assert window.low_mode is not None
    assert window.low_mode == window.high_mode
    assert window.low_mode.size == 3.0


def test_parts_that_nothing_couples_ask_for_stability_at_zero() -> None:
    pairs = Topology("two pairs", 4, ((0, 1, ONE), (1, 0, ONE), (2, 3, ONE), (3, 2, ONE)))
    assert windows([(0.1, 1.0)], pairs) == ()
    assert pieces(windows([(0.0, 1.0)], pairs)) == [(0.0, 0.5)]
    assert verdict([(0.1, 1.0)], pairs).answer == "no"
    assert verdict([(0.1, 1.0)], pairs, [(0.1, 0.0)]).answer == "undecided within the error"


def test_ends_may_be_numbers_of_numpy_or_fractions() -> None:
    graph = topology("star", 3)
    assert pieces(windows(np.array([[1, 4]], dtype=np.float32), graph)) == [(1.0, 4 / 3)]
    assert pieces(windows([(ONE / 3, ONE)], graph)) == [(1 / 3, 1 / 3)]
    assert windows([(1 / 3, 1 - 2**-53)], graph) == ()


def test_no_modes_and_no_ranges() -> None:
    alone = topology("chain", 1)
    assert pieces(windows([(1.0, 2.0)], alone)) == [(0.0, math.inf)]
    assert windows([], topology("chain", 2)) == ()
    assert verdict([], topology("chain", 2)).answer == "no"
    assert verdict([(1.0, 2.0)], alone).ratio is None


# -- exact order ---------------------------------------------------------------------------------------------


def test_a_range_exactly_as_wide_as_the_eigenratio_leaves_one_sigma() -> None:
    for n in (3, 5, 7):
        below, above = math.nextafter(n, 0), math.nextafter(n, 9)
        assert pieces(windows([(1.0, float(n))], topology("star", n))) == [(1.0, 1.0)]
        answers = [verdict([(1.0, high)], topology("star", n)).answer for high in (below, float(n), above)]
        assert answers == ["no", "yes", "yes"]


def test_equal_strengths_of_irrational_modes_are_proved_equal() -> None:
    """Links three times as strong, modes three times as fast: cubic eigenvalues without radicals, and square roots."""
    weak = from_matrix([[-6, 2, 1, 3], [2, -7, 1, 4], [1, 1, -6, 4], [3, 4, 4, -11]])
    strong = from_matrix([[3 * x for x in row] for row in weak.rows])
    for a, b in zip(weak.spectrum.nonzero, strong.spectrum.nonzero, strict=True):
        assert isinstance(a.number, RealRoot)
        assert compare(ONE / 7, a, Fraction(3, 7), b) == 0
        assert compare(ONE / 7, a, Fraction(3, 7) + Fraction(1, 10**400), b) == -1
    root = Eigenvalue(-2 + sp.sqrt(2), 1)
    assert compare(Fraction(1), root, Fraction(5), Eigenvalue(5 * (-2 + sp.sqrt(2)).expand(), 1)) == 0


def test_conjugates_share_a_polynomial_and_are_not_equal() -> None:
    slow, fast = Eigenvalue(-2 + sp.sqrt(2), 1), Eigenvalue(-2 - sp.sqrt(2), 1)
    assert compare(ONE, slow, ONE, fast) == 1
    assert compare(ONE, fast, ONE, slow) == -1


def test_conjugates_closer_than_any_first_look_are_told_apart() -> None:
    tiny = sp.sqrt(2) / 2**700
    slow, fast = Eigenvalue(-1 + tiny, 1), Eigenvalue(-1 - tiny, 1)
    assert [compare(ONE, slow, ONE, fast), compare(ONE, fast, ONE, slow)] == [1, -1]


def test_strengths_that_agree_to_a_hundred_digits_are_told_apart() -> None:
    root, p, q = Eigenvalue(-sp.sqrt(2), 1), 1, 1
    for step in range(300):
        assert compare(Fraction(p, q), root, ONE, Eigenvalue(sp.S.NegativeOne, 1)) == (-1 if p * p < 2 * q * q else 1)
        p, q = p + 2 * q, p + q
        assert step < 299 or q > 10**100


@pytest.mark.parametrize(("alpha", "gamma"), [(-ONE, -1), (ONE, 1), (ONE, 0), (ONE, -1 + sp.I)])
def test_strengths_of_no_meaning_are_refused(alpha: Fraction, gamma: sp.Expr) -> None:
    with pytest.raises(ValueError, match="expected alpha >= 0 and a real eigenvalue < 0"):
        compare(alpha, Eigenvalue(sp.sympify(gamma), 1), ONE, Eigenvalue(sp.S.NegativeOne, 1))


# -- verdicts ------------------------------------------------------------------------------------------------


def test_the_verdict_states_the_exact_eigenratio() -> None:
    answer = verdict([(0.1, 0.6)], topology("chain", 4))
    assert answer.answer == "yes"
    assert answer.ratio == 3 + 2 * sp.sqrt(2)  # cot²(π/8)
    assert answer.ratio_value == pytest.approx(1 / math.tan(math.pi / 8) ** 2, rel=1e-14)
    assert answer.allowed == pytest.approx(6.0)
    assert answer.slowest is not None
    assert answer.slowest.number == 1
    assert verdict([(0.1, 0.6)], weighted(6, 3)).ratio is None


@pytest.mark.parametrize(
    ("error", "answer"),
    [(0.0, "yes"), (0.04, "yes"), (0.06, "undecided within the error"), (2.0, "undecided within the error")],
)
def test_errors_of_a_range_that_is_wide_enough(error: float, answer: str) -> None:
    """Star of 5 in (1, 5.25): the ratio 5 fits while (5.25 - e) >= 5 (1 + e), e <= 0.25/6."""
    assert verdict([(1.0, 5.25)], topology("star", 5), [(error, error)]).answer == answer


@pytest.mark.parametrize(("error", "answer"), [(0.04, "no"), (0.05, "undecided within the error")])
def test_errors_of_a_range_that_is_too_narrow(error: float, answer: str) -> None:
    assert verdict([(1.0, 4.75)], topology("star", 5), [(error, error)]).answer == answer


def test_an_end_at_zero_is_no_measured_end() -> None:
    assert verdict([(0.0, 1.0)], topology("chain", 30), [(0.1, 0.1)]).answer == "yes"
    assert verdict([(0.01, 1.0)], topology("chain", 30), [(0.005, 0.0)]).answer == "no"
    assert verdict([(0.01, 1.0)], topology("chain", 30), [(0.01, 0.0)]).answer == "undecided within the error"


@pytest.mark.parametrize(
    ("low", "high", "ratio"),
    [(1, 3, 3.0), (2, 3, 1.5), (3, 3, 1.0), (1, None, math.inf), (0, None, math.inf), (0, 2, math.inf), (0, 0, 0.0)],
)
def test_the_largest_eigenratio_that_a_range_holds(low: int, high: int | None, ratio: float) -> None:
    assert StableRange(Fraction(low), None if high is None else Fraction(high)).ratio == ratio


def test_what_lies_below_zero_is_cut_off_with_its_errors() -> None:
    given = [(-3.0, -2.0), (-1.0, 0.5), (1.0, 2.0), (3.0, math.inf)]
    assert exact_ranges(given, [(0.25, 0.25)] * 4) == [
        StableRange(Fraction(0), Fraction(1, 2), (0.0, 0.25)),
        StableRange(Fraction(1), Fraction(2), (0.25, 0.25)),
        StableRange(Fraction(3), None, (0.25, 0.0)),
    ]
    assert exact_ranges([(-1.0, 0.0)], [(0.25, 0.25)]) == [StableRange(Fraction(0), Fraction(0), (0.0, 0.25))]
    assert exact_ranges([(0.0, 1.0)], [(0.25, 0.25)]) == [StableRange(Fraction(0), Fraction(1), (0.0, 0.25))]


def test_ranges_that_just_meet_are_joined_and_one_that_shrinks_to_a_point_stays() -> None:
    given = exact_ranges([(1.0, 1.5), (2.0, 3.0)], [(0.25, 0.25), (0.25, 0.25)])
    assert widen(given, 1) == [StableRange(Fraction(3, 4), Fraction(13, 4))]
    assert widen(given, -1)[0] == StableRange(Fraction(5, 4), Fraction(5, 4))
    below = exact_ranges([(0.125, 1.0), (2.0, 2.0)], [(0.25, 0.0), (2.0, 0.0)])
    assert widen(below, 1) == [StableRange(Fraction(0), Fraction(2))]  # no range begins below 0
    unending = exact_ranges([(1.0, 1.5), (2.0, math.inf)], [(0.25, 0.25), (0.25, 0.0)])
    assert [(r.low, r.high, r.errors) for r in widen(unending, 1)] == [(Fraction(3, 4), None, (0.0, 0.0))]
    later = exact_ranges([(1.0, 2.0), (4.0, 5.0), (5.25, 6.0)], [(0.25, 0.25)] * 3)
    assert [(r.low, r.high) for r in widen(later, 1)] == [(0.75, 2.25), (3.75, 6.25)]
    inside = exact_ranges([(1.0, 4.0), (5.0, 6.0)], [(0.0, 3.0), (2.0, 0.0)])
    assert widen(inside, 1) == [StableRange(Fraction(1), Fraction(7))]


def test_ranges_that_meet_within_their_errors_are_one() -> None:
    wide = widen(exact_ranges([(1.0, 2.0), (3.0, 4.0), (6.0, math.inf)], [(0.5, 0.5), (0.5, 0.25), (0.5, 0.0)]), 1)
    assert [(r.low, r.high) for r in wide] == [(0.5, 4.25), (5.5, None)]
    narrow = widen(exact_ranges([(1.0, 2.0), (3.0, 4.0)], [(0.75, 0.5), (0.25, 0.25)]), -1)
    assert [(r.low, r.high) for r in narrow] == [(3.25, 3.75)]


def test_several_ranges_within_their_errors() -> None:
    """Modes at 2 sigma and 4 sigma: one range must hold both, or two ranges a number and its double."""
    ring, ranges = topology("ring", 4), [(1.0, 1.4), (2.1, 2.2), (2.9, 2.95)]
    assert verdict(ranges, ring).answer == "yes"
    assert verdict(ranges[::2], ring).answer == "no"
    assert verdict(ranges[::2], ring, [(0.0, 0.02), (0.05, 0.0)]).answer == "no"
    assert verdict(ranges[::2], ring, [(0.0, 0.03), (0.05, 0.0)]).answer == "undecided within the error"
    assert verdict(ranges, ring, [(0.0, 0.0), (0.06, 0.06), (0.0, 0.0)]).answer == "undecided within the error"
    assert (
        verdict([(1.0, 1.4), (1.6, 1.875)], ring, [(0.0, 0.25), (0.125, 0.125)]).answer == "undecided within the error"
    )


def test_a_range_that_is_stable_at_zero_only_does_not_synchronise() -> None:
    assert verdict([(0.0, 0.0)], topology("chain", 2)).answer == "no"
    assert verdict([(0.0, 1e-300)], topology("chain", 30)).answer == "yes"


@pytest.mark.parametrize(
    ("ranges", "errors", "message"),
    [
        ([(2.0, 1.0)], None, "stable range 1 is"),
        ([(0.0, 1.0), (0.9, 2.0)], None, "stable range 2 is .* after 1.0; expected disjoint"),
        ([(0.0, math.nan)], None, "stable range 1 is"),
        ([(-math.inf, 1.0)], None, "stable range 1 is"),
        ([(0.0, 1.0)], [(0.0, -1.0)], "errors of range 1"),
        ([(0.0, 1.0)], [(0.0, math.inf)], "errors of range 1"),
        ([(0.0, 1.0)], [], "found 0 pairs for 1 ranges"),
    ],
)
def test_wrong_ranges_are_refused(ranges, errors, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        windows(ranges, topology("chain", 3), errors)


def test_complex_and_positive_eigenvalues_are_refused() -> None:
    one_way = Topology("one-way ring", 3, tuple((i, (i + 1) % 3, ONE) for i in range(3)))
    with pytest.raises(
        ValueError, match=r"complex eigenvalue .* Use synchain\.runtime\.prediction\.synchronisability\.windows_complex"
    ):
        windows([(0.0, 1.0)], one_way)
    with pytest.raises(ValueError, match=r"positive eigenvalue 2, .* negate it"):
        verdict([(0.0, 1.0)], from_matrix([[1, -1], [-1, 1]]))


# -- modes ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [2, 3, 4, 9])
def test_the_vectors_of_a_chain_are_cosines(n: int) -> None:
    for k, mode in enumerate(transversal_modes(topology("chain", n)), 1):
        expected = np.cos(np.pi * k * (np.arange(n) + 0.5) / n)
        expected /= np.linalg.norm(expected)
        assert mode.number == k
        largest = int(np.argmax(mode.vector))
        assert mode.vector == pytest.approx(expected * np.sign(expected[largest]), abs=1e-12)
        assert mode.vector[largest] >= np.abs(mode.vector).max() - 1e-12


def test_the_vector_of_a_multiple_mode_is_the_one_that_stands_out_at_one_leaf() -> None:
    slow, fast = transversal_modes(topology("star", 5))
    assert (slow.number, slow.multiplicity, fast.number) == (1, 3, 4)
    assert slow.vector == pytest.approx(np.array([0, 3, -1, -1, -1]) / math.sqrt(12), abs=1e-12)
    assert fast.vector == pytest.approx(np.array([4, -1, -1, -1, -1]) / math.sqrt(20), abs=1e-12)


def test_large_networks_have_modes_but_no_dense_vectors() -> None:
    mode = transversal_modes(topology("star", 3000))[0]
    with pytest.raises(ValueError, match=r"eigenvector of star\(3000\): expected at most 2000 nodes"):
        _ = mode.vector


def test_a_feed_forward_chain_has_one_eigenvector_for_all_its_modes() -> None:
    (mode,) = transversal_modes(feed_forward(6))
    assert (mode.eigenvalue.number, mode.multiplicity, mode.defective) == (-1, 5, True)
    assert geometric_multiplicity(mode.graph, mode.eigenvalue) == 1
    assert mode.vector == pytest.approx(np.eye(6)[5], abs=1e-12)
    assert pieces(windows([(0.5, 2.0)], mode.graph)) == [(0.5, 2.0)]


def test_missing_eigenvectors_of_irrational_modes_are_counted_exactly() -> None:
    graph = nested(topology("chain", 4))
    multiplicities = {
        str(m.eigenvalue): (m.multiplicity, geometric_multiplicity(graph, m.eigenvalue))
        for m in transversal_modes(graph)
    }
    assert multiplicities == {"-1": (2, 1), "-3 + sqrt(2)": (2, 1), "-3": (2, 1), "-3 - sqrt(2)": (2, 1)}


def test_modes_that_occur_twice_with_all_their_vectors_are_not_defective() -> None:
    chain = topology("chain", 4)
    links = [(1 + i, 1 + j, w) for i, j, w in chain.links] + [(5 + i, 5 + j, w) for i, j, w in chain.links]
    graph = Topology("driven twice", 9, tuple(sorted(links + [(i, 0, ONE) for i in range(1, 9)])))
    assert [(m.multiplicity, m.defective) for m in transversal_modes(graph)] == [(2, False)] * 4
