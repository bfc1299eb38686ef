"""The period of the drive is derived from the equations: no name of a parameter makes it, and none is needed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from synchain import Friction, Lagrangian, Potential, Rates, Reset, Scene, Stop, ends
from synchain.codegen.driver.columns import SpanColumn
from synchain.models.definitions.inline import Field
from synchain.models.graphs.families import topology
from synchain.models.inputs.plugin_files import allow_code
from synchain.models.mechanics.components import TIME
from synchain.runtime.bifurcation.branches import follow
from synchain.runtime.bifurcation.periodic import periodic_orbit
from synchain.runtime.bifurcation.skeleton import skeleton
from synchain.runtime.cells.drive_times import by_place, half_swing
from synchain.runtime.cells.plan import plan
from synchain.runtime.stability.cluster_exponents import cluster_exponents
from synchain.runtime.stability.exponent_plane import plane
from synchain.runtime.stability.exponents import exponents
from synchain.runtime.stability.lyapunov import lyapunov_spectrum
from synchain.runtime.stability.msf import msf
from synchain.runtime.sweeps.certify import check_certifiable
from synchain.runtime.sweeps.run import run


def longest_step(scene: Scene) -> float:
    """The longest step of the cell that has the shortest one."""
    return float(plan(scene).spans[:, SpanColumn.LONGEST].min())


PAIR, ALONE = topology("chain", 2), topology("chain", 1)
PERIOD = 2 * np.pi / 1.2
OWN = '''
"""Oscillator with two wells, its natural frequency called omega."""
from synchain import Lagrangian

OSCILLATOR = Lagrangian(
    "v**2/2", "-omega**2*x**2/2 + x**4/4 - F*x*({wave})", {{"x": "-d*v"}}, coordinates={{"x": "v"}},
    parameters={{"d": 0.15, "F": 0.3, "omega": 1.0, "Omega": {value}}},
    source="Kovacic & Brennan, The Duffing Equation (Wiley, 2011)",
)
'''


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Own oscillators: the drive by its parameter, by an expression of it, and drives without a period."""
    folder = tmp_path_factory.mktemp("drives")
    waves = {
        "own": (1.2, "cos(Omega * t)"),
        "half": (0.6, "cos(2 * Omega * t)"),
        "comb": (0.6, "cos(2 * Omega * t) + cos(3 * Omega * t)"),
        "two": (np.sqrt(2), "cos(Omega * t) + cos(omega * t)"),
        "fading": (1.2, "cos(Omega * t) * exp(-t)"),
    }
    for name, (value, wave) in waves.items():
        path = folder / f"{name}.py"
        path.write_text(OWN.format(value=value, wave=wave))
        allow_code(path)
    return folder


def scene(files: Path, name: str = "own", **more: object) -> Scene:
    return Scene(**{"oscillator": str(files / f"{name}.py"), "topology": PAIR, **more})  # type: ignore[arg-type]


