"""Branches of equilibria against closed forms and numbers from other code."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

import synchain as sc
from synchain.runtime.bifurcation import eigenvalues as module
from synchain.runtime.bifurcation.results import Branch

CELL = sc.Field({"x": "x - x**3"})
PULL = sc.Rates({"x": "K*W*(x_j - x_i)"}, {"K": 0.2})
MACHINE = sc.Field({"delta": "w", "w": "P - w/2"}, parameters={"P": 0})
LINE = sc.Rates({"w": "K*W*sin(delta_j - delta_i)"}, {"K": 3})
POWERS = [1.0, -0.6, 0.4, -1.1, 0.3]


def brusselators(n: int = 6, B: float = 2.0) -> sc.Scene:
    node = sc.Field({"x": "2 - (B + 1)*x + x**2*y", "y": "B*x - x**2*y"}, parameters={"B": sc.Parameter(B, minimum=0)})
    link = sc.Rates({"x": "Dx*W*(x_j - x_i)", "y": "Dy*W*(y_j - y_i)"}, {"Dx": 0.1, "Dy": 1})
    return sc.Scene(node, link, sc.graphs.ring(n), initial={"x": 2, "y": B / 2})


def jansen_rit() -> sc.Scene:
    """Rates of Jansen & Rit, Biol. Cybern. 73, 357 (1995), table 1."""
    rate = lambda v: f"5/(1 + exp({sp.Rational(56, 100)}*(6 - {v})))"  # noqa: E731
    rates = {
        "a": "u", "u": f"325*{rate('(b - c)')} - 200*u - 10000*a",
        "b": "v", "v": f"325*(p + 4*C/5*{rate('(C*a)')}) - 200*v - 10000*b",
        "c": "w", "w": f"1100*C/4*{rate('(C*a/4)')} - 100*w - 2500*c",
    }  # fmt: skip
    return sc.Scene(sc.Field(rates, parameters={"p": -60, "C": 135}), initial=dict.fromkeys("aubvcw", 0))


def values_of(branch: Branch, kind: str) -> list[float]:
    return [each.value for each in branch.points[kind]]


def test_two_bistable_cells_in_closed_form() -> None:
    """Branch points at K = 1/2 (x = 0) and 1/3 (x = -y = 1/sqrt 3); beyond, x, y = (sqrt .4 +- sqrt 1.2)/2 at K = 0.2."""
    scene = sc.Scene(CELL, PULL, sc.graphs.chain(2), initial={"x": 0})
    trivial = sc.follow(sc.equilibrium(scene), "K", to=0.7)
    (half,) = trivial.bifurcations
    assert half.kind == "branch point"
    assert half.value == pytest.approx(0.5, abs=1e-13)
    assert half.mode == "mode 1 of the graph, + -, eigenvalue 2"
    opposite = sc.follow(half, "K", within=(0.2, 0.7))
    np.testing.assert_allclose(values_of(opposite, "branch point"), [1 / 3, 1 / 3], atol=1e-13)
    assert opposite.points["branch point"][0].solution.state == pytest.approx([3**-0.5, -(3**-0.5)], abs=1e-12)
    mixed = sc.follow(opposite.points["branch point"][0], "K", within=(0.2, 0.7))
    expected = [(0.4**0.5 + 1.2**0.5) / 2, (0.4**0.5 - 1.2**0.5) / 2]
    assert sorted(np.abs(mixed[0].state)) == pytest.approx(sorted(np.abs(expected)), abs=1e-13)
    assert [mixed[k].growing for k in (0, -1)] == [1, 1]


def test_a_branch_that_is_born_in_a_pitchfork_turns_there() -> None:
    scene = sc.Scene(CELL, PULL, sc.graphs.chain(2), initial={"x": [0.9, -0.9]})
    branch = sc.follow(sc.equilibrium(scene, K=0.4), "K", to=0.7)
    (born,) = branch.bifurcations
    assert born.kind == "branch point"
    assert born.value == pytest.approx(0.5, abs=1e-13)
    np.testing.assert_allclose(branch[-1].state, -branch[0].state, atol=1e-12)
    assert branch.ends == ("K = 0.4",)


def test_six_brusselators_on_a_ring() -> None:
    branch = sc.follow(sc.equilibrium(brusselators()), "B", to=5.6)
    kinds = [str(each.kind) for each in branch.bifurcations]
    assert kinds == ["branch point", "branch point", "Hopf", "branch point"]
    np.testing.assert_allclose([each.value for each in branch.bifurcations], [2.8, 91 / 30, 5.0, 5.5], rtol=1e-12)
    assert [each.multiplicity for each in branch.bifurcations] == [1, 2, 1, 2]
    assert [each.mode[:6] for each in branch.bifurcations] == ["mode 3", "mode 2", "mode 0", "mode 1"]
    assert "+ - + - + -, eigenvalue 4" in branch.bifurcations[0].mode
    assert branch.bifurcations[2].frequency == pytest.approx(2.0, abs=1e-12)
    # Kuznetsov (2004), section 3.5.2 gives the coefficient of Brusselators up to the scale of the eigenvector: here negative.
    assert branch.bifurcations[2].lyapunov < 0
    board = sc.follow(branch.bifurcations[0], "B", within=(2.0, 3.2))
    for k in (0, -1):
        assert sorted(set(np.round(board[k].state[:6], 12))) == pytest.approx([1.120925826188285, 2.879074173811715])
        assert board[k].stable
        assert board[k].eigenvalues[0].real == pytest.approx(-0.537909676162, abs=1e-11)


def test_a_double_branch_point_has_a_branch_for_each_class_of_symmetry() -> None:
    """Mode 1 of a ring of six: reflections through two nodes, or through two links, leave a line each."""
    branch = sc.follow(sc.equilibrium(brusselators()), "B", to=5.6)
    _, two, _, one = branch.bifurcations
    assert (len(two.vectors), len(one.vectors)) == (1, 2)
    for bifurcation in (two, one):
        for k in range(len(bifurcation.vectors)):
            other = sc.follow(bifurcation, "B", within=(bifurcation.value - 0.05, bifurcation.value + 0.05), vector=k)
            assert np.ptp(other[-1].state[:6]) > 0.01
            assert max(each.residual for each in other) < 1e-12


@pytest.mark.parametrize(("size", "time"), [(1.0, 1.0), (1e-6, 1e6), (1e3, 1e-3)])
def test_the_branches_of_a_double_branch_point_keep_their_symmetry(size: float, time: float) -> None:
    """Four Brusselators on a ring: along (0, 1, 0, -1) the nodes 1 and 3 stay equal; a reference solves for three nodes."""
    rates = {"x": "(A - (B + 1)*x/S + (x/S)**2*y/S)*S/T", "y": "(B*x/S - (x/S)**2*y/S)*S/T"}
    node = sc.Field(
        rates, parameters={"A": 1.5, "B": 1, "S": size, "T": time}, initial={"x": 1.5 * size, "y": size / 1.5}
    )
    link = sc.Rates({"x": "a*W*(x_j - x_i)", "y": "b*W*(y_j - y_i)"}, {"a": 0.1 / time, "b": 1 / time})
    along = sc.follow(sc.equilibrium(sc.Scene(node, link, sc.graphs.ring(4))), "B", to=3)
    point = next(each for each in along.points["branch point"] if len(each.vectors) == 2 and each.value < 2.6)
    assert point.value == pytest.approx(2.55, rel=1e-10)
    which = int(np.argmin([abs(each[0]) for each in point.vectors]))
    branch = sc.follow(point, "B", within=(2, 6), vector=which)
    states = np.array([each.state for each in branch]).reshape(len(branch), 2, 4) / size
    np.testing.assert_allclose(states[:, :, 0], states[:, :, 2], rtol=1e-12)

    def reaction(z: np.ndarray, B: float) -> np.ndarray:
        x, y = z.reshape(2, 4)
        spread = [np.roll(u, 1) + np.roll(u, -1) - 2 * u for u in (x, y)]
        return np.concatenate([1.5 - (B + 1) * x + x**2 * y + 0.1 * spread[0], B * x - x**2 * y + spread[1]])

    for end in (states[0], states[-1]):
        np.testing.assert_allclose(reaction(end.ravel(), 6.0), 0, atol=1e-10)
    assert np.abs(states[-1] - states[0][:, [2, 3, 0, 1]]).max() < 1e-9  # both halves are images of each other
    for hopf in branch.points["Hopf"]:
        z, h = hopf.solution.state / size, 1e-6
        slopes = [(reaction(z + h * e, hopf.value) - reaction(z - h * e, hopf.value)) / (2 * h) for e in np.eye(8)]
        pair = min(np.linalg.eigvals(np.array(slopes).T), key=lambda value: abs(value.real) - (value.imag > 0.1))
        assert abs(pair.real) < 1e-7
        assert hopf.value == pytest.approx(3.805202, abs=1e-6)
    assert len(branch.points["Hopf"]) == 2


def test_folds_and_hopf_points_of_jansen_and_rit() -> None:
    """Hopf points by Hurwitz' determinant; the neutral saddle at p = 96.762 is no bifurcation."""
    branch = sc.follow(sc.equilibrium(jansen_rit()), "p", to=400)
    np.testing.assert_allclose(values_of(branch, "fold"), [113.5862732127988, -41.30141048782859], rtol=1e-13)
    np.testing.assert_allclose(
        values_of(branch, "Hopf"), [-12.14749234842, 89.82910796964, 315.69642806882], rtol=1e-12
    )
    frequencies = [each.frequency for each in branch.points["Hopf"]]
    np.testing.assert_allclose(frequencies, [45.48700707948, 65.20098196626, 70.14278420402], rtol=1e-12)
    assert len(branch.bifurcations) == 5
    assert all(each.residual < 1e-12 for each in branch.bifurcations)


