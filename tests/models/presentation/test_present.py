"""Equations as text: as the paper writes them, as LaTeX that balances, and as a dictionary that SymPy reads back."""

from __future__ import annotations

import json
import re
from fractions import Fraction

import pytest
import sympy as sp
from differences import made
from parts import edge, is_lagrangian, node, oscillator_of
from variational_reference import tangent_equations, transversal_equations

from synchain import Rates, Scene
from synchain.graphs import ring, star
from synchain.models.definitions.definition import FRICTION_LAW, OSCILLATOR
from synchain.models.dynamics.equations import Equations
from synchain.models.graphs.families import topology
from synchain.models.graphs.topology import from_matrix
from synchain.models.inputs.plugin_files import names
from synchain.models.mechanics.components import TIME, Edge, Node
from synchain.models.mechanics.contact import ContactModel
from synchain.models.presentation.equations_text import LARGEST, as_dict, latex, text

PAIR = made(topology("chain", 2))
X, Y, Z, A = sp.symbols("x y z a", real=True)


def body(equations: Equations) -> list[str]:
    """The lines of the LaTeX environment."""
    first, *lines, last = latex(equations).splitlines()
    assert (first, last) == (r"\begin{align*}", r"\end{align*}")
    assert all(line.endswith(r" \\") for line in lines[:-1])
    return [line.removeprefix("  & ").removesuffix(r" \\") for line in lines]


# -- the paper -----------------------------------------------------------------------------------------------


def test_two_friction_oscillators_as_in_the_paper() -> None:
    assert text(PAIR).splitlines() == [
        "χ_1'' = -χ_1 + u cos(ω τ) + ε f(ϑ_b - χ_1') + σ (χ_2 - χ_1)",
        "χ_2'' = -χ_2 + u cos(ω τ) + ε f(ϑ_b - χ_2') + σ (χ_1 - χ_2)",
        "f(w) = (2/π)(μ_k + (μ_s - μ_k) exp(-a |w|)) atan(κ w)",
    ]
    assert body(PAIR) == [
        r"\chi_1'' = -\chi_1 + u\cos(\omega\tau) + \varepsilon f(\vartheta_b - \chi_1') + \sigma(\chi_2 - \chi_1)",
        r"\chi_2'' = -\chi_2 + u\cos(\omega\tau) + \varepsilon f(\vartheta_b - \chi_2') + \sigma(\chi_1 - \chi_2)",
        r"f(w) = \frac{2}{\pi}(\mu_k + (\mu_s - \mu_k)\exp(-a|w|))\arctan(\kappa w)",
    ]


def test_one_oscillator_has_no_index() -> None:
    alone = made(topology("chain", 1), contact="sign", coupling=None)
    assert text(alone).splitlines() == [
        "χ'' = -χ + u cos(ω τ) + ε f(ϑ_b - χ')",
        "f(w) = (μ_k + (μ_s - μ_k) exp(-a |w|)) sgn(w)",
    ]
    assert body(alone)[0] == r"\chi'' = -\chi + u\cos(\omega\tau) + \varepsilon f(\vartheta_b - \chi')"


LAW_TEXT = {
    ("coulomb", "atan"): "(2/π) μ atan(κ w)",
    ("coulomb", "sign"): "μ sgn(w)",
    ("exponential", "sign"): "(μ_k + (μ_s - μ_k) exp(-a |w|)) sgn(w)",
    ("stribeck", "atan"): "c w + (2/π)(μ_k + (μ_s - μ_k) exp(-w²/v_s²)) atan(κ w)",
    ("viscous", "sign"): "c w",
    ("viscous", "atan"): "c w",
}


@pytest.mark.parametrize("law", names(FRICTION_LAW))
@pytest.mark.parametrize("contact", ContactModel)
def test_every_law_is_named_once_and_defined_below(law: str, contact: str) -> None:
    lines = text(made(topology("ring", 3), "friction", law, contact)).splitlines()
    assert lines[0] == "χ_1'' = -χ_1 + u cos(ω τ) + ε f(ϑ_b - χ_1') + σ (χ_2 + χ_3 - 2 χ_1)"
    sticks = contact == "set-valued" and law != "viscous"
    assert len(lines) == 4 + sticks
    assert ("zero sliding velocity" in lines[-1]) == sticks
    left, right = lines[3].split(" = ")
    assert (left, right) == ("f(w)", LAW_TEXT.get((law, contact), right))
    assert "χ" not in right


def test_links_of_a_node_are_gathered() -> None:
    lines = text(made(from_matrix([["-5/2", 2, "1/2"], [0, 0, 0], [1, 0, -1]]), coupling="damper")).splitlines()
    assert lines[0].endswith("f(ϑ_b - χ_1') + σ (2 χ_2' + (1/2) χ_3' - (5/2) χ_1')")
    assert "σ" not in lines[1]
    assert lines[2].endswith(" + σ (χ_1' - χ_3')")


