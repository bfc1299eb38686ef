"""Limit cycles of undriven oscillators: their exponents are eigenvalues of a period, not averages."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from catalogue import VAN_DER_POL
from scipy.integrate import solve_ivp

from synchain import Field, Scene, exponents, msf, open_result, periodic_orbit
from synchain.graphs import chain
from synchain.runtime.stability.orbits import OrbitProblem


def pair(mu: float, **settings: object) -> Scene:
    return Scene(VAN_DER_POL, "v->v", chain(2), initial={"x": 1, "v": 0.1}, parameters={"mu": mu}, **settings)


@cache
def floquet(mu: float, alphas: tuple[float, ...] = (0.0, 0.1, 0.5)) -> tuple[float, list[float]]:
    """The period, and the largest exponents of modes, by SciPy."""

    def both(_: float, z: np.ndarray, alpha: float) -> np.ndarray:
        x, v = z[:2]
        matrix = np.array([[0.0, 1.0], [-2.0 * mu * x * v - 1.0, mu * (1.0 - x * x) - alpha]])
        return np.concatenate([[v, mu * (1.0 - x * x) * v - x], (matrix @ z[2:].reshape(2, 2)).ravel()])

    def rates(_: float, z: np.ndarray) -> list[float]:
        return [z[1], mu * (1.0 - z[0] * z[0]) * z[1] - z[0]]

    def turn(_: float, z: np.ndarray) -> float:
        return float(z[1])

    turn.direction = -1  # type: ignore[attr-defined]
    tight = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}
    turns = solve_ivp(rates, (0.0, 400.0 if mu < 1 else 60.0), [2.0, 0.0], events=turn, **tight)
    (*_, before, last), state = turns.t_events[0], turns.y_events[0][-1]
    collected = []
    for alpha in alphas:
        end = solve_ivp(both, (0.0, last - before), [*state, 1.0, 0.0, 0.0, 1.0], args=(alpha,), **tight).y[2:, -1]
        collected.append(float(np.log(np.abs(np.linalg.eigvals(end.reshape(2, 2))).max()) / (last - before)))
    return float(last - before), collected


@pytest.mark.parametrize("mu", [0.1, 1.0, 10.0])
def test_exponents_along_a_cycle_are_eigenvalues(mu: float) -> None:
    result = exponents(pair(mu), [0.0, 0.1, 0.5], starts=3, rtol=1e-9)
    assert [attractor.kind for attractor in result.attractors] == ["periodic"] * 3
    period, expected = floquet(mu)
    np.testing.assert_allclose([attractor.cycle for attractor in result.attractors], period, rtol=1e-8)
    np.testing.assert_allclose(result.exponent, expected, atol=1e-8)
    assert result.stderr.max() < 1e-7


def test_a_drive_of_amplitude_zero_is_none() -> None:
    """The shipped oscillator has one, at any frequency; with an amplitude it is a drive."""
    shipped = Scene("van_der_pol", "v->v", chain(2), initial={"x": 1, "v": 0.1}, parameters={"omega": 1.7})
    period, expected = floquet(1.0)
    cycle = periodic_orbit(shipped)
    assert cycle.period == pytest.approx(period, rel=1e-9)
    result = exponents(shipped, [0.0, 0.1, 0.5], starts=1, rtol=1e-9)
    np.testing.assert_allclose(result.exponent, expected, atol=1e-8)


@pytest.mark.parametrize(("omega", "centre"), [(0.02, 0.0), (2.0, 0.0), (1e3, 0.0), (1.0, 1e3)])
def test_any_unit_of_time_and_any_place(omega: float, centre: float) -> None:
    """z' = omega (1 + 2 i - |z|^2) z with both parts coupled: -alpha, beside the 0 of the motion itself."""
    x = "(x - c)"
    node = Field(
        {"x": f"o*({x} - 2*y - ({x}**2 + y**2)*{x})", "y": f"o*(2*{x} + y - ({x}**2 + y**2)*y)"},
        parameters={"o": omega, "c": centre},
    )
    scene = Scene(node, "x->x, y->y", chain(2), initial={"x": centre + 0.5, "y": 0.1})
    result = exponents(scene, np.array([0.0, 0.3]) * omega, transient=round(max(20.0, 10.0 / omega)), starts=2)
    np.testing.assert_allclose(result.attractors[0].cycle, np.pi / omega, rtol=1e-6)
    np.testing.assert_allclose(result.exponent, [0.0, -0.3 * omega], atol=2e-6 * omega)


@pytest.mark.parametrize(("c", "turns"), [(2.5, 1), (3.5, 2), (4.0, 4)])
def test_doubled_periods_of_rossler(c: float, turns: int) -> None:
    scene = Scene("rossler", "x->x", chain(2), parameters={"a": 0.2, "b": 0.2, "c": c})
    result = exponents(scene, [0.0, 0.3], transient=2000, starts=1, rtol=1e-8)
    assert result.attractors[0].kind == "periodic"
    assert round(result.attractors[0].cycle / 5.8) == turns
    assert abs(result.exponent[0]) < 1e-6


