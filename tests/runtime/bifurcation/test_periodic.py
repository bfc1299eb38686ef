"""Periodic orbits by Newton's method against closed forms, and bifurcations on their branches."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from scipy.special import ellipk

from synchain.models.definitions.inline import Field
from synchain.models.graphs.families import topology
from synchain.models.scenes.scene import Scene
from synchain.runtime.bifurcation.branches import follow
from synchain.runtime.bifurcation.cycles import Cycles
from synchain.runtime.bifurcation.periodic import periodic_orbit, stability_end
from synchain.runtime.bifurcation.periodic_result import PeriodicOrbit
from synchain.runtime.bifurcation.skeleton import skeleton

PAIR = topology("chain", 2)


def scene(**more: object) -> Scene:
    return Scene(**{"topology": PAIR, "contact": "set-valued", "initial": {"x": 0.3}, **more})  # type: ignore[arg-type]


@pytest.mark.long
def test_den_hartogs_motion() -> None:
    """x'' + x + r sgn x' = cos(beta t), no stops: amplitude sqrt(V^2 - r^2 U^2) (Phil. Mag. 9, 801 (1930))."""
    beta, r = 1.4, 0.3
    v, u = 1 / (1 - beta**2), np.sin(np.pi / beta) / (beta * (1 + np.cos(np.pi / beta)))
    amplitude = np.sqrt(v**2 - (r * u) ** 2)
    s = scene(
        friction="coulomb",
        parameters={"theta_b": 0.0, "epsilon": 1.0, "mu": r, "u": 1.0, "omega": beta},
        transient=200.0,
    )
    orbit = periodic_orbit(s.lone)
    assert orbit.residual < 1e-13
    assert orbit.stable
    # the phase at the beginning of a period is where the drive is largest: sin phi = -r U / V
    phase = np.arctan2(-r * u / v, np.sign(v) * np.sqrt(1 - (r * u / v) ** 2))
    turning = phase / beta  # time of the turning point, where x is largest
    assert abs(orbit.state[0]) < amplitude
    later = _position(s, orbit.state, turning % (2 * np.pi / beta))
    assert abs(abs(later) - amplitude) < 1e-11


def _position(s: Scene, state: np.ndarray, length: float) -> float:
    from synchain.runtime.sweeps.run import run

    one = s.replace(
        topology=topology("chain", 1), transient=0.0, window=length, time_unit="time", record=(), rtol=1e-12
    )
    return float(run(one, x_1=float(state[0]), v_1=float(state[1]), show_progress=False).states("end")[0])


def test_a_linear_oscillator_has_the_multipliers_of_its_damping() -> None:
    s = Scene(oscillator="duffing", topology=PAIR, parameters={"beta": 1e-12, "delta": 0.2, "omega": 1.3})
    orbit = periodic_orbit(s)
    expected = np.exp(-0.1 * 2 * np.pi / 1.3)
    np.testing.assert_allclose(np.abs(orbit.multipliers), expected, rtol=1e-9)


def test_the_end_of_the_stable_range_to_rounding() -> None:
    """omega = 1.15, period two: the smoothed law approaches the exact one, and another start gives the same ten
    digits."""
    exact = stability_end(periodic_orbit(scene(), 2, omega=1.15), 0.4, 0.5)
    again = stability_end(periodic_orbit(scene(initial={"x": [0.1, 0.1]}, transient=401.0), 2, omega=1.15), 0.4, 0.5)
    assert abs(exact - again) < 1e-10
    gaps = [
        abs(stability_end(periodic_orbit(scene(contact="atan"), 2, omega=1.15, kappa=k), 0.4, 0.5) - exact)
        for k in (1e5, 1e7, 1e9)
    ]
    assert gaps[0] > 50 * gaps[1]
    assert gaps[2] < 1e-6
    with pytest.raises(ValueError, match="expected a change between them"):
        stability_end(periodic_orbit(scene(), 2, omega=1.15), 0.6, 0.7)


@pytest.mark.parametrize("ground", [0.1, 0.01])
def test_an_orbit_is_found_from_a_start_that_sticks_for_a_whole_period(ground: float) -> None:
    """The map of a period only shifts such a start by ground * period: Newton's method has no direction to go there."""
    s = scene(parameters={"omega": 1.15, "theta_b": ground}).lone
    length = 2 * np.pi / 1.15
    start = np.array([0.04373869 if ground == 0.1 else 0.4, ground])
    problem = Cycles.near(s, (), (0,), start[None], length, 1)
    gap, matrix = problem.linearise(start)
    np.testing.assert_allclose(gap, [ground * length, 0.0], rtol=1e-12)
    np.testing.assert_array_equal(matrix + np.eye(2), [[1.0, 0.0], [0.0, 0.0]])
    orbit = periodic_orbit(s, 1, start)
    assert orbit.residual < 1e-13
    assert np.abs(problem.linearise(orbit.state)[0]).max() < 1e-13


