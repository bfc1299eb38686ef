"""Taylor steps on lanes: exact solutions, order, step lengths in hard cases, scales, NaN, dense output, equal bits."""

from __future__ import annotations

import ast
import functools
import math
import re

import mpmath
import numpy as np
import pytest
import sympy as sp
from march import Lanes, alone, compiled, step_of
from plain import Text, march
from samples import numbers, path, spring
from scipy.integrate import solve_ivp

from synchain import Scene
from synchain.codegen.program.statements import walk
from synchain.codegen.steps.safe_names import tidy
from synchain.codegen.taylor import order_for, write_looped, write_step
from synchain.codegen.taylor.taylor_step import called
from synchain.graphs import chain, complete
from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME as T
from synchain.models.mechanics.components import Edge, Node

X, V, A = sp.symbols("x v a", real=True)
NONE: list[float] = []
INF, NAN = math.inf, math.nan


@functools.cache
def harmonic(order: int = 16, width: int = 1, dense: bool = False) -> Lanes:
    return compiled(alone([X, V], [V, -A * A * X], [A]), order, width, dense)


def exact(t: float, a: float = 1.0) -> list[float]:
    return [math.cos(a * t), -a * math.sin(a * t)]


# -- accuracy --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rtol", [1e-4, 1e-7, 1e-10, 1e-13])
def test_the_error_of_a_hundred_periods_is_what_the_tolerance_asks(rtol):
    end, steps = harmonic(order_for(rtol, rtol)).run([1.0, 0.0], [1.0], 200 * math.pi, rtol)
    error = np.abs(end[0] - exact(200 * math.pi)).max()
    assert error < 30 * rtol
    assert steps < 4000


def test_rounding_grows_slowly_over_ten_thousand_periods():
    end, _ = harmonic(24).run([1.0, 0.0], [1.0], 20_000 * math.pi, 1e-14)
    with mpmath.workdps(30):
        t = mpmath.mpf(20_000 * math.pi)
        error = max(abs(end[0, 0] - mpmath.cos(t)), abs(end[0, 1] + mpmath.sin(t)))
    assert error < 5e-12  # DOP853 comes to 6e-12 at this tolerance


@pytest.mark.parametrize("order", [8, 11])
def test_a_step_has_its_order_and_none_above(order):
    """x' = 1 + x**2: halving the step divides the error of one step by 2**(order + 1)."""
    step = compiled(alone([X], [1 + X * X]), order)
    errors = []
    with mpmath.workdps(40):
        for h in (2.0**-2, 2.0**-3):
            length, new, _ = step.step([0.3], NONE, h, scale=h, rtol=1.0, atol=1.0)
            assert length[0] == h
            errors.append(abs(new[0, 0] - mpmath.tan(mpmath.atan(mpmath.mpf(0.3)) + h)))
        assert abs(mpmath.log(errors[0] / errors[1], 2) - (order + 1)) < 0.3


# -- vanishing coefficients -------------------------------------------------------------------------------------


def test_free_motion_is_exact_and_its_step_bounded():
    step = compiled(alone([X, V], [V, sp.S.Zero]), 8)
    length, new, _ = step.step([1.0, 0.5], NONE, scale=2.0)
    assert length[0] == 32.0
    assert new.tolist() == [[17.0, 0.5]]


def test_a_polynomial_drive_is_exact():
    length, new, _ = compiled(alone([X], [T**3]), 8).step([0.0], NONE, t=1.0)
    assert length[0] == 16.0
    assert new[0, 0] == pytest.approx((17.0**4 - 1) / 4, rel=1e-15)


@pytest.mark.parametrize("start", [[1.0, 0.0], [0.0, 1.0]])
@pytest.mark.parametrize("order", [9, 16])
def test_odd_and_even_series_are_not_taken_for_exact(order, start):
    """At a turning point and at a zero every second coefficient vanishes."""
    length, new, _ = harmonic(order).step(start, [1.0], rtol=1e-10, atol=1e-10)
    turned = [start[0] * math.cos(length[0]) + start[1] * math.sin(length[0]),
              start[1] * math.cos(length[0]) - start[0] * math.sin(length[0])]  # fmt: skip
    assert 0.05 < length[0] < 4.0
    assert np.abs(new[0] - turned).max() < 1e-9


