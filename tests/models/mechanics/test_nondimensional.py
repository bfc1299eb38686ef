"""Units, parameters and scaling: eq. 2 becomes eq. 3, every kind of oscillator is one file, wrong units are refused."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random

import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from parts import edge, is_lagrangian, node, oscillator_of, parameters

from synchain import Parameter
from synchain.models import oscillators
from synchain.models.definitions.definition import COUPLING, FRICTION_LAW, OSCILLATOR
from synchain.models.inputs.plugin_files import PluginKind, load, names
from synchain.models.mechanics.calculus import cancelled, operations
from synchain.models.mechanics.components import TIME
from synchain.models.mechanics.nondimensional import FRICTION, nondimensional, physical, scale
from synchain.models.mechanics.parameter import dimension
from synchain.plugins import Oscillator

x, v = sp.symbols("x v", real=True)
theta_b, epsilon, u, omega = sp.symbols("theta_b epsilon u omega", real=True)
OWNERS = [
    pytest.param(kind, name, id=f"{kind.name}-{name}")
    for kind in (OSCILLATOR, FRICTION_LAW, COUPLING)
    for name in names(kind)
]


def test_eq_2_from_the_physical_lagrangian() -> None:
    m, k = sp.symbols("m k", positive=True)
    drive, frequency, belt, load_on_belt = sp.symbols("U Omega v_b F_N", real=True)
    acceleration = physical(oscillator_of("friction")).accelerations()
    expected = (-k * (x - drive * sp.cos(frequency * TIME)) + load_on_belt * FRICTION(belt - v)) / m
    assert sp.expand(acceleration[0] - expected) == 0


def test_eq_3_comes_out_of_the_scaling() -> None:
    (acceleration,) = nondimensional(oscillator_of("friction")).accelerations()
    assert acceleration == -x + u * sp.cos(omega * TIME) + epsilon * FRICTION(theta_b - v)


def test_eq_3_with_the_law_of_eqs_4_and_5() -> None:
    mu_s, mu_k, a, kappa = sp.symbols("mu_s mu_k a kappa", real=True)
    w = theta_b - v
    law = (mu_k + (mu_s - mu_k) * sp.exp(-a * sp.Abs(w))) * (2 / sp.pi * sp.atan(kappa * w))
    single = node("friction", "exponential", "atan")
    assert single.rhs == (v, -x + u * sp.cos(omega * TIME) + epsilon * law)
    assert node("friction", "exponential", "sign").rhs[1] == single.rhs[1].xreplace(
        {sp.atan(kappa * w): sp.pi / 2 * sp.sign(w)}
    )


def test_the_groups_of_the_paper() -> None:
    """x0 = g/omega0^2, tau = omega0 t, epsilon = F_N/(m g), theta_b = v_b/(x0 omega0), u = U/x0, omega = Omega/omega0."""
    model = oscillator_of("friction")
    m, k, g = sp.symbols("m k g", positive=True)
    omega0 = sp.sqrt(k / m)
    x0 = g / omega0**2
    expected = {"m": x0, "s": 1 / omega0, "N": m * g, "m/s": x0 * omega0, "rad/s": omega0, "s/m": 1 / (x0 * omega0)}
    for unit, amount in expected.items():
        assert sp.simplify(scale(model, unit) / amount) == 1, unit
    assert sp.simplify(scale(model, "N/m") - k) == 0
    table = parameters("friction", "exponential", "atan", "spring")
    units = {"theta_b": "m/s", "epsilon": "N", "u": "m", "omega": "rad/s", "a": "s/m", "kappa": "s/m"}
    for name, unit in units.items():
        said = sp.parse_expr(table[name].scale, local_dict={"m": m, "k": k, "g": g})
        assert sp.simplify(said / expected[unit]) == 1, name
    assert (table["sigma"].scale, table["mu_s"].scale) == ("k", "1")


positive = st.floats(0.1, 10)


@given(st.tuples(positive, positive, positive), st.lists(st.floats(-2, 2), min_size=3, max_size=3), positive, positive)
def test_physical_and_scaled_motion_agree_in_numbers(
    fixed: tuple[float, ...], motion: list[float], a: float, kappa: float
) -> None:
    """Eq. 2 in SI units, computed by hand with the friction law's parameters in SI units too, against the derived node."""
    (m, k, g), (at, rate, t) = fixed, motion
    omega0 = math.sqrt(k / m)
    x0 = g / omega0**2
    value = {"theta_b": 0.1, "epsilon": 2.0, "u": 0.3, "omega": 1.15, "mu_s": 0.3, "mu_k": 0.15, "a": a, "kappa": kappa}
    w = 0.1 * x0 * omega0 - rate * x0 * omega0
    falling = 0.15 + 0.15 * math.exp(-a / (x0 * omega0) * abs(w))
    f = falling * 2 / math.pi * math.atan(kappa / (x0 * omega0) * w)
    spring = -k * (at * x0 - 0.3 * x0 * math.cos(1.15 * omega0 * (t / omega0)))
    by_hand = (spring + 2.0 * m * g * f) / m / (x0 * omega0**2)
    derived = node("friction", "exponential", "atan")
    symbols = [TIME, *derived.state, *derived.parameters]
    values = [t, at, rate, *(value[s.name] for s in derived.parameters)]
    acceleration = derived.rhs[1].subs(dict(zip(symbols, values, strict=True)))
    assert float(acceleration) == pytest.approx(by_hand, rel=1e-12, abs=1e-12)


