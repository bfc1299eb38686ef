"""Every cell of a random sweep is equal to its own run, in bits, whatever its neighbours are and in which order."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from questions import CYCLE, pair

import synchain as sc

DRIVEN = sc.Field({"x": "v", "v": "-x - x**3 - v/5 + u*cos(w*t)"}, parameters={"u": 0.3, "w": 1.2})
AUTONOMOUS = sc.Scene(
    sc.Field({"x": "m*v", "v": "m*((1 - x**2)*v - x)"}, parameters={"m": 1}),
    None,
    initial={"x": 1.0, "v": 0.2},
    transient=0.0,
    window=3.0,
    time_unit="time",
)
PERIODIC = sc.Scene(DRIVEN, None, initial={"x": 0.5, "v": 0.0}, transient=1.0, window=1.0)


def ends(scene: sc.Scene, **axes: object) -> np.ndarray:
    """End states by the cells of one axis, or of none."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        end = sc.run(scene, show_progress=False, **axes).end
    first = [name for name in axes if name in end.dims]
    return end.transpose(*first, "node", "component").values.reshape(-1, 2 * scene.n)


def expect_own(scene: sc.Scene, name: str, values: list[float], seed: int) -> None:
    """Compare the cells of a sweep, of the shuffled sweep and of single runs."""
    order = np.random.default_rng(seed).permutation(len(values))
    swept = ends(scene, **{name: values})
    shuffled = ends(scene, **{name: [values[k] for k in order]})
    np.testing.assert_array_equal(shuffled, swept[order], err_msg="neighbours change a cell")
    for k, value in enumerate(values):
        np.testing.assert_array_equal(ends(scene, **{name: value})[0], swept[k], err_msg=f"{name} = {value}")


RATES = st.lists(st.floats(-1.0, 1.5).map(lambda e: float(10.0**e)), min_size=2, max_size=6, unique=True)


@settings(deadline=None, max_examples=5, derandomize=True)
@given(values=RATES, seed=st.integers(0, 99))
def test_cells_of_an_autonomous_node(values: list[float], seed: int) -> None:
    expect_own(AUTONOMOUS, "m", values, seed)


@settings(deadline=None, max_examples=5, derandomize=True)
@given(values=st.lists(st.floats(-2.0, 2.0), min_size=2, max_size=6, unique=True), seed=st.integers(0, 99))
def test_cells_of_starts(values: list[float], seed: int) -> None:
    expect_own(AUTONOMOUS, "x_1", values, seed)


@settings(deadline=None, max_examples=5, derandomize=True)
@given(values=RATES, seed=st.integers(0, 99))
def test_cells_of_drives(values: list[float], seed: int) -> None:
    expect_own(PERIODIC, "w", values, seed)


def test_the_default_of_a_swept_parameter_plays_no_part() -> None:
    fast = PERIODIC.replace(parameters={"u": 0.3, "w": 400.0})
    np.testing.assert_array_equal(ends(fast, w=[0.7]), ends(PERIODIC, w=[0.7]))


def other_width(scene: sc.Scene, values: list[float], **keywords: object) -> np.ndarray:
    return sc.run(scene, m=values, show_progress=False, **keywords).end.values


@pytest.mark.long
@pytest.mark.parametrize("text", [{"width": 1}, {"width": 2}, {"width": 8}, {"workers": 1}, {"workers": 3}])
def test_width_and_workers_play_no_part(text: dict[str, int]) -> None:
    values = np.geomspace(0.1, 30.0, 11).tolist()
    np.testing.assert_array_equal(other_width(AUTONOMOUS, values, **text), other_width(AUTONOMOUS, values))


@pytest.mark.long
@pytest.mark.parametrize("name", ["g", "x_2"])
def test_cells_of_a_pair(name: str) -> None:
    expect_own(pair(node=CYCLE), name, [0.01, 0.2, 0.7, 2.5, 9.0], 1)


STEEP = sc.Field(
    {"x": "v", "v": "c*((1 - x**2)*v) - x"},
    parameters={"c": 1.0},
)


@pytest.mark.long
def test_one_stiff_cell_decides_for_no_other() -> None:
    scene = sc.Scene(STEEP, None, initial={"x": 2.0, "v": 0.0}, transient=0.0, window=5.0, time_unit="time")
    expect_own(scene, "c", [0.1, 1.0, 3e4], 3)
