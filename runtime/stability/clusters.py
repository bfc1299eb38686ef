"""Whether a cluster state of a network is stable: exponents of the differences within its clusters, block by block.

One orbit of the quotient network carries a deviation for each block and one for the motion of the clusters themselves
(Pecora, Sorrentino, Hagerstrom, Murphy & Roy, Nat. Commun. 5, 4079 (2014)).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from tqdm import tqdm

from synchain.models.dynamics.variational import Variation, clustered
from synchain.models.graphs.clusters import Clusters, clusters
from synchain.models.scenes.scene import Scene

from ..cells.initial_modes import with_modes
from ..support.arrays import averaging
from .averages import Batches
from .carrier import Carrier
from .orbits import unit_of_time
from .transversal import one_cell

__all__ = ["ClusterExponents", "cluster_exponents"]

ANSWERS = {-1: "stable", 0: "undecided within the error", 1: "unstable"}


@dataclass(frozen=True, slots=True)
class ClusterExponents:
    """Largest transversal exponent (blocks,) of each block of a cluster state, per unit of non-dimensional time, with its
    standard error.

    `motion` is the largest exponent of the clusters' own motion, with its error; `separation` (clusters, clusters) the
    largest difference of two clusters' states seen at the ends of blocks: 0 where two have merged, so that the exponents
    are those of a coarser state.  `time` is the length averaged over.
    """

    state: Clusters
    exponent: np.ndarray
    stderr: np.ndarray
    motion: float
    motion_error: float
    separation: np.ndarray
    time: float

    @property
    def verdicts(self) -> tuple[str, ...]:
        """In words for each block: stable or unstable by more than two standard errors, else undecided."""
        signs = np.where(np.abs(self.exponent) > 2.0 * self.stderr, np.sign(self.exponent), 0.0)
        return tuple(ANSWERS[int(sign)] for sign in signs)

    @property
    def intertwined(self) -> tuple[tuple[int, ...], ...]:
        """The clusters of each block: they lose their synchrony together."""
        return tuple(block.clusters for block in self.state.blocks)

    @property
    def merged(self) -> tuple[tuple[int, int], ...]:
        """Pairs of clusters that were never seen more than 1e-9 apart: the motion is that of a coarser partition."""
        first, second = np.nonzero(np.triu(self.separation < 1e-9, 1))
        return tuple((int(a), int(b)) for a, b in zip(first, second, strict=True))

    def as_dict(self) -> dict[str, Any]:
        """JSON-ready: classes, blocks (clusters, nodes, exponent, stderr, verdict), motion and its error, merged, time."""
        rows = zip(self.state.blocks, self.exponent, self.stderr, self.verdicts, strict=True)
        return {
            "classes": list(self.state.classes),
            "blocks": [
                {"clusters": list(block.clusters), "nodes": sorted({i for pair in block.pairs for i in pair}),
                 "exponent": float(found), "stderr": float(error), "verdict": words}
                for block, found, error, words in rows
            ],
            "motion": self.motion,
            "motion_stderr": self.motion_error,
            "merged": [list(pair) for pair in self.merged],
            "time": self.time,
        }  # fmt: skip


def cluster_exponents(
    scene: Scene,
    state: Clusters | Sequence[int],
    *,
    precision: float = 1e-3,
    periods: float = 5000,
    transient: float = 300,
    rtol: float = 1e-8,
    seed: int = 0,
    show_progress: bool | None = False,
    **parameters: float,
) -> ClusterExponents:
    """Return the transversal exponents of a cluster state of a scene's network at its coupling strength.

    `state` is a partition of the nodes, from `synchain.models.graphs.clusters` or as the cluster of each node; clusters start as
    their first nodes do.  Times count periods of the drive, or 2 pi where there is none.  After `transient` the averages run
    until every standard error is below `precision`, or for `periods`.  `rtol` is the tolerance of the integration, never
    looser than what the friction law asks for; `seed` chooses the first deviations.

    Raises ValueError for a partition that is not balanced or of another graph, for a coupling that is not linear in the
    difference of states, more than eight clusters, and time dependence without a known period; FloatingPointError where
    an integration fails.
    """
    precision, periods, transient, seed = averaging(precision, periods, transient, seed)
    scene = one_cell(cluster_exponents, scene, rtol, parameters)
    found = _of_graph(scene, state)
    variation, unit = clustered(scene.equations, found), unit_of_time(scene)
    carrier = _carrier(scene, found, variation, seed)
    for _ in range(round(transient)):
        carrier.advance(unit)
    batches, apart = Batches(unit), np.zeros((found.quotient.n,) * 2)
    with tqdm(total=math.ceil(periods), unit="period", disable=not show_progress and show_progress is not None) as bar:
        while batches.blocks < periods:
            batches.add(carrier.advance(unit))
            apart = np.maximum(apart, _differences(carrier.state[0], found.quotient.n, _deviating(variation)))
            bar.update(1)
            if batches.due and np.all(batches.error() <= precision):
                break
    mean, error, time = batches.mean()[0], batches.error_by_start()[0], batches.blocks * unit
    return ClusterExponents(found, mean[1:], error[1:], float(mean[0]), float(error[0]), apart, time)


def _of_graph(scene: Scene, state: Clusters | Sequence[int]) -> Clusters:
    """The partition with its blocks, proved to belong to the scene's graph."""
    classes = state.classes if isinstance(state, Clusters) else state
    found = clusters(scene.topology, classes)
    if isinstance(state, Clusters) and (found.quotient.links, found.blocks) != (state.quotient.links, state.blocks):
        graph = scene.topology
        raise ValueError(
            f"cluster state {classes} belongs to another graph than {graph.name}({graph.n}); make it with clusters(graph, "
            "classes)"
        )
    return found


def _carrier(scene: Scene, found: Clusters, variation: Variation, seed: int) -> Carrier:
    """The quotient's orbit with one deviation along it and one in each block, which stay there."""
    firsts = [members[0] for members in found.members]
    state = np.array([[values[i] for values in scene.initial.values() for i in firsts]])
    numbers = np.array([[scene.parameters[name] for name in variation.orbit.parameters]])
    state = with_modes(variation.orbit, state, numbers)
    components = _deviating(variation)
    parts = list(_parts(found, components))
    carrier = Carrier.make(scene, variation, state, numbers, np.full((1, len(parts)), scene.parameters["sigma"]), 1)
    random = np.random.default_rng(seed)
    deviations = np.zeros((1, variation.size, len(parts)))
    for k, part in enumerate(parts):
        deviations[0, part, k] = random.normal(size=part.stop - part.start)
    carrier.point(deviations)
    return carrier


def _deviating(variation: Variation) -> int:
    """Components of an oscillator that deviate: all but the mode of a contact."""
    return len(variation.orbit.node.continuous)


def _parts(found: Clusters, components: int) -> Iterator[slice]:
    """Where the clusters' motion and each block stand among the coordinates of the variational equation."""
    first, last = 0, found.quotient.n * components
    yield slice(first, last)
    for block in found.blocks:
        first, last = last, last + len(block.nodes) * components
        yield slice(first, last)


def _differences(state: np.ndarray, count: int, components: int) -> np.ndarray:
    """Largest difference between the first components of every two of `count` clusters."""
    rows = state.reshape(-1, count)[:components]
    return np.asarray(np.abs(rows[:, :, None] - rows[:, None, :]).max(axis=0))
