"""Measure the synchronous motion of a network: extent, time of a turn, and number of steps.

The tolerance and the times of a criterion follow from the motion, so that results do not depend on the units of states
and time. The motion is measured with the kernel that runs the cells, which samples states at times far apart.
`stability.motion` follows an orbit step by step, but cannot integrate contacts, jumps and unequal nodes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from synchain.codegen.driver.columns import SpanColumn
from synchain.models.dynamics.equations import Equations
from synchain.models.scenes.scene import Scene

from ..cells.paces import fastest_rates
from ..cells.plan import CellRows
from ..stability.motion import above, extent_of
from ..support.status import Status
from .trials import Outcome, Trials

SAMPLES = 64
"""Number of states that are sampled in a stretch of the motion (a choice)."""

REST = 1e-5
"""A component is at rest if its later motion is below this part of its whole motion (a choice)."""

SEEN = 1e-7
"""Motion below this part of the size of a state counts as an error of the steps (a choice)."""

TURNS, ROUNDS, LONGER = 2.0, 20, 2.0
"""TURNS: number of turns of an undriven motion that determine the time of a turn. ROUNDS: most stretches of time that
are
tried, each LONGER times as long as the one before."""


@dataclass(frozen=True, slots=True)
class SynchronousMotion:
    """Scales of a synchronous motion, in non-dimensional time."""

    extent: (
        np.ndarray
    )  # (compared components,): range without its drift; of a component that comes to rest, range of the approach
    radian: float  # time in which the motion turns by a radian
    pace: float  # number of steps in a unit of time
    unit: float  # the scene's unit of time

    @property
    def size(self) -> float:
        """The extent of all components together, as one distance, like the synchronisation error."""
        return float(np.linalg.norm(self.extent))


def columns_of(equations: Equations) -> np.ndarray:
    """Return the indices (components, nodes) of the compared components in the state."""
    index = {name: k for k, name in enumerate(equations.state)}
    return np.array([[index[f"{name}_{i + 1}"] for i in range(equations.n)] for name in equations.compared])


def alike(equations: Equations, row: CellRows) -> CellRows:
    """Return a row in which all oscillators start from the state of the first one."""
    start, columns = row.start.copy(), columns_of(equations)
    start[:, columns] = start[:, columns[:, :1]]
    return replace(row, start=start)


def first_starts(scene: Scene, count: int) -> dict[str, list[float]] | None:
    """Return starts of `count` oscillators on the line through the scene's first two; None for default starts."""
    if scene.given["initial"] is None:
        return None
    first = {
        name: (*values, values[0])[:2] for name, values in scene.initial.items() if name not in scene.equations.modes
    }
    return {name: [a + k * (b - a) for k in range(count)] for name, (a, b) in first.items()}


def spread_of(equations: Equations, start: np.ndarray) -> np.ndarray:
    """Return the largest distance (components,) between oscillators in any of the starts (cells, dimension)."""
    return np.asarray(np.ptp(start[:, columns_of(equations)], axis=(0, 2)))


def measure_motion(
    trials: Trials,
    rows: Callable[[CellRows], CellRows],
    equations: Equations,
    row: CellRows,
    times: tuple[float | None, float | None],
    apart: np.ndarray,
) -> SynchronousMotion:
    """Measure the motion that begins with a row of the unreduced network. Shapes: apart (components,)."""

    def sample(ends: np.ndarray) -> Outcome:
        spans = np.tile(row.spans, (len(ends), 1))
        spans[:, SpanColumn.START], spans[:, SpanColumn.END] = 0.0, ends
        cells = replace(row.take(np.zeros(len(ends), dtype=int)), spans=spans)
        return trials.run(len(ends), lambda chosen: rows(cells.take(chosen)))

    columns, unit = columns_of(equations), float(row.spans[0, SpanColumn.START])
    period = float(row.spans[0, SpanColumn.PERIOD])

    def inverse(state: np.ndarray) -> float:
        fastest = float(fastest_rates(equations, state[None], row.numbers[0])[0])
        return 1.0 / fastest if 0.0 < fastest < math.inf else math.inf

    # choose transient and window: the given times, else multiples of the time of a radian
    radian = period / (2.0 * math.pi) if period else _radian(sample, columns, row.start[0], inverse)
    transient, window = (
        radian * radians if time is None else time * unit for time, radians in zip(times, (1000.0, 100.0), strict=True)
    )
    # sample states from the start on, and after the transient at times with golden-ratio spacing, which fit no period
    early = window * np.arange(1, SAMPLES + 1) / SAMPLES
    turned = max(window, 4.0 * math.pi * radian)  # two turns: in less than one, the extent depends on the phase
    late = transient + turned * (np.arange(1, SAMPLES + 1) * (math.sqrt(5.0) - 1.0) / 2.0 % 1.0)
    outcome = sample(np.concatenate([early, late]))
    paces = np.where(outcome.status == Status.FINISHED, outcome.steps / np.concatenate([early, late]), 0.0)
    states = np.concatenate([row.start, outcome.end])[:, columns]
    extent = _extent(np.concatenate([[0.0], early, late]), states, SAMPLES)
    return SynchronousMotion(np.where(extent > 0.0, extent, apart), radian, max(float(paces.max()), 1.0 / radian), unit)


def _radian(
    sample: Callable[[np.ndarray], Outcome],
    columns: np.ndarray,
    start: np.ndarray,
    inverse: Callable[[np.ndarray], float],
) -> float:
    """Return the time in which an undriven motion turns by a radian; without turns, 1 over its fastest rate, or 1."""
    least = inverse(start)
    length = least if math.isfinite(least) else 1.0
    for _ in range(ROUNDS):
        outcome = sample(length * np.arange(1, SAMPLES + 1) / SAMPLES)
        states = outcome.end[:, columns[:, 0]]
        if not np.isfinite(states).all():
            break
        moved = _without_drift(np.arange(SAMPLES), states, 0)
        extent, last = np.ptp(moved, axis=0), np.ptp(moved[SAMPLES // 2 :], axis=0)
        moves = last > REST * np.ptp(states, axis=0)
        if not moves.any():
            least = min(least, inverse(outcome.end[-1]))
            break
        # a turn moves a component by twice its extent
        turns = (np.abs(np.diff(moved, axis=0)).sum(axis=0)[moves] / (2.0 * extent[moves])).max()
        if turns >= TURNS:
            return float(length / (2.0 * math.pi * turns))
        length *= LONGER
    return least if math.isfinite(least) else 1.0


def _without_drift(time: np.ndarray, states: np.ndarray, first: int) -> np.ndarray:
    """Return states (times, …) minus the least-squares line through the states from index `first` on."""
    late = time[first:] - time[first:].mean()
    slope = np.tensordot(late, states[first:], axes=1) / (late @ late)
    return np.asarray(states - np.multiply.outer(time - time[first:].mean(), slope) - states[first:].mean(axis=0))


def _extent(time: np.ndarray, states: np.ndarray, late: int) -> np.ndarray:
    """Return extents of components in the last `late` states (times, components, nodes); 0 if all nodes are at rest."""
    good = np.isfinite(states).all(axis=(1, 2))
    late = int(good[-late:].sum())
    if late < 3:
        return np.zeros(states.shape[1])
    moved, least = _without_drift(time[good], states[good], -late), SEEN * np.abs(states[good]).max(axis=0)
    return above(extent_of(moved, moved[-late:], REST, least), least).max(axis=-1)
