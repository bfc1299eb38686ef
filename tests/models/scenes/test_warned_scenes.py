"""Scenes whose graph or links leave no synchronous state warn once, where a user makes them."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import pytest

from synchain import Field, Rates, Scene, Topology, chain, from_edges, load_scene, ring

NODE = Field({"x": "-x"})
PAIRS = from_edges([(1, 2), (3, 4)])
VANISHING = Rates({"x": "K*W*(x_j - x_i)"}, {"K": 0.1})
ACTING = Rates({"x": "K*W*tanh(x_j)"}, {"K": 0.1})


def told(made: Callable[[], Scene]) -> list[str]:
    """The warnings while a scene is made, all of them at this file."""
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        made()
    assert all(each.filename == __file__ for each in found)
    return [str(each.message) for each in found]


@pytest.mark.parametrize(
    ("coupling", "graph", "words"),
    [(VANISHING, PAIRS, "is not connected (2 parts)"), (ACTING, chain(4), "does not vanish between oscillators")],
)
def test_a_scene_without_a_synchronous_state_warns_once(coupling: Rates, graph: object, words: str) -> None:
    (sentence,) = told(lambda: Scene(NODE, coupling, graph))  # type: ignore[arg-type]
    assert words in sentence
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
