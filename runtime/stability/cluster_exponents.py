"""Stability of cluster states: transversal exponents of a network, block by block.

One orbit of the quotient network carries a deviation for each block and one for the motion of the
clusters themselves.

Source: Pecora, Sorrentino, Hagerstrom, Murphy & Roy, Nat. Commun. 5, 4079 (2014).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import xarray as xr

from synchain.models.dynamics.reduction import without_drive
from synchain.models.dynamics.variational import Variation, clustered
from synchain.models.inputs.keywords import warn
from synchain.models.scenes.scene import Scene
from synchain.models.symmetries.clusters import Clusters, clusters

from ..cells.run_keywords import ONE_ORBIT, Given
from ..results.labelled import Labelled, as_json, dataset
from ..support.error_text import with_error
from ..support.execution import Execution
from ..support.progress import Hook
from .averages import Averaging, Batches, document_keywords
from .exponents import single_cell
from .orbits import OrbitProblem
from .variational_integrator import VariationalIntegrator

MERGED = 1e-9
"""Distance below which two clusters count as one."""

APPROACH = 0.5
"""Two clusters approach each other if their largest distance falls below this part of what it was earlier."""


class BlockVerdict(StrEnum):
    """Stability of one block of a cluster state."""

    STABLE = "stable"
    UNDECIDED = "undecided within the error"
    UNSTABLE = "unstable"


@dataclass(frozen=True, slots=True, repr=False)
class ClusterExponents(Labelled):
    """Transversal exponents of a cluster state.

    Parameters
    ----------
    state : Clusters
        The cluster state with its blocks.
    exponent : ndarray, shape (blocks,)
        Largest exponent of each block per unit of non-dimensional time.
    stderr : ndarray, shape (blocks,)
        Standard errors of `exponent`.
    motion : float
        Largest exponent of the clusters' own motion.
    motion_error : float
        Standard error of `motion`.
    separation : ndarray, shape (clusters, clusters)
        Largest difference between the states of two clusters at the ends of blocks of time. It is 0
        if the clusters have merged; then the exponents are those of a coarser state.
    time : float
        Time averaged over.
    approaching : tuple of (int, int)
        Pairs of clusters that have not merged and whose distance still falls; the exponents may be
        those of a coarser state.
    unit : str
        Unit in which transient and average are counted.
    """

    state: Clusters
    exponent: np.ndarray
    stderr: np.ndarray
    motion: float
    motion_error: float
    separation: np.ndarray
    time: float
    approaching: tuple[tuple[int, int], ...] = ()
    unit: str = ""

    @property
    def data(self) -> xr.Dataset:
        """Exponents over the blocks, and the distances of the clusters."""
        return dataset(
            {
                "exponent": (("block",), self.exponent, "largest transversal exponent per unit of time"),
                "stderr": (("block",), self.stderr, "standard errors"),
                "verdict": (("block",), [verdict.value for verdict in self.verdicts], "stability of the block"),
                "separation": (("cluster", "other"), self.separation, "largest distance of two clusters"),
                "class": (("node",), np.array(self.state.classes), "cluster of each node, counted from 0"),
                "motion": ((), self.motion, "largest exponent of the clusters' own motion"),
            },
            {"node": np.arange(1, len(self.state.classes) + 1)},
        )

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """The clusters, each block with its verdict, what has merged and what is about to."""
        members = [", ".join(str(i + 1) for i in nodes) for nodes in self.state.members]
        blocks = [
            f"{verdict} ({with_error(exponent, error)}): clusters {', '.join(str(c + 1) for c in block.clusters)}"
            for block, exponent, error, verdict in zip(
                self.state.blocks, self.exponent, self.stderr, self.verdicts, strict=True
            )
        ]
        pairs = (("merged", self.merged), ("approaching", self.approaching))
        return (
            ("clusters", "; ".join(f"{k}: {nodes}" for k, nodes in enumerate(members, 1))),
            *((f"block {k}", words) for k, words in enumerate(blocks, 1)),
            ("own motion", with_error(self.motion, self.motion_error)),
            *((name, _words(found)) for name, found in pairs if found),
            *((("unit", self.unit),) if self.unit else ()),
        )

    @property
    def verdicts(self) -> tuple[BlockVerdict, ...]:
        """Verdict on each block, decided if the exponent exceeds two standard errors."""
        signs = np.where(np.abs(self.exponent) > 2.0 * self.stderr, np.sign(self.exponent), 0.0)
        verdicts = {-1: BlockVerdict.STABLE, 0: BlockVerdict.UNDECIDED, 1: BlockVerdict.UNSTABLE}
        return tuple(verdicts[int(sign)] for sign in signs)

    @property
    def intertwined(self) -> tuple[tuple[int, ...], ...]:
        """The clusters of each block; they lose their synchrony together."""
        return tuple(block.clusters for block in self.state.blocks)

    @property
    def merged(self) -> tuple[tuple[int, int], ...]:
        """Pairs of clusters that never were more than 1e-9 apart; the motion is that of fewer
        clusters.
        """
        return _pairs(self.separation < MERGED)

    def as_dict(self) -> dict[str, object]:
        """Return the exponents for JSON.

        Returns
        -------
        dict
            classes, blocks (clusters, nodes, exponent, stderr, verdict), motion, motion_stderr,
            merged, approaching, time.
        """
        rows = zip(self.state.blocks, self.exponent, self.stderr, self.verdicts, strict=True)
        blocks = [
            {
                "clusters": block.clusters,
                "nodes": sorted({i for pair in block.pairs for i in pair}),
                "exponent": exponent,
                "stderr": error,
                "verdict": verdict.value,
            }
            for block, exponent, error, verdict in rows
        ]
        return as_json(
            {
                "classes": self.state.classes,
                "blocks": blocks,
                "motion": self.motion,
                "motion_stderr": self.motion_error,
                "merged": self.merged,
                "approaching": self.approaching,
                "time": self.time,
            }
        )


@document_keywords
def cluster_exponents(
    scene: Scene,
    state: Clusters | Sequence[int],
    *,
    precision: float = 1e-3,
    periods: float = 5000,
    transient: float = 300,
    rtol: float = 1e-8,
    seed: int = 0,
    show_progress: bool | None = None,
    progress: Hook | None = None,
    parameters: Mapping[str, float] | None = None,
    **more: float,
) -> ClusterExponents:
    """Compute the transversal exponents of a cluster state of a scene's network.

    Parameters
    ----------
    scene : Scene
        Network of at most eight clusters with its coupling strength.
    state : Clusters or sequence of int
        Partition of the nodes, from `synchain.models.symmetries.clusters` or as the cluster of each
        node. Each cluster starts from the state of its first node.
    {average}
    rtol : float
        Relative tolerance of the integration. The friction law may require a smaller one.
    seed : int
        Seed of the initial deviations.
    {progress}
    {parameters}

    Returns
    -------
    ClusterExponents

    Raises
    ------
    ValueError
        If the partition is not balanced or belongs to another graph, if the coupling is not linear
        in the difference of states, if there are more than eight clusters, or if time enters
        without a known period.
    FloatingPointError
        If the integration fails.

    Warns
    -----
    RuntimeWarning
        If clusters approach each other: their largest distance halves from the first to the second
        half of the motion after the first half of the transient.
    """
    averaging = Averaging(precision, periods, transient, seed, Execution(1, None, show_progress, progress))
    scene = single_cell(Given(cluster_exponents, parameters, more, ONE_ORBIT), scene, rtol)
    partition = _of_graph(scene, state)
    variation = clustered(without_drive(scene.equations, scene.parameters), partition)
    reporter = averaging.reporter()
    problem, integrator = _integrator(scene, partition, variation, averaging.seed)
    unit = problem.unit
    batches, dropped = Batches(unit), round(averaging.transient)
    gaps: list[np.ndarray] = []

    def advance() -> np.ndarray:
        growth = integrator.advance(unit)
        gaps.append(_differences(integrator.state[0], partition.quotient.n, _deviating(variation)))
        return growth

    with reporter:
        for _ in range(dropped):
            advance()
            reporter.advance(1)
        for _ in averaging.rounds(batches, batches.error, reporter):
            batches.add(advance())
        steps = integrator.error_of_steps(unit)
    apart = np.max(gaps[dropped:], axis=0)
    approaching = _pairs(_falls(np.array(gaps[dropped // 2 :])) & (apart >= MERGED))
    if approaching:
        warn(
            f"cluster_exponents: found clusters that approach each other, {_words(approaching)}; expected settled ones, "
            f"the exponents may be those of fewer clusters; raise transient = {averaging.transient:g}"
        )
    mean, error, time = batches.mean()[0], np.hypot(batches.error_by_start(), steps)[0], batches.time
    return ClusterExponents(
        partition, mean[1:], error[1:], float(mean[0]), float(error[0]), apart, time, approaching, str(problem.turns)
    )


def _of_graph(scene: Scene, state: Clusters | Sequence[int]) -> Clusters:
    """Compute the blocks of a partition and check that it belongs to the scene's graph."""
    classes = state.classes if isinstance(state, Clusters) else state
    partition = clusters(scene.topology, classes)
    content = (partition.quotient.links, partition.blocks)
    if isinstance(state, Clusters) and content != (state.quotient.links, state.blocks):
        graph = scene.topology
        raise ValueError(
            f"cluster state {classes} belongs to another graph than {graph.name}({graph.n}); make it with clusters(graph, "
            "classes)"
        )
    return partition


