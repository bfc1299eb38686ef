"""The energy of the network of a scene."""

from __future__ import annotations

from ..networks.energy_terms import EnergyTerms, energy_of
from .scene import Scene

__all__ = ["energy_terms"]


def energy_terms(scene: Scene) -> EnergyTerms:
    """Return the energy of a scene's network.

    Raises ValueError, as `energy_of` does, for a network without an energy.
    """
    return energy_of(scene.model, scene.varied)
