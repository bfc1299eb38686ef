"""Models without a file: the same values as plug-in files make, exact, and wrong ones refused in one line."""

from __future__ import annotations

import copy
import json
import pickle
import re
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from sympy.physics.mechanics import dynamicsymbols

from synchain import Field, Lagrangian, Parameter, friction, friction_law
from synchain.codegen.program.functions import FUNCTIONS as PRINTED
from synchain.models.definitions.loader import load_friction_law, load_oscillator
from synchain.models.definitions.table import as_name_or_table, law_of_table, oscillator_of_table
from synchain.models.inputs.expression_text import FUNCTIONS
from synchain.models.mechanics.components import TIME
from synchain.models.mechanics.expression import exact, read, written
from synchain.models.mechanics.oscillator import Oscillator

t = dynamicsymbols._t
x, phi, psi = dynamicsymbols("x phi psi")
X, V, Y, Z, W = sp.symbols("x v y z w")
mu, k, m, u, omega, delta, beta = sp.symbols("mu k m u omega delta beta")
v = x.diff(t)


def duffing() -> Oscillator:
    return Lagrangian(
        v**2 / 2,
        x**2 / 2 + beta * x**4 / 4 - u * x * sp.cos(omega * t),
        {x: -delta * v},
        parameters=dict(load_oscillator("duffing").parameters),
        name="duffing",
    )


def double_pendulum() -> Oscillator:
    ratio, rod = sp.symbols("mass_ratio length_ratio")
    lower = phi.diff(t) ** 2 + rod**2 * psi.diff(t) ** 2 + 2 * rod * phi.diff(t) * psi.diff(t) * sp.cos(phi - psi)
    return Lagrangian(
        phi.diff(t) ** 2 / 2 + ratio * lower / 2,
        -(1 + ratio) * sp.cos(phi) - ratio * rod * sp.cos(psi),
        R=delta * (phi.diff(t) ** 2 + (psi.diff(t) - phi.diff(t)) ** 2) / 2,
        coordinates={phi: "w_phi", psi: "w_psi"},
        parameters=dict(load_oscillator("double_pendulum").parameters),
        name="double_pendulum",
    )


def lorenz() -> Oscillator:
    prandtl, rayleigh, b = sp.symbols("prandtl rayleigh b")
    return Field(
        {X: prandtl * (Y - X), Y: X * (rayleigh - Z) - Y, Z: X * Y - b * Z},
        parameters=dict(load_oscillator("lorenz").parameters),
        initial={X: 1, Y: 1, Z: 20},
        name="lorenz",
    )


@pytest.mark.parametrize("make", [duffing, double_pendulum, lorenz])
def test_an_inline_model_is_the_value_of_the_plug_in_file(make: Callable[[], Oscillator]) -> None:
    node = make()
    assert node == load_oscillator(node.name)
    assert as_name_or_table(node) == node.name
    assert replace(node, name="mine") == oscillator_of_table(as_name_or_table(replace(node, name="mine")))


def test_plain_symbols_functions_of_time_and_text_are_the_same_model() -> None:
    plain = Lagrangian(
        V**2 / 2,
        X**2 / 2 + beta * X**4 / 4 - u * X * sp.cos(omega * sp.Symbol("t")),
        {X: -delta * V},
        coordinates={X: V},
        parameters=dict(load_oscillator("duffing").parameters),
        name="duffing",
    )
    text = Lagrangian(
        "v**2/2",
        "x**2/2 + beta*x**4/4 - u*x*cos(omega*t)",
        {"x": "-delta*v"},
        coordinates=["x"],
        parameters=dict(load_oscillator("duffing").parameters),
        name="duffing",
    )
    assert plain == text == duffing()


def test_coordinates_and_velocities_have_names() -> None:
    one = Lagrangian(phi.diff(t) ** 2 / 2, 1 - sp.cos(phi))
    assert one.states == ("phi", "v")
    two = Lagrangian(phi.diff(t) ** 2 / 2 + v**2 / 2)
    assert two.states == ("phi", "x", "v_phi", "v_x")
    assert Lagrangian(phi.diff(t) ** 2 / 2 + v**2 / 2, coordinates=(x, phi)).states == ("x", "phi", "v_x", "v_phi")
    assert two.v_x == sp.Symbol("v_x", real=True)
    assert {"phi", "v_x", "model"} <= set(dir(two))
    with pytest.raises(AttributeError, match="no attribute 'theta'"):
        _ = two.theta
    assert pickle.loads(pickle.dumps(two)) == copy.deepcopy(two) == two


