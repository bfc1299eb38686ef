"""Orbits, branches and skeletons follow the units of states and of time, and are sought where the motion is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

import synchain as sc
from synchain.runtime.bifurcation.skeleton import near_returns, starts_of
from synchain.runtime.plots.diagram import stretches

DUFFING = sc.Field(
    {"x": "k*s/r*v", "v": "k*r*(F*cos(k*w*t) - v/r/10 + (x - c)/s - ((x - c)/s)**3)"},
    parameters={"s": 1, "c": 0, "k": 1, "r": 1, "w": 1.2, "F": 0.08},
)
UNITS = [(1e-9, 0, 1, 1e-9), (1e6, 0, 1e3, 1e3), (1e-4, 1, 1, 1e-4), (1, 0, 1e6, 1), (1e-6, 0, 1e-6, 1e5)]
NODE = sc.Field(
    {"x": "v", "v": "-d*v - a*x + b*x**2 - c*x**3 + u*cos(w*t)"}, parameters={"u": 1, **dict.fromkeys("abcdw", 1)}
)


def lines_of(branch: sc.results.Branch) -> list[tuple[bool, np.ndarray, np.ndarray]]:
    """The stretches of a branch, by the first state."""
    return stretches(
        branch, [each.state[0] for each in branch], [each.solution.state[0] for each in branch.bifurcations]
    )


def duffing(s: float = 1, c: float = 0, k: float = 1, r: float = 1) -> sc.Scene:
    """Duffing's oscillator with x -> s x + c, v -> r v and t -> t/k."""
    values = {"s": s, "c": c, "k": k, "r": r}
    return sc.Scene(DUFFING, None, None, parameters=values, initial={"x": c + 1.2 * s, "v": 0.0}, transient=50)


def in_units(state: np.ndarray, scene: sc.Scene) -> np.ndarray:
    p = scene.parameters
    return np.array([(state[0] - p["c"]) / p["s"], state[1] / p["r"]])


@pytest.fixture(scope="module")
def plain() -> tuple[sc.results.PeriodicOrbit, sc.results.Branch]:
    orbit = sc.periodic_orbit(duffing())
    return orbit, sc.follow(orbit, "F", values=[0.08, 0.1, 0.12])


@pytest.mark.parametrize("units", UNITS)
def test_orbits_and_branches_follow_the_units_of_state_and_time(
    units: tuple[float, float, float, float], plain: tuple[sc.results.PeriodicOrbit, sc.results.Branch]
) -> None:
    orbit, branch = plain
    scene = duffing(*units)
    found = sc.periodic_orbit(scene)
    np.testing.assert_allclose(in_units(found.state, scene), orbit.state, atol=1e-9)
    np.testing.assert_allclose(found.multipliers, orbit.multipliers, rtol=1e-8)
    along = sc.follow(found, "F", values=[0.08, 0.1, 0.12])
    assert [turn.kind for turn in along.bifurcations] == ["fold"] == [turn.kind for turn in branch.bifurcations]
    assert along.bifurcations[0].value == pytest.approx(branch.bifurcations[0].value, rel=1e-9)
    for each in (along, branch):
        assert each.values[[0, -1]].tolist() == [0.08, 0.08]


@pytest.mark.parametrize("units", [(1e-9, 0, 1, 1e-9), (1e-4, 1, 1e6, 1e-4)])
def test_the_search_of_a_skeleton_follows_the_units(units: tuple[float, float, float, float]) -> None:
    plain, scene = duffing(), duffing(*units)
    np.testing.assert_allclose(in_units(starts_of(scene, 0).T, scene).T, starts_of(plain, 0), atol=1e-6)
    orbits, expected = (near_returns(each, (1,)) for each in (scene, plain))
    assert len(expected) > 1
    states = sorted(in_units(orbit.state, scene).tolist() for orbit in orbits)
    np.testing.assert_allclose(states, sorted(orbit.state.tolist() for orbit in expected), atol=1e-7)


