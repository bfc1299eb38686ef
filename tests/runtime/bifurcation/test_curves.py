"""Curves of folds and Hopf points in two parameters against closed forms and normal forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_follow_equilibria import LINE, MACHINE, POWERS, jansen_rit

import synchain as sc
from synchain.runtime.bifurcation.results import Branch, Curve


@pytest.fixture(scope="module")
def columns() -> Branch:
    """The branch of Jansen & Rit in p."""
    return sc.follow(sc.equilibrium(jansen_rit()), "p", to=400)


def at(curve: Curve, name: str, value: float) -> np.ndarray:
    """Return the end of a curve at a value of a parameter."""
    ends = curve.values[[0, -1]]
    return ends[np.abs(ends[:, curve.names.index(name)] - value).argmin()]


def test_the_hopf_curve_of_jansen_and_rit_turns_and_comes_back(columns: Branch) -> None:
    """The least C = 132.961008877571 by Hurwitz' determinant with 30 digits."""
    curve = sc.follow(columns.points["Hopf"][2], ("p", "C"), within={"C": (130, 135)}, direction="down")
    (least,) = curve.special
    assert least.kind == "extreme C"
    np.testing.assert_allclose(least.values, [191.200562370804, 132.961008877571], rtol=1e-12)
    assert least.frequency == pytest.approx(68.8828683548, rel=1e-11)
    np.testing.assert_allclose(curve.values[-1], [89.82910796964, 135], rtol=1e-12)
    assert curve.frequencies[-1] == pytest.approx(65.20098196626, rel=1e-12)


def test_fold_curves_of_jansen_and_rit_reach_the_folds_of_another_branch(columns: Branch) -> None:
    expected = {0: 116.0333638392774, 1: -18.82700015123167}
    for number, p in expected.items():
        curve = sc.follow(columns.points["fold"][number], ("p", "C"), within={"C": (125, 140)}, direction="down")
        np.testing.assert_allclose(curve.values[-1], [p, 125], rtol=1e-12)
    again = sc.follow(sc.equilibrium(jansen_rit(), C=125), "p", to=400)
    np.testing.assert_allclose([each.value for each in again.points["fold"]], list(expected.values()), rtol=1e-12)
    assert [each.value for each in again.points["Hopf"]] == pytest.approx([-11.03365591088], rel=1e-11)


def test_amplitude_death_meets_a_double_hopf_point() -> None:
    """Two Stuart-Landau oscillators of frequencies 1 +- D/2: K = 1/2 + D^2/8 meets K = 1 at D = 2."""
    rates = {
        "x": "x - (1 + s*D/2)*y - (x**2 + y**2)*x",
        "y": "(1 + s*D/2)*x + y - (x**2 + y**2)*y",
    }
    node = sc.Field(rates, parameters={"s": 1, "D": 3})
    link = sc.Rates({"x": "K*W*(x_j - x_i)", "y": "K*W*(y_j - y_i)"}, {"K": 0.5})
    scene = sc.Scene(node, link, sc.graphs.chain(2), initial={"x": 0, "y": 0}, parameters={"s": [1, -1]})
    branch = sc.follow(sc.equilibrium(scene), "K", to=2.0)
    curve = sc.follow(branch.points["Hopf"][1], ("D", "K"), within={"D": (1, 4)})
    np.testing.assert_allclose(curve.values[:, 1], 0.5 + curve.values[:, 0] ** 2 / 8, atol=1e-11)
    (double,) = curve.special
    assert double.kind == "double Hopf"
    np.testing.assert_allclose(double.values, [2, 1], atol=1e-7)


def test_a_cusp_in_closed_form() -> None:
    """x' = m + n x - x^3 has folds at 4 n^3 = 27 m^2."""
    cell = sc.Field({"x": "m + n*x - x**3"}, parameters={"m": -1, "n": 1})
    branch = sc.follow(sc.equilibrium(sc.Scene(cell, None, initial={"x": -1.5})), "m", within=(-2, 2))
    curve = sc.follow(branch.points["fold"][0], ("m", "n"), within={"n": (-1, 2)})
    np.testing.assert_allclose(4 * curve.values[:, 1] ** 3, 27 * curve.values[:, 0] ** 2, atol=1e-10)
    assert set(curve.points) == {"cusp"}
    np.testing.assert_allclose(curve.points["cusp"][0].values, 0, atol=1e-12)


