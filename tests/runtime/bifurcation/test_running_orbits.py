"""Orbits on which angles turn all the way round: Josephson junctions phi'' = I - sin phi - beta phi'."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import synchain as sc

RATES = {"phi": "w", "w": "(1.5 - sin(phi))/T**2 - 0.3*w/T"}


def junction(unit: float) -> sc.Field:
    """A junction with another unit of time."""
    return sc.Field(RATES, parameters={"T": unit}, initial={"phi": 0, "w": 5 / unit})


@pytest.fixture(scope="module")
def right() -> tuple[float, float]:
    """The period and the multiplier: over the angle the energy obeys an equation of the first order, w w' = …"""

    def over_angle(phi: float, y: np.ndarray) -> list[float]:
        w, t = y[0], 1 / y[0]
        return [(1.5 - np.sin(phi) - 0.3 * w) / w, t]

    w = 5.0
    for _ in range(80):
        turn = solve_ivp(over_angle, (0, 2 * np.pi), [w, 0.0], method="DOP853", rtol=1e-12, atol=1e-12)
        w = turn.y[0, -1]
    return float(turn.y[1, -1]), float(np.exp(-0.3 * turn.y[1, -1]))  # the divergence is -beta


@pytest.mark.parametrize("unit", [1.0, 1e-6, 1e6])
def test_a_running_junction_is_periodic(unit: float, right: tuple[float, float]) -> None:
    orbit = sc.periodic_orbit(sc.Scene(junction(unit), None, transient=60))
    assert orbit.period / unit == pytest.approx(right[0], rel=1e-10)
    np.testing.assert_allclose(np.sort(orbit.multipliers.real), [right[1], 1], rtol=1e-8)
    assert abs(orbit.state[0]) <= np.pi


def test_exponents_know_the_running_orbit(right: tuple[float, float]) -> None:
    scene = sc.Scene(junction(1.0), "phi->w", sc.graphs.chain(2), transient=60)
    exponents = sc.exponents(scene, [0.0])
    assert exponents.motions == ("periodic",) * len(exponents.motions)
    assert abs(float(exponents.exponent[0])) < 1e-6


def test_junctions_a_whole_turn_apart_are_synchronous() -> None:
    pull = sc.Rates({"w": "K*W*sin(phi_j - phi_i)"}, {"K": 0.2})
    scene = sc.Scene(junction(1.0), pull, sc.graphs.ring(4), transient=60, initial={"phi": [0, 1.57, 3.14, 4.71]})
    assert sc.periodic_orbit(scene).pattern == "synchronous"


def test_junctions_that_repel_each_other_follow_at_a_third_of_a_period() -> None:
    push = sc.Rates({"w": "-K*W*sin(phi_j - phi_i)"}, {"K": 0.2})
    scene = sc.Scene(junction(1.0), push, sc.graphs.ring(3), transient=200, initial={"phi": [0, 2, 4]})
    assert sc.periodic_orbit(scene).pattern.startswith(
        "travelling wave: each node moves as the one before it, 1/3 of a"
    )
