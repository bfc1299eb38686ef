"""Nodes with parameters of their own, nodes of several kinds: scenes, equations, sweeps, what is refused and what merges."""

from __future__ import annotations

import re

import numpy as np
import pytest
import sympy as sp
from catalogue import real
from scipy.integrate import solve_ivp
from variational_reference import transversal_equations

from synchain import Field, Lagrangian, Scene, exponents, link_energy, load_scene, open_result, run
from synchain.codegen.export.python import to_python
from synchain.codegen.kernels.observable_functions import Recording
from synchain.codegen.kernels.sweep_kernel import emit
from synchain.export import text
from synchain.graphs import chain, from_matrix, ring, star
from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME, Node
from synchain.runtime.cells.reduce import reduce_scene
from synchain.runtime.sweeps.certify import certify
from synchain.runtime.synchronisation.probe import ring_of_three

DUFFING = {"delta": [0.1, 0.2, 0.3], "omega": [1.0, 1.5, 2.0]}


def scene(**changes: object) -> Scene:
    settings = {"oscillator": "duffing", "topology": chain(3), "parameters": {"sigma": 0.1, **DUFFING}, "transient": 0,
             "window": 20, "record": (), "rtol": 1e-10}  # fmt: skip
    return Scene(**{**settings, **changes})


def mixed(**changes: object) -> Scene:
    settings = {"nodes": [{"oscillator": "van_der_pol", "at": [2]}], "parameters": {"sigma": 0.1}, "time_unit": "time"}
    return scene(**{**settings, **changes})


def by_scipy(scene: Scene, end: float) -> np.ndarray:
    """The state at the end by SciPy from the exported source."""
    space: dict = {}
    exec(compile(to_python(scene.equations, scene.parameters), "<export>", "exec"), space)
    return solve_ivp(space["rhs"], (0, end), scene.y0, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]


# -- scenes ----------------------------------------------------------------------------------------------------


def test_a_list_is_one_parameter_for_each_node() -> None:
    network = scene()
    assert network.varied == ("delta", "omega")
    assert network.equations.parameters == (
        "delta_1", "delta_2", "delta_3", "beta", "u", "omega_1", "omega_2", "omega_3", "sigma")  # fmt: skip
    assert network.time_unit == "time"
    assert network.period is None
    assert network.as_dict()["parameters"]["delta"] == [0.1, 0.2, 0.3]
    assert Scene.from_dict(network.as_dict()) == network == network.replace(title="")


def test_equations_of_nodes_with_their_own_parameters() -> None:
    x, v = ([real(f"{c}_{i}") for i in (1, 2, 3)] for c in "xv")
    beta, u, sigma = (real(name) for name in ("beta", "u", "sigma"))
    rows = []
    for i in range(3):
        felt = sum(sigma * (x[j] - x[i]) for j in (i - 1, i + 1) if 0 <= j < 3)
        drive = u * sp.cos(real(f"omega_{i + 1}") * TIME)
        rows.append(-x[i] - beta * x[i] ** 3 - real(f"delta_{i + 1}") * v[i] + drive + felt)
    assert [sp.expand(a - b) for a, b in zip(scene().equations.rhs(), [*v, *rows], strict=True)] == [0] * 6
    assert "δ_2 x_2'" in text(scene().equations)
    assert "ω_3" in text(scene().equations)


