"""What runs how often, and names: nothing is computed twice, and no name of the user meets one of ours."""

from __future__ import annotations

import ast
import functools
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from samples import CASES, FLOATS, TABLE, Interpreted, friction_chain, path, real, take_step
from sympy.functions.elementary.piecewise import ExprCondPair

from synchain.codegen import integrators
from synchain.codegen.kernels.observable_functions import Recording
from synchain.codegen.kernels.sweep_kernel import emit
from synchain.codegen.program.passes import Hoist, Names, StraightLine
from synchain.codegen.steps.blocks import analyse
from synchain.codegen.steps.safe_names import RESERVED, tidy
from synchain.codegen.steps.sparse_plan import sparse_plan
from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME, Edge, Node

x, v, a, b, omega = real("x", "v", "a", "b", "omega")


def blocks_of(node: Node):
    return analyse(node, Names([s.name for s in (*node.state, *node.parameters)]))


# -- hoisting ------------------------------------------------------------------------------------------------


def parameter_work(e: sp.Expr, moving: set[sp.Symbol]) -> list[sp.Expr]:
    """Parts of an expression, more than a symbol or its sign, that do not move."""
    if e.is_Symbol or not e.free_symbols:
        return []
    if isinstance(e, ExprCondPair):
        return [part for argument in e.args for part in parameter_work(argument, moving)]
    if not e.free_symbols & moving:
        return [] if e == -next(iter(e.free_symbols)) else [e]
    work = [part for argument in e.args for part in parameter_work(argument, moving)]
    if e.is_Add or e.is_Mul:
        still = [arg for arg in e.args if arg.free_symbols and not arg.free_symbols & moving]
        if len(still) > 1:
            work.append(e.func(*still))
    return work


@pytest.mark.parametrize("case", CASES)
def test_node_functions_do_no_work_that_could_be_done_once(case):
    node = CASES[case].node
    blocks = blocks_of(node)
    for body in (blocks.rhs, blocks.linear):
        moving = set(node.state) | {s for s, _ in body.statements}
        for e in (*(e for _, e in body.statements), *body.results):
            assert parameter_work(e, moving) == [], e
            assert TIME not in e.free_symbols
    for _, e in blocks.constants:
        assert e.free_symbols <= set(node.parameters)
    for _, e in blocks.timed:
        assert parameter_work(e, {TIME}) == [] or e.free_symbols <= {TIME, *node.parameters}
        assert TIME in e.free_symbols


@pytest.mark.parametrize("case", CASES)
def test_blocks_put_together_are_the_equations(case):
    node = CASES[case].node
    blocks = blocks_of(node)
    outer = dict(blocks.constants)
    outer |= {s: e.xreplace(outer) for s, e in blocks.timed}

    def whole(body: StraightLine) -> list[sp.Expr]:
        values_by_name = dict(outer)
        for s, e in body.statements:
            values_by_name[s] = e.xreplace(values_by_name)
        return [e.xreplace(values_by_name) for e in body.results]

    entries = [e for row in node.jacobian() for e in row]
    everything = (*node.rhs, *entries, *node.time_derivative())
    for rates, expected in ((whole(blocks.rhs), node.rhs), (whole(blocks.linear), everything)):
        assert len(rates) == len(expected)
        dice = np.random.default_rng(3)
        symbols = [TIME, *node.state, *node.parameters]
        for values in dice.uniform(0.3, 1.4, (4, len(symbols))):
            parameter_values = dict(zip(symbols, map(sp.Float, values), strict=True))
            for p, q in zip(rates, expected, strict=True):
                assert abs(p.xreplace(parameter_values).evalf() - q.xreplace(parameter_values).evalf()) < 1e-9


def test_time_by_itself_moves_from_stage_to_stage():
    blocks = blocks_of(Node((x, v), (v, TIME - x * TIME), ()))
    assert [e for _, e in blocks.timed] == [TIME]
    assert TIME not in blocks.rhs.symbols


def test_equal_parts_are_computed_once():
    blocks = blocks_of(Node((x, v), (sp.exp(a * b) * x, sp.exp(a * b) * v + sp.sin(x * v)), (a, b)))
    assert [e for _, e in blocks.constants] == [sp.exp(a * b)]
    parts = [*(e for _, e in blocks.linear.statements), *blocks.linear.results]
    assert sum(e.count(sp.sin) for e in parts) == sum(e.count(sp.cos) for e in parts) == 1


