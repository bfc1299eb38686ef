"""The figures of the paper and of the exponents behind them, one file for each kind.

A figure is a module of this folder with

* NAMES: the figures that it makes, and optionally EXTRA: figures made only if asked for by name,
* SIZE: width and height in inches,
* ``compute(name, runs) -> data``: the numbers, through the `FigureRuns` that figures share,
* ``table(data) -> Table``: the same numbers as columns, and optionally ``ranges(data) -> Table``
  and ``document(data) -> str`` (Markdown),
* ``draw(axes, data) -> axes``: takes and returns matplotlib axes and never shows anything,
* optionally ``layout(figure) -> axes`` if it needs more than one pair of axes.

Discovery is a listing of the folder: a new figure is one new file.
"""

from __future__ import annotations

import pkgutil
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

from synchain.models.inputs.checks import suggestion

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..plots.csv_table import Table
    from .figure_runs import FigureRuns

__all__ = ["Drawing", "load", "names"]


@dataclass(frozen=True, slots=True)
class Drawing:
    """A figure and the module that makes it."""

    name: str  # name of the figure
    module: ModuleType  # module of this folder

    @property
    def size(self) -> tuple[float, float]:
        """Width and height in inches."""
        width, height = self.module.SIZE
        return float(width), float(height)

    def compute(self, runs: FigureRuns) -> object:
        """Compute the data of the figure, through runs that other figures may have made already."""
        return self.module.compute(self.name, runs)

    def table(self, data: object) -> Table:
        """Return the numbers as columns for `<name>.csv`."""
        table: Table = self.module.table(data)
        return table

    def layout(self, figure: Figure) -> object:
        """Add the axes that `draw` needs to a matplotlib figure and return them."""
        return self.module.layout(figure) if hasattr(self.module, "layout") else figure.add_subplot()

    def ranges(self, data: object) -> Table | None:
        """Return the ranges as columns for `<name>_ranges.csv`, or None if the figure has none."""
        table: Table | None = self.module.ranges(data) if hasattr(self.module, "ranges") else None
        return table

    def document(self, data: object) -> str | None:
        """Return the text of `<name>.md`, or None if the figure has none."""
        text: str | None = self.module.document(data) if hasattr(self.module, "document") else None
        return text

    def draw(self, axes: object, data: object) -> object:
        """Draw into axes from `layout` and return them."""
        return self.module.draw(axes, data)


def names(extra: bool = False) -> tuple[str, ...]:
    """List the names of the figures."""
    return tuple(sorted(name for name, (_, wanted) in _listing().items() if wanted or extra))


def load(name: str) -> Drawing:
    """Return a figure by its name."""
    known = _listing()
    if name not in known:
        raise ValueError(f"unknown figure {name!r}; known: {', '.join(names(extra=True))}{suggestion(name, known)}")
    return Drawing(name, known[name][0])


@cache
def _listing() -> dict[str, tuple[ModuleType, bool]]:
    """Module of each name, and whether the figure is made by default."""
    figures: dict[str, tuple[ModuleType, bool]] = {}
    for entry in pkgutil.iter_modules(__path__):
        if entry.name.startswith("_"):
            continue
        module = import_module(f".{entry.name}", __name__)
        figures.update({name: (module, True) for name in getattr(module, "NAMES", ())})
        figures.update({name: (module, False) for name in getattr(module, "EXTRA", ())})
    return figures
