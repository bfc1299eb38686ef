"""Series that are small to all orders now and large soon after, that have their terms far apart, or that pass where they end.

The steps run as plain Python.
"""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
import sympy as sp
from march import alone, step_of
from plain import Text, march
from scipy import special
from scipy.integrate import solve_ivp

from synchain.codegen.taylor import order_for
from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME as T

X, V, A = sp.symbols("x v a", real=True)
PULSE = alone([A, X], [sp.S.One, sp.exp(200 * (sp.cos(A) - 1)) / 100])
"""A phase that turns evenly, and a narrow pulse in each turn, of which a step beside it sees nothing above 1e-170."""


def run(equations: Equations, start: list[float], end: float, rtol: float) -> np.ndarray:
    return march(equations, order_for(rtol, rtol / 10), start, end, rtol)[0]


@pytest.mark.parametrize("rtol", [1e-2, 1e-4, 1e-8, 1e-12])
def test_a_pulse_of_a_phase_is_not_stepped_over(rtol):
    """Each turn adds the integral 2 pi exp(-200) I0(200)/100."""
    end = run(PULSE, [1.0, 0.0], 10 * math.pi + 1.0, rtol)
    assert end[1] == pytest.approx(5 * 2 * math.pi * special.i0e(200.0) / 100.0, abs=30 * rtol)


def test_a_pulse_of_a_phase_is_not_stepped_over_in_loops():
    end, _ = march(PULSE, 16, [1.0, 0.0], 10 * math.pi + 1.0, 1e-8, looped=True)
    assert end[1] == pytest.approx(math.pi * special.i0e(200.0) / 10.0, abs=1e-7)


@pytest.mark.parametrize(("power", "rtol"), [(10, 1e-3), (10, 1e-8), (7, 1e-2), (30, 1e-4)])
def test_a_zero_of_high_order_is_left_and_reached(power, rtol):
    """(1 - cos a)**n and its first 2n - 1 derivatives are zero in each turn; the mean of it is binomial(2n, n)/2**n."""
    mean = sp.Rational(math.comb(2 * power, power), 2**power)
    equations = alone([A, X], [sp.S.One, (1 - sp.cos(A)) ** power / mean])
    assert run(equations, [0.0, 0.0], 6 * math.pi, rtol)[1] == pytest.approx(6 * math.pi, rel=30 * rtol)


def test_a_soft_wall_turns_a_body_back():
    """x'' = exp(-50 x) from x = 3 with v = -1: at the start the force is 7e-66; the motion is log cosh."""
    b, energy = 50.0, 0.5
    speed, nearest = math.sqrt(2.0 * energy), -math.log(b * energy) / b
    turn = (3.0 - nearest + 2.0 * math.log(2.0) / b) / speed
    result = run(alone([X, V], [V, sp.exp(-50 * X)]), [3.0, -1.0], 6.0, 1e-8)
    exact = nearest + 2.0 / b * math.log(math.cosh(b * speed * (6.0 - turn) / 2.0))
    assert result.tolist() == pytest.approx([exact, speed], abs=1e-6)


def test_a_pulse_beside_a_large_motion_counts():
    """x' = cos(a/3)/10 + exp(200 (cos a - 1)): what else moves the state hides nothing."""
    equations = alone([A, X], [sp.S.One, sp.cos(A / 3) / 10 + sp.exp(200 * (sp.cos(A) - 1))])
    steps = run(equations, [1.0, 0.0], 10 * math.pi + 1.0, 1e-9)[1]
    slow = 0.3 * (math.sin((10 * math.pi + 2.0) / 3) - math.sin(1.0 / 3))
    assert steps == pytest.approx(slow + 10 * math.pi * special.i0e(200.0), abs=3e-7)


def some(chosen: tuple, others: tuple) -> list:
    """Parameters of which the others are tried with --long."""
    return [*chosen, *(pytest.param(other, marks=pytest.mark.long) for other in others)]


@pytest.mark.parametrize("power", some((4, 5, 8, 11, 15), (6, 7, 9, 10, 12)))
@pytest.mark.parametrize("rtol", some((1e-2, 1e-13), (1e-4, 1e-6, 1e-8, 1e-11)))
def test_a_spring_without_a_linear_term_keeps_its_energy(power, rtol):
    """Near x = 0 the coefficients of x'' = -x**n stand n + 1 orders apart: the last three say nothing."""
    force = X**power if power % 2 else X ** (power - 1) * sp.Abs(X)
    for start in ([0.0, 1.0], [1.0, 0.0], [1e-3, 1.0]):
        end = run(alone([X, V], [V, -force]), start, 30.0, rtol)
        before, after = (v**2 / 2 + abs(x) ** (power + 1) / (power + 1) for x, v in (start, end))
        assert after == pytest.approx(before, rel=100 * rtol)