def test_a_sign_makes_no_second_name():
    hoist = Hoist(frozenset({x}), Names([]).fresh("p"))
    first, second = hoist.apply(a * b * sp.sin(x)), hoist.apply(-a * b * sp.cos(x))
    assert len(hoist.table) == 1
    assert first.xreplace({s: e for e, s in hoist.table.items()}) == a * b * sp.sin(x)
    assert second.xreplace({s: e for e, s in hoist.table.items()}) == -a * b * sp.cos(x)


def test_conditions_on_parameters_and_fixed_branches_are_computed_once():
    choice = sp.Piecewise((-a * b, (x > a + b) | (a > b)), (a * x, a > b), (sp.cos(omega * TIME), True))
    blocks = blocks_of(Node((x, v), (choice, -v), (a, b, omega)))
    fixed = {e for _, e in blocks.constants}
    assert {a > b, a + b} <= fixed
    assert sp.cos in {e.func for _, e in blocks.timed}
    moving = [*(e for _, e in blocks.rhs.statements), *blocks.rhs.results]
    assert not any(e.has(a > b) or {a + b, a * b, TIME} & set(sp.preorder_traversal(e)) for e in moving)


def test_names_avoid_those_that_are_taken():
    names = Names(["p0", "p2"])
    supply = names.fresh("p")
    assert [next(supply).name for _ in range(3)] == ["p1", "p3", "p4"]
    assert next(names.fresh("p")).name == "p5"


def test_constants_are_computed_before_the_stages():
    text = emit(friction_chain(2), "rodas5p", Recording(("sync_error",)), width=1).text
    step = ast.parse(text[text.index("def step") :].strip().split("\n\n\n")[0])
    names = [
        s.targets[0].id for s in ast.walk(step) if isinstance(s, ast.Assign) and isinstance(s.targets[0], ast.Name)
    ]
    parameters = [n for n in names if n.startswith("p") and n[1:].isdigit()]
    assert len(parameters) == len(set(parameters)) > 3
    times = {c for c in integrators.integrator("rodas5p").c if c}
    assert names.count("w0") == 1 + len(times), "the drive is evaluated once for each stage time"
    assert names.count("now") == len(times)


# -- hostile names -------------------------------------------------------------------------------------------

PLAIN = ("alpha", "beta", "delta", "omega", "kappa", "eta", "sigma")
VALUES = [1.1, 0.2, 0.3, 1.7, 2.3, -0.4, 0.6]


def network(names: tuple[str, ...] = PLAIN, states: tuple[str, str] = ("x", "v"), weight: str = "weight",
            edge_states: tuple[str, str] | None = None) -> Equations:  # fmt: skip
    """A pair of nodes with every kind of term; the names are parameters of the node, then that of the edge."""
    x, v = real(*states)
    p = real(*names)
    rhs = (v, -p[0] * x - p[1] * v * sp.Abs(v) + p[2] * sp.cos(p[3] * TIME) + sp.atan(p[4] * v) * p[5])
    x_there, v_there, w = real("x_at_source", "v_at_source", weight)
    here = real(*(edge_states or states))
    edge = Edge(tuple(here), (x_there, v_there), w, (sp.S.Zero, p[6] * w * (x_there - here[0])), (p[6],))
    return Equations.of_equal_nodes(Node((x, v), rhs, tuple(p[:6])), edge, 2, path(2))


def numbers_of(eq: Equations, method: str, looped: bool) -> list[float]:
    """Everything that a step writes, and a section function of state, parameters and time."""
    state, first, last = real(eq.state[2], eq.parameters[0], eq.parameters[6])
    section = state * first - TIME * last
    kernel = Interpreted.of(
        emit(eq, method, Recording(("section",), section), width=1, unroll=0 if looped else 8), FLOATS
    )
    plan = sparse_plan(eq)
    y, graph = [0.3, 0.1, -0.2, 0.5], (plan.arrays, plan.weights) if looped else ()
    step = take_step(kernel, 0.3, 0.2, y, VALUES, 0.0, 1.0, *graph)
    dense = [0.0 if d is None else d for d in step.dense]
    section_value = kernel.section(0.3, 0.3, 0.2, VALUES, replace(step, dense=dense))
    return [*step.y_new, *dense, step.error, section_value]


TEXTS = (("rodas6p", True), ("ros34pw2", False), ("dop853", False), ("dop853", True))
"""Methods, in loops or not: that of most stages, and both kinds; Taylor steps have a test of their own."""


@functools.cache
def plain_numbers(method: str, looped: bool) -> list[float]:
    """Those of the network with harmless names."""
    return numbers_of(network(), method, looped)


@pytest.fixture
def same_numbers(request):
    """A function that fails where equations with other names give other numbers."""
    written = (*TEXTS, ("rodas6p", False)) if request.config.getoption("--long") else TEXTS

    def check(eq: Equations) -> None:
        for method, looped in written:
            operations = numbers_of(eq, method, looped)
            assert operations == pytest.approx(plain_numbers(method, looped), rel=1e-12, abs=1e-13), (method, looped)

    return check


