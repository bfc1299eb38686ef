"""Pictures of any result."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from figure_samples import pretend, words
from matplotlib.axes import Axes

from synchain import Scene, load_scene, periodic_orbit, run
from synchain.graphs import chain
from synchain.models.dynamics.equations import Equations
from synchain.results import Result
from synchain.runtime.plots import result_plot, style
from synchain.runtime.plots.style import symbol


@pytest.fixture(autouse=True)
def new_figure() -> Iterator[None]:
    """Plots draw into pyplot's current axes."""
    yield
    plt.close("all")


def plot(result: Result, kind: str | None = None, **options: Any) -> Axes:
    """Draw a result into a new figure."""
    plt.figure()
    return result.plot(kind=kind, **options)


SHADED = SimpleNamespace(low=0.15, high=1.0)
SWEPT = {"error": {"sigma": (0.3, 0.1, 0.2)}, "map": {"omega": (1.0, 1.1), "sigma": (0.1, 0.2, 0.3)}}


@pytest.fixture
def pair() -> Callable[..., Result]:
    def made(failed: tuple[int, ...] = (), **changes: Any) -> Result:
        return pretend(Scene(**{"topology": chain(2), "record": ("sync_error", "section"), **changes}), failed)

    return made


def test_an_error_curve_is_sorted_and_leaves_failures_out(pair: Callable[..., Result]) -> None:
    axes = plot(pair((1,), axes=SWEPT["error"]))
    x, y = axes.lines[0].get_data()
    assert list(x) == [0.1, 0.2, 0.3]
    assert np.isnan(y).tolist() == [True, False, False]
    assert axes.get_xlabel() == r"$\sigma$"
    assert words(axes) == ["1 of 3 cells failed and are left out"]


def test_two_axes_make_a_map(pair: Callable[..., Result]) -> None:
    result = pair((0,), axes=SWEPT["map"])
    axes = plot(result)
    (mesh,) = axes.collections
    assert mesh.get_array().shape == (2, 3)
    assert np.ma.getmaskarray(np.ma.masked_invalid(mesh.get_array())).sum() == 1
    assert (axes.get_xlabel(), axes.get_ylabel()) == (r"$\sigma$", r"$\omega$")
    first = plot(result, "error")
    assert words(first) == [r"$\omega$ = 1; 1 of 6 cells failed and are left out"]


def test_zipped_axes_run_along_the_first(pair: Callable[..., Result]) -> None:
    result = pair(axes={"sigma": (0.1, 0.2), "omega": (1.0, 1.2)}, zipped=True)
    axes = plot(result)
    assert axes.get_xlabel() == r"$\sigma$"
    assert list(axes.lines[0].get_xdata()) == [0.1, 0.2]


def test_section_points_against_the_axis_and_against_the_next(pair: Callable[..., Result]) -> None:
    axes = plot(pair(axes=SWEPT["error"]), "section")
    assert axes.get_ylabel() == "$x_1$ at $v_1$ falling"
    assert np.isfinite(axes.lines[0].get_ydata()).sum() == 0 + 1 + 2
    alone = plot(pair())
    assert alone.get_ylabel() == "$x_1$ the next time"
    low, high = alone.get_xlim()
    assert high - low >= 1e-5 * 0.99


def test_a_trajectory_makes_a_phase_portrait(pair: Callable[..., Result]) -> None:
    result = pair(record=("trajectory",), samples=20)
    given = style.new_figure((3, 3)).add_subplot()
    axes = result.plot(given)
    assert axes is given
    assert len(axes.lines) == 2
    np.testing.assert_array_equal(axes.lines[1].get_ydata(), result.trajectory.sel(component="v", node=2))


def test_a_result_with_nothing_but_end_states_is_drawn(pair: Callable[..., Result]) -> None:
    alone = plot(pair(record=()), "end")
    assert [line.get_xydata().tolist() for line in alone.lines] == [[[0.0, 2.0]], [[1.0, 3.0]]]
    swept = plot(pair(record=(), axes=SWEPT["error"]), "end")
    assert swept.get_ylabel() == "$x$ at the end"


def test_plots_that_cannot_be_made_are_refused(pair: Callable[..., Result]) -> None:
    with pytest.raises(
        ValueError, match="unknown kind of plot 'pie'; known: error, section, map, time, phase, space, network, end"
    ):
        pair().plot(kind="pie")
    with pytest.raises(ValueError, match="no numbers for the plot 'map'; it has them for: section, end, network"):
        pair().plot(kind="map")
    with pytest.raises(TypeError, match=r"unknown keyword 'knd' of plot; known: ax, kind, windows, and keywords"):
        pair().plot(knd="end")
    with pytest.raises(ValueError, match="windows: found a plot over omega; expected one over sigma"):
        pair(axes={"omega": (1.0, 1.1)}).plot(windows=[SHADED])
    plt.close()
    assert not plt.get_fignums()


