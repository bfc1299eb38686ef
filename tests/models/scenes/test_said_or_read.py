"""What users write otherwise than this package does is read, or refused with a way that works."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest
import sympy as sp
from sympy.codegen.cfunctions import expm1

from synchain import Field, Rates, Scene, chain, from_edges, load_scene, run

x = sp.Symbol("x")
NODE = Field({"x": "-x"})


@pytest.mark.parametrize(
    ("given", "at", "right"),
    [
        (sp.Mod(x, 3), -0.5, 2.5),
        (sp.Piecewise((2, sp.Ne(x, 1)), (5, True)), 1.0, 5.0),
        (sp.Piecewise((2, sp.Eq(x, 1)), (5, True)), 1.0, 2.0),
        (expm1(x), 1e-12, 1.0000000000005e-12),
    ],
    ids=str,
)
def test_functions_of_sympy_are_written_by_others(given: sp.Expr, at: float, right: float) -> None:
    (rate,) = Scene(Field({"x": given}), None).equations.node.rhs
    (state,) = rate.free_symbols
    assert sp.lambdify(state, rate)(at) == pytest.approx(right, rel=1e-15)


def test_a_remainder_runs() -> None:
    start = {"transient": 0.0, "window": 1.0, "initial": {"x": 0.25}, "record": ()}
    end = run(Scene(Field({"x": sp.Mod(x, 1)}), None, **start)).end  # type: ignore[arg-type]
    assert float(end.squeeze()) == pytest.approx(0.25 * math.e, rel=1e-8)


def test_eigenvalues_are_floats() -> None:
    assert [float(e) for e in chain(3).spectrum] == [0.0, -1.0, -3.0]


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (lambda: Rates({"x": "lambda*W*(x_j - x_i)"}, {}), "'lambda' is a word of Python"),
        (lambda: Scene(Field({"x": "-sigma*x"}, parameters={"sigma": 1}), "x->x", chain(2)), "Rates("),
        (lambda: Scene("duffing", links=[("spring", chain(3)), ("damper", chain(3))]), "Rates("),
        (lambda: from_edges([(1, 1), (1, 2)]), "to the rates of the node"),
    ],
)
def test_refusals_say_what_to_do(made: Callable[[], Any], words: str) -> None:
    with pytest.raises((ValueError, TypeError)) as caught:
        made()
    assert words in str(caught.value)


@pytest.mark.parametrize(
    "made",
    [
        lambda name: Scene(NODE, None, **{name: 1}),
        lambda name: Field({"x": name}),
        lambda name: Field({"x": sp.Symbol(name)}),
        load_scene,
    ],
)
def test_messages_are_short_for_long_names(made: Callable[[str], Any]) -> None:
    with pytest.raises((ValueError, TypeError)) as caught:
        made("q" * 9000)
    assert len(str(caught.value)) < 1000
