"""The figures of the paper, and figures of the exponents that explain them; one file for each kind of figure.

A figure is a module of this folder with

* NAMES: the figures of the module, and optionally EXTRA: figures that are drawn only on request by name,
* SIZE: width and height in inches,
* ``compute(name, runs) -> data``: compute the numbers by public functions; `FigureRuns` shares runs between figures,
* ``texts(data) -> dict``: return the text of each file beside the drawing, by the ending of its name: ".csv" with the
  numbers of the drawing, in some figures "_ranges.csv" and ".md",
* ``draw(figure, data) -> axes``: draw into an empty matplotlib figure and return its axes.

Discovery is a listing of the folder: a new figure is one new file.
"""

from __future__ import annotations

import pkgutil
from functools import cache
from importlib import import_module
from types import ModuleType

from synchain.models.inputs.checks import suggestion

__all__ = ["load", "names"]


def names(extra: bool = False) -> tuple[str, ...]:
    """List the names of the figures; with `extra` also of figures that are drawn only on request by name."""
    return tuple(sorted(name for name, (_, by_default) in _listing().items() if by_default or extra))


def load(name: str) -> ModuleType:
    listing = _listing()
    if name not in listing:
        raise ValueError(f"unknown figure {name!r}; known: {', '.join(names(extra=True))}{suggestion(name, listing)}")
    return listing[name][0]


@cache
def _listing() -> dict[str, tuple[ModuleType, bool]]:
    """Return for each figure its module, and False if the figure is drawn only on request by name."""
    listing: dict[str, tuple[ModuleType, bool]] = {}
    for entry in pkgutil.iter_modules(__path__):
        module = import_module(f".{entry.name}", __name__)
        listing.update({name: (module, True) for name in getattr(module, "NAMES", ())})
        listing.update({name: (module, False) for name in getattr(module, "EXTRA", ())})
    return listing
