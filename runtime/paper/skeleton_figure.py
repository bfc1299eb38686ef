"""The skeleton of the bifurcation diagram of figure 3: periodic orbits and their bifurcations.

Motion and orbits are those of set-valued friction, over a range of frequencies that starts below
that of the paper, where the motion is periodic. Each orbit is drawn at its crossings of the section
of figure 3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from synchain.models.scenes.file import load_scene
from synchain.models.scenes.scene import Scene
from synchain.models.sweeps.axis import Axis

from ..bifurcation.bifurcations import BifurcationKind
from ..bifurcation.branches import Branch
from ..bifurcation.periodic import PeriodicOrbit
from ..bifurcation.skeleton import skeleton
from ..plots.branch_marks import MARK, MARKERS, STABLE, UNSTABLE
from ..plots.csv_table import Table
from ..plots.style import BLACK, BLUE, COLUMN, ORANGE, PURPLE
from ..sweeps.run import run
from .bifurcation_figure import Diagram, points
from .figure_runs import FigureRuns

EXTRA = ("skeleton",)
SIZE = (COLUMN, 3.3)
LOW, HIGH = 1.0, 1.9
PERIODS = (1, 2, 4)
COLOURS = {1: PURPLE, 2: ORANGE, 4: BLUE}
CLOUD = "#b4b4b4"
CROWDED, INSET = ((1.443, 1.484), (0.585, 0.611)), (0.11, 0.08, 0.36, 0.35)
"""Magnified part of the diagram, and the position of its inset."""
SAME = 1e-9
"""Largest distance of two bifurcations of one kind that are one, seen from both branches."""
FULL = (901, 121, 16)
"""Number of values of omega for the motion, for following orbits and for their search."""


@dataclass(frozen=True, slots=True)
class Place:
    """An orbit of a branch."""

    value: float  # value of the parameter
    orbit: PeriodicOrbit
    x: np.ndarray  # (k,): positions at the section
    phases: str = ""  # phases of stick and slip in words
    kind: BifurcationKind | None = None  # kind of a bifurcation at this orbit
    residual: float = 0.0  # residual of the bifurcation


@dataclass(frozen=True, slots=True)
class SkeletonFigure:
    """Bifurcation diagram with the branches of orbits."""

    diagram: Diagram  # motion
    branches: tuple[tuple[Place, ...], ...]  # orbits of each branch in the order of the parameter


def compute(name: str, runs: FigureRuns) -> SkeletonFigure:
    """Run the scene of figure 3 with set-valued friction and find its skeleton."""
    scene = load_scene("figure_3").replace(contact="set-valued")
    cloud, values, looks = FULL
    grid = runs.quality.grid
    values, looks = (values, looks) if grid is None else (max(3, (grid + 1) // 3), max(1, grid // 12))
    swept = scene.replace(axes=(Axis.between("omega", LOW, HIGH, cloud),))
    found = skeleton(
        scene.replace(axes=()),
        "omega",
        np.linspace(LOW, HIGH, values),
        PERIODS,
        looks,
        show_progress=runs.execution.show_progress,
        progress=runs.execution.progress,
    )
    return SkeletonFigure(Diagram(runs.run(swept), "omega", ()), tuple(_placed(scene, branch) for branch in found))


def _placed(scene: Scene, branch: Branch) -> tuple[Place, ...]:
    """Orbits of a branch and at its bifurcations, with their points at the section."""
    found = [
        Place(float(value), orbit, np.empty(0), phases.words)
        for value, orbit, phases in zip(branch.values, branch.orbits, branch.phases, strict=True)
    ]
    found += [Place(each.value, each.orbit, np.empty(0), "", each.kind, each.residual) for each in branch.bifurcations]
    found.sort(key=lambda place: place.value)
    crossed = _crossings(scene, branch.name, [place.orbit for place in found])
    return tuple(replace(place, x=x) for place, x in zip(found, crossed, strict=True))


def _crossings(scene: Scene, name: str, orbits: list[PeriodicOrbit]) -> list[np.ndarray]:
    """Positions at which orbits cross the scene's section, in the order of time.

    Two of the longest cycles are run, and the first half of the crossings is kept, so that a
    crossing at the start is counted once.
    """
    state = np.array([orbit.state for orbit in orbits])
    values = [orbit.scene.parameters[name] for orbit in orbits]
    axes = {name: values, "x_1": state[:, 0].tolist(), "v_1": state[:, 1].tolist()}
    twice = scene.replace(
        axes=tuple(Axis(key, value) for key, value in axes.items()),
        zipped=True,
        transient=0.0,
        window=2.0 * max(orbit.periods for orbit in orbits),
        rtol=1e-11,
    )
    found = run(twice, show_progress=False)
    each = found.section.sel(component="x", node=1).values
    return [x[: (int(count) + 1) // 2] for x, count in zip(each, found.section_count.values, strict=True)]


def _periods(branch: tuple[Place, ...]) -> int:
    """Drive periods of a branch's orbits; the orbit from which the branch is born has fewer."""
    return max(place.orbit.periods for place in branch)


