"""Expressions and their texts: what a model keeps is what its text says, whatever was given."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import synchain as sc
from synchain.models.inputs.expression_text import FUNCTIONS
from synchain.models.mechanics.expression import exact, read, written

NAMES = {name: sp.Symbol(name, real=True) for name in ("x", "z", "k", "t")}
OF_TWO = ("atan2", "max", "min")


def larger(e: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    """Texts that are made of other texts by an operation, a function or a choice."""
    names, sign = st.sampled_from(sorted(set(FUNCTIONS) - {*OF_TWO})), st.sampled_from("+-*/")
    return st.one_of(
        st.builds("({}) {} ({})".format, e, sign, e),
        st.builds("{} {} {}".format, e, sign, e),
        st.builds("-({})*{}".format, e, e),
        st.builds("({})**({})".format, e, st.sampled_from(["2", "-1", "1/2", "-3/2", "k"])),
        st.builds("{}({})".format, names, e),
        st.builds("{}({}, {})".format, st.sampled_from(OF_TWO), e, e),
        st.builds("({} if {} {} {} else {})".format, e, e, st.sampled_from(["<", ">="]), e, e),
    )


TEXTS = st.recursive(st.sampled_from(["x", "z", "k", "t", "pi", "1", "2", "0.1", "7/3"]), larger, max_leaves=10)


@given(TEXTS)
@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much])
def test_texts_of_models_make_them_again(text: str) -> None:
    try:
        expression = exact("e", text, NAMES)
    except ValueError:
        return  # refused at the definition
    assert read("e", written(expression), NAMES) == expression


@pytest.mark.parametrize(
    "text",
    [
        "cos(x) - (1 - z)*sin(x)",
        "-(1 - z)*(2 - x)*t + x",
        "1/x - (x + z)*k",
        "-(x if z > 0 else k)*t",
        "1 if (x if z > 0 else k) > t else 0",
    ],
)
def test_signs_before_sums(text: str) -> None:
    x, z, k, t = NAMES.values()
    expression = exact("e", text, NAMES)
    assert read("e", written(expression), NAMES) == expression
    point = {x: 0.3, z: -0.7, k: 1.1, t: 0.9}
    value = eval(text, {"x": 0.3, "z": -0.7, "k": 1.1, "t": 0.9, "cos": sp.cos, "sin": sp.sin})
    assert float(expression.subs(point)) == pytest.approx(float(value))


def test_a_model_that_runs_can_be_saved() -> None:
    scene = sc.Scene(sc.Field({"x": "cos(x) - (1 - z)*sin(x)", "z": "1 - z"}), None)
    assert sc.Scene.from_dict(scene.as_dict()) == scene


def test_limits_of_quotients_are_equal_elsewhere() -> None:
    x, k = sp.symbols("x k", real=True)
    for text in (
        "k*x/sqrt(abs(x))",
        "(2*x - 2)**3/abs(1 - x)**1.5",
        "x**2/abs(x)**0.5",
        "x*abs(x)**-1.5",
        "k*x/sqrt(abs(k))",
    ):
        expression = exact("e", text, {"x": x, "k": k})
        for at in (0.3, -0.7, 2.5):
            value = eval(text, {"x": at, "k": -1.7, "sqrt": np.sqrt, "abs": abs})
            assert float(expression.subs({x: at, k: -1.7})) == pytest.approx(value, rel=1e-14), text
