"""Find modes of a linear network that are absent from the network's start."""

from __future__ import annotations

import numpy as np

from synchain.models.dynamics.equations import Equations
from synchain.models.scenes.scene import Scene

ROUNDING = 1e-12
"""A mode is absent if its share of the distances between oscillators is below this number (a choice)."""


def hidden_modes(scene: Scene) -> tuple[str, ...]:
    """Return a warning if some transversal modes are absent from the start of a linear network, else nothing.

    The modes of linear oscillators with linear links move independently. A mode that is absent from the start is
    excited by rounding alone, so that its growth shows late. Example: the mode (1, -2, 1) is absent from the default
    start of a chain of three, 0.30, 0.28, 0.26. There is no warning for nonlinear networks, in which modes excite one
    another, for all-to-all networks, which have a single transversal eigenvalue, and for one-way links, which are not
    examined.
    """
    graph = scene.topology
    if graph.all_to_all is not None or not graph.symmetric or not _linear(scene.equations):
        return ()
    matrix = np.zeros((scene.n, scene.n))
    for target, source, weight in graph.links:
        matrix[target, source] += float(weight)
        matrix[target, target] -= float(weight)
    start = np.array(list(scene.initial.values())).T
    apart = start - start.mean(axis=0)
    values, modes = np.linalg.eigh(matrix)
    parts, size = modes.T @ apart, np.linalg.norm(apart)
    same = ROUNDING * np.abs(values).max() * scene.n
    hidden = [
        value
        for value in scene.spectrum.values
        if value != 0.0 and np.linalg.norm(parts[np.abs(values - value) <= same]) <= ROUNDING * size
    ]
    if not hidden or size == 0.0:
        return ()
    named = ", ".join(f"{value:.4g}" for value in hidden[:3]) + (", …" if len(hidden) > 3 else "")
    return (
        f"the start has no part in the modes of gamma = {named}: in a linear network rounding alone excites them, so that "
        "a simulation notices late that they grow; give other initial states, e.g. random ones, {low, high}",
    )


def _linear(equations: Equations) -> bool:
    """Return True if oscillators are linear in their states, and links linear in the states of both ends."""
    nodes = ((node.state, (node.jacobian(), node.inertia)) for node in equations.nodes)
    edges = (
        (
            [s for end in edge.end_states for s in end],
            (edge.jacobian_here(), edge.jacobian_there(), edge.jacobian_beyond(), *edge.inertia),
        )
        for edge in equations.edges
    )
    return not equations.sticks and not any(
        e.free_symbols & set(states)
        for states, blocks in (*nodes, *edges)
        for block in blocks
        for row in block
        for e in row
    )
