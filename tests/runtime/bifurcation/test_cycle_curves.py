"""Curves of bifurcations of cycles in two parameters, against closed forms (C) and collocation (F)."""

from __future__ import annotations

import numpy as np
import pytest
from test_followed_cycles import stick_slip, wave

import synchain as sc

TURN = {"x": "x*(q - x**2 - y**2) - y", "y": "y*(q - x**2 - y**2) + x"}
"""A cycle of radius sqrt(q) and period 2 pi."""

HALF = {
    "u": "(p + x/2 - u**2 - w**2)*u + y*w/2 - w/2",
    "w": "(p - x/2 - u**2 - w**2)*w + y*u/2 + u/2",
}
"""Deviations u, w from this cycle, which turn by half a turn in a period."""

DUFFING = sc.Field({"x": "v", "v": "-x - x**3 - v/10 + F*cos(w*t)"}, parameters={"w": 1.2, "F": 0.3})


def cycle(rates: dict[str, str], **parameters: float) -> sc.results.PeriodicOrbit:
    start = dict.fromkeys(rates, 0.0) | {"x": 1.0}
    return sc.periodic_orbit(sc.Scene(sc.Field(rates, parameters=parameters), initial=start))


def test_folds_of_cycles_meet_in_a_cusp() -> None:
    """r' = r (b + c s + 3 s^2 - s^3), s = r^2: folds at c = 3 s^2 - 6 s, cusp at s = 1 (C)."""
    s = "(x**2 + y**2)"
    growth = f"(b + c*{s} + 3*{s}**2 - {s}**3)"
    first = cycle({"x": f"x*{growth} - y", "y": f"y*{growth} + x"}, b=1, c=-2.8)
    fold = sc.follow(first, "b", to=0.7).points["fold"][0]
    curve = sc.follow(fold, ("b", "c"), within={"c": (-3.3, -2.75)})
    squares = (curve.states**2).sum(axis=1)
    np.testing.assert_allclose(curve.values[:, 1], 3 * squares**2 - 6 * squares, atol=1e-11)
    np.testing.assert_allclose(curve.values[:, 0], 3 * squares**2 - 2 * squares**3, atol=1e-11)
    (cusp,) = curve.points["cusp"]
    np.testing.assert_allclose(cusp.values, [1, -3], atol=1e-10)
    np.testing.assert_allclose(curve.periods, 2 * np.pi, atol=1e-11)
    assert curve.ends == ("c = -2.75", "c = -2.75")


@pytest.mark.parametrize("unit", [1.0, 1e-4])
def test_folds_of_cycles_end_where_the_cycle_vanishes(unit: float) -> None:
    """r' = r (m + l r^2 - r^4): folds at m = -l^2/4, r^2 = l/2, which end in the Bautin point at m = l = 0 (C)."""
    s = f"((x**2 + y**2)/{unit**2})"
    rates = {"x": f"x*(m + l*{s} - {s}**2) - y", "y": f"y*(m + l*{s} - {s}**2) + x"}
    scene = sc.Scene(sc.Field(rates, parameters={"m": -0.1, "l": 1}))
    first = sc.periodic_orbit(scene, start=[0.95 * unit, 0], period=6)
    fold = sc.follow(first, "m", to=-1).points["fold"][0]
    curve = sc.follow(fold, ("m", "l"), within={"l": (-0.5, 2)})
    np.testing.assert_allclose(curve.values[:, 0], -(curve.values[:, 1] ** 2) / 4, atol=1e-12)
    np.testing.assert_allclose((curve.states**2).sum(axis=1) / unit**2, curve.values[:, 1] / 2, atol=1e-7)
    assert curve.values[:, 1].min() > 0.0
    (end,) = curve.special
    assert end.kind == "Bautin"
    np.testing.assert_allclose(end.values, [0, 0], atol=1e-8)
    assert sorted(each.split(" at ")[0] for each in curve.ends) == ["Bautin", "l = 2"]


def test_torus_points_end_in_a_zero_hopf_point() -> None:
    """r' = r (q + z - z^2), z' = p + z^2 - r^2, z = h - 1: the divergence of the cycles q + z = z^2 is 2 z (C)."""
    rise = "(q + (h - 1) - (h - 1)**2)"
    rates = {"x": f"x*{rise} - y", "y": f"y*{rise} + x", "h": "p + (h - 1)**2 - x**2 - y**2"}
    scene = sc.Scene(sc.Field(rates, parameters={"q": -0.01, "p": 0.04}))
    orbit = sc.periodic_orbit(scene, start=[0.19, 0, 1.01], period=6.2)
    (torus,) = sc.follow(orbit, "q", to=0.01).points["torus"]
    curve = sc.follow(torus, ("q", "p"), within={"q": (-1, 1), "p": (-0.3, 0.05)}, direction="down")
    (end,) = curve.points["zero-Hopf"]
    np.testing.assert_allclose(end.values, [0, 0], atol=1e-10)
    assert curve.ends[0].startswith("zero-Hopf at")
    assert "extreme q" not in curve.points  # q is zero to rounding