def test_series_with_two_zeros_in_a_row_are_not_taken_for_exact():
    """x' = 1/(1 - t**3) from t = 0: of three coefficients one is left; the solution has a pole at t = 1."""
    for order in (16, 17, 18):
        step = Text(alone([X], [1 / (1 - T**3)]), order)
        length, _ = step.step(np.zeros(1), np.float64(0.0), np.float64(INF), np.float64(1.0), 1e-10, 1e-11)
        assert 0.1 < length < 0.6


def test_an_equilibrium_stays_one():
    end, steps = harmonic().run([0.0, 0.0], [1.0], 1e4, 1e-10)
    assert end.tolist() == [[0.0, 0.0]]
    assert steps < 1000


# -- scales, and numbers that are none ------------------------------------------------------------------------


@pytest.mark.parametrize("exponent", [-660, -300, -30, 30, 300, 500])
def test_time_scales_change_no_bit(exponent):
    """Frequencies of 2**exponent: states x and v/a, so that all that changes is time."""
    w = 2.0**exponent
    end, steps = scaled().run([1.0, 0.0], [w], 20.0 / w, 1e-10, scale=2.0**-6 / w)
    reference, count = scaled().run([1.0, 0.0], [1.0], 20.0, 1e-10, scale=2.0**-6)
    assert steps == count
    assert end.tolist() == reference.tolist()


@functools.cache
def scaled() -> Lanes:
    return compiled(alone([X, V], [A * V, -A * X], [A]), 16)


@pytest.mark.parametrize("size", [1e-250, 1e-100, 1e100, 1e250])
def test_the_size_of_states_does_not_matter(size):
    end, steps = harmonic().run([size, 0.0], [1.0], 20.0, 1e-10, 1e-280)
    assert np.abs(end[0] / size - exact(20.0)).max() < 1e-9
    assert steps < 100


@pytest.mark.parametrize("scale", [2.0**-40, 2.0**-12, 1.0, 2.0**12])
def test_a_bad_scale_costs_steps_and_no_accuracy(scale):
    length, new, _ = harmonic().step([1.0, 0.0], [1.0], scale=scale, rtol=1e-10, atol=1e-10)
    assert 0.0 < length[0] < 4.0
    assert np.abs(new[0] - exact(length[0])).max() < 1e-9


@pytest.mark.parametrize("start", [[NAN, 0.0], [1.0, NAN], [INF, 0.0], [1.0, -INF]])
def test_states_that_are_no_numbers_give_no_length(start):
    assert math.isnan(harmonic().step(start, [1.0])[0][0])


def test_parameters_that_are_no_numbers_and_poles_give_no_length():
    assert math.isnan(harmonic().step([1.0, 0.0], [NAN])[0][0])
    assert math.isnan(compiled(alone([X], [sp.log(X)]), 8).step([-1.0], NONE)[0][0])
    assert math.isnan(compiled(alone([X, V], [sp.S.One, sp.sqrt(V)]), 8).step([0.0, 0.0], NONE)[0][0])


def test_coefficients_that_overflow_do_not_pass():
    length = harmonic().step([1.0, 0.0], [1e200])[0][0]
    assert math.isnan(length) or length == 0.0


# -- dense output, widths, equal oscillators -------------------------------------------------------------------


@pytest.mark.parametrize("width", [1, 2, 8])
def test_dense_output_is_the_solution_inside_a_step(width):
    start = np.stack([np.linspace(0.5, 1.0, width), np.linspace(-1.0, 1.0, width)]).T
    length, new, dense = harmonic(16, width, True).step(start, [1.3])
    for theta in (0.0, 0.25, 0.5, 1.0):
        t = theta * length
        value = start.T.copy()
        for k, row in enumerate(dense):
            value += theta ** (k + 1) * row
        c, s = np.cos(1.3 * t), np.sin(1.3 * t)
        assert (
            np.abs(value - [start[:, 0] * c + start[:, 1] / 1.3 * s, start[:, 1] * c - 1.3 * start[:, 0] * s]).max()
            < 1e-10
        )
    assert np.abs(value.T - new).max() < 1e-15 * 4


def test_every_width_has_the_same_bits():
    single, many = slip(), slip(8)
    values = numbers(friction_pair())
    starts = [[0.1 * lane, 0.05, 0.02 * lane, 0.03, 1.0, 1.0] for lane in range(8)]
    end, _ = many.run(starts, values, 0.5, 1e-9)
    assert [single.run(start, values, 0.5, 1e-9)[0][0].tolist() for start in starts] == end.tolist()


