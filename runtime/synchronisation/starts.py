"""Initial states of a basin: random states of a box, a grid over axes of initial states, or both."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from synchain.models.inputs.checks import check_integer, check_table, is_row
from synchain.models.scenes.scene import Axis, Scene

from ..support.arrays import row

Range = tuple[float, float]

EACH = "each"
"""Word for nodes that are perturbed one after another."""

SAMPLES = 1000
"""Number of random starts, if a call gives none."""

SAMPLE_LIMIT = 10_000_000
"""Largest number of starts in one call (a choice)."""


@dataclass(frozen=True, slots=True, eq=False)
class Starts:
    """Initial states of every cell of an answer."""

    states: np.ndarray  # (perturbed or 1, starts, dimension)
    grid: tuple[Axis, ...]  # axes of initial states, whose product are the starts; the random ones vary fastest
    samples: int  # number of random starts at each point of the grid
    perturbed: tuple[int, ...]  # nodes (0-based) that are perturbed one after another; empty if nodes move together

    @classmethod
    def of(
        cls,
        scene: Scene,
        samples: int | None,
        ranges: Mapping[str, Range] | None,
        nodes: str | Sequence[int] | None,
        seed: int,
    ) -> Starts:
        """Return the starts of a scene, whose axes of initial states make a grid; parameters as for `basin`."""
        grid = tuple(axis for axis in scene.axes if axis.name in scene.equations.state)
        chosen, perturbed = _nodes(scene, nodes)
        box = {} if grid and ranges is None else _box(scene, ranges)
        default = SAMPLES if box else 1
        count = check_integer("basin: samples", default if samples is None else samples, 1, SAMPLE_LIMIT)
        if count > 1 and not box:
            raise ValueError(f"basin: samples = {samples} at each point of a grid; expected ranges of what is random")
        values = _points(grid, scene.zipped)
        if len(values) * count > SAMPLE_LIMIT:
            raise ValueError(f"basin: found {len(values) * count} starts; expected at most {SAMPLE_LIMIT}")
        states = np.tile(np.array(scene.y0, dtype=float), (max(len(perturbed), 1), len(values) * count, 1))
        _fill_at_random(states, scene, box, chosen, perturbed, seed)
        for axis, column in zip(grid, values.T, strict=True):
            states[:, :, scene.equations.state.index(axis.name)] = np.repeat(column, count)
        return cls(states, grid, count, perturbed)

    @property
    def count(self) -> int:
        """Number of starts in each cell of the answer."""
        return int(self.states.shape[1])

    def ranges(self, scene: Scene) -> dict[str, float]:
        """Return the range of each component over all starts and nodes, and that of each state."""
        ranges = dict(zip(scene.equations.state, map(float, np.ptp(self.states, axis=(0, 1))), strict=True))
        for name in scene.components:
            states = [k for k, state in enumerate(scene.equations.state) if state.rpartition("_")[0] == name]
            ranges[name] = float(np.ptp(self.states[:, :, states]))
        return ranges


def _points(grid: Sequence[Axis], zipped: bool) -> np.ndarray:
    """Return the points (points, axes) of a grid of starts; a single one without coordinates if there is no grid."""
    if not grid:
        return np.empty((1, 0))
    if zipped:
        return np.array([axis.values for axis in grid]).T
    return np.stack(np.meshgrid(*(axis.values for axis in grid), indexing="ij"), axis=-1).reshape(-1, len(grid))


def _fill_at_random(
    states: np.ndarray,
    scene: Scene,
    box: Mapping[str, Range],
    chosen: Sequence[int],
    perturbed: Sequence[int],
    seed: int,
) -> None:
    """Draw states (perturbed or 1, starts, dimension) in a box, for chosen nodes or one perturbed node a row."""
    places = {name: k for k, name in enumerate(scene.equations.state)}
    holders = {c: scene.equations.holders(c) for c in box}
    # columns of random numbers: one for each state, or for each component if nodes are perturbed in turn
    names = [(c, i) for c in box for i in ([None] if perturbed else holders[c]) if i is None or i in chosen]
    random = np.random.default_rng(seed).random((states.shape[1], len(names)))
    for (c, i), column in zip(names, random.T, strict=True):
        low, high = box[c]
        for row_of, node in enumerate(perturbed) if i is None else [(0, i)]:
            if node in holders[c]:
                states[row_of, :, places[f"{c}_{node + 1}"]] = low + (high - low) * column


def _nodes(scene: Scene, nodes: str | Sequence[int] | None) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the nodes (0-based) with random states, and those that are perturbed one after another."""
    every = tuple(range(scene.n))
    if nodes is None:
        return every, ()
    if isinstance(nodes, str):
        if nodes != EACH:
            raise ValueError(f"basin: nodes: found {nodes!r}; expected {EACH!r}, or numbers of nodes from 1")
        return every, every
    numbers = [check_integer("basin: nodes", number, 1, scene.n) for number in (nodes if is_row(nodes) else [nodes])]
    return tuple(dict.fromkeys(number - 1 for number in numbers)), ()


def _box(scene: Scene, ranges: Mapping[str, Range] | None) -> dict[str, Range]:
    """Check the ranges, and return them in the order of the components, without the slip state of a contact."""
    names = tuple(name for name in scene.components if name not in scene.equations.modes)
    if ranges is None:
        return dict.fromkeys(names, (-1.0, 1.0))
    unknown = [name for name in check_table("basin: ranges", ranges) if name not in names]
    if unknown:
        raise ValueError(f"basin: unknown component {unknown[0]!r}; known: {', '.join(names)}")
    if not ranges:
        raise ValueError(f"basin: no ranges; name at least one component of {', '.join(names)}")
    box = {}
    for name in names:
        if name not in ranges:
            continue
        ends = row(f"basin: the range of {name}", ranges[name], 2)
        low, high = float(ends[0]), float(ends[-1])
        if not (len(ends) == 2 and low < high):
            raise ValueError(
                f"basin: the range of {name} is {low:g} … {high:g}; expected two numbers, the lower one first "
                "(for a fixed value leave the component out and set it in the scene's initial state)"
            )
        box[name] = (low, high)
    return box
