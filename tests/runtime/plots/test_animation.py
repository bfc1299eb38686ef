"""Animations show the states of the run at their times."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

from synchain import Scene
from synchain.graphs import chain, ring
from synchain.runtime.plots.style import BLUE, ORANGE
from synchain.runtime.sweeps.run import run


@pytest.fixture(autouse=True)
def closed() -> Iterator[None]:
    yield
    plt.close("all")


def test_masses_ride_on_the_belt_where_they_stick(tmp_path: Path) -> None:
    scene = Scene("friction", "spring", chain(2), record=("trajectory",), samples=400, contact="set-valued",
                  transient=0, window=2, initial={"x": [0.3, 0.1]}, parameters={"sigma": 0.1})  # fmt: skip
    result = run(scene, show_progress=False, width=1)
    motion = result.animate(seconds=1, fps=10)
    belt, portrait = motion.figure.axes
    x, v = (result.trajectory.sel(component=name).values for name in "xv")
    colours = set()
    for frame, t in enumerate(np.linspace(*result.time.values[[0, -1]], 10)):
        motion._draw_frame(frame)
        k = int(np.searchsorted(result.time.values, t))
        np.testing.assert_allclose(portrait.collections[0].get_offsets(), np.stack([x[k], v[k]], axis=1))
        masses = [patch for patch in belt.patches if hasattr(patch, "get_xy")]
        distance = masses[1].get_x() - masses[0].get_x()
        assert distance == pytest.approx(1.0 + 0.3 / abs(x).max() * (x[k, 1] - x[k, 0]), abs=0.05)
        colours |= {plt.matplotlib.colors.to_hex(mass.get_facecolor()).upper() for mass in masses}
    assert colours == {BLUE.upper(), ORANGE.upper()}
    motion.save(tmp_path / "belt.gif", writer="pillow", dpi=30)
    assert (tmp_path / "belt.gif").stat().st_size > 1000


def test_oscillators_without_friction_are_nodes_of_their_graph() -> None:
    scene = Scene("harmonic", "spring", ring(4), record=("trajectory",), samples=100, transient=0, window=1)
    result = run(scene, show_progress=False, width=1)
    motion = result.animate(seconds=1, fps=5)
    motion._draw_frame(4)
    nodes = motion.figure.axes[0].collections[-1]
    np.testing.assert_allclose(nodes.get_array(), result.trajectory.sel(component="x").values[-1])
    assert "<script" in motion._repr_html_()
    assert not plt.get_fignums()


def test_a_run_without_a_trajectory_is_refused() -> None:
    result = run(Scene("harmonic", "spring", chain(2), record=(), transient=0, window=1), show_progress=False, width=1)
    with pytest.raises(
        ValueError, match=r"animate: found no trajectory; record it: Scene\(…, record=\['trajectory'\]\)"
    ):
        result.animate()


def test_an_ending_that_no_writer_has_is_refused_before_frames_are_drawn(tmp_path: Path) -> None:
    scene = Scene("harmonic", "spring", chain(2), record=("trajectory",), samples=9, transient=0, window=1)
    motion = run(scene, show_progress=False, width=1).animate(seconds=1, fps=2)
    with pytest.raises(ValueError, match=r"save: found the ending '.txt'; expected .gif, .mp4, .webm or .mov"):
        motion.save(tmp_path / "motion.txt")
    motion._draw_was_started = True
