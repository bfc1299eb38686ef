"""Exact derivatives against differences in fifty digits; the digest; what equations refuse."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import mpmath
import pytest
import sympy as sp
from differences import DIGITS, close, evaluate, made, slopes, states
from effort import effort

from synchain.graphs import from_matrix, topology
from synchain.models.dynamics.equations import Equations
from synchain.models.graphs.links import Link
from synchain.models.mechanics.calculus import derivative
from synchain.models.mechanics.components import TIME, Edge, Node

X, V, W, A, B = (sp.Symbol(name, real=True) for name in ("x", "v", "w", "a", "b"))
ONE = Fraction(1)
HALF = Fraction(1, 2)
HARMONIC = Node((X, V), (V, -X), ())
X_I, V_I, X_J, V_J, WEIGHT, SIGMA = (sp.Symbol(n, real=True) for n in ("x_i", "v_i", "x_j", "v_j", "weight", "sigma"))
SPRING = Edge((X_I, V_I), (X_J, V_J), WEIGHT, (sp.S.Zero, SIGMA * WEIGHT * (X_J - X_I)), (SIGMA,))

MODELS = {
    "paper": made(topology("chain", 3)),
    "sign": made(topology("ring", 3), contact="sign"),
    "stribeck damper": made(topology("star", 4), friction="stribeck", coupling="damper"),
    "coulomb": made(topology("complete", 3), friction="coulomb"),
    "duffing": made(topology("ring", 4), "duffing", None),
    "one-way": made(from_matrix([[-1, 1, 0], [0, "-1/2", "1/2"], [3, 0, -3]])),
    "alone": made(topology("chain", 1), coupling=None),
}


@pytest.fixture(autouse=True)
def fifty_digits():
    with mpmath.workdps(DIGITS):
        yield


# -- derivatives ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("near", [None, 1, -1], ids=["anywhere", "stick, w > 0", "stick, w < 0"])
def test_the_jacobian_is_the_derivative_of_the_right_hand_side(name: str, near: float | None) -> None:
    equations = MODELS[name]
    values = states(equations, 1, near if equations.node.parameters else None)
    entries = equations.jacobian()
    parameter_values = dict(zip(entries, evaluate(list(entries.values()), values), strict=True))
    for column, state in enumerate(equations.state):
        column_values = [parameter_values.get((row, column), mpmath.mpf(0)) for row in range(equations.dimension)]
        assert close(column_values, slopes(equations.rhs(), {sp.Symbol(state, real=True): mpmath.mpf(1)}, values))


@pytest.mark.parametrize("name", MODELS)
def test_the_time_derivative_is_the_derivative_by_time_alone(name: str) -> None:
    equations = MODELS[name]
    values = states(equations, 2)
    parameter_values = evaluate(equations.time_derivative(), values)
    assert close(parameter_values, slopes(equations.rhs(), {TIME: mpmath.mpf(1)}, values))
    assert any(parameter_values) == equations.node.forced


def test_the_stick_slope_is_that_of_a_steep_arcus_tangent() -> None:
    """Inside |w| < 1/kappa the largest entry is of the order -epsilon mu_s (2/pi) kappa: the test states are stiff."""
    equations = MODELS["alone"]
    entry = evaluate([equations.jacobian()[1, 1]], states(equations, 1, 1))[0]
    assert -2 * 0.3 * 1e5 < entry < -1e4


@pytest.mark.parametrize("name", ["paper", "one-way", "stribeck damper"])
def test_links_and_nodes_add_up_to_the_jacobian(name: str) -> None:
    equations = MODELS[name]
    total: dict[tuple[int, int], sp.Expr] = dict(Equations.of_equal_nodes(equations.node, None, equations.n).jacobian())
    shares = list(equations.link_jacobian())
    for key, value in shares:
        total[key] = total.get(key, sp.S.Zero) + value
    assert total == equations.jacobian()
    assert len(shares) == 2 * len(equations.links)


def test_the_links_of_a_one_way_network_reach_their_targets_only() -> None:
    sigma = sp.Symbol("sigma", real=True)
    shares: dict[tuple[int, int], sp.Expr] = {}
    for key, value in MODELS["one-way"].link_jacobian():
        shares[key] = shares.get(key, sp.S.Zero) + value
    expected = [[-1, 1, 0], [0, -sp.S.Half, sp.S.Half], [3, 0, -3]]
    assert shares == {(3 + i, j): sigma * g for i, row in enumerate(expected) for j, g in enumerate(row) if g}


def test_without_links_there_is_no_link_jacobian() -> None:
    assert list(Equations.of_equal_nodes(HARMONIC, SPRING, 2).link_jacobian()) == []
    assert list(Equations.of_equal_nodes(HARMONIC, None, 2).link_jacobian()) == []


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        (sp.Abs(W), sp.sign(W)),
        (sp.sign(W), 0),
        (W * sp.sign(W), sp.sign(W)),
        (sp.exp(-sp.Abs(B - W)), sp.exp(-sp.Abs(B - W)) * sp.sign(B - W)),
        (sp.Abs(A + sp.Abs(W)), sp.sign(A + sp.Abs(W)) * sp.sign(W)),
        (sp.sign(W) * sp.Abs(W) ** 2, 2 * sp.Abs(W)),
        (sp.Abs(W) * sp.Abs(2 * W - 1), sp.sign(W) * sp.Abs(2 * W - 1) + 2 * sp.Abs(W) * sp.sign(2 * W - 1)),
        (sp.Integer(3), 0),
        (B**2, 0),
    ],
)
def test_kinks_are_differentiated_on_either_side(expression: sp.Expr, expected: sp.Expr) -> None:
    slope = derivative(expression, W)
    assert not slope.has(sp.DiracDelta, sp.Derivative)
    for w in (sp.Rational(-3, 7), sp.Rational(2, 9), sp.Rational(5, 2)):
        at = {W: w, A: -sp.Rational(1, 3), B: sp.Rational(1, 5)}
        assert sp.simplify((slope - expected).xreplace(at)) == 0


# -- size ----------------------------------------------------------------------------------------------------


def test_a_large_network_costs_no_algebra() -> None:
    def derived() -> tuple[Equations, str]:
        equations = made(topology("chain", 10_000))
        return equations, equations.digest

    assert made(topology("chain", 3)).digest  # what SymPy has to do for any size
    (equations, digest), calls = effort(derived)
    assert calls < 350_000
    assert (equations.dimension, len(equations.links), len(digest)) == (20_000, 19_998, 64)


def test_states_and_parameters_come_in_a_fixed_order() -> None:
    equations = MODELS["paper"]
    assert equations.state == ("x_1", "x_2", "x_3", "v_1", "v_2", "v_3")
    assert equations.parameters == ("theta_b", "epsilon", "u", "omega", "mu_s", "mu_k", "a", "kappa", "sigma")
    assert Equations.of_equal_nodes(equations.node, equations.edge, 3).parameters == equations.parameters[:-1]
    assert [s.name for s in equations.symbols(2)] == ["x_3", "v_3"]


# -- digest --------------------------------------------------------------------------------------------------

DIGEST = """
from fractions import Fraction
from parts import edge, node
from synchain.models.dynamics.network import network
from synchain.models.presentation.equations_text import as_dict
from synchain.models.graphs.families import topology
from synchain.models.graphs.links import Link
def digests():
    lines = []
    for oscillator, law in (("friction", "stribeck"), ("duffing", None)):
        single = node(oscillator, law, "atan")
        made = network(single, edge("spring", single, oscillator), topology("ring", 3))
        lines.append(f"{made.digest} {as_dict(made)}")
    return "\\n".join(lines)
