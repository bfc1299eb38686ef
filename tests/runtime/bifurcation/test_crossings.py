"""Multipliers that pass the unit circle, folds and branch points against closed forms, and branches that are lost."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from synchain import Field, Lagrangian
from synchain.models.graphs.families import topology
from synchain.models.scenes.scene import Scene
from synchain.runtime.bifurcation.branches import Branch, follow
from synchain.runtime.bifurcation.periodic import periodic_orbit
from synchain.runtime.bifurcation.skeleton import skeleton
from synchain.runtime.results.open import open_result

# Without f and j the state zero is an orbit, of the multipliers exp(2 pi (a +- i w)) for b = 0, s = 1,
# and exp(2 pi a), exp(2 pi b) for w = s = 0.
NUMBERS = {"a": 0.0, "b": 0.0, "f": 0.0, "g": 0.0, "j": 0.0, "q": 0.0, "r": 0.0, "s": 0.0, "w": 0.0}
NODE = Field(
    {
        "x": "f + (a + cos(t))*x - w*y - q*x**2 - g*x**3",
        "y": "w*x + (s*a + b + cos(t))*y + tanh(r*j)",
    },
    parameters=NUMBERS,
)


def followed(name: str, values: list[float], start: tuple[float, float] = (0.0, 0.0), **more: float) -> Branch:
    scene = Scene(NODE, topology=topology("chain", 1), parameters=more)
    return follow(periodic_orbit(scene, 1, start, parameters={name: values[0]}), name, values=values)


def found(branch: Branch) -> list[tuple[str, float]]:
    return [(str(each.kind), each.value) for each in branch.bifurcations]


@pytest.mark.parametrize("values", [[-0.1, 0.05], [-0.1, 0.0, 0.1], [0.1, -0.05, -0.1]])
def test_a_complex_pair_passes_the_circle(values: list[float]) -> None:
    """The modulus exp(2 pi a) of the pair is 1 at a = 0."""
    branch = followed("a", values, s=1.0, w=0.3)
    assert found(branch) == [("torus", pytest.approx(0.0, abs=1e-12))]
    assert branch.bifurcations[0].residual < 1e-11
    assert all(orbit.stable == (a < 0) for a, orbit in zip(branch.values, branch.orbits, strict=True) if abs(a) > 1e-9)
    assert set(values) <= set(branch.values)
    assert branch.data.bifurcation_kind.values.tolist() == ["torus"]
    assert "torus at" in repr(branch)


def test_a_neutral_saddle_is_no_bifurcation() -> None:
    """The real multipliers exp(2 pi a) and exp(-0.2 pi) have the product 1 at a = 0.1."""
    assert found(followed("a", [0.05, 0.15], b=-0.1)) == []


def test_multipliers_that_stay_on_the_circle_pass_it_nowhere() -> None:
    """Without damping the moduli differ from 1 by rounding errors of either sign."""
    assert found(followed("w", [0.2, 0.23, 0.26, 0.29, 0.32], s=1.0)) == []


def test_multipliers_that_leave_the_circle_at_one_are_found_by_the_determinant() -> None:
    """Of eigenvalues +-sqrt(a^2 - w^2), on the circle for a < w: its moduli have no sign there."""
    branch = followed("a", [0.1, 0.2, 0.4], s=-1.0, w=0.3)
    assert found(branch) == [("branch point", pytest.approx(0.3, abs=1e-10))]


@pytest.mark.parametrize("values", [[-0.1, 0.05], [-0.1, 0.0, 0.1]])
def test_a_branch_that_goes_straight_on_has_a_branch_point(values: list[float]) -> None:
    """Transcritical bifurcation of x' = (a + cos t) x - x^2."""
    branch = followed("a", values, q=1.0, b=-0.3)
    assert found(branch) == [("branch point", pytest.approx(0.0, abs=1e-10))]
    assert branch.bifurcations[0].residual < 1e-9
    assert set(values) <= set(branch.values)