def test_a_stable_orbit_far_from_the_start_is_found_and_the_search_said() -> None:
    """Where the search went 0.4 from the start in x at its own v, it was missed."""
    values = {"d": 0.21, "a": 0.16, "b": 0.48, "c": 0.94, "w": 1.94, "u": 1.0011}
    result = sc.skeleton(sc.Scene(NODE, None, None, parameters=values), "u", [1.0011], (1,), 1, show_progress=False)
    states = [branch.orbits[0].state for branch in result if branch.orbits[0].stable]
    assert any(np.allclose(state, [0.837, 3.854], atol=1e-3) for state in states)
    assert result.searched["v"][1] > 3.0
    assert dict(result.summary)["starts"].startswith("x from -")
    near = sc.skeleton(
        sc.Scene(NODE, None, None, parameters=values),
        "u",
        [1.0011],
        (1,),
        1,
        ranges={"x": (-0.1, 0.1)},
        show_progress=False,
    )
    assert near.searched["v"] == (0.0, 0.0)
    for wrong, message in (
        ({"y": (0, 1)}, "unknown key 'y'"),
        ({"x": (1, 0)}, "expected two numbers, the lower one first"),
    ):
        with pytest.raises(ValueError, match=message):
            sc.skeleton(sc.Scene(NODE, None, None, parameters=values), "u", [1.0], (1,), ranges=wrong)


def test_motions_that_escape_are_left_and_those_that_stay_are_found() -> None:
    """x'' = -x/2 + x^2 - x'/5 + u cos 2t escapes from x > 1/2."""
    values = {"d": 0.2, "a": 0.5, "b": 1.0, "c": 0.0, "w": 2.0, "u": 0.05}
    scene = sc.Scene(NODE, None, None, parameters=values)
    (branch,) = (b for b in sc.skeleton(scene, "u", [0.05], (1,), 1, show_progress=False) if b.orbits[0].stable)
    assert np.abs(branch.orbits[0].state).max() < 0.1
    for call in (
        lambda: sc.periodic_orbit(scene, 1, [3.0, 3.0]),
        lambda: sc.periodic_orbit(scene.replace(initial={"x": 3})),
    ):
        with pytest.raises(ArithmeticError):
            call()


def test_the_skeleton_of_an_undriven_network_has_equilibria_and_cycles(tmp_path: Path) -> None:
    """Two Brusselators: the uniform state, the pattern born at B = 4.2, and the cycles born at B = 5."""
    node = sc.Field({"x": "2 - (B + 1)*x + x**2*y", "y": "B*x - x**2*y"}, parameters={"B": 3})
    link = sc.Rates({"x": "W*(x_j - x_i)/5", "y": "W*(y_j - y_i)"})
    scene = sc.Scene(node, link, sc.graphs.chain(2), initial={"x": 2, "y": 1.5})
    found = sc.skeleton(scene, "B", [3.0, 4.0, 5.2], looks=3)
    resting = [branch for branch in found if not branch.orbits]
    cycles = [branch for branch in found if branch.orbits]
    uniform, pattern = resting
    assert [each.value for each in uniform.bifurcations] == pytest.approx([4.2, 5.0], abs=1e-11)
    assert pattern.points["branch point"][0].value == pytest.approx(4.2, abs=1e-10)
    assert cycles[0].values[0] == pytest.approx(5.0, abs=1e-11)
    assert max(abs(cycles[0].values[-1] - 5.2), cycles[0][-1].residual) < 1e-9
    found.save(tmp_path / "found.nc")
    assert len(sc.open_result(tmp_path / "found.nc")) == len(found)
    found.plot()


def test_lines_of_a_branch_end_at_its_bifurcations_and_are_of_one_stability(
    plain: tuple[sc.results.PeriodicOrbit, sc.results.Branch],
) -> None:
    branch = plain[1]
    line, other = lines_of(branch)
    assert (line[0], other[0]) == (True, False)
    assert line[1][-1] == other[1][0] == branch.bifurcations[0].value
    assert 0.1 in line[1]
    orbit = branch.orbits[0]
    lost = sc.results.PeriodicOrbit(orbit.scene, 1, orbit.state, np.array([-1.5, 0.1]), 0.0, 1)
    turn = replace(branch.bifurcations[0], length=float("nan"))
    crossed = sc.results.Branch(
        "F",
        np.array([0.08, 0.1, 0.12, 0.14]),
        (orbit, orbit, lost, lost),
        (turn,),
        np.array([0, 0, 1, 1]),
        np.array([0.08, 0.1, 0.12, 0.14]),
    )
    first, second = lines_of(crossed)
    np.testing.assert_array_equal(first[1], [0.08, 0.1, turn.value])
    np.testing.assert_array_equal(second[1], [turn.value, 0.12, 0.14])
    assert (first[0], second[0]) == (True, False)
    axes = crossed.plot()
    styles = {line.get_linestyle() for line in axes.lines if len(line.get_xdata()) > 1}
    assert styles == {"-", "--"}
    assert {text.get_text() for text in axes.get_legend().get_texts()} == {
        "1 drive period",
        "stable",
        "unstable",
        "fold",
    }


