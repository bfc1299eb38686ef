"""Figures of exponents: what is drawn for known functions, and that one run serves all that ask for it."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from figure_samples import TINY, Simulation, drawn, parabola, rows, words
from matplotlib.colors import to_rgba

from synchain import Scene, load_scene
from synchain.graphs import chain, complete
from synchain.results import MSF, Plane
from synchain.runtime.paper import exponent_figure, load, plane_figure, synchronisability_map
from synchain.runtime.paper.figure_runs import QUICK, FigureRuns, Quality
from synchain.runtime.paper.make import make
from synchain.runtime.plots import style
from synchain.runtime.synchronisation.criterion import PAPER


@pytest.fixture
def simulation(monkeypatch: pytest.MonkeyPatch) -> Simulation:
    """Nothing is simulated, and both qualities are tiny."""
    return Simulation().install(monkeypatch)


def test_exponents_are_drawn_with_their_stable_range_and_error(simulation: Simulation) -> None:
    panels, data = drawn("msf", FigureRuns(TINY))
    assert [function.scene.parameters["omega"] for function in data] == [1.15, 1.4, 1.55]
    for panel, function, (low, high) in zip(panels, data, ((0.0, 0.466), (0.09, 0.6), (0.176, 0.594)), strict=True):
        band = next(patch for patch in panel.patches if patch.get_facecolor() == to_rgba(style.GREY))
        assert (band.get_x(), band.get_x() + band.get_width()) == pytest.approx((low, high), abs=1e-3)
        (line,) = (line for line in panel.lines if len(line.get_xdata()) == len(function.fine.alpha))
        np.testing.assert_allclose(line.get_ydata(), (function.fine.alpha - low) * (function.fine.alpha - high))
        cloud = panel.collections[0].get_paths()[0].vertices
        at_end = cloud[np.isclose(cloud[:, 0], 1.2), 1]
        assert at_end.max() - at_end.min() == pytest.approx(4 * 1e-3, rel=1e-3)  # two standard errors either side
        assert panel.get_ylim()[0] < line.get_ydata().min() < line.get_ydata().max() < panel.get_ylim()[1]
        assert "published" in words(panel)
    (bar,) = (line for line in panels[1].lines if line.get_color() == style.ORANGE)
    np.testing.assert_allclose(bar.get_xdata(), [0.09, 0.6])  # 2 sigma of the printed row


def test_an_exponent_that_is_not_finite_leaves_a_gap() -> None:
    alpha = np.linspace(0.0, 1.2, 9)
    fine = parabola(1.4, alpha)
    fine.exponent[2] = -math.inf
    with style.context():
        axes = exponent_figure.draw_exponent(
            style.new_figure((3, 2)).add_subplot(), MSF(Scene(topology=chain(2)), alpha, fine)
        )
    curve, dots = axes.lines[1:]
    for line in (curve, dots):
        assert np.isnan(line.get_ydata()).tolist() == [k == 2 for k in range(9)]


@pytest.mark.parametrize(("asked", "marked"), [(4, True), (97, False)])
def test_few_strengths_are_marked_on_the_line_of_all(asked: int, marked: bool) -> None:
    fine = parabola(1.4, np.linspace(0.0, 1.2, 289))
    with style.context():
        alpha = np.linspace(0.0, 1.2, asked)
        axes = exponent_figure.draw_exponent(
            style.new_figure((3, 2)).add_subplot(), MSF(Scene(topology=chain(2)), alpha, fine)
        )
    _, curve, *dots = axes.lines
    np.testing.assert_array_equal(curve.get_xdata(), fine.alpha)
    assert [(line.get_linestyle(), len(line.get_xdata())) for line in dots] == ([("None", 4)] if marked else [])


def test_numbers_of_the_exponents_are_written(simulation: Simulation, tmp_path: Path) -> None:
    make(["msf"], tmp_path)
    table = rows(tmp_path / "msf.csv")
    assert list(table[0]) == ["omega", "alpha", "exponent", "stderr"]
    assert len(table) == 3 * 9
    assert float(table[9]["exponent"]) == pytest.approx(0.09 * 0.6)
    ranges = rows(tmp_path / "msf_ranges.csv")
    assert [(row["omega"], row["motion"]) for row in ranges] == [(w, "aperiodic") for w in ("1.15", "1.4", "1.55")]
    assert float(ranges[2]["low"]) == pytest.approx(0.176, abs=1e-4)
    assert float(ranges[2]["low_error"]) == pytest.approx(1e-3 / (0.594 - 0.176), rel=0.05)


def test_one_function_serves_every_figure_of_the_same_runs_and_no_other(simulation: Simulation) -> None:
    runs = FigureRuns(TINY)
    for name in ("figure_5", "figure_7", "msf"):
        load(name).compute(name, runs)
    assert [omega for kind, omega, _ in simulation.functions] == [1.15, 1.4, 1.55]
    assert exponent_figure.curve(load_scene("figure_8"), runs) is load("msf").compute("msf", runs)[1]
    exponent_figure.curve(load_scene("figure_8"), FigureRuns(TINY))
    assert len(simulation.functions) == 4


def test_effort_follows_the_quality() -> None:
    runs = FigureRuns(Quality(), workers=3)
    assert exponent_figure.effort(runs) == {
        "precision": 1e-3,
        "periods": 5000.0,
        "transient": 200.0,
        "starts": 4,
        "workers": 3,
        "show_progress": False,
        "progress": runs.execution.progress,
    }
    quick = exponent_figure.effort(FigureRuns(QUICK))
    assert quick["precision"] > 1e-3
    assert quick["periods"] < 5000


def test_the_plane_shows_contour_rays_and_dots(simulation: Simulation, tmp_path: Path) -> None:
    axes, _ = drawn("msf_plane", FigureRuns(TINY))
    assert [kind for kind, _, _ in simulation.functions] == ["plane"]
    contour = next(line for line in axes.lines if line.get_label() == r"$\Lambda=0$")
    radius = np.hypot(contour.get_xdata() - 0.345, contour.get_ydata())  # (alpha - 0.09)(alpha - 0.6) + beta^2 = 0
    np.testing.assert_allclose(radius, 0.255, atol=0.03)
    dots = {
        tuple(float(v[0]) for v in line.get_data())
        for line in axes.lines
        if line.get_marker() == "o" and len(line.get_xdata())
    }
    # weights 1 and 1/2 round four nodes: gamma = -3, -3/2 ± i/2
    np.testing.assert_allclose(
        sorted(dots),
        [(1.5 * plane_figure.SIGMA, 0.5 * plane_figure.SIGMA), (3.0 * plane_figure.SIGMA, 0.0)],
        atol=1e-12,
    )
    rays = [line for line in axes.lines if line.get_linestyle() == "--"]
    slopes = sorted(line.get_ydata()[1] / line.get_xdata()[1] for line in rays)
    np.testing.assert_allclose(slopes, [-1 / 3, 0.0, 1 / 3], atol=1e-12)
    assert axes.get_xlim() == (0.0, 1.2)
    make(["msf_plane"], tmp_path)
    table = rows(tmp_path / "msf_plane.csv")
    assert len(table) == 7 * 4
    last = table[-1]
    assert float(last["exponent"]) == pytest.approx((1.2 - 0.09) * (1.2 - 0.6) + 0.6**2)
    assert {"line", "alpha", "beta"} == set(rows(tmp_path / "msf_plane_ranges.csv")[0])


def test_colours_of_the_plane_meet_at_zero() -> None:
    grid = np.linspace(0.0, 1.0, 4)
    value = np.add.outer(grid, grid) - 0.5
    value[0, 0] = -math.inf
    with style.context():
        axes = plane_figure.draw_plane(
            style.new_figure((3, 2)).add_subplot(),
            Plane(Scene(), grid, grid, value, value, np.array([[["periodic"]]]), 1.0),
        )
    (mesh,) = axes.collections
    assert (mesh.norm.vmin, mesh.norm.vcenter, mesh.norm.vmax) == (-1.5, 0.0, 1.5)


@pytest.mark.parametrize(("sign", "least", "most"), [(-1, 0.0, 0.5), (1, 0.5, 1.0)])
def test_colours_of_one_sign_differ_and_leave_white_to_zero(sign: int, least: float, most: float) -> None:
    value = sign * np.array([[0.100, 0.101], [0.102, 0.103]])
    axes = Plane(Scene(), np.arange(2.0), np.arange(2.0), value, value, np.array([[["periodic"]]]), 1.0).plot()
    (mesh,) = axes.collections
    shades = mesh.norm(mesh.get_array())
    assert (shades.min(), shades.max()) == (least, most)
    assert min(mesh.cmap(mesh.norm(0.0))) > 0.9


def test_an_uneven_ring_has_the_weights_asked_for() -> None:
    ring = plane_figure.uneven_ring(4, Fraction(1, 3))
    assert ring.links[0] == (0, 1, Fraction(1))
    assert ring.links[1] == (0, 3, Fraction(1, 3))
    assert not ring.symmetric
    assert sorted(set(np.round(np.abs(np.array(ring.spectrum.values, dtype=complex)), 12))) == pytest.approx(
        [0.0, abs(complex(-4 / 3, 2 / 3)), 8 / 3]
    )


def test_the_map_takes_the_worst_mode_of_every_network(simulation: Simulation) -> None:
    runs = FigureRuns(TINY)
    panels, data = drawn("synchronisability_map", runs)
    assert len(simulation.functions) == len(data.omega) == 7
    at = int(np.argmin(np.abs(data.omega - 1.4)))
    low, high = 0.09, 0.6
    for graph, expected in ((chain(2), (low / 2, high / 2)), (complete(5), (low / 5, high / 5))):
        worst = synchronisability_map.largest_exponent(data, graph)[at]
        for sigma, value in zip(data.sigma, worst, strict=True):
            if min(abs(sigma - end) for end in expected) > 0.01:
                assert (value < 0) == (expected[0] < sigma < expected[1])
    three = synchronisability_map.largest_exponent(data, chain(3))
    one = np.array([np.interp(data.sigma, data.alpha, row[0]) for row in data.exponent])
    fast = np.array([np.interp(3 * data.sigma, data.alpha, row[0]) for row in data.exponent])
    np.testing.assert_allclose(three, np.maximum(one, fast))
    assert [panel.get_title() for panel in panels][:2] == ["chain(2)", "chain(3)"]
    shown = np.ma.getmaskarray(panels[0].collections[0].get_array())
    np.testing.assert_array_equal(~shown.T, synchronisability_map.largest_exponent(data, chain(2)) < 0)


def test_the_map_is_that_of_most_starts() -> None:
    """Two starts on a motion that is stable for a strong mode alone, one on the opposite: no mean of the two."""
    alpha, sigma = np.linspace(0.0, 3.0, 31), np.array([0.1, 0.5])
    often, seldom = 0.2 - alpha, alpha - 0.2
    data = synchronisability_map.Map(np.array([1.0]), alpha, sigma, np.array([[often, seldom, often]]), ("a; b",))
    largest = synchronisability_map.largest_exponent(data, chain(3))  # gamma = -1 and -3
    np.testing.assert_allclose(largest, [[0.1, -0.3]])


def test_the_map_is_written_with_a_column_for_each_network(simulation: Simulation, tmp_path: Path) -> None:
    make(["synchronisability_map"], tmp_path)
    table = rows(tmp_path / "synchronisability_map.csv")
    assert len(table) == 7 * 13
    assert list(table[0]) == [
        "omega",
        "sigma",
        "chain_2",
        "chain_3",
        "chain_4",
        "ring_6",
        "star_5",
        "complete_5",
        "motion",
    ]
    row = next(row for row in table if row["omega"] == "1.4" and row["sigma"] == "0.1")
    assert float(row["chain_2"]) == pytest.approx((0.2 - 0.09) * (0.2 - 0.6), abs=0.01)
    assert float(row["star_5"]) == pytest.approx((0.1 - 0.09) * (0.1 - 0.6), abs=0.01)  # gamma = -1 and -5
    assert row["motion"] == "aperiodic"


def test_a_tiny_function_from_a_real_run() -> None:
    runs = FigureRuns(Quality(points=3, criterion=replace(PAPER, starts=1, transient=2.0)), workers=1)
    (curve, *_) = (exponent_figure.curve(load_scene("figure_5"), runs),)
    assert curve.alpha.tolist() == [0.0, 0.6, 1.2]
    assert curve.exponent[0] < 0 < curve.exponent[1]
    assert curve.attractors == ("periodic, 2 drive periods",)