@pytest.mark.parametrize(
    "scene",
    [
        lambda: Scene("rossler", "x->x", chain(2), parameters={"a": 0.2, "b": 0.2, "c": 9.0}),
        lambda: Scene("lorenz", "x->x", chain(2)),
        lambda: Scene("pendulum", topology=chain(2)),
    ],
)
def test_chaos_and_conservative_orbits_are_averaged(scene: Callable[[], Scene]) -> None:
    """Chaos comes near its unstable cycles, and every orbit of a pendulum is a cycle; neither attracts."""
    result = exponents(scene(), [0.0, 0.2], periods=64, starts=4)
    assert {attractor.kind for attractor in result.attractors} == {"aperiodic"}


def test_windows_of_a_cycle_begin_at_zero() -> None:
    function = msf(pair(1.0), np.linspace(0.0, 2.0, 21))
    assert [low for low, _ in function.intervals] == pytest.approx([0.0], abs=1e-6)


def test_periodic_orbits_of_undriven_oscillators(tmp_path: Path) -> None:
    period, (_, weak, strong) = floquet(1.0)
    orbit = periodic_orbit(pair(1.0).lone)
    assert orbit.period == pytest.approx(period, rel=1e-10)
    assert orbit.stable
    assert orbit.multipliers[0] == pytest.approx(1.0, abs=1e-10)
    for alpha, exponent in ((0.1, weak), (0.5, strong)):
        largest = abs(periodic_orbit(pair(1.0)).transversal_multipliers(alpha)[0])
        assert np.log(largest) / orbit.period == pytest.approx(exponent, abs=1e-10)
    orbit.save(tmp_path / "orbit.nc")
    again = open_result(tmp_path / "orbit.nc")
    assert (again.period, again.stable) == (orbit.period, True)
    assert "period " in str(again)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("mu", "steps"), [(37.0, "auto"), (42.0, "auto"), (300.0, "rodas5p"), (4000.0, "rodas5p")])
def test_relaxation_oscillations_have_their_least_period(mu: float, steps: str) -> None:
    """The period by Dorodnitsyn's series. Jumps are missed by an even clock, and were taken for growth without bound."""
    scene = pair(mu, integrator=steps)
    period = (3.0 - 2.0 * math.log(2.0)) * mu + 7.01432 * mu ** (-1 / 3) - 22.0 / 9.0 * math.log(mu) / mu
    orbit = periodic_orbit(scene)
    assert orbit.period == pytest.approx(period, rel=3e-3)
    assert orbit.residual < 1e-9
    assert exponents(scene, [0.0], starts=1).attractors[0].cycle == pytest.approx(orbit.period, rel=1e-5)


def test_a_return_that_fails_leads_to_the_next_and_to_the_least_period(monkeypatch: pytest.MonkeyPatch) -> None:
    propagators = OrbitProblem.propagators
    failed: list[float] = []

    def fails_twice(orbit: OrbitProblem, integrator: Any, units: float) -> tuple[np.ndarray, np.ndarray]:
        if len(failed) < 2:
            failed.append(units * orbit.unit)
            raise FloatingPointError("the state grew without bound")
        return propagators(orbit, integrator, units)

    expected = periodic_orbit(pair(1.0)).period

    def cycle() -> float:
        return exponents(pair(1.0), [0.0], starts=1, rtol=1e-9).attractors[0].cycle

    monkeypatch.setattr(OrbitProblem, "propagators", fails_twice)
    assert cycle() == pytest.approx(expected, rel=1e-8)
    np.testing.assert_allclose(failed, [expected, 2.0 * expected], rtol=1e-6)


@pytest.mark.parametrize(
    ("scene", "more", "error", "message"),
    [
        (pair(1.0), {"periods": 2}, ValueError, "periods = 2; expected 1 for an oscillator without a drive"),
        (pair(1.0), {"start": [1.0]}, ValueError, "expected a number for each of x, v"),
        (Scene("rossler", "x->x", chain(2)), {}, ArithmeticError, "near the motion after 300 mean return times; start"),
        (Scene("pendulum", topology=chain(2)), {}, ArithmeticError, "no attracting cycle near the motion"),
        (pair(-1.0), {}, ArithmeticError, "no cycle: the motion comes to rest at x_1 = "),
    ],
)
def test_what_has_no_attracting_cycle(scene: Scene, more: dict[str, Any], error: type, message: str) -> None:
    with pytest.raises(error, match=message) as caught:
        periodic_orbit(scene, **more)
    assert "\n" not in str(caught.value)
