"""Sentences about scenes that are allowed but probably not meant."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ..mechanics.coupling import LagrangianCoupling
from ..mechanics.node_name import NodeName

if TYPE_CHECKING:
    from ..graphs.topology import Topology
    from .scene import Scene

__all__ = ["warnings", "zero_multiplicity"]

STIFF = 100.0
"""Frequency of a mode and number of its swings above which springs are called stiff."""


COUNTED = 200
"""Up to so many nodes zeros of a graph with negative weights are counted by its characteristic polynomial."""


def zero_multiplicity(graph: Topology) -> int:
    """Return how often zero is an eigenvalue of the connectivity matrix; 1 means one connected whole.

    With positive weights it is the number of groups that no other node acts on (J. S. Caughman, J. J. P. Veerman,
    Electron. J. Combin. 13, R39, 2006).  With negative weights it is at least that; up to COUNTED nodes it is exact.
    """
    leading = graph.leading_groups
    if graph.n > COUNTED or all(weight > 0 for _, _, weight in graph.links):
        return leading
    from ..spectra.characteristic import characteristic

    return next(k for k, c in enumerate(characteristic(graph).coeffs()) if c != 0)


def _stiff_springs(scene: Scene) -> list[str]:
    """A sentence where a mode of the springs swings so often that its phase error adds up to more than is asked for.

    The frequency of the fastest mode is at most sqrt(1 + 2 sigma d), d the largest weight at a node (Gershgorin).
    """
    if str(scene.coupling) != "spring" or not scene.topology.links:
        return []
    sigma = max([scene.parameters["sigma"], *(v for axis in scene.axes if axis.name == "sigma" for v in axis.values)])
    weights = [0.0] * scene.n
    for target, _, weight in scene.topology.links:
        weights[target] += abs(float(weight))
    fastest = math.sqrt(1.0 + 2.0 * sigma * max(weights))
    length = (scene.transient + scene.window) * (scene.period or 1.0 if scene.time_unit == "period" else 1.0)
    swings = fastest * length / (2.0 * math.pi)
    if fastest < STIFF or swings < STIFF:
        return []
    return [
        f"stiff springs: a mode of frequency {fastest:.3g} swings {swings:.3g} times, and the errors of its phase add up "
        "to more than rtol; tighten rtol until the result no longer changes"
    ]


def _vanishes(scene: Scene) -> bool:
    if not isinstance(scene.coupling, LagrangianCoupling) or scene.equations.mixed:
        return True
    return all(edge.diffusive for edge in scene.equations.edges)


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
    if scene.varied and graph.links:
        found.append(
            f"the nodes differ in {', '.join(scene.varied)}: equal states are no solution of this network, so there is no "
            "complete synchronisation; the synchronisation error stays above 0"
        )
    vanishing = not graph.links or _vanishes(scene)
    if not vanishing:
        found.append(
            f"coupling {str(scene.coupling)!r} does not vanish between oscillators in equal states, so that equal motion of all "
            "is no solution: there is no complete synchronisation; make it a function of differences"
        )
    found += _stiff_springs(scene)
    moved = {node.base for axis in scene.axes if (node := NodeName.parse(axis.name))} & set(scene.initial)
    same = not moved and all(len(set(x)) == 1 for x in scene.initial.values())
    if "sync_error" in scene.record and same and vanishing and not (scene.varied or scene.equations.mixed):
        found.append(
            "all oscillators start from the same state, so the synchronisation error stays 0 whatever the "
            "coupling; give them different initial states"
        )
    return tuple(found)
