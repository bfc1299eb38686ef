"""Plots of a result: error curve, bifurcation diagram, map, time series, phase portrait, space-time map, network."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from synchain.models.inputs.checks import suggestion
from synchain.models.inputs.names import NodeName

from ..prediction.synchronisability import Window
from ..results.result import Result
from ..support.status import Status
from .canvas import axes_of, line_style
from .graph_picture import draw_graph
from .style import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, bands, failures, note, symbol

# Kinds of plot; the names of observables are kinds too.
KINDS = ("error", "section", "map", "time", "phase", "space", "network", "end")
CYCLE = (BLUE, ORANGE, GREEN, PURPLE, SKY, BLACK)  # colours of oscillators, in turn
REALISATION = "realisation"  # name of the axis of random realisations
FINEST = 1000  # most drawn values on each axis of a map; longer axes are thinned
ROUNDING = 1e-9  # draw synchronisation errors below this value as zero
DECADES = 1e3  # ratio of the largest to the smallest error from which the scale is logarithmic
MARKED = 60  # largest number of cells drawn with a dot each: more dots would hide the line
SHARP = 0.5  # largest angle in radians between chords of a phase portrait that is drawn as a line: 12 samples a turn
PAINT: dict[str, Any] = {"shading": "nearest", "cmap": "cividis", "rasterized": True}  # style of colours over two axes


def draw_result(
    result: Result, ax: Axes | None = None, kind: str | None = None, windows: Iterable[Window] = (), **style: Any
) -> Axes:
    """Draw a result, with shaded windows of the coupling strength behind it; pass `style` to Matplotlib's artists."""
    # If the result has more axes than the plot, the leading axes are fixed at their first values; plots over time and
    # of the network show the first cell. Cells that did not finish are omitted, and a note above the plot counts them.
    if kind is not None and kind not in (choices := (*KINDS, *result.scene.observe)):
        raise ValueError(f"unknown kind of plot {kind!r}; known: {', '.join(choices)}{suggestion(kind, choices)}")
    possible, kinds = _possible(result)
    chosen = kind or possible[0]
    if chosen not in possible:
        raise ValueError(f"this result has no numbers for the plot {chosen!r}; it has them for: {', '.join(possible)}")
    axes = axes_of(ax)
    if chosen not in kinds:
        cut, remark = _cut(result, 2 if REALISATION in result.data.status.dims else 1)
        _observed(axes, cut, result, chosen, style)
    else:
        draw, kept_axes = _DRAWING[chosen]
        cut, remark = _cut(result, kept_axes)
        draw(axes, cut, result, style)
    if shaded := _intervals(windows):
        if (along := _along(cut, result)[1] if cut.status.ndim else "") != result.scene.strength:
            raise ValueError(
                f"windows: found a plot over {along or 'no parameter'}; expected one over {result.scene.strength}"
            )
        limits = axes.get_xlim()
        bands(axes, shaded)
        # Draw a dashed line and a note where windows end with the computed range (infinite error) and may continue.
        for window in getattr(windows, "windows", windows):
            for end, outside in (("low", "right"), ("high", "left")):
                edge, error = getattr(window, end, math.inf), getattr(window, f"{end}_error", 0.0)
                if error == math.inf and math.isfinite(edge):
                    axes.axvline(edge, color=BLACK, linewidth=0.8, linestyle="--", zorder=0.5)
                    axes.text(edge, 0.5, " not computed beyond ", transform=axes.get_xaxis_transform(), rotation=90,
                              fontsize="x-small", ha=outside, va="center", clip_on=True)  # fmt: skip
        axes.set_xlim(limits)
    failed = int((result.data.status != Status.FINISHED).sum())
    note(axes, "; ".join(filter(None, [remark, failures(failed, result.data.status.size)])))
    return axes


def _intervals(windows: object) -> list[tuple[float, float]]:
    """Return the ends of windows: of a master stability function, windows themselves, or pairs."""
    windows = getattr(windows, "windows", windows)
    try:
        pairs = [(w.low, w.high) if hasattr(w, "low") else tuple(w) for w in windows]  # type: ignore[attr-defined]
        return [(float(low), float(high)) for low, high in pairs]
    except (TypeError, ValueError):
        raise ValueError("windows: expected those of a master stability function, or pairs (low, high)") from None


