"""Expressions as text: the same value, few parentheses, and an error for whatever cannot be said."""

from __future__ import annotations

import ast
import math
import re
from pathlib import Path

import mpmath
import pytest
import sympy as sp
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from samples import FLOATS, real

from synchain.codegen.program import functions
from synchain.codegen.program.lowering import UnprintableError, lower
from synchain.codegen.program.printers import LANES

FUNCTIONS = functions.FUNCTIONS
"""What a kernel can call, by SymPy class."""


def show(expression: sp.Expr) -> str:
    """The text of an expression in a kernel."""
    return LANES.text(lower(sp.sympify(expression)))


x, y, z, kappa = SYMBOLS = real("x", "y", "z", "kappa")

# -- round trip ----------------------------------------------------------------------------------------------

RATIONALS = st.fractions(-20, 20, max_denominator=12).map(lambda f: sp.Rational(f.numerator, f.denominator))
CONSTANTS = st.sampled_from([sp.pi, sp.E, sp.sqrt(2), 1 / sp.pi, sp.exp(2), sp.log(3), sp.sin(1), sp.GoldenRatio])
LEAVES = st.one_of(st.sampled_from(SYMBOLS), st.sampled_from(SYMBOLS), RATIONALS, CONSTANTS)
SMOOTH = [sp.sin, sp.cos, sp.atan, sp.tanh, sp.asinh, sp.erf, sp.Abs, sp.sign]


def grown(inner: st.SearchStrategy) -> st.SearchStrategy:
    two = st.tuples(inner, inner)
    return st.one_of(
        two.map(lambda p: p[0] + p[1]),
        two.map(lambda p: p[0] - p[1]),
        two.map(lambda p: p[0] * p[1]),
        two.map(lambda p: p[0] / (2 + p[1] ** 2)),
        two.map(lambda p: sp.Max(p[0], p[1])),
        two.map(lambda p: sp.Min(p[0], p[1], 1)),
        two.map(lambda p: sp.Piecewise((p[0], x < y), (p[1] / 3, (z > 1) | (y <= -1)), (p[0] * 2, True))),
        st.tuples(inner, st.integers(2, 5)).map(lambda p: p[0] ** p[1]),
        st.tuples(inner, st.integers(1, 4)).map(lambda p: (1 + p[0] ** 2) ** -p[1]),
        inner.map(lambda e: sp.sqrt(1 + e**2)),
        inner.map(lambda e: (1 + e**2) ** sp.Rational(-3, 2)),
        two.map(lambda p: (1 + p[0] ** 2) ** sp.atan(p[1])),
        two.map(lambda p: sp.atan2(p[0], 1 + p[1] ** 2)),
        inner.map(lambda e: sp.exp(-(e**2))),
        inner.map(lambda e: sp.log(1 + e**2)),
        inner.map(lambda e: -e),
        st.tuples(st.sampled_from(SMOOTH), inner).map(lambda p: p[0](p[1])),
    )


def printed(expression: sp.Expr) -> str:
    """The text; an example with a power or a number that is too large does not count."""
    assume(expression.is_extended_real is not False and not expression.has(sp.zoo, sp.nan, sp.oo))
    try:
        return show(expression)
    except UnprintableError as problem:
        assume("does not fit" not in str(problem) and "the power" not in str(problem))
        raise


EXPRESSIONS = st.recursive(LEAVES, grown, max_leaves=6).map(sp.sympify)
VALUES = st.tuples(*[st.floats(-3, 3).filter(lambda v: abs(v) > 1e-3)] * len(SYMBOLS))


@settings(max_examples=150, deadline=None)
@given(EXPRESSIONS, VALUES)
def test_text_has_the_value_of_the_expression(expression, values):
    text = printed(expression)
    found = eval(text, {**FLOATS, **{s.name: v for s, v in zip(SYMBOLS, values, strict=True)}})
    with mpmath.workdps(50):
        parameter_values = [mpmath.mpf(v) for v in values]
        value = sp.lambdify(SYMBOLS, expression, "mpmath")
        exact = value(*parameter_values)
        # how far a rounding of the values moves the result: what doubles can do at best
        steps = [
            [v * (1 + mpmath.mpf(2) ** -45 * (i == j)) for j, v in enumerate(parameter_values)]
            for i in range(len(parameter_values))
        ]
        moved = [abs(value(*step) - exact) for step in steps]
        allowed = 100 * max(moved) + 1e-11 * (1 + abs(exact))
        assert math.isfinite(found)
        assume(not expression.has(sp.sign, sp.Piecewise) or max(moved) < 1e-6)  # a jump right here
        assert abs(found - exact) <= allowed, (text, found, exact)