def test_coupling_scales_with_the_oscillators_own_spring() -> None:
    """A spring of stiffness sigma k between two masses: its energy over k x0^2 is the non-dimensional potential."""
    model, spring = oscillator_of("friction"), load(COUPLING, "spring")
    q_i, q_j, sigma = sp.symbols("q_i q_j sigma", real=True)
    x0 = scale(model, "m")
    in_si = spring.potential.xreplace({q_i: q_i * x0, q_j: q_j * x0, sigma: sigma * scale(model, "N/m")})
    assert sp.simplify(in_si / scale(model, "N*m") - spring.potential) == 0


def test_duffing_and_harmonic_are_as_published() -> None:
    delta, beta = sp.symbols("delta beta", real=True)
    assert node("duffing").rhs == (v, -x - beta * x**3 - delta * v + u * sp.cos(omega * TIME))
    assert node("harmonic").rhs == (v, -x)
    assert node("harmonic").parameters == ()
    assert not node("harmonic").forced


# -- one new file is enough -----------------------------------------------------------------------------------

HEADER = "from synchain import Field, Lagrangian, Parameter\n"
VAN_DER_POL = (
    HEADER
    + """
OSCILLATOR = Lagrangian("v**2/2", "x**2/2", {"x": "mu*(1 - x**2)*v"}, coordinates={"x": "v"},
                        parameters={"mu": Parameter(1.0, "1", "strength of the negative damping")})
"""
)
ROESSLER = (
    HEADER
    + """
OSCILLATOR = Field({"x": "-y - z", "y": "x + a*y", "z": "b + z*(x - c)"}, parameters={"a": 0.2, "b": 0.2, "c": 9})
"""
)
HANGING = (
    HEADER
    + """
OSCILLATOR = Lagrangian(
    "m*(l*v)**2/2", "-m*g*l*cos(x)", {"x": "-d*v"}, coordinates={"x": "v"},
    parameters={"delta": Parameter(0.1, "N*m*s", "damping")},
    scaling={"physical": {"delta": "d"}, "units": {"m": "kg", "l": "m", "g": "m/s^2", "x": "rad"},
             "scales": {"kg": "m", "m": "l", "s": "sqrt(l/g)"}},
)
"""
)
HARDENING = (
    HEADER
    + """
OSCILLATOR = Lagrangian(
    "m*v**2/2", "k*x**2/2 + K*x**4/4", R="d*v**2/2", coordinates={"x": "v"},
    parameters={"beta": Parameter(1.0, "N/m^3", "hardening"), "delta": Parameter(0.1, "N*s/m", "damping")},
    scaling={"physical": {"beta": "K", "delta": "d"}, "units": {"m": "kg", "k": "N/m", "l": "m", "x": "m"},
             "scales": {"kg": "m", "m": "l", "s": "sqrt(m/k)"}},
)
"""
)
HEAVY = (
    HEADER
    + """
OSCILLATOR = Lagrangian("m*v**2/2", "-m*g*cos(x)", R="m*c*v**2/2", coordinates={"x": "v"}, parameters={
    "m": Parameter(2.0, "kg", "mass"), "g": Parameter(9.8, "m/s^2", "gravity"), "c": Parameter(0.1, "1/s", "damping")})
"""
)