def test_equal_numbers_are_equal_nodes() -> None:
    same = scene(parameters={"sigma": 0.1, "delta": [0.1, 0.1, 0.1], "omega": 1.0})
    assert same == scene(parameters={"sigma": 0.1})
    assert emit(same.equations, width=2).text == emit(scene(parameters={}).equations, width=2).text


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"delta": [0.1, 0.2]}, "parameter 'delta': found 2 values for 3 oscillators; expected 3 values or one number"),
        ({"delta": range(5)}, "found 5 values for 3 oscillators"),
        ({"delta": {0.1, 0.2, 0.3}}, "a set, which has no order"),
        (
            {"sigma": [0.1, 0.2, 0.3]},
            "'sigma' on chain(3): found 3 values for 4 links; expected 2 values, one for each edge, or one for each link",
        ),
        ({"delta_4": 0.1}, "unknown parameter 'delta_4'"),
        ({"sigma_1": 0.1}, "unknown parameter 'sigma_1'"),
        ({"omega": [1, -1, 2]}, "omega_2"),
    ],
)
def test_lists_that_fit_no_network(keywords: dict, message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=re.escape(message)):
        scene(parameters=keywords)


def test_states_that_numbers_make_alike_are_refused() -> None:
    node = Field({"x": "-x + x_1", "x_1": "-x_1"})
    with pytest.raises(ValueError, match="'x_1' has the name of 'x' at node 1"):
        Scene(node, "x->x", chain(2))
    assert Scene(Field({"x_1": "-x_1", "x_2": "-x_2"}), "x_1->x_1", chain(2)).equations.dimension == 4


def test_a_name_that_two_parameters_would_have() -> None:
    x, v, a, twin = (real(name) for name in ("x", "v", "a", "a_2"))
    node = Node((x, v), (v, -a * x - twin * v), (a, twin))
    assert Equations.of_equal_nodes(node, None, 2).parameters == ("a", "a_2")
    with pytest.raises(ValueError, match="'a_2' stands for two parameters"):
        Equations.of_equal_nodes(node, None, 2, varied=("a",))


def test_numbers_of_nodes_named_as_another_parameter_are_refused_by_the_scene() -> None:
    node = Field({"x": "-k*x - k_2"}, parameters={"k": 1, "k_2": 2})
    assert Scene(node, "x->x", chain(2)).parameters["k_2"] == 2
    for wrong in ({"parameters": {"k": [1, 3]}}, {"axes": {"k_1": [1, 3]}}):
        with pytest.raises(
            ValueError, match=r"^parameter 'k': found a number for each .* 'k_2' stands for two parameters"
        ):
            Scene(node, "x->x", chain(2), **wrong)


def test_a_swept_parameter_of_one_node() -> None:
    network = scene(parameters={"sigma": 0.1}, axes={"delta_2": [0.1, 0.2]}, time_unit="time")
    assert network.varied == ("delta",)
    assert network.replace(axes={}).varied == ()
    with pytest.raises(ValueError, match="axis 'delta': nodes or links have different values"):
        scene(axes={"delta": [0.1, 0.2]})
    with pytest.raises(ValueError, match="delta has values for 3 nodes"):
        scene().replace(topology=chain(4))
    assert scene().replace(delta=0.1).varied == ("omega",)
    assert scene().replace(delta_2=0.7).parameters["delta_2"] == 0.7


# -- sweeps ----------------------------------------------------------------------------------------------------


def test_a_sweep_over_one_node_and_what_it_resumes(tmp_path) -> None:
    network = scene(axes={"delta_2": [0.1, 0.4]})
    result = run(network)
    for k, value in enumerate((0.1, 0.4)):
        np.testing.assert_allclose(result.states()[k], by_scipy(network.replace(axes={}, delta_2=value), 20), atol=2e-8)
    result.save(tmp_path / "made.nc")
    again = open_result(tmp_path / "made.nc")
    assert again.scene == network
    assert run(network, resume=again).states("end").tolist() == result.states("end").tolist()


