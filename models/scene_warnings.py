"""Sentences about scenes that are allowed but probably not meant."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .scene import Scene
    from .topology import Topology

__all__ = ["warnings", "zero_multiplicity"]


def zero_multiplicity(graph: Topology) -> int:
    """Return how often zero is an eigenvalue of the connectivity matrix; 1 means one connected whole.

    With links both ways and positive weights it is the number of unconnected parts; else the exact spectrum
    decides.
    """
    if graph.symmetric and all(weight > 0 for _, _, weight in graph.links):
        return graph.components
    zero = [eigenvalue.multiplicity for eigenvalue in graph.spectrum.eigenvalues if eigenvalue.exact == 0]
    return sum(zero)


def warnings(scene: Scene) -> tuple[str, ...]:
    """Return the sentences for one scene, none where all is well."""
    graph, found = scene.topology, []
    multiplicity = zero_multiplicity(graph)
    if multiplicity > 1:
        parts = graph.components
        reason = f"is not connected ({parts} parts)" if parts > 1 else "has nodes that cannot reach one another"
        found.append(
            f"topology {graph.name}({graph.n}) {reason}: zero is an eigenvalue of multiplicity "
            f"{multiplicity}, so there is no complete synchronisation by coupling (a common drive may still lock the "
            "parts); join them by links"
        )
    negative = [weight for _, _, weight in graph.links if weight < 0]
    if negative:
        found.append(
            f"topology {graph.name}({graph.n}) has negative weights, which drive oscillators apart; if its matrix is a "
            "Laplacian D - A, negate it: the connectivity matrix is A - D"
        )
    moved = {axis.name.rpartition("_")[0] for axis in scene.axes} & set(scene.initial)
    if "sync_error" in scene.record and not moved and all(len(set(x)) == 1 for x in scene.initial.values()):
        found.append(
            "all oscillators start from the same state, so the synchronisation error stays 0 whatever the "
            "coupling; give them different initial states"
        )
    return tuple(found)
