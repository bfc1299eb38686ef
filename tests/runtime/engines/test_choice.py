"""Which integrator "auto" is, and the warning of stiffness that appears."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from synchain import Field, Scene, run
from synchain.graphs import chain
from synchain.results import Status
from synchain.runtime.cells.plan import CellRows
from synchain.runtime.cells.reduce import reduce_scene
from synchain.runtime.engines.choice import chosen_for_rows
from synchain.runtime.engines.scene_kernels import kernel_source, ladder_of
from synchain.runtime.stability.orbits import OrbitProblem
from synchain.runtime.synchronisation.probe import ring_of_three


def method(scene: Scene) -> tuple[str, int]:
    source = kernel_source(scene)
    return source.integrator, source.dimensions.dense_rows


def first_methods(scene: Scene) -> list[str]:
    """What each cell of a scene begins with."""
    reduction = reduce_scene(scene)
    ladder = ladder_of(reduction)
    rows = reduction.rows(reduction.planner.rows(np.arange(scene.cells)))
    return [ladder.methods[k].name for k in ladder.first(rows)]


@pytest.mark.parametrize(
    ("scene", "expected"),
    [
        (Scene(oscillator="pendulum", topology=chain(2)), "taylor"),
        (Scene(oscillator="pendulum", topology=chain(20)), "taylor"),
        (Scene(oscillator="van_der_pol", topology=chain(2), parameters={"mu": 1.0}), "taylor"),
        (Scene(oscillator="van_der_pol", topology=chain(2), parameters={"mu": 200.0}), "taylor"),  # it grows at first
        (Scene(topology=chain(2), contact="set-valued"), "taylor"),
        (Scene(topology=chain(2), parameters={"kappa": 10.0}), "taylor"),  # the smoothed law has a kink
        (Scene(topology=chain(20), parameters={"kappa": 10.0}), "taylor"),
        (Scene(topology=chain(3)), "rodas5p"),  # its layer is steep, although the start lies outside
        (Scene(topology=chain(3), friction="coulomb"), "rodas5p"),
        (Scene(topology=chain(3), contact="sign"), "dop853"),  # motion slides along its jump
        (Scene(Field({"x": "v", "v": "-x - sign(x) + sign(sin(t))"})), "taylor"),  # motion passes its jumps
        (Scene(Field({"x": "v", "v": "-x - 100*v - sign(x)"})), "rodas5p"),
        (Scene(oscillator="duffing", coupling="inerter", topology=chain(3), parameters={"sigma": 0.1}), "dop853"),
        (Scene(Field({"x": "v", "v": "-x - 1000*max(0, x - 1)**1.5"})), "dop853"),  # no series beside its kink
        (Scene(Field({"x": "v", "v": "-x - 100*v - 1000*max(0, x - 1)**1.5"})), "rodas5p"),
        (Scene(oscillator="chua", coupling="x->x", topology=chain(2)), "taylor"),
        (Scene(topology=chain(2), rtol=1e-10, parameters={"sigma": 0.1}), "rodas5p"),
    ],
)
def test_auto(scene, expected):
    assert method(scene)[0] == expected


def test_a_named_integrator_is_taken():
    assert method(Scene(oscillator="pendulum", topology=chain(2), integrator="dop853"))[0] == "dop853"
    stiff = Scene(oscillator="van_der_pol", topology=chain(2), parameters={"mu": 200.0}, integrator="taylor")
    assert method(stiff)[0] == "taylor"


def test_the_order_follows_the_tolerance():
    orders = [method(Scene(oscillator="pendulum", topology=chain(2), rtol=r))[1] for r in (1e-2, 1e-4, 1e-8, 1e-14)]
    assert orders == sorted(orders)
    assert orders[0] < orders[-1]


def test_linear_equations_take_the_highest_order():
    scene = Scene(oscillator="harmonic", topology=chain(2))
    assert method(scene) == ("taylor", 24)
    assert method(scene.replace(oscillator="pendulum"))[1] < 24
    assert method(scene.replace(rtol=1e-2))[1] < 24


def test_a_jump_along_which_motion_may_slide_is_refused():
    with pytest.raises(
        ValueError, match=r"taylor: found sign\(.*, along which motion may slide.*use integrator dop853"
    ):
        kernel_source(Scene(topology=chain(2), contact="sign", integrator="taylor"))


def test_the_layer_of_a_smoothed_jump_is_seen_from_a_start_outside():
    scene = Scene(topology=chain(2), friction="coulomb", axes={"kappa": [10.0, 1e5]})
    assert first_methods(scene) == ["taylor", "rodas5p"]
    link = Scene(
        oscillator="duffing", coupling="friction_damper", topology=chain(2), initial={"v": (0.0, 1.0)},
        axes={"sigma": [0.1, 1e4]},
    )  # fmt: skip
    assert first_methods(link) == ["taylor", "rodas5p"]


@pytest.mark.filterwarnings("error")
def test_rates_beyond_the_largest_float_begin_with_explicit_steps():
    link = Scene("van_der_pol", "x->x", chain(2), window=1.0, transient=0.0, axes={"sigma": [0.1, 1e308]})
    assert first_methods(link) == ["taylor", "dop853"]


def test_each_cell_begins_with_what_suits_it():
    bump = Scene(
        Field({"x": "v", "v": "-x - 1000*exp(-(a - 4)**2)*v"}, parameters={"a": 0.0}),
        axes={"a": np.linspace(-10.0, 10.0, 21)},
    )
    assert {
        a: name for a, name in zip(range(-10, 11), first_methods(bump), strict=True) if name != "taylor"
    } == dict.fromkeys((2, 3, 4, 5, 6), "rodas5p")


@pytest.mark.parametrize("k", [1e-6, 1.0, 1e6])
def test_the_choice_does_not_depend_on_the_unit_of_time(k):
    node = Field({"x": "k*v", "v": "k*(mu*(1 - x**2)*v - x)"}, parameters={"k": k, "mu": 1.0})
    scene = Scene(node, None, chain(1), initial={"x": 2.0, "v": 0.0}, transient=0.0, window=100.0 / k, time_unit="time")
    assert first_methods(scene.replace(axes={"mu": [1.0, 100.0]})) == ["taylor", "rodas5p"]


def of_modes(scene: Scene, alpha: list[float] | list[complex]) -> str:
    state = np.array([[values[0] for values in scene.initial.values()]])
    return OrbitProblem.of_modes(scene, np.array(alpha), state, 1).method.name


@pytest.mark.parametrize(
    ("scene", "alpha", "expected"),
    [
        (Scene(oscillator="pendulum", coupling="damper", topology=chain(2)), [0.0, 5.0], "taylor"),
        (Scene(oscillator="pendulum", coupling="damper", topology=chain(2)), [0.0, -200.0, 5.0], "rodas5p"),
        (Scene(oscillator="pendulum", coupling="damper", topology=chain(2)), [0.0, 200.0 + 1j], "rodas5p"),
        (Scene(oscillator="van_der_pol", topology=chain(2), parameters={"mu": 200.0}), [0.0], "rodas5p"),
        (Scene(topology=chain(2), contact="set-valued"), [0.0, 1.0], "taylor"),
        (Scene(topology=chain(2)), [0.0, 1.0], "rodas5p"),  # the smoothed law has a kink
        (
            Scene(oscillator="pendulum", topology=chain(2), integrator="dop853"),
            [0.0],
            "rodas5p",
        ),  # modes have no dop853
    ],
)
def test_auto_for_modes_looks_at_the_strongest(scene, alpha, expected):
    assert of_modes(scene, alpha) == expected


def test_a_named_integrator_is_taken_for_modes_too():
    scene = Scene(oscillator="pendulum", coupling="damper", topology=chain(2), integrator="taylor")
    assert of_modes(scene, [200.0]) == "taylor"
    assert of_modes(scene.replace(integrator="rodas5p"), [0.0]) == "rodas5p"


def test_the_probe_looks_at_its_strongest_ring():
    scene = Scene(oscillator="pendulum", coupling="damper", topology=chain(2), record=())
    equations = ring_of_three(scene.equations)

    def method(alpha: float) -> str:
        values = {**scene.parameters, "mode_alpha": alpha, "mode_beta": 0.0}
        parameters = np.array([[values[name] for name in equations.parameters]])
        return chosen_for_rows(
            scene, equations, CellRows(np.full((1, 6), 0.1), parameters, np.full((1, 7), 100.0))
        ).name

    assert (method(1.0), method(100.0)) == ("taylor", "rodas5p")


def test_stiffness_that_appears_is_said():
    scene = Scene(
        oscillator="van_der_pol",
        topology=chain(2),
        record=(),
        transient=0,
        window=60,
        time_unit="time",
        integrator="taylor",
    )
    with pytest.warns(RuntimeWarning, match=r"stiff equations: found a rate of .*integrator = 'rodas5p'"):
        run(scene, mu=[1.0, 200.0], show_progress=False)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run(scene, mu=[1.0, 2.0], show_progress=False)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("rates", "start", "window", "end", "most"),
    [
        ({"x": "-exp(min(t, 9))*(x - cos(t))"}, {"x": 0.0}, 10.0, math.cos(10 - 1.234e-4), 2500),
        (
            {"x": "x**2 - x**3"},
            {"x": 1e-5},
            2e5,
            1.0,
            800,
        ),  # a flame: it waits for 1e5 units, then rests at 1 for as many
        ({"x": "k*(cos(t) - x)", "k": "k"}, {"x": 0.3, "k": 1.0}, 14.0, math.cos(14 - 8.3e-7), 3200),
    ],
)
def test_stiffness_that_comes_with_time_is_left_to_rosenbrock_steps(rates, start, window, end, most):
    """Explicit steps alone took up to 140 000."""
    scene = Scene(
        Field(rates), None, chain(1), record=(), transient=0, window=window, time_unit="time", initial=start, atol=1e-12
    )
    result = run(scene, show_progress=False)
    assert result.states()[0] == pytest.approx(end, abs=1e-6)
    assert result.steps < most
    assert result.methods.item() >> 2 == (window > 10.0)  # few steps are not worth a second kernel


def test_slow_motion_of_few_derivatives_is_not_called_stiff():
    damped = Scene(
        Field({"x": "cos(t) + cos((t + 1)**1.1) - 2*x"}), record=(), transient=0, window=1e5, time_unit="time", initial={"x": 1.0}, rtol=1e-3
    )  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = run(damped, show_progress=False)
    assert result.steps > 20_000
    assert result.methods.item() >> 2 == 0


def test_a_slope_without_bound_at_the_start_ends_no_run():
    """The rate of sign(v) |v|^(1/2) is finite at rest, its slope is not."""
    scene = Scene(
        Field({"x": "v", "v": "cos(t) - x/2 - sign(v)*abs(v)**0.5"}), record=(), transient=0, window=5, time_unit="time",
        initial={"x": 0.0, "v": 0.0}, rtol=1e-9,
    )  # fmt: skip
    result = run(scene, show_progress=False)

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [y[1], np.cos(t) - y[0] / 2 - np.sign(y[1]) * np.sqrt(abs(y[1]))]

    expected = solve_ivp(rates, (0, 5), [0, 0], "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    np.testing.assert_allclose(result.states(), expected, rtol=0, atol=1e-7)


ROOT = Scene(
    Field({"x": "1 - x**a"}, parameters={"a": 0.5}), transient=0, window=3, time_unit="time", initial={"x": 0.0}
)
"""x' = 1 - sqrt(x) from 0: with s = sqrt(x), t = -2 s - 2 log(1 - s)."""

