"""Observables of runs beside independent integrals, records and trajectories."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from scipy.special import ive

from synchain import Field, Scene, open_result, run, stream
from synchain.graphs import chain, complete, ring
from synchain.models.mechanics.components import TIME
from synchain.observe import end, maximum, mean, minimum, nodes, rate, variance
from synchain.results import Result, Status
from synchain.runtime.cells.reduce import as_reduction

x, v, x_1, v_1, theta, t = sp.symbols("x v x_1 v_1 theta t")
T = np.linspace(0.0, 20.0, 2_000_001)
ERROR = sp.sqrt((x - x_1) ** 2 + (v - v_1) ** 2)


def integrals(scene: Scene, values: list[sp.Expr]) -> np.ndarray:
    """The means over the window of expressions of x_1 … and t, as further states of SciPy's DOP853."""
    equations = scene.equations
    symbols = [sp.Symbol(name, real=True) for name in (*equations.state, *equations.parameters)]
    rates = sp.lambdify([TIME, *symbols], equations.rhs(), "numpy", cse=True)
    own = sp.lambdify([TIME, *symbols], [e.xreplace({s: sp.Symbol(s.name, real=True) for s in e.free_symbols})
                                         for e in values], "numpy", cse=True)  # fmt: skip
    parameter_values = [scene.parameters[name] for name in equations.parameters]
    size = len(equations.state)

    def before(time, y):
        return np.array(rates(time, *y, *parameter_values), float)

    def inside(time, y):
        return np.concatenate([before(time, y[:size]), np.array(own(time, *y[:size], *parameter_values), float)])

    unit = scene.period if scene.time_unit == "period" else 1.0
    begin, finish = scene.transient * unit, (scene.transient + scene.window) * unit
    start = solve_ivp(before, (0.0, begin), scene.y0, "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    solution = solve_ivp(
        inside, (begin, finish), np.concatenate([start, np.zeros(len(values))]), "DOP853", rtol=1e-13, atol=1e-14
    )
    return solution.y[size:, -1] / (finish - begin)


def names(component: str, n: int) -> list[sp.Symbol]:
    return [sp.Symbol(f"{component}_{i + 1}") for i in range(n)]


NUMBERS = {"transient": 1.0, "window": 9.0, "time_unit": "time"}


def duffing(n: int, **more: object) -> Scene:
    """A driven network of unequal nodes, with smooth values and one that comes close to a kink."""
    return Scene(
        oscillator="duffing", topology=ring(n), rtol=1e-13, atol=1e-14, record=(), **NUMBERS,
        parameters={"sigma": 0.2, "beta": [0.3 + 0.01 * i for i in range(n)]},
        initial={"x": [0.1 + 0.1 * i for i in range(n)]},
        observe={
            "energy": mean(nodes.mean(v**2 / 2 + x**2 / 2)),
            "power": mean(nodes.sum(v * sp.cos(t) * sp.Symbol("beta"))),
            "spread": mean(nodes.std(x)),
            "own": mean(x * nodes.mean(v) + sp.exp(-(nodes[2](x) ** 2))),
        }, **more,
    )  # fmt: skip


@functools.cache
def of_duffing(n: int) -> np.ndarray:
    """The same means, spelled out node by node."""
    xs, vs = names("x", n), names("v", n)
    average = sum(xs) / n
    energy = sum(a**2 / 2 + b**2 / 2 for a, b in zip(xs, vs, strict=True)) / n
    power = sum(b * sp.cos(t) * sp.Symbol(f"beta_{i + 1}") for i, b in enumerate(vs))
    spread = sp.sqrt(sum((a - average) ** 2 for a in xs) / n)
    rates = [a * sum(vs) / n + sp.exp(-(xs[1] ** 2)) for a in xs]
    return integrals(duffing(n), [energy, power, spread, *rates])


@pytest.mark.parametrize(
    ("integrator", "n"),
    [("rodas5p", 3), ("taylor", 12), *(pytest.param(*other, marks=pytest.mark.long) for other in
     [("rodas5p", 12), ("dop853", 3), ("dop853", 12), ("taylor", 3)])],
)  # fmt: skip
def test_means_are_the_integrals_that_scipy_finds(integrator: str, n: int) -> None:
    """Of a driven network, written out and in loops; the near kink of the spread needs panels that are halved."""
    result = run(duffing(n, integrator=integrator), show_progress=False)
    assert result.own.dims == ("node",)
    assert result.node.values.tolist() == list(range(1, n + 1))
    values = np.concatenate([[result.energy, result.power, result.spread], result.own])
    np.testing.assert_allclose(values, of_duffing(n), rtol=0, atol=1e-10)