def test_nodes_merge_where_their_parameters_agree() -> None:
    """A ring of four with dampings a, b, a, b: opposite nodes start equal, and only with equal dampings they stay so."""
    settings = {"topology": ring(4), "initial": {"x": [0.3, 0.1, 0.3, 0.1], "v": 0}, "time_unit": "time"}
    pairs = scene(parameters={"sigma": 0.1, "delta": [0.1, 0.2, 0.1, 0.2]}, **settings)
    chosen = reduce_scene(pairs)
    assert chosen.equations.n == 2
    assert [pairs.equations.parameters[k] for k in chosen.numbers][:2] == ["delta_1", "delta_2"]
    assert reduce_scene(scene(parameters={"sigma": 0.1, "delta": [0.1, 0.2, 0.3, 0.2]}, **settings)).equations.n == 3
    swept = scene(parameters={"sigma": 0.1}, axes={"delta_3": [0.1, 0.2]}, **settings)
    assert reduce_scene(swept).equations.n == 3
    np.testing.assert_allclose(run(pairs).states(), by_scipy(pairs, 20), atol=2e-8)


def test_what_needs_equal_nodes_says_so() -> None:
    network = scene(parameters={"sigma": 0.1, "delta": [0.1, 0.2, 0.3]})
    for refuse in (lambda: transversal_equations(network.equations), lambda: ring_of_three(network.equations), lambda: certify(network),
                   lambda: exponents(network, [0.1])):  # fmt: skip
        with pytest.raises(ValueError, match="nodes that differ in delta; expected equal nodes"):
            refuse()
    with pytest.raises(ValueError, match="nodes of several kinds; expected equal nodes"):
        transversal_equations(mixed().equations)
    assert any(
        "differ in delta" in warning and "no complete synchronisation" in warning for warning in network.warnings
    )


# -- nodes of several kinds ------------------------------------------------------------------------------------


def test_nodes_of_two_kinds_move_as_their_own_equations_say() -> None:
    x, v = ([real(f"{c}_{i}") for i in (1, 2, 3)] for c in "xv")
    beta, delta, mu, omega, sigma = (real(name) for name in ("beta", "delta", "mu", "omega", "sigma"))
    network = mixed(record=("sync_error",))
    drive = [real(f"u_{i + 1}") * sp.cos(omega * TIME) for i in range(3)]
    rows = [-x[i] - beta * x[i] ** 3 - delta * v[i] + drive[i] + sigma * (x[1] - x[i]) for i in range(3)]
    rows[1] = -x[1] + mu * (1 - x[1] ** 2) * v[1] + drive[1] + sigma * (x[0] + x[2] - 2 * x[1])
    assert [sp.expand(a - b) for a, b in zip(network.equations.rhs(), [*v, *rows], strict=True)] == [0] * 6
    assert network.parameters["u_1"] == 0.3  # each node has the default of its kind
    assert network.parameters["u_2"] == 0.0
    result = run(network)
    np.testing.assert_allclose(result.states(), by_scipy(network, 20), atol=2e-8)
    assert result.sync_error > 0


def test_scenes_with_groups_are_read_and_written() -> None:
    network = mixed()
    assert Scene.from_dict(network.as_dict()) == network == network.replace(title="")
    assert network.replace(nodes=None).equations == scene(parameters={"sigma": 0.1}).equations
    everywhere = scene(nodes=[{"oscillator": "van_der_pol", "at": [1, 2, 3]}], parameters={"sigma": 0.1})
    assert everywhere.equations == scene(oscillator="van_der_pol", parameters={"sigma": 0.1}).equations


@pytest.mark.parametrize(
    ("nodes", "message"),
    [
        ([{"oscillator": "van_der_pol"}], "nodes 1: 'at' is missing"),
        ([{"oscillator": "van_der_pool", "at": [1]}], "unknown oscillator 'van_der_pool'"),
        ([{"oscillator": "van_der_pol", "at": [4]}], "a whole number from 1 to 3"),
        ([{"oscillator": "van_der_pol", "at": [2, 2]}], "each node once"),
        ([{"oscillator": "van_der_pol", "at": []}], "at least one node"),
        ([{"oscillator": "harmonic", "at": [1]}, {"oscillator": "van_der_pol", "at": [1]}], "in another group too"),
        ([{"oscillator": "lorenz", "at": [2]}], "coupling 'spring' joins coordinates with velocities"),
        ([{"oscillator": "friction", "friction": "exponental", "at": [2]}], "unknown friction 'exponental'"),
        ("van_der_pol", "expected tables"),
    ],
)
def test_groups_that_fit_no_network(nodes: object, message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=re.escape(message)):
        mixed(nodes=nodes)


