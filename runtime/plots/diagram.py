"""Draw branches of equilibria and orbits, and curves of bifurcations in two parameters."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from synchain.models.inputs.checks import check_text

from ..bifurcation.equilibrium import Equilibrium
from ..bifurcation.periodic_result import PeriodicOrbit
from ..bifurcation.results import Branch, Curve
from ..sweeps.run import run
from .branch_marks import MARK, MARKERS, STABLE, UNSTABLE
from .canvas import line_style
from .style import BLACK, BLUE, GREEN, ORANGE, PURPLE, symbol

SHORT = 1e-6  # window in which an observable of an equilibrium is recorded, in units of its fastest time (a choice)


def draw_branches(axes: Axes, branches: tuple[Branch, ...], y: str | None, style: dict[str, Any]) -> Axes:
    """Draw a state or an observable over the parameter: solid where stable, dashed where unstable, marks at bifurcations."""
    # One colour for equilibria and each kind of orbit; `legend` holds one entry for each style that is drawn.
    colours = (PURPLE, BLUE, ORANGE, GREEN)
    kinds = sorted({_kind(branch) for branch in branches})
    legend: dict[str, dict[str, Any]] = {
        text: {"color": colours[k % len(colours)]} for k, (_, text) in enumerate(kinds)
    }
    for branch in branches:
        colour = colours[kinds.index(_kind(branch)) % len(colours)]
        turn_heights = [_height(turn.solution, y) for turn in branch.bifurcations]
        for stable, values, heights in stretches(branch, [_height(each, y) for each in branch], turn_heights):
            axes.plot(values, heights, **line_style(style, color=colour, **(STABLE if stable else UNSTABLE)))
            legend["stable" if stable else "unstable"] = {"color": BLACK, **(STABLE if stable else UNSTABLE)}
        for turn, height in zip(branch.bifurcations, turn_heights, strict=True):
            axes.plot([turn.value], [height], color=colour, marker=MARKERS[turn.kind], **MARK)
            legend[str(turn.kind)] = {"color": BLACK, "marker": MARKERS[turn.kind], **MARK}
    if branches:
        first = branches[0][0]
        when = "" if y or isinstance(first, Equilibrium) else " at the beginning of a period"
        axes.set(xlabel=symbol(branches[0].name), ylabel=f"{symbol(y or _states(first)[0])}{when}")
        handles = [Line2D([], [], label=label, **look) for label, look in legend.items()]
        axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, fontsize="x-small")
    return axes


def draw_curve(axes: Axes, curve: Curve, style: dict[str, Any]) -> Axes:
    """Draw a curve in the plane of its parameters, with its points of codimension two by name."""
    axes.plot(*curve.values.T, **line_style(style, color=BLUE, label=str(curve.kind)))
    for each in curve.special:
        if not each.kind.startswith("extreme"):
            axes.plot(*each.values, color=BLUE, marker="o", **MARK)
            axes.annotate(each.kind, each.values, xytext=(4, 4), textcoords="offset points", fontsize="x-small")
    axes.set(xlabel=symbol(curve.names[0]), ylabel=symbol(curve.names[1]))
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), fontsize="x-small")
    return axes


def _kind(branch: Branch) -> tuple[int, str]:
    """Return the number of drive periods, 0 for equilibria, with the text of the legend."""
    first = branch[0]
    if isinstance(first, Equilibrium):
        return 0, "equilibria"
    if first.free:
        return 1, "cycles"
    return first.periods, f"{first.periods} drive period{'s' * (first.periods > 1)}"


def _states(solution: Equilibrium | PeriodicOrbit) -> list[str]:
    slips = () if isinstance(solution, Equilibrium) else ("slip_",)
    return [name for name in solution.scene.equations.state if not name.startswith(slips or "\0")]


def _height(solution: Equilibrium | PeriodicOrbit, y: str | None) -> float:
    """Return the first state, the state of a name, or an observable over one period."""
    names = _states(solution)
    if y is None or check_text("y", y) in names:
        return float(solution.state[names.index(y) if y else 0])
    if isinstance(solution, Equilibrium):
        window = SHORT / (float(np.abs(solution.eigenvalues).max(initial=0.0)) or 1.0)
    else:
        window = solution.period
    scene = solution.scene.replace(
        observe={"y": y}, record=(), transient=0.0, window=window, time_unit="time", continuation="none"
    )
    heights = run(scene, start=solution.data.state, show_progress=False, workers=1).data["y"].values
    if heights.size != 1:
        raise ValueError(f"y: found {y!r}, one value of each node; expected one, of node 1 (x_1) or nodes.maximum(x)")
    return float(heights.item())


def stretches(
    branch: Branch, heights: list[float], turn_heights: list[float]
) -> list[tuple[bool, np.ndarray, np.ndarray]]:
    """Cut a branch at its bifurcations into stretches of one stability: stable or not, values, heights."""
    good = [*map(bool, branch.stable), *(None for _ in branch.bifurcations)]
    turns = branch.bifurcations
    # The place of a bifurcation on the branch is its arclength, or the parameter where that is the length.
    places = [*branch.lengths, *(turn.value if np.isnan(turn.length) else turn.length for turn in turns)]
    points = zip(
        places, [*branch.values, *(turn.value for turn in turns)], [*heights, *turn_heights], good, strict=True
    )
    lines: list[tuple[bool, list[tuple[float, float]]]] = []
    ends: list[tuple[float, float]] = []
    for _, value, height, stable in sorted(points, key=lambda each: each[0]):
        point = (float(value), height)
        if stable is None:  # the bifurcation ends this stretch and begins the next one
            if lines and not ends:
                lines[-1][1].append(point)
            ends = [point]
        elif not lines or ends or lines[-1][0] != stable:
            lines.append((stable, [*ends, point]))
            ends = []
        else:
            lines[-1][1].append(point)
    return [(stable, *np.array(line).T) for stable, line in lines]