@functools.cache
def friction_pair() -> Equations:
    return Scene(oscillator="friction", topology=chain(2), contact="set-valued").equations


def slip(width: int = 1) -> Lanes:
    """The step of a set-valued pair that several tests share."""
    return compiled(friction_pair(), 12, width, True)


def pendula(n: int = 3) -> Equations:
    """A chain of pendula whose links are springs of a sine, with a term of each kind in a node."""
    here, there, w = sp.symbols("xh xt w", real=True), sp.symbols("xt2 vt2", real=True), sp.Symbol("w", real=True)
    edge = Edge(
        (here[0], here[1]), there, w, (sp.S.Zero, A * w * sp.sin(there[0] - here[0]) + w * (there[1] - here[1])), (A,)
    )
    node = Node((X, V), (V, -sp.sin(X) - V**3 / 7 + sp.cos(T) * X - 1 / (2 + V**2) + sp.exp(-X) - V), (A,))
    return Equations.of_equal_nodes(node, edge, n, path(n))


@pytest.mark.parametrize("case", ["pendula", "slip"])
def test_equal_oscillators_have_equal_bits(case):
    if case == "pendula":
        end, _ = compiled(pendula(), 6).run([0.3] * 3 + [0.1] * 3, [0.4], 30.0, 1e-10)
        assert end[0, 0] == end[0, 1] == end[0, 2]
        assert end[0, 3] == end[0, 4] == end[0, 5]
    else:
        end, _ = slip().run([0.3, 0.3, 0.01, 0.01, 1.0, 1.0], numbers(friction_pair()), 0.7, 1e-10)
        assert end[0, 0] == end[0, 1]
        assert end[0, 2] == end[0, 3]


# -- set-valued friction ---------------------------------------------------------------------------------------


def test_modes_are_constants_of_a_step():
    """A body that sticks moves with its ground; its mode stands in the new state and not in the dense output."""
    eq = friction_pair()
    values = dict(zip(eq.parameters, numbers(eq), strict=True))
    length, new, dense = slip().step([0.3, 0.1, values["theta_b"], 0.02, 0.0, 1.0], list(values.values()), 0.0625)
    assert length[0] == 0.0625
    assert new[0, 4:].tolist() == [0.0, 1.0]
    assert (dense[:, 4:] == 0.0).all()
    assert new[0, 2] == values["theta_b"]
    assert new[0, 0] == pytest.approx(0.3 + 0.0625 * values["theta_b"], rel=1e-15)
    assert new[0, 3] != 0.02


def test_set_valued_slip_is_that_of_the_equations():
    eq = friction_pair()
    values = numbers(eq)
    f = sp.lambdify((T, [sp.Symbol(n, real=True) for n in (*eq.state, *eq.parameters)]), eq.rhs())
    start = [0.3, 0.25, 0.0, -0.01, 1.0, 1.0]
    reference = solve_ivp(lambda t, y: f(t, [*y, *values]), (0, 0.8), start, method="DOP853", rtol=1e-13, atol=1e-14)
    end, _ = slip().run(start, values, 0.8, 1e-12)
    assert np.abs(end[0] - reference.y[:, -1]).max() < 2e-12


# -- refusals, names, orders -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name",
    [
        "scale",
        "ratio",
        "passed",
        "side_of",
        "size_kink0",
        "tan",
        "erf",
        "power",
        "r3",
        "w_x_1",
        "i_b",
        "n_",
        "raised",
        "x_1_4",
        "shared_0",
        "exp0",
    ],
)
def test_words_of_the_step_are_free_for_symbols(name):
    """The same motion whatever a parameter is called; Python runs the text."""
    p = sp.Symbol(name, real=True)
    eq = Equations.of_equal_nodes(Node((X, V), (V, -p * X + sp.exp(-p) - sp.exp(-X)), (p,)), spring(), 2, path(2))
    plain = eq.map_templates(lambda n: n.map(lambda e: e.xreplace({p: A})), lambda e: e, {p: A})
    ends = [march(e, 8, [0.3, 0.1, 0.0, 0.2], 2.0, 1e-8, numbers=[1.1, 0.3])[0].tolist() for e in (eq, plain)]
    assert ends[0] == ends[1]
    assert abs(ends[0][0]) < 10.0  # no NaN