@pytest.mark.parametrize("integrator", [pytest.param("dop853", marks=pytest.mark.long), "taylor"])
def test_kinks_are_found(integrator: str) -> None:
    """The mean of |cos t| over whole periods is 2/pi, and that of cos^2 t is 1/2; each step meets a kink."""
    scene = Scene(
        oscillator="harmonic", integrator=integrator, rtol=1e-12, record=(), transient=0.0, window=4 * math.pi,
        time_unit="time", initial={"x": [1.0], "v": [0.0]},
        observe={"size": mean(abs(x)), "square": "mean(x**2)", "swing": variance(x), "top": maximum(v)},
    )  # fmt: skip
    result = run(scene, show_progress=False)
    assert float(result.data["size"][0]) == pytest.approx(2 / math.pi, abs=1e-8)
    assert float(result.square[0]) == pytest.approx(0.5, abs=1e-10)
    assert float(result.swing[0]) == pytest.approx(0.5, abs=1e-10)
    assert float(result.top[0]) == pytest.approx(1.0, abs=1e-11)


@pytest.mark.parametrize("integrator", ["taylor", "dop853"])
def test_jumps_and_singular_places_are_integrated_or_said(integrator: str) -> None:
    """Over x = cos t from 0 to 2 pi; the mean of 1/x has no value, that of |x|^(-1/2) none to ten digits of 2^-40 of a step."""
    last = 2 * math.pi
    expected = {
        "mean(max(sign(x), 0))": 0.5, "variance(sign(x))": 1.0, "mean(floor(x + 1/2))": 0.0,
        "mean(log(abs(x)))": -math.log(2), "mean(1/x)": math.nan, "mean(1/sqrt(abs(x)))": math.nan,
    }  # fmt: skip
    scene = Scene(
        "harmonic", initial={"x": 1.0, "v": 0.0}, transient=0, window=last, time_unit="time", record=(), rtol=1e-10,
        integrator=integrator, observe={f"o{k}": text for k, text in enumerate(expected)},
    )  # fmt: skip
    result = run(scene, show_progress=False)
    for k, (text, value) in enumerate(expected.items()):
        np.testing.assert_allclose(float(result.data[f"o{k}"].squeeze()), value, rtol=0, atol=1e-9, err_msg=text)
    loose = run(scene.replace(rtol=1e-6), show_progress=False)
    exact = math.gamma(0.25) / (math.gamma(0.75) * math.sqrt(math.pi))
    assert float(loose.o5.squeeze()) == pytest.approx(exact, rel=1e-4)


EDGED = {
    "sign(x - 0.999)": lambda x: np.sign(x - 0.999),
    "max(0, x - 0.999)": lambda x: np.maximum(0, x - 0.999),
    "floor(x + 1e-3)": lambda x: np.floor(x + 1e-3),
    "abs(abs(x) - 0.999)": lambda x: abs(abs(x) - 0.999),
}
SMOOTH = {
    "exp(200*(x - 1))": lambda x: np.exp(200 * (x - 1)),
    "exp(-1e6*(x - 0.3)**2)": lambda x: np.exp(-1e6 * (x - 0.3) ** 2),
    "tanh(500*(x - 0.999))": lambda x: np.tanh(500 * (x - 0.999)),
    "1 - tanh(500*(x + 0.2))**2": lambda x: 1 - np.tanh(500 * (x + 0.2)) ** 2,
    "1/(1 + exp(-500*(x - 0.999)))": lambda x: (1 + np.tanh(250 * (x - 0.999))) / 2,
}
"""Functions of x that are constant to rounding but for a short time of each turn of x = cos t, with corners and without."""

TURNING = Scene(
    "harmonic", topology=chain(2), initial={"x": 1.0, "v": 0.0}, transient=0.0, window=8 * math.pi, time_unit="time",
    record=(), rtol=1e-12, parameters={"sigma": 0.0},
)  # fmt: skip