ROOT_AT_3 = brentq(lambda s: 3 + 2 * s + 2 * math.log(1 - s), 0.5, 0.99) ** 2


@pytest.mark.parametrize("name", ["rodas4", "rodas5p", "rodas6p", "ros34pw2", "taylor"])
def test_an_infinite_slope_is_never_passed_by_methods_that_take_slopes(name):
    result = run(ROOT.replace(integrator=name), show_progress=False)
    assert result.status == Status.STEP_UNDERFLOW
    assert "slopes are not, as at sqrt(0) or acos(1), runs need integrator = 'dop853'" in result.message


@pytest.mark.parametrize("n", [2, 10])
def test_an_infinite_slope_of_one_node_is_seen_in_networks(n):
    net = ROOT.replace(coupling="x->x", topology=chain(n), initial={"x": [0.0] + [0.5] * (n - 1)})
    net = net.replace(parameters={"sigma": 0.2})
    result = run(net, show_progress=False)
    assert result.status == Status.FINISHED
    assert result.states().min() > 0.75
    assert run(net.replace(integrator="rodas5p"), show_progress=False).status == Status.STEP_UNDERFLOW


@pytest.mark.parametrize(
    ("field", "x"),
    [
        ({"x": "1 - x**a"}, 0.0),  # a slope by the state
        ({"x": "-1e3*x + a*(t + 1)**a + t**a"}, 0.0),  # a slope by time, and stiff
        ({"x": "1 - sqrt(x) - a"}, 0.0),
        ({"x": "a - sqrt(1 - x**2)"}, 1.0),
    ],
)
def test_auto_begins_at_an_infinite_slope_by_explicit_steps(field, x):
    scene = ROOT.replace(oscillator=Field(field, parameters={"a": 0.5}), initial={"x": x})
    if x == 0.0:  # behind 1 there is no root
        assert run(scene, show_progress=False).status == Status.FINISHED
    if "t**a" not in field["x"]:
        assert method(scene)[0] == "dop853"
        assert method(scene.replace(initial={"x": 0.5}))[0] == "taylor"


