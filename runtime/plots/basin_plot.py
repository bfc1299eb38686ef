"""Plots of a basin: an image over two axes of starts, shares over a swept parameter, or the starts as dots."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, to_rgb
from matplotlib.patches import Patch

from synchain.models.inputs.checks import suggestion

from ..synchronisation.basin import Basin
from ..synchronisation.ensemble import APPROACHING, ENDS, ESCAPED, LEAVING, OTHER, STOPPED, UNFINISHED
from .canvas import line_style
from .style import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, note, symbol

KINDS = ("image", "shares", "starts")  # kinds of plot, the default first where the basin has numbers for it

# Colours of attractors in turn: those of Okabe & Ito, then of Tol (https://personal.sron.nl/~pault).
ATTRACTORS = (
    BLUE,
    ORANGE,
    GREEN,
    PURPLE,
    SKY,
    "#E69F00",
    "#F0E442",
    "#882255",
    "#44AA99",
    "#999933",
    "#6A3D9A",
    "#B15928",
)

# Colours of fates without an attractor; escaped starts have the colour of the axes.
WITHOUT = {OTHER: "#8a8a8a", APPROACHING: "#c9c9c9", LEAVING: "#a6761d", STOPPED: "#5f5f5f", UNFINISHED: "#e6d8ad"}


def draw_basin(axes: Axes, value: Basin, kind: str | None, style: dict[str, Any]) -> Axes:
    """Draw a basin; of several cells of the answer an image and starts show the first one."""
    if kind is not None and kind not in KINDS:
        raise ValueError(f"unknown kind of plot {kind!r}; known: {', '.join(KINDS)}{suggestion(kind, KINDS)}")
    data = value.data
    cells, grid = (
        data.share.dims[:-1],
        [name for name in data.fate.dims if name in data.coords and name in data.initial.dims],
    )
    grid = [str(name) for name in grid if name not in ("perturbed", "node", "component")]
    possible = [*["image"] * (len(grid) > 1), *["shares"] * (0 < len(cells) < 3), "starts"]
    if kind is not None and kind not in possible:
        raise ValueError(f"this basin has no numbers for the plot {kind!r}; it has them for: {', '.join(possible)}")
    chosen = kind or possible[0]
    seen = [k for k, label in enumerate(value.labels) if label in value.attractors or (value.fate == k).any()]
    colours = _colours(axes, value.labels)
    if chosen == "shares":
        (_shares if len(cells) == 1 else _map)(axes, value, seen, colours, style)
        return axes
    # the first cell of the answer, and the first values of all further axes of starts
    fate, initial = data.fate.isel(dict.fromkeys(cells, 0)), data.initial
    initial = initial.isel(perturbed=0) if "perturbed" in initial.dims else initial
    first = ", ".join(
        f"{symbol(str(name))} = {data[name].values[0]:.4g}"
        for name in cells
        if name in data.coords and name != "perturbed"
    )
    if chosen == "image":
        across, up, *others = grid
        fate = fate.isel(dict.fromkeys((*others, *(["sample"] if "sample" in fate.dims else [])), 0)).sortby(
            [across, up]
        )
        paint = {"cmap": ListedColormap(colours), "vmin": -0.5, "vmax": len(colours) - 0.5, "shading": "nearest"}
        axes.pcolormesh(
            fate[across], fate[up], fate.transpose(up, across).values, **{**paint, "rasterized": True, **style}
        )
        first = ", ".join(filter(None, [first, *(f"{symbol(n)} = {data[n].values[0]:.4g}" for n in others)]))
        axes.set(xlabel=symbol(across), ylabel=symbol(up))
        seen = [k for k in seen if (fate == k).any()]
    else:
        _starts(axes, value, fate.values.ravel(), initial.values.reshape(value.samples, -1), seen, colours, style)
    handles = [Patch(color=colours[k], label=value.labels[k]) for k in seen]
    axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3)
    note(axes, first)
    return axes


def _colours(axes: Axes, labels: tuple[str, ...]) -> list[str]:
    """Return the colour of each label; escaped starts are dark on light axes and light on dark ones."""
    light = float(np.dot(to_rgb(axes.get_facecolor()), [0.3, 0.6, 0.1])) > 0.5
    fixed = {**WITHOUT, ESCAPED: BLACK if light else "#f2f2f2"}
    attractors = [label for label in labels if label not in (OTHER, *ENDS)]
    return [fixed.get(label) or ATTRACTORS[attractors.index(label) % len(ATTRACTORS)] for label in labels]


def _starts(
    axes: Axes,
    value: Basin,
    fate: np.ndarray,
    initial: np.ndarray,
    seen: list[int],
    colours: list[str],
    style: dict[str, Any],
) -> None:
    """Draw starts as dots over the two states that vary first. Shapes: fate (starts,), initial (starts, states)."""
    states = [f"{c}_{n}" for c in value.data.component.values for n in range(1, value.scene.n + 1)]
    varied = [k for k in range(len(states)) if np.ptp(initial[:, k]) > 0.0] or [0]
    # two components of one node if these vary, else the first two states that do
    node = states[varied[0]].rpartition("_")[2]
    second = [k for k in varied[1:] if states[k].rpartition("_")[2] == node] or varied[1:] or varied
    across, up = varied[0], second[0]
    for k in seen:
        dots: dict[str, Any] = {"linestyle": "none", "marker": ".", "markersize": 3.5, "color": colours[k]}
        axes.plot(initial[fate == k, across], initial[fate == k, up], **line_style(style, **dots))
    axes.set(xlabel=symbol(states[across]), ylabel=symbol(states[up]))


def _shares(axes: Axes, value: Basin, seen: list[int], colours: list[str], style: dict[str, Any]) -> None:
    """Draw the share of each fate over the axis of the answer, with its interval as a band."""
    shares, intervals = value.shares, value.intervals
    name = str(shares.dims[0])
    x = np.asarray(shares[name].values) if name in shares.coords else np.arange(len(shares))
    if name == "cell":
        name, x = value.scene.axes[0].name, np.array(value.scene.axes[0].values)
    separate = name == "perturbed"
    x, order = (np.arange(len(x)) if separate else x), slice(None) if separate else np.argsort(x, kind="stable")
    for k in seen:
        y, (low, high) = shares.values[:, k], intervals.values[:, k].T
        line: dict[str, Any] = {"color": colours[k], "label": value.labels[k], "marker": "."}
        if separate:
            axes.errorbar(x, y, yerr=[y - low, high - y], linestyle="none", capsize=2, **line_style(style, **line))
        else:
            axes.fill_between(x[order], low[order], high[order], color=colours[k], alpha=0.2, linewidth=0.0)
            axes.plot(x[order], y[order], **line_style(style, **line))
    if separate:
        axes.set_xticks(x, [str(each) for each in shares[name].values])
    axes.set(xlabel="perturbed node" if separate else symbol(name), ylabel="share of starts", ylim=(-0.03, 1.03))
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3)


def _map(axes: Axes, value: Basin, seen: list[int], colours: list[str], style: dict[str, Any]) -> None:
    """Draw the share of the first fate as colours over the two axes of the answer."""
    share = value.shares.isel(attractor=seen[0])
    down, across = (str(name) for name in share.dims)
    share = share.sortby([name for name in (down, across) if name in share.coords])
    paint: dict[str, Any] = {"shading": "nearest", "cmap": "cividis", "vmin": 0.0, "vmax": 1.0, "rasterized": True}
    x, y = (
        np.asarray(share[name].values) if name != "perturbed" else np.arange(share.sizes[name])
        for name in (across, down)
    )
    painted = axes.pcolormesh(x, y, share.values, **{**paint, **style})
    axes.set(xlabel="perturbed node" if across == "perturbed" else symbol(across), ylabel=symbol(down))
    if across == "perturbed":
        axes.set_xticks(x, [str(each) for each in share[across].values])
    axes.figure.colorbar(painted, ax=axes, label=f"share: {value.labels[seen[0]]}")