@settings(max_examples=60, deadline=None)
@given(EXPRESSIONS)
def test_text_is_one_python_expression_of_known_names(expression):
    tree = ast.parse(printed(expression), mode="eval")
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    assert names <= {*(s.name for s in SYMBOLS), *FUNCTIONS.values(), "sqrt", "select"}
    assert all(isinstance(n.value, float) for n in ast.walk(tree) if isinstance(n, ast.Constant))


@settings(max_examples=60, deadline=None)
@given(EXPRESSIONS)
def test_text_is_the_same_for_an_equal_expression(expression):
    text = printed(expression)
    again = eval(sp.srepr(expression), {**vars(sp), "ExprCondPair": sp.functions.elementary.piecewise.ExprCondPair})
    assert show(again) == text


# -- how it reads --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("expression", "text"),
    [
        (x + y, "x + y"),
        (y - x, "y - x"),
        (-x, "-x"),
        (-x - y, "-x - y"),
        (3 - x, "3.0 - x"),
        (x - (y - z), "x + z - y"),
        (x * y * z, "x*y*z"),
        (x * (y + z), "x*(y + z)"),
        (-(x + y) * kappa, "kappa*(-x - y)"),
        (-2 * x * y, "-2.0*x*y"),
        (x / 2, "0.5*x"),
        (-3 * x / (7 * y), "-0.42857142857142855*x/y"),
        (x / y, "x/y"),
        (1 / x, "1.0/x"),
        (-1 / x, "-1.0/x"),
        (1 / (x * y), "1.0/(x*y)"),
        (x / (y + z), "x/(y + z)"),
        (x / (1 + kappa * y**2), "x/(1.0 + kappa*(y*y))"),
        (x / (y * (1 + z)), "x/(y*(1.0 + z))"),
        (x**2, "x*x"),
        (x**-2, "1.0/(x*x)"),
        ((x + y) ** 2, "(x + y)*(x + y)"),
        (sp.sqrt(x), "sqrt(x)"),
        (sp.sqrt(x) / kappa, "sqrt(x)/kappa"),
        (1 / sp.sqrt(x), "1.0/sqrt(x)"),
        (x ** sp.Rational(3, 2), "x*sqrt(x)"),
        (sp.exp(-x), "exp(-x)"),
        (x * sp.exp(-kappa * y), "x*exp(-kappa*y)"),
        (x / sp.atan(kappa * y), "x/atan(kappa*y)"),
        (x**y, "exp(y*log(x))"),
        (x ** sp.Rational(1, 3), "exp(0.3333333333333333*log(x))"),
        (x ** (-sp.pi), "1.0/exp(3.141592653589793*log(x))"),
        (2**x, "exp(0.6931471805599453*x)"),
        (sp.atan2(y, sp.tan(x)), "atan2(y, tan(x))"),
        (2 * sp.atan(kappa * x) / sp.pi, "0.6366197723675814*atan(kappa*x)"),
        (x + sp.sqrt(2), "1.4142135623730951 + x"),
        (sp.exp(2) * x, "7.38905609893065*x"),
        (x + sp.log(2) / 3, "x + 0.23104906018664845"),
        (x + 3 * sp.sin(1), "x + 2.5244129544236897"),
        (sp.Max(x, y, z), "maximum(x, maximum(y, z))"),
        (sp.Min(x, 0), "minimum(0.0, x)"),
        (sp.Abs(x) * sp.sign(y), "absolute(x)*sign(y)"),
        (sp.Piecewise((x, x < 0), (y, True)), "select(x < 0.0, x, y)"),
        (sp.Piecewise((x, x <= y), (y, True)), "select(x <= y, x, y)"),
        (sp.Piecewise((x, x > y), (y, True)), "select(x > y, x, y)"),
        (sp.Piecewise((x, x >= y), (y, x < z), (z, True)), "select(x >= y, x, select(x < z, y, z))"),
        (sp.Piecewise((x, (x < 0) | (y > 1)), (y, True)), "select((y > 1.0) | (x < 0.0), x, y)"),
        (sp.Piecewise((x, (x < 0) & (y >= 1)), (y, True)), "select((y >= 1.0) & (x < 0.0), x, y)"),
        (sp.Piecewise((x, ~((x < 0) & (y >= 1))), (y, True)), "select((x >= 0.0) | (y < 1.0), x, y)"),
        (sp.Piecewise((x, z), (y, kappa & (x < 0)), (z, True)), "select(z, x, select(kappa & (x < 0.0), y, z))"),
        (sp.Piecewise((x, ~(z & (y > 1))), (y, True)), "select((y <= 1.0) | ~z, x, y)"),
        (x - y > 1, "(x - y) > 1.0"),
        ((x < 0) & (y >= 1), "(y >= 1.0) & (x < 0.0)"),
    ],
)
def test_text_reads_like_written_by_hand(expression, text):
    assert show(expression) == text


