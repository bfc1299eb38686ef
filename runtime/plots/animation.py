"""Animations of a run: masses on a belt or between stops, or oscillators on a graph, next to the phase portrait."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import sympy as sp
from matplotlib.animation import FuncAnimation
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from synchain.models.mechanics.components import TIME
from synchain.models.mechanics.contact import ContactModel
from synchain.models.mechanics.events import Event
from synchain.models.mechanics.rows import Law, Row
from synchain.models.scenes.scene import Scene

from ..results.result import Result
from .graph_picture import draw_graph
from .result_plot import CYCLE, node_states, symbols
from .style import BLACK, BLUE, GREY, ORANGE

LARGEST = 200  # largest number of oscillators on a graph that an animation shows
ROW = 12  # largest number of masses in a row on a belt; more oscillators are drawn as nodes of a graph
TRAIL = 0.12  # length of the trail of each point of the phase portrait, as a fraction of the shown time
REACH = 0.3  # largest displacement of a drawn mass, as a fraction of the distance between two masses
STICK = 1e-3  # a mass sticks if its sliding speed is at most this fraction of the largest sliding speed
FLASH = 3  # number of frames in which a mass has a red edge after an impact
WALL = 0.07  # width of a drawn stop
RED = "#c1121f"

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
    colours = np.array([[CYCLE[i % len(CYCLE)] for i in range(scene.n)]] * len(time))
    floor = None if scene.n > ROW else _Floor.of(scene, data, time, v)
    if floor is None:
        update_left = _graph(left, scene, x, symbols(first))
    else:
        colours = np.where(floor.held, ORANGE, BLUE).T
        update_left = _row(left, scene, time, x, floor, colours)
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


@dataclass(frozen=True, slots=True)
class _Floor:
    """What masses in a row move on: belts and walls, and the frames in which they are held or hit."""

    # Shapes: held, hit and each belt (n, frames).

    belt: np.ndarray | None  # velocity under each mass; None without contacts
    walls: tuple[tuple[int, float, np.ndarray], ...]  # node, side (1: the mass is to the right), place in each frame
    held: np.ndarray
    hit: np.ndarray

    @classmethod
    def of(cls, scene: Scene, data: Any, time: np.ndarray, v: np.ndarray) -> _Floor | None:
        """Return the floor of a cell; None unless all nodes have a contact or a stop of their first coordinate."""
        exact = scene.contact == ContactModel.SET_VALUED or not all(
            k.oscillator.takes_friction for k in scene.model.kinds
        )
        try:
            equations = scene.equations if exact else scene.replace(contact=ContactModel.SET_VALUED).equations
        except ValueError:  # a law that does not jump
            return None
        if equations.joined or not equations.sticks or any(len(node.continuous) < 2 for node in equations.nodes):
            return None
        cell = {name: float(data[name]) for name in scene.parameters if name in data.coords}
        values = {sp.Symbol(name, real=True): sp.Float(e) for name, e in {**scene.parameters, **cell}.items()}
        belts, walls = [], []
        for i in range(scene.n):
            # the first coordinate, and its velocity behind all coordinates
            place, speed = (equations.symbols(i)[k] for k in (0, len(equations.node_at(i).continuous) // 2))
            rows: tuple[Event | Row, ...] = (*equations.events_at(i), *equations.rows_at(i))
            for row in rows:
                law = getattr(row, "law", Law.SIGN)
                s = {Law.SIGN: speed, Law.STOP: place}.get(law)
                slope = sp.S.Zero if s is None else row.level.diff(s).xreplace(values)
                if slope == 0 or not slope.is_number:
                    continue
                # the velocity of the ground, or the place of the stop, at which the level is zero
                zero = (-row.level.xreplace({s: sp.S.Zero}) / slope).xreplace(values)
                if zero.free_symbols - {TIME}:
                    continue  # other states stand in the level
                at = np.broadcast_to(np.asarray(sp.lambdify(TIME, zero, "numpy")(time), dtype=float), time.shape)
                if law is Law.SIGN:
                    belts.append((i, at))
                else:
                    walls.append((i, float(sp.sign(slope)), at))
        if {i for i, *_ in (*belts, *walls)} != set(range(scene.n)):
            return None
        belt = np.array([dict(belts)[i] for i in range(scene.n)]) if len(dict(belts)) == scene.n else None
        return cls(belt, tuple(walls), _held(scene, data, time, v, belt), _hits(scene, data, time))


def _held(scene: Scene, data: Any, time: np.ndarray, v: np.ndarray, belt: np.ndarray | None) -> np.ndarray:
    """Return the frames (n, frames) in which a mode is 0; without modes those in which a mass moves with the belt."""
    modes = sorted(scene.equations.modes)
    if modes:
        frames = np.clip(np.searchsorted(data.time.values, time), 0, data.sizes["sample"] - 1)
        samples = data.trajectory.transpose("component", "node", "sample").sel(component=modes).values[..., frames]
        return np.asarray((samples == 0.0).any(axis=0))
    sliding = np.abs(v - belt)
    return np.asarray(sliding <= STICK * sliding.max())


def _hits(scene: Scene, data: Any, time: np.ndarray) -> np.ndarray:
    """Return the frames (n, frames) that follow an impact that was recorded."""
    hit = np.zeros((scene.n, len(time)), dtype=bool)
    if "event_impacts" not in data:
        return hit
    struck = data.event_before.values == 1.0
    laws = [[getattr(row, "law", Law.SIGN) for row in scene.equations.node_at(i).conditions] for i in range(scene.n)]
    for at, node, row in zip(*(data[f"event_{name}"].values[struck] for name in ("time", "node", "row")), strict=True):
        if laws[int(node) - 1][int(row) - 1] is Law.STOP:
            first = int(np.searchsorted(time, at))
            hit[int(node) - 1, first : first + FLASH] = True
    return hit


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


def _row(axes: Axes, scene: Scene, time: np.ndarray, x: np.ndarray, floor: _Floor, colours: np.ndarray) -> Update:
    """Draw masses in a row, with colours (frames, n): their belt or rail, their stops, and springs between linked ones."""
    n, side = len(x), 0.34
    scale = REACH / (max(np.abs(x).max(), *(np.abs(at).max() for _, _, at in floor.walls), 0.0) or 1.0)
    centre = np.arange(n)[:, None] + scale * x  # (n, frames)
    low, high, spacing = -0.8, n - 0.2, 0.25
    axes.plot([low, high], [0.0, 0.0], color=BLACK, linewidth=2.0, zorder=1)
    marks, moved = None, np.zeros(len(time))
    if floor.belt is not None:
        # the belt: its two sides, rollers, and marks that move with it
        axes.plot([low, high], [-0.3, -0.3], color=BLACK, linewidth=2.0, zorder=1)
        for end in (low, high):
            axes.add_patch(Circle((end, -0.15), 0.15, facecolor=GREY, edgecolor=BLACK, linewidth=1.5, zorder=0))
        marks = axes.vlines(np.arange(low, high, spacing), -0.07, 0.0, color=BLACK, linewidth=1.0)
        speed = floor.belt[0]
        moved = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))])
    walls = []
    for i, open_side, at in floor.walls:
        edges = i + scale * at - 0.5 * side * open_side  # where the mass touches the wall
        wall = Rectangle((0.0, 0.0), WALL, 1.5 * side, facecolor=GREY, edgecolor=BLACK, hatch="////", zorder=2)
        axes.add_patch(wall)
        walls.append((wall, edges - WALL * (open_side > 0.0)))
    masses = [Rectangle((0.0, 0.0), side, side, zorder=3) for _ in range(n)]
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
    words = ["orange: held"] + (["red edge: impact"] if floor.hit.any() else [])
    axes.set_title(", ".join(words), loc="right", fontsize="medium", color=ORANGE)

    def update(frame: int) -> None:
        if marks is not None:
            start = low + (scale * moved[frame]) % spacing
            marks.set_segments([[(a, -0.07), (a, 0.0)] for a in np.arange(start, high, spacing)])
        for wall, places in walls:
            wall.set_xy((places[frame], 0.0))
        for i, mass in enumerate(masses):
            mass.set_xy((centre[i, frame] - 0.5 * side, 0.0))
            mass.set_facecolor(colours[frame, i])
            mass.set_edgecolor(RED if floor.hit[i, frame] else BLACK)
            mass.set_linewidth(4.0 if floor.hit[i, frame] else 1.0)
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
