"""Sweeps: axes, status of every cell, interruption, resuming, continuation, files."""

from __future__ import annotations

import json
import os
import signal

import numpy as np
import pytest
import xarray as xr

from synchain import Scene, kernel, open_result, run, stream
from synchain.graphs import chain
from synchain.models.dynamics.reduction import without_drive
from synchain.results import Status, SweepInterrupted
from synchain.runtime.cells.plan import plan
from synchain.runtime.cells.reduce import reduce_scene
from synchain.runtime.engines.step_control import tolerances
from synchain.runtime.support.execution import Execution
from synchain.runtime.support.progress import Reporter
from synchain.runtime.sweeps.memory import Memory
from synchain.runtime.sweeps.prepare import prepare

PAIR = Scene(topology=chain(2), transient=5, window=10, parameters={"sigma": 0.1})
SECTIONS = PAIR.replace(record=("sync_error", "section", "trajectory"), samples=2)
"""All records, as most tests of sweeps have them: they share a driver."""


def test_grid_is_laid_out_with_the_last_axis_fastest():
    result = run(PAIR, sigma=[0.0, 0.1], omega=[1.15, 1.4, 1.55])
    assert result.status.dims == ("sigma", "omega")
    assert result.status.shape == (2, 3)
    one = run(PAIR, sigma=0.1, omega=1.4)
    np.testing.assert_array_equal(result.end.sel(sigma=0.1, omega=1.4), one.end)
    assert not np.array_equal(result.end.sel(sigma=0.0, omega=1.4), one.end)


def test_zipped_axes_go_side_by_side():
    scene = PAIR.replace(axes={"sigma": [0.0, 0.1], "x_2": [0.28, 0.1]}, zipped=True)
    result = run(scene)
    assert result.status.dims == ("cell",)
    np.testing.assert_array_equal(result.end[1], run(PAIR, sigma=0.1, x_2=0.1).end)


def test_window_counts_periods_of_each_cell():
    times = run(PAIR, omega=[1.15, 2.3]).end_time
    np.testing.assert_allclose(times, 15 * 2 * np.pi / np.array([1.15, 2.3]), rtol=1e-15)


@pytest.mark.parametrize("axes", [{"sigam": 0.1}, {"sigma": [0.1, np.nan]}, {"x_3": 0.1}, {"sigma": []}])
def test_bad_axes_are_refused(axes):
    with pytest.raises((ValueError, TypeError)):
        run(PAIR, **axes)


def test_zero_drive_frequency_is_refused():
    with pytest.raises(ValueError, match="time_unit"):
        run(PAIR, omega=[0.0, 1.0])


def test_no_workers_are_refused():
    with pytest.raises(ValueError, match="workers = 0"):
        run(PAIR, workers=0)


def test_step_budget_ends_a_cell_with_its_sentence():
    result = run(PAIR.replace(max_steps=100))
    assert result.status == Status.STEP_BUDGET
    assert "max_steps" in result.message
    assert np.isnan([result.data.sync_error, result.data.sync_error_max]).all(), "nothing was seen of the window"
    assert not result.success
    assert result.steps + result.rejected == 100
    assert np.isfinite(result.end).all()
    assert 0 < result.end_time < 15 * 2 * np.pi / 1.15


def test_divergence_ends_a_cell_and_leaves_its_neighbours_alone():
    scene = Scene(
        oscillator="duffing", integrator="rodas5p", transient=0, window=5, parameters={"beta": -1.0, "u": 0.0}
    )
    result = run(scene, x_1=[0.1, 5.0, 0.2], width=8)
    assert result.status.values.tolist() == [Status.FINISHED, Status.DIVERGED, Status.FINISHED]
    np.testing.assert_array_equal(result.end[2], run(scene, x_1=0.2).end)


def test_every_status_has_a_sentence():
    assert all(len(status.message) > 10 for status in Status)


def run_with_room(scene, room):
    """Run a scene with room for so many section points of a cell at first."""
    memory = Memory.of(prepare(reduce_scene(scene), Execution(), room=room), None)
    memory.run(Reporter(scene.cells, show=False))
    return memory.result()


def test_section_room_grows_to_what_a_cell_needs():
    scene = SECTIONS.replace(axes={"sigma": [0.0, 0.1, 0.2]})
    full = run(scene)
    assert int(full.section_count.min()) > 3
    grown = run_with_room(scene, 2)
    assert grown.data.identical(full.data)


@pytest.mark.parametrize("direction", ["up", "down"])
def test_continuation_starts_from_the_neighbour(direction):
    scene = SECTIONS.replace(axes={"sigma": [0.02, 0.05, 0.08]}, continuation=direction)
    result = run(scene)
    order = [0, 1, 2] if direction == "up" else [2, 1, 0]
    state = np.array(PAIR.y0)
    for column in order:
        start = {name: float(value) for name, value in zip(PAIR.equations.state, state, strict=True)}
        alone = run(SECTIONS, sigma=[0.02, 0.05, 0.08][column], **start)
        np.testing.assert_array_equal(result.end[column], alone.end)
        state = alone.states("end")


