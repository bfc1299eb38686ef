"""Pictures of any result."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from figure_samples import pretend, words

from synchain.models import chain
from synchain.models.dynamics.equations import Equations
from synchain.models.scenes.file import load_scene
from synchain.models.scenes.scene import Scene
from synchain.runtime.plots import result_plot, style
from synchain.runtime.results.result import Result
from synchain.runtime.sweeps.run import run

SWEPT = {"error": {"sigma": (0.3, 0.1, 0.2)}, "map": {"omega": (1.0, 1.1), "sigma": (0.1, 0.2, 0.3)}}


@pytest.fixture
def pair() -> Callable[..., Result]:
    def made(failed: tuple[int, ...] = (), **changes: Any) -> Result:
        return pretend(Scene(**{"topology": chain(2), "record": ("sync_error", "section"), **changes}), failed)

    return made


def test_an_error_curve_is_sorted_and_leaves_failures_out(pair: Callable[..., Result]) -> None:
    axes = result_plot.draw_result(pair((1,), axes=SWEPT["error"]))
    x, y = axes.lines[0].get_data()
    assert list(x) == [0.1, 0.2, 0.3]
    assert np.isnan(y).tolist() == [True, False, False]
    assert axes.get_xlabel() == r"$\sigma$"
    assert words(axes) == ["1 of 3 cells failed and are left out"]


def test_two_axes_make_a_map(pair: Callable[..., Result]) -> None:
    result = pair((0,), axes=SWEPT["map"])
    axes = result_plot.draw_result(result)
    (mesh,) = axes.collections
    assert mesh.get_array().shape == (2, 3)
    assert np.ma.getmaskarray(np.ma.masked_invalid(mesh.get_array())).sum() == 1
    assert (axes.get_xlabel(), axes.get_ylabel()) == (r"$\sigma$", r"$\omega$")
    first = result_plot.draw_result(result, kind="error")
    assert words(first) == [r"$\omega$ = 1; 1 of 6 cells failed and are left out"]


def test_zipped_axes_run_along_the_first(pair: Callable[..., Result]) -> None:
    result = pair(axes={"sigma": (0.1, 0.2), "omega": (1.0, 1.2)}, zipped=True)
    axes = result_plot.draw_result(result)
    assert axes.get_xlabel() == r"$\sigma$"
    assert list(axes.lines[0].get_xdata()) == [0.1, 0.2]


def test_section_points_against_the_axis_and_against_the_next(pair: Callable[..., Result]) -> None:
    axes = result_plot.draw_result(pair(axes=SWEPT["error"]), kind="section")
    assert axes.get_ylabel() == "$x_1$ at $v_1$ falling"
    assert np.isfinite(axes.lines[0].get_ydata()).sum() == 0 + 1 + 2
    alone = result_plot.draw_result(pair())
    assert alone.get_ylabel() == "$x_1$ the next time"
    low, high = alone.get_xlim()
    assert high - low >= 1e-5 * 0.99


def test_a_trajectory_makes_a_phase_portrait(pair: Callable[..., Result]) -> None:
    result = pair(record=("trajectory",), samples=20)
    given = style.new_figure((3, 3)).add_subplot()
    axes = result_plot.draw_result(result, given)
    assert axes is given
    assert len(axes.lines) == 2
    np.testing.assert_array_equal(axes.lines[1].get_ydata(), result.trajectory.sel(component="v", node=2))


def test_a_result_with_nothing_but_end_states_is_drawn(pair: Callable[..., Result]) -> None:
    alone = result_plot.draw_result(pair(record=()), kind="end")
    assert [line.get_xydata().tolist() for line in alone.lines] == [[[0.0, 2.0]], [[1.0, 3.0]]]
    swept = result_plot.draw_result(pair(record=(), axes=SWEPT["error"]), kind="end")
    assert swept.get_ylabel() == "$x$ at the end"


def test_plots_that_cannot_be_made_are_refused(pair: Callable[..., Result]) -> None:
    with pytest.raises(ValueError, match="unknown kind of plot 'pie'; known: error, section, map, phase, end"):
        result_plot.draw_result(pair(), kind="pie")
    with pytest.raises(ValueError, match="no numbers for the plot 'map'; it has them for: section, end"):
        result_plot.draw_result(pair(), kind="map")
    assert not plt.get_fignums()


def test_oscillators_of_several_kinds_show_states_of_their_own() -> None:
    clocks = load_scene("huygens")
    axes = result_plot.draw_result(pretend(clocks.replace(record=("trajectory",), axes=())))
    assert [line.get_label() for line in axes.lines] == ["oscillator 1", "2", "3"]
    assert axes.get_xlabel() == r"$x$, $\vartheta$"
    ends = result_plot.draw_result(pretend(clocks.replace(record=(), axes=())))
    assert ends.get_ylabel() == r"$v$, $\vartheta_{\mathrm{rate}}$ at the end"


def test_many_oscillators_are_shown_over_time(pair: Callable[..., Result]) -> None:
    axes = result_plot.draw_result(pair(topology=chain(9), record=("trajectory",), samples=20))
    (mesh,) = axes.collections
    assert mesh.get_array().shape == (9, 20)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time", "oscillator")


def test_ends_of_many_oscillators_are_one_line_of_each_colour(pair: Callable[..., Result]) -> None:
    result = pair(topology=chain(20), record=())
    lines = result_plot.draw_result(result).lines
    assert len(lines) == len(result_plot.CYCLE)
    drawn = np.concatenate([line.get_xydata() for line in lines])
    np.testing.assert_array_equal(drawn[drawn[:, 0].argsort()], result.end.transpose("node", "component"))
    result = pair(topology=chain(20), record=(), axes=SWEPT["error"])
    lines = result_plot.draw_result(result, kind="end").lines
    np.testing.assert_array_equal(lines[5].get_ydata(), result.end.sel(component="x")[:, 5::6].values.ravel())
    np.testing.assert_array_equal(lines[5].get_xdata(), np.repeat(SWEPT["error"]["sigma"], 3))


@pytest.mark.parametrize("record", [(), ("trajectory",)])
def test_nodes_are_not_searched_for_each_oscillator(
    pair: Callable[..., Result], monkeypatch: pytest.MonkeyPatch, record: tuple[str, ...]
) -> None:
    result, searched = pair(topology=chain(20), record=record, samples=20), []
    before = Equations.holders
    monkeypatch.setattr(Equations, "holders", lambda self, name: searched.append(name) or before(self, name))
    result_plot.draw_result(result)
    assert len(searched) < 20


def test_rounding_is_drawn_as_zero(pair: Callable[..., Result]) -> None:
    result = pair(axes=SWEPT["error"])
    assert result_plot.draw_result(result).get_ylim()[1] > 0.01
    result.data["sync_error"] = result.data.sync_error * 0.0 + 1e-14
    assert result_plot.draw_result(result).get_ylim() == pytest.approx((-5e-11, 1e-9))


def test_observables_are_drawn_by_name_and_where_nothing_else_is_recorded() -> None:
    scene = Scene("harmonic", "spring", chain(2), record=(), integrator="cash_karp", transient=0, window=1, observe={
        "error": "end(nodes.mean(x))", "own": "end(x)"}, axes={"sigma": (0.3, 0.1, 0.2)})  # fmt: skip
    given = {"show_progress": False, "width": 1}  # the drivers of other tests
    found = run(scene, **given)
    axes = result_plot.draw_result(found)
    assert (axes.get_xlabel(), axes.get_ylabel()) == (r"$\sigma$", "error")
    x, y = axes.lines[0].get_data()
    assert list(x) == [0.1, 0.2, 0.3]
    assert list(y) == list(found.data["error"].values[[1, 2, 0]])
    assert len(result_plot.draw_result(found, kind="own").lines) == 2
    with pytest.raises(ValueError, match=r"unknown kind of plot 'owm'; known: .*did you mean 'own'"):
        result_plot.draw_result(found, kind="owm")
    several = run(scene, realisations=4, draws={"x": "uniform(-1, 1)"}, **given)
    lines = result_plot.draw_result(several).lines
    assert len(lines) == 5
    np.testing.assert_allclose(lines[-1].get_ydata(), several.data["error"].values[[1, 2, 0]].mean(axis=1))
    assert {line.get_linestyle() for line in lines} == {"-"}
    alone = {"realisations": 4, "draws": {"x": "uniform(-1, 1)"}, **given}
    for drawn in (scene.replace(axes=()), scene.replace(axes=(), record=("sync_error",), observe=None)):
        (dots,) = result_plot.draw_result(run(drawn, **alone)).lines
        assert (dots.get_linestyle(), dots.get_marker()) == ("None", "."), drawn
    with_error = run(scene.replace(record=("sync_error",), observe={"own": "end(x)"}), **given)
    assert result_plot.draw_result(with_error).get_ylabel() == "average synchronisation error"
