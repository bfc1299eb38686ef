"""Undriven motion in slow units of time: rest is told by the slopes of rates, and averages that see no turn say so."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable

import numpy as np
import pytest

from synchain.models import Field, Scene, chain
from synchain.runtime import exponents, lyapunov_spectrum
from synchain.runtime.stability.limit_cycle import rests

VAN_DER_POL = Field({"x": "v/T0", "v": "(-x + (1 - x**2)*v)/T0"}, parameters={"T0": 1.0}, initial={"x": 1.0, "v": 0.0})
PAIR = Scene(VAN_DER_POL, "x->v", chain(2))
FOUND = r"found an orbit that has neither turned nor settled in the average of \d+ units of time, its fastest rate is \S+; expected"


@pytest.mark.parametrize(
    "average",
    [lambda t: exponents(PAIR, [0.0], starts=1, T0=t), lambda t: lyapunov_spectrum(PAIR.replace(topology=None), T0=t)],
)
def test_an_average_within_which_nothing_turns_says_so(average: Callable[[float], object]) -> None:
    for slow in (1e3, 1e10):
        with pytest.warns(RuntimeWarning, match=FOUND) as caught:
            average(slow)
        assert all("\n" not in str(one.message) for one in caught)


def test_a_slow_orbit_does_not_rest() -> None:
    with pytest.warns(RuntimeWarning, match=re.escape("neither turned nor settled")):
        found = exponents(PAIR, [0.0, 1e-10], T0=1e10)
    assert {a.kind for a in found.attractors} == {"aperiodic"}


@pytest.mark.parametrize("slow", [1e-3, 1.0, 1e2])
def test_sane_units_of_time_raise_no_alarm(slow: float) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = exponents(PAIR, [0.0, 0.3 / slow], starts=1, transient=max(1, round(3 * slow)), T0=slow)
        lyapunov_spectrum(PAIR.replace(topology=None), transient=1, periods=max(10, 10 * slow), precision=0, T0=slow)
    assert found.exponent * slow == pytest.approx([0.0, 6.502e-3], abs=1e-5)


@pytest.mark.parametrize("unit", [1e-12, 1.0, 1e12])
@pytest.mark.parametrize("beside", [0.0, 1e9])
def test_rest_does_not_depend_on_units_of_time_nor_on_what_stands_beside(unit: float, beside: float) -> None:
    """A double well with damping beside a large constant."""

    def rates(state: np.ndarray) -> np.ndarray:
        x, v, z = state
        return unit * np.array([v, x - x**3 - 0.5 * v, beside - z])

    assert rests(rates, np.array([1.0 + 1e-10, -1e-10, beside]), 1e-9)
    assert rests(rates, np.array([0.0, 0.0, beside]), 1e-9)
    assert not rests(rates, np.array([1.0 + 1e-6, 0.0, beside]), 1e-9)
    assert not rests(rates, np.array([1.0, 1e-6, beside]), 1e-9)