def test_a_grid_of_machines_folds_with_a_neutral_shift() -> None:
    scene = sc.Scene(MACHINE, LINE, sc.graphs.ring(5), parameters={"P": POWERS})
    branch = sc.follow(sc.equilibrium(scene), "K", to=0.3)
    (fold,) = branch.bifurcations
    assert (str(fold.kind), branch.ends) == ("fold", ("K = 3",))
    assert fold.value == pytest.approx(0.65565648344943, abs=1e-13)
    angles = fold.solution.state[:5] - fold.solution.state[:5].mean()
    expected = [1.1414659473, -0.2728635999, -0.3455983930, -1.0971130613, 0.5741091070]
    np.testing.assert_allclose(angles, expected, atol=1e-10)
    assert (branch.growing[0], branch.growing[-1]) == (0, 1)


def test_a_parameter_of_one_node_is_followed() -> None:
    """sin(delta_1 - delta_2) = (P_1 - P_2)/(2 K) in the frame of the pair."""
    pair = sc.Scene(MACHINE, LINE, sc.graphs.chain(2), parameters={"P": [0.5, -0.5], "K": 1.0})
    branch = sc.follow(sc.equilibrium(pair), "P_1", to=3.0, values=[1.0])
    (fold,) = branch.bifurcations
    assert fold.value == pytest.approx(1.5, abs=1e-13)
    (at_one,) = (each for value, each in zip(branch.values, branch, strict=True) if value == 1.0 and each.stable)
    assert at_one.state[0] - at_one.state[1] == pytest.approx(np.arcsin(0.75), abs=1e-12)
    assert at_one.speeds == pytest.approx([0.5], abs=1e-13)