@functools.cache
def means(*texts: str) -> dict[str, np.ndarray]:
    """Means of functions of x = cos t, which one scene of long steps observes."""
    observe = {f"o{k}": f"mean({text})" for k, text in enumerate(texts)}
    data = run(TURNING.replace(observe=observe), show_progress=False, reduce=False).data
    return {text: data[f"o{k}"].values for k, text in enumerate(texts)}


@pytest.mark.parametrize(("group", "text"), [(group, text) for group in (EDGED, SMOOTH) for text in group])
def test_short_excursions_inside_long_steps_are_seen(group: dict[str, Callable], text: str) -> None:
    """Between two points of the rule, where all of its values are those of a constant."""
    turn = np.linspace(0.0, math.pi, 4_000_001)
    values = group[text](np.cos((turn[1:] + turn[:-1]) / 2))
    np.testing.assert_allclose(means(text)[text], float(np.mean(values)), rtol=1e-6, atol=1e-9)


def test_short_excursions_inside_reductions_are_seen() -> None:
    mean_of_all = means("nodes.sum(max(0, x - 0.999))")["nodes.sum(max(0, x - 0.999))"]
    np.testing.assert_allclose(mean_of_all, 2 * means("max(0, x - 0.999)")["max(0, x - 0.999)"][0], rtol=1e-7)


@pytest.mark.parametrize(("group", "text"), [(EDGED, "sign(x - 0.999)"), (SMOOTH, "exp(200*(x - 1))")])
def test_an_observable_does_not_depend_on_those_beside_it(group: dict[str, Callable], text: str) -> None:
    np.testing.assert_allclose(means(text)[text], means(*group)[text], rtol=1e-9)


EDGE = math.acos(0.99)
PULSES = {
    "exp(200*(cos(a) - 1))": float(ive(0, 200)),
    "max(0, cos(a) - 0.99)": (math.sin(EDGE) - 0.99 * EDGE) / math.pi,
    "exp(-1000*(a - 77)**2)": math.sqrt(math.pi / 1000) / (32 * math.pi),
}
"""Functions of a phase, and their means over 16 turns."""


@pytest.mark.parametrize("text", PULSES)
def test_short_pulses_of_a_phase_are_seen(text: str) -> None:
    """In steps of many turns."""
    scene = Scene(
        Field({"a": "om"}, parameters={"om": 1.0}), initial={"a": 0.3}, transient=0, window=32 * math.pi,
        time_unit="time", record=(), observe={"pulse": f"mean({text})"},
    )  # fmt: skip
    result = run(scene, show_progress=False)
    assert float(result.pulse.squeeze()) == pytest.approx(PULSES[text], rel=1e-6)


@pytest.mark.parametrize("integrator", ["taylor", "rodas5p", pytest.param("dop853", marks=pytest.mark.long)])
def test_extremes_between_the_points_of_the_rule_are_found(integrator: str) -> None:
    """Of x = cos t and v = -sin t, smooth ones within the tolerance and one with a kink nearly so."""
    closed = {
        "low": ("minimum(x)", -1.0),
        "product": ("maximum(abs(x*v))", 0.5),
        "ripple": ("minimum(x + sin(5*t)/20)", float(np.min(np.cos(T) + np.sin(5 * T) / 20))),
        "kink": ("minimum(max(x, v))", -math.sqrt(0.5)),
    }
    scene = Scene(
        oscillator="harmonic", integrator=integrator, rtol=1e-10, record=(), transient=0.0, window=20.0,
        time_unit="time", initial={"x": [1.0, 1.0], "v": [0.0, 0.0]}, topology=chain(2),
        observe={name: expression for name, (expression, _) in closed.items()} | {"all": "maximum(nodes.sum(v))"},
    )  # fmt: skip
    result = run(scene, show_progress=False)
    for name, (_, value) in closed.items():
        np.testing.assert_allclose(result.data[name], value, rtol=0, atol=1e-6 if name == "kink" else 2e-9)
    assert float(result.data["all"]) == pytest.approx(2.0, abs=2e-9)


