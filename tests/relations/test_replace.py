"""`replace` and back, in any order of any fields: the scene is equal, its file and its pickle are, and nothing is forgotten."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from questions import CYCLE, PULL

import synchain as sc

SCENE = sc.Scene(CYCLE, PULL, sc.graphs.chain(3), initial={"x": [0.1, 0.2, 0.3], "v": 0.0}, window=5.0, transient=1.0)
OTHER: dict[str, Any] = {
    "title": "other",
    "oscillator": "rossler",
    "coupling": "x->x",
    "topology": sc.graphs.ring(3),
    "parameters": {"g": 0.7},
    "initial": {"x": 2.0, "v": 1.0},
    "record": ("trajectory",),
    "observe": {"o": "mean(x_1)"},
    "section": "x_1 rising",
    "stop": "x_1 - 9",
    "transient": 7.0,
    "window": 3.0,
    "time_unit": "time",
    "samples": 11,
    "integrator": "dop853",
    "rtol": 1e-5,
    "atol": 1e-7,
    "max_steps": 1000,
    "axes": {"g": [0.1, 0.2]},
    "realisations": 2,
    "draws": {"x": "normal(0, 1)"},
    "rng": 5,
}
TOGETHER = {"oscillator", "coupling", "realisations", "draws", "samples", "record"}
"""Fields that need one another; they are changed by themselves below."""


@settings(deadline=None, max_examples=20, derandomize=True)
@given(order=st.permutations(sorted(set(OTHER) - TOGETHER)), count=st.integers(1, 8))
def test_fields_are_replaced_and_put_back(order: list[str], count: int) -> None:
    changed, names = SCENE, order[:count]
    for name in names:
        changed = changed.replace(**{name: OTHER[name]})
    for name in reversed(names):
        changed = changed.replace(**{name: getattr(SCENE, name)})
    assert changed == SCENE


@pytest.mark.parametrize("names", [("realisations", "draws"), ("samples", "record")])
def test_fields_that_need_one_another_are_put_back_together(names: tuple[str, ...]) -> None:
    changed = SCENE.replace(**{name: OTHER[name] for name in names})
    assert changed.replace(**{name: getattr(SCENE, name) for name in names}) == SCENE


@pytest.mark.parametrize("value", [5.0, {"low": 1.0, "high": 2.0, "rng": 3}])
def test_numbers_and_ranges_of_any_number_of_nodes_stay(value: Any) -> None:
    scene = sc.Scene("duffing", topology=sc.graphs.chain(3), initial={"x": value})
    there = scene.replace(topology=sc.graphs.chain(4))
    assert there == sc.Scene("duffing", topology=sc.graphs.chain(4), initial={"x": value})
    assert there.replace(topology=sc.graphs.chain(3)) == scene


def test_a_list_of_another_length_is_refused_in_one_line() -> None:
    with pytest.raises((ValueError, TypeError)) as caught:
        sc.Scene(CYCLE, PULL, sc.graphs.chain(4), initial={"x": [0.1, 0.2, 0.3]})
    assert "\n" not in str(caught.value)


KEPT = [("pickle", lambda scene, path: pickle.loads(pickle.dumps(scene)))]


def through_file(scene: sc.Scene, path: Path) -> sc.Scene:
    scene.save(path / "scene.toml")
    return sc.load_scene(path / "scene.toml")


@pytest.mark.parametrize("name", ["none", *sorted(set(OTHER) - {"realisations", "draws", "coupling"})])
@pytest.mark.parametrize("keep", [*KEPT, ("file", through_file)], ids=lambda pair: pair[0])
def test_a_scene_with_any_field_is_what_was_kept_of_it(name: str, keep: Any, tmp_path: Path, request: Any) -> None:
    changes = {name: OTHER[name]} if name in OTHER else {}
    if name == "oscillator":
        changes |= {"coupling": OTHER["coupling"], "parameters": None, "initial": None}
    if name in ("samples", "record"):
        changes = {both: OTHER[both] for both in ("samples", "record")}
    scene = SCENE.replace(**changes)
    assert keep[1](scene, tmp_path) == scene
