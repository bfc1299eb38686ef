"""Recurrences against the Taylor series of mpmath: the text runs in 60 digits, with the fractions that its numbers stand for."""

from __future__ import annotations

import re
from fractions import Fraction
from typing import Any

import mpmath
import pytest
import sympy as sp
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from march import alone, step_of

from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME as T

X, V, A, B = sp.symbols("x v a b", real=True)
ORDER = 16
DIGITS = 60

FUNCTIONS: dict[str, Any] = {
    **{n: getattr(mpmath, n) for n in ("exp", "log", "sin", "cos", "tan", "sinh", "cosh", "tanh", "atan", "asin", "acos")},
    **{n: getattr(mpmath, n) for n in ("asinh", "acosh", "atanh")},
    "erf": mpmath.erf, "sqrt": mpmath.sqrt, "power": mpmath.power, "absolute": abs, "any_lane": bool, "maximum": max, "minimum": min,
    "select": lambda which, yes, no: yes if which else no,
    "truncated": lambda x: x, "njit": lambda **options: lambda f: f, "load": lambda a, slot, width: a[slot],
    "store": lambda a, slot, value: a.__setitem__(slot, value), "WIDTH": 1, "DENSE": True,
}  # fmt: skip


def exact(text: str) -> str:
    """The text with every number as the short fraction, or the multiple of 1/sqrt(pi), that it stands for."""

    def number(match: re.Match[str]) -> str:
        for unit, divisor in ((1.0, "1"), (float(mpmath.sqrt(mpmath.pi)), "sqrt(pi)")):
            value = Fraction(float(match[0]) * unit).limit_denominator(10_000)
            if abs(float(value) - float(match[0]) * unit) < 1e-15 * abs(float(value)):
                return f"(mpf({value.numerator})/({value.denominator}*{divisor}))"
        return match[0]

    return re.sub(r"(?<![\w.])\d+\.\d+(e[-+]\d+)?", number, text)


def series(
    equations: Equations, start: list[Any], numbers: list[Any], t: Any = 0, order: int = ORDER, scale: int = 1
) -> list:
    """The coefficients of all states, (order + 1, dimension), in 60 digits."""
    space = {**FUNCTIONS, "mpf": mpmath.mpf, "pi": mpmath.pi}
    exec(exact(step_of(equations, order).text), space)
    size = equations.dimension
    y, y_new, dense = [*start, *numbers], [None] * size, [None] * size * order
    length, _ = space["step"](
        t, mpmath.inf, mpmath.mpf(scale), y, y, y_new, dense, mpmath.mpf("1e-10"), mpmath.mpf("1e-11")
    )
    rows = [dense[k * size : (k + 1) * size] for k in range(order)]
    return [list(start), *([c * (scale / length) ** (k + 1) for c in row] for k, row in enumerate(rows))]


def close(coefficients: list, expected: list, digits: int = 40) -> bool:
    size = max(abs(e) for e in expected)
    return all(
        abs(a - b) <= mpmath.mpf(10) ** -digits * max(size, abs(b)) for a, b in zip(coefficients, expected, strict=True)
    )


POINTS = ["-0.45", "0.7"]
UNARY = {
    "exp": sp.exp, "log": lambda a: sp.log(2 + a), "sin": sp.sin, "cos": sp.cos, "tan": sp.tan, "sinh": sp.sinh,
    "cosh": sp.cosh, "tanh": sp.tanh, "atan": sp.atan, "asin": sp.asin, "acos": sp.acos, "erf": sp.erf,
    "asinh": sp.asinh, "acosh": lambda a: sp.acosh(2 + a), "atanh": sp.atanh,
    "sqrt": lambda a: sp.sqrt(3 + a), "square": lambda a: a**2, "cube": lambda a: a**3, "seventh": lambda a: a**7,
    "inverse": lambda a: 1 / (2 + a), "inverse cube": lambda a: (2 + a) ** -3, "3/2": lambda a: (2 + a) ** sp.Rational(3, 2),
    "-5/2": lambda a: (2 + a) ** sp.Rational(-5, 2), "1/3": lambda a: (2 + a) ** sp.Rational(1, 3),
    "symbolic power": lambda a: (2 + a) ** B, "number to a series": lambda a: B**a, "quotient": lambda a: (1 + a**2) / (3 - a),
    "series to a series": lambda a: (2 + a) ** (1 + a**2), "nested": lambda a: sp.sin(sp.exp(a) * sp.cos(3 * a)),
    "two products": lambda a: a * sp.sin(a) * sp.exp(a) + a * sp.sin(a), "root of a function": lambda a: sp.sqrt(2 + sp.sin(a)),
    "negative argument": lambda a: sp.sin(-a) + sp.cos(-2 * a) - sp.tanh(-a),
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "point"),
    [pytest.param(name, point, marks=[pytest.mark.long] * ((k + turn) % 2))
     for k, name in enumerate(UNARY) for turn, point in enumerate(POINTS)],
)  # fmt: skip
def test_every_recurrence_is_the_series_of_mpmath(name, point):
    with mpmath.workdps(DIGITS):
        c, b = mpmath.mpf(point), mpmath.mpf("1.7")
        inner = A + T / 3 - T**2 / 7
        e = UNARY[name](inner)
        f = sp.lambdify((T, A, B), e, "mpmath")
        with mpmath.workdps(DIGITS + 60):
            expected = mpmath.taylor(lambda t: f(t, c, b), 0, ORDER - 1)
        equations = alone([X], [e], [A, B])
        coefficients = series(equations, [mpmath.mpf(0)], [c, b])
        assert close([row[0] * k for k, row in enumerate(coefficients)][1:], expected)


