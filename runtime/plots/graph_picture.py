"""Draw graphs: in matplotlib axes, and as SVG text in the text colour of the page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from synchain.models.graphs.topology import Topology
from synchain.models.inputs.checks import check_instance
from synchain.models.inputs.display import HasDrawing
from synchain.models.scenes.scene import Scene

from .graph_layout import positions

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike

# Colours of the kinds of nodes (Okabe & Ito).
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
ALONE = "0.8"  # colour of a node that is alone in its class
NEGATIVE = "#D55E00"  # colour of links with a negative weight
# Most nodes and lines of an SVG; a larger graph is described by its numbers of nodes and links.
SVG_NODES, SVG_LINES = 300, 3000
NUMBERED = 0.05  # least radius of nodes that are drawn with labels
LETTERS = 4  # most letters of a label in a node
POINTS = 60.0  # size of a new figure: points per unit of the layout
THIN, THICK = 0.7, 3.2  # line widths in points of the smallest and the largest weight
BEND = 0.18  # distance of a bent line from the straight one, divided by its length


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """The line of a link, or of two opposite links of equal weight."""

    source: int  # nodes, counted from 0
    target: int
    width: float  # in points
    arrow: bool  # True if the link runs one way
    bent: bool  # True if the line is an arc
    negative: bool  # True if the weight is negative


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    positions: np.ndarray  # (n, 2)
    lines: tuple[Line, ...]
    kind: tuple[int, ...]  # kind of each node
    names: tuple[str, ...]  # names of the kinds
    labels: Sequence[int] | Sequence[str]  # labels of the nodes

    @classmethod
    def of(cls, value: HasDrawing) -> Picture:
        """Lay out a graph, or that of a scene with its kinds of nodes."""
        graph = graph_of(value)
        layout = positions(graph)
        kinds: tuple[int, ...] = (0,) * graph.n
        names: tuple[str, ...] = ("",)
        if isinstance(value, Scene):
            kinds, names = value.equations.kind_of, tuple(kind.oscillator.name for kind in value.model.kinds)
        return cls(layout, _lines(graph, layout), kinds, names, graph.labels)

    def short_label(self, i: int) -> str:
        """Return the label of a node, cut to LETTERS."""
        text = str(self.labels[i])
        return text if len(text) <= LETTERS else f"{text[: LETTERS - 1]}…"

    @property
    def radius(self) -> float:
        """Radius of a node in units of the layout: 0.4 of the smallest distance between nodes, within limits."""
        count = len(self.positions)
        nearest = 2.0 / np.sqrt(count)  # estimate for large graphs
        if 1 < count <= SVG_NODES:
            distances = np.linalg.norm(self.positions[:, None] - self.positions[None], axis=2)
            nearest = float((distances + np.diag(np.full(count, np.inf))).min())
        return float(np.clip(0.4 * nearest, 0.012, 0.11))


def graph_of(value: HasDrawing) -> Topology:
    """Return a graph unchanged, or the graph of a scene; TypeError for any other value."""
    return value.topology if isinstance(value, Scene) else check_instance("graph", value, Topology, "a graph")


def _lines(graph: Topology, layout: np.ndarray) -> tuple[Line, ...]:
    """Return the lines of a graph; opposite links of equal weight become one line without an arrow."""
    weight = {(target, source): w for target, source, w in graph.links}
    largest = max((abs(w) for w in weight.values()), default=0)
    uneven = len({abs(w) for w in weight.values()}) > 1
    lines = []
    for (target, source), w in weight.items():
        back = weight.get((source, target))
        if back == w and target > source:
            continue
        width = THIN + (THICK - THIN) * float(abs(w) / largest) if uneven else 1.2
        bent = (back is not None and back != w) or _hits_node(layout, source, target)
        lines.append(Line(source, target, width, back != w, bent, w < 0))
    return tuple(lines)


def _hits_node(positions: np.ndarray, i: int, j: int) -> bool:
    """Return True if the straight line between two nodes passes through a third one."""
    direction = positions[j] - positions[i]
    length_squared = float(direction @ direction)
    if length_squared == 0.0 or len(positions) > SVG_NODES:
        return False
    offsets = positions - positions[i]
    # coordinate along the line from 0 to 1, and distance from the line, of every node
    along = offsets @ direction / length_squared
    distance = np.abs(offsets[:, 0] * direction[1] - offsets[:, 1] * direction[0]) / np.sqrt(length_squared)
    return bool(np.any((along > 1e-6) & (along < 1.0 - 1e-6) & (distance < 0.01)))


def draw_graph(value: HasDrawing, ax: Axes | None = None, values: ArrayLike | None = None, **style: Any) -> Axes:
    """Draw a graph, or the graph of a scene, into axes (default: pyplot's); return the axes."""
    # `values` (n,) colour the nodes: whole numbers as classes, others by a colour map.
    from matplotlib.collections import LineCollection
    from matplotlib.patches import FancyArrowPatch

    from .canvas import axes_of, check_style

    check_style(style, "draw", "ax, values")
    picture, axes = Picture.of(value), axes_of(ax)
    # straight lines as one collection, which draws fast
    points, straight = picture.positions, [line for line in picture.lines if not (line.arrow or line.bent)]
    axes.add_collection(
        LineCollection(
            [points[[line.source, line.target]] for line in straight],
            linewidths=[line.width for line in straight],
            colors=[NEGATIVE if line.negative else "0.45" for line in straight],
            zorder=1,
        )
    )
    # arcs and arrows one by one
    for line in picture.lines:
        if line.arrow or line.bent:
            patch = FancyArrowPatch(
                points[line.source],
                points[line.target],
                arrowstyle="-|>" if line.arrow else "-",
                connectionstyle=f"arc3,rad={BEND if line.bent else 0.0}",
                mutation_scale=8.0,
                shrinkA=0.0,
                shrinkB=6.0 if line.arrow else 0.0,
                linewidth=line.width,
                color=NEGATIVE if line.negative else "0.45",
                zorder=1,
            )
            axes.add_patch(patch)
    _nodes(axes, picture, values, style)
    return axes


def _nodes(axes: Axes, picture: Picture, values: ArrayLike | None, style: dict[str, Any]) -> None:
    """Draw the nodes with their colours and labels, with a legend if there are several kinds."""
    from matplotlib.patheffects import withStroke

    points, kind = picture.positions, np.array(picture.kind)
    size = (2.0 * POINTS * picture.radius) ** 2  # matplotlib takes the square of the diameter in points
    dots: dict[str, Any] = {"s": size, "zorder": 2, "linewidths": 0.0, **style}
    if values is None:
        for k, name in enumerate(picture.names):
            axes.scatter(*points[kind == k].T, **{"color": COLOURS[k % len(COLOURS)], "label": name, **dots})
    else:
        colour = np.asarray(values)
        if colour.shape != kind.shape or colour.dtype.kind not in "biuf":
            raise ValueError(
                f"values: found an array {colour.shape} of {colour.dtype}; expected {len(kind)} real numbers, one a node"
            )
        if colour.dtype.kind == "f":
            axes.figure.colorbar(axes.scatter(*points.T, **{"c": colour, **dots}), ax=axes)
        else:  # whole numbers are classes, such as clusters
            axes.scatter(*points.T, **{"color": class_colours(colour), **dots})
    if picture.radius >= NUMBERED:
        for i, (x, y) in enumerate(points.tolist()):
            axes.text(
                x,
                y,
                picture.short_label(i),
                color="white" if values is None else "0.1",
                path_effects=[] if values is None else [withStroke(linewidth=1.5, foreground="white")],
                ha="center",
                va="center_baseline",
                fontsize=min(POINTS * picture.radius, 7.0),
                zorder=3,
            )
    if len(picture.names) > 1 and values is None:
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3)
    low, high = points.min(axis=0) - 0.2, points.max(axis=0) + 0.2
    axes.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    axes.set_axis_off()


