"""The sequence of clusters: against closed forms, simulation on both sides of each step, and a published network."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import pytest

from synchain import Field, Scene, exponents, run, transition
from synchain.graphs import chain, complete, from_edges, one_way_ring, ring, star
from synchain.results import MSF, Transition
from synchain.runtime.cli import main
from synchain.runtime.stability.exponents import Exponents
from synchain.runtime.synchronisation.transition import TransitionCheck

WEIGHTS = {(0, 0): 0.1, (0, 1): 0.1, (0, 2): 0.1, (1, 1): 0.529, (1, 2): 0.529, (2, 2): 1.029}
GROUP = [0, 0, 0, 1, 1, 1, 2, 2, 2, 2]
TEN = from_edges([(i + 1, j + 1, WEIGHTS[GROUP[j], GROUP[i]]) for i in range(10) for j in range(i)])
"""The network of Bayani et al., Nat. Commun. 15, 4955 (2024), Fig. 2."""

MISSING = {(1, 5), (2, 7), (3, 9), (5, 11), (8, 10), (10, 11)}
ELEVEN = from_edges([(i, j) for i in range(1, 12) for j in range(i + 1, 12) if (i, j) not in MISSING])
"""The network of Pecora et al., Nat. Commun. 5, 4079 (2014), Fig. 1."""

WINDOW = Field({"x": "x + y", "y": "-1.5*x + 0.5*y"})
"""With links x -> x a mode has the matrix [[1 - alpha, 1], [-1.5, 0.5]].  Its trace is negative above alpha = 1.5, its
determinant positive below alpha = 4: the mode decays between."""


def sequence(graph, zero=7.3, top=48.0, slope=-1.0):
    """Return the sequence for a function with one zero, positive below it if the slope is negative."""
    alpha = np.linspace(0.0, top, 1001)
    value = slope * (alpha - zero)
    scene = Scene(Field({"x": "x"}), "x->x", graph)
    fine = Exponents(alpha, value, np.full(1001, 0.01), 100.0, 1, value[None])
    return Transition(MSF(scene, alpha, fine))


def test_published_network_of_ten_nodes_gives_the_published_sequence():
    """Fig. 3: nu*/6, nu*/4 and nu*/1 with nu* = 7.322; the weights make the eigenvalues 6.003, 4.003 and 1."""
    steps = sequence(TEN, 7.322).steps
    assert [step.clusters for step in steps] == [((6, 7, 8, 9),), ((3, 4, 5, 6, 7, 8, 9),), (tuple(range(10)),)]
    np.testing.assert_allclose([step.strength for step in steps], [7.322 / 6.003, 7.322 / 4.003, 7.322], rtol=1e-12)
    np.testing.assert_allclose([step.strength for step in steps], [1.220, 1.8305, 7.322], rtol=1e-3)


def test_conjugate_eigenvalues_join_nodes_only_together():
    """Eleven nodes: {1, 8} contains 10.618 and 8.382, and so joins at the smaller one."""
    steps = sequence(ELEVEN, 7.3).steps
    expected = [
        (11.0, ((3, 5),)),
        (9.0, ((1, 2, 3, 5, 6, 8),)),
        ((17 - 5**0.5) / 2 + 1, ((0, 7), (4, 9))),
        ((17 - 5**0.5) / 2, (tuple(range(11)),)),
    ]
    assert [step.clusters for step in steps] == [clusters for _, clusters in expected]
    np.testing.assert_allclose([7.3 / step.strength for step in steps], [size for size, _ in expected], rtol=1e-12)


def test_a_bounded_window_forms_clusters_and_dissolves_them():
    """Chain of three: the modes -1 and -3 are never stable together; without -1 the ends are equal."""
    scene = Scene(WINDOW, "x->x", chain(3), parameters={"sigma": 3.0})
    result = transition(scene, np.linspace(0, 24, 481))
    assert [(step.clusters, step.joins) for step in result.steps] == [(((0, 2),), True), (((0, 2),), False)]
    np.testing.assert_allclose([step.strength for step in result.steps], [1.5, 4.0], rtol=1e-6)
    assert result.first == (0, 1, 2)
    assert result.highest == 8.0
    assert "sigma = 1.5000" in str(result)
    assert "{1, 3} join" in str(result)
    assert "{1, 3} part" in str(result)


def test_steps_of_the_linear_window_are_those_of_a_simulation():
    """On both sides of each step, the difference of the two ends decays or grows as the step predicts."""
    scene = Scene(
        WINDOW,
        "x->x",
        chain(3),
        initial={"x": [1.0, 0.2, -0.5], "y": [0.3, 0.1, 0.0]},
        transient=0,
        window=20,
        time_unit="time",
    )
    states = run(scene, sigma=[1.2, 1.8, 3.5, 4.5], show_progress=False).end
    apart = np.abs(states.sel(node=1) - states.sel(node=3)).max("component").values
    assert (apart < 0.5).tolist() == [False, True, True, False]
    assert (apart > 1.5).tolist() == [True, False, False, True]


def test_a_function_that_is_negative_from_zero_dissolves_synchrony():
    result = sequence(star(5), 2.0, slope=1.0)
    assert result.first == (0,) * 5
    assert [(step.clusters, step.joins) for step in result.steps] == [
        (((0, 1, 2, 3, 4),), False),  # the mode -5 separates the hub
        (((1, 2, 3, 4),), False),
    ]
    np.testing.assert_allclose([step.strength for step in result.steps], [0.4, 2.0], rtol=1e-12)


def test_parts_without_links_join_only_if_oscillators_alone_do():
    parts = from_edges([(1, 2), (3, 4)])
    assert [step.classes for step in sequence(parts).steps] == [(0, 0, 1, 1)]
    assert sequence(parts, 1.0, slope=1.0).first == (0, 0, 0, 0)


def test_steps_end_where_the_fastest_mode_leaves_the_grid():
    result = sequence(TEN, top=24.0)
    assert len(result.steps) == 2
    assert result.highest == pytest.approx(24 / 6.003)
    assert "8 clusters" not in str(result)
    assert "4 clusters; there the grid of alpha ends" in str(result)


def test_errors_are_those_of_the_zero_divided_by_the_eigenvalue():
    result = sequence(TEN)
    errors = np.array([step.error for step in result.steps])
    np.testing.assert_allclose(errors * [6.003, 4.003, 1.0], result.function.uncertainties[0][0], rtol=1e-12)
    np.testing.assert_allclose(errors[-1], 0.01, rtol=1e-3)


def test_complex_and_missing_modes_are_refused():
    node = Field({"x": "x"})
    with pytest.raises(ValueError, match=r"complex eigenvalue -1\.5-0\.866025j; expected real"):
        transition(Scene(node, "x->x", one_way_ring(3)))
    with pytest.raises(ValueError, match="found 0 layers of links; expected one"):
        transition(Scene(node))
    with pytest.raises(ValueError, match="alpha from 1 to 2; expected strengths from 0 on"):
        transition(Scene(node, "x->x", chain(3)), [1.0, 2.0])
    with pytest.raises(ValueError, match="positive eigenvalue"):
        transition(Scene(node, "x->x", from_edges([(1, 2, -1), (2, 3, 1)])))


@pytest.fixture(scope="module")
def lorenz():
    """The sequence of four Lorenz oscillators on a star, and its check."""
    node = Field({"x": "10*(y - x)", "y": "x*(28 - z) - y", "z": "x*y - 2*z"}, initial={"x": 1})
    result = transition(Scene(node, "x->x", star(4), parameters={"sigma": 5.0}), periods=1000)
    return result, result.verify(0.2, periods=1000, transient=100)


def test_exponents_of_the_state_confirm_the_last_step(lorenz):
    """For the state of all nodes the exponents along the state's own motion are those of the function itself."""
    result, check = lorenz
    assert [step.classes for step in result.steps] == [(0, 0, 0, 0)]
    assert result.steps[0].strength == pytest.approx(7.3, abs=0.1)  # Huang et al., Phys. Rev. E 80, 036204 (2009)
    assert check.verdicts == ("confirmed",)
    alone = exponents(result.scene, check.strength[0], periods=1000)
    assert np.all(np.abs(check.exponent[0] - alone.exponent) < 4 * np.hypot(check.stderr[0], alone.stderr))
    assert abs(check.crossing[0] - result.steps[0].strength) < 0.3
    assert "confirmed; exponents" in str(check)


