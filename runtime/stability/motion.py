"""Measure the scales of a motion: the extent of each component, the time of a turn, and the size of terms of rates.

The scales depend on no unit: extents scale with x -> s x + c for each component, times with t -> k t.

A path is integrated in steps that are short compared with the extent so far (`path`). The unit of time
(`turns_of`) is the mean time between maxima of a component. If the path ends at an equilibrium, the unit
follows from the slowest rate there.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple, Protocol

import numpy as np
import sympy as sp

from synchain.codegen.driver.columns import Control
from synchain.models.dynamics.angles import Periods, periods_of_states
from synchain.models.dynamics.equations import Equations
from synchain.models.inputs.keywords import warn
from synchain.models.mechanics.components import TIME, Edge, Node

from .averages import ROUNDING
from .slow_motion import CONTRACTED

SHARE = 8
"""A path takes at least SHARE steps from one end of the extent of a component to the other (a choice)."""

FINE = 6
"""A step of a path probably hides a spike, and is repeated in halves, if its number of integrator steps exceeds twice
that
of the last step by more than FINE."""

TURNED, JUMP = 0.5, 32
"""TURNED: least cosine of the angle by which the motion may turn in a step of a path. JUMP: a step JUMP times shorter
than
the last one may turn by more, because the rates jump there."""

FIRST = 1e-6
"""First step of a path, relative to the shortest time estimated at the start; the motion hardly changes in it."""

SAMPLES, LOOKED, OFTEN = 4096, 64, 8
"""Most steps of a path; steps between two counts of turns; steps between two tests for an even drift (a choice)."""

NOISE = 10.0
"""Rates count as constant if they change by less than NOISE rtol times their change over the extent."""

EVEN = 1e-3
"""Largest relative change of the speed of an even drift (a choice)."""

FURTHER = 1e9
"""A drift goes on for ever: rates must not change when its components move FURTHER times as far (a choice)."""

CLEAR = 1 / 32
"""Least rise and fall of a turn, relative to the extent of its component (a choice)."""

ENOUGH = 12
"""Number of turns in the mean (a choice)."""

APPROACH, OTHER, STEADY, AFFORDED = 300, 4.0, 1.25, 4_000_000
"""While a component moves one way that changes the rates, or volumes have not shrunk since turns took STEADY times longer
or shorter, the motion still approaches its attractor.  It runs for APPROACH turns, as many as the usual transient, then for
twice as long each time. A later turn counts if it lasts OTHER times longer or shorter. After AFFORDED steps a warning says
that the motion may be an approach (choices)."""

REST = 1e-9
"""Rates count as zero if they are below their change over this part of the extent of the motion."""

DIGITS = 1e-10
"""Relative error of steps: a rate below this part of its terms counts as zero; a component that moves by less than this
part of its size is at rest."""

ASIDE = 1e-6
"""Displacement in difference quotients of rates, relative to the extent of the motion."""

STILL = 1e-6
"""A component is at rest if its later motion is below this part of its whole motion; the whole motion is then its
extent."""

FLAT = 1e-6
"""Difference quotients do not resolve rates of an equilibrium below this part of the fastest rate."""

ALIKE = 0.25
"""Two motions are alike if their means differ by less than ALIKE times the larger extent, and their extents by less than
twice as much (a choice)."""

REACH = 0.4
"""Largest distance of a further start in the first component, relative to the extent of the motion (a choice)."""


class OrbitIntegrator(Protocol):
    """An integrator of one orbit."""

    state: np.ndarray  # (1, states)
    control: np.ndarray  # tolerances, in the columns of `Control`
    steps: int  # steps so far

    def advance(self, length: float) -> object:
        """Integrate over a length of time."""


class RateFunctions(NamedTuple):
    """Rates of a state (p,) at time 0, and sums of the absolute values of terms; drives count with amplitude."""

    values: Callable[[np.ndarray], np.ndarray]
    sizes: Callable[[np.ndarray], np.ndarray]
    periods: tuple[float | None, ...] = ()  # the period of each state that is an angle, None for the others
    jump: bool = False  # True if events, such as the end of stick, change the rates

    def difference(self, state: np.ndarray, start: np.ndarray) -> np.ndarray:
        """Return the difference (p,) of two states without whole turns of angles."""
        return state - start - whole_turns(self.periods, state - start)

    def rounding(self, state: np.ndarray, time: float) -> np.ndarray:
        """Return the distance (p,) by which rounding alone may move each component within a time."""
        return np.asarray(ROUNDING * (np.abs(state) + np.nan_to_num(time * self.sizes(state))))

    def ignore(self, state: np.ndarray, move: np.ndarray, allowed: np.ndarray | float = 0.0) -> bool:
        """Return True if the rates do not depend on a drift (p,): if a move changes none by more than `allowed`.

        Angles move by whole turns, other components FURTHER times as far, each alone or all by their mean.
        """
        periods = np.array(self.periods or (None,) * len(state), dtype=float)  # NaN for None
        angle, moving = np.isfinite(periods), move != 0.0
        turns = np.where(angle, periods, 1.0)
        moves = [np.where(angle, turns * np.round(move / turns), FURTHER * move)]
        if np.any(moving & ~angle):
            moves.append(np.where(moving & ~angle, FURTHER * move[moving & ~angle].mean(), moves[0]))
        if np.any(moving & angle):
            moves.append(np.where(moving, move[moving].mean(), 0.0))
        here = self.values(state)
        with np.errstate(all="ignore"):
            return any(
                bool(np.all(np.abs(self.values(there) - here) <= allowed + DIGITS * self.sizes(there)))
                for there in (state + each for each in moves)
            )

    def slopes(self, state: np.ndarray, extent: np.ndarray) -> np.ndarray:
        """Return the change (p, p) of each rate, to first order, if one component moves by its extent."""
        here = self.values(state)
        with np.errstate(all="ignore"):
            moved = [self.values(state + move) - here for move in np.diag(ASIDE * extent)]
        return np.array(moved).T / ASIDE

    def contraction(self, state: np.ndarray, extent: np.ndarray) -> float:
        """Return the rate at which volumes shrink in each dimension at a state; NaN if it cannot be computed."""
        scale = np.where(extent > 0.0, extent, np.where(state != 0.0, np.abs(state), 1.0))
        return -float(np.trace(self.slopes(state, scale) / scale)) / len(state)


class Spread(NamedTuple):
    """Mean and extent (…, p) of each component of a motion."""

    mean: np.ndarray
    extent: np.ndarray

    @classmethod
    def of(cls, states: np.ndarray) -> Spread:
        """Return mean and extent of states (k, …, p)."""
        return cls(np.mean(states, axis=0), np.ptp(states, axis=0))

    def like(self, other: Spread, least: np.ndarray | float = 0.0) -> np.ndarray:
        """Return where two motions (…) are alike; means that differ by less than `least` (p,) are alike."""
        allowed = ALIKE * np.maximum(self.extent, other.extent) + least
        apart = np.abs(self.mean - other.mean) > allowed
        wider = np.abs(self.extent - other.extent) > 2.0 * allowed
        return np.asarray(~np.any(apart | wider, axis=-1))


class Turns(NamedTuple):
    """A unit of time, and the extent of a motion."""

    time: float  # period of the drive, or mean time of a turn
    extent: np.ndarray  # (p,): extent of each component
    label: str = "unit of time"  # text that describes `time`

    def __str__(self) -> str:
        """Return the meaning and the length of the unit of time."""
        return f"{self.label}, {self.time:.6g} units of time"


def whole_turns(periods: Periods, differences: np.ndarray) -> np.ndarray:
    """Return the whole turns in differences (…, states) of states; 0 for states that are no angles."""
    turns = np.zeros_like(differences)
    for place, period in enumerate(periods[: differences.shape[-1]]):
        if period is not None:
            turns[..., place] = period * np.round(differences[..., place] / period)
    return turns


def rates_of(equations: Equations, parameters: dict[str, float]) -> RateFunctions:
    """Return the rates of equations as functions of the state alone; with a mass matrix M, of M^-1 times the forces."""
    names = [sp.Symbol(name, real=True) for name in (*equations.state, *equations.parameters)]
    values = np.array([parameters[name] for name in equations.parameters], dtype=float)
    rates, sizes = (_summed(equations, names, values, change) for change in (lambda e, _: e, _size))
    mass, angles = equations.mass(), periods_of_states(equations)
    if not mass:
        return RateFunctions(rates, sizes, angles, equations.sticks)
    masses, places = sp.lambdify(names, [*mass.values()], "numpy"), tuple(np.array([*mass]).T)

    def inverse(state: np.ndarray) -> np.ndarray:
        matrix = np.zeros((len(state), len(state)))
        matrix[places] = masses(*state, *values)
        return np.linalg.inv(matrix)

    return RateFunctions(
        lambda state: inverse(state) @ rates(state),
        lambda state: np.abs(inverse(state)) @ sizes(state),
        angles,
        equations.sticks,
    )


def _summed(
    equations: Equations,
    names: list[sp.Symbol],
    values: np.ndarray,
    change: Callable[[sp.Expr, set[sp.Symbol]], sp.Expr],
) -> Callable[[np.ndarray], np.ndarray]:
    """Return the sum of nodes and links at time 0 as a function of the state; `change` has expressions and modes of events.

    Each template is compiled once, and evaluated for all its nodes or links together.
    """
    # a column for each state, parameter and number (the weights of links)
    columns: dict[sp.Expr, int] = {s: k for k, s in enumerate(names)}
    uses: dict[Node | Edge, list[tuple[Sequence[int], dict[sp.Symbol, sp.Expr]]]] = {}
    for i, places in enumerate(equations.places):
        uses.setdefault(equations.node_at(i), []).append((places, equations.at_node(i)))
    for link, edge in equations.linked():
        uses.setdefault(edge, []).append((equations.places[link[0]], equations.at_link(link, edge)))
    parts, nodes = [], range(equations.n)
    all_modes = {s for i in nodes for s in equations.symbols(i)[len(equations.node_at(i).continuous) :]}
    for template, each in uses.items():
        modes = {s for s, at in each[0][1].items() if at in all_modes}
        rates = [change(e, modes).xreplace({TIME: sp.S.Zero}) for e in template.rhs]
        symbols = sorted({s for e in rates for s in e.free_symbols}, key=lambda s: s.name)
        chosen = [[columns.setdefault(at.get(s, s), len(columns)) for _, at in each] for s in symbols]
        arguments = [np.array(row) if len(row) > 1 else row[0] for row in chosen]
        parts.append((sp.lambdify(symbols, rates, "numpy"), arguments, np.array([places for places, _ in each])))
    numbers = np.array([*values, *map(float, [*columns][len(names) :])])

    def total(state: np.ndarray) -> np.ndarray:
        known, result = np.concatenate([state, numbers]), np.zeros(len(state))
        for function, arguments, rows in parts:
            for row, rate in zip(rows.T, function(*(known[a] for a in arguments)), strict=True):
                np.add.at(result, row, rate)
        return result

    return total


def _size(e: sp.Expr, modes: set[sp.Symbol]) -> sp.Expr:
    """Return the sum of absolute values of terms, also in products; waves of time count with their amplitude."""
    if isinstance(e, sp.sin | sp.cos) and e.has(TIME):
        return sp.S.One
    # modes are whole numbers: 1 - slip**2 has no rounding error
    if isinstance(e, sp.Add | sp.Mul) and not e.free_symbols <= modes:
        return e.func(*(_size(part, modes) for part in e.args))
    if isinstance(e, sp.Pow) and e.exp.is_integer and e.exp.is_positive:
        return _size(e.base, modes) ** e.exp
    return sp.Abs(e)


def extent_of(
    states: np.ndarray, settled: np.ndarray, still: float = STILL, rounding: np.ndarray | float = 0.0
) -> np.ndarray:
    """Return the extent of each component (…) in the `settled` states (k, …).

    The extent of a component at rest is that in all `states`. A component is at rest if it moves by less than
    `rounding`, or by less than the part `still` of its motion in all states.
    """
    later, total = np.ptp(settled, axis=0), np.ptp(states, axis=0)
    return np.where(later > np.maximum(still * total, rounding), later, total)


def above(extent: np.ndarray, rounding: np.ndarray) -> np.ndarray:
    """Return the extents (…), with 0 for an extent that may be rounding alone."""
    return np.where(extent > rounding, extent, 0.0)


def starts_near(state: np.ndarray, extent: np.ndarray, count: int, seed: int) -> np.ndarray:
    """Return `count` states: a state (p,), and copies whose first component moves by at most REACH extents."""
    starts = np.tile(state, (count, 1))
    starts[1:, 0] += extent[0] * np.random.default_rng(seed).uniform(-REACH, REACH, count - 1)
    return starts


def rests(
    rates: RateFunctions, state: np.ndarray, closed: float, extent: np.ndarray, noise: np.ndarray | float = 0.0
) -> bool:
    """Return True if the rates at a state count as zero.

    A rate counts as zero if it is below the rounding of its terms, or below its change over `closed` times the extent,
    or over the `noise` of the components.
    """
    changes = np.abs(rates.slopes(state, np.maximum(extent, noise / closed))).sum(axis=1)
    here = np.abs(rates.values(state))
    return bool(np.all(here <= np.nan_to_num(closed * changes) + DIGITS * rates.sizes(state)))


def path(
    integrator: OrbitIntegrator, rates: RateFunctions, shortest: float, hidden: int = 0
) -> Iterator[tuple[np.ndarray, float, np.ndarray, np.ndarray]]:
    """Advance one orbit by steps in which components move by a small part of their extents and the motion hardly turns.

    After each step, yield the state before the step, the length of the step, the extent (p,) so far, and the rates (p,)
    after the step. A step of the shortest length may move or turn by more; the first steps do, and so do steps across a
    jump of the rates. The last `hidden` states of the integrator are no part of the motion.
    """
    count = integrator.state.shape[1] - hidden
    step, low, high = shortest, integrator.state[0, :count].copy(), integrator.state[0, :count].copy()
    speed, last, few = rates.values(low), shortest, math.inf
    while True:
        before, done = integrator.state[:, :count], integrator.steps
        integrator.advance(step)
        after = integrator.state[0, :count]
        lower, higher = np.minimum(low, after), np.maximum(high, after)
        moved, extent = SHARE * np.abs(after - before[0]), higher - lower
        # a component that has moved by rounding alone, such as the speed of a body in stick, limits no step
        farthest = np.maximum(extent, SHARE * rates.rounding(after, shortest / FIRST))
        taken, velocity = integrator.steps - done, rates.values(after)
        turned = step * JUMP > last and _cosine(speed, velocity, extent) < TURNED
        if step > shortest and (taken > 2 * few + FINE or turned or np.any(moved > farthest)):
            integrator.state, step = np.pad(before, ((0, 0), (0, hidden))), max(shortest, 0.5 * step)
            continue
        low, high, speed, last, few = lower, higher, velocity, step, taken
        yield before, step, extent, velocity
        step *= 1.5 if np.all(2.0 * moved <= farthest) else 1.0


def _cosine(first: np.ndarray, second: np.ndarray, extent: np.ndarray) -> float:
    """Return the cosine of the angle between rates (p,) in units of the extents; NaN if one is zero."""
    with np.errstate(all="ignore"):
        a, b = (np.where(extent > 0.0, rate / extent, 0.0) for rate in (first, second))
        return float(a @ b / np.sqrt((a @ a) * (b @ b)))


def shortest_time(rates: RateFunctions, state: np.ndarray) -> float:
    """Return a time in which a state hardly changes, from its rates and their slopes; 1 if all of them are zero."""
    size, speed = np.abs(state), np.abs(rates.values(state))
    moving = (size > 0.0) & (speed > DIGITS * rates.sizes(state))
    times = [*(size[moving] / speed[moving])]
    if (fastest := _fastest(rates, state)) > 0.0:
        times.append(1.0 / fastest)
    return FIRST * float(min(times, default=1.0 / FIRST))


def _fastest(rates: RateFunctions, state: np.ndarray) -> float:
    """Return the largest eigenvalue of the slopes of the rates, by size; 0 if the slopes are not finite."""
    size = np.abs(state)
    scale = np.where(size > 0.0, size, size.max(initial=0.0) or 1.0)
    slopes = rates.slopes(state, scale) / scale[None, :]
    return float(np.abs(np.linalg.eigvals(slopes)).max()) if np.isfinite(slopes).all() else 0.0


def turns_of(integrator: OrbitIntegrator, rates: RateFunctions, hidden: int = 0) -> Turns:
    """Measure the mean return time of an undriven orbit, or the slowest rate of the equilibrium that the orbit reaches.

    The turns of a fast approach, such as those of Lorenz's system from x = 1e6, are not the unit of time: measure again
    until no component moves one way, and volumes have shrunk while the time of a turn did not change.
    """
    turns, path_states, time = _turns_of_path(integrator, rates, hidden)
    trend, before, length, begun, last = _trend(path_states), path_states[-1], 0.0, integrator.steps, turns
    shrinks = _contraction(rates, path_states, turns.extent)
    shrunk = shrinks * time
    while trend.any() or (shrunk < CONTRACTED and shrinks * time > FLAT):
        length = max(2.0 * length, APPROACH * turns.time)
        if integrator.steps - begun > AFFORDED:
            if trend.any():  # `warn_of_slow_motion` warns if volumes have not shrunk
                warn(
                    f"found a component that moves one way over {length / turns.time:.1g} turns of {turns.time:.3g} units of time; "
                    "expected motion on an attractor, the unit of time may be that of an approach; start nearer to the attractor"
                )
            break
        try:
            integrator.advance(length)
        except FloatingPointError:  # the transient raises the error for an unbounded motion
            break
        later, path_states, time = _turns_of_path(integrator, rates, hidden)
        shrinks = _contraction(rates, path_states, later.extent)
        same = last.time / STEADY < later.time < STEADY * last.time
        shrunk, last = shrunk + shrinks * (length + time) if same else 0.0, later
        if not turns.time / OTHER < later.time < OTHER * turns.time:
            turns = later
        # the same components go on the same way, and the rates depend on them
        move = path_states[-1] - before
        trend = np.where((_trend(path_states) == trend) & (np.sign(path_states[0] - before) == trend), trend, 0.0)
        if trend.any() and rates.ignore(before, np.where(trend, move, 0.0)):
            trend = np.zeros_like(trend)
        before = path_states[-1]
    return turns


def _contraction(rates: RateFunctions, states: np.ndarray, extent: np.ndarray) -> float:
    """Return the mean rate at which volumes shrink in each dimension at states (k, p); 0 for one state."""
    looked = states[:: max(1, len(states) // OFTEN)] if len(states) > 1 else states[:0]
    return float(np.mean([rates.contraction(state, extent) for state in looked] or 0.0))


def _trend(states: np.ndarray) -> np.ndarray:
    """Return 1 or -1 for each component that moves one way through the states (k, p), else 0; 0 for one state."""
    steps = np.sign(np.diff(states, axis=0))
    return np.where(np.all(steps == steps[:1], axis=0), steps[0], 0.0) if len(steps) else np.zeros(states.shape[1])


def _turns_of_path(integrator: OrbitIntegrator, rates: RateFunctions, hidden: int) -> tuple[Turns, np.ndarray, float]:
    """Return unit and extent of a path, its later states (k, p) if it turns, else its last one, and its length of time.

    A motion with constant rates, such as that of locked phases, counts as an equilibrium that drifts. A turn of a
    component lasts from one maximum to the next; between them the component falls and rises by at least CLEAR times its
    extent. The component with the most turns gives the time. Only the later three quarters of a path are searched.
    """
    count = integrator.state.shape[1] - hidden
    start = integrator.state[0, :count].copy()
    times, states, velocities, time = [0.0], [start], [rates.values(start)], 0.0
    extent, closed = np.zeros_like(start), NOISE * float(integrator.control[Control.RTOL])
    shortest = shortest_time(rates, start)
    # motion below this size is rounding, such as the speed of a body in stick
    noise = rates.rounding(start, shortest / FIRST)
    if not rests(rates, start, REST, extent, noise):
        try:
            steps = path(integrator, rates, shortest, hidden)
            for k, (_, step, extent, velocity) in enumerate(steps, 1):
                time += step
                times.append(time)
                states.append(integrator.state[0, :count])
                velocities.append(velocity)
                if not np.isfinite(time) or k == SAMPLES:
                    break
                noise = rates.rounding(states[-1], shortest / FIRST)
                still = np.all(np.abs(states[-1] - states[-2]) <= STILL * extent + noise)
                if still and k > LOOKED and rests(rates, states[-1], REST, extent, noise):
                    break
                if k % LOOKED == 0 and _mean_turn(np.array(times[k // 4 :]), np.array(states[k // 4 :]), noise, ENOUGH):
                    break
                if k % OFTEN == 0 and _drift(rates, times, states, velocities, extent, closed) is not None:
                    break
        except FloatingPointError:  # the transient raises the error for an unbounded motion
            pass
    # subtract an even drift, such as that of locked phases: only the approach to the drift counts as motion
    at_rest = rests(rates, states[-1], REST, extent, noise)
    drift = _drift(rates, times, states, velocities, extent, closed)
    even = np.zeros_like(start) if at_rest else drift
    early, path_states = len(times) // 4, np.array(states)
    if even is not None:
        path_states = path_states - np.outer(times, even)
    late = path_states[early:]
    extent = extent_of(path_states, late[len(late) // 2 :])
    unit, label, turning = time or 2.0 * np.pi, "time in which nothing returns" if time else "nothing moves", late[-1:]
    if turn := _mean_turn(np.array(times[early:]), late, noise, 1):
        unit, label, turning = turn, "mean return time", late
    elif even is not None and (slow := _slowest(rates, states[-1], extent)):
        unit, label = 2.0 * np.pi / slow, "turn of the slowest rate"
    return Turns(unit, above(extent, rates.rounding(states[-1], unit)), label), turning, time


def _drift(
    rates: RateFunctions,
    times: list[float],
    states: list[np.ndarray],
    velocities: list[np.ndarray],
    extent: np.ndarray,
    closed: float,
) -> np.ndarray | None:
    """Return the rates (p,) if they have not changed in the later half of the time, else None."""
    # a body in stick on a moving ground has constant rates until it slips
    if rates.jump or len(states) <= LOOKED:
        return None
    first = bisect_left(times, 0.5 * times[-1])
    # the slow part of a relaxation oscillation resembles a drift: wait until the motion has gone far at one speed
    far = (SHARE * np.abs(states[-1] - states[first]) >= extent) & (extent > 0.0)
    if not far.any():
        return None
    changes, last = np.ptp(velocities[first:], axis=0), velocities[-1]
    if np.any(changes[far] > EVEN * np.abs(last[far])):
        return None
    swing = np.abs(rates.slopes(states[-1], extent)).sum(axis=1)
    limits = np.nan_to_num(closed * swing) + DIGITS * rates.sizes(states[-1])
    ahead = np.where(far, last * (times[-1] - times[first]), 0.0)
    if np.any(changes > limits) or not rates.ignore(states[-1], ahead, limits):
        return None
    # the first steps from a small component are so short that no rate changes: wait for the time of the fastest rate
    fastest = _fastest(rates, states[-1])
    return last if fastest == 0.0 or times[-1] * fastest >= 1.0 else None


def _mean_turn(times: np.ndarray, states: np.ndarray, noise: np.ndarray, fewest: int) -> float:
    """Return the mean time between maxima of the component with the most maxima; 0 for fewer than `fewest` turns.

    Components that move by less than the `noise` (p,) are at rest.
    """
    best, mean = fewest, 0.0
    for x, least in zip(states.T, noise, strict=True):
        extent = np.ptp(x)
        if not extent > max(DIGITS * np.abs(x).max(), least):
            continue
        tops = _tops(x, CLEAR * extent)
        if len(tops) > best:
            best, mean = len(tops), float(times[tops[-1]] - times[tops[0]]) / (len(tops) - 1)
    return mean


def _tops(x: np.ndarray, least: float) -> list[int]:
    """Return the indices of the maxima of a component (k,) between a rise and a fall by more than `least`.

    The first rise must come after a fall.
    """
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
    """Return the slowest resolved rate of an equilibrium; 0 if no rate is resolved."""
    scale = np.where(extent > 0.0, extent, np.where(state != 0.0, np.abs(state), 1.0))
    slopes = rates.slopes(state, scale) / scale[None, :]
    if not np.isfinite(slopes).all():
        return 0.0
    sizes = np.abs(np.linalg.eigvals(slopes))
    sizes = sizes[sizes > FLAT * sizes.max(initial=0.0)]
    return float(sizes.min(initial=np.inf)) if len(sizes) else 0.0