def monodromy(state: np.ndarray, force: float) -> tuple[np.ndarray, np.ndarray]:
    """The state a period later and its derivative by the first one, by SciPy."""

    def rates(t: float, y: np.ndarray) -> list[float]:
        x, v, a, b, c, e = y
        stiff = 1.0 - 3.0 * x * x
        return [
            v, x - x**3 - 0.15 * v + force * np.cos(1.2 * t), b, stiff * a - 0.15 * b, e, stiff * c - 0.15 * e,
        ]  # fmt: skip

    start = [*state, 1.0, 0.0, 0.0, 1.0]
    end = solve_ivp(rates, (0.0, PERIOD), start, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    return end[:2], end[2:].reshape(2, 2).T


def test_a_scene_takes_its_period_from_the_equations(files: Path) -> None:
    full, half = scene(files), scene(files, "half")
    assert (full.drive.frequency, half.drive.frequency) == (
        sp.Symbol("Omega", real=True),
        2 * sp.Symbol("Omega", real=True),
    )
    for driven in (full, half):
        assert driven.time_unit == "period"
        assert driven.angular_frequency == 1.2
        assert driven.period == PERIOD
        assert driven.replace(omega=3.0).period == PERIOD
        assert longest_step(driven) == PERIOD / 2
    assert full.replace(Omega=2.4).period == PERIOD / 2
    assert Scene(parameters={"omega": 1.4}).period == 2 * np.pi / 1.4


@pytest.mark.parametrize(
    ("drive", "times"),
    [
        ("cos(w*t)**2", 2), ("abs(sin(w*t))", 2), ("sin(w*t)*cos(w*t)", 2), ("cos(0.3*cos(w*t))", 2), ("cos(w*t)", 1),
        ("cos(w*t)**3", 1), ("cos(w*t)**3 - 3/4*cos(w*t)", 3), ("cos(w*t - x)**2", 2), ("cos(w*t) + cos(w*t)**2", 1),
        ("max(cos(w*t), cos(w*t + 2*pi/3), cos(w*t + 4*pi/3))", 3), ("x*cos(w*t)**2 + sin(w*t)*cos(w*t)", 2),
        ("sign(sin(w*t))", 1), ("sin(w*t)*sign(sin(w*t))", 2), ("(sin(w*t) if sin(w*t) > 0 else -sin(w*t))", 2),
        ("(1 if sin(w*t) > 0.99999 else 0)", 1), ("1/(2 + cos(w*t)**2)", 2), ("abs(cos(2*w*t)) + abs(sin(2*w*t))", 8),
        ("sqrt(1 - cos(2*w*t)**2)", 4), ("cos(w*t)**10", 2), ("(cos(w*t) + sin(w*t))**2", 2), ("max(0, sin(w*t))", 1),
        ("abs(cos(w*t)**5 - 5/4*cos(w*t)**3 + 5/16*cos(w*t))", 10), ("cos(x + v*cos(w*t))", 1),
    ],
)  # fmt: skip
def test_the_period_is_the_least_one_whatever_the_form_of_the_drive(drive: str, times: int) -> None:
    """The right-hand side repeats itself in this share of 2 pi/w, and in no smaller one."""
    driven = Scene(Field({"x": "v", "v": f"-x + {drive}"}, parameters={"w": 1.7}), None, ALONE)
    assert driven.angular_frequency == pytest.approx(times * 1.7, rel=1e-15)
    assert driven.drive.waves[0] in {k * sp.Symbol("w", real=True) for k in (1, 2)}  # steps do not become shorter
    symbols = [*(sp.Symbol(name, real=True) for name in driven.equations.state), sp.Symbol("w", real=True), TIME]
    of = np.vectorize(sp.lambdify(symbols, driven.equations.rhs()[1], "math"))
    t = np.linspace(0.0013, 3.0, 1001)
    np.testing.assert_allclose(of(0.3, 0.7, 1.7, t + driven.period), of(0.3, 0.7, 1.7, t), atol=1e-12)


@pytest.mark.parametrize(
    ("drive", "values", "frequency"),
    [
        ("cos(w*t) + cos(v*t)", {"w": 1.1, "v": 3.3}, 1.1), ("cos(t) + sin(n*t)", {"n": 15}, 1.0),
        ("cos(w*t)*cos(v*t)", {"w": 1.1, "v": 3.3}, 2.2), ("cos(w*t) + cos(v*t)", {"w": 1.0, "v": 1.2}, 0.2),
        ("cos(w*t) + cos(v*t)", {"w": 1.0, "v": 2**0.5}, None), ("cos(w*t) + cos(v*t)", {"w": 1.0, "v": 1 + 1e-9}, None),
    ],
)  # fmt: skip
def test_numbers_whose_ratio_is_rational_have_a_common_period(
    drive: str, values: dict[str, float], frequency: float | None
) -> None:
    """In that scene alone: times are counted in periods if they are asked for."""
    driven = Scene(Field({"x": f"-x + {drive}"}, parameters=values), None, ALONE, transient=2.0, window=3.0)
    assert driven.time_unit == "time"
    assert driven.angular_frequency == (None if frequency is None else pytest.approx(frequency, rel=1e-14))
    if frequency is None:
        with pytest.raises(ValueError, match="which have no common period"):
            driven.replace(time_unit="period")
        return
    counted = driven.replace(time_unit="period")
    np.testing.assert_allclose(plan(counted).spans[0, :3] * frequency / (2 * np.pi), [2.0, 5.0, 1.0])
    name = next(iter(values))
    with pytest.raises(ValueError, match=r"found a cell in which common\(.*\) is 0, or undefined"):
        plan(counted.replace(axes={name: [values[name], np.sqrt(5)]}))


def test_times_count_the_periods_of_each_cell(files: Path) -> None:
    times = {"transient": 2.0, "window": 3.0}
    over_drive = plan(scene(files, "half", axes={"Omega": [0.6, 1.2]}, **times))
    np.testing.assert_array_equal(over_drive.spans[:, :3].T, np.outer([2.0, 5.0, 1.0], [PERIOD, PERIOD / 2]))
    over_spring = plan(scene(files, axes={"omega": [0.0, 1.0, 2.0]}, **times))
    np.testing.assert_array_equal(over_spring.spans[:, :3], np.tile([2 * PERIOD, 5 * PERIOD, PERIOD], (3, 1)))


def test_the_fastest_wave_of_a_drive_limits_the_step(files: Path) -> None:
    comb = scene(files, "comb")
    assert comb.period == pytest.approx(2 * np.pi / 0.6)
    assert longest_step(comb) == pytest.approx(np.pi / 1.8)
    assert longest_step(comb.replace(axes={"Omega": [-1.0, 0.1]})) == pytest.approx(np.pi / 3.0)


@pytest.mark.parametrize(
    ("drive", "longest"),
    [
        ("exp(-(t - 60)**2/4)", 2 * np.sqrt(np.pi)), ("exp(20*(cos(2*t) - 1))", np.sqrt(np.pi / 80)),
        ("(1 - cos(t))**10", np.sqrt(np.pi / 10)), ("1/cosh(3*t - 1)**2", np.pi / 3),
        ("1/(1 + 25*(t - 3)**2)", np.sqrt(np.pi) / 5), ("cos(t)", np.pi), ("cos(t)**3", np.pi), ("tanh(30*t)", np.inf),
        ("exp(-1000*t)", np.inf), ("sqrt(1 + t**2)", np.inf), ("t**2", np.inf),
    ],
)  # fmt: skip
def test_no_step_is_longer_than_a_pulse_of_the_drive(drive: str, longest: float) -> None:
    """Functions of the states are not asked: they are seen by the step control."""
    for rate in (drive, f"({drive})*x"):
        driven = Scene(Field({"x": rate}), None, ALONE, transient=0.0, window=1.0, time_unit="time")
        assert longest_step(driven) == pytest.approx(longest)


@pytest.mark.parametrize(
    ("drive", "longest"),
    [
        ("max(0, sin(t) - 0.9)", 2 * np.arccos(0.9)),
        ("sign(sin(3*t) - 0.9999)", 2 / 3 * np.arccos(0.9999)), ("abs(sin(t) - 0.99999999)", 2 * np.arccos(0.99999999)),
        ("1 if sin(t) > 0.8 and sin(t) < 0.9 else 0", np.arcsin(0.9) - np.arcsin(0.8)), ("floor(4*t + 0.3)", 0.25),
        ("1 if 4*t - floor(4*t) < 0.1 else 0", 0.025), ("min(1, abs(t - 0.5)*1000)", 0.001),
        ("max(sin(t) - 1.5, 0)", np.sqrt(np.pi)), ("abs(sin(t) - 1)", np.sqrt(np.pi)), ("sign(t - 0.5)", np.inf),
        ("tanh(900*(t - 0.5)) - tanh(900*(t - 0.51))", 0.01), ("erf(90*(t - 0.5))*erf(90*(0.6 - t))", 0.1),
        ("1/(1 + exp(60 - 200*t))/(2 + 3*exp(200*t - 70))", 0.05 + np.log(2 / 3) / 200), ("erf(t - 0.5)", np.inf),
        ("tanh(90*(t - 0.5)) - tanh(80*(t - 0.501))", 2 / 80), ("tanh(2*sin(t)) + tanh(2*sin(t + 0.001))", 1.0),
        ("sign(t - 0.5) - tanh(80*(t - 0.501))", 2 / 80), ("1 - tanh(20*(t - 0.5))**2", 2 / 20),
        ("exp(-40*abs(t - 0.5))", 2 / 40), ("exp(-40*abs(sin(t)))", np.arcsin(2 / 40)), ("1 - erf(90*abs(t - 0.5))", 2 / 90),
        ("(1 - 1/(1 + exp(30 - 60*t)))/(1 + exp(30 - 60*t))", 2 / 60), ("3*tanh(30*t - 9)*exp(-t)", np.inf),
    ],
)  # fmt: skip
def test_no_step_is_longer_than_a_drive_stays_between_jumps_kinks_or_rises(drive: str, longest: float) -> None:
    driven = Scene(Field({"x": drive}), None, ALONE, transient=0.0, window=1.0, time_unit="time")
    assert longest_step(driven) == pytest.approx(longest, rel=1e-3)


def test_each_cell_has_the_longest_step_of_its_own_pulses() -> None:
    node = Field({"x": "1 if sin(w*t) > level else 0"}, parameters={"w": 2.0, "level": 0.0})
    swept = Scene(node, None, ALONE, axes={"level": [0.0, 0.99, 1.1]}, transient=0.0, window=1.0)
    shortest = [0.5 * np.pi, np.arccos(0.99), 0.5 * np.sqrt(np.pi)]
    longest = plan(swept).spans[:, SpanColumn.LONGEST]
    np.testing.assert_allclose(longest[1], shortest[1], rtol=1e-3)
    for k, level in enumerate([0.0, 0.99, 1.1]):
        assert longest[k] == longest_step(swept.replace(axes={}, parameters={"level": level}))


def test_short_pulses_of_unequal_nodes_are_seen_by_sweeps_and_modes() -> None:
    node = Field({"x": "-x + sign(sin(t) - level)"}, parameters={"level": 0.0})
    network = Scene(
        node, "x->x", topology("chain", 2), parameters={"level": [0.0, 0.99], "sigma": 0.1}, transient=0.0, window=1.0
    )
    assert longest_step(network) == pytest.approx(2 * np.arccos(0.99), rel=1e-3)
    values = np.array([[network.parameters[name] for name in network.equations.parameters]])
    assert half_swing(network.equations, by_place(network.equations, values)) == longest_step(network)


def test_the_fastest_drive_of_a_link_or_of_some_nodes_sets_the_longest_step() -> None:
    w, still = sp.Symbol("w"), Field({"x": "-x"})
    i, j, weight = ends(still)
    links = Scene(
        still,
        Rates({i.x: weight * (j.x - i.x) * (1 + sp.cos(w * sp.Symbol("t")))}, {"w": 1.0}),
        topology("chain", 3),
        parameters={"w": [1.0, 40.0]},
        time_unit="time",
    )
    driven = Field({"x": "-x + cos(w*t)"}, parameters={"w": 1.0})
    kinds = [{"oscillator": still, "at": [1]}, {"oscillator": driven, "at": [2, 3]}]
    values = {"w": [1.0, 40.0]}
    nodes = Scene(nodes=kinds, coupling="x->x", topology=topology("chain", 3), parameters=values, time_unit="time")
    for scene in (links, nodes):
        np.testing.assert_allclose(plan(scene).spans[:, SpanColumn.LONGEST], np.pi / 40)


@pytest.mark.parametrize("integrator", ["taylor", "dop853", "rodas5p"])
def test_a_pulse_of_the_drive_is_not_stepped_over(integrator: str) -> None:
    """x' = exp(-(t - 60)**2) is zero in double precision up to t = 33; its integral is sqrt(pi)."""
    pulse = Scene(
        Field({"x": "exp(-(t - 60)**2)"}),
        None,
        ALONE,
        transient=0.0,
        window=100.0,
        time_unit="time",
        integrator=integrator,
        initial={"x": 0.0},
    )
    assert run(pulse, show_progress=False).states("end")[0] == pytest.approx(np.sqrt(np.pi), rel=1e-6)


def test_a_drive_that_stands_still_in_a_cell_has_no_period(files: Path) -> None:
    with pytest.raises(ValueError, match=r"axis Omega: found 0, at which the drive has no period"):
        scene(files, "half", axes={"Omega": [0.0, 1.0]})
    zipped = {"axes": {"F": [0.1, 0.2], "Omega": [1.0, 0.0]}, "zipped": True}
    with pytest.raises(ValueError, match=r"axis Omega: found 0"):
        scene(files, **zipped)
    still = scene(files, time_unit="time", **zipped)
    with pytest.raises(ValueError, match="found Omega = 0 in the sweep"):
        check_certifiable(still)
    check_certifiable(scene(files, axes={"omega": [0.0, 1.0]}))


@pytest.mark.parametrize(
    ("name", "reason"),
    [("two", "is driven at Omega and omega, which have no common period"), ("fading", "depends on time other than by")],
)
def test_what_needs_a_period_refuses_a_drive_without_one(files: Path, name: str, reason: str) -> None:
    network = scene(files, name)
    assert (network.time_unit, network.period, network.angular_frequency) == ("time", None, None)
    with pytest.raises(ValueError, match=reason):
        network.replace(time_unit="period")
    refused = (
        lambda: exponents(network, [0.1]),
        lambda: msf(network, [0.1, 0.2]),
        lambda: plane(network, [0.1, 0.2], [0.0, 0.1]),
        lambda: lyapunov_spectrum(network),
        lambda: periodic_orbit(network),
        lambda: skeleton(network, "F", [0.05, 0.06]),
        lambda: cluster_exponents(network, [0, 0]),
        lambda: check_certifiable(network),
    )
    for call in refused:
        with pytest.raises(ValueError, match=reason):
            call()


def test_any_drive_runs_over_plain_times(files: Path) -> None:
    network = scene(files, "two", topology=ALONE, transient=0.0, window=20.0, rtol=1e-10, initial={"x": 0.3, "v": 0.0})
    end = run(network, show_progress=False).states("end")

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [y[1], y[0] - y[0] ** 3 - 0.15 * y[1] + 0.3 * (np.cos(np.sqrt(2) * t) + np.cos(t))]

    expected = solve_ivp(rates, (0.0, 20.0), [0.3, 0.0], method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    np.testing.assert_allclose(end, expected, atol=1e-6)


@pytest.mark.parametrize("name", ["own", pytest.param("half", marks=pytest.mark.long)])  # exponents have the half
def test_orbits_repeat_themselves_after_the_period_of_the_drive(files: Path, name: str) -> None:
    orbit = periodic_orbit(scene(files, name).lone, F=0.05)
    image, matrix = monodromy(orbit.state, 0.05)
    np.testing.assert_allclose(image, orbit.state, atol=1e-9)
    expected = np.linalg.eigvals(matrix)
    np.testing.assert_allclose(np.sort_complex(orbit.multipliers), np.sort_complex(expected), atol=1e-9)
    assert orbit.multipliers[0] == pytest.approx(0.349 + 0.578j, abs=1e-3)


def test_branches_follow_any_drive(files: Path) -> None:
    network = scene(files).lone
    orbit = periodic_orbit(network, F=0.05)
    weak = network.replace(F=0.05)
    branch = follow(orbit, "Omega", values=[1.2, 1.25])
    assert [abs(np.prod(o.multipliers)) for o in branch.orbits] == pytest.approx(
        [np.exp(-0.15 * 2 * np.pi / value) for value in branch.values], rel=1e-9
    )  # Liouville
    found = skeleton(weak, "Omega", [1.2, 1.25], periods=(1,), looks=1)
    (known,) = (b for b in found if any(_meets(each, orbit) for each in b.orbits))
    assert any(_meets(each, branch.orbits[-1]) for each in known.orbits)


def _meets(one: object, other: object) -> bool:
    return bool(np.abs(one.state - other.state).max() < 1e-7)  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", [pytest.param("own", marks=pytest.mark.long), "half"])  # orbits have their own
def test_exponents_count_the_periods_of_the_drive(files: Path, name: str) -> None:
    """Means of 300 motions over 450 periods by the classical Runge-Kutta method, their errors below 0.0007; with the
    period of the natural frequency they are 0.145, 0.109 and 0.021."""
    result = exponents(scene(files, name), [0.0, 0.2, 0.5], precision=1e-3, periods=20000, starts=8)
    np.testing.assert_allclose(result.exponent, [0.1567, 0.1169, 0.0117], atol=0.005)
    line = msf(scene(files, name), [0.0, 0.2, 0.5], precision=2e-3, periods=20000)
    np.testing.assert_allclose(line.exponent, result.exponent, atol=0.008)


def test_lyapunov_exponents_count_the_periods_of_the_drive(files: Path) -> None:
    """The sum of both is -d; with the period of the natural frequency both are -0.075."""
    result = lyapunov_spectrum(scene(files, topology=ALONE), periods=2000)
    np.testing.assert_allclose(result.exponent, [0.157, -0.307], atol=0.02)
    assert result.time == pytest.approx(2000 * PERIOD)


@pytest.mark.long
def test_planes_and_clusters_count_the_periods_of_the_drive(files: Path) -> None:
    result = plane(scene(files), [0.0, 0.2], [0.0, 0.1], precision=2e-3, periods=20000)
    np.testing.assert_allclose(result.exponent[:, 0], [0.158, 0.118], atol=0.01)
    full = cluster_exponents(scene(files, parameters={"sigma": 0.1}), [0, 0], precision=2e-3, periods=10000)
    assert full.motion == pytest.approx(0.158, abs=0.015)
    assert full.exponent[0] == pytest.approx(0.118, abs=0.015)  # sigma |gamma| = 0.2


def test_the_drive_of_rows_is_read_off_their_surfaces() -> None:
    """Time in a guard alone is a drive; that of three rows over a mass matrix is found without their minors."""
    V, x, y, v, u, t = sp.symbols("V x y v u t")
    fires = Field({V: 2 - V}, events=[Reset(V - 1 - sp.cos(4 * t) / 10, {V: 0})])
    assert Scene(fires, topology=ALONE).period == pytest.approx(np.pi / 2)
    kinetic = (v**2 + sp.cos(y) * v * u / 2 + 2 * u**2) / 2
    rub = [Friction(sp.cos(6 * t) / 3 - v - u / 2, 1 + x**2, "coulomb"), Friction(-v, 1, "coulomb"), Stop(1 - y, "1/2")]
    pad = Lagrangian(
        kinetic, x**2 + y**2, {x: sp.sin(4 * t)}, coordinates={x: v, y: u}, events=rub, contact="set-valued"
    )
    pair = Scene(pad, Potential("k*W*(y_i - y_j)**2/2", {"k": 0.1}), topology=PAIR)
    assert pair.period == pytest.approx(np.pi)
