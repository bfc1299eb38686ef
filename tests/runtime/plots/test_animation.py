"""Animations show the states of the run at their times."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
import sympy as sp
from matplotlib.patches import Rectangle

import synchain as sc
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


def test_stops_are_walls_and_impacts_mark_their_mass() -> None:
    """A mass between a stop that moves and one that rests touches each of them at its impacts."""
    x, v, t = sp.symbols("x v t")
    stops = [sc.Stop(sp.Rational(1, 2) - x, 0.7), sc.Stop(x + sp.Rational(1, 2) - sp.sin(2 * t) / 10, 0.7)]
    body = sc.Lagrangian(v**2 / 2, 0, coordinates={x: v}, initial={x: 0, v: 1}, events=stops)
    scene = Scene(
        body, None, chain(1), record=("trajectory", "events"), samples=2001, transient=0, window=4, time_unit="time"
    )
    result = run(scene, show_progress=False, width=1)
    motion = result.animate(seconds=2, fps=100)
    mass, walls = None, []
    time, red, places = np.linspace(0.0, 4.0, 200), [], []
    for frame in range(len(time)):
        motion._draw_frame(frame)
        *walls, mass = (patch for patch in motion.figure.axes[0].patches if isinstance(patch, Rectangle))
        red.append(mass.get_linewidth() > 2.0)
        right, left = sorted(walls, key=lambda wall: -wall.get_x())
        places.append((mass.get_x() - left.get_x() - left.get_width(), right.get_x() - mass.get_x() - mass.get_width()))
    gaps = np.array(places)
    assert (gaps > -1e-3).all()
    assert gaps.min(axis=0) == pytest.approx(0.0, abs=0.02)
    impacts = result.event_time.values
    expected = [any(0.0 <= now - at < 3.1 * (time[1] - time[0]) for at in impacts) for now in time]
    assert np.mean(np.array(red) == np.array(expected)) > 0.97
    assert 3 <= sum(red) <= 3 * len(impacts)


def test_held_masses_on_a_belt_beside_a_stop_are_orange() -> None:
    x, v = sp.symbols("x v")
    slider = sc.Lagrangian(v**2 / 2, x**2 / 2, coordinates={x: v}, friction="coulomb", contact="set-valued",
                           initial={x: 0.5}, events=[sc.Friction(sp.Rational(1, 5) - v), sc.Stop(x + 1)])  # fmt: skip
    scene = Scene(
        slider, "spring", chain(2), record=("trajectory",), transient=0, window=9, time_unit="time", samples=300
    )
    result = run(scene, show_progress=False, width=1)
    motion = result.animate(seconds=1, fps=30)
    slip = result.trajectory.sel(component="slip").values
    for frame, t in enumerate(np.linspace(0.0, 9.0, 30)):
        motion._draw_frame(frame)
        *_, one, two = (patch for patch in motion.figure.axes[0].patches if isinstance(patch, Rectangle))
        k = min(int(np.searchsorted(result.time.values, t)), 299)
        shown = [plt.matplotlib.colors.to_hex(mass.get_facecolor()).upper() == ORANGE.upper() for mass in (one, two)]
        assert shown == list(slip[k] == 0.0)
    assert 0 < (slip == 0.0).sum() < slip.size


def test_nodes_without_a_place_are_nodes_of_their_graph() -> None:
    neuron = sc.Field({"V": "3/2 - V"}, events=[sc.Reset("V - 1", {"V": 0})])
    relay = sc.Field({"x": "y", "y": "-sign(x + y)"}, contact="set-valued")
    for node in (neuron, relay):
        scene = Scene(node, None, chain(1), record=("trajectory", "events"), transient=0, window=2, time_unit="time")
        motion = run(scene, show_progress=False, width=1).animate(seconds=1, fps=2)
        motion._draw_frame(1)
        assert not motion.figure.axes[0].patches


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