@pytest.mark.parametrize("turns", [1, -3])
def test_an_orbit_of_an_angle_passes_through_its_states_some_turns_away(turns: int) -> None:
    pendulum = Field({"x": "v", "v": "-sin(x) - v/5 + u*cos(w*t)"}, parameters={"u": 0.1, "w": 1.2})
    orbit = periodic_orbit(Scene(pendulum, None, initial={"x": 0.5, "v": 0.1}, transient=20.0))
    assert orbit.meets(orbit.state + np.array([2 * np.pi * turns, 0.0]))
    assert not orbit.meets(orbit.state + np.array([2 * np.pi * turns + 1e-3, 0.0]))
    assert not orbit.meets(orbit.state + np.array([0.0, 2 * np.pi * turns]))
    spring = Field({"x": "v", "v": "-x - v/5 + u*cos(w*t)"}, parameters={"u": 0.1, "w": 1.2})
    orbit = periodic_orbit(Scene(spring, None, initial={"x": 0.5, "v": 0.1}, transient=20.0))
    assert not orbit.meets(orbit.state + np.array([2 * np.pi * turns, 0.0]))


CIRCLE = Field({"x": "x*(1 - x**2 - y**2) - y", "y": "y*(1 - x**2 - y**2) + x"}, initial={"x": 1.1, "y": 0})


@pytest.mark.parametrize("turns", [2, 3, 1501])
def test_a_multiple_of_the_period_leads_to_the_period(turns: int) -> None:
    orbit = periodic_orbit(Scene(CIRCLE, None), period=2 * np.pi * turns)
    assert orbit.period == pytest.approx(2 * np.pi, abs=1e-11)
    np.testing.assert_allclose(orbit.multipliers, [1.0, np.exp(-4 * np.pi)], atol=1e-10)


def test_a_whole_turn_is_the_period_of_a_rotation() -> None:
    """x'' = 3/2 - sin x - x'/2: the velocity decays at the rate 1/2."""
    rotor = Scene(Field({"x": "v", "v": "3/2 - sin(x) - v/2"}, initial={"x": 0, "v": 3}), None)
    orbit = periodic_orbit(rotor, period=6.3)
    assert orbit.period == pytest.approx(periodic_orbit(rotor).period, abs=1e-11)
    assert orbit.multipliers[1].real == pytest.approx(np.exp(-0.5 * orbit.period), abs=1e-10)


@pytest.mark.parametrize(("start", "period"), [([0, 0], 6.0), ([1e-12, 0], 1e-3), ([1, 0], 1e-9), ([1, 0], 0.1)])
@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
def test_rest_and_no_time_are_no_orbits(start: list[float], period: float, size: float) -> None:
    rates = {"x": "x*(1 - (x**2 + y**2)/S**2) - y", "y": "y*(1 - (x**2 + y**2)/S**2) + x"}
    scene = Scene(Field(rates, parameters={"S": size}), None)
    with pytest.raises(ArithmeticError, match="no orbit near the start with a period near"):
        periodic_orbit(scene, start=[size * x for x in start], period=period)


def test_members_of_a_family_are_neutral_and_near_the_start() -> None:
    pendulum = Scene(Field({"x": "v", "v": "-sin(x)"}, initial={"x": 1, "v": 0}), None)
    orbit = periodic_orbit(pendulum, period=6.7)
    assert orbit.period == pytest.approx(4 * ellipk(np.sin(0.5) ** 2), abs=1e-4)
    assert np.abs(orbit.state[0]) == pytest.approx(1.0, abs=1e-3)
    assert orbit.verdict == "one oscillator: neutral"
    assert not orbit.stable
    assert orbit.growing == 0


