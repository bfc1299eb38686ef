"""Values that a run keeps of each cell: the states, reduced over the nodes and over the window."""

from __future__ import annotations

from .offers import offer

HOMES = {
    "Observable": "models.dynamics.observable",
    "end": "models.dynamics.observable",
    "energy": "models.dynamics.observable",
    "maximum": "models.dynamics.observable",
    "mean": "models.dynamics.observable",
    "minimum": "models.dynamics.observable",
    "nodes": "models.dynamics.observable",
    "rate": "models.dynamics.observable",
    "variance": "models.dynamics.observable",
}

__all__ = list(HOMES)
__getattr__, __dir__ = offer(__name__, HOMES)
