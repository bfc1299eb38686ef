"""Couplings written as entries of a matrix H: what is read, what is refused, and what the links then do."""

from __future__ import annotations

import json
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from parts import connectivity, edge, is_lagrangian, node, oscillator_of, parameters
from scipy.integrate import solve_ivp
from variational_reference import ALPHA, deviation_names, transversal_equations

from synchain import Scene, load_scene, run
from synchain.codegen.program.lowering import lower
from synchain.codegen.program.printers import LANES
from synchain.export import text
from synchain.graphs import chain, from_matrix, ring
from synchain.models.definitions.definition import OSCILLATOR
from synchain.models.dynamics.network import network
from synchain.models.inputs.plugin_files import names
from synchain.models.interactions.coupling import MatrixCoupling
from synchain.models.mechanics.components import Node
from synchain.models.mechanics.oscillator import FieldModel

STATE = ("x", "y", "z")
WEIGHT, SIGMA = sp.symbols("weight sigma", real=True)
GAP = {name: sp.Symbol(f"{name}_j", real=True) - sp.Symbol(f"{name}_i", real=True) for name in (*STATE, "v")}


# -- what is read --------------------------------------------------------------------------------------------


def entries(text: str, state: tuple[str, ...]) -> dict[tuple[str, str], Fraction]:
    """The entries of a text, whose components must be states."""
    coupling = MatrixCoupling.parse(text)
    if coupling is None:
        raise ValueError("coupling without an arrow")
    coupling.check(state)
    return {(source, target): factor for source, target, factor in coupling.entries}


def canonical(text: str, state: tuple[str, ...]) -> str:
    """The one spelling of a text."""
    entries(text, state)
    return str(MatrixCoupling.parse(text).canonical(state))  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x->x", {("x", "x"): 1}),
        (" y -> x ", {("y", "x"): 1}),
        ("1/2 x->y", {("x", "y"): Fraction(1, 2)}),
        ("2y->z", {("y", "z"): 2}),
        ("-x->x", {("x", "x"): -1}),
        ("- 3/4*x->x,+0.25 z->y", {("x", "x"): Fraction(-3, 4), ("z", "y"): Fraction(1, 4)}),
        ("123456789123456789/1000000000000000 x->x", {("x", "x"): Fraction(123456789123456789, 10**15)}),
        ("1e-3 x->x, 0.12345678912345*y->y", {("x", "x"): Fraction(1, 1000), ("y", "y"): Fraction("0.12345678912345")}),
        ("-2.5E+2 x->z", {("x", "z"): -250}),
        ("x->x, y->y, z->z", {("x", "x"): 1, ("y", "y"): 1, ("z", "z"): 1}),
    ],
)
def test_entries(text: str, expected: dict) -> None:
    assert entries(text, STATE) == expected
    assert entries(canonical(text, STATE), STATE) == expected


def test_a_component_that_looks_like_an_exponent_is_one() -> None:
    assert entries("2e1->e1, 3 e1->x, 4e1 x->x", ("x", "e1")) == {("e1", "e1"): 2, ("e1", "x"): 3, ("x", "x"): 40}


def test_one_spelling() -> None:
    for spelling in ("x->y,0.5z->x", "2/4*z->x , x->y", "+ 1 x -> y, 1/2 z->x"):
        assert canonical(spelling, STATE) == "1/2 z->x, x->y"
    assert canonical("-1 x->x", STATE) == "-x->x"


REFUSED = [
    ("w->x", "coupling 'w->x': unknown component 'w'; known: x, y, z; name states of the oscillator"),
    ("xx->x", "unknown component 'xx'; known: x, y, z; did you mean 'x'?"),
    ("x->x,", "cannot read ''; expected 'a->b', the difference of a into the rate of b"),
    ("x->", "cannot read 'x->'"),
    ("->x", "cannot read '->x'"),
    ("x->y->z", "cannot read 'x->y->z'"),
    ("x->x; y->y", "cannot read 'x->x; y->y'"),
    ("sin(x)->x", "cannot read 'sin(x)->x'"),
    ("x.real->x", "cannot read 'x.real->x'"),
    ("x->x + y", "cannot read 'x->x + y'"),
    ("1e101 x->x", "the factor '1e101' is too large, or has too many digits"),
    ("1e-101 x->x", "the factor '1e-101' is too large, or has too many digits"),
    ("1/2/3 x->x", "cannot read '1/2/3 x->x'"),
    ("* x->x", "cannot read '* x->x'"),
    ("x - > x, x->y", "cannot read 'x - > x'"),
    ("٣ x->x", "cannot read '٣ x->x'"),
    ("1/0 x->x", "1/0 divides by zero"),
    ("0 x->x", "the factor of 'x->x' is 0"),
    ("x->x, 2 x->x", "'x->x' occurs twice; expected each entry once; add the factors"),
]