@pytest.mark.long
def test_a_period_doubling_is_found_where_the_double_period_is_born() -> None:
    first = periodic_orbit(scene().lone, 2, omega=1.2)
    branch = follow(first, "omega", values=np.linspace(1.2, 1.24, 5))
    (change,) = branch.bifurcations
    at, kind = change.value, change.kind
    assert kind == "period doubling"
    assert [orbit.stable for orbit in branch.orbits] == [bool(value < at) for value in branch.values]
    far = scene(transient=3000.0).lone
    gaps = []
    for value in (at - 0.002, at + 0.002):
        twice = periodic_orbit(far, 2, branch.orbits[int(np.abs(branch.values - 1.22).argmin())].state, omega=value)
        gaps.append(np.abs(periodic_orbit(far, 4, omega=value).state - twice.state).max())
    below, above = gaps
    assert below < 1e-9  # the period of four is that of two below, and another motion above
    assert above > 1e-3


def coulomb(drive: float) -> Scene:
    """The exponential law without a fall is Coulomb's; a block on ground at rest."""
    values = {"theta_b": 0.0, "epsilon": 1.0, "mu_s": 0.3, "mu_k": 0.3, "omega": 1.4, "u": drive}
    return scene(parameters=values, transient=100.0).lone


@pytest.mark.long
def test_stops_begin_where_den_hartogs_motion_ends() -> None:
    """No stops while X beta^2 >= r: V beta^2 = r sqrt(1 + U^2 beta^4)/P, P the drive (Phil. Mag. 9, 801 (1930))."""
    beta, r = 1.4, 0.3
    v, u = 1 / (1 - beta**2), np.sin(np.pi / beta) / (beta * (1 + np.cos(np.pi / beta)))
    last = r * np.sqrt(1 + u**2 * beta**4) / (abs(v) * beta**2)
    first = periodic_orbit(coulomb(1.2 * last))
    assert first.phases is not None
    assert first.phases.slip_states == (-1, 1)
    branch = follow(first, "u", values=np.linspace(1.2 * last, 0.9 * last, 3))
    (change,) = branch.bifurcations
    at, kind = change.value, change.kind
    assert kind == "stick loss"
    assert at == pytest.approx(last, abs=1e-8)
    assert branch.bifurcations[0].residual < 1e-8
    ends = [orbit.phases for orbit in (branch.orbits[0], branch.orbits[-1])]
    assert [phases and len(phases.slip_states) for phases in ends] == [2, 4]
    load = np.sqrt((v * branch.values[0]) ** 2 - (r * u) ** 2) * beta**2  # at the turning point
    assert ends[0] is not None
    assert ends[0].landing == pytest.approx(r - load, abs=1e-9)


@pytest.mark.long
def test_a_branch_goes_through_a_graze_to_its_fold() -> None:
    """omega = 0.7: as the drive grows the load in stick of period one comes up to the limit of static friction, at the rate
    at which its gap has fallen; beyond, the orbit lets go twice, and ends where it meets another one."""
    network = scene(transient=60.0, parameters={"omega": 0.7, "u": 0.15}).lone
    branch = follow(periodic_orbit(network), "u", values=[0.15, 0.45, 0.5, 0.55], direction="up")
    kinds = [each.kind for each in branch.bifurcations]
    assert kinds[:4] == ["period doubling", "grazing", "period doubling", "fold"]
    gaps = [orbit.phases.gap for orbit in branch.orbits if orbit.scene.parameters["u"] in (0.45, 0.5) and orbit.phases][
        :2
    ]
    at = branch.bifurcations[1].value
    assert at == pytest.approx(0.5 + 0.05 * gaps[1] / (gaps[0] - gaps[1]), abs=2e-4)
    assert max(each.residual for each in branch.bifurcations[:4]) < 3e-12
    assert [len(each.orbit.phases.slip_states) for each in branch.bifurcations[:4] if each.orbit.phases] == [2, 2, 4, 4]
    edge, turn = branch.bifurcations[3].value, branch.bifurcations[3].solution.state
    with pytest.raises(ArithmeticError):
        periodic_orbit(network, 1, turn, u=edge + 1e-4)


@pytest.mark.long
def test_the_skeleton_of_a_diagram_has_stable_and_unstable_orbits() -> None:
    """Period two loses its stability between 1.2 and 1.24 and lives on; the orbit of period one is followed both ways."""
    result = skeleton(scene(transient=1000.0), "omega", [1.2, 1.22, 1.24], periods=(2,))
    (branch,) = result
    assert {orbit.periods for orbit in branch.orbits} == {2}
    assert branch.stable[[0, -1]].tolist() == [True, False]
    assert [each.kind for each in branch.bifurcations] == ["period doubling"]
    assert branch.bifurcations[0].residual < 1e-9
    assert {orbit.phases.words for orbit in branch.orbits[::8] if orbit.phases} == {"stick, slip +"}


