"""Cycles of networks and their branches, against closed forms (C) and independent code (F: Fourier collocation).

The values of (F) were computed with SciPy's DOP853 at 2.5e-14 and variational equations, and checked by collocation.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import sympy as sp
from scipy.special import ellipk

import synchain as sc
from synchain.runtime.bifurcation.cycles import Cycles
from synchain.runtime.bifurcation.flow import flow_of
from synchain.runtime.bifurcation.products import product_eigenvalues

K, KAP, B, DX, DY, A = sp.symbols("k kap b Dx Dy a")
VAN_DER_POL = sc.Field({"x": "v", "v": "(1 - x**2)*v - x"})
i, j, W = sc.ends(VAN_DER_POL)
PUSH = sc.Rates({i.v: -K * W * (j.v - i.v)}, {K: 0.3})


def pair(**more: object) -> sc.Scene:
    return sc.Scene(
        VAN_DER_POL, PUSH, sc.graphs.chain(2), **{"initial": {"x": 2.0, "v": 0.0}, "transient": 50.0, **more}
    )


@cache
def ring_of_brusselators() -> sc.Scene:
    node = sc.Field({"x": "2 - (B + 1)*x + x**2*y", "y": "B*x - x**2*y"}, parameters={"B": 5.5})
    i, j, W = sc.ends(node)
    link = sc.Rates({i.x: DX * W * (j.x - i.x), i.y: DY * W * (j.y - i.y)}, {DX: 0.1, DY: 1})
    return sc.Scene(node, link, sc.graphs.ring(6), initial={"x": 2, "y": 1}, transient=50)


@cache
def repressilator(a: float) -> sc.Scene:
    node = sc.Field({"m": "-m", "p": "-5*(p - m)"})
    i, j, W = sc.ends(node)
    graph = sc.graphs.from_edges([(1, 2), (2, 3), (3, 1)], directed=True)
    link = sc.Rates({i.m: A * W / (1 + j.p**2)}, {A: a})
    return sc.Scene(node, link, graph, initial={"m": [1, 2, 3], "p": [1, 2, 4]}, transient=50)


def wave(n: int, q: int, kap: float, b: float) -> tuple[sc.Scene, float]:
    """A travelling wave of Stuart-Landau oscillators and its period (C)."""
    node = sc.Field({"x": "x - y - (x**2 + y**2)*(x - y/2)", "y": "y + x - (x**2 + y**2)*(y + x/2)"})
    i, j, W = sc.ends(node)
    rates = {i.x: KAP * W * (j.x - i.x - B * (j.y - i.y)), i.y: KAP * W * (j.y - i.y + B * (j.x - i.x))}
    slope = 2 - 2 * math.cos(2 * math.pi * q / n)
    radius = math.sqrt(1 - kap * slope)
    angles = 2 * np.pi * q * np.arange(n) / n
    start = {"x": list(radius * np.cos(angles)), "y": list(radius * np.sin(angles))}
    period = 2 * math.pi / (1 - radius**2 / 2 - kap * b * slope)
    return sc.Scene(node, sc.Rates(rates, {KAP: kap, B: b}), sc.graphs.ring(n), initial=start), period


def stick_slip(sigma: float) -> sc.Scene:
    """Blocks on a belt of speed 0.1, friction 0.4 in slip and 0.6 at rest."""
    numbers = {"nu": 0.1, "mu_k": 0.4, "mu_s": 0.6, "sigma": sigma}
    more = {"friction": "coulomb_static", "contact": "set-valued", "parameters": numbers}
    return sc.Scene("spring_block", "spring", sc.graphs.chain(2), initial={"x": 0.0, "v": 0.1}, transient=5, **more)


# --- orbits ---
def test_a_pair_is_described_by_how_it_moves() -> None:
    """In phase it is unstable across, in antiphase stable (F)."""
    together = sc.periodic_orbit(pair())
    assert together.period == pytest.approx(6.66328685932313, abs=1e-12)
    assert together.across[0].real == pytest.approx(5.92024491731, abs=1e-10)
    assert together.verdict == ("synchronous; along itself stable; across it unstable in 1 of 1 modes, largest 5.92024")
    assert not together.stable
    apart = sc.periodic_orbit(pair(initial={"x": [2.0, -1.0], "v": 0.0}))
    assert apart.period == pytest.approx(7.196573966960774, abs=1e-12)
    assert apart.multipliers[1].real == pytest.approx(0.157520224585, abs=1e-11)
    assert apart.verdict == "antiphase: node 2 half a period after node 1; stable, by the multipliers of all 2 nodes"
    assert apart.stable
    weak = sc.periodic_orbit(pair(initial={"x": [2.0, -1.0], "v": 0.0}), k=0.1)
    assert weak.period == pytest.approx(6.82122966782178, abs=1e-12)
    assert weak.multipliers[1].real == pytest.approx(0.553358926690, abs=1e-11)
    assert sc.periodic_orbit(pair(), k=0.1).across[0].real == pytest.approx(1.80183988068, abs=1e-10)


def test_newtons_method_alone_finds_an_unstable_orbit_of_the_whole_network() -> None:
    orbit = sc.periodic_orbit(pair(), start=[2.0, 2.000001, 0.0, 0.0], period=6.7)
    assert orbit.classes == (0, 1)
    assert orbit.multipliers[0].real == pytest.approx(5.92024491731, abs=1e-9)
    assert orbit.verdict == "synchronous; unstable, by the multipliers of all 2 nodes"


def test_a_lone_oscillator_is_not_its_network() -> None:
    orbit = sc.periodic_orbit(pair().lone)
    assert orbit.verdict == "one oscillator: stable"
    assert orbit.stable


def test_three_genes_travel() -> None:
    """Each protein is that of the one before it, a third of a period later (F)."""
    orbit = sc.periodic_orbit(repressilator(200.0))
    assert orbit.period == pytest.approx(9.440954865983308, abs=1e-11)
    assert orbit.multipliers[1].real == pytest.approx(0.11661576173674, abs=1e-12)
    assert orbit.pattern == "travelling wave: each node moves as the one before it, 1/3 of a period earlier"


def test_the_modes_of_synchronous_brusselators() -> None:
    """(F) for one node, and the whole network as a network."""
    orbit = sc.periodic_orbit(ring_of_brusselators())
    assert orbit.period == pytest.approx(3.98285101658994, abs=1e-12)
    assert orbit.multipliers[1].real == pytest.approx(0.01324088246646, abs=1e-12)
    assert orbit.modes == ("eigenvalue -1", "eigenvalue -3", "eigenvalue -4")
    by_mode = [orbit.across[orbit.blocks == k] for k in range(3)]
    np.testing.assert_allclose(
        [np.abs(m).max() for m in by_mode], [1.98279774621, 134.568200859, 253.141390338], rtol=4e-12
    )
    np.testing.assert_allclose(
        [m[np.abs(m).argmin()].real for m in by_mode], [-8.35478e-5, 1.928e-10, 1.28e-12], rtol=1e-5, atol=2e-13
    )
    assert "across it unstable in 5 of 5 modes, largest 253.141" in orbit.verdict
    scene = orbit.scene
    equations = scene.equations
    flow = flow_of(scene, equations, (), orbit.state)
    image = flow.linearise(scene.parameters, orbit.state[None], np.full(1, orbit.period), np.abs(orbit.state))
    whole = np.sort_complex(np.linalg.eigvals(image.propagators[0]))
    blocks = np.sort_complex(np.concatenate([orbit.multipliers, orbit.across]))
    np.testing.assert_allclose(whole, blocks, atol=1e-9)


def test_clusters_are_checked_and_followed_on_their_quotient() -> None:
    scene = sc.Scene(VAN_DER_POL, PUSH, sc.graphs.ring(4), initial={"x": [2, -2, 2, -2], "v": 0}, transient=50)
    orbit = sc.periodic_orbit(scene)
    assert orbit.classes == (0, 1, 0, 1)
    assert len(orbit.multipliers) == 4
    again = sc.periodic_orbit(scene, clusters=[5, 1, 5, 1])
    np.testing.assert_allclose(again.period, orbit.period, rtol=1e-12)
    # Alone the quotient is a pair of doubled strength.
    two = sc.periodic_orbit(pair(initial={"x": [2, -2], "v": 0}), k=0.6)
    assert orbit.period == pytest.approx(two.period, abs=1e-12)
    whole = sc.periodic_orbit(scene, start=orbit.state + 1e-7 * np.arange(8), period=orbit.period)
    ours = np.sort(np.abs(np.concatenate([orbit.multipliers, orbit.across])))
    np.testing.assert_allclose(np.sort(np.abs(whole.multipliers)), ours, atol=1e-10)
    with pytest.raises(ValueError, match="expected a balanced partition"):
        sc.periodic_orbit(scene, clusters=[0, 1, 2, 2])


@pytest.mark.parametrize(
    ("sigma", "multiplier"),
    [(0.3, 2.715726559203133), (1.0, -1.675514165536), (0.692280105026, 1.0), (0.921158234357, -1.0)],
)
def test_stick_and_slip_without_a_drive(sigma: float, multiplier: float) -> None:
    """T = pi + 2 atan(v/a) + 2 a/v; across mu = cos(w t) - (a w/v) sin(w t), w = sqrt(1 + 2 sigma) (C)."""
    v, a = 0.1, 0.2
    slip, w = math.pi + 2 * math.atan(v / a), math.sqrt(1 + 2 * sigma)
    orbit = sc.periodic_orbit(stick_slip(sigma))
    assert orbit.period == pytest.approx(slip + 2 * a / v, abs=1e-11)
    assert orbit.across[0].real == pytest.approx(math.cos(w * slip) - a * w / v * math.sin(w * slip), abs=1e-11)
    assert orbit.across[0].real == pytest.approx(multiplier, abs=1e-10)
    np.testing.assert_allclose(orbit.multipliers, [1.0, 0.0], atol=1e-11)
    if abs(multiplier) != 1.0:
        assert orbit.stable == (0.692280105026 < sigma < 0.921158234357)


@pytest.mark.parametrize("name", ["nu", "mu_k", "mu_s", "sigma"])
def test_the_derivative_by_a_parameter_passes_stick_and_slip(name: str) -> None:
    """Guards and grounds depend on parameters: against central differences of the flow itself."""
    scene = stick_slip(0.3)
    state, time = np.array([[-0.35, -0.3, 0.05, 0.07]]), np.full(1, 12.0)
    flow = flow_of(scene, scene.equations, (name,), state[0])
    image = flow.linearise(scene.parameters, state, time, np.ones(4))
    h = 1e-6
    ahead, behind = (flow.advance({**scene.parameters, name: scene.parameters[name] + e}, state, time) for e in (h, -h))
    np.testing.assert_allclose(image.columns[0, :, 0], (ahead - behind)[0] / (2 * h), atol=2e-8)
    assert np.abs(image.columns).max() > 1e-3


# --- the problem ---
@pytest.mark.parametrize("segments", [1, 3])
def test_the_derivatives_of_the_problem_are_those_of_its_residual(segments: int) -> None:
    orbit = sc.periodic_orbit(pair(initial={"x": [2.0, -1.0], "v": 0.0}))
    first = Cycles.of(orbit, "k")
    states = first.orbit_states(first.point, segments)
    problem = Cycles.near(orbit.scene, ("k",), orbit.classes, states, orbit.period, 0)
    z = problem.point + 1e-3 * np.random.default_rng(0).normal(size=len(problem.point))
    matrix = problem.linearise(z)[1]
    steps = 1e-6 * np.eye(len(z))
    differences = [(problem.linearise(z + e)[0] - problem.linearise(z - e)[0]) / 2e-6 for e in steps]
    np.testing.assert_allclose(matrix, np.array(differences).T, atol=1e-7)


def test_the_period_of_a_drive_moves_with_its_frequency() -> None:
    node = sc.Field({"x": "v", "v": "-x - x**3 - v/10 + 0.3*cos(w*t)"}, parameters={"w": 1.2})
    scene = sc.Scene(node, initial={"x": 0.5, "v": 0.0})
    problem = Cycles.near(scene, ("w",), (0,), np.array([[0.4, 0.1]]), 4 * math.pi / 1.2, 2)
    z = problem.point
    matrix, h = problem.linearise(z)[1], np.array([0.0, 0.0, 1e-6])
    difference = (problem.linearise(z + h)[0] - problem.linearise(z - h)[0]) / 2e-6
    np.testing.assert_allclose(matrix[:, -1], difference, atol=1e-8)


def test_small_multipliers_of_many_segments() -> None:
    """The product of matrices with eigenvalues 1e8 and 1e-8 each, five times."""
    rng = np.random.default_rng(3)
    bases = [rng.normal(size=(3, 3)) for _ in range(5)]
    numbers = np.array([[1e4, -2.0, 1e-4], [1e3, 1.0, 1e-4], [1e4, 0.5, 1e-3], [1e2, 1.0, 1e-4], [1e4, 1.0, 1e-4]])
    cycle = zip(bases[1:] + bases[:1], numbers, bases, strict=True)
    matrices = np.array([left @ np.diag(each) @ np.linalg.inv(right) for left, each, right in cycle])
    found = np.sort(product_eigenvalues(matrices).real)
    np.testing.assert_allclose(found, np.sort(numbers.prod(axis=0)), rtol=1e-6)


# --- branches ---
def at(branch: sc.results.Branch, value: float) -> sc.results.PeriodicOrbit:
    return next(o for v, o in zip(branch.values, branch.orbits, strict=True) if v == value)


def test_the_unstable_cycles_of_lorenz_are_born_at_its_hopf_point() -> None:
    """Subcritical at r = 470/19 (C); cycles (F)."""
    node = sc.Field({"x": "10*(y - x)", "y": "r*x - y - x*z", "z": "x*y - 8*z/3"}, parameters={"r": 20.0})
    rest = sc.equilibrium(sc.Scene(node, initial={"x": 7, "y": 7, "z": 19}))
    (hopf,) = sc.follow(rest, "r", to=26.0).points["Hopf"]
    assert hopf.value == pytest.approx(470 / 19, abs=1e-11)
    assert hopf.frequency == pytest.approx(9.624530063715754, abs=1e-11)
    assert hopf.lyapunov > 0.0
    cycles = sc.follow(hopf, "r", to=20.0, values=[24.0, 22.0, 20.0])
    for r, period, multiplier in (
        (24.0, 0.679336764198, 1.03208829783),
        (22.0, 0.764386427426, 1.160763014),
        (20.0, 0.876552253492, 1.402070818),
    ):
        orbit = at(cycles, r)
        assert orbit.period == pytest.approx(period, abs=2e-12)
        assert orbit.multipliers[0].real == pytest.approx(multiplier, abs=1e-9)
        assert not orbit.stable


@pytest.mark.parametrize("radius", [1e-4, 3e-4, 5e-4])
def test_small_circles_are_born_at_a_hopf_point(radius: float) -> None:
    """Circles around (1, 1): half a period later, their states differ by 2 r, as at a period doubling (C)."""
    inward = f"({radius}**2 - (x - 1)**2 - (y - 1)**2)"
    node = sc.Field({"x": f"{inward}*(x - 1) - (y - 1)", "y": f"{inward}*(y - 1) + x - 1"})
    circles = Cycles.near(sc.Scene(node), (), (0,), np.array([[1.0 + radius, 1.0]]), 2.0 * np.pi, 0)
    circles = replace(circles, scale=np.ones(2))  # extent of the first orbit of the branch
    z, gap, _ = circles.solved()
    assert gap < 1e-10
    assert circles.states(z)[0] == pytest.approx([1.0 + radius, 1.0], abs=radius / 10)
    assert circles.birth(z) == "Hopf"


LORENZ = sc.Field({"x": "10*(y - x)", "y": "x*(r - z) - y", "z": "x*y - 8*z/3"}, parameters={"r": 24})


@cache
def cycles_of_lorenz(x: float, y: float, z: float, t: float) -> sc.results.Branch:
    """The cycles from the Hopf point to r = 24, with a unit of each state and of time."""
    rates = {
        "x": f"10*(y*{x / y!r} - x)/{t!r}",
        "y": f"(r*x*{y / x!r} - y - x*z*{y / x / z!r})/{t!r}",
        "z": f"(x*y*{z / x / y!r} - 8*z/3)/{t!r}",
    }
    scene = sc.Scene(sc.Field(rates, parameters={"r": 20.0}), initial={"x": 7 * x, "y": 7 * y, "z": 19 * z})
    (hopf,) = sc.follow(sc.equilibrium(scene), "r", to=26.0).points["Hopf"]
    assert hopf.value == pytest.approx(470 / 19, abs=1e-11)
    return sc.follow(hopf, "r", to=24.0)


@pytest.mark.parametrize("units", [(1.0, 1e-9, 1e6, 1.0), (1e9, 1e3, 1e-6, 1e-6), (1e-9, 1e6, 1.0, 1e6)])
def test_cycles_are_born_alike_in_any_unit_of_each_state_and_of_time(units: tuple[float, float, float, float]) -> None:
    """As many solutions as in units of 1, to within the powers of 2 that balance the states; the cycle at r = 24 (F)."""
    cycles, plain = cycles_of_lorenz(*units), cycles_of_lorenz(1.0, 1.0, 1.0, 1.0)
    assert abs(len(cycles) - len(plain)) <= 3
    assert cycles[-1].period / units[3] == pytest.approx(0.679336764198, abs=2e-12)
    assert cycles[-1].multipliers[0].real == pytest.approx(1.03208829783, abs=1e-9)


def test_newtons_method_reaches_the_unstable_cycle_of_lorenz_from_afar() -> None:
    """Full steps from this start lead away; shorter ones reach the cycle (F), on several segments and on one."""
    scene, start = sc.Scene(LORENZ), np.array([7.0, 7.0, 19.0])
    orbit = sc.periodic_orbit(scene, start=start, period=0.68)
    assert orbit.period == pytest.approx(0.679336764198, abs=2e-12)
    assert orbit.multipliers[0].real == pytest.approx(1.03208829783, abs=1e-9)
    single = Cycles.near(scene, (), (0,), start[None], 0.68, 0)
    z, gap, _ = single.solved()
    assert single.period(z) == pytest.approx(0.679336764198, abs=2e-12)
    assert gap < 1e-12


def test_period_doublings_of_rossler_are_followed_both_ways() -> None:
    """(F)"""
    node = sc.Field({"x": "-y - z", "y": "x + y/5", "z": "1/5 + z*(x - c)"}, parameters={"c": 2.5})
    single = sc.follow(sc.periodic_orbit(sc.Scene(node, initial={"x": 1, "y": 1, "z": 0})), "c", to=3.0)
    assert single[0].period == pytest.approx(5.748991183278, abs=1e-12)
    assert single[0].multipliers[1].real == pytest.approx(-0.769693641734, abs=1e-11)
    (first,) = single.points["period doubling"]
    assert first.value == pytest.approx(2.832445027862, abs=1e-11)
    assert first.solution.period == pytest.approx(5.76982001651, abs=1e-10)
    double = sc.follow(first, "c", to=3.9, values=[3.2])
    assert at(double, 3.2).period == pytest.approx(11.53108104121, abs=1e-10)
    assert at(double, 3.2).multipliers[1].real == pytest.approx(0.154192527644, abs=1e-11)
    (second,) = double.points["period doubling"]
    assert second.value == pytest.approx(3.83735816841, abs=1e-11)
    assert second.solution.period == pytest.approx(11.5726888045, abs=1e-9)
    back = sc.follow(double[-1], "c", to=2.5)
    assert [str(each.kind) for each in back.bifurcations] == ["period doubling"] * 2
    assert back.bifurcations[-1].value == pytest.approx(first.value, abs=1e-9)
    assert back.ends == ("period doubling at c = 2.832445",)


def test_duffings_resonance_goes_through_both_folds() -> None:
    """The parameter moves the period of the drive; folds by Fourier collocation and a bordered Newton method (F)."""
    node = sc.Field({"x": "v", "v": "-x - x**3 - v/10 + 0.3*cos(w*t)"}, parameters={"w": 0.8})
    first = sc.periodic_orbit(sc.Scene(node, initial={"x": 0.5, "v": 0}, transient=100))
    branch = sc.follow(first, "w", to=2.2, largest_step=0.04)
    folds = [each.value for each in branch.points["fold"]]
    assert folds == pytest.approx([1.7797195242986, 1.3242362007706], abs=5e-13)
    assert len(branch) > 100
    assert branch.growing.max() == 1


def test_modes_leave_the_synchronous_resonance_of_a_pair() -> None:
    """Branch points of the mode across, on the branch of one node (F)."""
    node = sc.Field({"x": "v", "v": "-x - x**3 - v/10 + 0.3*cos(w*t)"}, parameters={"w": 1.2})
    i, j, W = sc.ends(node)
    pull = sc.Rates({i.v: K * W * (j.x - i.x)}, {K: 0.05})
    two = sc.Scene(node, pull, sc.graphs.chain(2), initial={"x": 0.5, "v": 0}, transient=100)
    branch = sc.follow(sc.periodic_orbit(two), "w", to=2.0)
    points = branch.points["branch point"]
    assert [each.value for each in points] == pytest.approx([1.68034293778, 1.3252959488], abs=1e-10)
    assert {each.mode for each in points} == {"eigenvalue -2"}
    other = sc.follow(points[0], "w", within=(1.5, 2.0))
    apart = [abs(orbit.state[0] - orbit.state[1]) for orbit in other.orbits]
    assert max(apart) > 0.1
    assert other[-1].classes == (0, 1)


@pytest.mark.parametrize(("name", "to", "torus"), [("b", -1.8, -1.6294054545460515), ("kap", 0.6, 0.440088365916)])
def test_a_travelling_wave_loses_its_stability_in_a_torus(name: str, to: float, torus: float) -> None:
    """Stuart-Landau ring of eight (C)."""
    scene, period = wave(8, 1, 0.3, -1.0)
    orbit = sc.periodic_orbit(scene, start=scene.y0, period=period)
    assert orbit.period == pytest.approx(8.228330594465563, abs=1e-12)
    assert orbit.multipliers[1] == pytest.approx(-0.855495443372 + 0.078015999042j, abs=1e-11)
    branch = sc.follow(orbit, name, to=to)
    (found,) = branch.points["torus"]
    assert found.value == pytest.approx(torus, abs=1e-11)


def test_cycles_of_a_bautin_cell_turn_at_their_fold() -> None:
    """r' = r (b + r^2 - r^4): unstable r = 1/2 and stable r = sqrt(3)/2 at b = -3/16, fold at -1/4 (C)."""
    growth = "(b + (x**2 + y**2) - (x**2 + y**2)**2)"
    node = sc.Field({"x": f"x*{growth} - y", "y": f"y*{growth} + x"}, parameters={"b": -0.5})
    rest = sc.equilibrium(sc.Scene(node, initial={"x": 0, "y": 0}))
    (hopf,) = sc.follow(rest, "b", to=0.5).points["Hopf"]
    cycles = sc.follow(hopf, "b", within=(-1.0, 0.5), values=[-3 / 16])
    (fold,) = cycles.points["fold"]
    assert fold.value == pytest.approx(-0.25, abs=1e-12)
    unstable, stable = (o for v, o in zip(cycles.values, cycles.orbits, strict=True) if v == -3 / 16)
    assert np.hypot(*unstable.state) == pytest.approx(0.5, abs=1e-11)
    assert np.hypot(*stable.state) == pytest.approx(math.sqrt(3) / 2, abs=1e-11)
    assert unstable.multipliers[0].real == pytest.approx(math.exp(math.pi / 2), abs=1e-9)
    assert stable.multipliers[1].real == pytest.approx(math.exp(-3 * math.pi / 2), abs=1e-11)