def _possible(result: Result) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the possible kinds of plot, the default first; and the same without observables."""
    count, data = result.data.status.ndim, result.data
    kinds = []
    if count >= 2:
        kinds.append("map")
    if "sync_error" in data and count >= 1:
        kinds.append("error")
    # default: the motion for a single run, the section for a sweep
    section = ["section"] if "section" in data else []
    motion = ["time", "phase", "space"] if "trajectory" in data else []
    if motion:  # default: curves if each oscillator has a different colour, else a space-time map
        motion.sort(key=("phase" if result.scene.n <= len(CYCLE) else "space").__ne__)
    kinds += section + motion if count else motion + section
    kinds += ["end", "network"]
    observed = [name for name in result.scene.observe if count and name in data and name not in kinds]
    # observables come before the default plots unless the user asked for a record
    if "sync_error" in data or "section" in data:
        return (*kinds[:-2], *observed, *kinds[-2:]), tuple(kinds)
    return (*observed, *kinds), tuple(kinds)


def _cut(result: Result, keep: int) -> tuple[xr.Dataset, str]:
    """Select the last `keep` axes of a result; cells that did not finish become NaN."""
    data = result.data
    # fix the leading axes at their first value
    leading = data.status.dims[: max(data.status.ndim - keep, 0)]
    remark = ", ".join(f"{symbol(str(name))} = {float(data[name][0]):.4g}" for name in leading)
    data = data.isel({name: 0 for name in leading})
    # thin the axes of a map to FINEST values
    steps = {str(d): -(-data.sizes[d] // FINEST) for d in data.status.dims if keep > 1}
    data = data.isel({name: slice(None, None, step) for name, step in steps.items()})
    thinned = ", ".join(f"every {step}th {symbol(name)}" for name, step in steps.items() if step > 1)
    remark = "; ".join(filter(None, [remark, thinned]))
    good = data.status == Status.FINISHED
    floats = [name for name, values in data.items() if values.dtype.kind == "f"]
    return data.assign({name: data[name].where(good) for name in floats}), remark


def _along(data: xr.Dataset, result: Result) -> tuple[np.ndarray, str]:
    """Return values and name of the axis of a one-dimensional result."""
    name = result.scene.axes[0].name if result.scene.zipped else str(data.status.dims[0])
    return data[name].values, name


def _line_style(x: np.ndarray, name: str) -> dict[str, Any]:
    """Return the style over an axis: a line, with dots for few values; only dots for realisations, without order."""
    unordered = name == REALISATION
    return {"linestyle": "none" if unordered else "-", "marker": "." if unordered or len(x) <= MARKED else None}


def _error(axes: Axes, data: xr.Dataset, result: Result, style: dict[str, Any]) -> None:
    x, name = _along(data, result)
    order, error = np.argsort(x, kind="stable"), data.sync_error.values
    axes.plot(x[order], error[order], **line_style(style, color=BLUE, **_line_style(x, name)))
    axes.set(xlabel=symbol(name), ylabel="average synchronisation error")
    if np.nanmax(error, initial=0.0) < ROUNDING:  # do not scale rounding errors to the full height
        axes.set_ylim(-0.05 * ROUNDING, ROUNDING)
    elif np.nanmax(error) > DECADES * (least := float(np.nanmin(error[error > ROUNDING]))):
        # logarithmic scale, and linear from zero to the smallest error above rounding
        axes.set_yscale("symlog", linthresh=least, linscale=1.0)
        axes.set_ylim(bottom=0.0)


def _observed(axes: Axes, data: xr.Dataset, result: Result, name: str, style: dict[str, Any]) -> None:
    """Draw an observable over the axis: a line for each node, or for each realisation and their mean."""
    x, along = _along(data, result)
    order = np.argsort(x, kind="stable")
    values = data[name].values[order].reshape(len(x), -1)
    marks = _line_style(x, along)
    if REALISATION in data.status.dims[1:]:
        axes.plot(x[order], values, color=SKY, linewidth=0.5)
        axes.plot(
            x[order], values.mean(axis=1), **line_style(style, color=BLUE, label="mean of the realisations", **marks)
        )
        axes.legend()
    else:
        for i, line in enumerate(values.T):
            axes.plot(x[order], line, **line_style(style, color=CYCLE[i % len(CYCLE)], **marks))
    axes.set(xlabel=symbol(along), ylabel=name.replace("_", " "))


def _section(axes: Axes, data: xr.Dataset, result: Result, style: dict[str, Any]) -> None:
    """Draw the first state other than the section's: over the axis if there is one, else as a return map."""
    states, section = result.scene.equations.state, result.scene.section
    state = next((name for name in states if name != section.variable), states[0])
    node_name = NodeName.parse(state)
    assert node_name is not None
    y = data.section.sel(component=node_name.base).isel(node=node_name.index).values
    # the section for an axis label: its state as a formula, its direction, and its level if that is not 0
    where = f"{symbol(section.variable)}{str(section).removeprefix(section.variable)}"
    x = None if data.status.ndim == 0 else _along(data, result)
    dots = line_style(
        style,
        linestyle="none",
        marker=".",
        markeredgewidth=0.0,
        color=BLACK,
        rasterized=True,
        # small, half transparent dots for many values of a parameter with many points
        markersize=3.0 if x is None else float(np.clip(700.0 / len(x[0]), 1.0, 3.0)),
        alpha=1.0 if x is None or len(x[0]) <= MARKED else 0.5,
    )
    if x is None:
        axes.plot(y[:-1], y[1:], **dots)
        axes.set(xlabel=f"{symbol(state)} at {where}", ylabel=f"{symbol(state)} the next time")
        _widen(axes)
        return
    axes.plot(np.repeat(x[0], y.shape[1]), y.reshape(-1), **dots)
    axes.set(xlabel=symbol(x[1]), ylabel=f"{symbol(state)} at {where}")