def test_decimals_are_what_they_say() -> None:
    node = Lagrangian(v**2 / 2, 0.1 * x**2 + 1e-3 * x**4 + Fraction(1, 3) * x)
    q = node.x
    assert node.model.potential == q**2 / 10 + q**4 / 1000 + q / 3
    assert Field({X: "-0.25*x**0.5"}).model.rates == (-sp.sqrt(sp.Symbol("x", real=True)) / 4,)
    assert Field({X: X / 3.0}).model.rates[0].as_coeff_Mul()[0] == sp.Rational("0.3333333333333333")
    long = sp.Float("0.12345678901234567890123", 25)
    assert Field({X: long * X}).model.rates[0].as_coeff_Mul()[0] == sp.Rational("0.12345678901234567890123")


@pytest.mark.parametrize(
    "rate",
    ["tan(pi/2 - x)", sp.tan(sp.pi / 2 - X), sp.cot(X), sp.sec(X), sp.csc(X), sp.coth(X), sp.sech(X), sp.csch(X)],
)
def test_functions_that_sympy_makes_of_others_are_known(rate: sp.Expr | str) -> None:
    (derived,) = Field({X: rate}).model.rates
    assert Field({X: written(derived)}).model.rates == (derived,)
    expected = sp.sympify(rate).subs(sp.Symbol("x"), 0.7)
    assert float(derived.subs(sp.Symbol("x", real=True), 0.7)) == pytest.approx(float(expected), rel=1e-14)


@pytest.mark.parametrize("at_zero", [0, sp.Rational(1, 2), 1])
def test_steps_of_heaviside_keep_their_value_at_zero(at_zero: sp.Expr) -> None:
    x = sp.Symbol("x", real=True)
    (rate,) = Field({x: sp.Heaviside(x, at_zero)}).model.rates
    assert [rate.subs(x, position) for position in (-2, 0, 3)] == [0, at_zero, 1]


def test_defaults_are_numbers_with_ranges_of_assumptions() -> None:
    mass, load = sp.Symbol("m", positive=True), sp.Symbol("load", nonnegative=True)
    node = Lagrangian(mass * v**2 / 2, {"x": 1} and load * x, parameters={mass: 2, load: sp.Rational(1, 2)})
    assert node.parameters["m"] == Parameter(2.0, positive=True)
    assert node.parameters["load"] == Parameter(0.5, minimum=0.0)
    with pytest.raises(ValueError, match=r"oscillator 'oscillator': m: default = 0.* is not allowed; .* above 0"):
        Lagrangian(mass * v**2 / 2, parameters={mass: 0})


def test_friction_by_name_value_and_expression() -> None:
    N, belt, mu_s, mu_k, a = sp.symbols("N belt mu_s mu_k a")
    force = {x: N * friction(belt - v)}
    values = {N: 2, belt: 0.1}
    named = Lagrangian(v**2 / 2, x**2 / 2, force, friction="exponential", parameters=values)
    assert named.friction == load_friction_law("exponential")
    law = (mu_k + (mu_s - mu_k) * sp.exp(-a * sp.Abs(W))) * sp.sign(W)
    written = Lagrangian(v**2 / 2, x**2 / 2, force, friction=law, parameters={**values, mu_s: 0.3, mu_k: 0.15, a: 2.5})
    assert written.friction is not None
    assert written.friction.force == load_friction_law("exponential").force
    assert set(written.friction.parameters) == {"mu_s", "mu_k", "a"}
    assert set(written.parameters) == {"N", "belt"}
    oscillator = Lagrangian(
        v**2 / 2, x**2 / 2, force, friction=written.friction, contact="set-valued", parameters=values
    )
    assert oscillator.contact == "set-valued"
    assert replace(oscillator, contact=written.contact) == written
    sticky = friction_law("mu_k*sign(w)", {"mu_k": 0.2, "mu_s": 0.3}, static="mu_s", order=[("mu_k", "mu_s")])
    plug_in = load_friction_law("coulomb_static")
    assert (sticky.force, sticky.static, sticky.order) == (plug_in.force, plug_in.static, plug_in.order)
    assert law_of_table(json.loads(json.dumps(as_name_or_table(sticky)))) == sticky


# -- what is refused ---------------------------------------------------------------------------------------------

