"""Scenes whose graph or links leave no synchronous state warn once, where a user makes them."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import pytest

from synchain import Field, Lagrangian, Rates, Scene, load_scene, scene_names
from synchain.graphs import Topology, chain, from_edges, ring

NODE = Field({"x": "-x"})
PAIRS = from_edges([(1, 2), (3, 4)])
VANISHING = Rates({"x": "K*W*(x_j - x_i)"}, {"K": 0.1})
ACTING = Rates({"x": "K*W*tanh(x_j)"}, {"K": 0.1})


def told(make: Callable[[], Scene]) -> list[str]:
    """The warnings while a scene is made, all of them at this file."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        make()
    assert all(each.filename == __file__ for each in caught)
    return [str(each.message) for each in caught]


@pytest.mark.parametrize(
    ("coupling", "graph", "message"),
    [(VANISHING, PAIRS, "is not connected (2 parts)"), (ACTING, chain(4), "does not vanish between oscillators")],
)
def test_a_scene_without_a_synchronous_state_warns_once(coupling: Rates, graph: object, message: str) -> None:
    (sentence,) = told(lambda: Scene(NODE, coupling, graph))  # type: ignore[arg-type]
    assert message in sentence
    assert told(lambda: Scene(NODE, VANISHING, ring(4)).replace(coupling=coupling, topology=graph)) == [sentence]


def test_files_warn_and_changes_of_numbers_do_not(tmp_path: Path) -> None:
    with pytest.warns(RuntimeWarning, match="2 parts"):
        scene = Scene(NODE, VANISHING, PAIRS)
    assert told(lambda: scene.replace(rtol=1e-6).replace(K=0.2)) == []
    scene.save(tmp_path / "pairs.toml")
    assert len(told(lambda: load_scene(tmp_path / "pairs.toml"))) == 1


def test_scenes_that_record_no_error_do_not_warn() -> None:
    assert told(lambda: Scene(NODE, VANISHING, PAIRS, record=())) == []
    assert told(lambda: Scene(NODE, ACTING, ring(4))) == []  # equal sums of weights: there is a synchronous motion


def belt(size: float, contact: str = "atan", speed: str = "vb") -> Scene:
    """A block on a belt, all lengths in units of `size`."""
    node = Lagrangian(
        "v**2/2", "x**2/2", {"x": f"N*friction({speed} - v)"}, coordinates={"x": "v"}, friction="coulomb",
        parameters={"N": size, "vb": 0.5 * size},
    )  # fmt: skip
    return Scene(node, contact=contact, record=())


def test_smoothed_friction_that_a_slow_belt_does_not_resolve_warns() -> None:
    (sentence,) = told(lambda: belt(1e-6))
    assert sentence in belt(1e-6).warnings
    assert "kappa * speed of the belt = 0.05; expected at least about 100" in sentence
    assert told(lambda: belt(1.0)) == told(lambda: belt(1e-6, "set-valued")) == []
    assert told(lambda: belt(1e-6, speed="vb*sin(x)")) == told(lambda: belt(1e-6, speed="vb*cos(t)")) == []


@pytest.mark.parametrize(
    "change",
    [
        {"theta_b": 1e-5},
        {"kappa": 10.0},
        {"parameters": {"theta_b": [0.1, -1e-5]}},
        {"axes": {"theta_b": [0.0, 1e-5]}},
        {"axes": {"kappa": [1e5, 10.0]}},
    ],
)
def test_numbers_that_leave_smoothed_friction_unresolved_warn_once(change: dict[str, object]) -> None:
    scene = Scene("friction", "spring", chain(2))
    (sentence,) = told(lambda: scene.replace(record=(), **change))
    assert "kappa * speed of the belt = 1;" in sentence
    with pytest.warns(RuntimeWarning):
        again = scene.replace(record=(), **change)
    assert told(lambda: again.replace(rtol=1e-6)) == []


def test_shipped_scenes_resolve_their_friction() -> None:
    assert [name for name in scene_names() if "smoothed" in " ".join(load_scene(name).warnings)] == []


@pytest.mark.parametrize("text", ["K*tanh(W*x_j)", "K*exp(-1 - W*x_j)", "K*tanh(2*W*x_j + 1)"])
def test_a_function_of_single_inputs_warns(text: str) -> None:
    link = Rates({"x": text}, {"K": 0.1})
    (sentence,) = told(lambda: Scene(NODE, link, ring(4)))
    assert "the sum of inputs is another model" in sentence
    assert (
        told(lambda: Scene(NODE, link, Topology("one_way", 3, ((1, 0, Fraction(1)), (2, 1, Fraction(1)))), record=()))
        == []
    )


@pytest.mark.parametrize("text", ["K*W*tanh(x_j)", "K*tanh(W*(x_j - x_i))", "K*sin(x_j - W)"])
def test_functions_of_other_things_do_not_warn(text: str) -> None:
    assert told(lambda: Scene(NODE, Rates({"x": text}, {"K": 0.1}), ring(4), record=())) == []
