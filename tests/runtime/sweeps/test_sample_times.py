"""Trajectories at given times, against closed forms and against equally spaced samples."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import synchain as sc
from synchain import Field, Scene
from synchain.runtime.cli import main

OSCILLATOR = Field({"x": "v", "v": "-k*x - c*v"}, parameters={"k": 4.0, "c": 0.3})
TIMES = [0.0, 0.1, 0.1000001, 1.7, 5.0, 9.99, 10.0]


def scene(**more: Any) -> Scene:
    settings = {"initial": {"x": 1.0, "v": 0.0}, "transient": 0, "window": 10, "rtol": 1e-11, **more}
    return Scene(OSCILLATOR, None, **settings)


def damped(t: np.ndarray, k: float, c: float) -> np.ndarray:
    """Return x of the damped oscillator from x = 1, v = 0."""
    w = np.sqrt(k - c * c / 4)
    return np.exp(-c * t / 2) * (np.cos(w * t) + c / (2 * w) * np.sin(w * t))


@pytest.mark.parametrize("integrator", ["auto", "dop853", "rodas5p", "cash_karp"])
def test_samples_at_given_times_are_the_closed_form(integrator: str) -> None:
    springs = [1.0, 4.0, 9.0]
    result = sc.run(scene(integrator=integrator), t_eval=TIMES, k=springs, show_progress=False)
    assert result.trajectory.dims == ("k", "sample", "component", "node")
    for k, times, states in zip(springs, result.time.values, result.trajectory.values, strict=True):
        np.testing.assert_array_equal(times, TIMES)
        # the linear interpolation of no method is involved; rodas5p interpolates to fourth order
        error = {"rodas5p": 1e-7, "cash_karp": 1e-5}.get(integrator, 1e-9)
        np.testing.assert_allclose(states[:, 0, 0], damped(times, k, 0.3), rtol=0, atol=error)


def test_equally_spaced_times_give_the_bits_of_samples() -> None:
    spaced = sc.run(scene(record=["trajectory"], samples=41), k=[1.0, 2.0, 3.0], show_progress=False)
    given = sc.run(scene(), t_eval=0.25 * np.arange(41), k=[1.0, 2.0, 3.0], show_progress=False)
    np.testing.assert_array_equal(spaced.trajectory.values, given.trajectory.values)
    np.testing.assert_allclose(spaced.time.values, given.time.values, rtol=1e-15)


def test_times_count_periods_of_the_drive_from_the_start_of_the_run() -> None:
    # v' = cos(omega t): x and v at whole and quarter periods of each cell
    field = Field({"x": "v", "v": "a*cos(omega*t)"}, parameters={"a": 1.0, "omega": 1.0})
    driven = Scene(field, None, initial={"x": 0.0, "v": 0.0}, transient=2, window=3, rtol=1e-10, t_eval=[2, 2.25, 4.75])
    result = sc.run(driven, omega=[0.7, 1.0, 3.1], show_progress=False)
    omega = np.array([[0.7], [1.0], [3.1]])
    times = result.time.values
    np.testing.assert_allclose(times, 2 * np.pi / omega * [2, 2.25, 4.75], rtol=1e-15)
    np.testing.assert_allclose(
        result.sel(component="v").trajectory.values[..., 0], np.sin(omega * times) / omega, atol=1e-8
    )


def test_each_lane_takes_its_own_steps_to_the_same_times() -> None:
    times = np.sort(np.random.default_rng(1).uniform(0, 10, 300))
    springs = np.geomspace(0.1, 400, 23)
    together = sc.run(scene(), t_eval=times, k=springs, show_progress=False).trajectory.values
    for k, states in list(zip(springs, together, strict=True))[::7]:
        alone = sc.run(scene(), t_eval=times, k=float(k), show_progress=False)
        np.testing.assert_array_equal(alone.trajectory.values, states)


def test_samples_behind_a_stop_are_missing() -> None:
    result = sc.run(scene(stop="x_1"), t_eval=TIMES, show_progress=False)
    states, stopped = result.trajectory.values[:, 0, 0], float(result.end_time)
    np.testing.assert_array_equal(np.isnan(states), np.array(TIMES) > stopped)
    assert 0.1000001 < stopped < 1.7


def test_a_scene_keeps_its_times_in_files_and_results(tmp_path: Any) -> None:
    timed = scene(t_eval=np.array([1.0, 2.5]), record=[])
    assert (timed.t_eval, timed.record, timed.samples) == ((1.0, 2.5), ("trajectory",), 2)
    assert Scene.from_dict(timed.as_dict()) == timed
    timed.save(tmp_path / "timed.toml")
    assert sc.load_scene(tmp_path / "timed.toml") == timed
    # the times are dropped by None, and replaced by samples
    assert timed.replace(t_eval=None).record == ()
    assert timed.replace(t_eval=None) == scene(record=[])
    assert timed.replace(samples=5, record=["trajectory"]).t_eval == ()
    file = sc.stream(timed, tmp_path / "timed.nc", show_progress=False)
    np.testing.assert_array_equal(file.result.trajectory.values, sc.run(timed, show_progress=False).trajectory.values)
    assert file.result.scene == timed


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"t_eval": [1, 3, 2]}, "found 2 behind 3; expected increasing times"),
        ({"t_eval": [1, 1]}, "found 1 behind 1"),
        ({"t_eval": [1, 10.001]}, "found 10.001; expected times of the window, from 0 to 10"),
        ({"t_eval": [1, 2], "transient": 1.5}, "found 1; expected times of the window, from 1.5 to 11.5"),
        ({"t_eval": []}, "found no times"),
        ({"t_eval": [1, float("nan")]}, "t_eval"),
        ({"t_eval": [1, 2], "samples": 5}, "samples: found it beside t_eval"),
    ],
)
def test_wrong_times_are_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        scene(**change)
    with pytest.raises(TypeError, match="t_eval: found 3"):
        sc.run(scene(), t_eval=3)  # type: ignore[arg-type]


def test_functions_with_windows_of_their_own_ignore_the_times() -> None:
    pair = Scene("van_der_pol", "x->v", sc.graphs.chain(2), transient=0, window=30, t_eval=[1, 2])
    criterion = sc.Criterion(starts=1, transient=5, window=5)
    assert sc.basin(pair, samples=4, transient=20, window=5, sigma=0.5, show_progress=False).samples == 4
    swept = pair.replace(axes={"sigma": [0.1, 1.0]})
    assert sc.thresholds(swept, criterion=criterion, show_progress=False) is not None


def test_the_command_line_takes_times(tmp_path: Any) -> None:
    scene(title="damped").save(tmp_path / "damped.toml")
    command = ["run", str(tmp_path / "damped.toml"), "--out", str(tmp_path)]
    assert main([*command, "--t-eval", "0.5,2,2.25"]) == 0
    result = sc.open_result(tmp_path / "damped.nc")
    np.testing.assert_array_equal(result.time.values, [0.5, 2, 2.25])
    np.testing.assert_allclose(result.trajectory.values[:, 0, 0], damped(result.time.values, 4.0, 0.3), atol=1e-9)
    assert main([*command, "--overwrite", "--t-eval", "0:10:5"]) == 0
    np.testing.assert_array_equal(sc.open_result(tmp_path / "damped.nc").time.values, [0, 2.5, 5, 7.5, 10])
