"""Random starts and parameter values of nodes and links, drawn anew for each realisation."""

from __future__ import annotations

from .offers import offer

HOMES = {
    "lorentzian": "models.sweeps.distribution",
    "normal": "models.sweeps.distribution",
    "uniform": "models.sweeps.distribution",
}

__all__ = list(HOMES)
__getattr__, __dir__ = offer(__name__, HOMES)