def _integrator(
    scene: Scene, partition: Clusters, variation: Variation, seed: int
) -> tuple[OrbitProblem, VariationalIntegrator]:
    """The quotient's orbit with one random deviation along it and one in each block."""
    firsts = [members[0] for members in partition.members]
    start = np.array([[values[i] for values in scene.initial.values() for i in firsts]])
    parts = list(_parts(partition, _deviating(variation)))
    strengths = np.full(len(parts), scene.parameters[scene.strength])
    problem = OrbitProblem.of(scene, variation, strengths, start)
    state = problem.with_slip_states(start)
    if not problem.forced:
        problem = problem.with_turns(problem.observed_turns(state, strengths), start)
    integrator = problem.integrator(state)
    random = np.random.default_rng(seed)
    deviations = np.zeros((1, variation.size, len(parts)))
    for k, part in enumerate(parts):
        deviations[0, part, k] = random.normal(size=part.stop - part.start)
    integrator.set_deviations(deviations)
    return problem, integrator


def _deviating(variation: Variation) -> int:
    """Number of components of an oscillator that deviate: all but the slip state of a contact."""
    return len(variation.orbit.node.continuous)


def _parts(partition: Clusters, components: int) -> Iterator[slice]:
    """Yield the slices of the clusters' motion and of each block in the variational equation."""
    first, last = 0, partition.quotient.n * components
    yield slice(first, last)
    for block in partition.blocks:
        first, last = last, last + len(block.nodes) * components
        yield slice(first, last)


def _falls(gaps: np.ndarray) -> np.ndarray:
    """True (clusters, clusters) for distances (blocks, clusters, clusters) that are smaller in the later half of the blocks."""
    half = len(gaps) // 2
    early, late = (part.max(axis=0, initial=0.0) for part in (gaps[:half], gaps[half:]))
    return np.asarray(late < APPROACH * early)


def _pairs(found: np.ndarray) -> tuple[tuple[int, int], ...]:
    """The pairs of clusters for which a symmetric table is true."""
    first, second = np.nonzero(np.triu(found, 1))
    return tuple((int(a), int(b)) for a, b in zip(first, second, strict=True))


def _words(pairs: Sequence[tuple[int, int]]) -> str:
    return "; ".join(f"{a + 1} and {b + 1}" for a, b in pairs)


def _differences(state: np.ndarray, count: int, components: int) -> np.ndarray:
    """Largest difference between the components of every two of `count` clusters."""
    rows = state.reshape(-1, count)[:components]
    return np.asarray(np.abs(rows[:, :, None] - rows[:, None, :]).max(axis=0))