def test_a_run_may_sweep_what_a_continued_scene_does_not():
    scene = SECTIONS.replace(axes={"sigma": [0.02, 0.05]}, continuation="up")
    bare = scene.replace(axes=())
    assert not bare.continued
    alone = run(bare, sigma=0.02, show_progress=False)
    along = run(bare, sigma=[0.02, 0.05], show_progress=False)
    np.testing.assert_array_equal(along.end[0], alone.end)
    np.testing.assert_array_equal(along.end, run(scene, show_progress=False).end)
    assert not np.array_equal(along.end[1], run(bare, sigma=0.05, show_progress=False).end)


def test_continuation_keeps_its_states_where_room_grows():
    scene = SECTIONS.replace(axes={"sigma": [0.02, 0.05, 0.08]}, continuation="up")
    full = run(scene)
    assert run_with_room(scene, 2).data.identical(full.data)


def test_result_survives_its_file(tmp_path):
    scene = PAIR.replace(record=("sync_error", "section", "trajectory"), samples=5, title="Größe σ")
    result = run(scene, sigma=[0.0, 0.1])
    path = tmp_path / "pair.nc"
    result.save(path)
    again = open_result(path)
    assert again.scene == result.scene
    assert again.data.identical(result.data)
    with xr.open_dataset(path) as data:
        assert data.attrs["kernel"] == kernel(result.scene).digest
        assert json.loads(data.attrs["scene"])["title"] == "Größe σ"
    assert [p.name for p in tmp_path.iterdir()] == ["pair.nc"]


def test_files_that_are_no_results_are_refused(tmp_path):
    (tmp_path / "text.nc").write_text("no netCDF")
    with pytest.raises(OSError, match=r"text\.nc"):
        open_result(tmp_path / "text.nc")
    xr.Dataset({"a": ("x", [1.0])}).to_netcdf(tmp_path / "other.nc", engine="scipy")
    with pytest.raises(ValueError, match="no synchain result"):
        open_result(tmp_path / "other.nc")


def test_unknown_variable_names_the_known_ones():
    with pytest.raises(AttributeError, match="sync_error"):
        _ = run(PAIR).trajectory


def test_saving_fails_whole(tmp_path, monkeypatch):
    result = run(PAIR)
    path = tmp_path / "pair.nc"
    result.save(path)
    before = path.read_bytes()

    def broken(*arguments, **options):
        raise OSError("disk full")

    monkeypatch.setattr(xr.Dataset, "to_netcdf", broken)
    with pytest.raises(OSError, match="disk full"):
        result.save(path, overwrite=True)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["pair.nc"]


