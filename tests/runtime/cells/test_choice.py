"""Which integrator "auto" is, and the warning of stiffness that appears."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from synchain.models import Field, Scene, chain
from synchain.runtime import run
from synchain.runtime.cells.choice import STIFF, chosen_for_rows, stiffness
from synchain.runtime.cells.kernels import kernel_source
from synchain.runtime.cells.plan import Plan, Planner
from synchain.runtime.stability.orbits import Orbits
from synchain.runtime.support.status import Status
from synchain.runtime.synchronisation.probe import ring_of_three


def method(scene: Scene) -> tuple[str, int]:
    source = kernel_source(scene)
    return source.integrator, source.dimensions.dense_rows


@pytest.mark.parametrize(
    ("scene", "expected"),
    [
        (Scene(oscillator="pendulum", topology=chain(2)), "taylor"),
        (Scene(oscillator="pendulum", topology=chain(20)), "taylor"),
        (Scene(oscillator="van_der_pol", topology=chain(2), parameters={"mu": 1.0}), "taylor"),
        (Scene(oscillator="van_der_pol", topology=chain(2), parameters={"mu": 200.0}), "rodas5p"),
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
        (Scene(topology=chain(2), rtol=1e-10, parameters={"sigma": 0.1}), "switching"),
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
    scene = Scene(topology=chain(2), friction="coulomb", parameters={"kappa": 1e5})
    assert stiffness(Planner(scene)) > STIFF > stiffness(Planner(scene.replace(parameters={"kappa": 10.0})))
    link = Scene(oscillator="duffing", coupling="friction_damper", topology=chain(2), initial={"v": (0.0, 1.0)})
    assert stiffness(Planner(link.replace(parameters={"sigma": 1e4}))) > STIFF > stiffness(Planner(link))


@pytest.mark.filterwarnings("error")
def test_rates_beyond_the_largest_float_are_infinitely_fast():
    link = Scene("van_der_pol", "x->x", chain(2), window=1.0, transient=0.0)
    assert stiffness(Planner(link.replace(parameters={"sigma": 1e308}))) == math.inf
    damper = Scene(oscillator="duffing", coupling="friction_damper", topology=chain(2))
    assert stiffness(Planner(damper.replace(parameters={"sigma": 1e308}))) == math.inf


def test_stiffness_in_the_middle_of_an_axis_is_seen():
    bump = Scene(
        Field({"x": "v", "v": "-x - 1000*exp(-(a - 4)**2)*v"}, parameters={"a": 0.0}),
        axes={"a": np.linspace(-10.0, 10.0, 101)},
    )
    calm = bump.replace(axes={"a": np.linspace(8.0, 10.0, 101)})
    assert (method(bump)[0], method(calm)[0]) == ("rodas5p", "taylor")


def test_stiffness_is_that_of_the_extreme_cells():
    scene = Scene(oscillator="van_der_pol", topology=chain(2))
    assert stiffness(Planner(scene.replace(parameters={"mu": 1.0}))) < STIFF
    swept = scene.replace(axes={"mu": [1.0, 200.0]})
    assert stiffness(Planner(swept)) > STIFF
    assert kernel_source(swept).integrator == "rodas5p"


def of_modes(scene: Scene, alpha: list[float] | list[complex]) -> str:
    state = np.array([[values[0] for values in scene.initial.values()]])
    return Orbits.make(scene, np.array(alpha), state, 1).method.name


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
        numbers = np.array([[values[name] for name in equations.parameters]])
        return chosen_for_rows(scene, equations, Plan(np.full((1, 6), 0.1), numbers, np.zeros((1, 4)))).name

    assert (method(1.0), method(-100.0)) == ("taylor", "rodas5p")


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


def test_stiffness_that_appears_is_said_of_explicit_steps_too():
    scene = Scene(
        Field({"x": "v", "v": "s*(1 - x**2)*v - x - max(0, v - 10)**1.5"}, parameters={"s": 1}), record=(), transient=0,
        window=20, time_unit="time", initial={"x": 1.0, "v": 9.0},
    )  # fmt: skip
    with pytest.warns(
        RuntimeWarning, match=r"stiff equations: found a rate of .* dop853 steps.*integrator = 'rodas5p'"
    ):
        run(scene, s=[1.0, 100.0], width=8, show_progress=False)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run(scene.replace(window=1), s=[1.0, 100.0], width=8, show_progress=False)  # 25 steps


def test_stiffness_that_comes_with_time_is_said() -> None:
    scene = Scene(
        Field({"x": "-exp(min(t, 9))*(x - cos(t))"}), record=(), transient=0, window=10, time_unit="time", initial={"x": 0.0}
    )  # fmt: skip
    with pytest.warns(RuntimeWarning, match="stiff equations: found a rate of 8.1e"):
        run(scene, show_progress=False)


def test_steps_that_crawl_at_rest_are_said():
    """A flame: x stays near 1e-5 for as many units of time, and at 1 for as many, where it returns at a rate of 1."""
    flame = Scene(
        Field({"x": "x**2 - x**3"}), record=(), transient=0, window=2e5, time_unit="time", initial={"x": 1e-5}, atol=1e-12
    )  # fmt: skip
    with pytest.warns(
        RuntimeWarning, match=r"stiff equations: found a rate of 1 beside slow motion, and 1\d{4} Taylor"
    ):
        run(flame, show_progress=False)
    damped = Scene(
        Field({"x": "cos(t) + cos((t + 1)**1.1) - 2*x"}), record=(), transient=0, window=1e5, time_unit="time", initial={"x": 1.0}, rtol=1e-3
    )  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = run(damped, show_progress=False)
    assert found.steps > 20_000


def test_fast_decay_beside_growth_is_stiff():
    """The rate k of the decay grows to 1e6; nothing that decays grows without bound."""
    scene = Scene(
        Field({"x": "k*(cos(t) - x)", "k": "k"}), record=(), transient=0, window=14, time_unit="time",
        initial={"x": 0.3, "k": 1.0},
    )  # fmt: skip
    with pytest.warns(RuntimeWarning, match=r"^stiff equations: found a rate of 1\.2e\+06"):
        run(scene, show_progress=False)


def test_a_slope_without_bound_at_the_start_ends_no_run():
    """The rate of sign(v) |v|^(1/2) is finite at rest, its slope is not."""
    scene = Scene(
        Field({"x": "v", "v": "cos(t) - x/2 - sign(v)*abs(v)**0.5"}), record=(), transient=0, window=5, time_unit="time",
        initial={"x": 0.0, "v": 0.0}, rtol=1e-9,
    )  # fmt: skip
    found = run(scene, show_progress=False)

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [y[1], np.cos(t) - y[0] / 2 - np.sign(y[1]) * np.sqrt(abs(y[1]))]

    expected = solve_ivp(rates, (0, 5), [0, 0], "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    np.testing.assert_allclose(found.states(), expected, rtol=0, atol=1e-7)


ROOT = Scene(
    Field({"x": "1 - x**a"}, parameters={"a": 0.5}), transient=0, window=3, time_unit="time", initial={"x": 0.0}
)
"""x' = 1 - sqrt(x) from 0: with s = sqrt(x), t = -2 s - 2 log(1 - s)."""