def test_auto_steps_from_an_infinite_slope_are_right():
    assert run(ROOT, show_progress=False).states().item() == pytest.approx(ROOT_AT_3, abs=1e-6)


@pytest.mark.filterwarnings("error")
def test_an_infinite_slope_is_not_called_stiff():
    node = Field({"x": "y*sqrt(x)", "y": "cos(50*t)"})
    result = run(
        ROOT.replace(oscillator=node, parameters={}, window=10, initial={"x": 0.0, "y": 1.0}), show_progress=False
    )
    assert result.steps > 100


@pytest.mark.parametrize(
    ("rate", "expected"),
    [
        ("asin(sin(2*t))", "dop853"),
        ("acos(cos(x))", "dop853"),
        ("log(abs(cos(t)))", "dop853"),
        ("exp(-1/cos(t)**2)", "dop853"),
        ("exp(-1/x**2)", "dop853"),
        ("exp(1/cos(t))", "dop853"),
        ("tanh(tan(t))", "dop853"),
        ("erf(1/x)", "dop853"),
        ("1/(1 + exp(1/x))", "dop853"),
        ("1/cosh(1/x)", "dop853"),
        ("exp(-1/x)", "taylor"),  # as of a temperature
        ("log(x)/x", "taylor"),
        ("tanh(1/a)*sin(x)", "taylor"),
        ("tanh(x/(1 + x**2))", "taylor"),
        ("sin(sqrt(x**2 + t**2))", "taylor"),
        ("asin(a)*x", "taylor"),
    ],
)
def test_auto_passes_the_ends_of_series_by_explicit_steps(rate, expected):
    parameters = {"a": 0.5} if "a)" in rate else None
    assert method(Scene(Field({"x": rate}, parameters=parameters), initial={"x": 2.0}))[0] == expected


