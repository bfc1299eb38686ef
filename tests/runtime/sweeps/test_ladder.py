"""Cells that go from one integrator to the next while they run: where, from which state, and what of it is seen."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from catalogue import VAN_DER_POL
from scipy.integrate import solve_ivp

from synchain import Field, Scene, run
from synchain.graphs import chain
from synchain.results import Result, Status

QUIET: dict[str, Any] = {"show_progress": False}
SHORT: dict[str, Any] = {"transient": 0.0, "time_unit": "time"}
ROBER = Scene(
    Field({"x": "-x/25 + 10000*y*z", "y": "x/25 - 10000*y*z - 30000000*y**2", "z": "30000000*y**2"}), None, None,
    initial={"x": 1.0, "y": 0.0, "z": 0.0}, window=1e9, **SHORT,
)  # fmt: skip
RELAXING = Scene(
    VAN_DER_POL, None, None, initial={"x": 2.0, "v": 0.1}, transient=5.0, window=15.0, time_unit="time",
    observe={"mean": "mean(x)"}, record=("trajectory",), samples=7,
)  # fmt: skip


def steps_of(result: Result) -> dict[str, int]:
    """The steps of a single cell by each integrator that ran."""
    steps = result.data.method_steps
    return {
        str(name): int(steps.sel(integrator=name)) for name in steps.integrator.values if steps.sel(integrator=name) > 0
    }


def test_kinetics_over_nine_decades_come_to_their_end() -> None:
    """Robertson's reactions (Hairer & Wanner, Solving ODEs II, 2nd ed. 1996, section IV.10), which 10^7 series did not end."""
    result, alone = run(ROBER, **QUIET), run(ROBER.replace(integrator="rodas5p"), **QUIET)
    assert result.status == Status.FINISHED
    assert int(result.steps + result.rejected) < 1.5 * int(alone.steps + alone.rejected)
    np.testing.assert_allclose(result.states(), alone.states(), rtol=1e-6)


def test_stiffness_that_comes_with_time_is_handed_on() -> None:
    """Van der Pol's oscillator grows from rest before it is stiff."""
    scene = RELAXING.replace(parameters={"mu": 300.0}, initial={"x": 0.1, "v": 0.0}, window=600.0)
    result, alone = run(scene, **QUIET), run(scene.replace(integrator="rodas5p"), **QUIET)
    taken = steps_of(result)
    assert list(taken) == ["taylor", "rodas5p"]
    assert sum(taken.values()) < 1.5 * int(alone.steps + alone.rejected)
    np.testing.assert_allclose(result.states(), alone.states(), rtol=1e-4)
    assert result.integrators == f"taylor ({taken['taylor']} steps), then rodas5p ({taken['rodas5p']} steps)"
    assert result.methods.attrs["flag_meanings"] == "taylor dop853 rodas5p"
    assert int(result.methods) == 0b101


