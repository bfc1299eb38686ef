"""Passages of a function that the ends of a step do not show, and layers far from the state."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

import synchain as sc

x_1 = sp.Symbol("x_1")
CIRCLE = sc.Scene(
    sc.Field({"x": "y", "y": "-x"}), initial={"x": [0.0], "y": [1.0]}, transient=0, window=50, time_unit="time",
    record=("trajectory",), samples=2, observe={"height": sc.observe.end(sp.Symbol("x"))}, rtol=1e-10,
)  # fmt: skip
"""Its stops, sections and records are those of test_stop: the tests share drivers."""
METHODS = [("taylor", 1), ("dop853", 4)]
NEAR, FAR = 0.999, -0.95
NEARBY = {"near": sc.Section(x_1 - NEAR, "both"), "far": sc.Section(x_1 - FAR, "rising")}


@pytest.mark.parametrize(("integrator", "width"), METHODS)
def test_sections_near_an_extremum_have_all_their_points(integrator: str, width: int) -> None:
    circle = CIRCLE.replace(integrator=integrator, sections=NEARBY, stop=x_1 - 2)
    data = sc.run(circle, show_progress=False, width=width).data
    turns = 2 * math.pi * np.arange(8)
    near = np.sort(np.concatenate([math.asin(NEAR) + turns, math.pi - math.asin(NEAR) + turns]))
    far = 2 * math.pi + math.asin(FAR) + turns
    for name, times in (("near", near), ("far", far[far < 50])):
        assert int(data[f"{name}_count"]) == len(times)
        np.testing.assert_allclose(data[f"{name}_time"].values[: len(times)], times, rtol=0, atol=1e-7)


@pytest.mark.parametrize(("integrator", "width"), METHODS)
def test_a_stop_near_an_extremum_ends_its_cell_the_first_time(integrator: str, width: int) -> None:
    circle = CIRCLE.replace(integrator=integrator, sections=NEARBY, stop=x_1 - NEAR)
    result = sc.run(circle, show_progress=False, width=width)
    np.testing.assert_allclose(result.states(), [NEAR, math.sqrt(1 - NEAR**2)], rtol=0, atol=1e-9)


PASSAGES = {
    "often": "sin(20*t) + x_1/2", "half": "sqrt(x_1) - 1/2", "kink": "abs(x_1 - 1/10) - 1/50", "cusp": "sqrt(abs(x_1 - 1/7)) - 1/50",
    "bell": "exp(-50*(x_1 - 3/10)**2) - 1/2", "jump": "floor(3*x_1) + 1/2", "touch": "(x_1 - 1/2)**2 - 1e-6",
    "edge": "sqrt(x_1**2 - 1/100) - 1/100", "pole": "1/x_1", "poles": "tan(2*x_1)",
}  # fmt: skip
"""Functions that pass zero often, beside places where they have no value, twice in a short time, or at no pole."""


@functools.cache
def passages(function: str, last: float) -> np.ndarray:
    """Where a function of x = sin t changes its sign, from its values at very many times; poles are left out."""
    t = np.linspace(0.0, last, 3_000_001)
    with np.errstate(all="ignore"):
        values = sp.lambdify((sp.Symbol("t"), x_1), sp.sympify(function), "numpy")(t, np.sin(t))
        small = np.maximum(abs(values[1:]), abs(values[:-1])) < 50
    return t[1:][(values[:-1] * values[1:] < 0) & small]


@pytest.mark.parametrize(("integrator", "width"), METHODS)
def test_no_passage_is_missed_inside_a_step(integrator: str, width: int) -> None:
    sections = {name: sc.Section(function, "both", keep="x") for name, function in PASSAGES.items()}
    data = sc.run(CIRCLE.replace(integrator=integrator, sections=sections), show_progress=False, width=width).data
    for name, function in PASSAGES.items():
        expected = passages(function, 50)
        assert int(data[f"{name}_count"]) == len(expected), name
        np.testing.assert_allclose(data[f"{name}_time"].values[: len(expected)], expected, rtol=0, atol=2e-5)


@pytest.mark.parametrize(("integrator", "width"), METHODS)
@pytest.mark.parametrize("name", ["half", "kink", "touch"])
def test_a_stop_is_the_first_passage(integrator: str, width: int, name: str) -> None:
    circle = CIRCLE.replace(integrator=integrator, stop=PASSAGES[name])
    result = sc.run(circle, show_progress=False, width=width)
    assert float(result.end_time) == pytest.approx(passages(PASSAGES[name], 5)[0], abs=2e-6)


@pytest.mark.parametrize(("integrator", "width"), METHODS)
def test_rounding_is_no_passage(integrator: str, width: int) -> None:
    """Two oscillators with one start: what is zero for ever, but for rounding, passes nothing and stops nothing."""
    zeros = [
        "10*(x_1 - x_2)", "x_1**2 + v_1**2 - x_2**2 - v_2**2", "exp(x_1)*exp(-x_2) - 1", "sin(x_1)**2 + cos(x_1)**2 - 1",
        "1e8*nodes.std(x)", "x_1 + v_1 - x_2 - v_2",
    ]  # fmt: skip
    pair = sc.Scene(
        "van_der_pol", "spring", sc.graphs.chain(2), initial={"x": 1.0, "v": 0.0}, parameters={"sigma": 0.3}, transient=0, window=50,
        time_unit="time", record=(), integrator=integrator, stop="v_1 - v_2 - 3/10*(x_1 - x_2)",
        sections={f"s{k}": sc.Section(function, "both", keep="x") for k, function in enumerate(zeros)},
    )  # fmt: skip
    data = sc.run(pair, show_progress=False, width=width, reduce=False).data
    assert [int(data[f"s{k}_count"]) for k in range(len(zeros))] == [0] * len(zeros)
    assert float(data.end_time) == 50.0
    apart = sc.run(pair, show_progress=False, width=width, reduce=False, x_2=1.2).data
    assert int(apart.s0_count) > 0
    assert float(apart.end_time) < 50.0


@pytest.mark.parametrize(("integrator", "width"), METHODS)
def test_a_stretch_of_zeros_is_passed_where_it_begins(integrator: str, width: int) -> None:
    """A function that comes to zero and stays passes there, once; one that leaves zero does not."""
    functions = {
        "stairs": ("floor(t) - 3", [3.0]), "edge": ("min(t - 3, 0)", [3.0]), "above": ("max(x_1, 0)", [math.pi, 3 * math.pi]),
        "tenths": ("floor(10*x_1)", [math.pi - math.asin(0.1), 2 * math.pi, 3 * math.pi - math.asin(0.1)]),
    }  # fmt: skip
    sections = {name: sc.Section(function, "both", keep="x") for name, (function, _) in functions.items()}
    circle = CIRCLE.replace(integrator=integrator, sections=sections, window=10, rtol=1e-12, stop="x_1 - 2")
    data = sc.run(circle, show_progress=False, width=width).data
    for name, (_, times) in functions.items():
        found = data[f"{name}_time"].values[: int(data[f"{name}_count"])]
        np.testing.assert_allclose(found, times, rtol=0, atol=1e-10, err_msg=name)


@pytest.mark.parametrize("steepness", [5, 20, 100])
def test_a_layer_that_is_saturated_now_is_not_stepped_over(steepness: int) -> None:
    """In double precision tanh is 1 and its slope 0 when |v| > 19/steepness: a mass with steep friction crosses v = 0."""
    node = sc.Lagrangian(
        "v**2/2", "x**2/2", {"x": "-3*tanh(s*v)/10 - v/10 + cos(t)"}, coordinates=["x"], parameters={"s": 1}
    )  # fmt: skip
    scene = sc.Scene(
        node, initial={"x": 0.5, "v": 0.0}, transient=0, window=20, time_unit="time", record=(), rtol=1e-9,
        integrator="taylor", parameters={"s": steepness},
    )  # fmt: skip
    states = sc.run(scene, show_progress=False).states()

    def rates(t: float, state: np.ndarray) -> list[float]:
        return [state[1], -state[0] - 0.3 * math.tanh(steepness * state[1]) - 0.1 * state[1] + math.cos(t)]

    expected = solve_ivp(rates, (0, 20), [0.5, 0.0], "DOP853", rtol=1e-12, atol=1e-13, max_step=0.01).y[:, -1]
    np.testing.assert_allclose(states, expected, rtol=0, atol=2e-7)
