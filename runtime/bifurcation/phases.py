"""Find the phases of stick and slip of a periodic orbit, and the distance of the orbit from a change of phases.

The orbit is sampled over one cycle.  Its margin is a function of time that reaches zero where a phase ends: in stick
the distance of the load from the limits of static friction, in slip the sliding speed.

* gap: the least minimum of the margin inside a phase; it closes in grazing.
* landing: the distance of the load from the limits at the end of slip; below zero the body turns at once (stick loss).

Minima and landings are computed from polynomials through neighbouring samples; their error is far below that of the
orbit. A stick shorter than the distance of two samples is recognised by the load at its beginning; so short a slip is
missed.

Source: di Bernardo, Budd, Champneys & Kowalczyk, Piecewise-smooth Dynamical Systems (Springer, 2008), chapters 7-8.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
import sympy as sp
from numpy.polynomial import Polynomial

from synchain.models.mechanics.components import TIME
from synchain.models.mechanics.events import Event
from synchain.models.mechanics.rows import Law, Row
from synchain.models.scenes.scene import Scene

from ..cells.run_keywords import ONE_CELL, with_numbers
from ..results.result import Result
from ..sweeps.run import run
from .flow import TOLERANCE

Function = Callable[..., np.ndarray]
"""A function of arrays."""

SAMPLES = 2000  # samples in each period of the drive (a choice)
REACH = 3  # samples on each side of the middle one of a polynomial, which has the degree 6 (a choice)


@dataclass(frozen=True, slots=True)
class Phases:
    """Phases of one cycle."""

    # 0 for stick, +1 and -1 for slip, in the order of time; of all rotations the first in lexicographic order
    slip_states: tuple[int, ...]
    gap: float  # least minimum of the margin inside a phase; inf if there is none
    landing: float  # smallest margin at an end of slip; > 0: it sticks, < 0: it turns at once; inf: slip never ends

    @property
    def words(self) -> str:
        """The phases as text, for example "stick, slip +"."""
        return ", ".join({0: "stick", 1: "slip +", -1: "slip -"}[mode] for mode in self.slip_states)


@dataclass(frozen=True, slots=True)
class RowPhases(Phases):
    """Events of one cycle of a node with rows: `slip_states` holds 16 times the row, and the modes before and after."""

    names: tuple[str, ...] = ()  # of the rows
    times: tuple[float, ...] = ()  # of the events, in cycles, ascending

    @property
    def words(self) -> str:
        """The events as text, for example "impact 1, slip_x held"."""
        return ", ".join(f"{self.names[row]} {_MEANINGS[before, after]}" for row, before, after in self._events)

    @property
    def crossings(self) -> tuple[tuple[int, int, int], ...]:
        """The events without stays on a surface that is left on the other side."""
        events = list(self._events)
        for k, (row, before, _) in enumerate(self._events):
            later = next((each for each in (*self._events[k + 1 :], *self._events[:k]) if each[0] == row), None)
            if self._events[k][2] == 0 and later is not None and later[2] == -before:
                events[events.index(self._events[k])] = (row, before, -before)
                events.remove(later)
        return min((tuple(events[k:] + events[:k]) for k in range(len(events))), default=())

    @property
    def _events(self) -> tuple[tuple[int, int, int], ...]:
        return tuple((code // 16, code % 16 // 4 - 1, code % 4 - 1) for code in self.slip_states)


_MEANINGS = {(1, 1): "jumps", (1, 0): "held", (-1, 0): "held", (0, 1): "released", (0, -1): "released", (1, -1): "crossed",
             (-1, 1): "crossed", (0, 0): "held", (-1, -1): "jumps"}  # fmt: skip


def _cycle_of(
    scene: Scene, values: Mapping[str, float], state: np.ndarray, period: float, record: tuple[str, ...]
) -> Result:
    """Run one cycle, sampled SAMPLES times in each period of the drive; the last sample is the first one again."""
    samples = SAMPLES * max(1, round(period / (scene.period or period)))
    names = [s.name for s in scene.equations.node.continuous]
    single = with_numbers(
        scene,
        values,
        **{**ONE_CELL, "record": record},
        samples=samples + 1,
        transient=0.0,
        window=period,
        time_unit="time",
        initial=dict(zip(names, map(float, state), strict=True)),
        rtol=TOLERANCE,
        atol=None,
    )
    return run(single, show_progress=False, workers=1)


def _phases_of_rows(scene: Scene, values: Mapping[str, float], state: np.ndarray, period: float) -> RowPhases:
    """Return the events of a cycle, and the least minimum of the gaps of all rows between events."""
    result = _cycle_of(scene, values, state, period, ("trajectory", "events"))
    path = np.asarray(result.trajectory.sel(node=1).values, dtype=float)[:-1]
    node, t, numbers = scene.equations.node, np.arange(len(path)) * (period / len(path)), {**scene.parameters, **values}
    margins = [
        np.broadcast_to(function(*path.T, t, *numbers.values()), t.shape)
        for function in _row_gaps(node.rows, tuple(node.state), tuple(numbers))
    ]
    table = np.array([np.ravel(result.events[f"event_{name}"].values) for name in ("time", "row", "before", "after")])
    events = table[:, np.isfinite(table[0])]
    codes = np.round(16 * (events[1] - 1) + 4 * (events[2] + 1) + events[3] + 1).astype(int).tolist()
    # the samples between events, beginning after the first one
    ends = np.unique(np.searchsorted(t, events[0]) % len(t))
    first = int(ends[0]) if len(ends) else 0
    gaps = [math.inf]
    for margin in margins:
        rolled = np.roll(margin, -first)
        if not len(ends):
            rolled = np.concatenate([rolled[-1:], rolled, rolled[:1]])
        gaps += [_least_minimum(part) for part in np.split(rolled, (ends - first)[1:])]
    rotations = (tuple(codes[k:] + codes[:k]) for k in range(len(codes)))
    modes = iter(node.modes)
    names = tuple("guard" if row.law is Law.RESET else str(next(modes)) for row in node.rows)
    times = tuple(np.sort(events[0] / period % 1.0).tolist())
    return RowPhases(min(rotations, default=()), min(gaps), math.inf, names, times)


@lru_cache(maxsize=16)
def _row_gaps(rows: tuple[Row, ...], state: tuple[sp.Symbol, ...], names: tuple[str, ...]) -> tuple[Function, ...]:
    """Compile the gaps of all rows as functions of state, time and parameters."""
    symbols = [*state, TIME, *(sp.Symbol(name, real=True) for name in names)]
    return tuple(sp.lambdify(symbols, gap, "numpy") for row in rows for gap in row.gaps)


def phases_of(scene: Scene, values: Mapping[str, float], state: np.ndarray, period: float) -> Phases | None:
    """Determine the phases of a periodic orbit of one oscillator at some parameters. Shapes: state (components,)."""
    if scene.equations.has_rows:
        return _phases_of_rows(scene, values, state, period)
    events = scene.equations.node.events
    if not events:
        return None
    samples = SAMPLES * max(1, round(period / (scene.period or period)))
    single = with_numbers(scene, values)
    result = _cycle_of(scene, values, state, period, ("trajectory",))
    once = np.asarray(result.trajectory.sel(node=1).values, dtype=float)[:-1]
    # Two cycles, so that each phase is complete in one of them: path (2 cycle, components x, v, slip).
    path = np.concatenate([once, once])
    t, slip = np.arange(len(path)) * (period / samples), np.round(path[:, 2]).astype(int)
    load_margin, sliding_speed = _margins(single, events[0])
    margin = np.where(slip == 0, load_margin(path[:, 0], t), slip * sliding_speed(path[:, 1]))
    changes = np.flatnonzero(slip[1:] != slip[:-1]) + 1
    if len(changes) == 0:
        return Phases((int(slip[0]),), _least_minimum(np.concatenate([margin[-1:], margin])), math.inf)
    # Phase by phase, those that begin in the first cycle.
    slip_states, gaps, landings = [], [math.inf], [math.inf]
    for a, b in pairwise(changes.tolist()):
        if a > len(once):
            break
        slip_states.append(int(slip[a]))
        gaps.append(_least_minimum(margin[a:b]))
        if slip[a] != 0:
            landings.append(_landing(slice(a, b), t, path, sliding_speed, load_margin))
            if landings[-1] > 0.0 and slip[b] != 0:
                slip_states.append(0)  # it sticks for less than the distance of two samples
    first_rotation = min(tuple(slip_states[k:] + slip_states[:k]) for k in range(len(slip_states)))
    return Phases(first_rotation, min(gaps), min(landings, key=abs))


def _margins(scene: Scene, event: Event) -> tuple[Function, Function]:
    """Return two functions: the distance of the load from the limits of friction, and the sliding speed."""
    up, down, sliding = _functions(event, tuple(scene.equations.node.state), tuple(scene.parameters))
    values = list(scene.parameters.values())
    return (
        lambda x, t: np.minimum(up(x, 0.0, t, *values), -down(x, 0.0, t, *values)),
        lambda v: np.asarray(sliding(0.0, v, 0.0, *values)),
    )


@lru_cache(maxsize=16)
def _functions(event: Event, state: tuple[sp.Symbol, ...], names: tuple[str, ...]) -> tuple[Function, ...]:
    """Compile both limits and the sliding velocity as functions of state, time and parameters."""
    symbols = [*state[:2], TIME, *(sp.Symbol(name, real=True) for name in names)]
    return tuple(sp.lambdify(symbols, e, "numpy") for e in (*event.limits, event.level))


def _least_minimum(values: np.ndarray) -> float:
    """Return the least of the minima inside a row of equally spaced values, each from a local polynomial."""
    inner = np.flatnonzero((values[1:-1] <= values[:-2]) & (values[1:-1] < values[2:])) + 1
    least = math.inf
    for k in map(int, inner):
        a = min(max(k - REACH, 0), max(len(values) - 2 * REACH - 1, 0))
        near = values[a : a + 2 * REACH + 1]
        polynomial = Polynomial.fit(np.arange(len(near)) - float(k - a), near, len(near) - 1)
        turns = [r.real for r in polynomial.deriv().roots() if abs(r.imag) < 1e-9 and abs(r.real) <= 1.0]
        least = min([least, *(float(polynomial(turn)) for turn in turns)])
    return least


def _landing(phase: slice, t: np.ndarray, path: np.ndarray, sliding_speed: Function, load_margin: Function) -> float:
    """Extrapolate the margin of the load to the end of a slip from its last samples, counted from the last one."""
    first = max(phase.stop - 2 * REACH, phase.start)
    steps = np.arange(first, phase.stop) - (phase.stop - 1.0)
    speed = Polynomial.fit(steps, sliding_speed(path[first : phase.stop, 1]), len(steps) - 1)
    x = Polynomial.fit(steps, path[first : phase.stop, 0], len(steps) - 1)
    # The slip ends at the first zero of the speed between the last sample and the next.
    zeros = [(float(r.real), float(r.imag)) for r in speed.roots()]
    roots = [real for real, imaginary in zeros if abs(imaginary) < 1e-6 and -1e-9 <= real <= 1.0 + 1e-9]
    at = min(roots, default=0.5)
    return float(load_margin(x(at), t[phase.stop - 1] + at * (t[1] - t[0])))
