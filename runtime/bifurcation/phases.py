"""Phases of stick and slip of a periodic orbit, and its distance from orbits with other phases.

Phases are read from samples of one cycle, and distances between them from polynomials through
neighbouring samples, whose error is far below that of the orbit. A stick shorter than the distance
of two samples is known by the load at its beginning; a slip as short as that is not seen.

Source: di Bernardo, Budd, Champneys & Kowalczyk, Piecewise-smooth Dynamical Systems (Springer,
2008), chapters 7-8.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
import sympy as sp
from numpy.polynomial import Polynomial

from synchain.models.graphs.families import topology
from synchain.models.mechanics.components import TIME
from synchain.models.mechanics.events import Event
from synchain.models.scenes.scene import Scene

from ..cells.run_keywords import ONE_CELL
from ..sweeps.run import run

SAMPLES = 2000
"""Samples in each period of the drive."""

REACH = 3
"""Samples on each side of the middle one of a polynomial."""


@dataclass(frozen=True, slots=True)
class Phases:
    """Phases of one cycle."""

    # 0 for stick, +1 and -1 for slip, in the order of time. The rotation that comes first in lexicographic order is
    # used
    slip_states: tuple[int, ...]
    # least minimum, inside a phase, of the sliding speed in slip and of the distance of the load from the limits of
    # static friction in stick; inf if there is none
    gap: float
    # distance of the load from those limits at the end of slip, at the landing nearest to them, positive if it
    # sticks; inf if slip never ends
    landing: float

    @property
    def words(self) -> str:
        """The phases in words, for example "stick, slip +"."""
        return ", ".join({0: "stick", 1: "slip +", -1: "slip -"}[mode] for mode in self.slip_states)


def phases_of(scene: Scene, state: np.ndarray, periods: int) -> Phases | None:
    """Determine the phases of a periodic orbit. Shapes: state (components,)."""
    events = scene.equations.node.events
    if not events:
        return None
    single = scene.replace(
        **{**ONE_CELL, "record": ("trajectory",)},
        topology=topology("chain", 1),
        samples=SAMPLES * periods + 1,
        transient=0.0,
        window=float(periods),
        time_unit="period",
        initial={"x": [float(state[0])], "v": [float(state[1])]},
    )
    once = np.asarray(run(single, show_progress=False, workers=1).trajectory.sel(node=1).values, dtype=float)[:-1]
    path = np.concatenate([once, once])  # two cycles, so that each phase is seen whole
    t, slip = np.arange(len(path)) * ((scene.period or 0.0) / SAMPLES), np.round(path[:, 2]).astype(int)
    held, slides = _margins(scene, events[0])
    values = np.where(slip == 0, held(path[:, 0], t), slip * slides(path[:, 1]))
    changes = np.flatnonzero(slip[1:] != slip[:-1]) + 1
    if len(changes) == 0:
        return Phases((int(slip[0]),), _least(np.concatenate([values[-1:], values])), math.inf)
    slip_states, gaps, landings = [], [math.inf], [math.inf]
    for a, b in pairwise(changes.tolist()):
        if a > len(once):
            break
        slip_states.append(int(slip[a]))
        gaps.append(_least(values[a:b]))
        if slip[a] != 0:
            landings.append(_landing(slice(a, b), t, path, slides, held))
            if landings[-1] > 0.0 and slip[b] != 0:
                slip_states.append(0)  # it sticks for less than the distance of two samples
    return Phases(_canonical(slip_states), min(gaps), min(landings, key=abs))


Function = Callable[..., np.ndarray]
"""A function of arrays."""


def _margins(scene: Scene, event: Event) -> tuple[Function, Function]:
    """Functions for the distance of the load from the limits of friction, and the speed."""
    up, down, sliding = _functions(event, tuple(scene.equations.node.state), tuple(scene.parameters))
    numbers = list(scene.parameters.values())
    return (
        lambda place, t: np.minimum(up(place, 0.0, t, *numbers), -down(place, 0.0, t, *numbers)),
        lambda speed: np.asarray(sliding(0.0, speed, 0.0, *numbers)),
    )


@lru_cache(maxsize=16)
def _functions(event: Event, state: tuple[sp.Symbol, ...], names: tuple[str, ...]) -> tuple[Function, ...]:
    """Both limits and the sliding velocity as functions of state, time and parameters."""
    symbols = [*state[:2], TIME, *(sp.Symbol(name, real=True) for name in names)]
    return tuple(sp.lambdify(symbols, e, "numpy") for e in (*event.limits, event.level))


def _least(values: np.ndarray) -> float:
    """Least of the minima inside a row of equally spaced values, each from a local polynomial."""
    inner = np.flatnonzero((values[1:-1] <= values[:-2]) & (values[1:-1] < values[2:])) + 1
    least = math.inf
    for k in map(int, inner):
        a = min(max(k - REACH, 0), max(len(values) - 2 * REACH - 1, 0))
        near = values[a : a + 2 * REACH + 1]
        bent = Polynomial.fit(np.arange(len(near)) - float(k - a), near, len(near) - 1)
        turns = [r.real for r in bent.deriv().roots() if abs(r.imag) < 1e-9 and abs(r.real) <= 1.0]
        least = min([least, *(float(bent(turn)) for turn in turns)])
    return least


def _landing(piece: slice, t: np.ndarray, path: np.ndarray, slides: Function, held: Function) -> float:
    """Margin of the load at the end of a slip, extrapolated from its last samples."""
    first = max(piece.stop - 2 * REACH, piece.start)
    steps = np.arange(first, piece.stop) - (piece.stop - 1.0)
    sliding = Polynomial.fit(steps, slides(path[first : piece.stop, 1]), len(steps) - 1)
    place = Polynomial.fit(steps, path[first : piece.stop, 0], len(steps) - 1)
    zeros = [(float(r.real), float(r.imag)) for r in sliding.roots()]
    roots = [real for real, imaginary in zeros if abs(imaginary) < 1e-6 and -1e-9 <= real <= 1.0 + 1e-9]
    at = min(roots, default=0.5)
    return float(held(place(at), t[piece.stop - 1] + at * (t[1] - t[0])))


def _canonical(slip_states: list[int]) -> tuple[int, ...]:
    """Rotation of a cycle that comes first in lexicographic order."""
    return min(tuple(slip_states[k:] + slip_states[:k]) for k in range(len(slip_states)))
