"""Which states are angles, and with what periods: the form of the equations decides."""

from __future__ import annotations

import math
import re

import pytest
import sympy as sp

import synchain as sc
from synchain.models.dynamics.angles import periods_of_kinds, periods_of_states

RATES = {
    "1 + sin(q)/2": 2,
    "cos(2*q)": 1,
    "sin(q/2)**2": 4,
    "sin(2*q) + cos(q/3)": 6,
    "tan(q)": 1,
    "tan(q)*sin(2*q/3)": 3,
    "exp(-cos(q + t/7)) + abs(sin(3*q))": 2,
    "sin(q + sin(q/2))": 4,
    "1 if sin(q) > 1/2 else 0": 2,
    "sin(q - a)": 2,
    "sin(q) + q/1000": None,
    "sin(a*q)": None,
    "sin(q**2)": None,
    "tanh(q)": None,
    "sin(1.5*q)/(2 + q)": None,
    "1 if q > 1/2 else 0": None,
    "a": None,
}
"""Rates of a state q, and its period in units of pi."""


@pytest.mark.parametrize("rate", RATES)
def test_the_form_of_the_rates_decides(rate: str) -> None:
    equations = sc.Scene(
        sc.Field({"q": rate}, parameters={"a": 1} if re.search(r"\ba\b", rate) else {}), None
    ).equations
    ((period,),) = periods_of_kinds(equations)
    assert period == (None if RATES[rate] is None else pytest.approx(RATES[rate] * math.pi))


def test_a_state_that_another_rate_has_bare_is_no_angle() -> None:
    field = sc.Field({"q": "v", "v": "-sin(q)", "x": "q - x"})
    assert periods_of_kinds(sc.Scene(field, None).equations) == ((None, None, None),)


@pytest.mark.parametrize(
    ("push", "period"),
    [("sin(q_j - q_i)", 4), ("sin(q_j/3)", 12), ("q_j - q_i", None), ("sin(q_i)*q_j", None), ("sin(q_j)*q_i", None)],
)
def test_links_decide_by_either_end(push: str, period: int | None) -> None:
    scene = sc.Scene(sc.Field({"q": "sin(q/2)"}), sc.Rates({"q": f"W*({push})"}), sc.graphs.ring(5))
    expected = None if period is None else pytest.approx(period * math.pi)
    assert periods_of_kinds(scene.equations) == ((expected,),)
    assert periods_of_states(scene.equations) == (expected,) * 5


@pytest.mark.parametrize("name", ["pendulum", "double_pendulum"])
def test_shipped_pendulums_turn(name: str) -> None:
    equations = sc.Scene(name, None).equations
    angles = [s for s, period in zip(equations.state, periods_of_states(equations), strict=True) if period]
    bare = {s.name for e in equations.rhs() for s in _outside_of_sines(e)}
    assert angles == [s for s in equations.state if s not in bare]
    assert angles


def _outside_of_sines(e: sp.Basic) -> set[sp.Symbol]:
    """The symbols of an expression outside of its sines and cosines."""
    return e.replace(lambda a: isinstance(a, sp.sin | sp.cos), lambda a: sp.S.One).free_symbols
