"""The skeleton of the bifurcation diagram of figure 3: periodic orbits and their bifurcations.

Motion and orbits are computed with set-valued friction. The range of frequencies starts below the range of the paper,
where the motion is periodic. Each orbit is drawn at its crossings of the section of figure 3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from synchain.models.scenes.file import load_scene
from synchain.models.scenes.scene import Scene
from synchain.models.sweeps.axis import Axis

from ..bifurcation.kinds import BifurcationKind
from ..bifurcation.periodic_result import PeriodicOrbit
from ..bifurcation.results import Branch
from ..bifurcation.skeleton import skeleton
from ..plots.branch_marks import MARK, MARKERS, STABLE, UNSTABLE
from ..plots.csv_table import as_csv
from ..plots.style import BLACK, BLUE, COLUMN, ORANGE, PURPLE
from ..results.result import Result
from ..sweeps.run import run
from .bifurcation_figure import points
from .figure_runs import FigureRuns

EXTRA = ("skeleton",)
SIZE = (COLUMN, 3.3)
LOW, HIGH = 1.0, 1.9  # lowest and highest frequency of the diagram
PERIODS = (1, 2, 4)
COLOURS = {1: PURPLE, 2: ORANGE, 4: BLUE}
CLOUD = "#b4b4b4"
# Magnified part of the diagram (ranges of frequency and position), and the rectangle of its inset in the axes.
CROWDED, INSET = ((1.443, 1.484), (0.585, 0.611)), (0.11, 0.08, 0.36, 0.35)
SAME = 1e-9  # bifurcations of one kind that two branches find within this distance of omega are one bifurcation
# Number of values of omega for the motion, for the continuation of orbits, and for the search of orbits.
FULL = (901, 121, 16)


@dataclass(frozen=True, slots=True)
class BranchPoint:
    """An orbit of a branch, or the orbit at one of its bifurcations."""

    value: float  # value of the parameter
    orbit: PeriodicOrbit
    x: np.ndarray  # (k,): positions at the section
    phases: str = ""  # sequence of stick and slip as text
    kind: BifurcationKind | None = None  # kind of a bifurcation at this orbit
    residual: float = 0.0  # residual of the bifurcation


class SkeletonFigure(NamedTuple):
    motion: Result  # section points over omega
    branches: tuple[tuple[BranchPoint, ...], ...]  # points of each branch in its order


def compute(name: str, runs: FigureRuns) -> SkeletonFigure:
    """Run the scene of figure 3 with set-valued friction and find its skeleton."""
    scene = load_scene("figure_3").replace(contact="set-valued")
    cloud, values, searched = FULL
    if (grid := runs.quality.grid) is not None:
        values, searched = max(3, (grid + 1) // 3), max(1, grid // 12)
    omegas = np.linspace(LOW, HIGH, values)
    branches = skeleton(
        scene.replace(axes=()),
        "omega",
        omegas,
        PERIODS,
        searched,
        show_progress=runs.execution.show_progress,
        progress=runs.execution.progress,
    )
    motion = runs.run(scene.replace(axes=(Axis.between("omega", LOW, HIGH, cloud),)))
    return SkeletonFigure(motion, tuple(_branch_points(scene, branch, omegas) for branch in branches))


def _branch_points(scene: Scene, branch: Branch, values: np.ndarray) -> tuple[BranchPoint, ...]:
    """Return the orbits of a branch and at its bifurcations, with their points at the section."""
    # Orbits at the values of the diagram and bifurcations, in the order of the branch.
    orbits = [
        (length, BranchPoint(float(value), orbit, np.empty(0), phases.words))
        for length, value, orbit in zip(branch.lengths, branch.values, branch.orbits, strict=True)
        if value in values and (phases := orbit.phases) is not None
    ]
    turns = [
        (t.length, BranchPoint(t.value, t.orbit, np.empty(0), "", t.kind, t.residual)) for t in branch.bifurcations
    ]
    branch_points = [point for _, point in sorted([*orbits, *turns], key=lambda pair: pair[0])]
    # Run two of the longest cycles and keep the first half of the crossings, so that a crossing at the start of the
    # run counts once.
    states = np.array([point.orbit.state for point in branch_points])
    starts = {
        branch.name: [point.orbit.scene.parameters[branch.name] for point in branch_points],
        "x_1": states[:, 0].tolist(),
        "v_1": states[:, 1].tolist(),
    }
    twice = scene.replace(
        axes=tuple(Axis(key, values) for key, values in starts.items()),
        zipped=True,
        transient=0.0,
        window=2.0 * max(point.orbit.periods for point in branch_points),
        rtol=1e-11,
    )
    result = run(twice, show_progress=False)
    counts = (result.section_count.values.astype(int) + 1) // 2
    crossings = result.section.sel(component="x", node=1).values
    return tuple(replace(p, x=x[:count]) for p, x, count in zip(branch_points, crossings, counts, strict=True))


def _periods(branch: tuple[BranchPoint, ...]) -> int:
    """Return the number of drive periods of the orbits of a branch; an orbit from which it bifurcates has fewer."""
    return max(point.orbit.periods for point in branch)


def texts(data: SkeletonFigure) -> dict[str, str]:
    """Return all orbits by their crossings of the section, and all bifurcations as CSV and Markdown."""
    orbits: list[tuple[object, ...]] = []
    turns: list[tuple[int, int, BifurcationKind, float, float, float]] = []
    for number, branch in enumerate(data.branches):
        for point in branch:
            orbit = point.orbit
            if point.kind is not None:
                lowest = min(point.x, default=math.nan)
                turns.append((number, orbit.periods, point.kind, point.value, point.residual, lowest))
                continue
            multiplier = complex(orbit.multipliers[0])
            for x in point.x:
                numbers = (multiplier.real, multiplier.imag, orbit.residual)
                orbits.append((number, orbit.periods, point.value, x, *numbers, point.phases))
    # In Markdown a bifurcation that two branches share is listed once.
    lines = ["| ω | drive periods | kind | residual |", "|---|---|---|---|"]
    last_kind, last_value = None, math.nan
    for _, periods, kind, value, residual, _ in sorted(turns, key=lambda turn: turn[3]):
        if kind != last_kind or not abs(value - last_value) < SAME:
            lines.append(f"| {value:.10f} | {periods} | {kind} | {residual:.0e} |")
        last_kind, last_value = kind, value
    columns = ("branch", "periods", "omega", "x_1", "multiplier_re", "multiplier_im", "residual", "phases")
    return {
        ".csv": as_csv(columns, orbits),
        "_ranges.csv": as_csv(("branch", "periods", "kind", "omega", "residual", "x_1"), turns),
        ".md": "\n".join(lines) + "\n",
    }


def draw(figure: Figure, data: SkeletonFigure) -> Axes:
    """Draw the motion as grey dots, stable orbits as lines, unstable ones dashed."""
    axes = figure.add_subplot()
    _draw_diagram(axes, data, 0.9)
    axes.set(xlim=(LOW, HIGH), xlabel=r"drive frequency $\omega$", ylabel=r"$\chi_1$ at the section")
    if CROWDED[0][0] > LOW and CROWDED[0][1] < HIGH:
        inset = axes.inset_axes(INSET)
        _draw_diagram(inset, data, 1.6)
        inset.set(xlim=CROWDED[0], ylim=CROWDED[1])
        inset.tick_params(labelsize=5.5, pad=2)
        inset.locator_params(nbins=3)
        axes.indicate_inset_zoom(inset, edgecolor=BLACK, linewidth=0.5)
    # legend entries only of colours, lines and marks in the drawing
    periods = sorted({_periods(branch) for branch in data.branches})
    kinds = {point.kind for branch in data.branches for point in branch}
    handles = [
        *(Line2D([], [], color=COLOURS.get(n, BLACK), label=f"{n} drive period{'s' * (n > 1)}") for n in periods),
        Line2D([], [], color=BLACK, label="stable", **STABLE),
        Line2D([], [], color=BLACK, label="unstable", **UNSTABLE),
        Line2D([], [], color=CLOUD, marker=".", linestyle="none", label="motion"),
        *(
            Line2D([], [], markeredgecolor=BLACK, marker=marker, label=kind, **MARK)
            for kind, marker in MARKERS.items()
            if kind in kinds
        ),
    ]
    figure.legend(
        handles=handles, loc="outside upper center", ncols=3, handlelength=1.8, columnspacing=1.2, borderpad=0.1
    )
    return axes


def _draw_diagram(axes: Axes, data: SkeletonFigure, size: float) -> None:
    axes.plot(
        *points(data.motion).T,
        linestyle="none",
        marker=".",
        markersize=size,
        color=CLOUD,
        markeredgewidth=0.0,
        rasterized=True,
        zorder=1,
    )
    for branch in data.branches:
        colour = COLOURS.get(_periods(branch), BLACK)
        for stable, line in curves(branch):
            axes.plot(*np.array(line).T, color=colour, zorder=3, **(STABLE if stable else UNSTABLE))
        for point in branch:
            if point.kind is not None:
                omega = np.full(len(point.x), point.value)
                axes.plot(omega, point.x, markeredgecolor=colour, **MARK, marker=MARKERS[point.kind])


def curves(branch: tuple[BranchPoint, ...]) -> list[tuple[bool, list[tuple[float, float]]]]:
    """Cut a branch into curves of crossings, at each change of stability or of the number of crossings."""
    # Each curve is a pair: True if stable, and its points (parameter, position).
    lines: list[tuple[bool, list[tuple[float, float]]]] = []
    crossings, last_stable = branch[0].x, None  # crossings of the last orbit, in the order of the curves
    for before, after in pairwise(branch):
        if len(crossings) != len(after.x):
            crossings, last_stable = after.x, None
            continue
        # Crossings are in the order of time, from an arbitrary one: rotate them to match those of the orbit before.
        shifted = (np.roll(after.x, k) for k in range(len(crossings)))
        ends = min(shifted, key=lambda x: float(np.abs(x - crossings).max()))
        stable = _stable(before, after)
        if stable != last_stable:
            lines += [(stable, [(before.value, float(x))]) for x in crossings]
        for (_, line), x in zip(lines[len(lines) - len(crossings) :], ends, strict=True):
            line.append((after.value, float(x)))
        crossings, last_stable = ends, stable
    return lines


def _stable(before: BranchPoint, after: BranchPoint) -> bool:
    """Return True if the orbits between two points are stable; test a point that is no bifurcation."""
    for point in (before, after):
        if point.kind is None:
            return point.orbit.stable
    return bool(max(abs(point.orbit.multipliers[0]) for point in (before, after)) < 1.0 + SAME)