@pytest.mark.parametrize(
    ("rate", "window", "integral"),
    [("asin(sin(2*t))", math.pi / 2, math.pi**2 / 8), ("log(abs(cos(t)))", math.pi, -math.pi * math.log(2))],
)
def test_auto_passes_the_ends_of_series_rightly(rate, window, integral):
    scene = ROOT.replace(oscillator=Field({"x": rate}), parameters={}, window=window, initial={"x": 0.0})
    assert run(scene, show_progress=False).states().item() == pytest.approx(integral, abs=1e-4)


@pytest.mark.parametrize("start", [0.0, 1.0])
def test_a_root_by_a_parameter_is_no_layer(start):
    """|v|**p of p = 1/2 is steep at a point."""
    node = Field({"x": "v", "v": "-x - sign(v)*abs(v)**p + cos(t)"}, parameters={"p": 0.5})
    assert method(Scene(node, initial={"x": start, "v": start}))[0] == "dop853"


def test_a_singularity_is_not_called_stiff():
    """x' = x**2 - c from 1: for c = 0 it grows without bound at t = 1, where its rate is as large as its steps are short."""
    blowing = Scene(
        Field({"x": "x**2 - c"}, parameters={"c": 0}), None, chain(1), initial={"x": 1.0}, record=(), transient=0,
        window=2, time_unit="time", integrator="taylor",
    )  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = run(blowing, c=[0.0, 2.0], show_progress=False)
    assert result.status.values.tolist() == [Status.DIVERGED, Status.FINISHED]
    with pytest.warns(RuntimeWarning, match=r"^a state grew to .* in 60 steps of a cell; expected a bounded"):
        run(blowing.replace(max_steps=60), show_progress=False)


def test_modes_that_become_stiff_are_said():
    """Van der Pol from the middle of a jump, where it is not stiff yet, onto the slow branch."""
    scene = Scene(oscillator="van_der_pol", topology=chain(2), parameters={"mu": 200.0}, integrator="taylor")
    start = np.array([[0.0, 1.0]])
    integrator = OrbitProblem.of_modes(scene, np.array([0.0]), start, 1).integrator(start)
    with pytest.warns(RuntimeWarning, match=r"stiff modes: found a rate of .*integrator = 'rodas5p'"):
        integrator.advance(2.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        integrator.advance(0.1)  # it has been said
    easy = OrbitProblem.of_modes(scene.replace(parameters={"mu": 1.0}), np.array([0.0]), start, 1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        easy.integrator(start).advance(20.0)


def test_rosenbrock_steps_leave_an_equilibrium_that_repels():
    """x' = k x (1 - x**2): a first step of 1e-4 damps what grows, and its estimate of the error with it.

    The growth is 0 at both ends of the axis.
    """
    scene = Scene(
        Field({"x": "4*q*(1 - q)*1e8*x*(1 - x**2) + (1 - x)*(2*q - 1)**2"}, parameters={"q": 1}), None, chain(1), initial={"x": 1e-3}, record=(), transient=0,
        window=5, time_unit="time", integrator="rodas5p", rtol=1e-3,
    )  # fmt: skip
    result = run(scene, q=[0.0, 0.25, 0.5, 1.0], show_progress=False)
    assert result.end.values.ravel() == pytest.approx([1.0] * 4, abs=1e-2)
