"""Results draw themselves with hvPlot, by the axes that they are labelled with."""

from __future__ import annotations

from pathlib import Path

import pytest

from synchain import Scene, run

hvplot = pytest.importorskip("hvplot.xarray")


def test_a_trajectory_becomes_a_page_with_its_scripts(tmp_path: Path) -> None:
    import hvplot as plots

    result = run(Scene("harmonic", record=("trajectory",), transient=0, window=6, samples=20), show_progress=False)
    picture = result.trajectory.sel(component="x").hvplot.line(x="sample", by="node")
    assert [dimension.name for dimension in picture.dimensions()][:2] == ["node", "sample"]
    plots.save(picture, tmp_path / "x.html", resources="inline")
    assert (tmp_path / "x.html").stat().st_size > 1_000_000  # the scripts are in the file
