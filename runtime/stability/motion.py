"""Scales of a motion that know no unit: how far each component moves, how long a turn takes, and how large the terms of rates are.

All lengths here follow the motion under x -> s x + c for each component, and all times under t -> k t.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
import sympy as sp

from synchain.codegen.driver.columns import Control
from synchain.models.dynamics.equations import Equations
from synchain.models.mechanics.components import TIME

from .averages import ROUNDING
from .variational_integrator import VariationalIntegrator

SHARE = 8
"""Least number of steps of a path from one end of a component to the other."""

FINE = 6
"""Most steps of the integrator by which a step of a path exceeds twice those of the one before: a spike between two states of a
path takes more."""

TURNED, JUMP = 0.5, 32
"""Least cosine of the angle by which the motion turns in a step of a path, and how many times shorter than the last one a step is
that may turn by more."""

FIRST = 1e-6
"""First step of a path, relative to the shortest time that the start lets guess."""

SAMPLES, LOOKED, OFTEN = 4096, 64, 8
"""Most steps of a path in which turns are counted, steps between two counts, and between two looks for an even drift."""

NOISE = 10.0
"""Change of rates that do not change, relative to what they change by over the extent, in units of the tolerance."""

EVEN = 1e-3
"""Largest change of the speed of an even drift, relative to it."""

CLEAR = 1 / 32
"""Least rise of a turn, relative to the extent of its component."""

ENOUGH = 12
"""Turns whose mean is taken."""

REST = 1e-9
"""Rates are zero if they are below what they change by over this part of the extent of the motion."""

DIGITS = 1e-10
"""Part of its terms below which a rate is zero, and of its size below which a component stays: steps leave such traces."""

ASIDE = 1e-6
"""How far aside rates are evaluated for their slopes, relative to the extent of the motion."""

STILL = 1e-6
"""A component whose later motion is below this part of all its motion has come to rest: its approach is its extent."""

FLAT = 1e-6
"""Part of the fastest rate of an equilibrium below which another one is not resolved."""

REACH = 0.4
"""Largest distance of a further start in the first component, relative to the extent of the motion."""


class RateFunctions(NamedTuple):
    """Rates (p,) of a state (p,) at time 0, and the sums of the sizes of their terms, with those of a drive at its largest."""

    values: Callable[[np.ndarray], np.ndarray]
    sizes: Callable[[np.ndarray], np.ndarray]

    def rounding(self, state: np.ndarray, time: float) -> np.ndarray:
        """How far each component (p,) may move by rounding alone within a time."""
        return np.asarray(ROUNDING * (np.abs(state) + np.nan_to_num(time * self.sizes(state))))

    def slopes(self, state: np.ndarray, extent: np.ndarray) -> np.ndarray:
        """How much each rate changes by (p, p) if one component moves by its extent, to first order."""
        here = self.values(state)
        with np.errstate(all="ignore"):
            moved = [self.values(state + move) - here for move in np.diag(ASIDE * extent)]
        return np.array(moved).T / ASIDE


class Turns(NamedTuple):
    """What a path shows: mean time of a turn, extent (p,) of the motion, and what the time is."""

    time: float
    extent: np.ndarray
    words: str = "unit of time"

    def __str__(self) -> str:
        """What the unit of time is, and its length."""
        return f"{self.words}, {self.time:.6g} units of time"


def rates_of(equations: Equations, parameters: dict[str, float]) -> RateFunctions:
    """Return the rates of equations as functions of the state alone."""
    names = [sp.Symbol(name, real=True) for name in (*equations.state, *equations.parameters)]
    values = [parameters[name] for name in equations.parameters]
    rhs = equations.rhs()
    rates, sizes = (
        sp.lambdify(names, [e.xreplace({TIME: sp.S.Zero}) for e in both], "numpy") for both in (rhs, map(_size, rhs))
    )
    return RateFunctions(
        lambda state: np.array(rates(*state, *values), dtype=float),
        lambda state: np.array(sizes(*state, *values), dtype=float),
    )


def _size(e: sp.Expr) -> sp.Expr:
    """The sum of the sizes of the terms of an expression, in products too; waves of time count with their amplitude."""
    if isinstance(e, sp.sin | sp.cos) and e.has(TIME):
        return sp.S.One
    if isinstance(e, sp.Add | sp.Mul):
        return e.func(*map(_size, e.args))
    if isinstance(e, sp.Pow) and e.exp.is_integer and e.exp.is_positive:
        return _size(e.base) ** e.exp
    return sp.Abs(e)


def extent_of(
    states: np.ndarray, settled: np.ndarray, still: float = STILL, rounding: np.ndarray | float = 0.0
) -> np.ndarray:
    """Return how far each component (…) moves in settled states (k, …), or in all states if it has come to rest.

    It rests if it moves by less than rounding, or by less than a part `still` of all its motion.
    """
    later, whole = np.ptp(settled, axis=0), np.ptp(states, axis=0)
    return np.where(later > np.maximum(still * whole, rounding), later, whole)


def above(extent: np.ndarray, rounding: np.ndarray) -> np.ndarray:
    """Return the extents (…), 0 for those that may be rounding."""
    return np.where(extent > rounding, extent, 0.0)


def starts_near(state: np.ndarray, extent: np.ndarray, count: int, seed: int) -> np.ndarray:
    """Return `count` states: the given one (p,), and copies up to REACH extents away in the first component, at random."""
    starts = np.tile(state, (count, 1))
    starts[1:, 0] += extent[0] * np.random.default_rng(seed).uniform(-REACH, REACH, count - 1)
    return starts


def rests(rates: RateFunctions, state: np.ndarray, closed: float, extent: np.ndarray) -> bool:
    """Return whether the rates at a state are zero: below rounding of their terms, or within what they change by over a part `closed` of the extent."""
    changes = np.abs(rates.slopes(state, extent)).sum(axis=1)
    here = np.abs(rates.values(state))
    return bool(np.all(here <= np.nan_to_num(closed * changes) + DIGITS * rates.sizes(state)))


def path(
    integrator: VariationalIntegrator, rates: RateFunctions, shortest: float
) -> Iterator[tuple[np.ndarray, float, np.ndarray, np.ndarray]]:
    """Advance a single orbit by steps in which no component moves by more than a share of its extent, and the motion does not turn round.

    Yield, after each step, the state before it, its length, the extent (p,) so far and the rates (p,) after it.  Steps of
    the shortest length may move by more, as the first ones do, and so may turns at a jump of the rates.  The absolute
    tolerance follows the extent.
    """
    step, low, high = shortest, integrator.state[0].copy(), integrator.state[0].copy()
    speed, last, few = rates.values(low), shortest, math.inf
    while True:
        before, done = integrator.state, integrator.steps
        integrator.advance(step)
        after = integrator.state[0]
        lower, higher = np.minimum(low, after), np.maximum(high, after)
        moved, extent = SHARE * np.abs(after - before[0]), higher - lower
        taken, velocity = integrator.steps - done, rates.values(after)
        turned = step * JUMP > last and _cosine(speed, velocity, extent) < TURNED
        if step > shortest and (taken > 2 * few + FINE or turned or np.any(moved > extent)):
            integrator.state, step = before, max(shortest, 0.5 * step)
            continue
        low, high, speed, last, few = lower, higher, velocity, step, taken
        yield before, step, extent, velocity
        step *= 1.5 if np.all(2.0 * moved <= extent) else 1.0


def _cosine(first: np.ndarray, second: np.ndarray, extent: np.ndarray) -> float:
    """Cosine of the angle between two rates (p,), each component in units of its extent; NaN if one of them is zero."""
    with np.errstate(all="ignore"):
        a, b = (np.where(extent > 0.0, rate / extent, 0.0) for rate in (first, second))
        return float(a @ b / np.sqrt((a @ a) * (b @ b)))


def shortest_time(rates: RateFunctions, state: np.ndarray) -> float:
    """Return a time in which nothing has happened yet at a state that does not rest; 1 if nothing tells one."""
    size, speed = np.abs(state), np.abs(rates.values(state))
    known = (size > 0.0) & (speed > 0.0)
    times = [*(size[known] / speed[known])]
    scale = np.where(size > 0.0, size, size.max(initial=0.0) or 1.0)
    slopes = rates.slopes(state, scale) / scale[None, :]
    if np.isfinite(slopes).all() and (fastest := np.abs(np.linalg.eigvals(slopes)).max()) > 0.0:
        times.append(1.0 / fastest)
    return FIRST * float(min(times, default=1.0 / FIRST))


def turns_of(integrator: VariationalIntegrator, rates: RateFunctions) -> Turns:
    """Return the mean return time of an undriven orbit, or the slowest rate of the equilibrium that it comes to.

    A motion whose rates do not change any more, such as that of locked phases, is at an equilibrium that drifts.  A turn
    of a component lasts from one top to the next, with a fall and a rise by CLEAR of its extent at least between them.
    The component with most turns counts; they are looked for in the later three quarters of a path.
    """
    start = integrator.state[0].copy()
    times, states, velocities, time = [0.0], [start], [rates.values(start)], 0.0
    extent, closed = np.zeros_like(start), NOISE * float(integrator.control[Control.RTOL])
    if not rests(rates, start, REST, extent):
        try:
            for k, (_, step, extent, velocity) in enumerate(path(integrator, rates, shortest_time(rates, start)), 1):
                time += step
                times.append(time)
                states.append(integrator.state[0])
                velocities.append(velocity)
                if not np.isfinite(time) or k == SAMPLES:
                    break
                still = np.all(np.abs(states[-1] - states[-2]) <= STILL * extent)
                if still and k > LOOKED and rests(rates, states[-1], REST, extent):
                    break
                if k % LOOKED == 0 and _mean_turn(np.array(times[k // 4 :]), np.array(states[k // 4 :]), ENOUGH):
                    break
                if k % OFTEN == 0 and _drift(rates, times, states, velocities, extent, closed) is not None:
                    break
        except FloatingPointError:  # what grows without bound is refused where it is settled
            pass
    # beside an even drift only what approaches it counts as motion: locked phases turn on at one speed
    at_rest = rests(rates, states[-1], REST, extent)
    even = np.zeros_like(start) if at_rest else _drift(rates, times, states, velocities, extent, closed)
    early, path_states = len(times) // 4, np.array(states)
    if even is not None:
        path_states = path_states - np.outer(times, even)
    late = path_states[early:]
    extent = extent_of(path_states, late[len(late) // 2 :])
    unit, words = time or 2.0 * np.pi, "time in which nothing returns" if time else "nothing moves"
    if turn := _mean_turn(np.array(times[early:]), late, 1):
        unit, words = turn, "mean return time"
    elif even is not None and (slow := _slowest(rates, states[-1], extent)):
        unit, words = 2.0 * np.pi / slow, "turn of the slowest rate"
    return Turns(unit, above(extent, rates.rounding(states[-1], unit)), words)


def _drift(
    rates: RateFunctions,
    times: list[float],
    states: list[np.ndarray],
    velocities: list[np.ndarray],
    extent: np.ndarray,
    closed: float,
) -> np.ndarray | None:
    """The rates (p,) of a motion that have not changed in the later half of its time; None if they have."""
    if len(states) <= LOOKED:
        return None
    first = bisect_left(times, 0.5 * times[-1])
    # the slow part of a relaxation oscillation looks alike beside its jumps: wait until the motion has come far at one speed
    far = (SHARE * np.abs(states[-1] - states[first]) >= extent) & (extent > 0.0)
    if not far.any():
        return None
    changes, last = np.ptp(velocities[first:], axis=0), velocities[-1]
    if np.any(changes[far] > EVEN * np.abs(last[far])):
        return None
    swing = np.abs(rates.slopes(states[-1], extent)).sum(axis=1)
    limits = np.nan_to_num(closed * swing) + DIGITS * rates.sizes(states[-1])
    return last if np.all(changes <= limits) else None


def _mean_turn(times: np.ndarray, states: np.ndarray, fewest: int) -> float:
    """Mean time between tops of the component with most of them; 0 if there are fewer than `fewest` turns."""
    best, mean = fewest, 0.0
    for x in states.T:
        extent = np.ptp(x)
        if not extent > DIGITS * np.abs(x).max():
            continue
        tops = _tops(x, CLEAR * extent)
        if len(tops) > best:
            best, mean = len(tops), float(times[tops[-1]] - times[tops[0]]) / (len(tops) - 1)
    return mean


def _tops(x: np.ndarray, least: float) -> list[int]:
    """Where a component (k,) is largest between a rise and a fall by more than `least`; the first rise comes after a fall."""
    steps = np.diff(x)
    extremes = [*(np.flatnonzero(steps[1:] * steps[:-1] <= 0.0) + 1), len(x) - 1]
    tops, low, high, rising = list[int](), 0, 0, False
    for k in extremes:
        if rising and x[k] > x[high]:
            high = k
        elif rising and x[high] - x[k] > least:
            tops += [high] if low else []
            low, rising = k, False
        elif not rising and x[k] < x[low]:
            low = k
        elif not rising and x[k] - x[low] > least:
            high, rising = k, True
    return tops


def _slowest(rates: RateFunctions, state: np.ndarray, extent: np.ndarray) -> float:
    """The slowest rate of an equilibrium that is resolved; 0 if there is none."""
    scale = np.where(extent > 0.0, extent, np.where(state != 0.0, np.abs(state), 1.0))
    slopes = rates.slopes(state, scale) / scale[None, :]
    if not np.isfinite(slopes).all():
        return 0.0
    found = np.abs(np.linalg.eigvals(slopes))
    found = found[found > FLAT * found.max(initial=0.0)]
    return float(found.min(initial=np.inf)) if len(found) else 0.0