@pytest.fixture
def plug_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str, str], Oscillator]]:
    """A function that puts one more file into the folder of the oscillators, as far as Python can see."""
    monkeypatch.setattr(oscillators, "__path__", [*oscillators.__path__, str(tmp_path)])
    added = []

    def add(name: str, body: str) -> Oscillator:
        (tmp_path / f"{name}.py").write_text(body, encoding="utf-8")
        added.append(name)
        return oscillator_of(name)

    yield add
    for name in added:
        sys.modules.pop(f"synchain.models.oscillators.{name}", None)
        vars(oscillators).pop(name, None)


def test_a_lagrangian_in_one_file(plug_in: Callable[[str, str], Oscillator]) -> None:
    plug_in("van_der_pol_again", VAN_DER_POL)
    mu = sp.Symbol("mu", real=True)
    assert "van_der_pol_again" in names(OSCILLATOR)
    assert node("van_der_pol_again").rhs == (v, -x + mu * (1 - x**2) * v)
    assert edge("spring", node("van_der_pol_again"), "van_der_pol_again").rhs[0] == 0


def test_a_vector_field_in_one_file(plug_in: Callable[[str, str], Oscillator]) -> None:
    plug_in("roessler_again", ROESSLER)
    y, z, a, b, c = sp.symbols("y z a b c", real=True)
    single = node("roessler_again")
    assert single.state == (x, y, z)
    assert single.rhs == (-y - z, x + a * y, b + z * (x - c))
    with pytest.raises(ValueError, match="coupling 'spring' joins coordinates with velocities"):
        edge("spring", single, "roessler_again")


def test_an_angle_scales_like_an_angle(plug_in: Callable[[str, str], Oscillator]) -> None:
    plug_in("hanging", HANGING)
    delta = sp.Symbol("delta", real=True)
    assert node("hanging").rhs == (v, -sp.sin(x) - delta * v)
    assert parameters("hanging")["delta"].scale in {"sqrt(g)*l**(3/2)*m", "g**(1/2)*l**(3/2)*m", "l**(3/2)*sqrt(g)*m"}


def test_equations_keep_no_common_factors(plug_in: Callable[[str, str], Oscillator]) -> None:
    for name, body in (("hardening", HARDENING), ("heavy", HEAVY)):
        plug_in(name, body)
    beta, delta, g, c = sp.symbols("beta delta g c", real=True)
    assert node("hardening").rhs == (v, -beta * x**3 - delta * v - x)
    assert node("heavy").rhs == (v, -c * v - g * sp.sin(x))


@pytest.mark.parametrize("name", [name for name in names(OSCILLATOR) if is_lagrangian(name)])
def test_cancelling_changes_the_text_of_an_equation_alone(name: str) -> None:
    """The rates of a node against those that the Euler-Lagrange equations give, at random places."""
    system = nondimensional(oscillator_of(name))
    derived = system.accelerations()
    quotient = cancelled(derived)
    assert operations(quotient) <= operations(derived)
    forms = (derived, quotient, tuple(map(sp.cancel, derived)) if len(derived) == 1 else quotient)
    symbols = sorted(set().union(*(e.free_symbols for e in derived)), key=str)
    functions = [sp.lambdify(symbols, form, [{"f": math.tanh}, "math"]) for form in forms]
    random = Random(name)
    for _ in range(20):
        point = [random.uniform(0.1, 2.0) for _ in symbols]
        expected = functions[0](*point)
        for function in functions[1:]:
            assert function(*point) == pytest.approx(expected, rel=1e-13, abs=1e-13)


def test_long_equations_and_shorter_ones_stay_as_they_were_derived() -> None:
    mu = sp.Symbol("mu", real=True)
    short = (mu * (1 - x**2) * v - x,)
    assert cancelled(short) == short
    long = (sp.Add(*(sp.Symbol(f"a_{k}", real=True) * x * v / v.func(f"b_{k}") for k in range(99))) * v / (x * v),)
    assert cancelled(long) == long