def test_hopf_points_of_modes_in_closed_form() -> None:
    """FitzHugh-Nagumo with links in v: the mode lambda is neutral at v = -sqrt(.936 - D lambda)."""
    node = sc.Field({"v": "v - v**3/3 - w + I", "w": "2/25*(v + 7/10 - 4/5*w)"}, parameters={"I": 0.2})
    link = sc.Rates({"v": "D*W*(v_j - v_i)"}, {"D": 0.05})
    scene = sc.Scene(node, link, sc.graphs.ring(4), initial={"v": -1.1, "w": -0.5})
    branch = sc.follow(sc.equilibrium(scene), "I", to=0.45)
    values = values_of(branch, "Hopf")
    np.testing.assert_allclose(values[:2], [0.331281337455, 0.391624018433], atol=1e-11)
    first, second, *_ = branch.points["Hopf"]
    assert (first.multiplicity, second.multiplicity) == (1, 2)
    np.testing.assert_allclose([first.frequency, second.frequency], 0.275506805724, atol=1e-11)


def test_amplitude_death_is_bounded_by_hopf_points() -> None:
    """Two Stuart-Landau oscillators of frequencies 1 +- D/2 rest between K = 1 and (1 + D^2/4)/2 for D = 3."""
    rates = {"x": "x - w*y - (x**2 + y**2)*x", "y": "w*x + y - (x**2 + y**2)*y"}
    node = sc.Field(rates, parameters={"w": 1})
    link = sc.Rates({"x": "K*W*(x_j - x_i)", "y": "K*W*(y_j - y_i)"}, {"K": 0.5})
    scene = sc.Scene(node, link, sc.graphs.chain(2), initial={"x": 0, "y": 0}, parameters={"w": [2.5, -0.5]})
    branch = sc.follow(sc.equilibrium(scene), "K", to=2.0)
    np.testing.assert_allclose(values_of(branch, "Hopf"), [1.0, 1.625], atol=1e-12)
    assert [each.multiplicity for each in branch.bifurcations] == [2, 1]
    assert branch.bifurcations[1].frequency == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("sign", [-1, 1])