def class_colours(classes: ArrayLike) -> list[str]:
    """Return a colour for each node: one for each class of several nodes, and ALONE for single nodes."""
    _, index, sizes = np.unique(np.asarray(classes), return_inverse=True, return_counts=True)
    place = np.cumsum(sizes > 1) - 1
    return [COLOURS[place[k] % len(COLOURS)] if sizes[k] > 1 else ALONE for k in index]


def svg(value: HasDrawing, width: int = 300) -> str:
    """Return a graph as SVG text, or a sentence for more than SVG_NODES nodes or SVG_LINES lines."""
    # Lines have the colour of the surrounding text, so that the drawing is readable on any background.
    graph = graph_of(value)
    if graph.n > SVG_NODES or graph.link_count > 2 * SVG_LINES:
        return (
            f"<p>{graph.n} nodes and {graph.link_count} links are too many to be drawn here; "
            "<code>draw()</code> draws them</p>"
        )
    picture = Picture.of(value)
    # the box around all nodes; SVG counts y downwards
    low, high = picture.positions.min(axis=0), picture.positions.max(axis=0)
    margin = picture.radius + 0.14
    (left, bottom), (across, up) = low - margin, high - low + 2 * margin
    scale = width / max(across, up)
    body = [_svg_line(picture, line, scale) for line in picture.lines]
    body += [_svg_node(picture, i, scale) for i in range(len(picture.positions))]
    box = f"{scale * left:.1f} {-scale * (bottom + up):.1f} {scale * across:.1f} {scale * up:.1f}"
    label = escape(f"{graph.name} of {graph.n} nodes", quote=True)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" aria-label="{label}" width="{scale * across:.0f}" '
        f'height="{scale * up:.0f}" viewBox="{box}">{"".join(body)}</svg>'
    )