def test_a_law_is_named_only_where_the_model_has_one() -> None:
    """The membrane has the term c (sum) and a parameter c, which is also that of viscous friction."""
    nerve = made(topology("chain", 1), "fitzhugh_nagumo", None, coupling=None)
    assert text(nerve).splitlines() == ["x' = c (current + x + y - (1/3) x³)", "y' = (a - x - b y)/c"]
    x, v, mu, kappa = (sp.Symbol(name, real=True) for name in ("x", "v", "mu", "kappa"))
    smooth = Equations.of_equal_nodes(
        Node((x, v), (v, 2 * mu * sp.atan(kappa * (x - v)) / sp.pi), (mu, kappa)), None, 1
    )
    assert text(smooth).splitlines() == ["x'' = (2/π) μ atan(κ (x - x'))"]


# -- other oscillators ---------------------------------------------------------------------------------------


def test_other_oscillators_keep_their_letters() -> None:
    duffing = made(topology("chain", 2), "duffing", None)
    assert text(duffing).splitlines() == [
        "x_1'' = -x_1 - β x_1³ - δ x_1' + u cos(ω t) + σ (x_2 - x_1)",
        "x_2'' = -x_2 - β x_2³ - δ x_2' + u cos(ω t) + σ (x_1 - x_2)",
    ]
    assert body(duffing)[0] == r"x_1'' = -x_1 - \beta x_1^3 - \delta x_1' + u\cos(\omega t) + \sigma(x_2 - x_1)"


def test_a_vector_field_is_written_to_first_order() -> None:
    """Lorenz, J. Atmos. Sci. 20, 130 (1963)."""
    s, r, b = sp.symbols("s rho beta", real=True)
    lorenz = Equations.of_equal_nodes(
        Node((X, Y, Z), (s * (Y - X), X * (r - Z) - Y, X * Y - b * Z), (s, r, b)), None, 1
    )
    assert text(lorenz).splitlines() == ["x' = s (y - x)", "y' = -y + x (ρ - z)", "z' = x y - β z"]


def test_powers_of_a_velocity_are_no_further_primes() -> None:
    x, v = sp.symbols("x v", real=True)
    braked = Equations.of_equal_nodes(Node((x, v), (v, -x - v**2), ()), None, 2)
    assert text(braked).splitlines() == ["x_1'' = -x_1 - (x_1')²", "x_2'' = -x_2 - (x_2')²"]
    assert body(braked)[0] == "x_1'' = -x_1 - (x_1')^2"


def test_a_chain_of_derivatives_is_written_to_first_order() -> None:
    jerk = Equations.of_equal_nodes(Node((X, Y, Z), (Y, Z, -X), ()), None, 1)
    assert text(jerk).splitlines() == ["x' = y", "y' = z", "z' = -x"]


def test_links_into_a_coordinate_are_not_lost() -> None:
    """Coupling in x: x' is no longer v, so both equations are of first order."""
    x, v, x_i, v_i, x_j, v_j, weight, sigma = sp.symbols("x v x_i v_i x_j v_j weight sigma", real=True)
    drift = Edge((x_i, v_i), (x_j, v_j), weight, (sigma * weight * (x_j - x_i), sp.S.Zero), (sigma,))
    made_here = Equations.of_equal_nodes(Node((x, v), (v, -x), ()), drift, 2, PAIR.links)
    assert text(made_here).splitlines()[:2] == ["x_1' = v_1 + σ (x_2 - x_1)", "v_1' = -x_1"]


@pytest.mark.parametrize("clash", ["w", "f"])
def test_a_name_that_the_law_needs_keeps_it_written_in_place(clash: str) -> None:
    single = node("friction", "coulomb", "sign")
    taken = sp.Symbol(clash, real=True)
    clashing = Node(single.state, (single.rhs[0], single.rhs[1] - taken), (*single.parameters, taken))
    assert text(Equations.of_equal_nodes(clashing, None, 1)) == f"x'' = -x + ε μ sgn(ϑ_b - x') - {clash} + u cos(ω t)"


@pytest.mark.parametrize("clash", ["chi", "tau"])
def test_a_parameter_called_chi_or_tau_keeps_x_and_t(clash: str) -> None:
    single = node("friction", "coulomb", "sign")
    taken = sp.Symbol(clash, real=True)
    clashing = Node(single.state, (single.rhs[0], single.rhs[1] - taken), (*single.parameters, taken))
    shown = text(Equations.of_equal_nodes(clashing, None, 1))
    assert shown.startswith("x'' = ")
    assert "cos(ω t)" in shown