def test_a_wrong_step_is_not_confirmed(lorenz):
    """The exponent is negative on both sides of a strength far above the true one."""
    result, check = lorenz
    fine = result.function.fine
    wrong = Exponents(fine.alpha, fine.exponent + 2.0 * (fine.alpha < 9.0), fine.stderr, 1.0, 1, fine.by_start)
    planted = Transition(MSF(result.scene, result.function.alpha, wrong))
    assert planted.verify(0.1, periods=500, transient=100).verdicts == ("stable on both sides",)
    turned = TransitionCheck(result, check.strength, -check.exponent, check.stderr, check.remarks)
    assert turned.verdicts == ("reversed",)
    doubtful = TransitionCheck(result, check.strength, check.exponent, np.full((1, 2), 9.0), check.remarks)
    assert doubtful.verdicts == ("undecided within the errors",)


def test_states_without_exponents_are_named():
    twins = from_edges([*((k, k + 1) for k in range(33)), (32, 34)])
    many = sequence(twins, 0.5, top=8.0)
    assert [(len(step.clusters[0]), max(step.classes)) for step in many.steps[:1]] == [(2, 33)]
    checked = many.verify(periods=2, transient=0)
    assert checked.verdicts[0] == "not computed"
    assert checked.remarks[0] == "34 clusters; exponents are computed for at most 32"
    with pytest.raises(ValueError, match="apart: found 1; expected a number between 0 and 1"):
        sequence(star(3)).verify(1.0)