def _map(axes: Axes, data: xr.Dataset, result: Result, style: dict[str, Any]) -> None:
    """Draw colours over the last two axes: the error, else the number of section points, else the final state."""
    if "sync_error" in data:
        values, label = data.sync_error, "average synchronisation error"
    elif "section_count" in data:
        values, label = data.section_count.where(data.status == Status.FINISHED), "section points"
    else:
        values, label = data.end.isel(component=0, node=0), f"{symbol(result.scene.equations.state[0])} at the end"
    down, along = (str(name) for name in values.dims)
    values = values.sortby([down, along])
    painted = axes.pcolormesh(values[along], values[down], values, **{**PAINT, **style})
    axes.set(xlabel=symbol(along), ylabel=symbol(down), facecolor="0.8")
    axes.figure.colorbar(painted, ax=axes, label=label)


def _time(axes: Axes, data: xr.Dataset, result: Result, style: dict[str, Any]) -> None:
    states = node_states(data.trajectory, result, 0)
    _curves(axes, (np.broadcast_to(data.time.values, states.T.shape), states.values.T), style)
    axes.set(xlabel="time", ylabel=symbols(states))
    _legend(axes, result)


def _phase(axes: Axes, data: xr.Dataset, result: Result, style: dict[str, Any]) -> None:
    """Draw the second state of each node over its first: a line, or dots if the samples are too few for a line."""
    first, second = (node_states(data.trajectory, result, k) for k in (0, 1))
    x, y = first.values.T, second.values.T
    # angles between successive chords, each state in units of its range
    with np.errstate(invalid="ignore", divide="ignore"):
        chords = np.diff(x, axis=1) / np.ptp(x) + 1j * np.diff(y, axis=1) / np.ptp(y)
        turns = np.abs(np.angle(chords[:, 1:] / chords[:, :-1]))
    coarse = float(np.nanmedian(turns)) > SHARP if np.isfinite(turns).any() else False
    _curves(axes, (x, y), {"linestyle": "none", "marker": ".", "markersize": 2.0, **style} if coarse else style)
    axes.set(xlabel=symbols(first), ylabel=symbols(second))
    _legend(axes, result)