FIELDS = {
    "same": {
        "title": "other", "record": ("trajectory",), "observe": {"m": "mean(x)"}, "section": "v_1 rising", "window": 7.0,
        "sections": {"cut": sc.Section("x_1", "rising")}, "samples": 9, "rtol": 1e-4, "atol": 1e-3, "rng": 5,
        "nodes": [], "continuation": "up", "zipped": True,
    },
    "other": {"initial": {"x": -1.2, "v": 0.0}},
    "refused": {"axes": {"F": [0.1, 0.2]}, "stop": "x_1 - 9"},
}  # fmt: skip


def test_every_field_of_a_scene_is_obeyed_refused_or_of_no_matter(
    plain: tuple[sc.results.PeriodicOrbit, sc.results.Branch],
) -> None:
    orbit, _ = plain
    calls = {
        "periodic_orbit": lambda scene: sc.periodic_orbit(scene).state,
        "skeleton": lambda scene: sc.skeleton(scene, "F", [0.08], (1,), 1, show_progress=False),
    }
    for field, value in FIELDS["same"].items():
        more = {"samples": 9} if field == "record" else {}
        answer = calls["periodic_orbit"](duffing().replace(**{field: value}, **more))
        np.testing.assert_allclose(answer, orbit.state, rtol=1e-12)
    for field, value in FIELDS["refused"].items():
        for name, call in calls.items():
            if (field, name) != ("axes", "skeleton"):  # the parameter that it sweeps
                with pytest.raises(ValueError, match=f"{name}: found {field}"):
                    call(duffing().replace(**{field: value}))
    left = sc.periodic_orbit(duffing().replace(initial=FIELDS["other"]["initial"]))
    assert left.state[0] == pytest.approx(-1.0, abs=0.3)
    timed = duffing().replace(time_unit="time", transient=50 * duffing().period)
    np.testing.assert_allclose(sc.periodic_orbit(timed).state, orbit.state, atol=1e-10)


SIZES = [1.0, 1e-3, 1e-6]


def resting(rate: str, size: float, name: str, value: float, start: float = 0.0) -> sc.results.Equilibrium:
    """The equilibrium of x' = rate, with states of a size."""
    field = sc.Field({"x": rate}, parameters={"S": size, name: value})
    return sc.equilibrium(sc.Scene(field, initial={"x": start * size}))


@pytest.mark.parametrize("size", SIZES)
def test_branches_at_a_branch_point_follow_the_unit_of_the_state(size: float) -> None:
    """x = +-S sqrt(r), and S^2 (1 +- sqrt(1 + 4 r))/2 = x^2 with folds at r = -1/4."""
    for rate, folds in (("r*x - x**3/S**2", []), ("r*x + x**3/S**2 - x**5/S**4", [-0.25, -0.25])):
        (point,) = sc.follow(resting(rate, size, "r", -1.0), "r", to=1.0).points["branch point"]
        branch = sc.follow(point, "r", within=(-1.0, 1.0))
        assert not branch.lost
        assert branch.ends == ("r = 1", "r = 1")
        states = np.array([each.state[0] for each in branch]) / size
        expected = states**4 - states**2 if folds else states**2
        np.testing.assert_allclose(branch.values, expected, atol=1e-9)
        assert len(states) > 30
        assert states[0] == pytest.approx(-states[-1], rel=1e-9)
        assert [each.value for each in branch.bifurcations] == pytest.approx(folds, abs=1e-9)
        assert {str(each.kind) for each in branch.bifurcations} == ({"fold"} if folds else set())
        assert all(each.residual < 1e-5 for each in branch.bifurcations)


