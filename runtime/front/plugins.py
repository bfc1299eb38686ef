"""What files of models and of graphs assign and call, and the permission to run files by their path."""

from __future__ import annotations

from .offers import offer

HOMES = {
    "Family": "models.graphs.families",
    "FrictionLaw": "models.mechanics.contact",
    "Oscillator": "models.mechanics.oscillator",
    "allow_code": "models.inputs.plugin_files",
    "integer_option": "models.inputs.options",
    "integers_option": "models.inputs.options",
    "probability_option": "models.inputs.options",
}

__all__ = list(HOMES)
__getattr__, __dir__ = offer(__name__, HOMES)