@pytest.mark.parametrize(("text", "part"), REFUSED)
def test_refused(text: str, part: str) -> None:
    for refuse in (lambda: entries(text, STATE), lambda: edge(text, node("rossler")),
                   lambda: Scene(oscillator="rossler", topology=chain(2), coupling=text)):  # fmt: skip
        with pytest.raises(ValueError, match="coupling") as caught:
            refuse()
        assert part in str(caught.value)
        assert "\n" not in str(caught.value)


@given(st.text("xyz->,0123/.*+- \n_e", max_size=30))
def test_any_text_is_read_or_refused_and_one_spelling_is_stable(words: str) -> None:
    try:
        made, message = canonical(words, STATE), ""
    except ValueError as error:
        made, message = "", str(error)
    if message:
        assert message.startswith("coupling")
        assert "\n" not in message
    else:
        assert canonical(made, STATE) == made
        assert entries(made, STATE) == entries(words, STATE)


# -- what the links do ---------------------------------------------------------------------------------------


def test_the_difference_of_the_first_enters_the_rate_of_the_second() -> None:
    link = edge("y->x", node("rossler"))
    assert link.rhs == (SIGMA * WEIGHT * GAP["y"], 0, 0)
    assert link.parameters == (SIGMA,)
    link = edge("1/2 x->y, -3 z->y, z->z", node("lorenz"))
    assert link.rhs[0] == 0
    assert sp.expand(link.rhs[1] - SIGMA * WEIGHT * (GAP["x"] / 2 - 3 * GAP["z"])) == 0
    assert link.rhs[2] == SIGMA * WEIGHT * GAP["z"]
    assert link.diffusive


OTHER_MASSES = ("beam", "belt_double_pendulum", "clock", "double_pendulum")


@pytest.mark.parametrize("oscillator", [name for name in names(OSCILLATOR) if name not in OTHER_MASSES])
def test_springs_and_dampers_of_mass_one_are_entries(oscillator: str) -> None:
    single = node(oscillator, "coulomb" if oscillator_of(oscillator).takes_friction else None)
    if not is_lagrangian(oscillator):
        with pytest.raises(ValueError, match=r"joins coordinates with velocities; .* coupling = 'x->x'"):
            edge("spring", single, oscillator)
        return
    assert edge("x->v", single, oscillator) == edge("spring", single, oscillator)
    assert edge("v->v", single, oscillator) == edge("damper", single, oscillator)


def test_the_friction_oscillator_has_mass_one_too() -> None:
    single = node("friction", "exponential")
    assert edge("x->v", single, "friction") == edge("spring", single, "friction")


def test_equal_states_feel_exactly_nothing() -> None:
    """One sum over both differences, x_j + y_j/3 - x_i - y_i/3, would leave round-off."""
    link = edge("x->x, 1/3 y->x", node("rossler"))
    for k in range(200):
        at = {"x": 0.1 * k, "y": 0.7 + k}
        values = {f"{name}_{end}": value for name, value in at.items() for end in "ij"}
        assert eval(LANES.text(lower(link.rhs[0])), {"sigma": 0.3, "weight": 1.7, **values}) == 0.0


def test_a_network_by_hand() -> None:
    graph = from_matrix([[0, 0], ["2/3", "-2/3"]])
    single = node("rossler")
    rates = network(single, edge("x->x, 1/2 z->y", single), graph).rhs()
    x_1, x_2, y_2, z_1, z_2, a = sp.symbols("x_1 x_2 y_2 z_1 z_2 a", real=True)
    assert sp.expand(rates[1] - (-y_2 - z_2 + SIGMA * sp.Rational(2, 3) * (x_1 - x_2))) == 0
    assert sp.expand(rates[3] - (x_2 + a * y_2 + SIGMA * (z_1 - z_2) / 3)) == 0
    assert not rates[0].has(SIGMA)
    assert not rates[2].has(SIGMA)


def test_the_identity_shifts_every_mode_by_alpha() -> None:
    """H = I: d' = (J - alpha) d, so that every exponent is that of one oscillator less alpha."""
    single = node("lorenz")
    mode = transversal_equations(network(single, edge("x->x, y->y, z->z", single), chain(2)))
    alone = transversal_equations(network(single, edge("x->x", single), chain(2)))
    for k, d in enumerate(deviation_names(single)):
        jacobian = alone.node.rhs[3 + k].xreplace({ALPHA: sp.S.Zero})
        assert sp.expand(mode.node.rhs[3 + k] - (jacobian - ALPHA * d)) == 0


def test_connectivity_leaves_the_factors_to_the_matrix() -> None:
    graph = from_matrix([["-5/2", 2, "1/2"], [0, 0, 0], ["1/3", 0, "-1/3"]])
    assert connectivity("x->x", graph) == connectivity("1/2 x->y, z->z", graph) == graph.rows
    with pytest.raises(ValueError, match="cannot read"):
        connectivity("x->", graph)


