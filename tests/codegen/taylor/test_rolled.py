"""Steps of large nodes: loops over series of one kind, with the results of a step that is written out."""

from __future__ import annotations

import numpy as np
import pytest
from plain import Text

import synchain as sc
from synchain.codegen.integrators import integrator
from synchain.codegen.kernels.sweep_kernel import emit
from synchain.codegen.steps.safe_names import tidy
from synchain.codegen.taylor import is_large, order_for, write_rolled
from synchain.models.dynamics.equations import Equations
from synchain.runtime.engines.scene_kernels import kernel_source


def node(*rates: str, **parameters: float) -> Equations:
    """The equations of one node with the states y1, y2, …"""
    field = sc.Field({f"y{k + 1}": rate for k, rate in enumerate(rates)}, parameters=parameters)
    return sc.Scene(field, None, initial=dict.fromkeys(field.states, 1.0)).equations


def bodies(count: int) -> Equations:
    """Stars in a plane."""
    x, y = (lambda i: f"y{2 * i + 1}"), (lambda i: f"y{2 * i + 2}")
    speeds = [f"y{2 * count + k + 1}" for k in range(2 * count)]
    pulls = [
        " + ".join(
            f"{j + 1}*({z(j)} - {z(i)})/(({x(j)} - {x(i)})**2 + ({y(j)} - {y(i)})**2)**(3/2)"
            for j in range(count)
            if j != i
        )
        for i in range(count)
        for z in (x, y)
    ]
    return node(*speeds, *pulls)


NODES = {
    "powers": node("y2**1.5 - y1*y2", "1/(1 + y1**2) - sqrt(y2 + 3)*y1", "y1*y2*y3/(y3**2 + 2)"),
    "functions": node("sin(y2) + exp(-y1**2)", "log(y1 + 4) - tanh(3*y2)", "atan(y1*y2) + cos(y3)*cosh(y3/5)"),
    "parameters": node("a*y2", "-b*sin(y1) - a*y2 + 0.3*cos(w*t)", "a", a=0.3, b=1.7, w=2.0),
    "sigmoids": node("1/(1 + exp(-y2)) - y1", "y1/cosh(y2) - y2*erf(y1)"),
    "choices": node("abs(y2) - y1", "max(y1, 0.3*y2, 1 - y3) - y2", "min(y1, 2*y2) - abs(y3 - y1)*y3"),
    "stars": bodies(3),
    "lines": node("y2", "-y1", "0.5"),
}


@pytest.mark.parametrize("order", [8, 15])
@pytest.mark.parametrize("name", NODES)
def test_loops_have_the_series_of_a_step_that_is_written_out(name, order):
    equations, rng = NODES[name], np.random.default_rng(3)
    rolled, lines = (Text(equations, order, dense=True, rolled=way) for way in (True, False))
    parameter_values = {"a": 0.3, "b": 1.7, "w": 2.0}
    values = [parameter_values[p] for p in equations.parameters]
    for _ in range(5):
        start = np.array([*rng.uniform(0.2, 1.5, equations.dimension), *values])
        ways = [step.step(start, 0.4, 10.0, 0.5, 1e-9, 1e-12) for step in (rolled, lines)]
        np.testing.assert_allclose(*ways, rtol=1e-6)
        np.testing.assert_allclose(rolled.rows[: order - 2], lines.rows[: order - 2], rtol=1e-6, atol=1e-12)
        np.testing.assert_allclose(rolled.state, lines.state, rtol=1e-13)


@pytest.mark.parametrize(
    ("rates", "starts"),
    [
        pytest.param(("1", "sqrt(y1**2 - 2*y1 + 1)"), [(0.5, 0.0)], id="a root beyond its zero is no step"),
        pytest.param(("1", "exp(-y1**2)"), [(-9.0, 0.0), (-6.0, 0.0)], id="a hidden peak ends a step"),
        pytest.param(("1", "exp(-y1)"), [(-3.0, 0.0), (800.0, 0.0)], id="an exponential that is zero"),
        pytest.param(("y2", "abs(y1)"), [(0.0, 1.0), (0.0, -1.0), (0.0, 1.0)], id="sides of an earlier step"),
        pytest.param(("-1", "1", "1/2", "abs(y1 + y2 - y3)"), [(0.1, 0.2, 0.3, 0.0)], id="zero to rounding"),
        pytest.param(
            ("abs(y2) - y1", "max(y1, 0.3*y2, 1 - y3) - y2", "min(y1, 2*y2) - abs(y3 - y1)*y3"),
            [(0.0, 0.0, 1.0), (0.0, 0.1, 0.0), (0.7, 0.7, 0.7)],
            id="several kinks at once",
        ),
    ],
)
def test_steps_end_where_those_that_are_written_out_end(rates, starts):
    rolled, lines = (Text(node(*rates), 12, rolled=way) for way in (True, False))
    for start in starts:
        ways = [step.step(np.array(start), 0.0, 10.0, 0.5, 1e-9, 1e-12) for step in (rolled, lines)]
        np.testing.assert_allclose(*ways, rtol=1e-6)
        np.testing.assert_allclose(rolled.state, lines.state, rtol=1e-12, atol=1e-14)


def test_texts_do_not_grow_with_the_number_of_series():
    texts = [write_rolled(tidy(bodies(count)), 16).text for count in (4, 7)]
    assert len(texts[1]) < 1.1 * len(texts[0])  # 8 states and 18 pairs, 14 and 42
    assert len(texts[1]) < 12_000


def test_large_nodes_are_rolled_and_small_ones_are_written_out():
    assert is_large(bodies(7))
    assert not is_large(bodies(2))
    assert not is_large(sc.Scene("double_pendulum", None).equations)
    assert emit(bodies(7), integrator("taylor", 16)).looped
    assert not emit(bodies(2), integrator("taylor", 16)).looped


def test_large_nodes_have_two_orders():
    field = sc.Field({f"y{k}": f"-y{k} + " + " + ".join(f"sin(y{j} - y{k})" for j in range(9)) for k in range(9)})
    scene = sc.Scene(field, None)
    assert len({kernel_source(scene.replace(rtol=rtol)).code for rtol in (1e-3, 1e-6, 1e-9)}) == 1
    assert {order_for(10.0**-k, 0.0, large=True) for k in range(2, 16)} == {16, 20}