@pytest.mark.parametrize("looped", [False, True], ids=["lines", "loops"])
def test_a_kink_of_a_function_that_hides(looped):
    """x' = -1, y' = |exp(-30 x**2) - 1/2| from x = 3 to -3."""
    equations = alone([X, V], [-sp.S.One, sp.Abs(sp.exp(-30 * X**2) - sp.Rational(1, 2))])
    end, _ = march(equations, order_for(1e-9, 1e-10), [3.0, 0.0], 6.0, 1e-9, looped=looped)
    edge = math.sqrt(math.log(2.0) / 30.0)
    inner = 2.0 * float(mpmath.quad(lambda x: mpmath.exp(-30 * x**2) - 0.5, [0, edge]))
    outer = 2.0 * float(mpmath.quad(lambda x: 0.5 - mpmath.exp(-30 * x**2), [edge, 2 * edge, 3]))
    assert end[1] == pytest.approx(inner + outer, abs=1e-8)


@pytest.mark.parametrize("looped", [False, True], ids=["lines", "loops"])
def test_the_slope_of_erf_is_seen_from_far_away(looped):
    """A phase a' = 1 from 0, x' = erf(50 (a - 10)): exp(-a**2) is zero to every digit at the start, and up to a = 9.46."""
    equations = alone([A, X], [sp.S.One, sp.erf(50 * (A - 10))])
    end, _ = march(equations, 16, [0.0, 0.0], 19.0, 1e-10, looped=looped)
    assert end[1] == pytest.approx(-1.0, abs=1e-9)


FAR = {
    "1/(1 + exp)": (1 / (1 + sp.exp(30 * (A - 30))), 30.0, 8),
    "soft maximum": (sp.log(1 + sp.exp(30 * (A - 30))), 30.0 * 50.0 + math.pi**2 / 180.0, 6),
    "exp of exp": (sp.exp(-sp.exp(30 * (A - 30))), 30.0 - float(mpmath.euler) / 30.0, 8),
    "power": (1 / (1 + sp.Integer(2) ** (40 * (A - 30))), 30.0, 8),
    "pulse": (sp.exp(-400 * (A - 30) ** 2), math.sqrt(math.pi) / 20.0, 8),
    "1/(2 + 3 exp)": (1 / (2 + 3 * sp.exp(50 * (A - 30))), 15.0 - math.log(1.5) / 100.0, 8),
    "overflow": (1 / (1 + sp.exp(-400 * (A - 30))), 10.0, 8),
    "overflow behind": (A / (1 + sp.exp(400 * (A - 30))), 450.0 + math.pi**2 / 6.0 / 160000.0, 6),
    "1/cosh": (1 / sp.cosh(500 * (A - 30)), math.pi / 500.0, 10),
    "1/cosh**2": (sp.cosh(500 * (A - 30)) ** -2, 2.0 / 500.0, 10),
}
"""What underflows or overflows at the start or later, what comes of it up to 40, and digits that it is right to."""


@pytest.mark.parametrize("looped", [False, True], ids=["lines", "loops"])
@pytest.mark.parametrize("case", FAR)
def test_an_exponential_that_has_no_digits_is_seen_from_far_away(case, looped):
    """A phase a' = 1 from 0, x' = 1/(1 + exp(30 (a - 30))) and the like: exp(-900) is zero, with all that follows from it."""
    rate, right, digits = FAR[case]
    end, steps = march(alone([A, X], [sp.S.One, rate]), 16, [0.0, 0.0], 40.0, 1e-10, looped=looped)
    assert end[1] == pytest.approx(right, abs=10.0**-digits)
    assert steps < 700


def test_the_way_to_an_exponential_is_gone_in_parts_of_it():
    """From exp(-4e7) on: steps that see an exponential are no longer than 0.1."""
    end, steps = march(alone([A, X], [sp.S.One, 1 / (1 + sp.exp(400 * (A - 10**5)))]), 16, [0.0, 0.0], 1e5 + 1.0, 1e-10)
    assert end[1] == pytest.approx(1e5, abs=1e-4)
    assert steps < 300