def test_a_branch_that_turns_has_a_fold() -> None:
    """x' = f + cos(t) x - x^2 has two orbits for f > 0, and x = 0 alone for f = 0: both are on the branch."""
    branch = followed("f", [0.1, 0.04, -0.1], (0.3, 0.0), q=1.0, b=-0.3)
    assert found(branch) == [("fold", pytest.approx(0.0, abs=1e-12))]
    assert branch.bifurcations[0].residual < 1e-9
    assert branch.values[[0, -1]].tolist() == [0.1, 0.1]
    assert (branch.values == 0.04).sum() == 2
    assert branch.growing[[0, -1]].tolist() == [0, 1]
    assert branch.lost == ()


def test_a_branch_born_in_a_pitchfork_turns_at_a_branch_point() -> None:
    """x' = (a + cos t) x - x^3 has the orbits of either sign for a > 0."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        branch = followed("a", [0.1, 0.05, -0.05, -0.1], (0.3, 0.0), g=1.0, b=-0.3)
    assert found(branch) == [("branch point", pytest.approx(0.0, abs=1e-11))]
    assert branch.values.min() > -1e-9
    assert branch.orbits[-1].state[0] == pytest.approx(-branch.orbits[0].state[0], abs=1e-10)


def test_symmetric_and_other_orbits_of_duffing_meet_at_a_pitchfork() -> None:
    """The symmetric orbit goes through it, the other turns there, for coarse values too."""
    scene = Scene("duffing")
    through = follow(periodic_orbit(scene, 1, u=2.4), "u", values=[2.4, 2.6])
    (kind, at), *none = found(through)
    assert (kind, none) == ("branch point", [])
    other = periodic_orbit(scene, 1, u=2.7)
    assert abs(other.multipliers[0].imag) > 0.1  # that of the symmetric one is real
    for values in ([2.7, 2.6, 2.5, 2.3], np.linspace(2.7, 2.4, 16)):
        ending = follow(other, "u", values=values)
        assert ("branch point", pytest.approx(at, abs=1e-10)) in found(ending)
        assert ending.values.min() > at - 1e-8


def test_steep_branches_are_followed_in_short_pieces() -> None:
    """y of period one is proportional to tanh(300 j), which changes on a three-hundredth of the step."""
    branch = followed("j", [-1.0, -0.9, 1.0], (0.0, -2.0), a=-0.2, b=-0.3, r=300.0)
    np.testing.assert_allclose(branch.orbits[-1].state, -branch.orbits[0].state, atol=1e-9)


def test_a_branch_that_is_lost_says_so(tmp_path: object) -> None:
    """Beyond j = 0 the rates have no value."""
    node = Field({"x": "-x + sqrt(j)*cos(t)"}, parameters={"j": 1.0})
    scene = Scene(node, None, None, initial={"x": 0.0}, transient=20)
    with pytest.warns(RuntimeWarning, match=r"follow: found no solution and no bifurcation beyond j = ") as caught:
        branch = follow(periodic_orbit(scene), "j", values=[1.0, 0.5, -1.0])
    assert caught[0].filename == __file__
    assert "\n" not in str(caught[0].message)
    assert branch.bifurcations == ()
    (at,) = branch.lost
    assert at == pytest.approx(0.0, abs=1e-6)
    assert dict(branch.summary)["lost"] == f"at {at:.8g}"
    branch.save(f"{tmp_path}/lost.nc")
    assert open_result(f"{tmp_path}/lost.nc").lost == branch.lost


def test_doublings_of_a_parametric_oscillator_are_found_in_any_form_of_its_drive() -> None:
    """cos(wt)^2 has half the period of cos(wt): over two periods both doublings pass at 1."""
    drive = "cos(w*t)**2"
    node = Field(
        {"x": "v", "v": f"-d*v - (1 + a*{drive})*x - x**3 + f0*{drive}"},
        parameters={"w": 1.1, "d": 0.1, "a": 1, "f0": 0.05},
    )
    one = Scene(node, None, None, initial={"x": 0, "v": 0}, transient=100)
    branch = follow(periodic_orbit(one), "w", values=[1.1, 1.12, 1.15, 1.23, 1.3, 1.33])
    assert [turn.kind for turn in branch.bifurcations] == ["period doubling"] * 2
    np.testing.assert_allclose([turn.value for turn in branch.bifurcations], [1.133433, 1.310721], atol=1e-6)


WELLS = Lagrangian(
    "v**2/2",
    "-x**2/2 + x**4/4",
    {"x": "F*cos(w*t) - g*v"},
    coordinates={"x": "v"},
    parameters={"g": 0.2, "F": 1.0, "w": 1.05},
)
LOW, HIGH = 8 / 7, 1.482142857
IN_WELL = [
    ("period doubling", pytest.approx(1.2710356921, abs=1e-8)),
    ("branch point", pytest.approx(1.2862282030, abs=1e-8)),
]


def wells() -> Scene:
    return Scene(WELLS, initial={"x": 1, "v": 0}, transient=300)


def seen(branch: Branch) -> list[tuple[str, float]]:
    """Bifurcations of a branch that is not lost and that has only located ones."""
    assert branch.lost == ()
    assert all(each.residual < 1e-6 for each in branch.bifurcations)
    return found(branch)


@pytest.mark.parametrize("count", [2, 9, 60])
def test_bifurcations_do_not_depend_on_the_number_of_values(count: int) -> None:
    """A step over the whole range led from the asymmetric orbit to the symmetric one; SciPy gives the values."""
    first = periodic_orbit(wells(), 1, [-0.504565084, 0.09546030488], F=LOW)
    branch = follow(first, "F", values=np.linspace(LOW, HIGH, count))
    # At the branch point it turns into its mirror image.
    assert seen(branch) == [*IN_WELL, IN_WELL[0]]
    drives = np.linspace(LOW, HIGH, count)
    assert all((branch.values == drive).sum() == 2 - (drive == LOW) * 0 for drive in drives if drive < 1.2862282)
    # The divergence is -g, so the multipliers have the product exp(-g T), and no pair can pass the circle.
    for orbit in branch.orbits:
        assert np.prod(orbit.multipliers).real == pytest.approx(np.exp(-0.2 * 2 * np.pi / 1.05), rel=1e-9)


@pytest.mark.parametrize("count", [2, 9])
def test_bifurcations_of_a_skeleton_do_not_depend_on_the_number_of_values(count: int) -> None:
    """From the stable asymmetric orbits at F = 1.28, which are mirror images, to both ends."""
    values = [*np.linspace(LOW, 1.28, count), *np.linspace(1.28, HIGH, count)[1:]]
    near = {"x": (-0.736, -0.716), "v": (0.103, 0.123)}
    branches = [branch for branch in skeleton(wells(), "F", values, (1,), 1, ranges=near) if branch.bifurcations]
    assert [seen(branch) for branch in branches] == [[*IN_WELL, IN_WELL[0]]]


@pytest.mark.parametrize("count", [2, 3, 50])
def test_a_pitchfork_and_a_fold_are_found_with_any_number_of_values(count: int) -> None:
    """x' = f + (a + cos t) x - x^3: a pitchfork at a = 0 for f = 0, a fold at f < 0 for a = 0.3."""
    node = Field({"x": "f + (a + cos(t))*x - x**3"}, parameters={"a": 0.3, "f": 0.0})
    scene = Scene(node, None, None, initial={"x": 0.5}, transient=50)
    first = periodic_orbit(scene)
    assert seen(follow(first, "a", values=np.linspace(0.3, -0.4, count))) == [
        ("branch point", pytest.approx(0.0, abs=1e-8))
    ]
    folded = follow(first, "f", values=np.linspace(0.0, -1.4, count))
    assert seen(folded)[:1] == [("fold", pytest.approx(-0.0334640228, abs=1e-8))]


@pytest.mark.parametrize("count", [2, 40])
def test_two_doublings_in_one_step_are_found(count: int) -> None:
    """The multiplier comes back into the circle, so that both ends of the range are stable."""
    node = Field(
        {"x": "v", "v": "-d*v - (1 + a*cos(w*t)**2)*x - x**3 + f0*cos(w*t)**2"},
        parameters={"w": 1.1, "d": 0.1, "a": 1, "f0": 0.05},
    )
    scene = Scene(node, None, None, initial={"x": 0, "v": 0}, transient=100)
    branch = follow(periodic_orbit(scene), "w", values=np.linspace(1.1, 1.33, count))
    assert seen(branch) == [("period doubling", pytest.approx(at, abs=1e-6)) for at in (1.133433, 1.310721)]
