"""Compute the mean growth of the deviations of many strengths along orbits, block by block.

1. `interpolation_for(problem, states, periods)` tries choices on the next blocks, the cheapest first, and
   returns a `BlockInterpolation`: the length of a block, and the few strengths (nodes) whose propagators are
   integrated. The propagators of all other strengths are interpolated.
2. `March.begin(problem, states, interpolation)` starts an integrator of the nodes at the states, with one
   deviation for each strength.
3. `March.growths(batches)` advances the orbits by the numbers of blocks in `batches`, and returns the logarithm
   of the growth of every deviation over each batch. `exponents.average` adds batches until the mean is precise.

The costs below count multiplications. The numbers were fitted to timings of the kernels, and only rank the choices.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from .averages import BATCHES, TOLERANCE_RATIO, TRIED, error_of_steps
from .interpolation import Interpolation, exact_interpolation, lines_of, strength_interpolation
from .orbits import OrbitProblem
from .variational_integrator import NO_BATCH_STARTS, Deviations, VariationalIntegrator

NODES, PARTS = (13, 21, 29, 37, 61), (1, 2, 4, 8, 16)
"""Numbers of nodes of a panel, and of panels on each side, that are tried. The nodes and three strengths for comparison
together fill registers of eight lanes."""

BLOCKS, FREE_BLOCKS = (8.0, 4.0, 2.0, 1.0), (1.0, 0.5, 0.25, 0.125)
"""Lengths of a block that are tried, in periods of a drive and in turns of undriven motion (a choice)."""

STEP, BLOCK, STRENGTH, LANDINGS = 200, 60_000, 42, 5_000
"""Costs in multiplications. STEP: one step of one deviation. BLOCK: a block, apart from its deviations. STRENGTH: one
strength in a block costs as much as STRENGTH further nodes. LANDINGS: all landings in a unit of time."""

LONGEST_STICK = 4.0
"""Shortest block, in units of time, that is longer than most intervals between two landings."""

ALLOWED = 1e-12
"""Interpolation errors below ALLOWED are accepted at any rtol: rounding of propagators and weights causes as much."""

HOPELESS, FURTHER = 0.1, 1.45
"""After an error above HOPELESS, choices with fewer than FURTHER times as many nodes are skipped: the error of a
polynomial falls geometrically with the number of nodes."""

TRIAL = 8
"""Number of blocks on which an interpolation is tried (a choice)."""

MODE_TOLERANCE_RATIO = 10.0
"""Ratio of the tolerance of the modes to that of the orbit, if the growth of the modes is averaged.