def table(data: SkeletonFigure) -> Table:
    """Return one row for each orbit and crossing of the section."""
    rows = []
    for number, branch in enumerate(data.branches):
        for place in branch:
            value, orbit = complex(place.orbit.multipliers[0]), place.orbit
            own = (number, orbit.periods, place.value), (value.real, value.imag, orbit.residual, place.phases)
            rows += [(*own[0], x, *own[1]) for x in place.x if place.kind is None]
    columns = ("branch", "periods", "omega", "x_1", "multiplier_re", "multiplier_im", "residual", "phases")
    return Table(columns, tuple(rows))


def ranges(data: SkeletonFigure) -> Table:
    """Return one row for each bifurcation of each branch, at its lowest point at the section."""
    rows = [
        (number, place.orbit.periods, place.kind, place.value, place.residual, min(place.x, default=math.nan))
        for number, branch in enumerate(data.branches)
        for place in branch
        if place.kind is not None
    ]
    return Table(("branch", "periods", "kind", "omega", "residual", "x_1"), tuple(rows))


def document(data: SkeletonFigure) -> str:
    """Return the bifurcations as a table in Markdown; a shared one is listed once."""
    lines = ["| ω | drive periods | kind | residual |", "|---|---|---|---|"]
    last: tuple[Any, ...] = (None, math.nan)
    for _, periods, kind, value, residual, _ in sorted(ranges(data).rows, key=lambda row: row[3]):
        if kind != last[0] or not abs(value - last[1]) < SAME:
            lines.append(f"| {value:.10f} | {periods} | {kind} | {residual:.0e} |")
        last = kind, value
    return "\n".join(lines) + "\n"


def draw(axes: Axes, data: SkeletonFigure) -> Axes:
    """Draw the motion as grey dots, stable orbits as lines, unstable ones dashed."""
    _diagram(axes, data, 0.9)
    axes.set(xlim=(LOW, HIGH), xlabel=r"drive frequency $\omega$", ylabel=r"$\chi_1$ at the section")
    if CROWDED[0][0] > LOW and CROWDED[0][1] < HIGH:
        inset = axes.inset_axes(INSET)
        _diagram(inset, data, 1.6)
        inset.set(xlim=CROWDED[0], ylim=CROWDED[1])
        inset.tick_params(labelsize=5.5, pad=2)
        inset.locator_params(nbins=3)
        axes.indicate_inset_zoom(inset, edgecolor=BLACK, linewidth=0.5)
    axes.figure.legend(
        handles=_key(data), loc="outside upper center", ncols=3, handlelength=1.8, columnspacing=1.2, borderpad=0.1
    )
    return axes


def _diagram(axes: Axes, data: SkeletonFigure, size: float) -> None:
    """Draw motion, branches and bifurcations."""
    cloud, _ = points(data.diagram)
    axes.plot(
        cloud[:, 0],
        cloud[:, 1],
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
        for place in branch:
            if place.kind is not None:
                across = np.full(len(place.x), place.value)
                axes.plot(across, place.x, markeredgecolor=colour, **MARK, marker=MARKERS[place.kind])


def curves(branch: tuple[Place, ...]) -> list[tuple[bool, list[tuple[float, float]]]]:
    """Cut a branch into curves at the section if its stability or the number of crossings changes."""
    made: list[tuple[bool, list[tuple[float, float]]]] = []
    order, style = branch[0].x, None
    for before, after in pairwise(branch):
        if len(order) != len(after.x):
            order, style = after.x, None
            continue
        ends = min((np.roll(after.x, k) for k in range(len(order))), key=lambda x: float(np.abs(x - order).max()))
        stable = _stable(before, after)
        if stable != style:
            made += [(stable, [(before.value, float(x))]) for x in order]
        for (_, line), x in zip(made[len(made) - len(order) :], ends, strict=True):
            line.append((after.value, float(x)))
        order, style = ends, stable
    return made


def _stable(before: Place, after: Place) -> bool:
    """True if the orbits between two places are stable, by the one that is not at a bifurcation."""
    own = next((place for place in (before, after) if place.kind is None), None)
    return own.orbit.stable if own else max(abs(place.orbit.multipliers[0]) for place in (before, after)) < 1.0 + SAME


def _key(data: SkeletonFigure) -> list[Line2D]:
    """Legend of the colours, lines and marks that occur."""
    counts = sorted({_periods(branch) for branch in data.branches})
    found = {place.kind for branch in data.branches for place in branch}
    kinds = [kind for kind in MARKERS if kind in found]
    return [
        *(Line2D([], [], color=COLOURS.get(n, BLACK), label=f"{n} drive period{'s' if n > 1 else ''}") for n in counts),
        Line2D([], [], color=BLACK, label="stable", **STABLE),
        Line2D([], [], color=BLACK, label="unstable", **UNSTABLE),
        Line2D([], [], color=CLOUD, marker=".", linestyle="none", label="motion"),
        *(Line2D([], [], markeredgecolor=BLACK, marker=MARKERS[kind], label=kind, **MARK) for kind in kinds),
    ]