ROTORS = Scene(
    oscillator="rotor", coupling="torsion", topology=complete(10), rtol=1e-11, record=("sync_error", "trajectory"),
    samples=3, parameters={"power": [0.1 * math.sin(3 * i) for i in range(10)]}, **NUMBERS, integrator="taylor",
    initial={"x": [0.3 * i for i in range(10)]}, axes={"sigma": [0.05, 0.1, 0.3]},
    observe={
        "r": mean(abs(nodes.mean(sp.exp(sp.I * x)))),
        "again": "mean(sqrt(nodes.mean(cos(x))**2 + nodes.mean(sin(x))**2))",
        "frequency": mean(rate(x)),
        "speed": mean(v),
        "error": mean(nodes.sum(ERROR)),
        "worst": maximum(nodes.sum(ERROR)),
        "last": end(x),
        "force": end(rate(v)),
        "lowest": minimum(nodes.minimum(v)),
    },
)  # fmt: skip


@pytest.fixture(scope="module")
def rotors() -> Result:
    return run(ROTORS, show_progress=False, width=4)


def test_order_parameter_and_frequencies_of_rotors(rotors: Result) -> None:
    np.testing.assert_allclose(rotors.r, rotors.again, rtol=0, atol=1e-15)
    xs = names("x", 10)
    order = sp.sqrt(sum(map(sp.cos, xs)) ** 2 + sum(map(sp.sin, xs)) ** 2) / 10
    one = ROTORS.replace(axes={}, sigma=0.3)
    assert float(rotors.r[2]) == pytest.approx(float(integrals(one, [order])[0]), abs=1e-10)
    moved = rotors.states("trajectory")[:, -1, :10] - rotors.states("trajectory")[:, 0, :10]
    np.testing.assert_allclose(rotors.frequency, moved / 9.0, rtol=0, atol=1e-13)
    np.testing.assert_allclose(rotors.frequency, rotors.speed, rtol=0, atol=1e-10)


def test_values_at_the_end(rotors: Result) -> None:
    state = [sp.Symbol(name, real=True) for name in (*ROTORS.equations.state, *ROTORS.equations.parameters)]
    field = sp.lambdify(state, ROTORS.equations.rhs()[10:], "numpy", cse=True)
    values = [ROTORS.parameters[name] for name in ROTORS.equations.parameters[:-1]]
    np.testing.assert_array_equal(rotors.last, rotors.states()[:, :10])
    for cell, sigma in enumerate((0.05, 0.1, 0.3)):
        force = field(*rotors.states()[cell], *values, sigma)
        np.testing.assert_allclose(rotors.force[cell], force, rtol=0, atol=1e-6)  # the slope of the dense output


def test_the_synchronisation_error_is_an_observable() -> None:
    """At short steps Simpson's rule of the record is exact to rounding too, and both look at the same extremes."""
    scene = Scene(
        topology=chain(2), integrator="rodas5p", rtol=1e-13, record=("sync_error",), parameters={"kappa": 50}, **NUMBERS,
        observe={"error": mean(nodes.sum(ERROR)), "worst": maximum(nodes.sum(ERROR)), "last": end(nodes.sum(ERROR))},
    )  # fmt: skip
    result = run(scene, show_progress=False, width=1, sigma=[0.1, 0.2])
    np.testing.assert_allclose(result.error, result.sync_error, rtol=0, atol=1e-12)
    np.testing.assert_allclose(result.worst, result.sync_error_max, rtol=1e-5)
    np.testing.assert_allclose(result.data["last"], result.sync_error_end, rtol=1e-13)


def test_observables_do_not_depend_on_lanes_workers_and_other_records(rotors: Result) -> None:
    other = run(ROTORS.replace(record=(), samples=0), show_progress=False, width=1, workers=1)
    for name in ROTORS.observe:
        np.testing.assert_array_equal(other.data[name], rotors.data[name])


def test_files_hold_observables(rotors: Result, tmp_path: Path) -> None:
    rotors.save(tmp_path / "whole.nc")
    opened = open_result(tmp_path / "whole.nc")
    assert opened.scene == ROTORS
    assert opened.frequency.attrs["long_name"] == "mean(rate(x))"
    streamed = stream(ROTORS, tmp_path / "streamed.nc", show_progress=False, width=4)
    assert streamed.success
    assert (tmp_path / "streamed.nc").read_bytes() == (tmp_path / "whole.nc").read_bytes()


def test_a_resumed_run_keeps_what_was_observed(rotors: Result) -> None:
    """Cells of an earlier result are not run again: their numbers come from its variables."""
    data = rotors.data.copy(deep=True)
    data["status"][1] = Status.NOT_RUN
    data["frequency"][1] = np.nan
    data["r"][0] += 1.0
    result = run(ROTORS, resume=Result(data, ROTORS), show_progress=False, width=4)
    assert float(result.r[0]) == float(rotors.r[0]) + 1.0
    np.testing.assert_array_equal(result.frequency, rotors.frequency)