def test_clusters_that_no_balanced_partition_has_are_named():
    """A leaf and its neighbour lie where the slowest mode of this tree is zero; they feel different sums of weights."""
    tree = from_edges([(0, 1), (1, 2), (1, 3), (2, 4), (3, 5)])
    *_, last, all_nodes = sequence(tree, 1.0).steps
    assert last.clusters == ((0, 1),)
    assert last.imbalance.startswith("partition is not balanced: nodes 1 and 2")
    assert all_nodes.imbalance == ""
    result = sequence(tree, 1.0, top=10.0)
    assert "{0, 1} join to first order" in str(result)
    assert result.verify(periods=2, transient=0).remarks == (f"no such state: {last.imbalance}",)


def test_a_plot_has_a_line_for_each_node_and_step():
    _, axes = plt.subplots()
    result = sequence(TEN)
    result.plot(axes)
    assert len(axes.lines) == 4 * 10 + 3
    assert axes.get_xlim() == (0.0, pytest.approx(result.highest))
    assert axes.get_xlabel() == r"$\sigma$"
    colours = {line.get_color() for line in axes.lines if line.get_linewidth() == 5.0}
    assert len(colours) == 1  # one cluster, which grows
    plt.close()


def test_a_plot_without_exponents_has_a_remark_and_no_legend(recwarn):
    _, axes = plt.subplots()
    unknown = np.full((4, 2), np.nan)
    TransitionCheck(sequence(ELEVEN), np.ones((4, 2)), unknown, unknown, ("",) * 4).plot(axes)
    assert axes.get_legend() is None
    assert [text.get_text() for text in axes.texts] == ["no step has exponents on both sides"]
    assert not recwarn
    plt.close()


def test_the_command_prints_what_python_prints(tmp_path, capsys):
    scene = Scene(WINDOW, "x->x", ring(4), parameters={"sigma": 1.0})
    scene.save(tmp_path / "ring.toml")
    assert main(["transition", str(tmp_path / "ring.toml"), "--alpha", "0:8:161"]) == 0
    assert capsys.readouterr().out == f"{transition(scene, np.linspace(0, 8, 161))!r}\n"


def test_complete_graphs_have_a_single_step():
    (step,) = sequence(complete(6)).steps
    assert (step.classes, step.eigenvalue.multiplicity) == ((0,) * 6, 5)