def test_a_bogdanov_takens_point_in_closed_form() -> None:
    """x' = y, y' = m + n x + x^2 - x y: folds at m = n^2/4, Hopf points at m = 0, n < 0 (Kuznetsov, section 8.4)."""
    node = sc.Field({"x": "y", "y": "m + n*x + x**2 - x*y"}, parameters={"m": -0.3, "n": -1})
    branch = sc.follow(sc.equilibrium(sc.Scene(node, None, initial={"x": -0.5, "y": 0})), "m", within=(-2, 1))
    folds = sc.follow(branch.points["fold"][0], ("m", "n"), within={"n": (-2, 2)})
    np.testing.assert_allclose(folds.values[:, 0], folds.values[:, 1] ** 2 / 4, atol=1e-11)
    hopf = sc.follow(branch.points["Hopf"][0], ("m", "n"), within={"n": (-2, 2)})
    np.testing.assert_allclose(hopf.frequencies**2, -hopf.values[:, 1], atol=1e-11)
    for curve in (folds, hopf):
        (point,) = curve.points["Bogdanov-Takens"]
        np.testing.assert_allclose(point.values, 0, atol=1e-10)
    assert hopf.ends[1].startswith("Bogdanov-Takens")


def test_a_bautin_point_in_closed_form(tmp_path: Path) -> None:
    """r' = r (b + c r^2 - r^4) has Hopf points at b = 0, whose coefficient passes zero at c = 0."""
    square = "(x**2 + y**2)"
    node = sc.Field(
        {"x": f"b*x - y + {square}*c*x - {square}**2*x", "y": f"x + b*y + {square}*c*y - {square}**2*y"},
        parameters={"b": -0.5, "c": -1},
    )
    branch = sc.follow(sc.equilibrium(sc.Scene(node, None, initial={"x": 0, "y": 0})), "b", within=(-1, 1))
    curve = sc.follow(branch.points["Hopf"][0], ("b", "c"), within={"c": (-2, 2)})
    (point,) = curve.special
    assert point.kind == "Bautin"
    np.testing.assert_allclose(point.values, 0, atol=1e-12)
    curve.save(tmp_path / "curve.nc")
    opened = sc.open_result(tmp_path / "curve.nc")
    assert isinstance(opened, Curve)
    np.testing.assert_array_equal(opened.values, curve.values)
    assert opened.special[0].kind == "Bautin"


def test_a_pole_of_the_lyapunov_coefficient_is_no_bautin_point() -> None:
    """z' = m + z^2 - r^2, r' = r (n + z + c r^2) has Hopf points at z = -n; there r^2 = 2 z dz, so the coefficient
    is proportional to c + 1 / (2 z): a zero at z = -1 / (2 c), and a pole at the zero-Hopf point z = 0.
    """
    square, inner = "(x**2 + y**2)", "(n + z + c*(x**2 + y**2))"
    rates = {"x": f"{inner}*x - y", "y": f"x + {inner}*y", "z": f"m + z**2 - {square}"}
    node = sc.Field(rates, parameters={"m": -1, "n": 0.5, "c": -1})
    branch = sc.follow(sc.equilibrium(sc.Scene(node, None, initial={"x": 0, "y": 0, "z": -1})), "n", within=(0, 2))
    curve = sc.follow(branch.points["Hopf"][0], ("m", "n"), within={"n": (-2, 2)})
    kinds = {point.kind: point.values for point in curve.special}
    assert sorted(point.kind for point in curve.special) == ["Bautin", "extreme m", "zero-Hopf"]
    np.testing.assert_allclose(kinds["zero-Hopf"], 0, atol=1e-10)
    np.testing.assert_allclose(kinds["Bautin"], (-0.25, -0.5), rtol=1e-9)


def test_folds_of_a_grid_with_a_shift_scale_with_its_powers() -> None:
    """With all powers times q the fold is at q K: here by one power, so that the rotors turn together."""
    scene = sc.Scene(MACHINE, LINE, sc.graphs.ring(5), parameters={"P": POWERS})
    (fold,) = sc.follow(sc.equilibrium(scene), "K", to=0.3).bifurcations
    curve = sc.follow(fold, ("K", "P_1"), within={"P_1": (0.9, 1.2)})
    assert curve.ends == ("P_1 = 0.9", "P_1 = 1.2")
    shifted = sc.equilibrium(scene.replace(parameters={"P": [1.2, *POWERS[1:]], "K": 3}))
    (other,) = sc.follow(shifted, "K", to=0.3).bifurcations
    assert at(curve, "P_1", 1.2)[0] == pytest.approx(other.value, rel=1e-11)


@pytest.mark.parametrize(
    ("names", "within", "message"),
    [
        (("p", "p"), {"p": (0, 200)}, "expected two different parameters"),
        (("p", "q"), {"q": (0, 1)}, "unknown parameter 'q'; known: "),
        (("p", "C"), None, "found no bounds; expected within="),
        (("p", "C"), {"C": (136, 140)}, "found C = 135 outside; expected it between 136 and 140"),
    ],
)
def test_what_is_refused(
    columns: Branch, names: tuple[str, str], within: dict[str, tuple[float, float]] | None, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        sc.follow(columns.points["fold"][0], names, within=within)