def test_the_parameter() -> None:
    strength = parameters("rossler", coupling="x->x")["sigma"]
    assert (strength.default, strength.unit, strength.minimum, strength.scale) == (0.0, "1", None, "1")


def test_a_field_of_positions_and_velocities_takes_a_spring() -> None:
    """Mass 1: no kinetic energy is asked for."""
    x, v = sp.symbols("x v", real=True)
    rossler = replace(oscillator_of("rossler"), model=FieldModel(("x", "v"), (v, -x)))
    assert edge("spring", Node((x, v), (v, -x), ()), rossler).rhs[1] == SIGMA * WEIGHT * GAP["x"]


# -- scenes --------------------------------------------------------------------------------------------------


def test_a_scene_keeps_its_coupling() -> None:
    scene = Scene(oscillator="rossler", topology=ring(3), coupling=" 0.5y->x,x -> x", parameters={"sigma": -0.1})
    assert str(scene.coupling) == "x->x, 1/2 y->x"
    assert Scene.from_dict(json.loads(json.dumps(scene.as_dict()))) == scene
    assert scene.parameters["sigma"] == -0.1
    assert scene.equations.edge == edge("x->x, 1/2 y->x", node("rossler"))
    assert scene.replace(topology=chain(2)).coupling == scene.coupling


def test_a_scene_file(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text('oscillator = "lorenz"\ncoupling = "x->x"\n[topology]\nname = "chain"\nn = 2\n', "utf-8")
    assert load_scene(path) == Scene(oscillator="lorenz", coupling="x->x", topology=chain(2))
    path.write_text('oscillator = "lorenz"\ncoupling = "v->x"\n', "utf-8")
    with pytest.raises(ValueError, match=r"mine.toml: coupling 'v->x': unknown component 'v'; known: x, y, z"):
        load_scene(path)


def test_a_scene_refuses_springs_between_vector_fields() -> None:
    with pytest.raises(ValueError, match=r"coupling 'spring' joins coordinates with velocities; .* 'x->x'"):
        Scene(oscillator="rossler", topology=chain(2))
    assert Scene(oscillator="rossler").equations.n == 1
    with pytest.raises(ValueError, match="unknown component 'y'; known: x, v"):
        Scene(oscillator="rossler", coupling="x->y").replace(oscillator="harmonic")


def test_a_coupling_that_is_too_long_to_be_written_back_is_refused() -> None:
    text = ",".join(f"0.12345678{k}{s}->{t}" for k, (s, t) in enumerate((s, t) for s in STATE for t in STATE))
    assert len(text) <= 200
    with pytest.raises(ValueError, match=r"coupling: found 2.. characters; expected at most 200"):
        Scene(oscillator="rossler", coupling=text)


def test_an_unknown_name_says_that_components_are_possible() -> None:
    with pytest.raises(
        ValueError,
        match=r"unknown coupling 'x>x'; known: cubic_spring, damper, .*torsion, or components such as 'x->x'",
    ):
        Scene(oscillator="rossler", coupling="x>x")


def test_entries_between_lagrangian_oscillators() -> None:
    """Links into a coordinate: x' is then v and the links, and the kernel's equations say so."""
    equations = Scene(oscillator="harmonic", topology=chain(2), coupling="x->x").equations
    v_1, x_1, x_2 = sp.symbols("v_1 x_1 x_2", real=True)
    assert equations.rhs()[0] == v_1 + SIGMA * (x_2 - x_1)
    assert text(equations).splitlines()[0] == "x_1' = v_1 + σ (x_2 - x_1)"


# -- runs ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [3, pytest.param(40, marks=pytest.mark.long)])
def test_a_run_agrees_with_a_network_written_by_hand(n: int) -> None:
    """A few nodes are written out in the kernel, many are looped over; SciPy integrates L s and H as matrices."""
    graph, sigma = ring(n), 0.3
    scene = Scene(oscillator="rossler", topology=graph, coupling="x->x, 1/2 y->x, -1/3 z->y", transient=0, window=2,
                  parameters={"sigma": sigma}, rtol=1e-10,
                  initial={"x": np.cos(np.arange(n)), "y": 1.0, "z": 2 + np.sin(np.arange(n))})  # fmt: skip
    matrix = np.array([[1, 1 / 2, 0], [0, 0, -1 / 3], [0, 0, 0]])
    laplacian = np.array(graph.rows, dtype=float)

    def rates(t: float, flat: np.ndarray) -> np.ndarray:
        x, y, z = states = flat.reshape(3, n)
        return (np.array([-y - z, x + 0.2 * y, 0.2 + z * (x - 9)]) + sigma * matrix @ states @ laplacian.T).ravel()

    expected = solve_ivp(rates, (0, 2), scene.y0, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    result = run(scene, workers=1, show_progress=False)
    assert result.success
    assert np.abs(result.states("end") - expected).max() < 1e-6
    assert expected.reshape(3, n).std(axis=1).max() > 1e-2, "the nodes differ, so that links matter"