"""


def test_the_digest_and_the_text_do_not_depend_on_the_hash_seed() -> None:
    there = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, sys.argv[1])\n{DIGEST}\nprint(digests())", str(Path(__file__).parents[2])],
        env={**os.environ, "PYTHONHASHSEED": "77"}, capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    here: dict = {}
    exec(DIGEST, here)
    assert len(there.splitlines()) == 2
    assert there == here["digests"]() + "\n"


def test_different_equations_have_different_digests() -> None:
    chain = Equations.of_equal_nodes(HARMONIC, SPRING, 2, ((0, 1, ONE), (1, 0, ONE)))
    others = [
        *MODELS.values(),
        chain,
        replace(chain, kind_of=(0, 0, 0)),
        network_of(SPRING, ((0, 1, ONE),)),
        network_of(SPRING, ((0, 1, HALF), (1, 0, ONE))),
        replace(chain, layers=chain.layers * 2),
        replace(chain, nodes=(Node((X, V), (V, -2 * X), ()),)),
        replace(chain, nodes=(Node((X, W), (W, -X), ()),)),
        replace(chain, nodes=(Node((X, V), (V, -X), (A,)),)),
        network_of(replace(SPRING, rhs=(sp.S.Zero, SIGMA * WEIGHT * (X_I - X_J))), chain.links),
    ]
    assert len({e.digest for e in others}) == len(others)


def test_equal_equations_have_equal_digests() -> None:
    pair = ((0, 1, ONE), (1, 0, ONE))
    assert network_of(SPRING, pair).digest == made(topology("chain", 2), "harmonic", None).digest
    assert network_of(SPRING).digest == network_of(None).digest  # an edge that joins nothing


def network_of(edge: Edge | None, links: tuple[Link, ...] = ()) -> Equations:
    return Equations.of_equal_nodes(HARMONIC, edge, 2, links)


# -- refusals ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"rhs": (V, -X, X)}, "node: 3 equations for 2 states; expected one each"),
        ({"rhs": (V, -A * X)}, r"node: undeclared symbol 'a' in -a\*x; declare it as a state or parameter"),
        ({"rhs": (V, -0.5 * X)}, "node: floating-point number -0.5.* in .*; use a parameter or a Rational"),
        ({"state": (X, X)}, "node: the name 'x' stands for two things; rename that state or parameter"),
        ({"parameters": (V,)}, "node: the name 'v' stands for two things"),
        ({"parameters": (TIME,)}, "node: the name 't' is the time; rename"),
        ({"rhs": (V, -sp.Symbol("x"))}, "node: undeclared symbol 'x'"),  # complex x is not real x
    ],
)
def test_a_node_refuses(keywords: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Node(**{"state": (X, V), "rhs": (V, -X), "parameters": (), **keywords})


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"there": (X_I, V_J)}, "edge: the name 'x_i' stands for two things"),
        ({"rhs": (sp.S.Zero,)}, "edge: 1 equations for 2 states"),
        ({"rhs": (sp.S.Zero, A * X_I)}, r"edge: undeclared symbol 'a' in a\*x_i"),
        ({"rhs": (sp.S.Zero, X_I * 0.1)}, "edge: floating-point number 0.1"),
        ({"parameters": (WEIGHT,)}, "edge: the name 'weight' stands for two things"),
    ],
)
def test_an_edge_refuses(keywords: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(SPRING, **keywords)


NAMED_LIKE_A_STATE = Node((X, V), (V, -sp.Symbol("x_2", real=True) * X), (sp.Symbol("x_2", real=True),))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((HARMONIC, SPRING, 0), "a network needs at least one node, found n = 0"),
        ((HARMONIC, None, 2, ((0, 1, ONE),)), "1 links but no edge equations; give a coupling"),
        ((Node((X,), (-X,), ()), SPRING, 2), "the edge joins nodes of 2 states, the node has 1"),
        ((HARMONIC, SPRING, 2, ((0, 2, ONE),)), "link 0 <- 2: expected different nodes of 0 … 1"),
        ((HARMONIC, SPRING, 2, ((-1, 0, ONE),)), "link -1 <- 0: expected different nodes of 0 … 1"),
        ((HARMONIC, SPRING, 2, ((1, 1, ONE),)), "link 1 <- 1: expected different nodes of 0 … 1"),
        ((HARMONIC, SPRING, 2, ((0, 1, ONE), (0, 1, HALF))), "link 0 <- 1 occurs twice; add the weights up"),
        ((NAMED_LIKE_A_STATE, None, 2), "the parameter 'x_2' has the name of a state variable; rename it"),
    ],
)
def test_equations_refuse(arguments: tuple, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Equations.of_equal_nodes(*arguments)


def test_a_name_is_taken_only_where_the_network_reaches_it() -> None:
    assert Equations.of_equal_nodes(NAMED_LIKE_A_STATE, None, 1).state == ("x_1", "v_1")
