"""Compute the stability of cluster states: transversal exponents of a network, block by block.

Along one orbit of the quotient network, one deviation is integrated for each block, and one for the motion of the
clusters themselves. All deviations obey the same equation; the entries of the block are its strengths.

Sources: Pecora, Sorrentino, Hagerstrom, Murphy & Roy, Nat. Commun. 5, 4079 (2014); Zhang & Motter, SIAM Rev. 62, 817
(2020).
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import xarray as xr

from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.reduction import without_drive
from synchain.models.dynamics.variational import clustered
from synchain.models.inputs.keywords import warn
from synchain.models.scenes.scene import Scene
from synchain.models.symmetries.clusters import Block, Clusters, clusters

from ..cells.run_keywords import ONE_ORBIT, Given
from ..results.labelled import Labelled, as_json, dataset
from ..support.error_text import with_error
from ..support.execution import Execution
from ..support.progress import Hook
from .averages import Averaging, Batches, document_keywords, with_growth_by_powers
from .orbits import OrbitProblem
from .variational_integrator import VariationalIntegrator

MERGED = 1e-9
"""Two clusters count as one if no component is ever further apart than this part of its size (a choice)."""

APPROACH = 0.5
"""Two clusters approach each other if their largest distance falls below this part of its earlier value (a choice)."""


class BlockVerdict(StrEnum):
    """Verdict on the stability of one block of a cluster state."""

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
        Standard errors of `exponent`. An exponent within 3 over the time since the start is not told from 0, as
        deviations may grow by a power of time: its error is at least its size.
    motion : float
        Largest exponent of the clusters' own motion.
    motion_error : float
        Standard error of `motion`.
    separation : ndarray, shape (clusters, clusters)
        Largest difference between the states of two clusters at the ends of blocks of time. A separation of 0
        means that the clusters have merged; the exponents are then those of a coarser state. Clusters of nodes of
        different kinds are infinitely far apart.
    time : float
        Length of the average.
    approaching : tuple of (int, int)
        Pairs of clusters that have not merged, but have a falling distance; the exponents may be
        those of a coarser state.
    unit : str
        Unit in which transient and average are counted.

    See Also
    --------
    synchain.cluster_exponents
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
        """The clusters, each block with its verdict, and the clusters that merged or approach each other."""
        members = [", ".join(str(i + 1) for i in nodes) for nodes in self.state.members]
        blocks = [
            f"{verdict} ({with_error(exponent, error)}): {_text_of(block)}"
            for block, exponent, error, verdict in zip(
                self.state.blocks, self.exponent, self.stderr, self.verdicts, strict=True
            )
        ]
        pairs = (("merged", self.merged), ("approaching", self.approaching))
        return (
            ("clusters", "; ".join(f"{k}: {nodes}" for k, nodes in enumerate(members, 1))),
            *((f"block {k}", verdict) for k, verdict in enumerate(blocks, 1)),
            ("own motion", with_error(self.motion, self.motion_error)),
            *((name, _text(merging)) for name, merging in pairs if merging),
            *((("unit", self.unit),) if self.unit else ()),
        )

    @property
    def verdicts(self) -> tuple[BlockVerdict, ...]:
        """Verdict on each block; a sign is certain if the exponent is more than two standard errors from zero."""
        signs = np.where(np.abs(self.exponent) > 2.0 * self.stderr, np.sign(self.exponent), 0.0)
        verdicts = {-1: BlockVerdict.STABLE, 0: BlockVerdict.UNDECIDED, 1: BlockVerdict.UNSTABLE}
        return tuple(verdicts[int(sign)] for sign in signs)

    @property
    def intertwined(self) -> tuple[tuple[int, ...], ...]:
        """The clusters of each block; the clusters of one block lose their synchrony together."""
        return tuple(block.clusters for block in self.state.blocks)

    @property
    def merged(self) -> tuple[tuple[int, int], ...]:
        """Pairs of clusters of equal nodes that were never apart by 1e-9 of their states, and so count as one cluster."""
        return _pairs(self.separation == 0.0)

    def as_dict(self) -> dict[str, object]:
        """Return the exponents for JSON.

        Returns
        -------
        dict
            classes, blocks (clusters, nodes, size, multiplicity, exponent, stderr, verdict), motion,
            motion_stderr, merged, approaching, time.
        """
        rows = zip(self.state.blocks, self.exponent, self.stderr, self.verdicts, strict=True)
        blocks = [
            {
                "clusters": block.clusters,
                "nodes": block.nodes,
                "size": len(block.cluster_of),
                "multiplicity": block.multiplicity,
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
    precision: float | None = None,
    periods: float = 5000,
    transient: float | None = None,
    rtol: float | None = None,
    rng: int | np.random.Generator | None = None,
    show_progress: bool | None = None,
    progress: Hook | None = None,
    parameters: Mapping[str, float] | None = None,
    **more: float,
) -> ClusterExponents:
    """Compute the transversal exponents of a cluster state of a scene's network.

    Parameters
    ----------
    scene : Scene
        Network of at most 32 clusters with its coupling strength.
    state : Clusters or sequence of int
        Partition of the nodes, from `clusters` or as the cluster of each node. All nodes of a cluster are of one kind
        and have equal parameters. Each cluster starts from the state of its first node. The partition into a single
        cluster is complete synchronisation, also with layers that do not commute.
    {average}
    rtol : float, optional
        Relative tolerance of the integration; by default that of the scene. The friction law may require a smaller one.
    rng : int or Generator, optional
        Seed of the initial deviations; by default that of the scene.
    {progress}
    {parameters}

    Returns
    -------
    ClusterExponents

    Raises
    ------
    ValueError
        If the partition is not balanced or belongs to another graph, if nodes of a cluster differ, if
        links are not proportional to their weights or differ in a parameter, if there are more than 32
        clusters, or if time enters in the equations without a known period.
    FloatingPointError
        If the integration fails.

    Warns
    -----
    RuntimeWarning
        If clusters approach each other. The first half of the transient is dropped; then the largest distance in the
        second half of the motion is at most half of that in the first half.

    See Also
    --------
    synchain.graphs.clusters
    synchain.exponents
    synchain.transition

    Examples
    --------
    >>> import synchain as sc
    >>> scene = sc.Scene("rossler", "x->x", sc.graphs.star(4), parameters={"sigma": 0.5})
    >>> found = sc.cluster_exponents(scene, [0, 1, 1, 1], periods=300, show_progress=False)
    >>> found.exponent.shape
    (1,)
    """
    execution = Execution(1, None, show_progress, progress)
    averaging = Averaging.for_scene(scene, precision, periods, transient, rng, execution)
    given = Given(cluster_exponents, parameters, more, ONE_ORBIT)
    scene = given.scene(scene, rtol=scene.rtol if rtol is None else rtol)
    partition = _of_graph(scene, state)
    reporter = averaging.reporter()
    problem, integrator = _integrator(scene, partition, averaging.seed)
    orbit = problem.variation.orbit
    averaging = averaging.in_units(scene, problem.unit)
    reporter.total = averaging.length
    batches, dropped = Batches(problem.unit), round(averaging.transient)
    states: list[np.ndarray] = []  # states after each unit of time

    def advance() -> np.ndarray:
        growth = integrator.advance(problem.unit)
        states.append(integrator.state[0])
        return growth

    with reporter:
        for _ in range(dropped):
            advance()
            reporter.advance(1)
        for _ in averaging.rounds(batches, batches.error, reporter):
            batches.add(advance())
        steps = integrator.error_of_steps(problem.unit)

    # drop the first half of the transient, then compare the largest distances in the two halves of the motion
    gaps, ratios = _separations(orbit, np.array(states), dropped)
    apart = np.where(ratios < MERGED, 0.0, gaps[dropped:].max(axis=0))
    settled = gaps[dropped // 2 :]
    half = len(settled) // 2
    early, late = (part.max(axis=0, initial=0.0) for part in (settled[:half], settled[half:]))
    approaching = _pairs((late < APPROACH * early) & (apart > 0.0))
    if approaching:
        warn(
            f"cluster_exponents: found clusters that approach each other, {_text(approaching)}; expected settled ones, "
            f"the exponents may be those of fewer clusters; raise transient = {averaging.transient:g}"
        )
    mean, error, time = batches.mean()[0], np.hypot(batches.error_by_start(), steps)[0], batches.time
    error = with_growth_by_powers(mean, error, dropped * problem.unit + time)
    return ClusterExponents(
        partition, mean[1:], error[1:], float(mean[0]), float(error[0]), apart, time, approaching, str(problem.turns)
    )


def _of_graph(scene: Scene, state: Clusters | Sequence[int]) -> Clusters:
    """Compute the blocks of a partition; check that it belongs to the scene's graphs, and that clusters are uniform."""
    classes = state.classes if isinstance(state, Clusters) else state
    graphs = [graph for _, graph in scene.model.linked] or [scene.topology]
    partition = clusters(graphs, classes)
    if isinstance(state, Clusters) and [graph.links for graph in state.graphs] != [graph.links for graph in graphs]:
        names = " and ".join(f"{graph.name}({graph.n})" for graph in graphs)
        raise ValueError(
            f"cluster state {classes} belongs to another graph than {names}; make it with clusters(graph, classes), or "
            "with the graphs of all layers"
        )
    for name in scene.equations.varied:
        holders = scene.equations.holders(name)
        for members in partition.members:
            values = {i: scene.parameters[f"{name}_{i + 1}"] for i in members if i in holders}
            other = next((i for i in values if values[i] != values[members[0]]), None)
            if other is not None:
                raise ValueError(
                    f"cluster state {classes}: nodes {members[0] + 1} and {other + 1} of one cluster differ in {name}; "
                    "expected equal nodes in a cluster"
                )
    return partition