def test_oscillators_of_several_kinds_show_states_of_their_own() -> None:
    clocks = load_scene("huygens")
    axes = plot(pretend(clocks.replace(record=("trajectory",), axes=())))
    assert [line.get_label() for line in axes.lines] == ["oscillator 1", "2", "3"]
    assert axes.get_xlabel() == r"$x$, $\vartheta$"
    ends = plot(pretend(clocks.replace(record=(), axes=())))
    assert ends.get_ylabel() == r"$v$, $\vartheta_{\mathrm{rate}}$ at the end"


def test_many_oscillators_are_shown_over_time(pair: Callable[..., Result]) -> None:
    axes = plot(pair(topology=chain(9), record=("trajectory",), samples=20))
    (mesh,) = axes.collections
    assert mesh.get_array().shape == (9, 20)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time", "oscillator")


def test_ends_of_many_oscillators_are_one_line_of_each_colour(pair: Callable[..., Result]) -> None:
    result = pair(topology=chain(20), record=())
    lines = plot(result).lines
    assert len(lines) == len(result_plot.CYCLE)
    drawn = np.concatenate([line.get_xydata() for line in lines])
    np.testing.assert_array_equal(drawn[drawn[:, 0].argsort()], result.end.transpose("node", "component"))
    result = pair(topology=chain(20), record=(), axes=SWEPT["error"])
    lines = plot(result, "end").lines
    np.testing.assert_array_equal(lines[5].get_ydata(), result.end.sel(component="x")[:, 5::6].values.ravel())
    np.testing.assert_array_equal(lines[5].get_xdata(), np.repeat(SWEPT["error"]["sigma"], 3))


@pytest.mark.parametrize("record", [(), ("trajectory",)])
def test_nodes_are_not_searched_for_each_oscillator(
    pair: Callable[..., Result], monkeypatch: pytest.MonkeyPatch, record: tuple[str, ...]
) -> None:
    result, searched = pair(topology=chain(20), record=record, samples=20), []
    before = Equations.holders
    monkeypatch.setattr(Equations, "holders", lambda self, name: searched.append(name) or before(self, name))
    plot(result)
    assert len(searched) < 20


def test_rounding_is_drawn_as_zero(pair: Callable[..., Result]) -> None:
    result = pair(axes=SWEPT["error"])
    assert plot(result).get_ylim()[1] > 0.01
    result.data["sync_error"] = result.data.sync_error * 0.0 + 1e-14
    assert plot(result).get_ylim() == pytest.approx((-5e-11, 1e-9))


def test_observables_are_drawn_by_name_and_where_nothing_else_is_recorded() -> None:
    scene = Scene("harmonic", "spring", chain(2), record=(), integrator="cash_karp", transient=0, window=1, observe={
        "error": "end(nodes.mean(x))", "own": "end(x)"}, axes={"sigma": (0.3, 0.1, 0.2)})  # fmt: skip
    settings = {"show_progress": False, "width": 1}  # the drivers of other tests
    result = run(scene, **settings)
    axes = plot(result)
    assert (axes.get_xlabel(), axes.get_ylabel()) == (r"$\sigma$", "error")
    x, y = axes.lines[0].get_data()
    assert list(x) == [0.1, 0.2, 0.3]
    assert list(y) == list(result.data["error"].values[[1, 2, 0]])
    assert len(plot(result, "own").lines) == 2
    with pytest.raises(ValueError, match=r"unknown kind of plot 'owm'; known: .*did you mean 'own'"):
        plot(result, "owm")
    several = run(scene, realisations=4, draws={"x": "uniform(-1, 1)"}, **settings)
    lines = plot(several).lines
    assert len(lines) == 5
    np.testing.assert_allclose(lines[-1].get_ydata(), several.data["error"].values[[1, 2, 0]].mean(axis=1))
    assert {line.get_linestyle() for line in lines} == {"-"}
    alone = {"realisations": 4, "draws": {"x": "uniform(-1, 1)"}, **settings}
    for drawn in (scene.replace(axes=()), scene.replace(axes=(), record=("sync_error",), observe=None)):
        (dots,) = plot(run(drawn, **alone)).lines
        assert (dots.get_linestyle(), dots.get_marker()) == ("None", "."), drawn
    with_error = run(scene.replace(record=("sync_error",), observe={"own": "end(x)"}), **settings)
    assert plot(with_error).get_ylabel() == "average synchronisation error"


