"""Every friction law of the directory: odd, passive, finite at the jump, with units and a source; the four laws by value."""

from __future__ import annotations

import random

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from parts import coupling_of, law_of, oscillator_of

from synchain.models.definitions.definition import COUPLING, FRICTION_LAW, OSCILLATOR
from synchain.models.dynamics.network import parameters
from synchain.models.inputs.frozen import FrozenDict
from synchain.models.inputs.plugin_files import names
from synchain.models.mechanics.contact import KAPPA, ContactModel, FrictionLaw, regularise
from synchain.models.mechanics.nondimensional import friction_coefficient
from synchain.models.mechanics.parameter import Parameter

LAWS = names(FRICTION_LAW)
W = sp.Symbol("w", real=True)
FAST = sp.Symbol("w", positive=True)
SPEEDS = [sp.Rational(10) ** k for k in range(-6, 4)]


def coefficient(name: str, w: sp.Expr = W) -> sp.Expr:
    """The law with its default parameters, exactly as fractions."""
    law = law_of(name)
    values = {sp.Symbol(p, real=True): sp.Rational(str(value.default)) for p, value in law.parameters.items()}
    return law.force.xreplace({**values, W: w})


def test_the_four_laws_are_found() -> None:
    assert {"coulomb", "exponential", "stribeck", "viscous"} <= set(LAWS)


@pytest.mark.parametrize("name", LAWS)
def test_declarations(name: str) -> None:
    law = law_of(name)
    assert law.name == name
    assert law.summary.strip()
    assert any(character.isdigit() for character in law.source), "a source has a year or a volume"
    assert all(isinstance(p, Parameter) and p.meaning for p in law.parameters.values())


@pytest.mark.parametrize("name", LAWS)
def test_parameters_have_no_name_of_an_oscillator_or_coupling(name: str) -> None:
    others: set[str] = {"kappa", "t", "x", "v", "weight"}
    for oscillator in names(OSCILLATOR):
        node = oscillator_of(oscillator)
        others |= set(node.parameters) if node.takes_friction else set()
    for coupling in names(COUPLING):
        others |= set(coupling_of(coupling).parameters)
    assert not others & set(law_of(name).parameters)


@pytest.mark.parametrize("name", LAWS)
def test_odd(name: str) -> None:
    force = law_of(name).force
    assert sp.simplify(force.xreplace({W: -W}) + force) == 0


@pytest.mark.parametrize("name", LAWS)
def test_drags_along_and_never_drives(name: str) -> None:
    f = coefficient(name)
    assert f.subs(W, 0) == 0
    for speed in SPEEDS:
        assert f.subs(W, speed) > 0
        assert f.subs(W, -speed) < 0


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("contact", ContactModel)
@given(st.integers(0, 10**6), st.floats(1e-9, 1e3))
@settings(max_examples=25, deadline=None)
def test_never_drives_with_any_allowed_parameters(name: str, contact: str, seed: int, speed: float) -> None:
    """w f(w) >= 0 also where friction grows with speed, mu_s < mu_k, and f(0) = 0 exactly, smoothed or not."""
    dice, law = random.Random(seed), law_of(name)
    values = {
        sp.Symbol(p, real=True): sp.Rational(allowed.check(p, dice.choice([0.01, 0.3, 2.0, 50.0])))
        for p, allowed in {**law.parameters, "kappa": KAPPA}.items()
    }
    f = friction_coefficient(law_of(name), contact)(W).xreplace(values)
    assert f.xreplace({W: sp.S.Zero}) == 0
    assert f.xreplace({W: sp.Rational(speed)}).evalf() >= 0
    assert f.xreplace({W: -sp.Rational(speed)}).evalf() <= 0


@pytest.mark.parametrize("name", LAWS)
def test_jump_is_finite_and_numbers_are_exact(name: str) -> None:
    start = sp.limit(coefficient(name, FAST), FAST, 0, "+")
    assert start.is_finite
    assert start >= 0
    assert not coefficient(name).atoms(sp.Float)


@pytest.mark.parametrize(
    ("name", "start", "end"),
    [
        ("exponential", "3/10", "3/20"),
        ("coulomb", "3/10", "3/10"),
        ("stribeck", "3/10", "3/20"),
        ("viscous", "0", "oo"),
    ],
)
def test_limits(name: str, start: str, end: str) -> None:
    f = coefficient(name, FAST)
    assert sp.limit(f, FAST, 0, "+") == sp.Rational(start)
    assert sp.limit(f, FAST, sp.oo) == sp.sympify(end)