def _curves(axes: Axes, lines: tuple[np.ndarray, np.ndarray], style: dict[str, Any]) -> None:
    """Draw a curve for each node: x and y are (n, samples)."""
    count = len(lines[0])
    colours = CYCLE if count <= len(CYCLE) else mpl.colormaps["viridis"](np.linspace(0.0, 1.0, count))
    for i, (x, y) in enumerate(zip(*lines, strict=True)):
        label = "oscillator " * (i == 0) + str(i + 1)
        axes.plot(x, y, **line_style(style, color=colours[i], linewidth=0.8, label=label))


def _space(axes: Axes, data: xr.Dataset, result: Result, style: dict[str, Any]) -> None:
    """Draw the first state as colours over time and node."""
    states = node_states(data.trajectory, result, 0)
    nodes = np.arange(1, result.scene.n + 1)
    painted = axes.pcolormesh(data.time.values, nodes, states.values.T, **{**PAINT, **style})
    axes.set(xlabel="time", ylabel="oscillator")
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.figure.colorbar(painted, ax=axes, label=symbols(states))


def _network(axes: Axes, data: xr.Dataset, result: Result, style: dict[str, Any]) -> None:
    states = node_states(data.end, result, 0)
    draw_graph(result.scene.topology, axes, states.values.astype(float), **style)
    axes.figure.axes[-1].set_ylabel(f"{symbols(states)} at the end")


def node_states(values: xr.DataArray, result: Result, k: int) -> xr.DataArray:
    """Return the first (`k` = 0) or second (`k` = 1) state of each node, nodes last; the first if there is no second."""
    equations = result.scene.equations
    state_names = [{s.name for s in node.state} for node in equations.nodes]
    components = [[name for name in equations.components if name in names] for names in state_names]
    chosen = [components[kind][min(k, len(components[kind]) - 1)] for kind in equations.kind_of]
    return values.sel(component=xr.DataArray(chosen, dims="node"), node=values.node).transpose(..., "node")


def symbols(states: xr.DataArray) -> str:
    """Return the symbols of states without numbers of nodes, separated by commas."""
    return ", ".join(dict.fromkeys(symbol(str(name)) for name in states.component.values))


def _end(axes: Axes, data: xr.Dataset, result: Result, style: dict[str, Any]) -> None:
    """Draw the final states of every oscillator, over the axis if there is one."""
    first, second = (node_states(data.end, result, k) for k in (0, 1))
    along = _along(data, result) if data.status.ndim else None
    x, y = (first, second) if along is None else (np.broadcast_to(along[0][:, None], first.shape), first)
    for i, color in enumerate(CYCLE[: result.scene.n]):  # one line of each colour, as there may be many oscillators
        across, up = (np.asarray(values)[..., i :: len(CYCLE)].ravel() for values in (x, y))
        label = "oscillator " * (i == 0) + str(i + 1)
        axes.plot(across, up, **line_style(style, linestyle="none", marker=".", color=color, label=label))
    labels = (
        (f"{symbols(first)} at the end", f"{symbols(second)} at the end")
        if along is None
        else (symbol(along[1]), f"{symbols(first)} at the end")
    )
    axes.set(xlabel=labels[0], ylabel=labels[1])
    _widen(axes)
    _legend(axes, result)


def _legend(axes: Axes, result: Result) -> None:
    """Explain the colours of the oscillators above the axes, if there are several and each has its own colour."""
    if 1 < result.scene.n <= len(CYCLE):
        axes.legend(
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            ncols=len(CYCLE),
            handlelength=1.0,
            columnspacing=1.0,
            borderpad=0.2,
        )


def _widen(axes: Axes) -> None:
    """Widen the limits to a hundredth of the plotted values, so that rounding errors show no pattern."""
    for low, high, set_limits in ((*axes.get_xlim(), axes.set_xlim), (*axes.get_ylim(), axes.set_ylim)):
        least = 0.01 * max(abs(low), abs(high), 1e-3)
        if high - low < least:
            set_limits(0.5 * (low + high - least), 0.5 * (low + high + least))


_DRAWING = {  # for each kind its function, and the number of swept axes in the plot
    "error": (_error, 1),
    "section": (_section, 1),
    "map": (_map, 2),
    "time": (_time, 0),
    "phase": (_phase, 0),
    "space": (_space, 0),
    "network": (_network, 0),
    "end": (_end, 1),
}