def test_plots_draw_into_the_current_axes_of_pyplot(pair: Callable[..., Result]) -> None:
    axes = pair(axes=SWEPT["error"]).plot(color="red", lw=3)
    assert axes is plt.gca()
    assert (axes.lines[0].get_color(), axes.lines[0].get_linewidth()) == ("red", 3)
    assert chain(3).draw() is axes
    assert chain(3).spectrum.plot() is axes


def test_windows_are_shaded_and_leave_the_limits(pair: Callable[..., Result]) -> None:
    result = pair(axes=SWEPT["error"])
    plain, shaded = plot(result), plot(result, windows=[SHADED])
    assert shaded.get_xlim() == plain.get_xlim()
    (band,) = shaded.patches
    assert (band.get_x(), band.get_width()) == (0.15, pytest.approx(0.85))


def test_a_window_that_ends_with_the_computed_range_has_a_dashed_edge(pair: Callable[..., Result]) -> None:
    result = pair(axes=SWEPT["error"])
    window = SimpleNamespace(low=0.15, high=0.25, low_error=0.01, high_error=math.inf)
    plain, opened = plot(result, windows=[SHADED]), plot(result, windows=[window])
    (edge,) = (line for line in opened.lines if line.get_linestyle() == "--")
    assert list(edge.get_xdata()) == [0.25, 0.25]
    notes = [[text.get_text().strip() for text in axes.texts] for axes in (plain, opened)]
    assert [each.count("not computed beyond") for each in notes] == [0, 1]


def test_errors_that_span_decades_have_a_logarithmic_scale(pair: Callable[..., Result]) -> None:
    result = pair(axes=SWEPT["error"])
    assert plot(result).get_yscale() == "linear"
    result.data["sync_error"] = result.data.sync_error * 0.0 + np.array([1e-12, 1e-4, 1.0])
    axes = plot(result)
    assert axes.get_yscale() == "symlog"
    assert list(axes.lines[0].get_ydata()) == [1e-4, 1.0, 1e-12]


def test_states_over_time_and_on_the_network(pair: Callable[..., Result]) -> None:
    result = pair(record=("trajectory",), samples=20)
    axes = plot(result, "time")
    np.testing.assert_array_equal(axes.lines[1].get_xydata()[:, 0], result.time)
    np.testing.assert_array_equal(axes.lines[1].get_ydata(), result.trajectory.sel(component="x", node=2))
    nodes = plot(result, "network").collections[-1]
    np.testing.assert_array_equal(nodes.get_array(), result.end.sel(component="x"))


def test_few_samples_a_turn_are_dots() -> None:
    """A polygon through four samples a turn is no orbit."""
    scene = Scene("harmonic", "spring", chain(2), record=("trajectory",), transient=0, window=60, samples=41)
    coarse = run(scene, show_progress=False, width=1)
    assert {line.get_linestyle() for line in plot(coarse, "phase").lines} == {"None"}
    fine = run(scene.replace(samples=400), show_progress=False, width=1)
    assert {line.get_linestyle() for line in plot(fine, "phase").lines} == {"-"}


def test_windows_may_be_pairs_and_anything_else_is_refused(pair: Callable[..., Result]) -> None:
    result = pair(axes=SWEPT["error"])
    (band,) = plot(result, windows=[(0.15, 0.25)]).patches
    assert (band.get_x(), band.get_width()) == (0.15, pytest.approx(0.1))
    for wrong in (3, [(1,)]):
        with pytest.raises(ValueError, match=r"windows: expected those of a master stability function, or pairs"):
            result.plot(windows=wrong)


def test_an_orbit_of_a_coupled_scene_is_drawn() -> None:
    """Its oscillator alone has no links, and so no strength of them."""
    scene = Scene("duffing", "spring", chain(2), parameters={"delta": 0.2, "omega": 1.3, "sigma": 0.1})
    orbit = periodic_orbit(scene)
    x, _ = orbit.plot().lines[0].get_data()
    assert (x[0], x[-1]) == pytest.approx((orbit.state[0],) * 2, abs=1e-6)


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("sigma", r"$\sigma$"),
        ("x_12", "$x_{12}$"),
        ("maximum(x_1)", "maximum($x_1$)"),
        ("mean(v_2**2)", "mean($v_2$**2)"),
    ],
)
def test_labels_write_states_of_expressions_as_formulas(name: str, label: str) -> None:
    assert symbol(name) == label