The larger tolerance changes exponents by less than rtol. The change is larger where a multiplier passes through
zero: the exponent dips towards -inf there and magnifies every error.
"""


@dataclass(frozen=True, slots=True)
class BlockInterpolation:
    """The length of a block, and the interpolation of the propagators of all strengths over a block."""

    block: float  # length of a block in units of time
    strengths: Interpolation  # from the nodes to all strengths
    # for bodies that stick: from the strengths that are integrated between landings, to the nodes of `strengths`
    stick_intervals: Interpolation | None = None

    @property
    def is_exact(self) -> bool:
        """True if every strength is integrated."""
        return self.strengths.is_exact and (self.stick_intervals is None or self.stick_intervals.is_exact)


@dataclass(slots=True)
class March:
    """Orbits that advance block by block, with the deviations of all strengths along the orbits."""

    problem: OrbitProblem
    block: float  # length of a block in units of time
    integrator: VariationalIntegrator  # orbits with the propagators of the nodes
    deviations: Deviations  # deviations of all strengths, with the largest interpolation error so far

    @classmethod
    def begin(
        cls,
        problem: OrbitProblem,
        states: np.ndarray,
        interpolation: BlockInterpolation,
        tolerance_ratio: float = MODE_TOLERANCE_RATIO,
    ) -> March:
        """Return a march from states (starts, components), with deviations of all strengths."""
        nodes, intervals = interpolation.strengths, interpolation.stick_intervals
        if problem.lands and intervals is None:
            intervals = exact_interpolation(nodes.nodes)
        integrator = problem.integrator(states, (intervals or nodes).nodes, tolerance_ratio)
        integrator.set_deviations(problem.unit_deviations(integrator))
        width = integrator.kernel.origin.width
        deviations = Deviations.make(
            nodes.registers(width),
            len(states),
            problem.components,
            problem.variation.size,
            None if intervals is None else intervals.registers(width),
        )
        return cls(problem, interpolation.block, integrator, deviations)

    def growths(self, batches: np.ndarray, batch_starts: np.ndarray = NO_BATCH_STARTS) -> np.ndarray:
        """Advance by batches (b,) of blocks; return the logarithm of the growth (b, starts, m) over each batch.

        The states and deviations at the beginning of each batch are stored in `batch_starts` (starts, b, any).
        """
        return self.integrator.follow(self.block * self.problem.unit, batches, self.deviations, batch_starts)

    def tried(self, most: int) -> tuple[np.ndarray, np.ndarray]:
        """Advance by at most TRIED blocks; return growth (blocks, starts, m) and error due to the steps (starts, m)."""
        count, (starts, size), vectors = min(most, TRIED), self.integrator.state.shape, self.deviations.vectors
        begun = np.empty((starts, count, size + vectors.shape[1]))
        usual = self.growths(np.ones(count, dtype=np.int64), begun)
        # integrate each block again from its start with looser tolerances; all blocks are cells of one call
        begun = begun.swapaxes(0, 1).reshape(count * starts, -1)
        beside = self.integrator.beside(np.ascontiguousarray(begun[:, :size]), TOLERANCE_RATIO)
        deviations = replace(self.deviations, vectors=np.ascontiguousarray(begun[:, size:]))
        length = self.block * self.problem.unit
        looser = beside.follow(length, np.ones(1, dtype=np.int64), deviations)[0].reshape(usual.shape)
        return usual, error_of_steps(usual, looser, length)


def interpolation_for(problem: OrbitProblem, states: np.ndarray, periods: float) -> BlockInterpolation:
    """Choose block length and interpolation for an average, by trial from states (starts, components)."""
    limit = max(0.01 * problem.scene.rtol, ALLOWED)  # the error of later blocks may be ten times larger
    failed: list[InterpolationChoice] = []
    for choice in _choices(problem, states, periods):
        if any(choice.is_coarser(other) for other in failed):
            continue
        interpolation = choice.of(problem.strengths)
        if interpolation.is_exact:
            return interpolation
        march = March.begin(problem, states, interpolation)
        march.growths(np.full(1, TRIAL))
        if march.deviations.error < limit:
            return interpolation
        more = FURTHER if march.deviations.error > HOPELESS else 1.0
        failed.append(replace(choice, nodes=int(more * choice.nodes), stick_nodes=int(more * choice.stick_nodes)))
    return BlockInterpolation(choice.block, exact_interpolation(problem.strengths))


@dataclass(frozen=True, slots=True)
class InterpolationChoice:
    """A length of a block and numbers of nodes, with their cost."""

    cost: float  # multiplications for a unit of time
    block: float
    nodes: int  # number of nodes of a panel
    parts: int  # number of panels on each side
    stick_nodes: int = (
        0  # number of nodes of a panel that are integrated between landings; 0: all nodes, over whole blocks
    )

    def of(self, strengths: np.ndarray) -> BlockInterpolation:
        """Return the interpolation of strengths (m,) or (m, layers)."""
        outer = strength_interpolation(strengths, self.nodes, self.parts)
        inner = strength_interpolation(outer.nodes, self.stick_nodes, self.parts) if self.stick_nodes else None
        return BlockInterpolation(self.block, outer, inner)

    def is_coarser(self, other: InterpolationChoice) -> bool:
        """Return True if the other choice has no longer blocks and no fewer nodes, in a panel and in all."""
        these, others = ((c.nodes, c.stick_nodes, c.nodes * c.parts, c.stick_nodes * c.parts) for c in (self, other))
        return self.block >= other.block and all(a <= b for a, b in zip(these, others, strict=True))


def _choices(problem: OrbitProblem, states: np.ndarray, periods: float) -> list[InterpolationChoice]:
    """Return the choices for an average over some periods, the cheapest first."""
    # the cost of a node follows from the number of steps that a single mode takes in a unit of time
    one = problem.integrator(states, problem.strengths[:1], MODE_TOLERANCE_RATIO)
    one.advance(problem.unit)
    node_cost = STEP * problem.components * one.steps / len(states)
    count = len(problem.strengths)
    lines = 1 if problem.strengths.ndim == 1 else len(lines_of(problem.strengths)[1])
    blocks = [b for b in BLOCKS if b <= max(4.0, periods / BATCHES) and periods % b == 0.0]
    choices: list[InterpolationChoice] = []
    if problem.lands and lines == 1:
        # for bodies that stick, one column of two is integrated, and one entry of four is interpolated
        long_blocks = [b for b in blocks if b >= LONGEST_STICK]
        for block, stick_nodes, nodes, parts in itertools.product(long_blocks, NODES, NODES, PARTS):
            if stick_nodes < nodes:
                cost = stick_nodes * parts * (node_cost / 2 + nodes) + LANDINGS + count * (nodes + STRENGTH / 4) / block
                choices.append(InterpolationChoice(cost, block, nodes, parts, stick_nodes))
    if not choices:
        entries = count * problem.components**2  # of the propagators of all strengths
        for block, nodes, parts in itertools.product(blocks if problem.forced else FREE_BLOCKS, NODES, PARTS):
            cost = nodes * parts * (lines * node_cost) + (entries * (nodes + STRENGTH) + BLOCK) / block
            choices.append(InterpolationChoice(cost, block, nodes, parts))
    return sorted(choices, key=lambda choice: choice.cost)