ROOT_AT_3 = brentq(lambda s: 3 + 2 * s + 2 * math.log(1 - s), 0.5, 0.99) ** 2


@pytest.mark.parametrize("name", ["rodas4", "rodas5p", "rodas6p", "ros34pw2", "switching", "taylor"])
def test_an_infinite_slope_is_never_passed_by_methods_that_take_slopes(name):
    found = run(ROOT.replace(integrator=name), show_progress=False)
    assert found.status == Status.STEP_UNDERFLOW
    assert "slopes are not, as at sqrt(0) or acos(1), runs need integrator = 'dop853'" in found.message


@pytest.mark.parametrize("n", [2, 10])
def test_an_infinite_slope_of_one_node_is_seen_in_networks(n):
    net = ROOT.replace(coupling="x->x", topology=chain(n), initial={"x": [0.0] + [0.5] * (n - 1)})
    net = net.replace(parameters={"sigma": 0.2})
    found = run(net, show_progress=False)
    assert found.status == Status.FINISHED
    assert found.states().min() > 0.75
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
    assert method(scene)[0] == "dop853"
    assert method(scene.replace(initial={"x": 0.5}))[0] == ("dop853" if "t**a" in field["x"] else "taylor")


def test_auto_steps_from_an_infinite_slope_are_right():
    assert run(ROOT, show_progress=False).states().item() == pytest.approx(ROOT_AT_3, abs=1e-6)


@pytest.mark.filterwarnings("error")
def test_an_infinite_slope_is_not_called_stiff():
    node = Field({"x": "y*sqrt(x)", "y": "cos(50*t)"})
    found = run(
        ROOT.replace(oscillator=node, parameters={}, window=10, initial={"x": 0.0, "y": 1.0}), show_progress=False
    )
    assert found.steps > 100


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
        found = run(blowing, c=[0.0, 2.0], show_progress=False)
    assert found.status.values.tolist() == [Status.DIVERGED, Status.FINISHED]
    with pytest.warns(RuntimeWarning, match=r"^a state grew to .* in 60 Taylor steps of a cell; expected a bounded"):
        run(blowing.replace(max_steps=60), show_progress=False)


def test_modes_that_become_stiff_are_said():
    """Van der Pol from the middle of a jump, where it is not stiff yet, onto the slow branch."""
    scene = Scene(oscillator="van_der_pol", topology=chain(2), parameters={"mu": 200.0}, integrator="taylor")
    orbits = Orbits.make(scene, np.array([0.0]), np.array([[0.0, 1.0]]), 1)
    integrator = orbits.integrator_of(orbits.strengths)
    with pytest.warns(RuntimeWarning, match=r"stiff modes: found a rate of .*integrator = 'rodas5p'"):
        integrator.advance(2.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        integrator.advance(0.1)  # it has been said
    easy = Orbits.make(scene.replace(parameters={"mu": 1.0}), np.array([0.0]), np.array([[0.0, 1.0]]), 1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        easy.integrator_of(easy.strengths).advance(20.0)


def test_rosenbrock_steps_leave_an_equilibrium_that_repels():
    """x' = k x (1 - x**2): a first step of 1e-4 damps what grows, and its estimate of the error with it.

    The growth is 0 at both ends of the axis.
    """
    scene = Scene(
        Field({"x": "4*q*(1 - q)*1e8*x*(1 - x**2) + (1 - x)*(2*q - 1)**2"}, parameters={"q": 1}), None, chain(1), initial={"x": 1e-3}, record=(), transient=0,
        window=5, time_unit="time", integrator="rodas5p", rtol=1e-3,
    )  # fmt: skip
    found = run(scene, q=[0.0, 0.25, 0.5, 1.0], show_progress=False)
    assert found.end.values.ravel() == pytest.approx([1.0] * 4, abs=1e-2)