def test_the_cycles_of_three_genes_lead_from_the_hopf_point_to_large_strengths() -> None:
    """Hopf point (C), cycle at a = 200 (F)."""
    rest = sc.equilibrium(repressilator(5.0).replace(initial={"m": 1, "p": 1}))
    (hopf,) = sc.follow(rest, "a", to=10.0).points["Hopf"]
    assert hopf.value == pytest.approx(7.393774506123546, abs=1e-11)
    assert hopf.frequency == pytest.approx((math.sqrt(96) - 6) / (2 * math.sqrt(3)), abs=1e-12)
    last = sc.follow(hopf, "a", to=200.0)[-1]
    assert last.period == pytest.approx(9.440954865983308, abs=1e-11)
    assert last.multipliers[1].real == pytest.approx(0.11661576173674, abs=1e-11)


def test_a_branch_of_cycles_ends_at_the_longest_period() -> None:
    """Cycles that are born at m = 0 grow into a homoclinic orbit (Kuznetsov, section 8.4)."""
    node = sc.Field({"x": "y", "y": "m + n*x + x**2 - x*y"}, parameters={"m": -0.3, "n": -1})
    rest = sc.equilibrium(sc.Scene(node, None, initial={"x": -0.5, "y": 0}))
    (hopf,) = sc.follow(rest, "m", within=(-1, 0.1)).points["Hopf"]
    cycles = sc.follow(hopf, "m", within=(-1, 1), longest_period=12.0)
    assert cycles[-1].period == 12.0
    assert cycles.ends == ("period = 12: homoclinic?",)
    assert not cycles.bifurcations
    assert np.all(np.diff(cycles.values[-5:]) < 0)
    with pytest.raises(ValueError, match="longest_period: found solutions without a period of their own"):
        sc.follow(rest, "m", to=0, longest_period=3.0)


