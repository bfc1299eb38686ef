"""Every function that a model may call, in steps of stages, beside SciPy; series of functions have tests of their own."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import erf, exprel

import synchain as sc
from synchain.models.inputs.expression_text import FUNCTIONS

SMOOTH = (
    "acos(x/9) - acosh(2 + x*x) + asin(x/9) - asinh(3*x) + atan(x) - atanh(x/9) + cos(x) - cosh(x/3) + erf(2*x)"
    " - exp(x/3) + log(3 + x) - sin(x) + sinh(x/4) - sqrt(3 + x) + tan(x/9) - tanh(x) + (3 + x)**(1/3) - 2**x"
    " + (3 + v)**(x/5)"
)
KINKED = "abs(x)*abs(v) + max(x, 0)*x - min(x, v)*v"
ROUGH = "atan2(x, 3 + v) + 0*floor(9 + x/9)*ceiling(x/9 - 9) + 0*sign(9 + x) - 0*max(x, v)"
OTHERWISE = {
    "acos": np.arccos, "acosh": np.arccosh, "asin": np.arcsin, "asinh": np.arcsinh, "atan": np.arctan,
    "atan2": np.arctan2, "atanh": np.arctanh, "abs": abs, "ceiling": np.ceil, "cos": np.cos, "cosh": np.cosh, "erf": erf,
    "exp": np.exp, "floor": np.floor, "log": np.log, "max": max, "min": min, "sign": np.sign, "sin": np.sin,
    "sinh": np.sinh, "sqrt": np.sqrt, "tan": np.tan, "tanh": np.tanh,
}  # fmt: skip


@pytest.mark.parametrize("text", [SMOOTH, f"{KINKED} + {ROUGH}"], ids=["smooth", "rough"])
def test_all_functions_of_models_run(text: str) -> None:
    field = sc.Field({"x": "v", "v": f"-x - v/5 + ({text})/9"}, initial={"x": 0.5, "v": 0.1})
    integrator = "rodas5p" if text == SMOOTH else "auto"
    settings = {"transient": 0.0, "window": 2.0, "time_unit": "time", "rtol": 1e-10, "integrator": integrator}
    result = sc.run(sc.Scene(field, **settings), show_progress=False)

    def rates(t: float, y: np.ndarray) -> list[float]:
        x, v = y
        return [v, -x - v / 5 + eval(text, {**OTHERWISE, "x": x, "v": v}) / 9]

    exact = solve_ivp(rates, (0.0, 2.0), [0.5, 0.1], method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    np.testing.assert_allclose(result.end.values.ravel(), exact, rtol=0.0, atol=1e-8)


def test_angles_of_numbers_run() -> None:
    field = sc.Field({"x": "atan2(1, x) + atan2(0, x) + atan2(x, 0)"}, initial={"x": 0.4})
    settings = {"transient": 0.0, "window": 1.0, "time_unit": "time", "rtol": 1e-10, "integrator": "dop853"}
    result = sc.run(sc.Scene(field, **settings), show_progress=False)
    exact = solve_ivp(lambda _, x: np.arctan2(1, x) + np.pi / 2, (0.0, 1.0), [0.4], rtol=1e-12, atol=1e-13).y[:, -1]
    np.testing.assert_allclose(result.end.values.ravel(), exact, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("integrator", ["taylor", "dop853", "rodas5p"])
def test_functions_without_a_value_by_their_formula_run_from_there(integrator: str) -> None:
    """From 0, where (exp(x) - 1)/x is 0/0, over both ends of its power series; on links as on nodes."""
    node = sc.Field({"x": "-expm1(x)/2 + 9*cos(t) - 3"})
    link = sc.Rates({"x": "W*(1/exprel(x_i) - log1p(x_j**2) + mod(k, 2))"}, {"k": 3.5})
    settings = {"transient": 0.0, "window": 6.0, "time_unit": "time", "rtol": 1e-10, "integrator": integrator}
    settings["initial"] = {"x": 0.0}
    result = sc.run(sc.Scene(node, link, sc.graphs.chain(2), **settings), show_progress=False)

    def rate(t: float, x: np.ndarray) -> np.ndarray:
        return -np.expm1(x) / 2 + 9 * np.cos(t) - 3 + 1 / exprel(x) - np.log1p(x[::-1] ** 2) + 1.5

    solution = solve_ivp(rate, (0.0, 6.0), [0.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-13)
    assert solution.y.min() < -1.0 < 1.0 < solution.y.max()
    np.testing.assert_allclose(result.end.values.ravel(), solution.y[:, -1], rtol=0.0, atol=1e-8)


def test_no_function_is_left_out() -> None:
    called = set(re.findall(r"([a-z0-9]+)\(", f"{SMOOTH} {KINKED} {ROUGH}"))
    assert called == set(FUNCTIONS)


@pytest.mark.parametrize("text", ["v*abs(v)**0.5", "v*abs(v)**q", "sign(v)*abs(v)**q"])
def test_powers_of_sizes_are_numbers_at_rest(text: str) -> None:
    """A node at rest: |v|**q, its derivative, and what is divided by |v| there."""
    q = {"q": 1.5} if "q" in text else {}
    node = sc.Lagrangian("v**2/2", "x**2/2", Q={"x": f"-0.6*{text}"}, coordinates=["x"], parameters=q)
    settings = {"transient": 0.0, "window": 2.0, "time_unit": "time", "rtol": 1e-9, "integrator": "rodas5p"}
    result = sc.run(sc.Scene(node, initial={"x": 0.3, "v": 0.0}, **settings), show_progress=False)

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [y[1], -y[0] - 0.6 * eval(text, {**OTHERWISE, "v": y[1], **q})]

    exact = solve_ivp(rates, (0.0, 2.0), [0.3, 0.0], method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    np.testing.assert_allclose(result.end.values.ravel(), exact, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize(
    "text",
    [
        "v*abs(v)**-0.5",
        "2*v/sqrt(abs(4*v))",
        "v**2*abs(v)**(-3/2)*sign(v)",
        "(v - 0)/sqrt(abs(v))",
        "v*abs(v)**(p - 1)",
    ],
)
def test_quotients_with_a_limit_have_it(text: str) -> None:
    """x/sqrt(|x|) is 0/0 at rest, where sqrt(|x|) sign(x) is 0."""
    p = {"p": 0.5} if "p" in text else {}
    node = sc.Lagrangian("v**2/2", "x**2/2", Q={"x": f"-0.6*{text}"}, coordinates=["x"], parameters=p)
    settings = {"transient": 0.0, "window": 2.0, "time_unit": "time", "rtol": 1e-10, "integrator": "dop853"}
    result = sc.run(sc.Scene(node, initial={"x": 0.3, "v": 0.0}, **settings), show_progress=False)

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [y[1], -y[0] - 0.6 * np.sign(y[1]) * abs(y[1]) ** 0.5]

    exact = solve_ivp(rates, (0.0, 2.0), [0.3, 0.0], method="DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
    np.testing.assert_allclose(result.end.values.ravel(), exact, rtol=0.0, atol=1e-7)