def test_components_of_one_name_are_joined_and_compared() -> None:
    network = scene(oscillator="lorenz", nodes=[{"oscillator": "van_der_pol", "at": [2]}], coupling="x->x, y->y",
                 parameters={"sigma": 1}, record=("sync_error",))  # fmt: skip
    assert network.equations.state == ("x_1", "x_2", "x_3", "y_1", "y_3", "z_1", "z_3", "v_2")
    assert network.initial["y"] == network.initial["z"] == (0.0, 0.0) or len(network.initial["y"]) == 2
    sigma, x, y = real("sigma"), real("x_1"), real("y_1")
    forces = dict(zip(network.equations.state, network.equations.rhs(), strict=True))
    assert sp.diff(forces["x_1"], real("x_2")) == sigma
    assert not forces["y_1"].has(sigma)  # the neighbour has no y
    assert forces["x_1"].has(x, y)
    with pytest.raises(ValueError, match="coupling 'y->y' joins nothing between nodes of"):
        network.replace(coupling="y->y")
    with pytest.raises(ValueError, match="unknown section variable 'y_2'"):
        network.replace(section="y_2 falling")


def test_a_coupling_between_other_kinds_is_refused() -> None:
    with pytest.raises(ValueError, match="coupling 'hanging' joins clock and beam; found nodes of one kind"):
        Scene(oscillator="clock", coupling="hanging", topology=chain(2))
    with pytest.raises(ValueError, match="no states of one name to compare"):
        load_scene("huygens").replace(record=("sync_error",))


def test_an_energy_of_a_state_that_both_oscillators_have_is_refused() -> None:
    """The state of one end was taken, whatever `between` said."""
    wheel = Lagrangian("v**2/2", "x**2/2", coordinates={"x": "v"}, name="wheel")
    cart = Lagrangian("v**2", "2*x**2", coordinates={"x": "v"}, name="cart")
    rod = link_energy("k*W*x**2/2", between={"wheel": ["x"], "cart": []}, parameters={"k": 1}, name="rod")
    with pytest.raises(ValueError, match=r"coupling 'rod': .* both have a state 'x'; .* rename it in one oscillator"):
        Scene(wheel, rod, chain(2), nodes=[{"oscillator": cart, "at": [2]}])


def test_friction_laws_of_two_kinds() -> None:
    network = Scene(topology=chain(2), nodes=[{"oscillator": "friction", "friction": "coulomb", "at": [2]}])
    formulas = text(network.equations)
    assert "of node 1" in formulas
    assert "of node 2" in formulas
    rows = Scene(topology=chain(2), contact="set-valued", nodes=network.nodes).equations
    assert rows.state == ("x_1", "x_2", "v_1", "v_2", "slip_1", "slip_2")


def test_the_equations_of_ten_thousand_nodes_cost_no_algebra(monkeypatch) -> None:
    """What is derived does not grow with the network: SymPy substitutes no more for ten thousand nodes than for ten."""
    plain, calls = sp.Basic.xreplace, []

    def counted(self, rule):
        calls.append(self)
        return plain(self, rule)

    monkeypatch.setattr(sp.Basic, "xreplace", counted)
    network = scene(topology=chain(10_000), parameters={"delta": np.linspace(0.1, 0.2, 10_000), "sigma": 0.1})
    assert network.equations.dimension == 20_000
    assert len(calls) < 100


