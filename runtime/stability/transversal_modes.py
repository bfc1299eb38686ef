"""The transversal modes of a network over the cells of a sweep: which cells share a synchronous orbit, and their strengths."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from synchain.models.scenes.scene import Scene, check_scene
from synchain.models.spectra.joint import JointEigenvalue, joint_spectrum


@dataclass(frozen=True, slots=True)
class SharedOrbit:
    """Cells that differ only in what does not move their synchronous orbit."""

    cells: np.ndarray  # (c,): the cells
    numbers: dict[str, float]  # parameters of all of them that the orbit depends on
    strengths: np.ndarray  # (m,) or (m, layers): the strengths -sigma gamma of all modes of all cells, each once
    place: np.ndarray  # (c, modes): where in `strengths` the modes of each cell are


def transversal_modes(scene: Scene) -> tuple[JointEigenvalue, ...]:
    """Return the distinct joint eigenvalues of the layers of a network, without one mode of equal states."""
    modes = joint_spectrum(tuple(graph for _, graph in scene.model.linked))
    return tuple(mode for mode in modes if any(mode.values) or mode.multiplicity > 1)


def still_strengths(scene: Scene) -> set[str]:
    """Return the strengths that do not move the synchronous orbit: those of layers whose links vanish between equal states."""
    pairs = zip(scene.strengths, scene.equations.layers, strict=True)
    return {name for name, layer in pairs if all(edge.diffusive for _, edge in layer.edge_of)}


def unused_axes(scene: Scene) -> set[str]:
    """Return the axes on which nothing depends that is computed for given strengths of modes or of links."""
    axes = {axis.name for axis in check_scene(scene).axes}
    return axes & still_strengths(scene) if axes else set()


def shared_orbits(scene: Scene, columns: Mapping[str, np.ndarray]) -> Iterator[SharedOrbit]:
    """Yield the cells of a sweep by their synchronous orbits. Shapes: columns (cells,)."""
    (count,) = {len(column) for column in columns.values()} or {1}
    gamma = np.array([mode.values for mode in transversal_modes(scene)])
    names, still = scene.strengths, still_strengths(scene)
    gamma = gamma if len(names) > 1 else gamma[:, 0]
    sigma = [np.broadcast_to(columns.get(name, np.array(scene.parameters[name])), (count,)) for name in names]
    each = np.stack(sigma, axis=-1)[:, None, :] if len(names) > 1 else sigma[0][:, None]
    own = [name for name in columns if name in scene.parameters and name not in still]
    groups: dict[tuple[float, ...], list[int]] = defaultdict(list)
    for cell in range(count):
        groups[tuple(float(columns[name][cell]) for name in own)].append(cell)
    for values, cells in groups.items():
        asked = -each[cells] * gamma
        strengths, place = np.unique(asked.reshape(-1, *asked.shape[2:]), axis=0, return_inverse=True)
        numbers = dict(zip(own, values, strict=True))
        yield SharedOrbit(np.array(cells), numbers, strengths, place.reshape(asked.shape[:2]))