def test_rotors_that_turn_at_different_speeds_close_in_a_moving_frame() -> None:
    """The difference D of two rotors obeys D'' = P_1 - P_2 - g D' - 2 K sin D; their mean speed is (P_1 + P_2)/(2 g)."""
    difference = sc.Field({"D": "w", "w": "1.4 - g*w - 2*K*sin(D)"}, parameters={"g": 0.2, "K": 0.3})
    one = sc.periodic_orbit(sc.Scene(difference, initial={"D": 0, "w": 7}), start=[0.0, 7.0], period=0.9)
    node = sc.Field({"d": "w", "w": "P - g*w"}, parameters={"P": 0, "g": 0.2})
    line = sc.Rates({"w": "K*W*sin(d_j - d_i)"}, {"K": 0.3})
    two = sc.Scene(node, line, sc.graphs.chain(2), parameters={"P": [1.0, -0.4]}, initial={"d": 0, "w": 0})
    orbit = sc.periodic_orbit(two, start=[0, 0, 5, -2], period=0.9)
    assert orbit.period == pytest.approx(one.period, rel=1e-12)
    assert orbit.shifts == ("d",)
    assert orbit.speeds[0] == pytest.approx(1.5 + math.pi / orbit.period, rel=1e-12)
    decay = math.exp(-0.2 * orbit.period)
    np.testing.assert_allclose(orbit.multipliers, [1, 1, decay, decay], atol=1e-11)
    assert orbit.stable
    assert "frame        d of all nodes at the mean speed 4.99973" in str(orbit)
    branch = sc.follow(orbit, "K", to=0.5)
    assert branch[-1].period == pytest.approx(sc.periodic_orbit(one.scene, start=one.state, period=0.9, K=0.5).period)