@settings(max_examples=60, deadline=None)
@given(EXPRESSIONS)
def test_no_parentheses_around_atoms_or_twice(expression):
    text = printed(expression)
    opened = []
    pairs = set()
    for i, c in enumerate(text):
        if c == "(":
            opened.append(i)
        elif c == ")":
            pairs.add((opened.pop(), i))
    for a, b in pairs:
        assert (a + 1, b - 1) not in pairs, text
        called = a > 0 and (text[a - 1].isalnum() or text[a - 1] == "_")
        assert called or not text[a + 1 : b].isidentifier(), text


# -- refusals ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("expression", "message"),
    [
        (sp.gamma(x), r"no printing rule for gamma in gamma\(x\); known: absolute, acos, .*, sqrt, powers, Piecewise"),
        (sp.Function("f")(x), r"no printing rule for f in f\(x\)"),
        (x + sp.besselj(0, y), "no printing rule for besselj"),
        (sp.DiracDelta(x), "no printing rule for DiracDelta"),
        (x + sp.Float(0.1), "floating-point number 0.1.* in an expression; make it a parameter or a Rational"),
        (x * sp.Float(2.5), "floating-point number"),
        (sp.sin(sp.Float(0.5) * x), "floating-point number"),
        (sp.I * x, "no printing rule for ImaginaryUnit"),
        (x + sp.sqrt(-2), "no printing rule for ImaginaryUnit"),
        (sp.oo, "no printing rule for Infinity|does not fit"),
        (sp.nan, "no printing rule for NaN"),
        (sp.zoo * sp.exp(x), "no printing rule for ComplexInfinity"),
        (sp.Piecewise((x, x < 0)), r"has no value where no condition holds; end it with \(value, True\)"),
        (sp.Piecewise((x, sp.Eq(x, y)), (y, True)), "no printing rule for the condition"),
        (sp.Piecewise((x, sp.Ne(x, y)), (y, True)), "no printing rule for the condition"),
        (x**17, r"no printing rule for the power x\*\*17; expected whole exponents up to 16"),
        (x**-17, "no printing rule for the power"),
        ((-2) ** x, "no printing rule for ImaginaryUnit"),
        (sp.Integer(10) ** 400 * x, "does not fit into a double; rescale the equations"),
        (x + sp.Integer(10) ** 309, "does not fit into a double"),
    ],
)
def test_what_cannot_be_said_is_an_error(expression, message):
    with pytest.raises(UnprintableError, match=message):
        show(expression)
    assert issubclass(UnprintableError, ValueError)


def test_every_function_is_printed_and_exists():
    from synchain.codegen import simd

    for kind, name in FUNCTIONS.items():
        arguments = (x, y) if kind in (sp.Max, sp.Min, sp.atan2) else (x,)
        assert show(kind(*arguments)).startswith(f"{name}(")
        assert hasattr(simd, name)


def test_the_page_on_plug_ins_names_every_function_that_can_be_compiled():
    page = (Path(__file__).parents[3] / "docs" / "plugins.md").read_text("utf-8")
    section = page.partition("## Functions that can be compiled")[2]
    named = re.findall("`([A-Za-z0-9]+)`", section.partition("SymPy")[0])
    assert sorted(named) == sorted(kind.__name__ for kind in FUNCTIONS)
