"""Lyapunov spectra of stiff equations, whose fast directions are gone long before the end of a block."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import synchain as sc

SHORT = {"periods": 50, "transient": 10}


@pytest.mark.parametrize("k", [100, 10**4, 10**6, 10**9])
def test_a_fast_direction_has_its_exponent(k: int) -> None:
    scene = sc.Scene(sc.Field({"x": "-x", "y": "-k*y"}, parameters={"k": k}, initial={"x": 1, "y": 1}), "x->x")
    result = sc.lyapunov_spectrum(scene, periods=10, transient=10)  # the rates are constant
    assert result.resolved.all()
    np.testing.assert_allclose(result.exponent, [-1.0, -k], rtol=1e-8)


def test_fast_and_slow_directions_that_are_mixed() -> None:
    """The matrix has the eigenvalues -1, -2 and -30 000; its eigenvectors are not orthogonal."""
    basis = np.array([[1, 2, 0], [0, 1, 3], [1, 0, 1]])
    matrix = basis @ np.diag([-1.0, -2.0, -30000.0]) @ np.linalg.inv(basis)
    names = ("x", "y", "z")
    rates = {a: f"({p:.6f})*x + ({q:.6f})*y + ({r:.6f})*z" for a, (p, q, r) in zip(names, matrix, strict=True)}
    result = sc.lyapunov_spectrum(sc.Scene(sc.Field(rates, initial={"x": 1}), "x->x"), **SHORT)
    np.testing.assert_allclose(result.exponent[:2], [-1.0, -2.0], atol=0.02)  # of the order 1/time
    assert result.exponent.sum() == pytest.approx(-30003.0, rel=1e-9)


def test_several_fast_directions_are_lost_and_their_sum_is_said() -> None:
    rates = {"x": "-x + z", "y": "x - 30000*y", "z": "y - 50000*z"}
    result = sc.lyapunov_spectrum(sc.Scene(sc.Field(rates, initial={"x": 1}), "x->x"), **SHORT)
    assert result.exponent[1:].tolist() == [-np.inf, -np.inf]
    assert result.resolved.tolist() == [True, False, False]
    assert result.exponent[0] == pytest.approx(-1.0, abs=1e-6)
    assert result.rest == pytest.approx(-80000.0, rel=1e-8)
    assert dict(result.summary)["not followed"] == "2 directions, which decay too fast; their exponents sum to -80000"


def test_the_relaxation_oscillator_of_van_der_pol() -> None:
    """The second exponent is the mean divergence along the cycle, here by SciPy's LSODA."""
    mu = 20.0
    oscillator = sc.Field({"x": "v", "v": "20*(1 - x**2)*v - x"}, initial={"x": 2})
    result = sc.lyapunov_spectrum(sc.Scene(oscillator, "x->x"), periods=64, transient=10)

    def rates(_: float, s: np.ndarray) -> list[float]:
        return [s[1], mu * (1 - s[0] ** 2) * s[1] - s[0], mu * (1 - s[0] ** 2)]

    def section(_: float, s: np.ndarray) -> float:
        return float(s[1])

    section.direction = -1  # type: ignore[attr-defined]
    solution = solve_ivp(rates, (0, 200), [2.0, 0.0, 0.0], "LSODA", events=section, rtol=1e-9, atol=1e-12)
    (a, b), (first, last) = solution.t_events[0][-2:], solution.y_events[0][-2:, 2]
    assert result.exponent[1] == pytest.approx((last - first) / (b - a), rel=0.02)  # the window holds no whole cycles
    assert abs(result.exponent[0]) < 2 * result.stderr[0] + 0.01
    assert result.exponent.sum() == pytest.approx(result.divergence, rel=1e-9)


@pytest.mark.parametrize("rtol", [1e-4, 1e-2])
def test_a_tolerance_out_of_which_no_direction_stands_is_refused(rtol: float) -> None:
    with pytest.raises(ValueError, match=rf"rtol: found {rtol:g}; expected at most 1e-05 for a whole spectrum"):
        sc.lyapunov_spectrum(sc.Scene("rossler"), rtol=rtol)