def test_values_between_the_limits() -> None:
    """f(1) by hand: 0.15 + 0.15 e^-2.5, 0.15 + 0.15 e^-(1/0.4)^2, and the viscous part of Stribeck's law."""
    half = sp.Rational(3, 20)
    assert sp.expand(coefficient("exponential", sp.S.One) - half - half * sp.exp(-sp.Rational(5, 2))) == 0
    assert sp.expand(coefficient("stribeck", sp.S.One) - half - half * sp.exp(-sp.Rational(25, 4))) == 0
    stribeck, c = law_of("stribeck").force, sp.Symbol("c", real=True)
    assert sp.simplify(stribeck - stribeck.xreplace({c: sp.S.Zero}) - c * W) == 0
    assert coefficient("viscous", sp.Integer(2)) == sp.Rational(3, 5)


def test_regularised_jump_is_smooth_and_close() -> None:
    kappa = sp.Symbol("kappa", positive=True)
    smooth = regularise(sp.sign(W), W, kappa)
    assert smooth == 2 * sp.atan(kappa * W) / sp.pi
    assert smooth.diff(W).subs(W, 0) == 2 * kappa / sp.pi
    assert sp.limit((1 - smooth.subs(W, FAST)) * sp.pi * kappa * FAST / 2, FAST, sp.oo) == 1
    assert regularise(W**2 * sp.Abs(W), W, kappa) == W**2 * sp.Abs(W)


def test_default_steepness_is_the_papers() -> None:
    assert KAPPA.default == 1e5
    with pytest.raises(ValueError, match=r"kappa = 0 is not allowed; expected a finite number above 0"):
        KAPPA.check("kappa", 0)


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("contact", ContactModel)
def test_units_cancel(name: str, contact: str) -> None:
    """A law in scaled parameters and the scaled velocity is the law itself: nothing of M, L and T is left over."""
    expected = law_of(name).force
    if contact == "atan":
        expected = regularise(expected, W, sp.Symbol("kappa", real=True))
    assert sp.simplify(friction_coefficient(law_of(name), contact)(W) - expected) == 0


def test_a_wrong_unit_is_noticed() -> None:
    a, w = sp.symbols("a w", real=True)
    table = FrozenDict({"a": Parameter(1.0, "m/s", "rate of decay")})
    law = FrictionLaw("careless", table, sp.exp(-a * sp.Abs(w)) * sp.sign(w))
    with pytest.raises(ValueError, match="friction law careless: the unit m does not cancel"):
        friction_coefficient(law, "sign")


MU = sp.Symbol("mu", real=True)
FRACTION = sp.Rational(1, 10**6)


def law_with(force: sp.Expr) -> FrictionLaw:
    return FrictionLaw("own", FrozenDict({"mu": Parameter(0.0)}), force)


@pytest.mark.parametrize(
    "force",
    [
        MU * W / sp.Abs(W), MU * sp.Abs(W) / W, sp.Piecewise((MU, W > 0), (-MU, True)), sp.Piecewise((MU, W > 0), (-MU / 2, True)),
        sp.Piecewise((MU, W > 0), (-MU, W < 0), (0, True)), sp.Piecewise((MU, sp.sin(W) > 0), (-MU, True)), sp.Heaviside(W, 0) * MU,
        MU * (sp.Max(W, 0) + sp.Min(W, 0)) / sp.Abs(W), MU * (sp.floor(W) + sp.ceiling(W)), MU * sp.atan(1 / W),
        MU * sp.sign(W) + MU * W / sp.Abs(W),
    ],
)  # fmt: skip
def test_a_jump_that_is_no_sign_is_refused(force: sp.Expr) -> None:
    """The arcus tangent would not smooth it, and nothing would stick."""
    with pytest.raises(ValueError, match=r"friction law 'own': found a jump at w = 0 in .* not written with sign"):
        law_with(force)


@pytest.mark.parametrize(
    ("force", "jumps"),
    [
        (MU * sp.sign(W), True), (MU * sp.sign(2 * W), True), (sp.sign(W * MU), True), (MU * sp.sign(W) + MU / 4, True),
        (MU * sp.sign(W) * sp.Piecewise((1, sp.Abs(W) < 1), (2, True)), True), (MU * sp.sign(W) * sp.exp(-sp.Abs(W)), True),
        (MU * sp.sign(W) * W**2, False), (MU * sp.tanh(W / FRACTION), False), (MU * sp.sign(W) * sp.sqrt(sp.Abs(W)), False),
        (MU * W * sp.Abs(W), False), (sp.Piecewise((MU * W, W > 0), (2 * MU * W, True)), False), (MU + W - MU, False),
    ],
)  # fmt: skip
def test_what_jumps_at_rest(force: sp.Expr, jumps: bool) -> None:
    assert law_with(force).jumps is jumps


def test_signs_of_parameters_are_not_smoothed() -> None:
    kappa = sp.Symbol("kappa", real=True)
    assert regularise(sp.sign(MU) * W, W, kappa) == sp.sign(MU) * W
    assert "kappa" not in parameters(oscillator_of("friction"), law_with(sp.sign(MU) * W))


def test_unknown_contact() -> None:
    with pytest.raises(ValueError, match="unknown contact 'tanh'; known: atan, sign"):
        friction_coefficient(law_of("coulomb"), "tanh")