N, VB = sp.symbols("N vb")
RUB = {x: friction(1 - v)}

WRONG: dict[str, tuple[Callable[[], object], str]] = {
    "undeclared": (lambda: Lagrangian(v**2 / 2, k * x**2), "V: undeclared symbol 'k'; declared: x, v, t"),
    "undeclared in text": (lambda: Field({"x": "-k*x"}), "rate of x: undeclared symbol 'k'; declared: x, t"),
    "unused": (lambda: Lagrangian(v**2, parameters={k: 1}), "no expression has the parameter 'k'"),
    "unused beside a law": (
        lambda: Lagrangian(v**2, 0, RUB, friction="coulomb", parameters={mu: 1}),
        "no expression has the parameter 'mu'",
    ),
    "in law and force": (
        lambda: Lagrangian(v**2, mu * x, RUB, friction=mu * sp.sign(W), parameters={mu: 1}),
        "'mu' is in the friction law and outside of it",
    ),
    "no kinetic energy": (lambda: Lagrangian(v**2 / 2, phi**2), "no kinetic energy in the velocity v_phi"),
    "singular": (lambda: Lagrangian((v + phi.diff(t)) ** 2), "the mass matrix of v_phi, v_x is singular"),
    "nan": (lambda: Lagrangian(v**2 / 2, float("nan") * x), "V: found nan; expected rational numbers"),
    "infinite": (lambda: Lagrangian(v**2 / 2, sp.oo * x), "V: found oo"),
    "complex": (lambda: Lagrangian(v**2 / 2, sp.I * x), "V: found the piece I"),
    "root of a negative": (lambda: Field({X: sp.sqrt(-(X**2) - 1) * sp.sqrt(-2)}), "rate of x: found the piece I"),
    "function": (lambda: Lagrangian(v**2 / 2, sp.gamma(x)), "V: found the function gamma(x); known: abs, acos"),
    "constant": (lambda: Field({X: sp.Catalan * X}), "rate of x: found the piece Catalan"),
    "logical": (lambda: Field({X: sp.Gt(X, 0)}), "rate of x: found x > 0 (StrictGreaterThan); expected an expression"),
    "boolean": (lambda: Field({X: True}), "rate of x: found True (bool); expected an expression"),
    "force on": (lambda: Lagrangian(v**2 / 2, Q={phi: 1}, coordinates=[x]), "undeclared function phi(t); declared: x"),
    "force alone": (lambda: Lagrangian(v**2 / 2, Q={phi: 1}), "no kinetic energy in the velocity v_phi"),
    "force on a name": (lambda: Lagrangian(v**2 / 2, Q={"y": 1}), "Q has the key 'y'; expected x"),
    "force on velocity": (lambda: Lagrangian(v**2 / 2, Q={v: 1}), "Q has the key Derivative(x(t), t); expected x"),
    "forces": (lambda: Lagrangian(v**2 / 2, Q=1), "Q: found 1 (int); expected a table"),
    "acceleration": (lambda: Lagrangian(v**2 / 2, v.diff(t)), "V: found Derivative(x(t), (t, 2)); expected x(t)"),
    "rate in a field": (lambda: Field({x: v}), "rate of x: found Derivative(x(t), t); expected x(t)"),
    "function of two": (
        lambda: Field({X: sp.Function("h")(X, t)}),
        "found the function h(x, t); expected functions of t",
    ),
    "symbol and function": (lambda: Lagrangian(v**2 / 2, X**2), "V: found the symbol x beside functions of time"),
    "velocity as symbol": (lambda: Lagrangian(v**2 / 2, V * x), "V: found the symbol v beside functions of time"),
    "two meanings": (lambda: Lagrangian(v**2 / 2, V * x, parameters={V: 1}), "the name 'v' stands for two things"),
    "state and parameter": (lambda: Field({X: X}, parameters={"x": 1}), "the name 'x' stands for two things"),
    "time": (lambda: Field({X: X * t}, parameters={t: 1}), "the name 't' of a parameter has another meaning"),
    "pi": (lambda: Field({X: X * sp.Symbol("pi")}), "rate of x: undeclared symbol 'pi'"),
    "word of Python": (
        lambda: Field({X: sp.Symbol("lambda")}, parameters={"lambda": 1}),
        "'lambda' is a word of Python",
    ),
    "braces": (lambda: Field({sp.Symbol(r"\theta"): 1}), "is no name of a state"),
    "attribute": (lambda: Field({"model": 1}), "the state 'model' has the name of an attribute of nodes"),
    "integer": (
        lambda: Field({X: k * X}, parameters={sp.Symbol("k", integer=True): 1}),
        "its symbol is assumed to be algebraic, integer, rational",
    ),
    "default": (lambda: Field({X: k * X}, parameters={k: sp.I}), "k: default: found I"),
    "no default": (lambda: Field({X: "k*x"}, parameters={"k": {"unit": "1"}}), "expected a table with a default"),
    "unknown range": (lambda: Field({X: "k*x"}, parameters={"k": {"default": 1, "max": 2}}), "unknown key 'max'"),
    "plain symbols": (lambda: Lagrangian(V**2 / 2), "found no function of time; expected coordinates = {x: v}"),
    "friction in T": (lambda: Lagrangian(v**2 * friction(v)), "found friction(…) in T"),
    "friction in a field": (lambda: Field({X: friction(X)}), "found friction(…) in a rate"),
    "law unused": (lambda: Lagrangian(v**2, friction="coulomb"), "found friction 'coulomb', but no force has"),
    "contact unused": (lambda: Lagrangian(v**2, contact="atan"), "found contact 'atan', but no force has"),
    "law as text": (
        lambda: Lagrangian(v**2, 0, RUB, friction="mu*sign(w)"),
        "viscous, or an expression, friction_law('mu*sign(w)', {'mu': 0.3})",
    ),
    "unknown law": (lambda: Lagrangian(v**2, 0, RUB, friction="colomb"), "unknown friction 'colomb'"),
    "unknown contact": (lambda: Lagrangian(v**2, 0, RUB, contact="sticky"), "unknown contact 'sticky'"),
    "law without w": (
        lambda: Lagrangian(v**2, 0, RUB, friction=sp.sign(Y)),
        "friction: law: undeclared symbol 'y'; declared: w",
    ),
    "law with parameter w": (
        lambda: Lagrangian(v**2, W * x, RUB, friction=sp.sign(W), parameters={W: 1}),
        "the name 'w' stands for the sliding velocity",
    ),
    "law of time": (lambda: friction_law("sign(w)*cos(t)"), "undeclared symbol 't'; declared: w"),
    "static of w": (lambda: friction_law("sign(w)", static="w"), "found friction(…), or w in static"),
    "complex law": (
        lambda: friction_law("mu*w**(3/2)", {"mu": 0.3}),
        "found w**(3/2), which is complex for w < 0; expected a real force",
    ),
    "order": (lambda: friction_law("mu*sign(w)", {"mu": 1}, order=[("mu", "nu")]), "order names 'nu'"),
    "initial": (lambda: Field({X: -X}, initial={Y: 1}), "initial has the key y; expected x"),
    "no rates": (lambda: Field({}), "found no rates"),
    "same state": (lambda: Field({X: 1, "x": 2}), "two keys are the same state"),
    "condition": (lambda: Field({X: sp.Piecewise((1, X > 0))}), "has no value where no condition holds"),
    "name of a file": (lambda: Field({"x": "-x"}, name="a.py"), "name: found 'a.py', which names a file of code"),
    "steep after all": (lambda: Field({"x": "x**16*x"}), "found the power x**17; expected exponents up to 16"),
    "steep": (lambda: Field({X: X**17}), "found the exponent 17; expected at most 16"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_model_is_refused_at_its_definition_in_one_line(name: str) -> None:
    make, message = WRONG[name]
    with pytest.raises((ValueError, TypeError), match=re.escape(message)) as caught:
        make()
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 600


# -- expressions as text -----------------------------------------------------------------------------------------


def test_models_know_the_functions_that_generated_code_knows() -> None:
    classes = {function for function in FUNCTIONS.values() if isinstance(function, type)}
    assert classes == set(PRINTED)
    assert set(FUNCTIONS) - {name for name, f in FUNCTIONS.items() if f in classes} == {"sqrt"}


NAMES = {name: sp.Symbol(name, real=True) for name in ("x", "v", "k", "mu")} | {"t": TIME}

HOSTILE = [
    "__import__('os').system('true')", "x.__class__", "(lambda: 0)()", "[x for x in (1,)]", "x if x else 0", "f'{x}'",
    "9**9**9", "(9*x)**(16**2)", "((x+k)**16)**16", "exp(exp(exp(100)))", "floor(exp(1000))", "1/0", "x/(k-k)", "log(0)",
    "sqrt(-1)*x", "1e400", "x = 1", "x; k", "", "(" * 300, "-" * 300 + "x", "x+" * 3000 + "x", "x" * 30000, "t()", "True",
    "x > 0", "x and k", "x < k < 1", "sin(x, k)", "sin(x=1)", "sin(*x)", "max(x)", "eval(x)", "x == k", "'x'", "1j*x",
    "friction()", "sin", "exp(10**99)", "atan2(x)", "\x00", "x\n+k)", "10**16**16", "asin(2)", "0**-1", "...", "x[0]",
    "x if exp(log(x)) > (-1 if -1 > friction(pi) else friction(pi)) else 1", "abs(x > 0)", "not x", "1 if 2 > 1", "k if x > 0 and 1 else 2",
]  # fmt: skip


@pytest.mark.parametrize("text", HOSTILE)
def test_hostile_text_is_refused_in_one_line(text: str) -> None:
    with pytest.raises(ValueError, match=r"^V: ") as caught:
        read("V", text, NAMES)
    assert "\n" not in str(caught.value)


x_, v_, k_ = NAMES["x"], NAMES["v"], NAMES["k"]
AS_THEY_ARE = [
    2 * ((x_ + 1) * (v_ + 1)), -((x_ + 1) * (v_ + 1)), x_ - 3 * (x_ + 1) * (v_ + 1) / 2, -(x_ + 1) * v_, (x_ + 1) / (2 * v_),
    2 * (x_ + 1) ** 2 / (v_ + 1), 1 / (2 * x_ + 2), sp.sqrt(x_ + 1) ** -3, x_**-k_, -(x_**2), sp.sqrt(2) * x_ / 2,
    sp.Add(*(x_**i * v_ for i in range(17))), sp.Mul(*(sp.sin(i * x_) for i in range(1, 20))), sp.exp(1) * x_ - sp.pi,
    sp.Piecewise((x_, x_ > 0), (v_, sp.And(v_ < 1, x_ < 2)), (-1, True)), sp.Max(x_, v_, k_) * sp.Abs(x_),
]  # fmt: skip


@pytest.mark.parametrize("e", AS_THEY_ARE, ids=str)
def test_an_expression_keeps_its_form(e: sp.Expr) -> None:
    assert exact("e", e, NAMES) == e


leaves = st.sampled_from([*NAMES.values(), sp.Integer(2), sp.Rational(-3, 7), sp.pi, sp.Integer(-1), sp.Float(0.3)])


def deeper(inner: st.SearchStrategy) -> st.SearchStrategy:
    one = st.sampled_from([sp.sin, sp.exp, sp.tanh, sp.Abs, sp.sign, sp.floor, sp.atan, lambda e: -e])
    inner = inner.filter(lambda e: not e.has(sp.zoo, sp.nan))  # SymPy compares neither
    pairs = st.tuples(inner, inner)
    return st.one_of(
        st.builds(lambda f, e: f(e), one, inner),
        pairs.map(lambda p: p[0] + p[1]),
        pairs.map(lambda p: p[0] * p[1]),
        pairs.map(lambda p: p[0] - p[1]),
        pairs.map(lambda p: p[0] / (1 + p[1] ** 2)),
        pairs.map(lambda p: sp.Max(*p)),
        st.builds(lambda e, n: e**n, inner, st.sampled_from([2, 3, -1])),
        pairs.map(lambda p: sp.Piecewise((p[0], NAMES["x"] > p[1]), (p[1], True))),
        pairs.map(lambda p: sp.Piecewise((p[0], sp.And(NAMES["x"] > 0, NAMES["v"] <= 1)), (p[1], True))),
    )


@settings(deadline=None, max_examples=150)
@given(st.recursive(leaves, deeper, max_leaves=8))
def test_what_is_written_is_read_as_the_same_expression(e: sp.Expr) -> None:
    try:
        expression = exact("e", e, NAMES)
    except ValueError:  # a constant that is not real, in one line as tested above
        return
    assert read("e", written(expression), NAMES) == expression
    assert exact("e", expression, NAMES) == expression
    assert not expression.atoms(sp.Float)
    point = {s: sp.Rational(7 * i + 3, 5) for i, s in enumerate(NAMES.values())}
    value, meant = sp.N(expression.subs(point)), sp.N(e.subs(point))
    assert abs(value - meant) <= 1e-9 * (1 + abs(meant)) or sp.zoo in (value, meant)
