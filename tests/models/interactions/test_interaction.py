"""Links of any rates and potentials as values: what is kept, what is refused, and what they become in equations."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import Any

import pytest
import sympy as sp
from catalogue import BODY, ROTOR, real

from synchain import Parameter, Potential, Rates, Scene, ends
from synchain.graphs import chain, complete, ring, star
from synchain.models.definitions.loader import load_oscillator
from synchain.models.interactions.coupling import from_table
from synchain.models.interactions.link import edge, strength
from synchain.models.mechanics.components import TIME

K, LAG, G = sp.symbols("K lag G")
V = real("v")

TARGET, SOURCE, W = ends(ROTOR)
KURAMOTO = Rates({TARGET.theta: K * W * sp.sin(SOURCE.theta - TARGET.theta - LAG)}, {K: 0, LAG: 0.1})

A, B, _ = ends(BODY)
GRAVITY = Potential(-G * W * A.m * B.m / sp.sqrt((A.x - B.x) ** 2 + (A.y - B.y) ** 2), {G: 1})


# -- values ---------------------------------------------------------------------------------------------------


def test_ends_are_symbols_of_states_and_parameters() -> None:
    assert (TARGET.theta, SOURCE.p, W.name) == (real("theta_i"), real("p_j"), "weight")
    assert dir(A) == sorted(["x", "y", "u", "v", "m"])
    with pytest.raises(
        AttributeError, match=r"end i of a link: unknown 'thet'; known: theta, p; did you mean 'theta'\?"
    ):
        _ = TARGET.thet


def test_equal_contents_make_equal_couplings() -> None:
    k, lag = sp.symbols("K lag", real=True)
    again = Rates(
        {TARGET.theta: -W * k * sp.sin(TARGET.theta + lag - SOURCE.theta)}, {"lag": sp.Rational(1, 10), "K": 0}
    )
    assert again == KURAMOTO
    assert hash(again) == hash(KURAMOTO)
    assert pickle.loads(pickle.dumps(KURAMOTO)) == KURAMOTO
    assert pickle.loads(pickle.dumps(GRAVITY)) == GRAVITY
    assert Rates({TARGET.theta: K * W * sp.sin(SOURCE.theta - TARGET.theta)}, {K: 0}) != KURAMOTO


def test_links_are_said_by_expressions_or_by_text() -> None:
    assert Rates({"theta": "K*W*sin(theta_j - theta_i - lag)"}, {"K": 0, "lag": 0.1}) == KURAMOTO
    assert Potential("-G*W*m_i*m_j/sqrt((x_i - x_j)**2 + (y_i - y_j)**2)", {"G": 1}) == GRAVITY


def test_decimals_are_exact() -> None:
    (rate,) = Rates({TARGET.theta: 0.1 * W * (SOURCE.theta - 0.3 * TARGET.theta)}).rates.values()
    assert not rate.atoms(sp.Float)
    assert sp.expand(rate) == sp.expand(sp.Rational(1, 10) * W * (SOURCE.theta - sp.Rational(3, 10) * TARGET.theta))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Rates({}), "found none; expected one at least"),
        (lambda: Rates({1: W}), r"found the key 1 \(int\); expected a state of the target, e.g. i.x"),
        (lambda: Rates({"theta": W, TARGET.theta: W}), "the rate of 'theta' is given twice; expected it once"),
        (lambda: Rates({"theta": "W*(theta_j -"}), "unreadable expression"),
        (lambda: Rates({"theta": "W*(theta_j - theta)"}), "undeclared symbol 'theta'"),
        (lambda: Rates({SOURCE.theta: W}), "found the rate of 'theta_j'; expected a state of the target"),
        (lambda: Rates({TARGET.theta: sp.S.Zero * W}), "the rate of 'theta' is 0; expected a function"),
        (lambda: Rates({TARGET.theta: W, TARGET.p: sp.S.Zero}), "the rate of 'p' is 0"),
        (lambda: Rates({"V": "g*W*(V_j - V_i)/C"}, {"g": 1}), "give it a default, or write C_i for what the node has"),
        (lambda: Rates({TARGET.theta: K * W}), "undeclared symbol 'K'; expected .* give it a default"),
        (lambda: Rates({TARGET.theta: W}, {K: 1}), "nothing uses the parameter 'K'"),
        (
            lambda: Rates({TARGET.theta: K * SOURCE.theta}, {K: 1}),
            "nothing uses the weight of a link; expected it as a factor",
        ),
        (lambda: Rates({TARGET.theta: W * sp.Function("f")(SOURCE.theta)}), "found the function f"),
        (lambda: Rates({TARGET.theta: W / (SOURCE.theta - SOURCE.theta)}), "found the piece zoo"),
        (lambda: Rates({TARGET.theta: W * sp.I}), "found the piece I"),
        (lambda: Rates({TARGET.theta: K * W}, {K: "a"}), "parameter K: unreadable number|parameter K"),
        (
            lambda: Rates({TARGET.theta: W * sp.Symbol("pi")}, {"pi": 1}),
            "the symbol 'pi' has the name of a constant or a function",
        ),
        (lambda: Rates({TARGET.theta: W * TIME}, {"t": 1}), "the parameter 't' has the name of the time"),
        (lambda: Rates({TARGET.theta: W * sp.Symbol("lambda")}, {"lambda": 1}), "'lambda', a word of Python"),
        (lambda: Potential(W * TARGET.theta**2), "of one end; expected a function of both"),
    ],
)
def test_wrong_definitions_are_refused_in_one_line(make: Callable[[], Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message) as caught:
        make()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("coupling", "oscillator", "message"),
    [
        (KURAMOTO, "duffing", "unknown state 'theta'.*known: x, v"),
        (Rates({real("x_i"): W * real("q_j")}), "duffing", "unknown 'q' at the source of a link; known: x, v, "),
        (
            GRAVITY,
            "rossler",
            "potential of m, x, y' needs coordinates with velocities; found a node of .*; expected Rates",
        ),
        (Potential(W * real("v_i") * real("v_j")), "duffing", "found the velocity 'v_i' in the energy"),
    ],
)
def test_nodes_that_do_not_fit_are_refused_by_the_scene(coupling: Any, oscillator: str, message: str) -> None:
    with pytest.raises(ValueError, match=message) as caught:
        Scene(oscillator=oscillator, coupling=coupling, topology=ring(3))
    assert "\n" not in str(caught.value)


# -- tables of scene files -----------------------------------------------------------------------------------


RANGED = Rates({TARGET.theta: K * W}, {K: Parameter(0.5, "N", "push", minimum=0, positive=True)})


@pytest.mark.parametrize("coupling", [KURAMOTO, GRAVITY, RANGED])
def test_a_table_is_the_same_coupling(coupling: Rates | Potential) -> None:
    assert from_table("coupling", coupling.as_dict()) == coupling


@pytest.mark.parametrize(
    "e",
    ["sqrt(x_i)/10 - exp(-x_j**2)*W", "W*atan2(x_i, x_j) + max(x_i, x_j, 0) - min(x_i, 2)", "W*abs(x_i)**(1/3)*pi",
     "W*tanh(x_i/3)**2 + floor(x_i)", "W*x_j if x_i > x_j else 0"],
)  # fmt: skip
def test_text_and_expression_are_one(e: str) -> None:
    coupling = from_table("coupling", {"rates": {"x": e}})
    assert isinstance(coupling, Rates)
    assert Rates({real("x_i"): coupling.rates["x"]}) == coupling == from_table("coupling", coupling.as_dict())


@pytest.mark.parametrize(
    "text",
    ["9**9**9", "(9**999)**999", "exp(exp(exp(9)))", "floor(exp(exp(99)))", "__import__('os')", "x.y", "x if y else z", "[x]",
     "sin()", "sin(x, y)", "lambda: 1", "1/0", "sqrt(-1)", "x" * 25000, "-" * 150 + "x", "sin", "x**1001"],
)  # fmt: skip
def test_hostile_texts_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"\Arates of a link: rate of x: "):
        from_table("coupling", {"rates": {"x": text}})


def test_brackets_are_no_operations() -> None:
    text = "W*" + "(" * 99 + "x_j" + ")" * 99
    assert from_table("coupling", {"rates": {"x": text}}) == from_table("coupling", {"rates": {"x": "W*x_j"}})


def test_a_scene_with_a_table_goes_to_a_dictionary_and_back() -> None:
    settings = {
        "oscillator": "rossler",
        "links": [
            {"coupling": {"rates": {"x": "K*W*tanh(x_j - x_i - lag)"}, "parameters": {"K": 0.1, "lag": 0}},
             "topology": {"name": "ring", "n": 4}},
            {"coupling": "y->y", "topology": {"name": "star", "n": 4}},
        ],
    }  # fmt: skip
    scene = Scene.from_dict(settings)
    again = Scene.from_dict(scene.as_dict())
    assert again == scene
    assert again.equations.digest == scene.equations.digest
    assert scene.replace(K=0.3).parameters["K"] == 0.3
    assert [len(layer.links) for layer in scene.equations.layers] == [8, 6]


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"rates": {"x": "W*x_j"}, "potential": "W"}, "expected either 'rates' or 'potential'"),
        ({"parameters": {}}, "expected either 'rates' or 'potential'"),
        ({"rates": {"x": "W*x_j"}, "strength": 1}, "found 'rates', 'strength'; expected either"),
        ({"rates": {"x": 1}}, "nothing uses the weight of a link"),
        (
            {"rates": {"x": "K*W"}, "parameters": {"K": {"value": 1}}},
            "parameter K: unknown key 'value'; known: default",
        ),
        ({"rates": {"x": "K*W"}, "parameters": {"K": {"unit": "N"}}}, "parameter K: 'default' is missing"),
        ({"rates": {"x": "K*W"}, "parameters": {"K": {"default": 1, "unit": 3}}}, "parameter K: unit: found 3"),
    ],
)
def test_wrong_tables_are_refused(table: dict[str, Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        Scene(oscillator="rossler", coupling=table, topology=ring(3))  # type: ignore[arg-type]


# -- layers ---------------------------------------------------------------------------------------------------


def test_one_layer_is_a_coupling_and_a_graph() -> None:
    assert Scene(oscillator="rossler", links=[("x->x", ring(3))]) == Scene(
        oscillator="rossler", coupling="x->x", topology=ring(3)
    )


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"links": [("x->x", ring(3)), ("y->y", ring(4))]}, "found graphs of 3, 4 nodes; expected one number of nodes"),
        (
            {"links": [("x->x", ring(3)), ("y->y", ring(3))]},
            "its parameter 'sigma' has the name of one of another part",
        ),
        ({"links": []}, "found no layer"),
        ({"links": "x->x"}, "expected pairs"),
        ({"links": ["x->x"]}, "links 1: found 'x->x'; expected a pair"),
        ({"links": [("x->x", ring(3))], "topology": ring(3)}, "found a topology beside it"),
        ({"links": [("x->x", ring(3))], "coupling": "y->y"}, "found a coupling beside it"),
    ],
)
def test_wrong_layers_are_refused(keywords: dict[str, Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        Scene(oscillator="rossler", **keywords)


def test_what_several_layers_have_not_is_said() -> None:
    x_i, x_j = sp.symbols("x_i x_j")
    other = Rates({x_i: K * W * (x_j - x_i)}, {K: 0})
    scene = Scene(oscillator="rossler", links=[("x->x", ring(4)), (other, star(4))])
    for wrong in (lambda: scene.spectrum, lambda: scene.strength, lambda: scene.equations.edge):
        with pytest.raises(ValueError, match="found 2 layers of links; expected one"):
            wrong()


# -- equations ------------------------------------------------------------------------------------------------


def test_a_first_order_network() -> None:
    equations = Scene(oscillator=ROTOR, coupling=KURAMOTO, topology=chain(2), parameters={"p": [0.1, 0.2]}).equations
    p, k, lag = (real(name) for name in ("p_1", "K", "lag"))
    gap = real("theta_2") - real("theta_1")
    assert sp.simplify(equations.rhs()[0] - (p + k * sp.sin(gap - lag))) == 0


def test_masses_of_both_ends() -> None:
    apart = Scene(oscillator=BODY, coupling=GRAVITY, topology=complete(2), parameters={"m": [1.0, 2.0]}).equations
    alike = Scene(oscillator=BODY, coupling=GRAVITY, topology=complete(2)).equations
    x_1, x_2, y_1, y_2, g = (real(name) for name in ("x_1", "x_2", "y_1", "y_2", "G"))
    cube = ((x_1 - x_2) ** 2 + (y_1 - y_2) ** 2) ** sp.Rational(3, 2)
    for equations, mass in ((apart, real("m_2")), (alike, real("m"))):
        assert sp.simplify(equations.rhs()[4] - g * mass * (x_2 - x_1) / cube) == 0
    momentum = [real(f"m_{i + 1}") * apart.rhs()[4 + i] for i in range(2)]
    assert sp.simplify(sum(momentum)) == 0


def test_a_potential_of_one_coordinate_is_a_spring() -> None:
    i, j, w = ends(load_oscillator("duffing"))
    sigma = sp.Symbol("sigma")
    potential = Potential(sigma * w * (i.x - j.x) ** 2 / 2, {sigma: 0})
    written, spring = (
        Scene(oscillator="duffing", coupling=c, topology=ring(4)).equations for c in (potential, "spring")
    )
    assert written.digest == spring.digest


def test_a_potential_that_tells_its_ends_apart_has_a_direction() -> None:
    i, j, w = ends(load_oscillator("mass"))
    r, sigma, alpha, beta = j.x - i.x, *sp.symbols("sigma fput_alpha fput_beta")
    energy = sigma * w * (r**2 / 2 + alpha * r**3 / 3 + beta * r**4 / 4)
    potential = Potential(energy, {sigma: 1, alpha: 0.25, beta: 0})
    written, fput = (Scene(oscillator="mass", coupling=c, topology=chain(4)).equations for c in (potential, "fput"))
    for a, b in zip(written.rhs(), fput.rhs(), strict=True):
        assert sp.expand(a - b) == 0


def test_the_strength_is_the_only_factor_of_the_whole_link() -> None:
    node = Scene(oscillator=ROTOR).equations.node
    symbol = strength(edge(KURAMOTO, node, ROTOR), node.parameters)
    assert symbol == real("K")
    b = sp.Symbol("b")
    several = Rates({TARGET.theta: K * b * W * (SOURCE.theta - TARGET.theta)}, {K: 1, b: 1})
    with pytest.raises(ValueError, match="found the factors K, b; expected sigma, or exactly one parameter"):
        strength(edge(several, node, ROTOR), node.parameters)
    none = Rates({TARGET.theta: W * sp.sin(K * (SOURCE.theta - TARGET.theta))}, {K: 1})
    with pytest.raises(ValueError, match="found K; expected sigma, or exactly one parameter"):
        strength(edge(none, node, ROTOR), node.parameters)