def test_several_solutions_are_followed_at_once() -> None:
    """Of the equilibria of two bistable cells at m = 0 two pairs meet in folds."""
    cell = sc.Field({"x": "x - x**3 + m"}, parameters={"m": 0})
    link = sc.Rates({"x": "K*W*(x_j - x_i)"}, {"K": 0.2})
    scene = sc.Scene(cell, link, sc.graphs.chain(2), initial={"x": 1})
    found = sc.equilibria(scene)
    branches = sc.follow(found, "m", to=0.1)
    assert len(branches) == len(found) == 6
    alone = sc.follow(found[1], "m", to=0.1)
    np.testing.assert_array_equal(branches[1].values, alone.values)
    assert [len(each.points["fold"]) for each in branches] == [0, 1, 1, 0, 0, 0]
    with pytest.raises(TypeError, match="for one parameter a sequence of them"):
        sc.follow([], "m", to=1.0)


def test_where_newtons_method_fails_the_motion_leads_to_a_recurrence() -> None:
    """From 27 of 60 starts around the cycle of Lorenz Newton's method alone finds it, from 49 after a recurrence."""
    rng = np.random.default_rng(1)
    starts = [(8 + 3 * rng.normal(size=3) + [0, 0, 15], 0.68 * np.exp(rng.normal() / 10)) for _ in range(2)]
    for start, period in starts:
        assert not closes(start, period)
        orbit = sc.periodic_orbit(sc.Scene(LORENZ), start=start, period=period)
        assert orbit.period == pytest.approx(0.679336764198, abs=2e-12)


