"""Animations of a run: masses on a moving belt, or oscillators on a graph, next to the phase portrait."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.animation import FuncAnimation
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from synchain.models.mechanics.contact import ContactModel
from synchain.models.scenes.scene import Scene

from ..results.result import Result
from .graph_picture import draw_graph
from .result_plot import CYCLE, node_states, symbols
from .style import BLACK, BLUE, GREY, ORANGE

LARGEST = 200
"""Largest number of oscillators on a graph that an animation shows."""
ROW = 12
"""Largest number of masses in a row on a belt; more oscillators are drawn as nodes of a graph."""
TRAIL = 0.12
"""Length of the trail of each point of the phase portrait, as a fraction of the shown time."""
REACH = 0.3
"""Largest displacement of a drawn mass, as a fraction of the distance between two masses."""
STICK = 1e-3
"""A mass sticks if its sliding speed is at most this fraction of the largest sliding speed."""

Update = Callable[[int], None]


class Animation(FuncAnimation):
    """An animation that a notebook plays; `save("motion.gif")` writes it, `plt.show()` shows it in a window."""

    figure: Figure

    def save(self, filename: str | Path, writer: Any = None, *more: Any, **options: Any) -> None:
        """Write a GIF file (Pillow), or a film (ffmpeg)."""
        ending = Path(filename).suffix.lower()
        if writer is None and ending not in (".gif", ".mp4", ".webm", ".mov"):
            raise ValueError(f"save: found the ending {ending!r}; expected .gif, .mp4, .webm or .mov")
        super().save(filename, writer or ("pillow" if ending == ".gif" else "ffmpeg"), *more, **options)

    def _repr_html_(self) -> str:
        plt.close(self.figure)  # otherwise the notebook also shows the first frame
        return str(self.to_jshtml(default_mode="loop"))


def animate(result: Result, seconds: float, fps: int) -> Animation:
    """Return the animation of the first cell of a result with a trajectory."""
    if "trajectory" not in result.data:
        raise ValueError("animate: found no trajectory; record it: Scene(…, record=['trajectory'])")
    if not seconds > 0.0 or fps < 1:
        raise ValueError(f"animate: found {seconds} seconds at {fps} frames a second; expected at least one frame")
    scene = result.scene
    if scene.n > LARGEST:
        raise ValueError(
            f"animate: found {scene.n} oscillators; expected at most {LARGEST}; plot(kind='space') shows more"
        )
    data = result.data.isel({name: 0 for name in result.data.status.dims})
    first, second = (node_states(data.trajectory, result, k) for k in (0, 1))
    path, speed, samples = first.values.T, second.values.T, data.time.values  # (n, samples), samples of time
    # states (n, frames) at equal time intervals
    time = np.linspace(samples[0], samples[-1], max(2, round(seconds * fps)))
    x, v = (np.array([np.interp(time, samples, row) for row in rows]) for rows in (path, speed))

    figure, (left, right) = plt.subplots(1, 2, figsize=(9.6, 4.0), width_ratios=(3, 2), layout="constrained")
    ground = _belt_speeds(scene, {name: float(data[name]) for name in scene.parameters if name in data.coords})
    if ground is None or scene.n > ROW:
        update_left = _graph(left, scene, x, symbols(first))
        colours = np.array([[CYCLE[i % len(CYCLE)] for i in range(scene.n)]] * len(time))
    else:
        sliding = np.abs(v - ground[:, None])
        colours = np.where(sliding <= STICK * sliding.max(), ORANGE, BLUE).T
        update_left = _belt(left, scene, time, x, ground, colours)
    trail = max(1, round(TRAIL * len(samples)))
    update_right = _portrait(right, path, speed, np.searchsorted(samples, time), trail, colours)
    right.set(xlabel=symbols(first), ylabel=symbols(second))
    clock = left.set_title("", loc="left", fontsize="medium")

    def update(frame: int) -> list[Any]:
        update_left(frame)
        update_right(frame)
        clock.set_text(rf"$t = {time[frame]:.1f}$")
        return []

    motion = Animation(figure, update, frames=len(time), interval=1000.0 / fps, blit=False)
    motion.figure = figure
    return motion


def _belt_speeds(scene: Scene, cell: dict[str, float]) -> np.ndarray | None:
    """Return the velocity of the ground of each oscillator (n,); None unless all have friction with a ground."""
    if not all(kind.oscillator.takes_friction for kind in scene.model.kinds):
        return None
    try:
        equations = scene.replace(contact=ContactModel.SET_VALUED).equations
    except ValueError:  # several coordinates, or a ground that accelerates
        return None
    values = {**scene.parameters, **cell}
    if equations.has_rows:
        return None
    targets = [node.events[0].target for node in equations.nodes]
    speeds = [float(target.subs({s: values[s.name] for s in target.free_symbols})) for target in targets]
    return np.array([speeds[kind] for kind in equations.kind_of])


def _portrait(axes: Axes, x: np.ndarray, v: np.ndarray, ends: np.ndarray, trail: int, colours: np.ndarray) -> Update:
    """Draw paths (n, samples) in grey, and moving points with colours (frames, n) and a trail of `trail` samples."""
    axes.plot(x.T, v.T, color=GREY, linewidth=0.6, zorder=1)
    trails = [axes.plot([], [], color=colour, linewidth=1.2)[0] for colour in colours[0]]
    points = axes.scatter(x[:, 0], v[:, 0], c=colours[0], s=28.0, zorder=3)

    def update(frame: int) -> None:
        end = int(ends[frame]) + 1
        for line, across, up, colour in zip(trails, x, v, colours[frame], strict=True):
            line.set_data(across[max(0, end - trail) : end], up[max(0, end - trail) : end])
            line.set_color(colour)
        points.set_offsets(np.stack([x[:, end - 1], v[:, end - 1]], axis=1))
        points.set_color(colours[frame])

    return update


def _graph(axes: Axes, scene: Scene, x: np.ndarray, label: str) -> Update:
    """Draw the graph with nodes coloured by their first state."""
    draw_graph(scene.topology, axes, x[:, 0], vmin=float(x.min()), vmax=float(x.max()), cmap="coolwarm")
    nodes = axes.collections[-1]
    axes.figure.axes[-1].set_ylabel(label)
    return lambda frame: nodes.set_array(x[:, frame])


def _belt(axes: Axes, scene: Scene, time: np.ndarray, x: np.ndarray, ground: np.ndarray, colours: np.ndarray) -> Update:
    """Draw masses in a row on a belt, with colours (frames, n), and springs between linked ones."""
    n, side = len(x), 0.34
    scale = REACH / (np.abs(x).max() or 1.0)
    centre = np.arange(n)[:, None] + scale * x  # (n, frames)
    # the belt: its two sides, rollers, and marks that move with it
    low, high = -0.8, n - 0.2
    for y in (0.0, -0.3):
        axes.plot([low, high], [y, y], color=BLACK, linewidth=2.0, zorder=1)
    for end in (low, high):
        axes.add_patch(Circle((end, -0.15), 0.15, facecolor=GREY, edgecolor=BLACK, linewidth=1.5, zorder=0))
    spacing = 0.25
    marks = axes.vlines(np.arange(low, high, spacing), -0.07, 0.0, color=BLACK, linewidth=1.0)
    masses = [Rectangle((0.0, 0.0), side, side, edgecolor=BLACK, linewidth=1.0, zorder=3) for _ in range(n)]
    for mass in masses:
        axes.add_patch(mass)
    labels = [
        axes.text(0.0, 0.5 * side, str(label), ha="center", va="center", color="white", zorder=4)
        for label in scene.topology.labels
    ]
    pairs = sorted({(min(i, j), max(i, j)) for i, j, _ in scene.topology.links})
    springs = [axes.plot([], [], color="0.35", linewidth=1.0, zorder=2)[0] for _ in pairs]
    axes.set(
        xlim=(low - 0.3, high + 0.3),
        ylim=(-0.5, 0.9 + 0.25 * max((j - i for i, j in pairs), default=0)),
        aspect="equal",
    )
    axes.set_axis_off()
    axes.set_title("orange: sticks to the belt", loc="right", fontsize="medium", color=ORANGE)

    def update(frame: int) -> None:
        start = low + (scale * ground[0] * time[frame]) % spacing
        at = np.arange(start, high, spacing)
        marks.set_segments([[(a, -0.07), (a, 0.0)] for a in at])
        for i, mass in enumerate(masses):
            mass.set_xy((centre[i, frame] - 0.5 * side, 0.0))
            mass.set_facecolor(colours[frame, i])
            labels[i].set_position((centre[i, frame], 0.5 * side))
        for spring, (i, j) in zip(springs, pairs, strict=True):
            spring.set_data(*_spring(centre[i, frame], centre[j, frame], side, j - i))

    return update


def _spring(a: float, b: float, side: float, apart: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a zigzag between two neighbours, or an arc over the masses between two distant masses."""
    if apart == 1:
        s = np.linspace(0.0, 1.0, 26)
        wave = np.where((s > 0.15) & (s < 0.85), np.where(np.arange(26) % 2, 0.07, -0.07), 0.0)
        return a + 0.5 * side + s * (b - a - side), 0.5 * side + wave
    s = np.linspace(0.0, np.pi, 60)
    wave = 0.05 * np.sin(40.0 * s) * (np.sin(s) > 0.3)
    return 0.5 * (a + b) - 0.5 * (b - a) * np.cos(s), side + (0.25 * apart) * np.sin(s) + wave