@pytest.mark.parametrize(
    ("right", "wrong", "message"),
    [
        (
            '"delta": Parameter(0.1, "N*m*s"',
            '"delta": Parameter(0.1, "N*m"',
            "hanging: force on x: the unit s does not",
        ),
        ("m*(l*v)**2", "m*l*v**2", "hanging: kinetic energy: the unit m does not cancel"),
        ("-m*g*l*cos(x)", "-m*g*cos(x)", "hanging: potential energy: the unit m does not cancel"),
        ("sqrt(l/g)", "sqrt(g/l)", "hanging.scales: g becomes .*; expected 1"),
        ("-d*v", "-d*v*mass", "force on x: undeclared symbol 'mass'; declared: x, v, m, l, g, d, t"),
        ('"N*m*s"', '"lb"', "unit 'lb': cannot read 'lb'; expected products and quotients of 1, rad, kg, m, s, N"),
        ('"g": "m/s^2"', '"g": "lb"', "scaling: g: unit 'lb': cannot read 'lb'; expected products and quotients of 1"),
        ('{"x": "v"}', '{"x": "v", "y": "w"}', "no kinetic energy in the velocity w"),
    ],
)
def test_a_careless_file_is_refused(
    plug_in: Callable[[str, str], Oscillator], right: str, wrong: str, message: str
) -> None:
    assert right in HANGING
    with pytest.raises(ValueError, match=message):
        nondimensional(plug_in("hanging", HANGING.replace(right, wrong)))


# -- units and parameters -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("unit", "powers"),
    [
        ("1", (0, 0, 0)),
        ("rad/s", (0, 0, -1)),
        ("N/m", (1, 0, -2)),
        ("kg*m^2/s^2", (1, 2, -2)),
        ("1/s", (0, 0, -1)),
        ("m/s/s", (0, 1, -2)),
        ("s^-2", (0, 0, -2)),
        ("N * m", (1, 2, -2)),
    ],
)
def test_units_as_powers(unit: str, powers: tuple[int, int, int]) -> None:
    assert dimension(unit) == powers


@pytest.mark.parametrize("unit", ["", "K", "m^", "m^x", "m^1.5", "m//s", "*m", "N/", "m^²", "m^-"])
def test_unreadable_units(unit: str) -> None:
    with pytest.raises(ValueError, match=r"cannot read .*; expected products and quotients"):
        dimension(unit)


@pytest.mark.parametrize(("kind", "name"), OWNERS)
def test_every_plug_in_declares_itself(kind: PluginKind, name: str) -> None:
    part = load(kind, name)
    assert part.name == name
    assert part.summary.strip()
    assert any(character.isdigit() for character in part.source), "a source has a year or a volume"
    assert all(isinstance(parameter, Parameter) and parameter.meaning for parameter in part.parameters.values())


def test_table_1_is_the_default() -> None:
    table = parameters("friction", "exponential", "atan", "spring")
    assert {name: p.default for name, p in table.items()} == {
        "theta_b": 0.1, "epsilon": 2.0, "u": 0.1, "omega": 1.15, "mu_s": 0.3, "mu_k": 0.15, "a": 2.5, "kappa": 1e5,
        "sigma": 0.0,
    }  # fmt: skip


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, -1, 3.5])
def test_parameter_refuses_a_value(bad: float) -> None:
    share = Parameter(0.5, "1", "a share", minimum=0, maximum=3)
    assert share.check("share", 3) == 3.0
    with pytest.raises(
        ValueError, match=r"share = .* is not allowed; expected a finite number at least 0 and at most 3"
    ):
        share.check("share", bad)


@pytest.mark.parametrize("bad", ["1", None, True, 1j, [1]])
def test_parameter_refuses_what_is_no_number(bad: object) -> None:
    with pytest.raises(TypeError, match="is no number; expected a finite number"):
        Parameter(0.5, "1", "a share").check("share", bad)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Parameter(-1, "1", "a mass", minimum=0), "default of 'a mass' = -1 is not allowed"),
        (lambda: Parameter(0, "kg", "a mass", positive=True), "expected a finite number above 0"),
        (lambda: Parameter(1, "1", "a share", minimum=2, maximum=0), "range is empty: minimum 2 above maximum 0"),
        (lambda: Parameter(1, "furlong", "a length"), "unit 'furlong': cannot read 'furlong'"),
    ],
)
def test_parameter_checks_itself(make: Callable[[], Parameter], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()