def test_tangent_equations_are_written_too() -> None:
    lines = text(transversal_equations(PAIR)).splitlines()
    assert lines[0] == "χ'' = -χ + u cos(ω τ) + ε f(ϑ_b - χ')"
    assert lines[1].startswith("d_x'' = -d_x (1 + α) + d_x' (")
    assert len(lines) == 3
    assert len(body(tangent_equations(node("friction", "exponential", "atan")))) == 3


# -- pieces --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("expression", "plain", "tex"),
    [
        (sp.S.Zero, "0", "0"),
        (-X / 2, "-(1/2) x", r"-\frac{1}{2}x"),
        (sp.Rational(-3, 4), "-3/4", r"-\frac{3}{4}"),
        (A / X, "a/x", r"\frac{a}{x}"),
        ((1 + A) / (X * (1 + X)), "(1 + a)/(x (1 + x))", r"\frac{1 + a}{x(1 + x)}"),
        (A / (1 + X), "a/(1 + x)", r"\frac{a}{1 + x}"),
        (sp.sqrt(1 + X**2), "sqrt(1 + x²)", r"\sqrt{1 + x^2}"),
        (X ** sp.Rational(3, 2), "x^(3/2)", r"x^{\frac{3}{2}}"),
        (X**A, "x^(a)", "x^a"),
        (sp.sin(X) ** 12, "sin(x)¹²", r"\sin(x)^{12}"),
        ((X - A) ** 2 * A, "a (x - a)²", "a(x - a)^2"),
        (-(X - A) * A, "a (a - x)", "a(a - x)"),
        (sp.sin(A * X**2 - 1), "sin(a x² - 1)", r"\sin(ax^2 - 1)"),
        (3 * sp.pi * X / 7, "(3 π/7) x", r"\frac{3\pi}{7}x"),
        (sp.Max(X, 0), "Max(0, x)", r"\max(0, x)"),
        (sp.Symbol("mass_left", real=True) * X, "mass_left x", r"\mathrm{mass}_{\mathrm{left}}x"),
        (2 * 3**A, "2 3^(a)", r"2\cdot 3^a"),
    ],
)
def test_expressions(expression: sp.Expr, plain: str, tex: str) -> None:
    parameters = tuple(sorted(expression.free_symbols - {X}, key=str))
    equations = Equations.of_equal_nodes(Node((X,), (expression,), parameters), None, 1)
    assert text(equations) == f"x' = {plain}"
    assert body(equations) == [f"x' = {tex}"]


def test_what_has_no_rule_is_left_to_sympy() -> None:
    piece = sp.Piecewise((X, X > 0), (0, True))
    equations = Equations.of_equal_nodes(Node((X,), (piece,), ()), None, 1)
    assert text(equations) == "x' = Piecewise((x, x > 0), (0, True))"
    assert r"\begin{cases} x" in latex(equations)


# -- many nodes ----------------------------------------------------------------------------------------------


def test_a_large_network_is_written_for_node_i() -> None:
    many = made(topology("star", 40))
    assert text(many).splitlines() == [
        "χ_i'' = -χ_i + u cos(ω τ) + ε f(ϑ_b - χ_i') + σ Σ_j G_ij (χ_j - χ_i)",
        "f(w) = (2/π)(μ_k + (μ_s - μ_k) exp(-a |w|)) atan(κ w)",
        "i, j = 1, …, 40, G_ij the weights of the 78 links",
    ]
    lines = body(many)
    assert lines[0].endswith(r"f(\vartheta_b - \chi_i') + \sigma\sum_j G_{ij}(\chi_j - \chi_i)")
    assert lines[2] == r"i, j = 1, \dots, 40, G_{ij}\text{ the weights of the 78 links}"


@pytest.mark.parametrize("n", [LARGEST, LARGEST + 1])
def test_the_largest_network_that_is_written_out(n: int) -> None:
    lines = text(made(topology("chain", n), "harmonic", None)).splitlines()
    assert len(lines) == (n if n == LARGEST else 2)
    assert lines[0] == ("x_1'' = -x_1 + σ (x_2 - x_1)" if n == LARGEST else "x_i'' = -x_i + σ Σ_j G_ij (x_j - x_i)")


def test_many_nodes_without_links() -> None:
    assert text(Equations.of_equal_nodes(node("harmonic", None, "atan"), None, 9)).splitlines() == [
        "x_i'' = -x_i",
        "i = 1, …, 9",
    ]


def test_a_force_turned_round_keeps_its_sign() -> None:
    single = node("harmonic", None, "atan")
    spring = edge("spring", single, "harmonic")
    push = Edge(spring.here, spring.there, spring.weight, (sp.S.Zero, -spring.weight * sp.sin(spring.there[0])), ())
    lines = text(Equations.of_equal_nodes(single, push, 7, ((0, 1, Fraction(1)),))).splitlines()
    assert lines[0] == "x_i'' = -x_i - Σ_j G_ij sin(x_j)"


