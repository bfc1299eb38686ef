"""The energy of the network of a scene."""

from __future__ import annotations

from ..networks.energy_terms import EnergyTerms, energy_of
from .scene import Scene

__all__ = ["energy_terms"]


def energy_terms(scene: Scene) -> EnergyTerms:
    """Return the energy of a scene's network.

    Raises ValueError, as `energy_of` does, for a network without an energy.

    See Also
    --------
    synchain.energy_function
    synchain.export.latex

    Examples
    --------
    >>> import synchain as sc
    >>> energy, power = sc.energy_terms(sc.Scene("harmonic", "spring", sc.graphs.chain(2))).whole()
    >>> print(energy)
    sigma*(x_1 - x_2)**2/2 + v_1**2/2 + v_2**2/2 + x_1**2/2 + x_2**2/2
    """
    return energy_of(scene.model, scene.varied)