@pytest.fixture
def interruptible():
    """Ctrl-C raises KeyboardInterrupt even where the test run was started with that signal ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_interrupt_keeps_finished_cells_and_resume_completes_them(interruptible):
    scene = SECTIONS.replace(transient=50, window=50, axes={"sigma": list(np.linspace(0, 0.3, 200))})
    pressed = []

    def press_once(progress):
        if progress.done and not pressed:
            pressed.append(progress.done)
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(SweepInterrupted) as caught:
        run(scene, workers=1, progress=press_once)
    partial = caught.value.result
    finished = partial.status.values == Status.FINISHED
    assert 0 < finished.sum() < 200
    assert np.isnan(partial.sync_error.values[partial.status.values == Status.NOT_RUN]).all()
    full = run(scene)
    np.testing.assert_array_equal(partial.sync_error.values[finished], full.sync_error.values[finished])
    assert run(scene, resume=partial).data.identical(full.data)


def test_resuming_another_scene_is_refused():
    with pytest.raises(ValueError, match="another scene"):
        run(PAIR, resume=run(PAIR, sigma=0.2))


@pytest.mark.parametrize(("kappa", "rtol", "expected"), [(1e5, 1e-3, 1e-5), (1e5, 1e-8, 1e-8), (10.0, 1e-3, 1e-3)])
def test_tolerance_sees_the_width_of_the_smoothed_jump(kappa, rtol, expected):
    scene = PAIR.replace(rtol=rtol, kappa=kappa)
    limits = tolerances(scene, scene.equations, plan(scene).numbers)
    assert limits == pytest.approx((expected, expected / 10))


def test_steepest_jump_of_a_cell_sets_its_tolerance():
    scene = PAIR.replace(rtol=1e-3, axes={"kappa": [10.0, 1e6]})
    assert tolerances(scene, scene.equations, plan(scene).numbers)[0] == pytest.approx([1e-3, 1e-6])


@pytest.mark.parametrize("kappas", [[10.0, 1e6], [1e6, 10.0]])
def test_steepest_jump_of_unequal_nodes_sets_the_tolerance(kappas):
    scene = PAIR.replace(rtol=1e-3, parameters={"kappa": kappas})
    assert tolerances(scene, scene.equations, plan(scene).numbers)[0] == pytest.approx(1e-6)


@pytest.mark.parametrize("off", [{"u": 0.0}, {"omega": 0.0}])
def test_the_jump_is_looked_up_in_the_equations_that_the_numbers_belong_to(off):
    scene = PAIR.replace(rtol=1e-3, kappa=1e6, **off)
    calm = without_drive(scene.equations, scene.parameters)
    assert len(calm.parameters) < len(scene.equations.parameters)
    values = np.array([[scene.parameters[name] for name in calm.parameters]])
    assert tolerances(scene, calm, values) == pytest.approx((1e-6, 1e-7))


def test_loose_tolerance_is_not_silently_wrong():
    """With rtol = 1e-3 taken literally the oscillator slips through its stick phase and the error is of order 0.1."""
    loose, tight = (run(SECTIONS.replace(rtol=rtol, window=40)) for rtol in (1e-3, 1e-9))
    assert loose.data["rtol_used"].item() == pytest.approx(1e-5)
    assert float(np.abs(loose.end - tight.end).max()) < 1e-4


@pytest.mark.parametrize("periods", [50, 147, 244])
def test_a_window_of_whole_periods_has_its_last_sample(periods: int) -> None:
    """2 pi N and N times 2 pi differ by rounding, so the run ends at the end of a period or a hair before or behind it."""
    scene = Scene(
        oscillator="duffing", topology=chain(1), record=("trajectory",), samples=5, transient=0, rtol=1e-3,
        time_unit="time", parameters={"delta": 0.5},
    )  # fmt: skip
    for window in (2 * np.pi * periods, np.nextafter(2 * np.pi * periods, 0), np.nextafter(2 * np.pi * periods, 1e9)):
        result = run(scene.replace(window=float(window)), reduce=False, width=1)
        assert np.isfinite(result.states("trajectory")).all(), window
        np.testing.assert_allclose(result.states("trajectory")[-1], result.states("end"), rtol=1e-11)


@pytest.mark.parametrize("n", [2, 9])
@pytest.mark.parametrize("size", [1e-280, 1e-160, 1.0])
def test_errors_of_tiny_states_are_not_lost_in_their_squares(size: float, n: int) -> None:
    """Two estimates of dop853 are made one: their squares, 1e-320 and less, were zero beside a tolerance of 1e-176."""
    settings = {"transient": 0, "window": 10, "time_unit": "time", "rtol": 1e-8, "atol": 1e-16 * size}
    start = {"x": size, "v": 0.0}
    scene = Scene(
        oscillator="harmonic", coupling="spring", topology=chain(n), initial=start, integrator="dop853", **settings
    )
    ends = run(scene, show_progress=False).states("end") / size
    expected = np.repeat([np.cos(10.0), -np.sin(10.0)], n).reshape(ends.shape)
    np.testing.assert_allclose(ends, expected, rtol=0, atol=1e-8)


def test_a_result_holds_the_tolerances_of_each_cell(tmp_path):
    """A default atol is a tenth of rtol, less by powers of ten for starts below 0.1; a jump of friction 1/kappa wide is resolved."""
    oscillator = Scene("harmonic", None, record=(), transient=0, window=1, time_unit="time", initial={"v": 0.0})
    starts = [2e-9, 0.02, 0.2, 2.0, 2e9]
    data = run(oscillator, x_1=starts, show_progress=False).data
    np.testing.assert_allclose(data["atol_used"], [1e-17, 1e-10, 1e-9, 1e-9, 1e-9], rtol=1e-12)
    assert set(data["rtol_used"].values) == {1e-8}
    assert not {"rtol_used", "atol_used"} & set(data.attrs)
    for start in starts:
        alone = run(oscillator, x_1=start, show_progress=False).data
        assert alone["atol_used"] == data["atol_used"].sel(x_1=start)
    assert set(run(oscillator.replace(atol=1e-7), x_1=starts, show_progress=False).data["atol_used"].values) == {1e-7}
    streamed = stream(oscillator, tmp_path / "a.nc", x_1=starts, show_progress=False).data
    np.testing.assert_array_equal(streamed["atol_used"], data["atol_used"])
    rubbing = run(SECTIONS.replace(rtol=1e-4, window=1, transient=0), kappa=[1e3, 1e5], show_progress=False).data
    np.testing.assert_allclose(rubbing["rtol_used"], [1e-4, 1e-5])
    np.testing.assert_allclose(rubbing["atol_used"], [1e-5, 1e-6])
