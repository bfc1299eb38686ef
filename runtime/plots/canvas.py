"""The axes that plots are drawn into, in the style of the figures."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from matplotlib.axes import Axes

from .style import context, new_figure

SIZE = (4.8, 3.4)
"""Width and height of a new figure in inches."""


@contextmanager
def canvas(ax: Axes | None) -> Iterator[Axes]:
    """Yield the axes, or those of a new figure, within the style of the figures."""
    if ax is not None and not isinstance(ax, Axes):
        raise TypeError(f"ax: found {type(ax).__name__}; expected matplotlib axes, e.g. plt.subplots()[1]")
    with context():
        yield new_figure(SIZE).add_subplot() if ax is None else ax