def test_the_first_lyapunov_coefficient_of_a_normal_form(sign: int) -> None:
    """z' = (b + i w) z + (c + i) |z|^2 z has the coefficient 2 c/w for <q, q> = 1: |z|^2 is twice the product of q."""
    c, w = sp.Rational(3 * sign, 10), 2
    square = "(x**2 + y**2)"
    node = sc.Field(
        {"x": f"b*x - {w}*y + {square}*(({c})*x - y)", "y": f"{w}*x + b*y + {square}*(({c})*y + x)"},
        parameters={"b": -0.5},
    )
    branch = sc.follow(sc.equilibrium(sc.Scene(node, None, initial={"x": 0, "y": 0})), "b", to=0.5)
    (hopf,) = branch.points["Hopf"]
    assert hopf.lyapunov == pytest.approx(2 * 2 * float(c) / (2 * w), abs=1e-9)


def test_the_first_lyapunov_coefficient_of_a_plane_with_quadratic_terms() -> None:
    """The formula of Guckenheimer & Holmes (Springer, 1983), equation (3.4.11), for x' = -w y + f, y' = w x + g."""
    x, y = sp.symbols("x y", real=True)
    w, f, g = 3, x**2 / 2 - x * y / 3 + y**2 / 5 + x**3 / 7, x * y + x**2 / 4 - y**2 / 2 - x**2 * y / 6
    d = lambda e, *by: sp.diff(e, *by).subs({x: 0, y: 0})  # noqa: E731
    cubic = d(f, x, x, x) + d(f, x, y, y) + d(g, x, x, y) + d(g, y, y, y)
    mixed = d(f, x, y) * (d(f, x, x) + d(f, y, y)) - d(g, x, y) * (d(g, x, x) + d(g, y, y))
    squares = d(f, x, x) * d(g, x, x) - d(f, y, y) * d(g, y, y)
    expected = float(cubic / 16 + (mixed - squares) / (16 * w))  # of r' = a r^3
    node = sc.Field({"x": f"b*x - {w}*y + {f}", "y": f"{w}*x + b*y + {g}"}, parameters={"b": -0.1})
    branch = sc.follow(sc.equilibrium(sc.Scene(node, None, initial={"x": 0, "y": 0})), "b", to=0.1)
    hopf = min(branch.points["Hopf"], key=lambda each: abs(each.value))
    assert hopf.lyapunov == pytest.approx(2 * expected / w, rel=1e-8)


