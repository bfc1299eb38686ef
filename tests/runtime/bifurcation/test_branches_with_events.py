"""Branches of periodic orbits through impacts: period doubling and graze beside closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy as sp

import synchain as sc
from synchain.runtime.bifurcation.arclength import correct
from synchain.runtime.bifurcation.cycles import Cycles

X, V, T, A = sp.symbols("x v t a")
FINE = {"integrator": "taylor", "record": (), "rtol": 1e-11, "atol": 1e-13}


def lone(node, x: float, v: float, a: float) -> sc.Scene:
    return sc.Scene(
        node, topology=sc.graphs.chain(1), initial={"x": [x], "v": [v]}, parameters={"a": a}, transient=0, **FINE
    )


def test_period_doubling_of_a_bouncing_ball() -> None:
    """One impact a period on the table a sin(wt), g = 1: the trace -(1 + e^2) of the exact flight map.

    With u + v = T/(1 + e) it gives (a w^2)^2 = (2 (1 + e^2)/(1 + e)^2)^2 + (pi (1 - e)/(1 + e))^2.
    """
    e, w = 0.5, 2.0 * math.pi
    doubling = math.hypot(2.0 * (1.0 + e**2) / (1.0 + e) ** 2, math.pi * (1.0 - e) / (1.0 + e)) / w**2
    a = 0.97 * doubling
    phase = math.acos(0.5 * (1.0 - e) / ((1.0 + e) * a * w)) / w  # of the impact, where u = (1 - e)/(1 + e) T/2
    left = 1.0 - phase
    table = sp.sin(2 * sp.pi * T)
    ball = sc.Lagrangian(
        V**2 / 2, X, coordinates={X: V}, parameters={A: a}, events=[sc.Stop(X - A * table, sp.Rational(1, 2))]
    )
    scene = lone(ball, a * math.sin(w * phase) + 0.5 * left - left**2 / 2, 0.5 - left, a)
    branch = sc.follow(sc.periodic_orbit(scene, 1), "a", to=1.02 * doubling)
    (found,) = branch.bifurcations
    assert found.kind == "period doubling"
    assert found.value == pytest.approx(doubling, abs=1e-13)
    doubled = sc.follow(found, "a", to=1.02 * doubling)
    assert doubled[-1].periods == 2
    assert doubled[-1].phases.words == "open jumps, open jumps"


F, W = 3 / 5 * math.hypot(1 - 0.64, 0.08), sp.Rational(4, 5)


def oscillator(phase: float) -> sc.Lagrangian:
    """x'' + x'/10 + x = a cos(4t/5 + phase) with a stop at 3/5, which the motion without impacts touches at a = F."""
    drive = A * sp.cos(W * T + phase) - V / 10
    gap = sp.Rational(3, 5) - X
    return sc.Lagrangian(
        V**2 / 2,
        X**2 / 2,
        {X: drive},
        coordinates={X: V},
        parameters={A: 0.5},
        events=[sc.Stop(gap, sp.Rational(7, 10))],
    )


def test_a_branch_without_impacts_ends_where_it_grazes_the_stop() -> None:
    branch = sc.follow(sc.periodic_orbit(lone(oscillator(0), 0.1, 0.0, 0.2), 1), "a", to=0.3)
    (found,) = branch.bifurcations
    assert found.kind == "grazing"
    assert found.value == pytest.approx(F, abs=1e-9)


def test_a_branch_goes_on_where_an_impact_meets_the_beginning_of_a_period() -> None:
    """At a = 0.3377; the same oscillator with a drive that is shifted by a radian meets no impact there."""
    first = sc.periodic_orbit(lone(oscillator(0), 0.4, -0.5, 0.35).replace(transient=100), 1)
    branch = sc.follow(first, "a", to=0.33)
    assert branch.ends == ("a = 0.33",)
    assert np.all(np.diff(branch.values) < 0.0)
    other = sc.periodic_orbit(lone(oscillator(1), 0.4, -0.5, 0.35).replace(transient=100), 1)
    shifted = sc.follow(other, "a", to=0.33)
    np.testing.assert_allclose(branch[-1].multipliers, shifted[-1].multipliers, rtol=1e-8)
    alone = sc.periodic_orbit(branch[-1].scene, 1, branch[-1].state)
    np.testing.assert_allclose(alone.state, branch[-1].state, atol=1e-10)
    assert {orbit.phases.words for orbit in branch} == {"open jumps"}


@pytest.mark.parametrize("name", ["a", "w"])
def test_the_tangent_of_a_cycle_that_begins_elsewhere_is_that_at_the_drive(name: str) -> None:
    """The difference of the orbits beside it; w moves the period too."""
    gap, rates = sp.Rational(3, 5) - X, {X: A * sp.cos(sp.Symbol("w") * T) - V / 10}
    stop = sc.Stop(gap, sp.Rational(7, 10))
    node = sc.Lagrangian(V**2 / 2, X**2 / 2, rates, coordinates={X: V}, parameters={"a": 0.35, "w": 0.8}, events=[stop])
    orbit = sc.periodic_orbit(sc.Scene(node, initial={"x": 0.4, "v": -0.5}, transient=100))
    problem = Cycles.of(orbit, name, begin=2.0)
    ahead = np.append(np.zeros(2), 1.0)
    point = correct(problem, problem.point, ahead)
    assert point is not None
    tangent = problem.network_tangent(point)
    value, h = orbit.scene.parameters[name], 1e-5
    plus, minus = (sc.periodic_orbit(orbit.scene, 1, orbit.state, **{name: value + d}).state for d in (h, -h))
    np.testing.assert_allclose(tangent[:2] / tangent[2], (plus - minus) / (2 * h), rtol=1e-6)
