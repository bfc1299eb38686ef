"""Branches that leave a bifurcation beside the known one, in closed form."""

from __future__ import annotations

import re

import numpy as np
import pytest

import synchain as sc
from synchain.runtime.bifurcation.results import Branch

EXCITABLE = sc.Field({"v": "v - v**3/3 - w + I", "w": "2/25*(v + 7/10 - 4/5*w)"}, parameters={"I": 0.2})


def followed(rate: str, start: float, begin: float = -1.0) -> Branch:
    """The branch of equilibria of x' = rate from r = begin to -begin."""
    cell = sc.Field({"x": rate}, parameters={"r": begin})
    return sc.follow(sc.equilibrium(sc.Scene(cell, initial={"x": start})), "r", to=-begin)


@pytest.mark.parametrize(
    ("rate", "start", "begin", "other"),
    [
        ("x*(x - r)", 0.0, -1.0, "x - r"),
        ("x*(x - r)", -1.0, -1.0, "x"),
        ("x*(r - x**3)", 0.0, -1.0, "r - x**3"),
        ("x*(r - x**3)", -1.0, -1.0, "x"),
        ("(x - r)*(x - 2*r - r**2 + x**2)", -1.0, -1.0, "x - 2*r - r**2 + x**2"),
        ("r*x - x**3", 0.0, -1.0, "r - x**2"),
        ("r*x - x**3", 1.0, 1.0, "x"),  # the known branch was born here
        ("(x - r/2)*(r - (x - r/2)**2)", 1.5, 1.0, "x - r/2"),
    ],
)
def test_the_branch_that_crosses_the_known_one_is_followed(rate: str, start: float, begin: float, other: str) -> None:
    (point,) = followed(rate, start, begin).bifurcations
    assert point.kind == "branch point"
    assert point.value == pytest.approx(0.0, abs=1e-14)
    branch = sc.follow(point, "r", within=(-1.0, 1.0))
    assert not branch.lost
    assert np.ptp(branch.values) > 0.5
    left = [eval(other, {"x": each.state[0], "r": r}) for r, each in zip(branch.values, branch, strict=True)]
    place = int(np.abs(branch.lengths).argmin())  # the branch point, whose state is known to the root of rounding
    assert abs(left.pop(place)) < 1e-7
    np.testing.assert_allclose(left, 0.0, atol=1e-12)


def test_a_uniform_state_of_many_cells_crosses_another_one() -> None:
    """Seventy cells, whose matrices are sparse: x = 0 and x = r."""
    pull = sc.Rates({"x": "W*(x_j - x_i)"})
    cell = sc.Field({"x": "x*(x - r)"}, parameters={"r": -0.5})
    scene = sc.Scene(cell, pull, sc.graphs.complete(70), initial={"x": -0.5})
    (point,) = sc.follow(sc.equilibrium(scene), "r", to=0.5).bifurcations
    branch = sc.follow(point, "r", within=(-0.5, 0.5))
    assert max(float(np.abs(each.state).max()) for each in branch) < 1e-12
    assert sorted(branch.values[[0, -1]]) == [-0.5, 0.5]


@pytest.mark.parametrize("start", [0.0, 0.3])
def test_driven_orbits_cross(start: float) -> None:
    """x' = (a + cos t) x - x^2 has the orbit zero, and one that passes it at a = 0."""
    cell = sc.Field({"x": "(a + cos(t))*x - x**2"}, parameters={"a": 0.1})
    known = sc.follow(sc.periodic_orbit(sc.Scene(cell), 1, [start]), "a", to=-0.1)
    (point,) = known.bifurcations
    assert point.value == pytest.approx(0.0, abs=1e-12)
    branch = sc.follow(point, "a", within=(-0.1, 0.1))
    assert not branch.lost
    largest = max(abs(float(each.state[0])) for each in branch)
    assert (largest > 0.05) == (start == 0.0)
    assert (largest < 1e-12) == (start > 0.0)


@pytest.mark.parametrize("radius", [1.0, 0.8])
def test_undriven_cycles_cross(radius: float) -> None:
    """The cycles of radius 1 and b in the plane."""
    speed = "(sqrt(x**2 + y**2) - 1)*(b - sqrt(x**2 + y**2))"
    plane = sc.Field({"x": f"-y + x*{speed}", "y": f"x + y*{speed}"}, parameters={"b": 0.8})
    first = sc.periodic_orbit(sc.Scene(plane), start=[radius, 0.0], period=6.28)
    (point,) = sc.follow(first, "b", to=1.2).bifurcations
    assert point.value == pytest.approx(1.0, abs=1e-10)
    branch = sc.follow(point, "b", within=(0.8, 1.2))
    sizes = [float(np.hypot(*each.state)) for each in branch]
    np.testing.assert_allclose(sizes, branch.values if radius == 1.0 else 1.0, atol=1e-9)