WORDS = """
h y p p0 p1 w0 w1 z0 z1 dense shift reach rate error size rtol atol now theta total e3 e5 scaled inside pair y_new
node node_linear step bank put section drive load store select broadcast absolute
maximum minimum sqrt exp cos sin atan njit np math lambda if None True is print abs WIDTH DENSE NODES DIMENSION
COMPONENTS DENSE_ROWS ENTRIES LOOPED MATRIX STATE SLOPE K1 TIME STEP graph weights target source order solve
factorise i j k e old new f r n m u k1_x_1 k12_v_2 u_x_1 f_x_1 f_x r_v_2 n_x_1 e_x_1 j_vv j_vv_1 ft_v ft_v_1
m_v_1_x_1 l_v_1_x_1 inv_v_1 x_here v_there hoisted_0 fixed_0 _ __name__ __debug__ mu_ x1 k10
""".split()  # noqa: SIM905


@pytest.mark.parametrize("chunk", [0, *(pytest.param(k, marks=pytest.mark.long) for k in range(1, 6))])
def test_parameters_may_have_any_name(chunk, same_numbers):
    size = len(WORDS) // 6 + 1
    part = WORDS[chunk * size : (chunk + 1) * size]
    for start in range(0, len(part), 7):
        some = tuple((part[start : start + 7] + list(PLAIN))[:7])
        same_numbers(network(some))
        same_numbers(network(some[3:] + some[:3]))


STATES = [
    ("h", "p"), ("k1", "k2"), ("u", "u_x"), ("w0", "p0"), ("x", "x_1"), ("z0", "z1"), ("n", "e"), ("r", "j"), ("f", "m"),
    ("inv", "ft"), ("l", "e5"), ("total", "now"), ("λ", "ϑ"), ("lambda", "_"), ("v_1", "v"), ("a", "aa"), ("speed", "place"),
    ("S", "K1"), ("load", "sqrt"), ("x", "x_here"),
]  # fmt: skip


@pytest.mark.parametrize(
    "states",
    [*STATES[::3], *(pytest.param(states, marks=pytest.mark.long) for k, states in enumerate(STATES) if k % 3)],
)
def test_states_may_have_any_name(states, same_numbers):
    same_numbers(network(states=states))


@pytest.mark.parametrize(
    "names",
    [("a b", "a-b", "a_b"), ("ϑ", "θ", "theta"), ("ﬁ", "fi", "f_i"), ("lambda", "lambda_", "lambda__"), ("x²", "²", "2"),
     ("", " ", "  "), ("α", "β'", "γ̇"), ("__x", "_x", "x"), ("m_x", "m_x_", "user_m_x")],
)  # fmt: skip
def test_names_that_become_alike_stay_apart(names, same_numbers):
    states = ("q", "dq") if "x" in names else ("x", "v")
    same_numbers(network((*names, *PLAIN[3:]), states))


@pytest.mark.parametrize("weight", ["alpha", "sigma_", "w0", "h", "i", "t0"])
def test_the_weight_of_a_link_may_have_any_name(weight, same_numbers):
    same_numbers(network(weight=weight))


def test_harmless_names_stay_as_they_are():
    assert tidy(friction_chain(2)) == friction_chain(2)
    assert not set(TABLE) & RESERVED


def test_the_header_tells_what_was_renamed():
    head = emit(network(("lambda", *PLAIN[1:])), "rodas5p", width=1).text.split('"""')[1]
    assert "Renamed     lambda as lambda_" in head
    assert "Renamed" not in emit(network(), "rodas5p", width=1).text.split('"""')[1]


@pytest.mark.parametrize("name", ["x_1", "v_2"])
def test_a_parameter_named_like_a_state_variable_is_refused(name):
    with pytest.raises(ValueError, match=f"the parameter '{name}' has the name of a state variable; rename it"):
        network((name, *PLAIN[1:]))


def test_the_time_is_no_parameter():
    with pytest.raises(ValueError, match="node: the name 't' is the time; rename that state or parameter"):
        network(("t", *PLAIN[1:]))
    with pytest.raises(ValueError, match="edge: the name 't' is the time"):
        network((*PLAIN[:6], "t"))
    with pytest.raises(ValueError, match="the parameter 'x' has the name of a state variable"):
        network((*PLAIN[:6], "x"), edge_states=("q", "dq"))
    with pytest.raises(ValueError, match="node: the name 'x' stands for two things"):
        network(("x", *PLAIN[1:]))