def closes(start: np.ndarray, period: float) -> bool:
    """Return whether Newton's method reaches the cycle from a start alone, with the segments of `periodic_orbit`."""
    scene = sc.Scene(LORENZ)
    flow = flow_of(scene, scene.equations, (), start)
    times = np.arange(1, 4) * period / 4
    states = np.vstack([start, flow.advance(scene.parameters, np.tile(start, (3, 1)), times)])
    return Cycles.near(scene, (), (0,), states, period, 0).solved()[1] < 1e-8


def test_a_conservative_family_is_followed_in_a_parameter_that_breaks_it() -> None:
    """The pendulum with damping e: T = 4 K(sin^2(amplitude/2)) at e = 0; along g the cycle is one of many (C)."""
    node = sc.Field({"q": "v", "v": "-g*sin(q) - e*v"}, parameters={"g": 1, "e": 0})
    orbit = sc.periodic_orbit(sc.Scene(node), start=[1, 0], period=6.5)
    with pytest.raises(ValueError, match="follow: found many cycles at g = 1, as under a conserved quantity"):
        sc.follow(orbit, "g", to=2)
    family = sc.follow(orbit, "e", within=(-1, 1), longest_period=12, direction="up")
    q, v = np.array([each.state for each in family]).T
    periods = [each.period for each in family.orbits]
    np.testing.assert_allclose(periods, 4 * ellipk(v**2 / 4 + np.sin(q / 2) ** 2), rtol=1e-9)
    assert max(periods) - min(periods) > 1
    np.testing.assert_allclose(family.values, 0, atol=1e-8)
    assert family.points["fold"] == ()
    with pytest.raises(KeyError, match=r"points: found 'foold'; expected fold, branch point, .* did you mean 'fold'"):
        family.points["foold"]
