"""Models of values: parts made in a notebook, names of nodes, what a scene keeps of what it was given."""

from __future__ import annotations

import pickle
from dataclasses import replace

import pytest
import sympy as sp

from synchain import Parameter, Scene
from synchain.graphs import chain
from synchain.models.inputs.frozen import FrozenDict
from synchain.models.inputs.names import NodeName
from synchain.models.interactions.coupling import WEIGHT, LagrangianCoupling, MatrixCoupling
from synchain.models.mechanics.contact import ContactModel
from synchain.models.mechanics.oscillator import FRICTION, Coordinate, FieldModel, LagrangianModel
from synchain.models.networks.layers import as_law, as_oscillator
from synchain.models.networks.model import Model, NodeKind
from synchain.plugins import FrictionLaw, Oscillator

x, v, w, mu, k, sigma, q_i, q_j = sp.symbols("x v w mu k sigma q_i q_j", real=True)
DUMB = LagrangianModel((Coordinate("x", "v"),), v**2 / 2, k * x**2 / 2, (FRICTION(1 - v),))
SLIDER = Oscillator("slider", FrozenDict({"k": Parameter(2.0, "1", "stiffness")}), DUMB)
LAW = FrictionLaw("dry", FrozenDict({"mu": Parameter(0.3, "1", "coefficient", minimum=0)}), mu * sp.sign(w))
ROPE = LagrangianCoupling(
    "rope", FrozenDict({"sigma": Parameter(0.1, "1", "strength")}), sigma * WEIGHT * (q_i - q_j) ** 2 / 2
)


def test_parts_made_by_hand_make_a_scene() -> None:
    scene = Scene(oscillator=SLIDER, friction=LAW, contact="sign", coupling=ROPE, topology=chain(2))
    assert scene.equations.node.rhs == (v, -k * x + mu * sp.sign(1 - v))
    assert scene.equations.edge == Scene(topology=chain(2)).equations.edge
    assert dict(scene.parameters) == {"k": 2.0, "mu": 0.3, "sigma": 0.1}
    assert repr(scene) == "Scene(slider/dry/rope, chain(2))"
    assert pickle.loads(pickle.dumps(scene)) == scene
    assert scene.replace(k=1.0).equations == scene.equations


def test_a_field_made_by_hand_takes_components() -> None:
    rotation = Oscillator(
        "rotation", FrozenDict(), FieldModel(("a", "b"), (-sp.Symbol("b", real=True), sp.Symbol("a", real=True)))
    )
    scene = Scene(oscillator=rotation, coupling="2/4 b->a", topology=chain(3))
    assert scene.coupling == MatrixCoupling.parse("1/2 b->a")
    assert not rotation.takes_friction
    assert rotation.coordinates == ()


def test_equal_contents_are_one_part_and_others_are_not() -> None:
    again = replace(SLIDER, summary="the same, described")
    assert again == SLIDER
    assert hash(again) == hash(SLIDER)
    assert replace(SLIDER, model=replace(DUMB, potential=k * x**4)) != SLIDER
    assert as_oscillator("duffing") == as_oscillator("duffing")
    assert as_law("default", as_oscillator("friction")) == as_law("exponential", SLIDER)
    assert as_law("default", replace(SLIDER, friction=LAW)) == LAW
    assert as_law("default", SLIDER) is None


def test_an_oscillator_and_its_law_go_together() -> None:
    with pytest.raises(ValueError, match="oscillator 'slider' has no friction law; known: coulomb"):
        Scene(oscillator=SLIDER, friction=None)
    with pytest.raises(ValueError, match="oscillator 'duffing' takes no friction law, found 'dry'; leave it out"):
        Scene(oscillator="duffing", friction=LAW)


def test_a_model_knows_the_kind_of_each_node() -> None:
    nodes = [{"oscillator": "harmonic", "at": [2]}]
    model = Scene(oscillator="duffing", nodes=nodes, topology=chain(3)).model
    assert [kind.oscillator.name for kind in model.kinds] == ["duffing", "harmonic"]
    assert model.kind_of == (0, 1, 0)
    assert model.holders("beta") == (0, 2)
    assert model.coordinates == ("x",)
    assert model.node_parameter("beta_3") == NodeName("beta", 2)
    assert model.node_parameter("beta_2") is None
    assert model == pickle.loads(pickle.dumps(model))
    one = Model((NodeKind(as_oscillator("harmonic"), None),), (0, 0), ContactModel.ATAN, ((None, chain(2)),))
    assert dict(one.parameters) == {}


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("x_1", ("x", 0)), ("w_phi_12", ("w_phi", 11)), ("x_0", None), ("x_01", None), ("mu_s", None), ("x", None),
        ("_1", None), ("x_", None), ("x_²", None), ("x_1234567890", None),
    ],
)  # fmt: skip
def test_names_of_nodes(name: str, parts: tuple[str, int] | None) -> None:
    assert NodeName.parse(name) == (None if parts is None else NodeName(*parts))
    assert parts is None or str(NodeName(*parts)) == name


def test_what_was_given_stays_and_what_was_not_follows() -> None:
    """A value that happens to be the default is given all the same."""
    scene = Scene(rtol=1e-6, parameters={"omega": 1.15})
    assert scene.replace(rtol=1e-9).atol == 1e-10
    assert Scene(rtol=1e-6, atol=1e-7).replace(rtol=1e-9).atol == 1e-7
    assert scene.replace(topology=chain(2)).record == ("sync_error",)
    assert Scene(record=()).replace(topology=chain(2)).record == ()
    assert scene.replace(friction="coulomb").parameters["omega"] == 1.15
    assert scene.replace(oscillator="lorenz", parameters=None).time_unit == "time"
    assert Scene(topology=chain(2), initial={"x": 1}).replace(topology=chain(3)).initial["x"] == (1.0, 1.0, 1.0)