def test_both_folds_of_a_resonance_lie_on_one_curve() -> None:
    """At F = 0.3 (F); between F and the cusp there is no fold."""
    orbit = sc.periodic_orbit(sc.Scene(DUFFING, initial={"x": 0.5, "v": 0}, transient=100))
    (fold,) = sc.follow(orbit, "w", to=1.9).points["fold"][:1]
    curve = sc.follow(fold, ("w", "F"), within={"F": (0, 0.3)}, direction="down")
    np.testing.assert_allclose(curve.values[0, 0], 1.7797195242986, rtol=1e-12)
    np.testing.assert_allclose(curve.values[-1], [1.3242362007706, 0.3], rtol=1e-12)
    (cusp,) = curve.points["cusp"]
    np.testing.assert_allclose(curve.periods, 2 * np.pi / curve.values[:, 0], rtol=1e-12)
    for share, folds in ((0.99, 0), (1.01, 2)):
        first = sc.periodic_orbit(orbit.scene, w=0.9, F=share * cusp.values[1])
        assert len(sc.follow(first, "w", to=1.3).points["fold"]) == folds


def test_period_doublings_in_closed_form() -> None:
    """Deviations u, w from a cycle of radius sqrt(q) turn by half a turn and grow by p +- sqrt(q)/2 (C)."""
    branch = sc.follow(cycle(TURN | HALF, p=-1, q=1), "p", to=-0.3)
    (doubling,) = branch.points["period doubling"]
    assert doubling.value == pytest.approx(-0.5, abs=1e-12)
    curve = sc.follow(doubling, ("q", "p"), within={"q": (0.3, 2)})
    np.testing.assert_allclose(curve.values[:, 1], -np.sqrt(curve.values[:, 0]) / 2, atol=1e-11)
    assert {curve.values[0, 0], curve.values[-1, 0]} == {0.3, 2.0}
    assert curve.kind == "period doubling"
    assert curve.growing.max() == 0


def test_period_doublings_end_in_a_double_hopf_point() -> None:
    """The cycle shrinks onto the equilibrium at q = 0, where deviations u, w are neutral at p = 0 (C)."""
    first = cycle(TURN | HALF, p=-0.6, q=1)
    (doubling,) = sc.follow(first, "p", to=-0.4).points["period doubling"]
    curve = sc.follow(doubling, ("q", "p"), within={"q": (-0.3, 1.1)}, direction="up")
    (end,) = curve.points["double Hopf"]
    np.testing.assert_allclose(end.values, [0, 0], atol=1e-10)
    assert curve.ends[0].startswith("double Hopf at")


def test_torus_points_and_their_resonances_in_closed_form() -> None:
    """Deviations grow by p - q and turn by 0.3 p in a unit of time: 1:4 at 0.6 pi p = pi/2, 1:3 at 2 pi/3 (C)."""
    around = {"u": "(p - x**2 - y**2 - u**2 - w**2)*u - s*w", "w": "(p - x**2 - y**2 - u**2 - w**2)*w + s*u"}
    around = {name: rate.replace("s*", "0.3*p*") for name, rate in around.items()}
    (torus,) = sc.follow(cycle(TURN | around, p=0.7, q=1), "p", to=1.1).points["torus"]
    curve = sc.follow(torus, ("q", "p"), within={"q": (0.5, 1.2)})
    np.testing.assert_allclose(curve.values[:, 1], curve.values[:, 0], atol=1e-11)
    np.testing.assert_allclose(curve.frequencies, 0.3 * curve.values[:, 1], atol=1e-11)
    resonances = {each.kind: each.values[1] for each in curve.special}
    assert resonances == pytest.approx({"1:4 resonance": 1 / 1.2, "1:3 resonance": 2 / 1.8}, abs=1e-10)


def test_torus_points_of_a_wave_pass_the_known_ones() -> None:
    """(C), from the point at kap = 0.3 to that at b = -1."""
    scene, period = wave(8, 1, 0.3, -1.0)
    orbit = sc.periodic_orbit(scene, start=scene.y0, period=period)
    (torus,) = sc.follow(orbit, "b", to=-1.7).points["torus"]
    curve = sc.follow(torus, ("kap", "b"), within={"b": (-1.7, -1.0)}, direction="up", largest_step=0.2)
    np.testing.assert_allclose(curve.values[[0, -1]], [[0.3, -1.62940545454605], [0.440088365916, -1]], rtol=1e-11)


def test_the_strength_at_which_synchrony_is_lost_is_followed() -> None:
    """Three nodes lose it in a double mode at 2/3 of the strength of two (F); at the end as a run in one parameter."""
    pull = sc.Rates({"v": "k*W*(x_j - x_i)"}, {"k": 0.1 / 3})
    scene = sc.Scene(DUFFING, pull, sc.graphs.ring(3), initial={"x": 0.5, "v": 0}, transient=100)
    orbit = sc.periodic_orbit(scene)
    lost = sc.follow(orbit, "w", to=1.9).points["branch point"][0]
    assert lost.multiplicity == 2
    curve = sc.follow(lost, ("k", "w"), within={"k": (0.02, 0.1)}, direction="up")
    np.testing.assert_allclose(curve.values[0], [0.1 / 3, 1.68034293778], rtol=1e-10)
    assert curve.ends == ("k = 0.02",)
    again = sc.follow(sc.periodic_orbit(scene, k=0.02), "w", to=1.9).points["branch point"][0]
    assert curve.values[-1, 1] == pytest.approx(again.value, abs=1e-10)


def test_what_has_no_curve_is_refused() -> None:
    (doubling,) = sc.follow(sc.periodic_orbit(stick_slip(0.8)), "sigma", to=1.0).points["period doubling"]
    with pytest.raises(ValueError, match="found set-valued friction, stops or resets in two parameters"):
        sc.follow(doubling, ("sigma", "nu"), within={"sigma": (0.5, 1.0)})