def test_blocks_of_modes_and_the_whole_matrix_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    first = sc.equilibrium(brusselators(8))
    by_blocks = sc.follow(first, "B", to=5.6)
    monkeypatch.setattr(module.ModeBlocks, "of", classmethod(lambda cls, equations: None))
    dense = sc.follow(first, "B", to=5.6)
    assert [str(each.kind) for each in by_blocks.bifurcations] == [str(each.kind) for each in dense.bifurcations]
    for one, other in zip(by_blocks.bifurcations, dense.bifurcations, strict=True):
        assert one.value == pytest.approx(other.value, abs=1e-8)
        assert one.multiplicity == other.multiplicity


def test_branches_open_as_they_were_saved(tmp_path: Path) -> None:
    branch = sc.follow(sc.equilibrium(brusselators()), "B", to=3.0)
    branch.save(tmp_path / "branch.nc")
    opened = sc.open_result(tmp_path / "branch.nc")
    assert isinstance(opened, Branch)
    np.testing.assert_array_equal(opened.values, branch.values)
    assert opened.bifurcations[0].text == branch.bifurcations[0].text
    np.testing.assert_array_equal(opened.bifurcations[0].vectors, branch.bifurcations[0].vectors)
    branch.bifurcations[0].save(tmp_path / "point.nc")
    again = sc.follow(sc.open_result(tmp_path / "point.nc"), "B", to=3.0)
    assert again.values[-1] == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("B", {}, "found no end for B; expected to=, values= or within="),
        ("b", {"to": 3}, "unknown parameter 'b'; known: "),
        ("B", {"to": 2}, "the value of the first solution; expected another value"),
        ("B", {"within": (3, 4)}, "found B = 2 of the first solution outside"),
        ("B", {"within": (4, 3)}, "expected two numbers, the lower one first"),
        ("B", {"to": 5, "within": (1, 3)}, "to: found 5, outside of within=.1, 3.; expected a value inside"),
        ("B", {"to": -1}, "B = -1.0 is not allowed"),
        ("B", {"to": 3, "largest_step": 0}, "largest_step: found 0; expected a number above 0"),
        ("B", {"to": 3, "vector": 1}, "vector: found 1; expected 0 for a branch that leaves no bifurcation"),
        ("B", {"to": 3, "direction": "left"}, "direction: found 'left'; expected 'both', 'up' or 'down'"),
    ],
)
def test_what_is_refused(name: str, options: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        sc.follow(sc.equilibrium(brusselators()), name, **options)


@pytest.mark.parametrize(("K", "classes", "images"), [(0.2, 6, 9), (0.4, 4, 5), (0.6, 3, 3)])
def test_all_equilibria_of_two_bistable_cells(K: float, classes: int, images: int) -> None:
    """9 equilibria for K < 1/3, 5 to 1/2, then 3; those that differ by a swap of the cells are found once."""
    found = sc.equilibria(sc.Scene(CELL, PULL, sc.graphs.chain(2), initial={"x": 1}), K=K)
    assert len(found) == classes
    assert sum(1 + (abs(each.state[0] - each.state[1]) > 1e-6) for each in found) == images
    assert all(each.residual < 1e-12 for each in found)


def test_equilibria_of_machines_differ_by_more_than_turns_and_shifts() -> None:
    pair = sc.Scene(MACHINE, LINE, sc.graphs.chain(2), parameters={"P": [0.5, -0.5], "K": 1.0})
    found = sc.equilibria(pair)
    apart = sorted(abs(np.sin(each.state[0] - each.state[1])) for each in found)
    np.testing.assert_allclose(apart, [0.5, 0.5], atol=1e-12)
    assert sorted(each.stable for each in found) == [False, True]
    assert not found.stopped
    assert str(found).startswith("2 equilibria, 1 stable; 40 random starts led to no others")
    first = sc.equilibria(pair, 1)
    assert len(first) == 1
    assert first.stopped
    assert str(first).splitlines()[0].endswith("the search ended at count = 1: more may exist")
    assert pickle.loads(pickle.dumps(first)).stopped
    with pytest.raises(ValueError, match="equilibria: the range of delta is"):
        sc.equilibria(pair, ranges={"delta": (1, 0)})


@pytest.mark.parametrize("twist", [1, 2, 3])
def test_twisted_states_of_a_ring_of_phases(twist: int) -> None:
    """Eigenvalues -K cos(2 pi q/n) lambda_k of the state theta_i = 2 pi q i/n."""
    n, K = 9, 0.7
    phase = sc.Field({"theta": "w"}, parameters={"w": 0})
    pull = sc.Rates({"theta": "K*W*sin(theta_j - theta_i)"}, {"K": K})
    start = {"theta": (2 * np.pi * twist / n * np.arange(n)).tolist()}
    rest = sc.equilibrium(sc.Scene(phase, pull, sc.graphs.ring(n), initial=start))
    modes = 2 - 2 * np.cos(2 * np.pi * np.arange(n) / n)
    expected = np.sort(-K * np.cos(2 * np.pi * twist / n) * modes)
    np.testing.assert_allclose(np.sort(rest.eigenvalues.real), expected, atol=1e-12)
    assert rest.stable == (twist < n / 4)


def test_a_double_hopf_point_has_rotating_and_standing_waves() -> None:
    """A ring of four: a rotating wave, and a standing wave through nodes and one through links."""
    node = sc.Field({"v": "v - v**3/3 - w + I", "w": "2/25*(v + 7/10 - 4/5*w)"}, parameters={"I": 0.35})
    link = sc.Rates({"v": "D*W*(v_j - v_i)"}, {"D": 0.05})
    scene = sc.Scene(node, link, sc.graphs.ring(4), initial={"v": -1.1, "w": -0.5})
    double = sc.follow(sc.equilibrium(scene), "I", to=0.4).points["Hopf"][0]
    amplitudes = sorted(np.sort(np.abs(v[:4]) / np.abs(v[:4]).max()).round(9).tolist() for v in double.vectors)
    assert amplitudes == [[0, 0, 1, 1], [1, 1, 1, 1], [1, 1, 1, 1]]


def test_a_large_network_without_blocks_folds() -> None:
    """Of 2400 eigenvalues the 12 nearest to zero are computed: one passes where the parameter turns."""
    n = 1200
    power = 0.3 * (-1.0) ** np.arange(n)
    power[:2] = 0.35, -0.35
    scene = sc.Scene(MACHINE, LINE, sc.graphs.ring(n), parameters={"P": power.tolist(), "K": 2})
    with pytest.warns(RuntimeWarning, match="Hopf points are looked for in the 12 eigenvalues nearest to zero"):
        branch = sc.follow(sc.equilibrium(scene), "K", to=0.15)
    (fold,) = branch.bifurcations
    assert (str(fold.kind), branch.ends) == ("fold", ("K = 2",))
    assert not branch.stable.any()


def test_a_value_of_each_node_is_no_height_of_a_diagram() -> None:
    branch = sc.follow(sc.equilibrium(sc.Scene(CELL, PULL, sc.graphs.chain(2), initial={"x": 0})), "K", to=0.7)
    with pytest.raises(ValueError, match=r"y: found 'maximum\(x\)', one value of each node; expected one"):
        branch.plot(y="maximum(x)")


def test_a_diagram_draws_observables_and_reads_as_its_branches(tmp_path: Path) -> None:
    cell = sc.Scene(sc.Field({"x": "r*x - x**3"}, parameters={"r": -1}), initial={"x": 0})
    rest = sc.follow(sc.equilibrium(cell), "r", to=1)
    fork = sc.follow(rest.points["branch point"][0], "r", to=1)
    both = sc.diagram(rest, sc.diagram(fork))
    assert [len(each) for each in both] == [len(rest), len(fork)]
    lines = [line for line in both.plot(y="maximum(x_1**2)").lines if len(line.get_xdata()) > 1]
    assert {line.get_linestyle() for line in lines} == {"-", "--"}
    of_the_node = [line for line in both.plot(y="maximum(x**2)").lines if len(line.get_xdata()) > 1][-len(lines) :]
    assert [list(line.get_ydata()) for line in of_the_node] == [list(line.get_ydata()) for line in lines]
    for line in lines:
        across, up = np.array(line.get_xdata()), np.array(line.get_ydata())
        np.testing.assert_allclose(up, 0.0 if not up.any() else across, atol=1e-9)
    both.save(tmp_path / "both.nc")
    assert [len(each) for each in sc.open_result(tmp_path / "both.nc")] == [len(rest), len(fork)]
    with pytest.raises(ValueError, match="diagram: found branches over no parameter; expected one parameter"):
        sc.diagram()
    with pytest.raises(TypeError, match="diagram: found 3"):
        sc.diagram(3)


def test_conserved_quantities_hide_no_branch_points_and_make_none() -> None:
    """Mass moves between u and w: the mode of 2 - 2 cos(2 pi k/5) is neutral at det(A - lambda H) = 0 (C)."""
    rate = "(w*(k + u**2/(1 + u**2)) - u)"
    cell = sc.Field({"u": rate, "w": f"-{rate}"}, parameters={"k": 0.067})
    link = sc.Rates({"u": "D*W*(u_j - u_i)", "w": "10*W*(w_j - w_i)"}, {"D": 0.2})
    first = sc.equilibrium(sc.Scene(cell, link, sc.graphs.ring(5), initial={"u": 0.6, "w": 1.6}))
    branch = sc.follow(first, "D", to=0.005)
    u, w = first.state[[0, -1]]
    by_u, by_w = w * 2 * u / (1 + u**2) ** 2 - 1, 0.067 + u**2 / (1 + u**2)
    waves = 2 - 2 * np.cos(2 * np.pi * np.array([1, 2]) / 5)
    assert [(str(each.kind), each.multiplicity) for each in branch.bifurcations] == [("branch point", 2)] * 2
    expected = 10 * by_u / (10 * waves + by_w)
    np.testing.assert_allclose([each.value for each in branch.bifurcations], expected, rtol=1e-9)


def test_a_conserved_momentum_passes_nowhere() -> None:
    """Rotors that feel only each other: a double eigenvalue 0 with one vector is known to the root of rounding."""
    rotor = sc.Field({"delta": "w", "w": "0*w"})
    link = sc.Rates({"w": "K*W*sin(delta_j - delta_i) + 0.3*W*(w_j - w_i)"}, {"K": 2})
    twist = 2 * np.pi * np.arange(5) / 5
    first = sc.equilibrium(sc.Scene(rotor, link, sc.graphs.ring(5), initial={"delta": twist}))
    assert sc.follow(first, "K", to=0.3).bifurcations == ()


@pytest.mark.parametrize(
    ("rates", "kind", "count"),
    [
        ({"x": "x*(x**2 - r**2)"}, "branch point", 1),
        ({"x": "r*x - x**3", "y": "-r*y - y**3"}, "branch point", 2),
        ({"x": "r*x - y", "y": "x + r*y", "u": "-r*u - 2*v", "v": "2*u - r*v"}, "Hopf", 2),
    ],
)
def test_values_that_change_no_number_of_growing_ones_are_listed(rates: dict[str, str], kind: str, count: int) -> None:
    """A growth -r^2 touches zero, r and -r exchange their signs (C)."""
    rest = sc.equilibrium(sc.Scene(sc.Field(rates, parameters={"r": -1})))
    (point,) = sc.follow(rest, "r", to=1).bifurcations
    assert (point.kind, point.multiplicity) == (kind, count)
    assert point.value == pytest.approx(0.0, abs=1e-9)


def test_values_that_all_pass_together_are_real() -> None:
    """Phases that feel sin(q_j - q_i - a) have the Jacobian -cos(a) L (C)."""
    rates = sc.Rates({"q": "W*sin(q_j - q_i - a)"}, {"a": 0.3})
    rest = sc.equilibrium(sc.Scene(sc.Field({"q": "w"}, parameters={"w": 1}), rates, sc.graphs.ring(5)))
    (point,) = sc.follow(rest, "a", to=3).bifurcations
    assert (point.kind, point.multiplicity) == ("branch point", 4)
    assert point.value == pytest.approx(np.pi / 2, abs=1e-9)