@pytest.mark.parametrize("order", [8, 13, 24])
def test_states_solve_their_equations(order):
    """x = tan(t + c) from x' = 1 + x**2, at another time and scale."""
    with mpmath.workdps(DIGITS):
        c = mpmath.mpf("0.4")
        coefficients = series(alone([X], [1 + X**2]), [mpmath.tan(c)], [], t=5, order=order, scale=4)
        with mpmath.workdps(DIGITS + 60):
            expected = mpmath.taylor(mpmath.tan, c, order)
        assert close([row[0] / 4**k for k, row in enumerate(coefficients)], expected)


LEAVES = st.sampled_from([X, V, T, A, sp.Integer(2), sp.Rational(-1, 3), sp.Integer(1)])


def grown(inner: st.SearchStrategy) -> st.SearchStrategy:
    safe = [sp.sin, sp.cos, sp.tanh, sp.atan, lambda e: sp.exp(sp.sin(e)), lambda e: sp.sqrt(2 + e**2), lambda e: e**3,
            lambda e: 1 / (1 + e**2), lambda e: sp.log(1 + e**2), lambda e: (2 + e**2) ** sp.Rational(-2, 3), sp.erf]  # fmt: skip
    return st.one_of(
        st.builds(lambda a, b: a + b, inner, inner),
        st.builds(lambda a, b: a * b, inner, inner),
        st.builds(lambda a, b: a - b, inner, inner),
        st.builds(lambda f, a: f(a) if a.free_symbols else a, st.sampled_from(safe), inner),
    )


EXPRESSIONS = st.recursive(LEAVES, grown, max_leaves=7)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(EXPRESSIONS, EXPRESSIONS)
def test_random_equations_are_solved_term_by_term(first, second):
    """Coefficients of x' = f and v' = g against derivatives that SymPy takes along the flow."""
    order = 6
    equations = alone([X, V], [first, second], [A])
    with mpmath.workdps(DIGITS):
        values = {X: mpmath.mpf("0.31"), V: mpmath.mpf("-0.27"), A: mpmath.mpf("0.6"), T: mpmath.mpf("0.2")}
        coefficients = series(equations, [values[X], values[V]], [values[A]], t=values[T], order=order)
        for c, state in enumerate((X, V)):
            e, factorial = state, 1
            for k in range(1, 5):
                e = e.diff(X) * first + e.diff(V) * second + e.diff(T)
                factorial *= k
                value = sp.lambdify((X, V, A, T), e, "mpmath")(*(values[s] for s in (X, V, A, T)))
                assert abs(coefficients[k][c] - mpmath.mpf(value) / factorial) <= mpmath.mpf(10) ** -40 * (
                    1 + abs(value)
                )


def test_a_kink_of_parameters_is_no_kink():
    assert "absolute(a)" in step_of(alone([X], [-X * sp.Abs(A)], [A]), 8).text


@pytest.mark.parametrize(
    "constant", [sp.cbrt(2 + A**2), (2 + A) ** B, sp.tan(A), sp.sinh(A) * sp.cosh(B), sp.erf(sp.asin(A))]
)
def test_constants_take_every_function(constant):
    with mpmath.workdps(DIGITS):
        a, b = mpmath.mpf("0.4"), mpmath.mpf("1.3")
        coefficients = series(alone([X], [-X * constant], [A, B]), [mpmath.mpf(1)], [a, b], order=6)
        assert abs(coefficients[1][0] + sp.lambdify((A, B), constant, "mpmath")(a, b)) < mpmath.mpf(10) ** -40


def test_unknown_functions_and_low_orders_are_refused():
    with pytest.raises(ValueError, match=r"found gamma\(.*, which has no series"):
        step_of(alone([X], [sp.gamma(2 + X**2)]), 8)
    with pytest.raises(ValueError, match="order 5; expected at least 6"):
        step_of(alone([X], [X]), 5)
