"""Style of the figures, and functions that write their files.

Every figure has an opaque white background, so that it looks the same on paper and on light and dark screens. The
colours of Okabe & Ito (https://jfly.uni-koeln.de/color/) are distinct for colour-blind readers; line style or position
repeats their meaning. Widths fit one column of a journal (88 mm) without scaling, with text of 7 to 8 points. Files
depend only on the numbers: they contain no dates, and fixed ids. Text in SVG files stays text.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from synchain.models.presentation.writer import Latex

from ..prediction.intervals import Interval
from ..support.files import whole_file

BLACK, BLUE, ORANGE, GREEN, PURPLE, SKY = "#1a1a1a", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9"
GREY = "#d9d9d9"
COLUMN = 3.46  # width of one column in inches
DPI = 300  # resolution of PNG files, in dots per inch

# Settings of matplotlib for all figures; all other settings have the defaults of matplotlib.
SETTINGS: dict[str, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Verdana", "Arial", "Helvetica", "sans-serif"],
    "font.size": 8.0,
    "axes.labelsize": 8.5,
    "axes.titlesize": 8.5,
    "legend.fontsize": 7.0,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "mathtext.fontset": "dejavusans",
    "axes.linewidth": 0.7,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.top": True,
    "ytick.right": True,
    "lines.linewidth": 1.0,
    "lines.markersize": 3.0,
    "figure.facecolor": "white",
    "axes.facecolor": "white",
    "savefig.facecolor": "white",
    "savefig.transparent": False,
    "text.color": BLACK,
    "axes.edgecolor": BLACK,
    "axes.labelcolor": BLACK,
    "xtick.color": BLACK,
    "ytick.color": BLACK,
    "legend.frameon": False,
    "axes.axisbelow": False,
    "svg.fonttype": "none",
    "svg.hashsalt": "synchain",
    "figure.dpi": DPI,
    "savefig.dpi": DPI,
    "path.simplify": True,
    "image.composite_image": True,
}


@contextmanager
def context() -> Iterator[None]:
    """Use matplotlib with this style; restore the settings of the user afterwards."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(SETTINGS)
        yield


def symbol(name: str) -> str:
    """Return a parameter or a state as a formula; in an expression, such as "maximum(x_1)", each of them."""
    return re.sub(r"[^\W\d]\w*\b(?!\()", lambda found: f"${Latex().letter(found[0])}$", name)


def new_figure(size: tuple[float, float]) -> Figure:
    """Return an empty figure without a window; use inside `context`."""
    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save(figure: Figure, folder: Path, name: str) -> list[Path]:
    """Write `<name>.png` and `<name>.svg`, each completely or not at all; use inside `context`."""
    written = []
    for kind, metadata in (("png", {"Software": None}), ("svg", {"Date": None, "Creator": None})):
        path = folder / f"{name}.{kind}"
        with whole_file(path) as temporary:
            figure.savefig(temporary, format=kind, dpi=DPI, metadata=metadata)
        written.append(path)
    return written


def bands(axes: Axes, intervals: Sequence[Interval], *, horizontal: bool = False, **options: Any) -> None:
    span = axes.axhspan if horizontal else axes.axvspan
    for low, high in intervals:
        span(low, high, **{"color": GREY, "linewidth": 0.0, "zorder": 0.0, **options})


def bracket(axes: Axes, intervals: Sequence[Interval], height: float, color: str, text: str = "") -> None:
    """Draw thin bars with end strokes over intervals; the limits of x must be set before."""
    transform = axes.get_xaxis_transform()  # x in data, y as a fraction of the height
    first, last = axes.get_xlim()
    for low, high in intervals:
        stroke = 1.0 if high - low > 0.01 * (last - first) else 0.4  # narrow intervals side by side: thin strokes
        axes.plot(
            [low, high],
            [height, height],
            color=color,
            linewidth=1.0,
            transform=transform,
            zorder=4,
            marker="|",
            markersize=4.0,
            markeredgewidth=stroke,
            clip_on=False,
        )
    if text and intervals:
        axes.annotate(
            text,
            (intervals[-1][1], height),
            xycoords=transform,
            xytext=(4, 0),
            textcoords="offset points",
            color=color,
            fontsize=6.5,
            va="center",
            ha="left",
        )


def note(axes: Axes, text: str) -> None:
    """Write a remark above the axes at the right; skip an empty text."""
    if text:
        axes.annotate(
            text,
            (1.0, 1.0),
            xycoords="axes fraction",
            xytext=(0, 2),
            textcoords="offset points",
            fontsize=6.5,
            color=ORANGE,
            ha="right",
            va="bottom",
        )


def failures(failed: int, cells: int) -> str:
    """Return the remark on cells that did not finish; empty if all did."""
    return f"{failed} of {cells} cells failed and are left out" if failed else ""