def _integrator(scene: Scene, partition: Clusters, seed: int) -> tuple[OrbitProblem, VariationalIntegrator]:
    """Return the quotient's problem, and its integrator with random deviations of the clusters and of each block."""
    equations = without_drive(scene.equations, scene.parameters)
    parts = clustered(equations, partition)
    orbit, firsts = parts.variation.orbit, [members[0] for members in partition.members]
    places = [
        (name, equations.holders(name).index(firsts[c])) for name in orbit.components for c in orbit.holders(name)
    ]
    start = np.array([[scene.initial[name][place] for name, place in places]])
    strengths = np.array([[float(number) for number in row] for row in parts.strengths])
    problem = OrbitProblem.of(scene, parts.variation, strengths, start)
    state = problem.with_slip_states(start)
    if not problem.forced:
        problem = problem.with_turns(problem.observed_turns(state, strengths), start)
    integrator = problem.integrator(state)
    random = np.random.default_rng(seed)
    deviations = np.zeros((1, parts.variation.size, len(parts.slots)))
    for k, slots in enumerate(parts.slots):
        rows = [row for slot in slots for row in parts.rows[slot]]
        deviations[0, rows, k] = random.normal(size=len(rows))
    integrator.set_deviations(deviations)
    return problem, integrator


def _separations(orbit: Equations, states: np.ndarray, first: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the largest difference (k, clusters, clusters) of a component in states (k, any), and of its ratios.

    The ratios (clusters, clusters) are those to the size of the component from the state `first` on. Nodes of different
    kinds are infinitely far apart.
    """
    gaps, ratios = np.full((len(states), orbit.n, orbit.n), np.inf), np.full((orbit.n, orbit.n), np.inf)
    size = np.abs(states[first:]).max(axis=0)
    for a, b in itertools.product(range(orbit.n), repeat=2):
        if orbit.kind_of[a] == orbit.kind_of[b]:
            count = len(orbit.node_at(a).continuous)
            p, q = (list(orbit.places[c][:count]) for c in (a, b))
            difference, larger = np.abs(states[:, p] - states[:, q]), np.maximum(size[p], size[q])
            gaps[:, a, b] = difference.max(axis=1)
            ratios[a, b] = (difference[first:] / np.where(larger > 0.0, larger, 1.0)).max()
    return gaps, ratios


def _text_of(block: Block) -> str:
    """Return the clusters of a block with its size and multiplicity, if these exceed 1."""
    size = len(block.cluster_of)
    details = [f"size {size}"] * (size > 1) + [f"{block.multiplicity} times"] * (block.multiplicity > 1)
    return f"clusters {', '.join(str(c + 1) for c in block.clusters)}" + "".join(f", {text}" for text in details)


def _pairs(table: np.ndarray) -> tuple[tuple[int, int], ...]:
    """Return the pairs of clusters for which a symmetric table is true."""
    first, second = np.nonzero(np.triu(table, 1))
    return tuple((int(a), int(b)) for a, b in zip(first, second, strict=True))


def _text(pairs: Sequence[tuple[int, int]]) -> str:
    return "; ".join(f"{a + 1} and {b + 1}" for a, b in pairs)