@pytest.mark.parametrize("size", SIZES)
def test_folds_of_one_state_follow_its_unit(size: float) -> None:
    """A single eigenvalue is zero at a fold, and gives no unit there."""
    branch = sc.follow(resting("F*S + x - x**3/S**2", size, "F", 0.0, -1.5), "F", within=(-1.0, 1.0))
    fold = 2.0 / 27.0**0.5
    assert [each.value for each in branch.bifurcations] == pytest.approx([fold, -fold], abs=1e-12)
    for end in (size, 1.0):  # from a state at zero
        branch = sc.follow(resting("r - x + 4*x**3/S**2", size, "r", 0.0), "r", to=end)
        assert [each.value for each in branch.bifurcations] == pytest.approx([fold * size / 2.0], rel=1e-9)
        assert not branch.lost
        assert branch.bifurcations[0].residual < 1e-5


def test_a_beam_buckles_by_millimetres() -> None:
    """(100 - P) x + 1e8 x^3 = 0 in metres: 1 mm at P = 200."""
    beam = sc.Field({"x": "v", "v": "(P - 100)*x - 1e8*x**3 - v"}, parameters={"P": 0})
    straight = sc.equilibrium(sc.Scene(beam, initial={"x": 0.0}))
    (point,) = sc.follow(straight, "P", to=200.0).points["branch point"]
    branch = sc.follow(point, "P", to=200.0)
    assert sorted(branch[k].state[0] for k in (0, -1)) == pytest.approx([-1e-3, 1e-3], rel=1e-9)
    assert [each.stable for each in branch].count(False) == 1


@pytest.mark.parametrize(("size", "time"), [(1.0, 1.0), (1e3, 1e-6), (1e-6, 1e-6)])
def test_a_relay_switches_at_its_zero_in_any_unit(size: float, time: float) -> None:
    """(d/dt + 1)^3 x = -sign(x): the half period h and the state at the switch follow from expm."""
    matrix = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, -3.0, -3.0]])

    def at_switch(h: float) -> np.ndarray:
        flow = expm(h * matrix)
        return np.linalg.solve(np.eye(3) + flow, np.linalg.solve(matrix, (flow - np.eye(3))[:, 2]))

    period = 2.0 * brentq(lambda h: at_switch(h)[0], 1.0, 6.0, xtol=1e-15)
    rates = {"p": "q/T", "q": "r/T", "r": "(-p - 3*q - 3*r - k*S*sign(p))/T"}
    values = {"k": 1.0, "S": size, "T": time}
    relay = sc.Field(rates, parameters=values, contact="set-valued", initial={"p": 0.3 * size, "q": 0.0, "r": 0.0})
    orbit = sc.periodic_orbit(sc.Scene(relay, transient=40))
    assert orbit.period / time == pytest.approx(period, rel=1e-11)


@pytest.mark.parametrize(("size", "time"), [(1.0, 1.0), (1e3, 1e3), (1e6, 1e-6), (1e-6, 1e6)])
def test_the_equilibria_of_a_model_that_starts_at_zero_are_found_in_any_unit(size: float, time: float) -> None:
    """A mass on a spring carries two pendula, each of which hangs down or stands up."""
    values = {
        "l": 0.4 * size,
        "g": 9.81 * size / time**2,
        "k": 300.0 / time**2,
        "c": 2.0 / time,
        "d": 0.05 * size**2 / time,
    }
    beam = sc.Lagrangian(
        "5*v**2/2 + ((v + l*w*cos(a))**2 + (l*w*sin(a))**2 + (v + l*u*cos(b))**2 + (l*u*sin(b))**2)/2",
        "k*x**2/2 - g*l*(cos(a) + cos(b))",
        {"x": "-c*v", "a": "-d*w", "b": "-d*u"},
        coordinates={"x": "v", "a": "w", "b": "u"},
        parameters=values,
        initial={"x": 0.0, "a": 0.1, "b": -0.2},
    )
    angles = [each.state[1:3] for each in sc.equilibria(sc.Scene(beam))]
    assert sorted(np.round(np.cos(angles), 9).tolist()) == [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]]
