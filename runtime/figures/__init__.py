"""The figures of the paper and of the exponents behind them, one file for each kind.

A figure is a module of this folder with

* NAMES: the figures that it makes, and perhaps EXTRA: more of them, made only when asked for by name,
* SIZE: width and height in inches,
* ``compute(name, runs) -> data``: the numbers, through the runs that a `FigureRuns` shares between figures,
* ``table(data) -> Table``: the same numbers as columns; perhaps ``ranges(data) -> Table``, ``document(data) -> str``
  (Markdown) beside it,
* ``draw(axes, data) -> axes``: takes and returns matplotlib axes and never shows anything,
* perhaps ``layout(figure) -> axes`` where it needs more than one pair of axes.

Discovery is a listing of the folder: a new figure is one new file.
"""

from __future__ import annotations

import pkgutil
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

from synchain.models.inputs.checks import suggestion

if TYPE_CHECKING:
    from .figure_runs import FigureRuns
    from .tables import Table

__all__ = ["Drawing", "load", "names"]


@dataclass(frozen=True, slots=True)
class Drawing:
    """One figure: a name and the module that makes it."""

    name: str
    module: ModuleType

    @property
    def size(self) -> tuple[float, float]:
        """Width and height in inches."""
        return self.module.SIZE

    def compute(self, runs: FigureRuns) -> Any:
        """Return the numbers of the figure, simulated where the study has not got them yet."""
        return self.module.compute(self.name, runs)

    def table(self, data: Any) -> Table:
        """Return the numbers as columns for `<name>.csv`."""
        return self.module.table(data)

    def layout(self, figure: Any) -> Any:
        """Put the axes that `draw` needs into a matplotlib figure and return them."""
        return self.module.layout(figure) if hasattr(self.module, "layout") else figure.add_subplot()

    def draw(self, axes: Any, data: Any) -> Any:
        """Draw into axes from `layout` and return them."""
        return self.module.draw(axes, data)


def names(extra: bool = False) -> tuple[str, ...]:
    """Return the names of all figures, sorted; with `extra` also those that are made only when asked for."""
    return tuple(sorted(name for name, (_, wanted) in _listing().items() if wanted or extra))


def load(name: str) -> Drawing:
    """Return the figure `name`; ValueError with the known names where there is none."""
    known = _listing()
    if name not in known:
        raise ValueError(f"unknown figure {name!r}; known: {', '.join(names(extra=True))}{suggestion(name, known)}")
    return Drawing(name, known[name][0])


@cache
def _listing() -> dict[str, tuple[ModuleType, bool]]:
    """Module of each name, and whether it is made without being asked for."""
    found: dict[str, tuple[ModuleType, bool]] = {}
    for entry in pkgutil.iter_modules(__path__):
        if entry.name.startswith("_"):
            continue
        module = import_module(f".{entry.name}", __name__)
        found.update({name: (module, True) for name in getattr(module, "NAMES", ())})
        found.update({name: (module, False) for name in getattr(module, "EXTRA", ())})
    return found