def test_symbols_that_are_called_otherwise_stay_apart():
    """A name that the step needs, what it is called instead, and what that would be called again."""
    clashing, plain = (sp.symbols(names, real=True) for names in ("i_b i_b_ user_i_b", "a b c"))
    ends = []
    for p, q, r in (clashing, plain):
        eq = alone([X, V], [V, r - p * X - q * V], [p, q, r])
        ends.append(march(eq, 8, [0.3, 0.1], 2.0, 1e-8, numbers=[1.1, 0.3, 0.2])[0].tolist())
    assert ends[0] == ends[1]


def test_orders_grow_with_the_tolerance_and_are_few():
    orders = [order_for(10.0**-k, 10.0 ** -(k + 1)) for k in range(1, 16)]
    assert orders == sorted(orders)
    assert set(orders) == {8, 12, 16, 20, 24}
    assert order_for(1e-14, 1e-6) == order_for(1e-6, 1e-14)


def test_golden_steps(golden):
    """The text of a slipping pair; of a looped ring of pendula."""
    golden("taylor_slip_6.txt", step_of(friction_pair(), 6).text + "\n")
    golden("taylor_looped_8.txt", write_looped(tidy(pendula()), 8).text + "\n")


def test_operations_are_those_of_the_text():
    """A written-out step has no indices to be computed; signs of numbers and arguments are no operations."""
    source = step_of(alone([X, V], [V, A - sp.sin(X) - V**2 / 3], [A]), 8)
    tree = ast.parse(source.text.split("@njit")[-1].partition("\n")[2])
    assert source.operations == sum(isinstance(node, ast.BinOp) for node in ast.walk(tree)) > 100


OWN_WORDS = {
    "slip": friction_pair(),
    "pendula": tidy(pendula()),
    "kinks": alone([X, V], [V, -sp.Abs(X) - X**3 + sp.Abs(sp.cos(T)) + A], [A]),
    "jumps": alone([X, V], [V, -X - sp.floor(3 * X) + sp.sign(sp.cos(T)) + A], [A]),
    "hidden": alone([X, V], [V, -sp.exp(-(X**2)) + sp.sqrt(1 + V**2)], []),
    "mean field": Scene("pendulum", "torsion", complete(30)).equations,
}


@pytest.mark.parametrize("looped", [False, True], ids=["lines", "loops"])
@pytest.mark.parametrize("name", OWN_WORDS)
def test_no_symbol_of_a_user_is_called_like_a_name_of_the_step(name, looped):
    """What is assigned is a symbol of the equations, a numbered name of a series, or kept for the step."""
    equations = tidy(OWN_WORDS[name])
    body = (write_looped if looped else write_step)(equations, 8).function.body
    assigned = {name for s in walk(body) for name in getattr(s, "targets", ())}
    nodes, edges = equations.nodes, equations.edges
    symbols = {s.name for node in nodes for s in (*node.state, *node.parameters)} | {*equations.parameters}
    symbols |= {s.name for edge in edges for s in (edge.weight, *edge.parameters)} | {*equations.state}
    symbols |= {*called(symbols).values()}
    symbols |= {f"{symbol}{end}" for symbol in symbols for end in ("_here", "_there", "_first")}
    intermediates = {
        word
        for word in assigned - symbols - {"t"}
        if not re.fullmatch(r"[a-z_]+\d+(_\d+|_rest|_value)?|.+_\d+_\d+", word)
    }
    assert intermediates
    for word in intermediates:
        parameter = sp.Symbol(word, real=True)
        (renamed,) = tidy(alone([X], [parameter], [parameter])).node.parameters
        assert called([renamed.name])[renamed.name] != word, word


def test_a_step_brings_the_functions_that_it_calls():
    kinked = alone([X, V], [V, -sp.Abs(X) - X + A], [A])
    smooth, bent, slips = (step_of(e, 8).text for e in (alone([X], [-X], []), kinked, friction_pair()))
    assert ["def passage" in text for text in (smooth, bent, slips)] == [False, True, True]
    assert ["def closing" in text for text in (smooth, bent, slips)] == [False, False, True]


@pytest.mark.parametrize(
    ("factor", "expanded"), [(A + 2 * sp.exp(X), False), (A + sp.exp(X), True), (X - 1, True), (3 * X - 1, True)]
)
def test_what_is_scaled_and_shifted_is_multiplied_out(factor, expanded):
    """Differences from a state stay whole: they may be exact where a product of each part is not."""
    text = step_of(alone([X], [factor * sp.sin(X)], [A]), 8).text
    assert ("linear0_0 = " in text) == expanded
    assert text.count("product0_3 = ") == 1
