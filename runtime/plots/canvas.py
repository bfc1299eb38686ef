"""The axes that plots are drawn into."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from matplotlib.axes import Axes
from matplotlib.cbook import normalize_kwargs
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from .style import context, new_figure

SIZE = (4.8, 3.4)  # width and height in inches of figures without a window


@contextmanager
def off_screen() -> Iterator[tuple[Figure, Axes]]:
    """Yield a figure that belongs to no window, in the style of the figures, and its axes."""
    with context():
        figure = new_figure(SIZE)
        yield figure, figure.add_subplot()


def axes_of(ax: Axes | None) -> Axes:
    """Return the given axes, else pyplot's current axes (of a new figure if there are none), as xarray does."""
    if ax is None:
        import matplotlib.pyplot as plt

        axes: Axes = plt.gca()
        return axes
    if not isinstance(ax, Axes):
        raise TypeError(f"ax: found {type(ax).__name__}; expected matplotlib axes, e.g. plt.subplots()[1]")
    return ax


# Keywords of `scatter` and `pcolormesh` that are no properties of a Matplotlib artist.
KEYWORDS = {"s", "c", "cmap", "norm", "vmin", "vmax", "shading"}


def check_style(style: Mapping[str, Any], method: str, known: str) -> None:
    """Raise TypeError for a keyword that no artist of Matplotlib takes."""
    for name in normalize_kwargs(dict(style), Line2D):
        if name not in KEYWORDS and not any(hasattr(artist, f"set_{name}") for artist in (Line2D, PathCollection)):
            raise TypeError(
                f"unknown keyword {name!r} of {method}; known: {known}, and keywords of Matplotlib such as color, linewidth, cmap"
            )


def line_style(style: Mapping[str, Any], **defaults: Any) -> dict[str, Any]:
    """Return the style of a line: defaults, replaced by the style of the user, who may write `lw` for `linewidth`."""
    return {**defaults, **normalize_kwargs(dict(style), Line2D)}