def test_of_four_branches_that_cross_at_a_point_another_one_is_followed() -> None:
    """x = 0, r, -r and 2 r cross at the origin, where all second derivatives vanish and give no direction."""
    (point,) = followed("x*(x - r)*(x + r)*(x - 2*r)", 0.0).bifurcations
    branch = sc.follow(point, "r", within=(-1.0, 1.0))
    assert {abs(round(branch[k].state[0] / branch.values[k], 9)) for k in (0, -1)} <= {1.0, 2.0}


def test_cycles_that_begin_on_the_other_side_of_a_hopf_point_are_refused() -> None:
    """A subcritical Hopf point: the cycles go to smaller I, and turn back in a fold."""
    scene = sc.Scene(EXCITABLE, initial={"v": -1.1, "w": -0.5})
    (hopf,) = sc.follow(sc.equilibrium(scene), "I", to=0.6).points["Hopf"]
    message = (
        "follow: found bounds 0.33128134, 2 for a branch that begins below I = 0.33128134; expected bounds on both "
        "sides, as it may turn back; give within=(low, high)"
    )
    with pytest.raises(ValueError, match=re.escape(message)):
        sc.follow(hopf, "I", to=2)
    cycles = sc.follow(hopf, "I", within=(0.3, 2.0))
    assert [str(each.kind) for each in cycles.bifurcations] == ["fold", "fold", "Hopf"]
    # The Hopf points have v = -+sqrt(0.936).
    end, v = cycles.bifurcations[-1], 0.936**0.5
    assert end.value == pytest.approx(v**3 / 3 - v + (v + 0.7) / 0.8, abs=1e-12)
    assert end.frequency == pytest.approx(hopf.frequency, rel=1e-12)
    assert end.lyapunov == pytest.approx(hopf.lyapunov, rel=1e-9)
    again = sc.follow(end, "I", within=(1.4, 2.0))
    assert again.values.max() > end.value


def test_cycles_of_two_turns_end_where_their_period_doubles() -> None:
    """Beyond c = 2.832445027862 a long step meets the cycle of one turn, which is as stable."""
    rossler = sc.Field({"x": "-y - z", "y": "x + y/5", "z": "1/5 + z*(x - c)"}, parameters={"c": 3.2})
    first = sc.periodic_orbit(sc.Scene(rossler), start=[6.1149, -3.0838, 0.6005], period=11.531)
    assert first.period == pytest.approx(11.53108104121, rel=1e-11)
    branch = sc.follow(first, "c", to=2.5)
    (end,) = branch.bifurcations
    assert (end.kind, end.value) == ("period doubling", pytest.approx(2.832445027862, abs=1e-11))
    assert branch.ends == ("period doubling at c = 2.832445",)
    assert end.orbit.period == pytest.approx(5.76982001651, rel=1e-10)


def test_cycles_end_at_their_hopf_point_to_rounding() -> None:
    """The unstable cycles of Lorenz end at r = 470/19, those of a Brusselator at B = 5."""
    lorenz = sc.Field({"x": "10*(y - x)", "y": "r*x - y - x*z", "z": "x*y - 8/3*z"}, parameters={"r": 24})
    first = sc.periodic_orbit(sc.Scene(lorenz), start=[7, 7, 19], period=0.68)
    (end,) = sc.follow(first, "r", to=26).bifurcations
    assert (end.kind, end.value) == ("Hopf", pytest.approx(470 / 19, rel=1e-13))
    assert end.frequency == pytest.approx(9.624530063715754, rel=1e-12)
    brusselator = sc.Field({"x": "2 - (B + 1)*x + x**2*y", "y": "B*x - x**2*y"}, parameters={"B": 6})
    first = sc.periodic_orbit(sc.Scene(brusselator, initial={"x": 2.5, "y": 3}))
    (end,) = sc.follow(first, "B", to=4).bifurcations
    assert (end.kind, end.value) == ("Hopf", pytest.approx(5.0, rel=1e-13))


def test_three_cycles_are_born_in_a_double_hopf_point_of_a_ring() -> None:
    """Standing waves have a multiplier 1 to all digits near their birth: its sign shows later, and passes nowhere."""
    rates = {"x": "m*x - y - x*(x**2 + y**2)", "y": "x + m*y + (0.3*x - y)*(x**2 + y**2)"}
    link = sc.Rates({"x": "0.3*W*(x_j - x_i)", "y": "0.3*W*(y_j - y_i)"})
    scene = sc.Scene(sc.Field(rates, parameters={"m": 0.2}), link, sc.graphs.ring(5), initial={"x": 0, "y": 0})
    (hopf,) = sc.follow(sc.equilibrium(scene), "m", to=0.6).points["Hopf"]
    assert hopf.value == pytest.approx(0.3 * (2 - 2 * np.cos(2 * np.pi / 5)), abs=1e-12)
    rows = dict(hopf.summary)
    assert rows["branches"] == "3 that no symmetry maps to each other: follow(…, vector=k), k = 0 to 2"
    assert "Lyapunov coefficient" not in rows
    standing = sc.follow(hopf, "m", to=0.42)
    assert len(set(standing[-1].classes)) == 3
    assert standing.bifurcations == ()