# -- everything shipped --------------------------------------------------------------------------------------


@pytest.mark.parametrize("oscillator", names(OSCILLATOR))
@pytest.mark.parametrize("n", [1, 3, 8])
def test_latex_of_every_oscillator_balances(oscillator: str, n: int) -> None:
    law = "stribeck" if oscillator_of(oscillator).takes_friction else None
    coupling = "spring"
    if not is_lagrangian(oscillator):
        states = [s.name for s in node(oscillator).state]
        coupling = f"{states[0]}->{states[0]}, -1/2 {states[-1]}->{states[0]}"
    lines = body(made(topology("chain", n), oscillator, law, coupling=coupling if n > 1 else None))
    for line in lines:
        for left, right in ("()", "{}"):
            assert line.count(left) == line.count(right)
        assert line.count("|") % 2 == 0
        assert not re.search(r"\*|__|\\[A-Za-z]+_\{\}|\bnan\b", line)
        assert "=" in line


def test_vector_fields_and_links_between_components() -> None:
    """The right-hand sides as they stand in the papers; a link from two components in one pair of parentheses."""
    assert text(made(topology("chain", 2), "rossler", None, coupling="x->x, -1/2 z->y")).splitlines()[:2] == [
        "x_1' = -y_1 - z_1 + σ (x_2 - x_1)",
        "y_1' = x_1 + a y_1 - (1/2) σ (z_2 - z_1)",
    ]
    assert text(made(topology("chain", 1), "lorenz", None, coupling=None)).splitlines() == [
        "x' = prandtl (y - x)",
        "y' = -y + x (rayleigh - z)",
        "z' = x y - b z",
    ]
    many = text(made(topology("ring", 9), "rossler", None, coupling="x->x, 1/2 y->x, -1/2 z->y")).splitlines()
    assert many[:2] == [
        "x_i' = -y_i - z_i + σ Σ_j G_ij (x_j + (1/2) y_j - x_i - (1/2) y_i)",
        "y_i' = x_i + a y_i - (1/2) σ Σ_j G_ij (z_j - z_i)",
    ]


# -- for programs --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("contact", ContactModel)
def test_the_dictionary_is_read_back_exactly(contact: str) -> None:
    equations = made(topology("ring", 3), contact=contact)
    shown = json.loads(json.dumps(as_dict(equations)))
    assert list(shown) == ["state", "parameters", "rhs", "jacobian", "time_derivative", "digest"]
    symbols = {name: sp.Symbol(name, real=True) for name in (*shown["state"], *shown["parameters"])} | {"t": TIME}

    def read(line: str) -> sp.Expr:
        return sp.parse_expr(line, local_dict=symbols)

    modes = ["slip_1", "slip_2", "slip_3"] if contact == "set-valued" else []
    assert shown["state"] == ["x_1", "x_2", "x_3", "v_1", "v_2", "v_3", *modes]
    assert tuple(map(read, shown["rhs"])) == equations.rhs()
    assert tuple(map(read, shown["time_derivative"])) == equations.time_derivative()
    order = {name: i for i, name in enumerate(shown["state"])}
    entries = {tuple(order[name] for name in key.split(",")): read(line) for key, line in shown["jacobian"].items()}
    assert entries == equations.jacobian()
    assert shown["digest"] == equations.digest


def test_the_keys_of_the_jacobian() -> None:
    keys = as_dict(made(topology("chain", 2), "harmonic", None))["jacobian"]
    assert keys == {
        "x_1,v_1": "1",
        "x_2,v_2": "1",
        "v_1,x_1": "-sigma - 1",
        "v_1,x_2": "sigma",
        "v_2,x_1": "sigma",
        "v_2,x_2": "-sigma - 1",
    }


def test_layers_of_links_have_weights_of_their_own_and_masses_of_the_source_its_index() -> None:
    x_i, x_j = sp.symbols("x_i x_j")
    k, w = sp.Symbol("k"), sp.Symbol("weight", real=True)
    pull = Rates({x_i: k * w * (x_j - x_i)}, {k: 1})
    lines = text(Scene(oscillator="rossler", links=[(pull, ring(9)), ("y->y", star(9))]).equations).splitlines()
    assert "k Σ_j G_1_ij (x_j - x_i)" in lines[0]
    assert "σ Σ_j G_2_ij (y_j - y_i)" in lines[1]
    assert lines[-1] == "i, j = 1, …, 9, G_1_ij the weights of the 18 links, G_2_ij the weights of the 16 links"
    push = Rates({sp.Symbol("v_i"): w * sp.Symbol("beta_j") * x_j})
    beta = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]
    equations = Scene(oscillator="duffing", coupling=push, topology=ring(7), parameters={"beta": beta}).equations
    assert "Σ_j G_ij β_j x_j" in text(equations)