@pytest.mark.parametrize(
    ("contact", "integrator"),
    [
        *(pytest.param("atan", method, marks=pytest.mark.long) for method in ("rodas5p", "auto")),
        ("set-valued", "rodas5p"),
        pytest.param("set-valued", "taylor", marks=pytest.mark.long),
    ],
)
def test_the_mean_speed_is_the_distance_over_the_time(contact: str, integrator: str) -> None:
    """Of oscillators that slip and stick, by every kind of step; cells jump over no cycle of the window."""
    scene = Scene(
        topology=chain(2), contact=contact, integrator=integrator, rtol=1e-10, record=(), transient=0.0, window=20.0,
        parameters={"kappa": 1e3} if contact == "atan" else {}, initial={"x": [0.3, 0.5], "v": [0.0, 0.1]},
        observe={"speed": mean(v), "square": mean((x - nodes[1](x)) ** 2)},
    )  # fmt: skip
    result = run(scene, show_progress=False, width=4, sigma=[0.1, 0.2])
    span = 20.0 * scene.period
    moved = result.states()[:, :2] - np.array(scene.y0[:2])
    np.testing.assert_allclose(result.speed, moved / span, rtol=0, atol=2e-9)
    assert (result.square.values[:, 0] == 0.0).all()
    assert (result.square.values[:, 1] > 0.0).all()


def test_a_periodic_cell_leaves_out_no_cycle_of_the_window() -> None:
    """The approach to the cycle counts: a cell that jumped would give the cycles after it too little weight."""
    scene = Scene(
        transient=0.0, window=300.0, initial={"x": [0.3], "v": [0.0]}, record=(), integrator="rodas5p",
        parameters={"kappa": 100.0}, observe={"speed": mean(v), "square": mean(x**2), "top": maximum(v)},
    )  # fmt: skip
    options = {"show_progress": False, "width": 1, "omega": [0.5, 2.0]}
    result = run(scene, **options)
    plain = run(scene, **options, reduce=False)
    early = run(scene.replace(transient=200.0, window=1.0), **options)
    assert (early.periods_skipped > 100).all()
    assert (result.periods_skipped == 0).all()
    assert (plain.periods_skipped == 0).all()
    for name in scene.observe:
        np.testing.assert_allclose(result.data[name], plain.data[name], rtol=1e-11, atol=1e-12)


def test_observed_parameters_and_equal_oscillators_are_kept() -> None:
    """What a reduction would leave out is there if it is observed."""
    scene = Scene(
        oscillator="duffing", topology=chain(2), integrator="dop853", record=(), **NUMBERS, parameters={"u": 0.0},
        initial={"x": [0.5] * 2}, observe={"force": mean(sp.Symbol("u") + sp.Symbol("omega") * v), "speed": mean(v)},
        axes={"omega": [0.5, 2.0]},
    )  # fmt: skip
    reduction = as_reduction(scene, True)
    assert {"u", "omega"} < set(reduction.equations.parameters)
    assert any("observed" in sentence for sentence in reduction.kept)
    result = run(scene, show_progress=False, width=1)
    np.testing.assert_allclose(result.force, result.speed * np.array([[0.5], [2.0]]), rtol=1e-9)
    assert result.speed.shape == (2, 2)


def test_a_cell_that_ends_early_says_what_it_saw() -> None:
    """A cell that used up its steps before the window has seen nothing; one inside it has its part of the window."""
    scene = Scene(
        oscillator="harmonic", integrator="dop853", record=(), transient=5.0, window=5.0, time_unit="time",
        observe={"speed": mean(v)},
    )  # fmt: skip
    early = run(scene.replace(max_steps=3), show_progress=False)
    assert int(early.status) == Status.STEP_BUDGET
    assert np.isnan(early.speed.values).all()


def test_oscillators_that_move_as_one_have_no_sign_of_rounding():
    seen = {"sign": "mean(sign(10*(x_1 - x_2)))"}
    pair = Scene("duffing", "x->x", chain(2), parameters={"sigma": 5.0}, transient=200, window=1, observe=seen)
    assert float(run(pair, show_progress=False).data["sign"]) == 0.0
