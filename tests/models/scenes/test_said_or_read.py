"""What users write otherwise than this package does is read, or refused with a way that works."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy import special
from sympy.codegen.cfunctions import expm1, log1p

from synchain import Field, Potential, Rates, Scene, exprel, load_scene, run
from synchain.graphs import chain, from_edges

x = sp.Symbol("x")
NODE = Field({"x": "-x"})


def _rate_of(field: Any) -> tuple[sp.Symbol, sp.Expr]:
    node = Scene(field, None).equations.node
    return node.state[0], node.rhs[0]


@pytest.mark.parametrize(
    ("expression", "at", "right"),
    [
        (sp.Mod(x, 3), -0.5, 2.5),
        (sp.Piecewise((2, sp.Ne(x, 1)), (5, True)), 1.0, 5.0),
        (sp.Piecewise((2, sp.Eq(x, 1)), (5, True)), 1.0, 2.0),
        (expm1(x), 1e-12, 1.0000000000005e-12),
        (log1p(x), 1e-12, 9.999999999995e-13),
        (exprel(x), 0.0, 1.0),
        ("x % 3 + (2 if x != 1 else 5)", -0.5, 4.5),
        ("mod(x, 3) + (2 if x == 1 else 5)", 1.0, 3.0),
    ],
    ids=str,
)
def test_other_functions_are_written_by_those_of_kernels(expression: sp.Expr | str, at: float, right: float) -> None:
    assert sp.lambdify(*_rate_of(Field({"x": expression})))(at) == pytest.approx(right, rel=1e-15)


@pytest.mark.parametrize("name", ["expm1", "exprel", "log1p"])
def test_functions_near_zero_have_all_digits(name: str) -> None:
    f, exact = sp.lambdify(*_rate_of(Field({"x": f"{name}(x)"}))), getattr(special, name)
    small = 10.0 ** np.arange(-300.0, 0.0, 7.0)
    places = [0.0, 1.0, -0.999, 2.54, 30.0, 700.0, *small, *-small, *np.linspace(-0.99, 3.0, 100)]
    places += [] if name == "log1p" else [-1.0, -40.0, -1e5]
    for at in places:
        assert f(at) == pytest.approx(float(exact(at)), rel=1e-15, abs=0.0), at


def test_a_remainder_runs() -> None:
    start = {"transient": 0.0, "window": 1.0, "initial": {"x": 0.25}, "record": ()}
    end = run(Scene(Field({"x": sp.Mod(x, 1)}), None, **start)).end  # type: ignore[arg-type]
    assert float(end.squeeze()) == pytest.approx(0.25 * math.e, rel=1e-8)


def test_eigenvalues_are_floats() -> None:
    assert [float(e) for e in chain(3).spectrum] == [0.0, -1.0, -3.0]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Rates({"x": "lambda*W*(x_j - x_i)"}, {}), "'lambda' is a word of Python"),
        (
            lambda: Scene(Field({"x": "-sigma*x"}, parameters={"sigma": 1}), "x->x", chain(2)),
            "write Rates({'x': 'k*W*(x_j - x_i)'}, {'k': 1})",
        ),
        (
            lambda: Scene("duffing", links=[("spring", chain(3)), ("damper", chain(3))]),
            "write Rates({'v': 'k*W*(v_j - v_i)'}",
        ),
        (
            lambda: Scene("duffing", links=[("damper", chain(3)), ("spring", chain(3))]),
            "write Potential('k*W*(x_j - x_i)**2/2'",
        ),
        (lambda: from_edges([(1, 1), (1, 2)]), "to the rates of the node"),
    ],
)
def test_refusals_say_what_to_do(make: Callable[[], Any], message: str) -> None:
    with pytest.raises((ValueError, TypeError)) as caught:
        make()
    assert message in str(caught.value)


@pytest.mark.parametrize(
    "make",
    [
        lambda name: Scene(NODE, None, **{name: 1}),
        lambda name: Field({"x": name}),
        lambda name: Field({"x": sp.Symbol(name)}),
        load_scene,
    ],
)
def test_messages_are_short_for_long_names(make: Callable[[str], Any]) -> None:
    with pytest.raises((ValueError, TypeError)) as caught:
        make("q" * 9000)
    assert len(str(caught.value)) < 1000


@pytest.mark.parametrize(
    ("node", "coupling", "other"),
    [
        ("duffing", "spring", Potential("k*W*(x_j - x_i)**2/2", {"k": 1})),
        ("duffing", "damper", Rates({"v": "k*W*(v_j - v_i)"}, {"k": 1})),
        ("rossler", "x->x, 1/2 y->x", Rates({"x": "k*W*(x_j - x_i) + k*1/2*W*(y_j - y_i)"}, {"k": 1})),
    ],
)
def test_couplings_with_a_free_name_are_those_that_are_shipped(node: str, coupling: str, other: Any) -> None:
    sigma, k = sp.symbols("sigma k", real=True)
    rates = Scene(node, coupling, chain(2)).equations.edge.rhs  # type: ignore[union-attr]
    renamed = Scene(node, other, chain(2)).equations.edge.rhs  # type: ignore[union-attr]
    assert all(sp.expand(a - b.xreplace({k: sigma})) == 0 for a, b in zip(rates, renamed, strict=True))