BESIDE = {
    "tanh(30 x) v": -X - sp.Rational(3, 10) * sp.tanh(30 * X) * V,
    "erf(5 x) v": -X - sp.Rational(3, 10) * sp.erf(5 * X) * V,
    "erf(30 x - 5) x": -X * (1 + sp.Rational(3, 10) * sp.erf(30 * X - 5)) - V / 10,
    "sqrt of erf": -X * sp.sqrt(sp.Rational(3, 2) + sp.erf(20 * X - 2)) - V / 10,
    "erf of erf": -X - sp.erf(30 * sp.erf(10 * X)) * V / 5,
    "tanh(60 x)**2 v": -X - sp.tanh(60 * X) ** 2 * V,
}
"""Rates of v, in which a step lies between a function that is constant there and one that hides it."""


@pytest.mark.parametrize("looped", [False, True], ids=["lines", "loops"])
@pytest.mark.parametrize("case", BESIDE)
def test_a_step_beside_a_factor_is_seen(case, looped):
    field = sp.lambdify([X, V], [V, BESIDE[case]], ["scipy", "numpy"])
    exact = solve_ivp(lambda _, y: field(*y), (0.0, 12.0), [0.37, 0.1], "DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
    end, _ = march(alone([X, V], [V, BESIDE[case]]), 16, [0.37, 0.1], 12.0, 1e-8, looped=looped)
    assert np.asarray(end)[:2] == pytest.approx(exact, abs=1e-6)


def test_a_choice_by_what_rests_passes_nothing():
    """The third state does not move: it is a constant of the step, as a parameter is."""
    chosen = sp.Piecewise((sp.sin(A), V > 0), (sp.cos(A), True))
    result = run(alone([A, X, V], [sp.S.One, chosen, sp.S.Zero]), [0.0, 0.0, 2.0], 1.0, 1e-10)
    assert result[1] == pytest.approx(1.0 - math.cos(1.0), abs=1e-9)


def test_a_kink_of_a_wave_is_found_where_the_state_rests():
    """x' = max(0, sin a - 9/10) from x = 0: nothing moves x until the kink, which the polynomial of sin a must find."""
    end = run(alone([A, X], [sp.S.One, sp.Max(0, sp.sin(A) - sp.Rational(9, 10))]), [0.0, 0.0], 10 * math.pi, 1e-10)
    edge = math.asin(0.9)
    assert end[1] == pytest.approx(5 * (2 * math.cos(edge) - 0.9 * (math.pi - 2 * edge)), abs=1e-8)


@pytest.mark.parametrize("looped", [False, True], ids=["lines", "loops"])
def test_the_root_of_what_has_run_out_is_no_number(looped):
    """x' = -sqrt(x) is (1 - t/2)**2 up to t = 2, and its series go on: a tank cannot run empty and fill again."""
    tank = alone([X], [-sp.sqrt(X)])
    _, reach = Text(tank, 12, looped).step(np.ones(1), np.float64(0.0), math.inf, 2.0, 1e-10, 1e-11)
    assert np.isnan(reach)
    order = order_for(1e-9, 1e-10)
    assert march(tank, order, [1.0], 1.5, 1e-9, looped=looped)[0][0] == pytest.approx(0.0625, abs=1e-9)
    assert np.isnan(march(tank, order, [1.0], 3.0, 1e-9, looped=looped)[0][0])


@pytest.mark.parametrize("rate", [-3 * X ** sp.Rational(2, 3), -4 * X ** sp.Rational(3, 4), -sp.S.One, -1 / X])
def test_powers_and_poles_are_not_passed(rate):
    extra = [sp.log(X)] if rate == -1 else []
    equations = alone([X, V][: 1 + len(extra)], [rate, *extra])
    assert np.isnan(run(equations, [1.0, 0.0][: 1 + len(extra)], 3.0, 1e-9)).all()


@pytest.mark.parametrize(
    ("rates", "watched"),
    [
        ([V, -sp.sin(X) - V / 10 + sp.cos(T)], False), ([V, X - X**3], False), ([X * V, 1 - X**2 * V], False),
        ([V, sp.exp(-X)], True), ([V, -(X**5)], True), ([V, -sp.atan(10 * X)], True), ([V, sp.exp(-(T**2))], True),
    ],
)  # fmt: skip
def test_polynomials_and_waves_pay_nothing(rates, watched):
    assert ("unseen" in step_of(alone([X, V], rates), 16).text) == watched