def _svg_line(picture: Picture, line: Line, scale: float) -> str:
    """Return one line, with an arrow head at its target if the link runs one way."""
    a, b = (picture.positions[i] * [scale, -scale] for i in (line.source, line.target))
    colour = NEGATIVE if line.negative else "currentColor"
    # a quadratic Bézier curve; an arrow ends at the edge of the node
    direction = b - a
    bend = 0.5 * (a + b) + 2 * BEND * np.array([-direction[1], direction[0]]) * 0.5 if line.bent else 0.5 * (a + b)
    into = (b - bend) / (np.hypot(*(b - bend)) or 1.0)
    tip = b - into * picture.radius * scale if line.arrow else b
    path = f"M{a[0]:.1f} {a[1]:.1f}Q{bend[0]:.1f} {bend[1]:.1f} {tip[0]:.1f} {tip[1]:.1f}"
    head = ""
    if line.arrow:
        side = np.array([-into[1], into[0]]) * 3.5
        back = tip - into * 8.0
        corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in (tip, back + side, back - side))
        head = f'<polygon points="{corners}" fill="{colour}" opacity="0.8"/>'
    return f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="{line.width:.2g}" opacity="0.55"/>{head}'


def _svg_node(picture: Picture, i: int, scale: float) -> str:
    """Return one node, with its label if the circle is large enough."""
    (x, y), k = picture.positions[i] * [scale, -scale], picture.kind[i]
    name = picture.names[k]
    title = f"<title>{escape(f'node {picture.labels[i]}' + (f', {name}' if name else ''))}</title>"
    colour = COLOURS[k % len(COLOURS)]
    dot = f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{picture.radius * scale:.1f}" fill="{colour}">{title}</circle>'
    if picture.radius < NUMBERED:
        return dot
    size = min(picture.radius * scale * 1.1, 12.0)
    return dot + (
        f'<text x="{x:.1f}" y="{y + 0.35 * size:.1f}" fill="#fff" font-size="{size:.1f}" text-anchor="middle" '
        f'font-family="sans-serif">{escape(picture.short_label(i))}</text>'
    )
