"""The skeleton of the bifurcation diagram as a figure: curves, marks and numbers, from a small real one."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from figure_samples import rows

from synchain.runtime.bifurcation.kinds import BifurcationKind
from synchain.runtime.paper import load, names, skeleton_figure
from synchain.runtime.paper import make as maker
from synchain.runtime.paper.figure_runs import FigureRuns, Quality
from synchain.runtime.paper.make import make
from synchain.runtime.paper.skeleton_figure import BranchPoint, SkeletonFigure, curves
from synchain.runtime.plots import style

SMALL = Quality(points=5, grid=9)
DOUBLING = 1.2222040752683
"""Where the motion of two drive periods loses its stability: two stretches of following it agree to 1e-12."""


@pytest.fixture(autouse=True)
def narrow(monkeypatch: pytest.MonkeyPatch) -> None:
    """A range with one bifurcation, orbits of two drive periods alone, and kernels of one width."""
    monkeypatch.setattr(skeleton_figure, "LOW", 1.2)
    monkeypatch.setattr(skeleton_figure, "HIGH", 1.24)
    monkeypatch.setattr(skeleton_figure, "PERIODS", (2,))
    monkeypatch.setattr("synchain.codegen.simd.lanes.native_width", lambda *_: 1)


@cache
def small() -> SkeletonFigure:
    data: SkeletonFigure = load("skeleton").compute("skeleton", FigureRuns(SMALL, workers=1))
    return data


def test_every_kind_of_bifurcation_has_a_mark_of_its_own() -> None:
    assert set(skeleton_figure.MARKERS) == set(BifurcationKind)
    assert len(set(skeleton_figure.MARKERS.values())) == len(BifurcationKind)


def test_it_is_made_when_asked_for() -> None:
    assert "skeleton" not in names()
    assert "skeleton" in names(extra=True)


@pytest.mark.long
def test_the_orbit_runs_through_the_motion_and_beyond() -> None:
    (branch,) = small().branches
    assert [point.kind for point in branch] == [None, None, "period doubling", None]
    assert branch[2].value == pytest.approx(DOUBLING, abs=1e-11)
    cloud = skeleton_figure.points(small().motion)
    for point in (branch[0], branch[-1]):
        nearby = cloud[np.abs(cloud[:, 0] - point.value) < 1e-9, 1]
        assert len(nearby) > 40
        (x,) = point.x
        if point.value < DOUBLING:
            np.testing.assert_allclose(nearby, x, atol=2e-5)  # the motion is this orbit, up to 0.945^150 of the start
        else:
            assert nearby.min() < x - 1e-3 < x + 1e-3 < nearby.max()  # and goes round it


def test_stable_pieces_are_lines_and_unstable_ones_dashed() -> None:
    (branch,) = small().branches
    (stable, before), (unstable, after) = curves(branch)
    assert (stable, unstable) == (True, False)
    assert [value for value, _ in before] == pytest.approx([1.2, 1.22, DOUBLING])
    assert [value for value, _ in after] == pytest.approx([DOUBLING, 1.24])
    with style.context():
        axes = skeleton_figure.draw(style.new_figure(skeleton_figure.SIZE), small())
    styles = {line.get_linestyle() for line in axes.lines}
    assert {"-", "--", "None"} <= styles
    (mark,) = (line for line in axes.lines if line.get_marker() == skeleton_figure.MARKERS["period doubling"])
    np.testing.assert_allclose(mark.get_xdata(), DOUBLING)
    (legend,) = axes.figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [
        "2 drive periods",
        "stable",
        "unstable",
        "motion",
        "period doubling",
    ]


def test_curves_stay_apart_where_crossings_change_places() -> None:
    """Of two crossings that one is first which the period of the drive begins with; the curves go on all the same."""
    (branch,) = small().branches
    pairs = ([0.6, 0.7], [0.71, 0.61], [0.62, 0.72], [0.63])
    lines = curves(tuple(BranchPoint(1.0 + k, branch[0].orbit, np.array(x)) for k, x in enumerate(pairs)))
    assert [[x for _, x in line] for _, line in lines] == [[0.6, 0.61, 0.62], [0.7, 0.71, 0.72]]


def test_files_beside_the_figure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    figure = small()
    monkeypatch.setattr(skeleton_figure, "compute", lambda name, runs: figure)
    monkeypatch.setattr(maker, "QUICK", SMALL)
    written = make(["skeleton"], tmp_path, quick=True)
    assert {path.name for path in written} == {
        "skeleton.csv",
        "skeleton_ranges.csv",
        "skeleton.md",
        "skeleton.png",
        "skeleton.svg",
    }
    orbits = rows(tmp_path / "skeleton.csv")
    assert [row["omega"] for row in orbits] == ["1.2", "1.22", "1.24"]
    assert [abs(float(row["multiplier_re"])) < 1.0 for row in orbits] == [True, True, False]
    assert {row["phases"] for row in orbits} == {"stick, slip +"}
    assert all(float(row["residual"]) < 1e-13 for row in orbits)
    (found,) = rows(tmp_path / "skeleton_ranges.csv")
    assert (found["periods"], found["kind"]) == ("2", "period doubling")
    assert float(found["omega"]) == pytest.approx(DOUBLING, abs=1e-11)
    assert "| 1.2222040753 | 2 | period doubling |" in (tmp_path / "skeleton.md").read_text()
