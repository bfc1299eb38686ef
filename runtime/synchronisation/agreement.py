"""The stability of synchronous motion from exponents beside direct simulation, value by value of
sigma.

The projection says yes where every transversal exponent is negative by more than two standard
errors, no where one is positive by more than that.  Where a simulation says otherwise, further
simulations look for the reason.

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
"""How many times the transient is repeated in the search for a reason."""

MERGED = 1e-14
"""A mean synchronisation error below this part of the motion's extent is round-off, not a distance."""

NEAR_ZERO = 5.0
"""An exponent within this many standard errors of 0 allows for bursts in either direction."""

NUDGE = 1e-5
"""Distance between neighbours in a start next to the synchronous state, as a part of the motion's extent."""


@dataclass(frozen=True, slots=True)
class Cell:
    """One value of sigma: the largest transversal exponent with its standard error, and what a
    simulation does.

    `share` is the part of the starts that synchronised, `error` the median of their mean
    synchronisation errors; `outcome` is one of OUTCOMES, `cause` one of CAUSES where the two
    disagree, else empty.
    """

    sigma: float
    exponent: float
    stderr: float
    share: float
    error: float
    outcome: str
    cause: str = ""


@dataclass(frozen=True, slots=True)
class Agreement:
    """A scene's network judged twice for each sigma."""

    scene: Scene
    criterion: AppliedCriterion
    cells: tuple[Cell, ...] = field(repr=False)

    @property
    def counts(self) -> dict[str, int]:
        """How many values of sigma had each outcome."""
        found = Counter(cell.outcome for cell in self.cells)
        return {outcome: found[outcome] for outcome in OUTCOMES}

    @property
    def causes(self) -> dict[str, int]:
        """How many disagreements had each cause, those that occur."""
        found = Counter(cell.cause for cell in self.cells if cell.cause)
        return {cause: found[cause] for cause in CAUSES if found[cause]}

    def as_dict(self) -> dict[str, object]:
        """JSON-ready: counts, causes, and for each sigma the numbers, outcome and cause."""
        names = ("sigma", "exponent", "stderr", "share", "error", "outcome", "cause")
        rows = [{name: getattr(cell, name) for name in names} for cell in self.cells]
        return {"counts": self.counts, "causes": self.causes, "cells": rows}


def strengths(graph: Topology, sigma: Sequence[float] | np.ndarray) -> np.ndarray:
    """Return the strengths alpha = sigma |gamma_k| (sigma, modes) of a graph's distinct transversal
    modes.

    A part of the network that nothing couples to the rest has the strength 0.  Raises ValueError
    for a graph without links, and for eigenvalues that are complex or positive.
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
    places = _places(line, alpha)
    share, error = simulation.simulate(grid)
    projected = [_projected(line.exponent[row], line.stderr[row]) for row in places]
    outcomes = [_outcome(sign, part >= 0.5) for sign, part in zip(projected, share, strict=True)]
    largest = [row[int(np.argmax(line.exponent[row]))] for row in places]
    cells = [
        Cell(float(s), float(line.exponent[k]), float(line.stderr[k]), float(a), float(e), words)
        for s, k, a, e, words in zip(grid, largest, share, error, outcomes, strict=True)
    ]
    split = [_split(line, row) for row in places]
    return Agreement(scene, simulation.criterion, tuple(_explained(simulation, cells, split)))


def _places(line: Exponents, alpha: np.ndarray) -> np.ndarray:
    """Where each strength stands on the line."""
    order = np.argsort(line.alpha)
    at = np.clip(np.searchsorted(line.alpha[order], alpha), 0, len(order) - 1)
    places = order[at]
    missing = alpha[line.alpha[places] != alpha]
    if len(missing):
        raise ValueError(f"line: found no exponent at alpha = {missing[0]!r}; expected all `strengths` of the graph")
    return np.asarray(places)


def _projected(exponent: np.ndarray, error: np.ndarray) -> int:
    """1 if all exponents are surely negative, -1 if one is surely not, else 0."""
    if np.all(exponent + 2.0 * error < 0.0):
        return 1
    return -1 if np.any(exponent - 2.0 * error > 0.0) else 0


def _outcome(projected: int, simulated: bool) -> str:
    if projected == 0:
        return OUTCOMES[4]
    if (projected > 0) == simulated:
        return OUTCOMES[0] if simulated else OUTCOMES[1]
    return OUTCOMES[3] if simulated else OUTCOMES[2]


def _split(line: Exponents, places: np.ndarray) -> bool:
    """True if the synchronous motions of different starts have exponents of different signs."""
    largest = line.by_start[:, places].max(axis=1)
    return bool(largest.min() < 0.0 < largest.max())


@dataclass(frozen=True, slots=True)
class DirectSimulation:
    """Direct simulation of one scene."""

    scene: Scene
    criterion: AppliedCriterion
    execution: Execution

    def simulate(self, sigma: np.ndarray, longer: float = 1.0, near: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """Share of the starts that synchronised and median error (sigma,); `near` starts next to
        the synchronous state.
        """
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
    """The cells with causes: disagreements are simulated again, longer, and from next to the
    synchronous state.
    """
    made = list(cells)
    odd = [i for i, cell in enumerate(cells) if cell.outcome in OUTCOMES[2:4]]
    if not odd:
        return made
    sigma = np.array([cells[i].sigma for i in odd])
    longer = simulation.simulate(sigma, LONGER)[0]
    near = simulation.simulate(sigma, LONGER, near=True)[0]
    for i, later, close in zip(odd, longer, near, strict=True):
        merged = cells[i].error < MERGED * simulation.criterion.size
        made[i] = replace(cells[i], cause=_cause(cells[i], merged, float(later), float(close), split[i]))
    return made


def _cause(cell: Cell, merged: bool, longer: float, near: float, split: bool) -> str:
    """Why a simulation disagrees, from the shares of starts that synchronise after a longer
    transient and from nearby.
    """
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
