"""Scenes of models without a file: as dictionaries, as TOML files, hostile tables, several kinds of nodes."""

from __future__ import annotations

import copy
import json
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
import sympy as sp
from catalogue import paths
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from synchain import Field, Lagrangian, Parameter, Scene, friction_law, link_energy, load_scene, scene_names
from synchain.graphs import chain, ring, star
from synchain.models.definitions.loader import load_oscillator, read_coupling
from synchain.models.mechanics.contact import ContactModel
from synchain.models.mechanics.oscillator import Oscillator
from synchain.models.scenes.toml import toml

LAW = friction_law("(mu_k + (mu_s - mu_k)*exp(-a*abs(w)))*sign(w)", {"mu_s": 0.3, "mu_k": 0.15, "a": 2.5})
BELT = {"coordinates": ["x"], "parameters": {"N": 2, "belt": 0.1}}
SLIDER = Lagrangian("v**2/2", "x**2/2", {"x": "N*friction(belt - v)"}, friction=LAW, **BELT)
STICKY = Lagrangian("v**2/2", "x**2/2", {"x": "N*friction(belt - v)"}, friction=LAW, contact="set-valued", **BELT)


# -- contacts and laws that the nodes bring ----------------------------------------------------------------------


def test_a_scene_takes_the_law_and_the_contact_of_its_nodes() -> None:
    scene = Scene(STICKY, "spring", chain(2))
    assert scene.friction == LAW
    assert scene.contact == ContactModel.SET_VALUED
    assert scene.components == ("x", "v", "slip")
    assert scene.replace(contact="atan").components == ("x", "v")
    assert scene.replace(friction="coulomb").friction != LAW
    assert scene.replace(oscillator="duffing", parameters={}).contact == ContactModel.ATAN
    assert Scene("friction", topology=chain(2)).contact == ContactModel.ATAN


def test_nodes_of_two_contacts_need_a_word() -> None:
    groups = [{"oscillator": STICKY, "at": [2]}]
    with pytest.raises(ValueError, match="contact: the nodes have 'atan' and 'set-valued'; expected one; give contact"):
        Scene(SLIDER, "spring", chain(2), nodes=groups)
    assert Scene(SLIDER, "spring", chain(2), nodes=groups, contact="atan").contact == ContactModel.ATAN


def test_a_node_without_a_law_needs_one() -> None:
    bare = Lagrangian("v**2/2", 0, {"x": "N*friction(belt - v)"}, **BELT)
    with pytest.raises(ValueError, match="oscillator 'oscillator' has no friction law; known: coulomb"):
        Scene(bare)
    assert Scene(bare, friction="coulomb").friction is not None


# -- scene -> file -> scene --------------------------------------------------------------------------------------

number = st.sampled_from(["1/3", "0.3", "2", "pi/4", "sqrt(2)"])
TERMS = ["{c}*x**2/2", "{c}*x**4/4", "{c}*cos(x - p)", "{c}*p*x", "{c}*x*cos(2*t)", "{c}*abs(x)**3/3", "{c}*exp(-p*x)"]
FORCES = ["-{c}*v", "{c}*p*(1 - x**2)*v", "{c}*sin(t)", "-{c}*v if x > 0 else -p*v", "-{c}*max(v, 0)", "-{c}*tanh(v/p)"]


@st.composite
def lagrangians(draw: st.DrawFn) -> Oscillator:
    def drawn(terms: list[str], about: str) -> str:
        chosen = draw(st.lists(st.sampled_from(terms), min_size=1, max_size=3, unique=True))
        texts = [term.format(c=draw(number)).replace("x", about) for term in chosen]
        return " + ".join(f"({text})" for text in texts).replace(f"e{about}p", "exp").replace(f"ma{about}", "max")

    names = draw(st.sampled_from([("x",), ("x", "y")]))
    speeds = dict(zip(names, ("v",) if len(names) == 1 else ("v_x", "v_y"), strict=True))
    kinetic = " + ".join(f"{draw(number)}*p*{speed}**2/2" for speed in speeds.values())
    potential = " + ".join(drawn(TERMS, name) for name in names)
    forces = {name: drawn(FORCES, name).replace("v", speed) for name, speed in speeds.items() if draw(st.booleans())}
    p = Parameter(draw(st.floats(0.1, 3)), positive=True)
    initial = draw(st.none() | st.just({"x": 0.5}))
    name = draw(st.sampled_from(["oscillator", 'a "b" \\ é', "duffing"]))
    return Lagrangian(kinetic, potential, forces, coordinates=speeds, parameters={"p": p}, initial=initial, name=name)


