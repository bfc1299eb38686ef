"""Printing and parsing are inverse: text -> scene -> file -> scene, and text -> SymPy -> text, over random rates."""

from __future__ import annotations

import pickle
import re
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import synchain as sc

NUMBERS = st.sampled_from(["1", "2", "3/7", "0.1", "1.5", "-2", "10", "1e-3"])
NAMES = st.sampled_from(["x", "z", "a", "t"])
ATOMS = NUMBERS | NAMES
ONE = ("sin", "cos", "tanh", "exp", "abs", "atan", "sign", "floor", "sqrt")


def deeper(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    pairs = st.tuples(inner, st.sampled_from(["+", "-", "*"]), inner).map(lambda p: f"({p[0]}) {p[1]} ({p[2]})")
    bare = st.tuples(inner, st.sampled_from([" + ", " - ", "*"]), inner).map("".join)
    quotients = st.tuples(inner, ATOMS).map(lambda p: f"({p[0]})/(2 + ({p[1]})**2)")
    powers = st.tuples(inner, st.sampled_from(["2", "3", "(-1)", "(1/2)"])).map(lambda p: f"(({p[0]})**2 + 1)**{p[1]}")
    calls = st.tuples(st.sampled_from(ONE), inner).map(
        lambda p: f"{p[0]}(({p[1]})**2)" if p[0] == "sqrt" else f"{p[0]}({p[1]})"
    )
    extremes = st.tuples(st.sampled_from(["min", "max"]), inner, inner).map(lambda p: f"{p[0]}({p[1]}, {p[2]})")
    choices = st.tuples(inner, inner, inner).map(lambda p: f"({p[0]} if {p[1]} > 0 else {p[2]})")
    return pairs | bare | quotients | powers | calls | extremes | choices


TEXTS = st.recursive(ATOMS, deeper, max_leaves=4)


def scene_of(first: str, second: str) -> sc.Scene | None:
    """The scene of two rates, or None if the reader refuses them."""
    names = set(re.findall(r"[a-z]+", first + second))
    try:
        node = sc.Field({"x": first, "z": second}, parameters={"a": 0.5} if "a" in names else {})
        return sc.Scene(node, None, initial={"x": 0.3, "z": 0.2})
    except (ValueError, TypeError):
        return None


def kept(scene: sc.Scene) -> sc.Scene:
    with TemporaryDirectory() as folder:
        scene.save(Path(folder) / "scene.toml")
        return sc.load_scene(Path(folder) / "scene.toml")


def check(first: str, second: str) -> None:
    scene = scene_of(first, second)
    if scene is None:
        return
    assert kept(scene) == scene
    assert kept(scene).equations == scene.equations
    assert pickle.loads(pickle.dumps(scene)) == scene
    assert kept(kept(scene)) == scene


@settings(deadline=None, max_examples=10, derandomize=True)
@given(first=TEXTS, second=TEXTS)
@example("cos(z)*x", "1 - z")
def test_a_scene_of_random_text_is_its_file(first: str, second: str) -> None:
    check(first, second)


@pytest.mark.long
@settings(deadline=None, max_examples=500)
@given(first=TEXTS, second=TEXTS)
def test_scenes_of_many_random_texts_are_their_files(first: str, second: str) -> None:
    check(first, second)


@pytest.mark.parametrize(("first", "second"), [("cos(x) - (1 - z)*sin(x)", "1 - z"), ("exp(x) - (x - z)*exp(z)", "z")])
def test_differences_with_a_product_of_a_difference(first: str, second: str) -> None:
    check(first, second)