def test_the_text_of_a_kernel_does_not_grow_with_the_network() -> None:
    texts = []
    for n in (30, 300):
        network = scene(topology=chain(n), parameters={"sigma": 0.1, "delta": np.linspace(0.1, 0.2, n)})
        texts.append(emit(network.equations, "rodas5p", Recording(()), width=2).text)
    assert abs(len(texts[1]) - len(texts[0])) < 300  # numbers of three digits in place of two


def test_a_star_of_two_kinds_may_be_one_way() -> None:
    graph = from_matrix([[0, 0, 0], [1, -1, 0], [1, 0, -1]])
    network = mixed(topology=graph, nodes=[{"oscillator": "van_der_pol", "at": [1]}])
    assert [ends for ends, _ in network.equations.edge_of] == [(1, 0)]
    assert star(3).n == network.n


# -- oscillators and laws that `nodes` gives alone -------------------------------------------------------------------

STATIC = {"oscillator": "friction", "friction": "coulomb_static", "at": [1, 2]}
BOTH = {"nodes": [STATIC], "topology": chain(2), "contact": "set-valued"}


def test_a_law_that_nodes_give_is_checked_as_that_of_the_scene() -> None:
    wrong = {"parameters": {"mu_s": 0.1, "mu_k": 0.3}}
    refusal = "friction coulomb_static: found mu_s = 0.1 below mu_k = 0.3"
    with pytest.raises(ValueError, match=refusal):
        Scene(friction="coulomb_static", topology=chain(2), contact="set-valued", **wrong)
    with pytest.raises(ValueError, match=refusal):
        Scene(**BOTH, **wrong)
    unused = {"friction": "coulomb_static", "nodes": [{**STATIC, "friction": "coulomb"}]}
    assert "mu_s" not in Scene(**{**BOTH, **unused}).parameters


def test_static_and_sliding_friction_are_compared_node_by_node() -> None:
    Scene(**BOTH, parameters={"mu_s": [0.2, 0.4], "mu_k": [0.1, 0.3]})
    with pytest.raises(ValueError, match=r"found mu_s_1 = 0\.2 below mu_k_1 = 0\.25"):
        Scene(**BOTH, parameters={"mu_s": [0.2, 0.4], "mu_k": [0.25, 0.3]})
    with pytest.raises(ValueError, match=r"found mu_s_2 = 0\.2 below mu_k = 0\.3"):
        Scene(**BOTH, parameters={"mu_s": [0.5, 0.4], "mu_k": 0.3}, axes={"mu_s_2": [0.2, 0.6]})


def test_coordinates_are_those_of_the_nodes() -> None:
    pendulums = [{"oscillator": "double_pendulum", "at": [1, 2]}]
    by_nodes = Scene(nodes=pendulums, topology=chain(2), coupling="spring on phi")
    assert (
        by_nodes.equations == Scene(oscillator="double_pendulum", topology=chain(2), coupling="spring on phi").equations
    )
    with pytest.raises(ValueError, match="unknown coordinate 'x'; known: phi, psi"):
        Scene(nodes=pendulums, topology=chain(2), coupling="spring on x")


def test_the_repr_names_the_laws_of_the_nodes() -> None:
    assert repr(Scene(**BOTH)) == "Scene(friction/coulomb_static/spring, chain(2))"
    one = {**STATIC, "at": [2]}
    assert (
        repr(Scene(nodes=[one], topology=chain(2))) == "Scene(friction/exponential and coulomb_static/spring, chain(2))"
    )


def test_what_is_not_driven_is_named_as_the_nodes_are() -> None:
    with pytest.raises(ValueError, match="found 'period', but 'lorenz' is not driven"):
        Scene(nodes=[{"oscillator": "lorenz", "at": [1]}], time_unit="period")


def test_the_warning_of_a_coupling_that_does_not_vanish_reads_the_oscillator_of_the_nodes() -> None:
    pendulums = [{"oscillator": "double_pendulum", "at": [1, 2]}]
    assert Scene(nodes=pendulums, topology=chain(2), coupling="spring on phi").warnings == ()
