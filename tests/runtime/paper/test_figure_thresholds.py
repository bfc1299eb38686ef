"""Projection and thresholds: measured and predicted stand beside published numbers, which are never used."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from figure_samples import TINY, Simulation, drawn, rows, words

from synchain import load_scene
from synchain.graphs import chain
from synchain.results import ExponentWindows
from synchain.runtime.paper import load, published
from synchain.runtime.paper import threshold_table as tables_of_thresholds
from synchain.runtime.paper.figure_runs import QUICK, FigureRuns
from synchain.runtime.paper.make import make
from synchain.runtime.prediction.intervals import scale
from synchain.runtime.synchronisation.threshold import project


@pytest.fixture
def simulation(monkeypatch: pytest.MonkeyPatch) -> Simulation:
    """Nothing is simulated, and both qualities are tiny."""
    return Simulation().install(monkeypatch)


def test_projection_shows_probe_lines_and_network(simulation: Simulation, tmp_path: Path) -> None:
    (probe, lines, network), data = drawn("figure_8", FigureRuns(TINY))
    np.testing.assert_allclose(data.predicted, [(0.09 / (2 - math.sqrt(2)), 0.6 / (2 + math.sqrt(2)))])
    thick = [line for line in lines.lines if line.get_linewidth() > 1.5]
    assert len(thick) == 3
    for line in thick:
        assert min(line.get_ydata()) == pytest.approx(0.09)
    assert words(lines)[:3] == ["$2 - \\sqrt{2}$", "$2$", "$2 + \\sqrt{2}$"]
    assert probe.get_ylim() == lines.get_ylim()
    assert network.get_xlim() == lines.get_xlim()
    for axes in (probe, lines):
        assert any(patch.get_y() == pytest.approx(0.09) for patch in axes.patches)
    (inset,) = (axes for axes in probe.figure.axes if axes not in (probe, lines, network))
    (ends,) = (line for line in inset.lines if line.get_marker() == "o")
    np.testing.assert_allclose(ends.get_ydata(), (0.09, 0.6), atol=1e-4)
    assert inset.get_ylim() == probe.get_ylim()
    for axes in (lines, network):
        assert any(patch.get_x() == pytest.approx(data.predicted[0][0]) for patch in axes.patches)


def test_projection_writes_curves_and_ranges(simulation: Simulation, tmp_path: Path) -> None:
    simulation.failed = (3,)
    make(["figure_6"], tmp_path)
    table = rows(tmp_path / "figure_6.csv")
    assert list(table[0]) == ["curve", "alpha", "sigma", "e_avg", "share", "status", "exponent", "stderr"]
    assert [row["curve"] for row in table] == ["probe"] * 13 + ["network"] * 13 + ["exponent"] * 9
    assert float(table[-1]["exponent"]) == pytest.approx((1.2 - 0.176) * (1.2 - 0.594))
    assert [k for k, row in enumerate(table) if row["status"] != "finished"] == [13 + 3]
    ranges = rows(tmp_path / "figure_6_ranges.csv")
    assert [row["range"] for row in ranges] == ["probe", "exponent", "predicted", "measured", "published"]
    assert (ranges[-1]["low"], ranges[-1]["high"]) == ("0.176", "0.196")
    (_, lines, network), _ = drawn("figure_6", FigureRuns(TINY))
    assert "1 of 26 cells failed and are left out" in words(lines)
    assert any(np.isnan(line.get_ydata()).any() for line in network.lines)


def test_published_numbers_are_never_used(simulation: Simulation, monkeypatch: pytest.MonkeyPatch) -> None:
    before = load("thresholds").compute("thresholds", FigureRuns(TINY))
    drawn_before = load("figure_8").compute("figure_8", FigureRuns(TINY))
    wrong = tuple(published.Published(r.n, r.omega, ((0.01, 0.02),), "wrong") for r in published.PUBLISHED)
    monkeypatch.setattr(published, "PUBLISHED", wrong)
    after = load("thresholds").compute("thresholds", FigureRuns(TINY))
    assert [(r.measured, r.predicted) for r in after.rows] == [(r.measured, r.predicted) for r in before.rows]
    assert after.rows[0].ranges("published") == ((0.01, 0.02),)
    drawn_after = load("figure_8").compute("figure_8", FigureRuns(TINY))
    assert drawn_after.predicted == drawn_before.predicted
    assert drawn_after.network.intervals == drawn_before.network.intervals
    assert drawn_after.published == ((0.01, 0.02),)


def test_the_published_rows_agree_among_themselves() -> None:
    assert len(published.PUBLISHED) == 7
    for row in published.PUBLISHED:
        (pair,) = (r.intervals for r in published.PUBLISHED if (r.n, r.omega) == (2, row.omega))
        (expected,) = project(scale(list(pair), 2.0), chain(row.n).spectrum, 0.6)
        assert row.intervals[0] == pytest.approx(expected, abs=0.0025)
    for omega in published.NOT_PERIODIC:
        (pair,) = (r.intervals for r in published.PUBLISHED if (r.n, r.omega) == (2, omega))
        assert project(scale(list(pair), 2.0), chain(5).spectrum, 0.6) == []


def test_published_rows_are_found_by_their_chain() -> None:
    assert published.published(4, 1.4).intervals == ((0.153, 0.177),)
    assert published.published(7, 1.55).intervals == ()
    assert published.published(7, 1.15) is None
    assert published.published(3, 1.4) is None


def test_table_of_thresholds(simulation: Simulation, tmp_path: Path) -> None:
    make(["thresholds"], tmp_path)
    table = rows(tmp_path / "thresholds.csv")
    assert [(row["n"], row["omega"]) for row in table] == [
        ("2", "1.15"),
        ("2", "1.4"),
        ("2", "1.55"),
        ("3", "1.15"),
        ("3", "1.55"),
        ("4", "1.15"),
        ("4", "1.4"),
        ("5", "1.4"),
        ("5", "1.55"),
    ]
    first, three, five = table[1], table[4], table[-1]
    assert float(first["measured_high"]) == pytest.approx(0.3)
    assert float(first["measured_minus_published_low"]) == pytest.approx(0.0)
    assert float(three["predicted_minus_published_high"]) == pytest.approx(0.594 / 3 - 0.196, abs=1e-9)
    assert five["measured_low"] == five["predicted_low"] == five["published_low"] == ""
    assert "none predicted, none measured" in five["remark"]
    assert (first["tolerance"], first["starts"], first["transient"]) == ("0.001", "1", "1000")
    text = (tmp_path / "thresholds.md").read_text()
    assert (
        "| 3 | 1.55 | [0.1760, 0.1980] | [0.1760, 0.1980] | [0.1760 ± 0.0024, 0.19800 ± 0.00080] | [0.1760, 0.1960] |"
        in text
    )
    assert "at least half of 1 starts" in text


def test_exponents_are_right_where_the_quick_probe_is_not() -> None:
    """At n = 4, omega = 1.40 the quick probe finds [0.178, 0.179]; averages of 320 000 periods 0.1515 ± 0.0007, 0.1772 ± 0.0001."""
    runs = FigureRuns(QUICK)
    scene = tables_of_thresholds.scene_of(4, 1.4, runs)
    windows = tables_of_thresholds.windows_of(scene, runs)
    ((low, high),), ((low_error, high_error),) = windows.intervals, windows.errors
    assert 0.0 < high_error < low_error < 0.005
    assert abs(low - 0.1515) < 2 * low_error
    assert abs(high - 0.1772) < 2 * high_error


def test_the_table_has_the_windows_of_the_exponents(simulation: Simulation, tmp_path: Path) -> None:
    make(["thresholds"], tmp_path)
    table = rows(tmp_path / "thresholds.csv")
    three = table[4]
    assert (float(three["exponents_low"]), float(three["exponents_high"])) == pytest.approx((0.176, 0.198), abs=1e-4)
    slope = 0.594 - 0.176  # of the parabola that stands in for the exponents
    assert float(three["exponents_low_error"]) == pytest.approx(1e-3 / slope, rel=0.05)
    assert float(three["exponents_high_error"]) == pytest.approx(1e-3 / slope / 3, rel=0.05)
    assert float(three["exponents_minus_published_high"]) == pytest.approx(0.198 - 0.196, abs=1e-4)
    assert table[-1]["exponents_low"] == table[-1]["exponents_low_error"] == ""
    assert three["all_exponents"].startswith("[0.1760")
    (axes, _) = drawn("thresholds", FigureRuns(TINY))
    assert [text.get_text() for text in axes.get_legend().get_texts()] == list(
        ("measured", "predicted", "exponents", "published")
    )


def test_a_row_without_exponents_says_why() -> None:
    row = tables_of_thresholds.ThresholdRow(4, 1.4, (), (), ExponentWindows(absent="no drive"), None, 0, 9)
    assert "exponents not computed: no drive" in row.remark
    data = tables_of_thresholds.Comparison((row,), TINY)
    assert "| none | none | not computed | none |" in tables_of_thresholds.document(data)


def test_the_range_compared_is_the_one_that_shares_most() -> None:
    nearest = tables_of_thresholds.nearest
    intervals = ((0.0, 0.01), (0.1, 0.2), (0.3, 0.6))
    assert nearest(intervals, ((0.12, 0.35),)) == (0.1, 0.2)
    assert nearest(intervals, ()) == (0.3, 0.6)
    assert nearest((), ((0.1, 0.2),)) is None


def test_ragged_ranges_are_joined_over_narrow_gaps_only() -> None:
    intervals = ((0.1, 0.12), (0.1205, 0.13), (0.1309, 0.14), (0.142, 0.15))
    assert tables_of_thresholds.joined(intervals) == ((0.1, 0.14), (0.142, 0.15))
    assert tables_of_thresholds.joined(intervals, 0.0) == intervals
    assert tables_of_thresholds.joined(()) == ()
    row = tables_of_thresholds.ThresholdRow(4, 1.4, intervals, (), ExponentWindows(), published.published(4, 1.4), 0, 9)
    assert "2 narrow gaps bridged; 1 more range measured" in row.remark


def test_failed_values_of_sigma_are_said_in_the_table(simulation: Simulation, tmp_path: Path) -> None:
    simulation.failed = (1, 2)
    make(["thresholds"], tmp_path)
    table = rows(tmp_path / "thresholds.csv")
    assert [row["status"] for row in table[2:5]] == ["finished", "2 of 13 failed", "2 of 13 failed"]
    assert "2 of 13 cells failed" in table[4]["remark"]


def test_the_probe_of_a_pair_is_its_own_network(simulation: Simulation) -> None:
    runs = FigureRuns(TINY)
    pair = runs.network(load_scene("figure_4b"))
    assert pair.intervals == ((0.045, 0.3),)
    assert pair.x[-1] == 0.6
    assert simulation.networks == []


def test_longer_and_shorter_transients_are_compared(simulation: Simulation, tmp_path: Path) -> None:
    simulation.failed = (0,)
    make(["transient"], tmp_path)
    table = rows(tmp_path / "transient.csv")
    assert sorted({float(row["transient"]) for row in table}) == [100.0, 300.0, 1000.0, 3000.0]
    assert {(row["n"], row["omega"]) for row in table} == {("2", "1.4"), ("2", "1.55"), ("3", "1.55"), ("4", "1.4")}
    assert sum(row["status"] == "failed" for row in table) == 4 * 4
    ends = [float(row["sigma"]) for row in table if row["n"] == "3" and row["transient"] == "100"]
    assert (ends[0], ends[-1]) == pytest.approx((0.156, 0.216))
    assert {0.176, 0.196} <= set(ends)
