"""Undriven motion in slow units of time: rest is told by the slopes of rates, and averages that see no turn say so."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from synchain import Field, Scene, exponents, lyapunov_spectrum
from synchain.graphs import chain
from synchain.runtime.stability.motion import RateFunctions, rests

VAN_DER_POL = Field({"x": "v/T0", "v": "(-x + (1 - x**2)*v)/T0"}, parameters={"T0": 1.0}, initial={"x": 1.0, "v": 0.0})
PAIR = Scene(VAN_DER_POL, "x->v", chain(2))


@pytest.mark.parametrize("slow", [1e-6, 1e3, 1e10])
def test_a_spectrum_counts_turns_of_the_motion(slow: float) -> None:
    """The second exponent of the limit cycle is its mean divergence, by quadrature along it."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = lyapunov_spectrum(PAIR.replace(topology=None), T0=slow, periods=64, transient=20)
    np.testing.assert_allclose(result.exponent * slow, [0.0, -1.0594], atol=1e-3)


def test_a_slow_orbit_is_followed_for_as_many_turns_as_a_fast_one() -> None:
    result = exponents(PAIR, [0.0, 0.3e-10], starts=2, T0=1e10)
    assert [a.kind for a in result.attractors] == ["periodic"] * 2
    assert result.exponent * 1e10 == pytest.approx([0.0, 6.502e-3], abs=1e-5)


@pytest.mark.parametrize("slow", [1e-3, 1.0, 1e2])
def test_sane_units_of_time_raise_no_alarm(slow: float) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = exponents(PAIR, [0.0, 0.3 / slow], starts=1, transient=max(1, round(3 * slow)), T0=slow)
        lyapunov_spectrum(PAIR.replace(topology=None), transient=1, periods=max(10, 10 * slow), precision=0, T0=slow)
    assert result.exponent * slow == pytest.approx([0.0, 6.502e-3], abs=1e-5)


@pytest.mark.parametrize("unit", [1e-12, 1.0, 1e12])
@pytest.mark.parametrize("beside", [0.0, 1e9])
@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
def test_rest_does_not_depend_on_units_nor_on_what_stands_beside(unit: float, beside: float, size: float) -> None:
    """A double well with damping beside a large constant."""

    def values(state: np.ndarray) -> np.ndarray:
        x, v, z = state / size
        return unit * size * np.array([v, x - x**3 - 0.5 * v, beside - z])

    def sizes(state: np.ndarray) -> np.ndarray:
        x, v, z = np.abs(state / size)
        return unit * size * np.array([v, x + x**3 + 0.5 * v, beside + z])

    def at_rest(*state: float) -> bool:
        return rests(RateFunctions(values, sizes), size * np.array(state), 1e-9, size * np.ones(3))

    assert at_rest(1.0 + 1e-10, -1e-10, beside)
    assert at_rest(0.0, 0.0, beside)
    assert not at_rest(1.0 + 1e-6, 0.0, beside)
    assert not at_rest(1.0, 1e-6, beside)
