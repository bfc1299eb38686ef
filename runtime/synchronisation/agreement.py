"""Compare the stability of synchronous motion from exponents with direct simulation, for each value of sigma.

By exponents, a network synchronises if all of them are below zero by more than two standard errors, and does not
synchronise if one is above zero by more than two. If a simulation disagrees, further simulations search for the cause.

Sources: bubbling: Ashwin, Buescu & Stewart, Phys. Lett. A 193, 126 (1994); mergers by round-off:
Pikovsky, Phys. Rev. Lett. 73, 2931 (1994).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace

import numpy as np

from synchain.models.dynamics.synchrony import expect_vanishing
from synchain.models.graphs.topology import Topology
from synchain.models.scenes.scene import Scene

from ..cells.run_keywords import Given
from ..stability.exponents import Exponents, exponents
from ..stability.transversal_modes import unused_axes
from ..support.execution import Execution
from ..support.progress import Hook
from .criterion import IN_CRITERION, AppliedCriterion, Criterion, checked
from .threshold import check_probe, fitted, simulate

OUTCOMES = ("both yes", "both no", "exponent yes, simulation no", "exponent no, simulation yes", "undecided")

CAUSES = ("transient too short", "round-off merger", "intermittency", "coexisting attractor", "unexplained")
"""Reasons for a disagreement, in the order in which `agreement` explains them."""

LONGER = 4.0
"""Ratio of the transient in the search for a cause to the transient of the criterion (a choice)."""

MERGED = 1e-14
"""A mean synchronisation error below this part of the motion's extent counts as round-off."""

NEAR_ZERO = 5.0
"""An exponent within this number of standard errors counts as 0; bursts occur on both sides of 0 (a choice)."""

NUDGE = 1e-5
"""Distance between neighbours in a start next to the synchronous state, relative to the motion's extent (a choice)."""


@dataclass(frozen=True, slots=True)
class Cell:
    """One value of sigma, judged by exponents and by simulation."""

    sigma: float
    exponent: float  # largest transversal exponent
    stderr: float  # standard error of the exponent
    share: float  # part of the starts that synchronised
    error: float  # median over the starts of the mean synchronisation error
    outcome: str  # one of OUTCOMES
    cause: str = ""  # one of CAUSES if exponents and simulation disagree


@dataclass(frozen=True, slots=True)
class Agreement:
    """Verdicts on a scene's network by exponents and by simulation, for each sigma."""

    scene: Scene
    criterion: AppliedCriterion
    cells: tuple[Cell, ...] = field(repr=False)

    @property
    def counts(self) -> dict[str, int]:
        """Number of values of sigma with each outcome."""
        counts = Counter(cell.outcome for cell in self.cells)
        return {outcome: counts[outcome] for outcome in OUTCOMES}

    @property
    def causes(self) -> dict[str, int]:
        """Number of disagreements by cause; causes that do not occur are left out."""
        counts = Counter(cell.cause for cell in self.cells if cell.cause)
        return {cause: counts[cause] for cause in CAUSES if counts[cause]}

    def as_dict(self) -> dict[str, object]:
        """Return counts, causes, and the fields of each `Cell`, for JSON."""
        names = ("sigma", "exponent", "stderr", "share", "error", "outcome", "cause")
        rows = [{name: getattr(cell, name) for name in names} for cell in self.cells]
        return {"counts": self.counts, "causes": self.causes, "cells": rows}


def strengths(graph: Topology, sigma: Sequence[float] | np.ndarray) -> np.ndarray:
    """Return the strengths alpha = sigma |gamma_k| (sigma, modes) of a graph's distinct transversal modes.

    If the network has several parts without links between them, one strength is 0. Raise ValueError for a graph without
    links, and for eigenvalues that are complex or positive.
    """
    spectrum = graph.spectrum
    check_probe(graph, spectrum)
    rows = zip(spectrum.values, spectrum.multiplicities, strict=True)
    sizes = [abs(value) for value, count in rows if abs(value) > 0.0 or count > 1]
    return np.asarray(np.outer(np.asarray(sigma, dtype=float), sizes))


