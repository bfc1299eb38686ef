"""Runs that go on from the end of another: the same motion, labels and the phase of the drive checked."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from synchain import Field, Scene, open_result, run
from synchain.graphs import topology
from synchain.results import Result
from synchain.runtime.cells.reduce import reduce_scene
from synchain.runtime.results.labels import DRIVE_PHASE

DRIVEN = Scene(
    oscillator="duffing",
    topology=topology("chain", 3),
    parameters={"omega": 1.15, "sigma": 0.1},
    initial={"x": [0.1, 0.2, 0.3], "v": [0.0, 0.0, 0.1]},
    transient=3.0,
    window=4.0,
    rtol=1e-11,
)
FREE = Scene(
    oscillator="harmonic", topology=topology("chain", 2), transient=0.0, window=3.7, time_unit="time", rtol=1e-11
)


def ran(scene: Scene, **more: Any) -> Result:
    return run(scene, workers=1, width=1, show_progress=False, **more)


@pytest.fixture(scope="module")
def first() -> Result:
    return ran(DRIVEN)


def test_two_runs_in_a_row_are_one(first: Result) -> None:
    second = ran(DRIVEN.replace(transient=0.0), start=first)
    np.testing.assert_allclose(second.end, ran(DRIVEN.replace(transient=7.0)).end, rtol=0, atol=1e-8)
    assert np.abs(second.end - first.end).max() > 1e-3
    assert second.data.attrs["start_time"] == first.end_time.item() == pytest.approx(7 * 2 * np.pi / 1.15)
    assert second.scene.initial["v"] == tuple(first.end.sel(component="v").values)


def test_equations_without_drive_go_on_from_any_time() -> None:
    second = ran(FREE, start=ran(FREE))
    np.testing.assert_allclose(second.end, ran(FREE.replace(window=7.4)).end, rtol=0, atol=1e-8)


def test_one_cell_of_a_sweep_in_any_order_of_its_labels(first: Result) -> None:
    swept = ran(DRIVEN, sigma=[0.05, 0.1])
    turned = swept.end.isel(sigma=-1, node=[2, 0, 1], component=[1, 0])
    np.testing.assert_array_equal(ran(DRIVEN, start=turned, x_1=0.5).scene.y0[1:], first.states("end")[1:])
    assert ran(DRIVEN, start=turned).end.identical(ran(DRIVEN, start=swept.end.isel(sigma=-1)).end)


def test_modes_of_contacts_follow_from_the_other_states() -> None:
    scene = Scene(topology=topology("chain", 2), contact="set-valued", transient=5.0, window=5.0)
    first = ran(scene)
    again = ran(scene.replace(transient=0.0, window=1.0), start=first)
    full = ran(scene.replace(transient=5.0, window=6.0))
    np.testing.assert_allclose(again.end, full.end, rtol=0, atol=1e-7)


def test_kinds_of_nodes_have_their_own_components() -> None:
    scene = FREE.replace(nodes=[{"at": [2], "oscillator": "rossler"}], coupling="x->x", initial=None)
    first = ran(scene)
    assert np.isnan(first.end.sel(component="z", node=1))
    second = ran(scene, start=first)
    np.testing.assert_allclose(second.states("end"), ran(scene.replace(window=7.4)).states("end"), rtol=0, atol=1e-7)


def test_states_in_a_row_and_tables_are_starts(first: Result) -> None:
    full = ran(DRIVEN, start=first)
    for start in (first.states(), first.states().tolist(), full.scene.initial):
        again = ran(DRIVEN, start=start)
        np.testing.assert_array_equal(again.end, full.end)
        assert again.data.attrs["start_time"] == 0.0


def test_each_cell_of_a_sweep_goes_on_from_its_own(tmp_path: Path) -> None:
    sigma, omega = [0.05, 0.1, 0.2], [1.15, 0.9]
    first = ran(DRIVEN, sigma=sigma, omega=omega)
    second = ran(DRIVEN.replace(transient=0.0), start=first, sigma=sigma, omega=omega)
    np.testing.assert_array_equal(second.start_state, first.end)
    np.testing.assert_array_equal(second.start_time, first.end_time)
    for k, strength in enumerate(sigma):
        alone = ran(DRIVEN.replace(transient=0.0), start=first.end.isel(sigma=k, omega=1), sigma=strength, omega=0.9)
        np.testing.assert_array_equal(second.end.isel(sigma=k, omega=1), alone.end)
    other_order = ran(DRIVEN.replace(transient=0.0), start=first.end.transpose(..., "sigma"), sigma=sigma, omega=omega)
    np.testing.assert_array_equal(other_order.end, second.end)
    second.save(tmp_path / "second.nc")
    assert open_result(tmp_path / "second.nc").data.identical(second.data)


def test_an_axis_that_a_start_lacks_begins_at_one_cell() -> None:
    first = ran(DRIVEN, sigma=[0.05, 0.1])
    second = ran(DRIVEN, start=first, delta=[0.1, 0.2], sigma=[0.05, 0.1])
    for k in range(2):
        np.testing.assert_array_equal(second.start_state.isel(delta=k), first.end)
    alone = ran(DRIVEN, start=first.end.isel(sigma=1), sigma=0.1, delta=0.2)
    np.testing.assert_array_equal(second.end.isel(sigma=1, delta=1), alone.end)


def test_equal_starts_of_a_scene_are_not_merged_if_cells_start_apart() -> None:
    alike = DRIVEN.replace(initial={"x": 0.1})
    first = ran(DRIVEN, sigma=[0.05, 0.1])
    second = ran(alike, start=first, sigma=[0.05, 0.1])
    np.testing.assert_array_equal(second.end, ran(DRIVEN, start=first, sigma=[0.05, 0.1]).end)


def test_starts_of_cells_are_resumed_with_them() -> None:
    swept = DRIVEN.replace(axes={"sigma": [0.05, 0.1]})
    first = ran(swept)
    second = ran(swept, start=first)
    assert ran(swept, start=first, resume=second).end.identical(second.end)
    for more in ({"resume": second}, {"resume": first, "start": first}):
        with pytest.raises(ValueError, match="started from other states; give the start of that run"):
            ran(swept, **more)


def test_modes_of_contacts_of_each_cell_follow_from_the_other_states() -> None:
    scene = Scene(topology=topology("chain", 2), contact="set-valued", transient=5.0, window=5.0)
    first = ran(scene, sigma=[0.1, 0.2])
    second = ran(scene.replace(transient=0.0, window=1.0), start=first, sigma=[0.1, 0.2])
    alone = ran(scene.replace(transient=0.0, window=1.0), start=first.end.isel(sigma=1), sigma=0.2)
    np.testing.assert_array_equal(second.end.isel(sigma=1), alone.end)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"sigma": [0.05, 0.2]}, r"found cells of sigma = 0\.05, 0\.1; expected those of the sweep, 0\.05, 0\.2"),
        ({"delta": [0.1, 0.2]}, r"several cells, along sigma \(2\)"),
        ({"sigma": [0.05, 0.1], "certified": True}, "certified: found a start of several cells"),
        ({"sigma": [0.05, 0.1], "reduce": reduce_scene(DRIVEN)}, "a ReducedScene beside a start of several cells"),
    ],
)
def test_cells_of_another_sweep_are_refused(more: dict[str, Any], message: str) -> None:
    first = ran(DRIVEN, sigma=[0.05, 0.1])
    with pytest.raises(ValueError, match=message) as caught:
        ran(DRIVEN, start=first, **more)
    assert "\n" not in str(caught.value)
    with pytest.raises(ValueError, match="set continuation = 'none'"):
        ran(DRIVEN.replace(axes={"sigma": [0.05, 0.1]}, continuation="up"), start=first)


@pytest.mark.parametrize(
    ("start", "error", "message"),
    [
        (lambda: ran(DRIVEN, sigma=[0.05, 0.1]), ValueError, r"several cells, along sigma \(2\); .*\.isel\(sigma=-1\)"),
        (lambda: ran(FREE), ValueError, "nodes 1, 2; expected 1, 2, 3"),
        (lambda: ran(DRIVEN).end.sel(component=["x"]), ValueError, "components x; expected x, v, those of the scene"),
        (lambda: ran(DRIVEN).end.isel(node=0), ValueError, "nodes none; expected 1, 2, 3"),
        (lambda: ran(DRIVEN.replace(window=4.3)), ValueError, "is 0.300000 into a period at t = 39.88"),
        (lambda: ran(DRIVEN).end.assign_coords({DRIVE_PHASE: np.nan}), ValueError, "the drive has no period at t = "),
        (lambda: ran(DRIVEN.replace(max_steps=3)), ValueError, "a result with 1 cell: used up max_steps"),
        (lambda: ran(DRIVEN).end * np.nan, ValueError, "a state that is not finite"),
        (lambda: "end", TypeError, r"found 'end' \(str\); expected a Result of one cell"),
        (lambda: [0.1, 0.2], ValueError, "start: found 2 numbers; expected 6, of x_1, x_2, x_3, v_1, v_2, v_3"),
        (lambda: np.ones((2, 3)), ValueError, r"start: found an array of shape \(2, 3\)"),
        (lambda: {"y": 1.0}, ValueError, "initial: unknown key 'y'; known: x, v"),
        (lambda: xr.DataArray([1.0, 2.0]), ValueError, r"along dim_0 \(2\)"),
    ],
)
def test_what_is_refused(start: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message) as caught:
        ran(DRIVEN, start=start())
    assert "\n" not in str(caught.value)


def test_a_continued_sweep_refuses_a_drive_amid_its_period() -> None:
    """Each cell begins at phase 0, as `run(start=...)` says of one cell."""
    driven = Scene(Field({"x": "-x + b*cos(2*t)"}, parameters={"b": 1}), None, None, transient=0.0, window=10.0)
    amid = driven.replace(time_unit="time", axes={"b": [1.0, 2.0, 3.0]}, continuation="up")
    with pytest.raises(
        ValueError, match=r"continuation: the drive is 0\.183099 into a period at the end of a cell; expected"
    ):
        run(amid, show_progress=False)
    uncut = amid.replace(window=3 * driven.period)
    counted = amid.replace(time_unit="period", window=3.0)
    ends = [run(each, show_progress=False).states("end") for each in (uncut, counted)]
    np.testing.assert_allclose(*ends, rtol=1e-12)
    run(amid.replace(continuation="none"), show_progress=False)