def test_what_is_refused() -> None:
    with pytest.raises(ValueError, match="periods = 0; expected a whole number, at least 1"):
        periodic_orbit(scene(), 0)
    drifting = Field({"x": "1 + cos(t)/2"})
    with pytest.raises(ArithmeticError, match="no orbit of 1 drive period near the start"):
        periodic_orbit(Scene(drifting, None), 1, start=[0.0])


@pytest.mark.parametrize(
    ("call", "kind", "message"),
    [
        (lambda s, o: periodic_orbit(s, 1.5), ValueError, "periods = 1.5; expected a whole number, at least 1"),
        (
            lambda s, o: periodic_orbit(Scene(CIRCLE, None), period=0),
            ValueError,
            "period = 0; expected a number above 0",
        ),
        (lambda s, o: periodic_orbit(s, "2"), ValueError, "periods = '2'; expected a whole number"),
        (lambda s, o: periodic_orbit("figure_3"), TypeError, "'figure_3'.*expected a Scene"),
        (
            lambda s, o: periodic_orbit(s, 2, omga=1.0),
            ValueError,
            "unknown parameter or keyword 'omga' of periodic_orbit; known: theta_b, epsilon, u",
        ),
        (
            lambda s, o: periodic_orbit(s, 2, [0.1]),
            ValueError,
            r"start: found \[0.1\]; expected a number for each of x, v",
        ),
        (lambda s, o: periodic_orbit(s, 2, ["a", 1]), ValueError, "expected a number for each of x, v"),
        (lambda s, o: periodic_orbit(s, 2, np.array([1j, 1])), ValueError, "expected a number for each of x, v"),
        (lambda s, o: periodic_orbit(s, 2, [np.nan, 0]), ValueError, "expected a number for each of x, v"),
        (lambda s, o: stability_end(o, "a", 1), ValueError, "low = 'a'; expected a finite strength alpha"),
        (lambda s, o: stability_end(o, 0.1, np.inf), ValueError, "high = inf; expected a finite strength alpha"),
        (lambda s, o: follow(o, "omga", values=[1.0]), ValueError, "unknown parameter 'omga'; known: theta_b"),
        (lambda s, o: follow(o, "omega", values=[]), ValueError, r"values: found \[\]; expected at least one number"),
        (lambda s, o: follow(o, "omega", values=[1.15, 1.16, 1.1]), ValueError, "rising or falling all the way"),
        (
            lambda s, o: follow(o, "omega", within=(1.1, 1.2), values=[1.12, 1.3]),
            ValueError,
            "values: found 1.3 outside of within; expected values from 1.1 to 1.2",
        ),
        (
            lambda s, o: follow(o, "omega", values=["a"]),
            ValueError,
            r"values: found \['a'\]; expected finite numbers for omega",
        ),
        (
            lambda s, o: follow(o, "omega", values=1.15),
            ValueError,
            "values: found 1.15; expected finite numbers for omega",
        ),
        (
            lambda s, o: follow(None, "omega", values=[1.15]),
            TypeError,
            "first: found None; expected an Equilibrium, PeriodicOrbit",
        ),
        (lambda s, o: skeleton(s, "omga", [1.15]), ValueError, "unknown parameter 'omga'"),
        (
            lambda s, o: skeleton(s, "omega", [1.15], looks=0),
            ValueError,
            "looks = 0; expected a whole number, at least 1",
        ),
        (lambda s, o: skeleton(s, "omega", [1.15], (0,)), ValueError, "periods = 0; expected a whole number"),
        (lambda s, o: skeleton(s, "omega", [1.15], 2), ValueError, "periods = 2; expected numbers of drive periods"),
        (lambda s, o: skeleton(s, "omega", [1.15], ()), ValueError, "expected numbers of drive periods"),
        (lambda s, o: skeleton("figure_3", "omega", [1.15]), TypeError, r"scene: found 'figure_3' \(str\); expected"),
    ],
)
def test_misuse_is_answered_in_one_line(call: Callable[..., object], kind: type, message: str) -> None:
    with pytest.raises(kind, match=message) as caught:
        call(scene(), known())
    assert "\n" not in str(caught.value)


@cache
def known() -> PeriodicOrbit:
    return periodic_orbit(scene(), 2, [0.04373869, 0.1], omega=1.15)