def agreement(
    scene: Scene,
    sigma: Sequence[float] | np.ndarray,
    *,
    line: Exponents | None = None,
    criterion: Criterion | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    show_progress: bool | None = None,
    progress: Hook | None = None,
    parameters: Mapping[str, float] | None = None,
    **more: float,
) -> Agreement:
    """Judge synchronisation by exponents and by direct simulation for each sigma."""
    scene = Given(agreement, parameters, more, IN_CRITERION).scene(scene, unused_axes(scene))
    expect_vanishing("agreement", scene.equations)
    check_probe(scene.topology, scene.spectrum)
    scene = scene.replace(record=("sync_error",))
    grid = np.atleast_1d(np.asarray(sigma, dtype=float))
    if grid.ndim != 1 or not (np.all(np.isfinite(grid)) and np.all(np.diff(grid) > 0.0) and np.all(grid >= 0.0)):
        raise ValueError("sigma: expected finite numbers from 0 up that increase")
    execution = Execution(workers, executor, show_progress, progress)
    simulation = DirectSimulation(scene, fitted(scene, grid, checked(criterion), execution), execution)
    alpha = strengths(scene.topology, grid)
    line = line or exponents(scene, np.unique(alpha), workers=workers, show_progress=show_progress, progress=progress)
    # find the indices (sigma, modes) of all strengths on the line
    order = np.argsort(line.alpha)
    indices = order[np.clip(np.searchsorted(line.alpha[order], alpha), 0, len(order) - 1)]
    missing = alpha[line.alpha[indices] != alpha]
    if len(missing):
        raise ValueError(f"line: found no exponent at alpha = {missing[0]!r}; expected all `strengths` of the graph")
    shares, medians = simulation.simulate(grid)
    cells, split = [], []
    for value, modes, share, error in zip(grid, indices, shares, medians, strict=True):
        k = modes[int(np.argmax(line.exponent[modes]))]
        outcome = _outcome(line.exponent[modes], line.stderr[modes], share >= 0.5)
        cells.append(
            Cell(float(value), float(line.exponent[k]), float(line.stderr[k]), float(share), float(error), outcome)
        )
        # the starts reach motions with exponents of different signs
        largest = line.by_start[:, modes].max(axis=1)
        split.append(bool(largest.min() < 0.0 < largest.max()))
    return Agreement(scene, simulation.criterion, tuple(_explained(simulation, cells, split)))


def _outcome(exponent: np.ndarray, error: np.ndarray, simulated: bool) -> str:
    """Compare the signs of all exponents with a simulation; a sign is certain if the exponent exceeds two errors."""
    if np.all(exponent + 2.0 * error < 0.0):
        return OUTCOMES[0] if simulated else OUTCOMES[2]
    if np.any(exponent - 2.0 * error > 0.0):
        return OUTCOMES[3] if simulated else OUTCOMES[1]
    return OUTCOMES[4]


@dataclass(frozen=True, slots=True)
class DirectSimulation:
    """Direct simulation of one scene."""

    scene: Scene
    criterion: AppliedCriterion
    execution: Execution

    def simulate(self, sigma: np.ndarray, longer: float = 1.0, near: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Return shares and median errors (sigma,); `longer`: factor of the transient, `near`: from near synchrony."""
        scene = self.scene
        if near:
            first = {name: np.array(values[:1] * scene.n) for name, values in scene.initial.items()}
            move = NUDGE * self.criterion.extent[0] * np.arange(scene.n)
            first[scene.components[0]] = first[scene.components[0]] + move
            scene = scene.replace(initial={name: values.tolist() for name, values in first.items()})
        used = self.criterion
        criterion = replace(used, transient=longer * used.transient, max_steps=int(longer * used.max_steps))
        sweep = simulate(scene, sigma, criterion, math.inf, self.execution)
        return sweep.share, sweep.error


def _explained(simulation: DirectSimulation, cells: Sequence[Cell], split: Sequence[bool]) -> list[Cell]:
    """Return the cells with causes: simulate disagreements again, for longer and from near synchrony."""
    explained = list(cells)
    differing = [i for i, cell in enumerate(cells) if cell.outcome in OUTCOMES[2:4]]
    if not differing:
        return explained
    sigma = np.array([cells[i].sigma for i in differing])
    longer = simulation.simulate(sigma, LONGER)[0]
    near = simulation.simulate(sigma, LONGER, near=True)[0]
    for i, later, close in zip(differing, longer, near, strict=True):
        merged = cells[i].error < MERGED * simulation.criterion.size
        explained[i] = replace(cells[i], cause=_cause(cells[i], merged, float(later), float(close), split[i]))
    return explained


def _cause(cell: Cell, merged: bool, longer: float, near: float, split: bool) -> str:
    """Return the cause of a disagreement; `longer`, `near`: shares after a longer transient, and from near by."""
    stable = cell.outcome == OUTCOMES[2]
    mixed = 0.0 < cell.share < 1.0 or 0.0 < longer < 1.0
    if not stable and merged:
        return CAUSES[1]
    if (longer >= 0.5) == stable:
        return CAUSES[0]
    if mixed and abs(cell.exponent) < NEAR_ZERO * cell.stderr:
        return CAUSES[2]
    if split or mixed or (stable and near >= 0.5):
        return CAUSES[3]
    return CAUSES[4]
