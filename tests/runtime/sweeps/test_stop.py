"""Cells that end where a function of their state passes zero."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from synchain import Scene, open_result, run
from synchain.graphs import ring
from synchain.observe import end, mean, nodes, rate
from synchain.results import Status

x, v, x_1, t = sp.symbols("x v x_1 t")
START = {"x": [1.0], "v": [0.0]}
TURN = {"turn": {"function": "x_1 - v_1", "direction": "both", "keep": ["x_1"]}}
TIMES = {"transient": 0.0, "window": 20.0, "time_unit": "time"}


@pytest.mark.parametrize(("integrator", "width"), [("dop853", 4), ("rodas5p", 4), ("taylor", 1), ("cash_karp", 4)])
def test_the_end_is_where_the_function_is_zero(integrator: str, width: int) -> None:
    """x = cos t is -1/2 at 2 pi/3; what is observed and sampled is that of the shorter step."""
    scene = Scene(
        oscillator="harmonic", rtol=1e-12, initial=START, record=("trajectory",), samples=201, integrator=integrator, **TIMES,
        stop=x_1 + sp.Rational(1, 2),
        observe={"place": mean(x), "square": mean(v**2), "speed": end(v), "slope": end(rate(x))},
        sections=TURN,
    )  # fmt: skip
    last = 2 * np.pi / 3
    near = 1e-9 if integrator == "cash_karp" else 1e-11  # its dense output is of order 3
    result = run(scene, show_progress=False, width=width)
    assert int(result.status) == Status.STOPPED
    assert result.message == "1 cell: met the stop condition of the scene before the end of the window"
    assert float(result.end_time) == pytest.approx(last, abs=near)
    np.testing.assert_allclose(result.states(), [-0.5, -np.sin(last)], rtol=0, atol=near)
    assert float(result.place[0]) == pytest.approx(np.sin(last) / last, abs=near)
    assert float(result.square[0]) == pytest.approx((last / 2 - np.sin(2 * last) / 4) / last, abs=near)
    assert float(result.data["speed"][0]) == float(result.states()[1])
    assert float(result.slope[0]) == pytest.approx(float(result.states()[1]), abs=1e-6)
    finite = np.isfinite(result.states("trajectory")[:, 0])
    assert finite.sum() == 21  # samples 0.1 apart: the last one is at 2.0
    times = result.time.values[finite]
    np.testing.assert_allclose(result.states("trajectory")[finite, 0], np.cos(times), rtol=0, atol=1e-8)
    assert int(result.turn_count) == 0  # cos t = -sin t at 3 pi/4, which is later


def test_cells_stop_each_for_itself_in_any_lanes() -> None:
    """Also before the window, where nothing is observed; a cell whose function keeps its sign reaches the end."""
    scene = Scene(
        oscillator="harmonic", integrator="dop853", rtol=1e-11, record=("trajectory",), samples=2, sections=TURN,
        transient=1.0, window=5.0, time_unit="time", stop="x_1 - 1/2", observe={"speed": mean(v)}, axes={"x_1": [0.4, 0.6, 1.0, -2.0]}, initial={"v": [0.0]},
    )  # fmt: skip
    result = run(scene, show_progress=False, width=4)
    stops = [np.nan, np.arccos(0.5 / 0.6), np.arccos(0.5), np.arccos(-0.25)]
    assert result.status.values.tolist() == [Status.FINISHED, *[Status.STOPPED] * 3]
    np.testing.assert_allclose(result.end_time[1:], stops[1:], rtol=0, atol=1e-9)
    np.testing.assert_allclose(result.end_time[0], 6.0)
    assert np.isnan(result.speed.values[1, 0])
    assert np.isfinite(result.speed.values[[0, 2, 3], 0]).all()
    assert not result.success
    assert int(result.turn_count[0]) >= 1
    for k, start in enumerate(scene.axes[0].values):
        alone = run(scene.replace(axes={}), show_progress=False, width=4, x_1=start)
        for name in ("end_time", "speed", "turn_count"):
            np.testing.assert_array_equal(alone.data[name], result.data[name][k])
        count = int(alone.turn_count)
        for name in ("turn", "turn_time"):
            np.testing.assert_array_equal(alone.data[name][:count], result.data[name][k, :count])


@pytest.mark.parametrize(
    ("stop", "end_time"), [("x_1 - 3/2", 20.0), ("1/2 - x_1", np.pi / 3), ("v_1", np.pi), ("v_1 - 1/2", 7 * np.pi / 6)]
)
def test_a_function_must_pass_zero_even_if_it_begins_there(stop: str, end_time: float) -> None:
    """x = cos t: as terminal events of SciPy do, one that touches zero or lies past it at the start ends nothing."""
    observed = {
        "record": ("trajectory",),
        "samples": 2,
        "observe": {"speed": mean(v)},
        "sections": TURN,
    }  # a shared driver
    scene = Scene(oscillator="harmonic", rtol=1e-10, initial=START, stop=stop, **observed, **TIMES)
    assert float(run(scene, show_progress=False).end_time) == pytest.approx(end_time, abs=1e-8)


def test_the_synchronisation_error_is_that_of_the_time_before_the_stop(tmp_path: Path) -> None:
    """Networks in loops too: their mean falls through a level at the time that it alone decides."""
    n = 12
    scene = Scene(
        oscillator="harmonic", topology=ring(n), integrator="taylor", rtol=1e-12, record=("sync_error",), **TIMES,
        initial={"x": [1.0 + 0.1 * i for i in range(n)], "v": [0.0] * n}, stop=nodes.mean(x),
        observe={"error": mean(nodes.sum(abs(x - x_1) ** 2) ** sp.Rational(1, 2))},
        axes={"sigma": [0.0]},
    )  # fmt: skip
    result = run(scene, show_progress=False)
    assert float(result.end_time[0]) == pytest.approx(np.pi / 2, abs=1e-10)
    gaps = 0.1 * np.arange(n)
    assert float(result.error[0]) == pytest.approx(np.sqrt((gaps**2).sum()) * 2 / np.pi, abs=1e-9)
    assert float(result.sync_error[0]) == pytest.approx(gaps.sum(), abs=1e-9)  # x and v turn on a circle
    result.save(tmp_path / "stopped.nc")
    assert open_result(tmp_path / "stopped.nc").scene == scene


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"stop": "x"}, "stop: found x, which each node has"),
        ({"stop": "y_1"}, "stop: unknown name 'y_1'"),
        ({"stop": "x_1", "record": ("section",)}, "found 'section' beside stop"),
        ({"stop": "x_1", "contact": "set-valued"}, "stop: found set-valued contacts"),
        ({"stop": 1}, "stop: found the constant 1"),
    ],
)
def test_wrong_stops_are_refused(keywords: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Scene(topology=ring(3), **keywords)


def test_scene_files_hold_the_stop() -> None:
    scene = Scene(topology=ring(3), record=(), stop=nodes.maximum(abs(v)) - 1e-9)
    assert Scene.from_dict(scene.as_dict()) == scene
    assert "stop" not in Scene().as_dict()