@st.composite
def fields(draw: st.DrawFn) -> Oscillator:
    size = draw(st.integers(1, 4))
    rates = {f"s{i}": f"-{draw(number)}*s{i} + k*sin(s{(i + 1) % size})**2/({draw(number)} + t)" for i in range(size)}
    return Field(rates, parameters={"k": draw(st.floats(-2, 2))})


@settings(max_examples=20, suppress_health_check=[HealthCheck.too_slow])
@given(st.data())
def test_scene_to_file_and_back(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    node = data.draw(lagrangians() | fields() | st.sampled_from([SLIDER, STICKY]))
    first = node.states[0]
    scene = Scene(
        node,
        "spring" if node.coordinates == ("x",) else f"{first}->{first}",
        data.draw(st.sampled_from([chain(1), chain(2), ring(5)])),
        title=data.draw(st.sampled_from(["", 'of "mine" \\ ü'])),
        axes={f"{first}_1": [0.1, 1e-5]},
        nodes=[{"oscillator": node, "at": [1]}],
    )
    path = tmp_path_factory.mktemp("scene") / "a.toml"
    scene.save(path)
    again = load_scene(path)
    assert again == scene
    assert hash(again) == hash(scene)
    assert again.equations.digest == scene.equations.digest
    assert Scene.from_dict(json.loads(json.dumps(scene.as_dict()))) == scene
    assert tomllib.loads(toml(scene.as_dict())) == scene.as_dict()


@pytest.mark.parametrize("name", scene_names())
def test_a_shipped_scene_is_saved_by_the_names_of_its_parts(name: str, tmp_path: Path) -> None:
    scene = load_scene(name)
    scene.save(tmp_path / "a.toml")
    assert load_scene(tmp_path / "a.toml") == scene
    assert 'oscillator = "' in (tmp_path / "a.toml").read_text("utf-8")


def test_parameters_keep_their_order_in_a_file(tmp_path: Path) -> None:
    """Their order is that of the equations, which the digest of results holds."""
    node = Field({"x": "-c*x + m - z*x**3"}, parameters={"c": 1, "m": Parameter(0.5, minimum=0), "z": 2})
    scene = Scene(node, "x->x", chain(2), transient=0, window=1, time_unit="time")
    scene.save(tmp_path / "scene.toml")
    assert list(load_scene(tmp_path / "scene.toml").oscillator.parameters) == ["c", "m", "z"]


def test_a_contact_without_friction_is_refused() -> None:
    with pytest.raises(ValueError, match="contact: found 'set-valued' and no node with friction"):
        Scene("duffing", contact="set-valued")


def test_a_scene_is_saved_under_a_name_of_toml(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"expected a name that ends in \.toml"):
        Scene().save(tmp_path / "a.json")
    with pytest.raises(ValueError, match=r"scene file: found \d+ bytes; expected at most 1000000"):
        Scene(topology=chain(2), axes={"sigma": [i / 7 for i in range(100_000)]}).save(tmp_path / "a.toml")
    assert not (tmp_path / "a.toml").exists()


@pytest.mark.parametrize("name", ["friction", "belt_double_pendulum", "spring_block"])
def test_a_model_with_scales_is_a_name_or_a_table(name: str) -> None:
    shipped = load_oscillator(name)
    assert Scene(shipped).as_dict()["oscillator"] == name
    scene = Scene(replace(shipped, name="mine"))
    again = Scene.from_dict(json.loads(json.dumps(scene.as_dict())))
    assert again == scene
    assert again.oscillator.source == shipped.source
    assert again.equations.digest == Scene(name).equations.digest


@pytest.mark.parametrize("name", ["spring", "damper", "inerter", "fput", "friction_damper"])
def test_energies_of_links_are_a_name_or_a_table(name: str) -> None:
    shipped = read_coupling(f"{name} on phi")
    assert Scene("double_pendulum", shipped, chain(2)).as_dict()["coupling"] == f"{name} on phi"
    scene = Scene("double_pendulum", replace(shipped, name="mine"), chain(2))
    again = Scene.from_dict(json.loads(json.dumps(scene.as_dict())))
    assert again == scene
    assert again.equations.digest == Scene("double_pendulum", shipped, chain(2)).equations.digest


def test_energies_of_links_in_a_notebook_are_those_of_a_scene_file() -> None:
    q_i, q_j, k, W = sp.symbols("q_i q_j k W")
    spring = link_energy(k * W * (q_i - q_j) ** 2 / 2, parameters={k: 0.3})
    table = {"energies": {"potential": "k*W*(q_i - q_j)**2/2"}, "parameters": {"k": 0.3}}
    scene = Scene("duffing", spring, chain(2))
    assert Scene("duffing", table, chain(2)) == scene
    assert Scene.from_dict(scene.as_dict()) == scene
    assert scene.as_dict()["coupling"]["energies"] == {"potential": "W*k*(q_i - q_j)**2/2"}
    sigma, own = sp.symbols("sigma k", real=True)
    assert scene.equations.edge.rhs[1] == Scene("duffing", "spring", chain(2)).equations.edge.rhs[1].subs(sigma, own)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (
            {"energies": {"V": "W*q_i*q_j"}},
            "coupling: energies: unknown key 'V'; known: potential, dissipation, kinetic",
        ),
        ({"energies": {"potential": True}}, "coupling: energies: potential: found True"),
        ({"energies": {"potential": "W*q_i*q_j"}, "on": "x"}, r"coupling: on: found 'x' \(str\); expected a list"),
        ({"energies": {"potential": "q_i*q_j"}}, "no energy has the weight W of a link"),
        ({"energies": {"potential": "W*q_i*q_j"}, "rates": {}}, "coupling: unknown key 'rates'"),
    ],
)
def test_wrong_energies_of_links_are_refused(table: dict, message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        Scene("duffing", table, chain(2))


def test_a_coupling_between_two_oscillators_without_a_file_is_not_saved() -> None:
    hanging = replace(read_coupling("hanging"), name="mine")
    scene = Scene("clock", nodes=[{"oscillator": "beam", "at": [1]}], coupling=hanging, topology=star(3))
    with pytest.raises(ValueError, match="coupling 'mine': found a coupling between clock and beam and no file"):
        scene.as_dict()


# -- hostile tables ----------------------------------------------------------------------------------------------

TABLE = {
    "coordinates": {"x": "v"},
    "kinetic": "m*v**2/2",
    "potential": "x**2/2 - u*x*cos(t)",
    "forces": {"x": "N*friction(1 - v)"},
    "dissipation": "v**2/100",
    "friction": {
        "force": "mu*sign(w)",
        "static": "mu_s",
        "parameters": {"mu": 0.2, "mu_s": 0.3},
        "order": [["mu", "mu_s"]],
    },
    "contact": "atan",
    "parameters": {"m": {"default": 1, "positive": True}, "u": 0.1, "N": 2},
    "initial": {"x": 0.1},
    "name": "own",
}
ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers(-3, 3) | st.floats() | st.text(max_size=12)
    | st.sampled_from(["x", "v", "9**9**9", "__import__('os')", "x.y", "t", "w", "\x1b[2J", "x if x > 0 else -x", "1/0", "friction(v)"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(["x", "v", "p", "force"]), inner, max_size=3),
    max_leaves=5,
)  # fmt: skip


@settings(max_examples=150)
@given(st.data())
def test_any_mutated_table_is_an_oscillator_or_one_clear_line(data: st.DataObject) -> None:
    tree: dict = copy.deepcopy(TABLE)
    for path in data.draw(st.lists(st.sampled_from(paths(TABLE)[1:]), min_size=1, max_size=2)):
        *inside, last = path
        branch: object = tree
        try:
            for key in inside:
                branch = branch[key]  # type: ignore[index]
            branch[last] = data.draw(ANYTHING)  # type: ignore[index]
        except (LookupError, TypeError):
            pass  # an earlier change removed this place
    try:
        scene = Scene.from_dict({"oscillator": tree})
    except (ValueError, TypeError) as error:
        message = str(error)
        assert 10 < len(message) < 1500, message
        assert message.isprintable(), message
        return
    assert Scene.from_dict(json.loads(json.dumps(scene.as_dict()))) == scene


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"kinetic": "v**2/2"}, "oscillator: 'coordinates' is missing"),
        ({"coordinates": ["x"]}, "oscillator: 'kinetic' is missing"),
        ({"coordinates": "x", "kinetic": "v**2"}, "coordinates: found 'x' \\(str\\)"),
        ({"coordinates": ["x"], "kinetic": True}, "oscillator: kinetic: found True"),
        ({"coordinates": ["x"], "kinetic": "v**2", "rate": 1}, "unknown key 'rate'"),
        ({"rates": {"x": "-x"}, "kinetic": "v**2"}, "unknown key 'kinetic'"),
        ({"rates": {"x": [1]}}, "oscillator: rates: x: found \\[1\\]"),
        ({"rates": {"x": "-x"}, "parameters": {"k": 1}}, "no expression has the parameter 'k'"),
        ({**TABLE, "friction": {"static": "1"}}, "friction: 'force' is missing"),
        ({**TABLE, "friction": {"force": "sign(w)", "order": "ab"}}, "friction: order: found 'ab'"),
        ({**TABLE, "friction": "./law.py"}, "no such file"),
    ],
)
def test_a_wrong_table_is_refused(table: dict, message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        Scene.from_dict({"oscillator": table})


def test_symbols_of_states_serve_expressions() -> None:
    assert STICKY.x - SLIDER.x == 0
    assert STICKY.v == sp.Symbol("v", real=True)