@pytest.mark.parametrize(
    ("rates", "start"),
    [
        ({"x": "1 + x**(3/2) - x**2", "y": "-y"}, {"x": 0.0, "y": 1.0}),  # no second term at the start
        ({"x": "1 - x**a/(1 + x**a)", "y": "x - y"}, {"x": 0.0, "y": 0.0}),
        ({"x": "u/(exp(u) - 1) - x", "u": "-u"}, {"x": 0.5, "u": 0.0}),
    ],
)
def test_a_series_without_a_next_term_is_handed_on(rates: dict[str, str], start: dict[str, float]) -> None:
    parameters = {"a": 2.4} if "**a" in rates["x"] else {}
    scene = Scene(Field(rates, parameters=parameters), None, None, initial=start, window=4.0, **SHORT)
    if "exp(u)" in rates["x"]:  # 0/0 has no value for any method
        with pytest.warns(RuntimeWarning, match="no cell came to its end"):
            assert run(scene, **QUIET).status != Status.FINISHED
        return
    result = run(scene, **QUIET)
    assert result.status == Status.FINISHED
    assert list(steps_of(result))[-1] == "dop853"

    def right(t: float, y: np.ndarray) -> list[float]:
        if "**a" in rates["x"]:
            return [1 - y[0] ** 2.4 / (1 + y[0] ** 2.4), y[0] - y[1]]
        return [1 + y[0] ** 1.5 - y[0] ** 2, -y[1]]

    expected = solve_ivp(right, (0, 4), list(start.values()), "DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
    np.testing.assert_allclose(result.states(), expected, rtol=0, atol=2e-6)


def test_records_go_on_over_a_hand_over() -> None:
    """Means and samples of a cell that changes its method within the window are those of a single method."""
    scene = RELAXING.replace(
        transient=0.0, parameters={"mu": 40.0}, rtol=1e-9, atol=1e-10, window=200.0, initial={"x": 0.1, "v": 0.0}
    )
    result, alone = run(scene, **QUIET), run(scene.replace(integrator="rodas5p"), **QUIET)
    assert len(steps_of(result)) == 2
    np.testing.assert_allclose(result.mean, alone.mean, atol=1e-6)
    np.testing.assert_allclose(result.trajectory, alone.trajectory, atol=1e-5)
    np.testing.assert_array_equal(result.time, alone.time)


@pytest.mark.parametrize("order", [[0, 1, 2, 3], [3, 1, 0, 2]])
def test_a_cell_of_a_sweep_is_its_own_run_to_the_last_bit(order: list[int]) -> None:
    values = np.array([0.1, 1.0, 20.0, 300.0])[order]
    result = run(RELAXING, mu=values, width=4, **QUIET)
    assert len(np.unique(result.methods)) > 1
    for k, mu in enumerate(values):
        alone = run(RELAXING, mu=float(mu), **QUIET)
        for name in ("end", "mean", "trajectory", "steps", "method_steps"):
            np.testing.assert_array_equal(result.data[name].isel(mu=k), alone.data[name], err_msg=f"{name}, mu = {mu}")


def test_integrators_of_a_sweep_are_counted_by_cells() -> None:
    result = run(RELAXING.replace(observe={}, record=()), mu=[1.0, 3.0, 1e3, 2e3], **QUIET)
    parts = [part.split(" in ") for part in result.integrators.split("; ")]
    assert sorted(cells for _, cells in parts) == ["2 cells", "2 cells"]
    assert dict(result.summary)["integrators"] == result.integrators
    assert result.integrators in str(result).replace("\n", " ")


def test_the_longest_step_is_that_of_the_cell() -> None:
    """Beside a drive of 400 a slow one takes the steps that it takes alone."""
    node = Field({"x": "v", "v": "-x/10 - v/10 - x**3 + cos(w*t)"}, parameters={"w": 400.0})
    scene = Scene(node, None, None, initial={"x": 1.0, "v": 0.0}, transient=0.0, window=2.0)
    result, alone = run(scene, w=[0.7, 400.0], **QUIET), run(scene, w=0.7, **QUIET)
    assert result.steps.values[0] == alone.steps < 100
    np.testing.assert_array_equal(result.end.isel(w=0), alone.end)


def test_a_steep_law_in_one_cell_does_not_tighten_the_others() -> None:
    scene = Scene(topology=chain(1), transient=0.0, window=2.0, record=())
    result, alone = run(scene, kappa=[1e2, 1e9], **QUIET), run(scene, kappa=1e2, **QUIET)
    np.testing.assert_array_equal(result.end.isel(kappa=0), alone.end)
    assert result.steps.values[0] == alone.steps


@pytest.mark.parametrize(
    ("rates", "start"),
    [
        ({"x": "v", "v": "0.3*cos(t/10) - 0.5*sign(v) - 0.1*x"}, {"x": 0.0, "v": 1.0}),
        ({"x": "1 - 2*sign(x)"}, {"x": 1.0}),
        ({"x": "y", "y": "0.2 - floor(y + 1/2)"}, {"x": 0.0, "y": 0.6}),
    ],
)
def test_a_slide_along_a_jump_ends_long_before_max_steps(rates, start) -> None:
    """10^7 steps of 5e-9 had to pass before a run said that it slides."""
    with pytest.warns(RuntimeWarning, match="slides along a jump"):
        result = run(Scene(Field(rates), None, None, initial=start, window=200.0, **SHORT), **QUIET)
    assert result.status == Status.STEP_BUDGET
    assert int(result.steps + result.rejected) < 300_000
    assert steps_of(result).keys() <= {"dop853"}


def test_a_slide_that_max_steps_will_do_for_goes_on() -> None:
    """And a cell beside it that slides for longer: each is judged alone."""
    scene = Scene(
        Field({"x": "1 - 2*sign(x)"}), None, None, initial={"x": 1.0}, max_steps=2_000_000, window=1.01, **SHORT
    )
    result = run(scene, x_1=[1.0, 0.001, 2.0], **QUIET)
    assert result.status.values.tolist() == [Status.FINISHED, Status.STEP_BUDGET, Status.FINISHED]
    assert int((result.steps + result.rejected)[0]) > 300_000
    assert int((result.steps + result.rejected)[1]) < 300_000
