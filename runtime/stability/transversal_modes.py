"""Find the transversal modes of a network in the cells of a sweep, and group the cells by synchronous orbit."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from synchain.models.inputs.checks import listed
from synchain.models.scenes.scene import Scene, check_scene
from synchain.models.spectra.joint import JointEigenvalue, commute, joint_spectrum
from synchain.models.symmetries.clusters import clusters

LARGEST, NODES = 16, 128
"""Most differences in a block, and most nodes whose differences are separated into blocks (choices)."""


@dataclass(frozen=True, slots=True)
class SharedOrbit:
    """Cells that have the same synchronous orbit."""

    cells: np.ndarray  # (c,): indices of the cells
    parameters: dict[str, float]  # values of the parameters that change the orbit
    # (m,), (m, layers) or (m, layers, size, size): the distinct strengths -sigma gamma of all modes of all cells
    strengths: np.ndarray
    place: np.ndarray  # (c, modes): index in `strengths` of each mode of each cell


@dataclass(frozen=True, slots=True)
class TransversalBlock:
    """Differences of nodes that layers without common eigenvectors do not separate further."""

    # (layers, size, size): the matrix of each layer; blocks of all modes have one size, and repeat smaller ones along the
    # diagonal
    values: np.ndarray
    size: int  # number of coordinates, without repetitions
    nodes: tuple[int, ...]  # the nodes that differ
    multiplicity: int

    def __str__(self) -> str:
        names = listed(f"node_{i + 1}" for i in self.nodes).replace("node_", "")
        return f"({self.size} difference{'s' * (self.size > 1)} of the nodes {names})"


def transversal_modes(scene: Scene) -> tuple[JointEigenvalue, ...] | tuple[TransversalBlock, ...]:
    """Return the distinct joint eigenvalues of the layers of a network, without the mode of synchronous motion.

    Layers that do not commute have the finest blocks of their matrices instead, of at most LARGEST differences.
    """
    graphs = tuple(graph for _, graph in scene.model.linked)
    if commute(graphs):
        modes = joint_spectrum(graphs)
        return tuple(mode for mode in modes if any(mode.values) or mode.multiplicity > 1)
    n = graphs[0].n
    blocks = clusters(graphs, [0] * n).blocks if n <= NODES else ()
    largest = max((len(block.cluster_of) for block in blocks), default=n - 1)
    if largest > LARGEST:
        raise ValueError(
            f"transversal modes: found layers that do not commute, and blocks of {largest} differences; expected at most {LARGEST}; "
            "lyapunov_spectrum(scene, count=…) computes exponents of the whole network"
        )
    size = math.lcm(*(len(block.cluster_of) for block in blocks))
    return tuple(
        TransversalBlock(
            np.array([np.kron(np.eye(size // len(rows)), np.array(rows, dtype=float)) for rows in block.matrices]),
            len(block.cluster_of),
            block.nodes,
            block.multiplicity,
        )
        for block in blocks
    )


def still_strengths(scene: Scene) -> set[str]:
    """Return strengths that do not change the synchronous orbit: of links that vanish between equal states."""
    pairs = zip(scene.strengths, scene.equations.layers, strict=True)
    return {name for name, layer in pairs if all(edge.diffusive for _, edge in layer.edge_of)}


def unused_axes(scene: Scene) -> set[str]:
    """Return the axes of strengths that do not change the synchronous orbit, nor the exponents at given strengths."""
    axes = {axis.name for axis in check_scene(scene).axes}
    return axes & still_strengths(scene) if axes else set()


def shared_orbits(scene: Scene, columns: Mapping[str, np.ndarray]) -> Iterator[SharedOrbit]:
    """Yield the cells of a sweep, grouped by synchronous orbit. Shapes: columns (cells,)."""
    (count,) = {len(column) for column in columns.values()} or {1}
    gamma = np.array([mode.values for mode in transversal_modes(scene)])
    names, still = scene.strengths, still_strengths(scene)
    gamma = gamma if len(names) > 1 else gamma[:, 0]
    sigma = [np.broadcast_to(columns.get(name, np.array(scene.parameters[name])), (count,)) for name in names]
    each = np.stack(sigma, axis=-1)[:, None, :] if len(names) > 1 else sigma[0][:, None]
    each = each.reshape(*each.shape, *(1 for _ in gamma.shape[each.ndim - 1 :]))
    moving = [name for name in columns if name in scene.parameters and name not in still]
    groups: dict[tuple[float, ...], list[int]] = defaultdict(list)
    for cell in range(count):
        groups[tuple(float(columns[name][cell]) for name in moving)].append(cell)
    for values, cells in groups.items():
        alpha = -each[cells] * gamma  # (c, modes), (c, modes, layers) or (c, modes, layers, size, size)
        strengths, place = np.unique(alpha.reshape(-1, *alpha.shape[2:]), axis=0, return_inverse=True)
        parameters = dict(zip(moving, values, strict=True))
        yield SharedOrbit(np.array(cells), parameters, strengths, place.reshape(alpha.shape[:2]))
