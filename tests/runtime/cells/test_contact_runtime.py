"""Everything that runs scenes works on set-valued friction: one small scene, one table."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from synchain import Criterion, Scene, open_result, run, thresholds
from synchain.graphs import topology
from synchain.results import Status
from synchain.runtime.cells.reduce import explain, reduce_scene
from synchain.runtime.plots.result_plot import draw_result

pytestmark = pytest.mark.long

SIGMA = [0.0, 0.1, 0.2, 0.3]
SCENE = Scene(
    topology=topology("chain", 2), contact="set-valued", transient=200.0, window=4.0, samples=9,
    record=("sync_error", "section", "trajectory"), section="v_1 falling", parameters={"omega": 1.15},
    axes={"sigma": SIGMA}, initial={"x": [0.3, 0.28], "v": [0.0, 0.0]},
)  # fmt: skip


@pytest.fixture(scope="module")
def result():
    return run(SCENE, show_progress=False)


def finishes(result, folder: Path) -> None:
    assert np.all(result.status == Status.FINISHED)
    assert list(result.sync_error.values < 1e-6) == [True, True, True, False]


def cuts_where_the_velocity_falls_through_zero(result, folder: Path) -> None:
    """The motion repeats after two drive periods, with one fall in each: two in a window of four."""
    assert result.section_count.values.tolist() == [2] * len(SIGMA)
    times = result.section_time.values
    np.testing.assert_allclose(times[:3, 1] - times[:3, 0], 4 * np.pi / 1.15, rtol=1e-6)
    velocities = result.section.sel(component="v", node=1).values
    assert np.nanmax(np.abs(velocities)) < 1e-7


def samples_the_motion_and_its_modes(result, folder: Path) -> None:
    path = result.states("trajectory")
    assert np.all(np.isfinite(path))
    assert set(np.unique(path[..., 4:])) <= {-1.0, 0.0, 1.0}
    np.testing.assert_array_equal(path[:, -1], result.states("end"))


def is_resumed(result, folder: Path) -> None:
    again = run(SCENE, show_progress=False, resume=result)
    assert again.data.identical(result.data)


def is_saved(result, folder: Path) -> None:
    path = folder / "stick.nc"
    result.save(path)
    assert open_result(path).data.identical(result.data)


def is_explained(result, folder: Path) -> None:
    text = explain(reduce_scene(SCENE))
    assert "coupling: 1 link" in text or "coupling: 2 links" in text
    assert "quotient" in text


def is_continued(result, folder: Path) -> None:
    along = run(SCENE.replace(continuation="up", transient=20.0), show_progress=False)
    assert np.all(along.status == Status.FINISHED)
    assert along.sync_error.values[1] < 1e-9


def is_drawn(result, folder: Path) -> None:
    assert draw_result(result, kind=None) is not None


@pytest.mark.parametrize(
    "works",
    [finishes, cuts_where_the_velocity_falls_through_zero, samples_the_motion_and_its_modes, is_resumed, is_saved,
     is_explained, is_continued, is_drawn],
    ids=lambda f: f.__name__,
)  # fmt: skip
def test_a_sweep(works: Callable, result, tmp_path: Path) -> None:
    works(result, tmp_path)


def test_thresholds() -> None:
    """Two oscillators at omega = 1.15: the exact end of the range is alpha = 0.4650, sigma = 0.2325; the probe's resolution
    is 5e-3 here."""
    criterion = Criterion(transient=600.0, window=20.0)
    result = thresholds(SCENE.replace(axes=()), sigma=np.linspace(0.0, 0.3, 7), resolution=5e-3, criterion=criterion,
                       show_progress=False)  # fmt: skip
    ((low, high),) = result.direct.intervals
    assert low == 0.0
    assert high == pytest.approx(0.2325, abs=0.02)


@pytest.mark.parametrize("start", [-0.1, 0.1])
def test_the_mode_of_a_body_that_sticks_is_zero_without_a_sign(start: float) -> None:
    still = {"theta_b": 0.0, "u": 0.0}
    settings = {"parameters": still, "initial": {"v": start}, "record": (), "transient": 0.0, "window": 3.0}
    scene = Scene(contact="set-valued", integrator="taylor", **settings)
    end = run(scene, show_progress=False).end.sel(component="slip").values
    assert not end.any()
    assert not np.signbit(end).any()
