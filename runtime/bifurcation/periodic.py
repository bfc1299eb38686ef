"""Find a periodic orbit of a network as it moves, or near a start.

1. Nodes that start alike and stay alike by symmetry are one node of the quotient network, on which the orbit is found.
2. With a drive, Newton's method starts from the state after the transient.
3. Without a drive, the motion is followed through the transient to its first return near a state; Newton's method solves
   for state and period together (`Cycles`).  A motion that was followed must be attracted by its cycle, while a start with
   a period leads to unstable cycles as well.
4. How the nodes move is read off the motion (`pattern_of`).

Sources: Seydel, Practical Bifurcation and Stability Analysis, 3rd ed. (Springer, 2010), chapter 7; for orbits with stick,
Leine & Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems (Springer, 2004), chapters 7-8.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from numbers import Integral, Real

import numpy as np
from scipy.optimize import brentq

from synchain.models.dynamics.angles import periods_of_states
from synchain.models.dynamics.reduction import NoQuotient, quotient
from synchain.models.dynamics.synchrony import NoSynchrony
from synchain.models.inputs.checks import check_number, is_row, short_repr
from synchain.models.scenes.scene import Scene, check_scene

from ..cells.run_keywords import Given
from ..stability.limit_cycle import APART, NEAR, RETURNS, returns
from ..stability.motion import rests, turns_of, whole_turns
from ..sweeps.continued_start import StartValue, started
from .arclength import Point
from .cycles import Cycles, quotient_of
from .flow import TOLERANCE, Flow, flow_of
from .pattern import pattern_of
from .periodic_result import PeriodicOrbit, closed
from .transversal import expansion

NEWTON = {
    "rtol": f"orbits are integrated with rtol = {TOLERANCE:g}, on which the comparison of orbits rests",
    "workers": "each step of Newton's method needs the one before",
    "executor": "each step of Newton's method needs the one before",
    **{name: "a few steps of Newton's method are soon done" for name in ("show_progress", "progress")},
}
"""Keywords that functions of periodic orbits refuse, with the reason."""

# Largest distance of the state of an orbit from its image, relative to the extent of each state (a choice).
CLOSED = 1e-9
SEGMENTS = 4  # segments of an undriven orbit that is looked for near a start and a period (a choice)
# Where Newton's method fails from a start, the motion is followed over FOLLOWED periods with PARTS states in each,
# and the RECURRENCES closest returns after SPANS of a period are tried (choices).
PARTS, FOLLOWED, SPANS, RECURRENCES = 32, 4, (0.7, 1.4), 3
STILL = 1e-3  # least motion of an orbit in a period, by its rates, in units of the motion from the start (a choice)
PARTS_OF_PERIOD = 1024  # largest n for which period / n is tested as a period (a choice)
REST = 1e-9  # a motion rests if its rates are below their change over this part of its extent (a choice)
LONGEST = 10_000  # most drive periods of an orbit; unstable ones far shorter already lose all their digits
TOGETHER = 100  # periods of a transient in one call; Ctrl-C acts between calls
# States in a period from which the pattern of the nodes is read; fewer for MANY nodes (choices).
LOOKS, FEWER_LOOKS, MANY = 256, 64, 64


def periodic_orbit(
    scene: Scene,
    periods: int = 1,
    start: StartValue | None = None,
    *,
    period: float | None = None,
    clusters: Sequence[int] | None = None,
    parameters: Mapping[str, float] | None = None,
    **more: float,
) -> PeriodicOrbit:
    """Find a periodic orbit of a network as it moves, and its stability.

    Nodes that are alike and start alike move alike: the orbit is found on the quotient network, and the multipliers of
    the differences between the nodes are computed along it, mode by mode of the graph.  `print(orbit)` tells how the nodes
    move, and the stability along this motion and across it.  ``periodic_orbit(scene.lone)`` is the orbit of one node.

    Parameters
    ----------
    scene : Scene
        The network, with parameters, initial state, transient, integrator and max_steps.  The tolerance is 1e-12,
        nothing is recorded, and axes, draws and `stop` are refused.
    periods : int
        Number of drive periods after which the orbit repeats itself; 1 without a drive.
    start : Result, DataArray, mapping, or sequence of numbers, optional
        Where Newton's method starts: as for `run`, or the states of one node for all of them.  By default the scene's
        initial state after its transient.  Without a drive and without `period`, the motion from the start must reach
        the orbit, which must attract; the transient counts mean return times.
    period : float, optional
        The period near which an undriven orbit is looked for from `start`: Newton's method, for unstable orbits too; where
        it fails, again from places at which the motion from `start` nearly returns.
    clusters : sequence of int, optional
        The cluster of each node, such as ``[0, 1, 1, 0]``; by default the nodes with one start that symmetry keeps alike.
    parameters : mapping of str to float, optional
        Parameters of the scene to set, for names that are keywords already.
    **more : float
        Parameters of the scene to set.

    Returns
    -------
    PeriodicOrbit

    Raises
    ------
    ValueError
        If `periods` is out of range, a parameter is unknown, `start` is no state, or `clusters` is not balanced.
    ArithmeticError
        If Newton's method does not converge, or the motion does not return.

    See Also
    --------
    follow : Follow an orbit along a parameter and locate its bifurcations.
    skeleton : Search all orbits of some periods, stable or not.
    equilibrium : Find a state at rest.

    Examples
    --------
    The limit cycle of van der Pol's oscillator:

    >>> from synchain import Scene, periodic_orbit
    >>> orbit = periodic_orbit(Scene("van_der_pol"))
    >>> round(orbit.period, 6), orbit.stable
    (6.663287, True)

    Two of them that push each other apart:

    >>> from synchain import Field, Rates
    >>> from synchain.graphs import chain
    >>> node = Field({"x": "v", "v": "(1 - x**2)*v - x"})
    >>> pair = Scene(node, Rates({"v": "-k*W*(v_j - v_i)"}, {"k": 0.3}), chain(2), initial={"x": 2, "v": 0})
    >>> print(periodic_orbit(pair).verdict)
    synchronous; along itself stable; across it unstable in 1 of 1 modes, largest 5.92024
    """
    scene = Given(periodic_orbit, parameters, more, NEWTON).scene(check_scene(scene))
    check_periods(periods)
    if start is not None:
        scene = _started(scene, start)
    classes = _clusters(scene, clusters)
    equations = quotient_of(scene, classes, ())
    state = _quotient_state(scene, classes, equations.n)
    flow = flow_of(scene, equations, (), state)
    if equations.forced:
        if period is not None:
            raise ValueError(
                f"period = {short_repr(period)}; expected none beside a drive; give `periods`, whole ones of it"
            )
        if not scene.period:
            raise ValueError(
                f"periodic_orbit: the oscillator {scene.oscillator.name!r} {scene.drive.problem}; expected a drive with a period"
            )
        if start is None:
            state = _settled(flow, scene, state)
        problem = Cycles.near(scene, (), classes, state[None], periods * scene.period, int(periods))
        z, gap, steps = problem.solved()
        if not _accepted(problem, z):
            raise ArithmeticError(
                f"no orbit of {periods} drive period{'s' * (periods > 1)} near the start: the best residual was {gap:.1e}"
            )
    else:
        if periods != 1:
            raise ValueError(
                f"periods = {periods}; expected 1 for an oscillator without a drive, whose period is found"
            )
        if period is not None:
            problem, z, steps = _near(scene, classes, flow, state, check_number("period", period))
        else:
            problem, z, steps = _cycle(scene, classes, flow, state)
    return _described(problem, problem.solution(Point(z, z, steps)), z)


def _near(
    scene: Scene, classes: tuple[int, ...], flow: Flow, state: np.ndarray, length: float
) -> tuple[Cycles, np.ndarray, int]:
    """Find an undriven orbit near a state and a period by Newton's method."""
    if length <= 0.0:
        raise ValueError(f"period = {length:g}; expected a number above 0")
    # Segments bend the orbit less, so that Newton's method comes from further away; a body may stick in one.
    count = 1 if flow.equations.sticks else SEGMENTS

    def later(times: np.ndarray) -> np.ndarray:
        return flow.advance(scene.parameters, np.tile(state, (len(times), 1)), times)

    def starts() -> Iterator[tuple[float, float]]:
        """Yield the start, and where Newton's method ends in a minimum of the residual, places of near returns."""
        yield 0.0, length
        yield from _recurrences(later, length) if count > 1 else ()

    gap, moves = math.inf, True
    for begin, span in starts():
        times = begin + np.arange(count) * span / count
        states = np.vstack([state, later(times[1:])]) if begin == 0.0 else later(times)
        problem = Cycles.near(scene, (), classes, states, span, 0)
        z, other, steps = problem.solved()
        if _accepted(problem, z):
            return *_least(problem, z), steps
        gap, moves = min(gap, other), _moves(problem, z)
    end = f"the best residual was {gap:.1e}" if moves else "Newton's method ended at rest"
    raise ArithmeticError(f"no orbit near the start with a period near {length:.6g}: {end}; start nearer to the orbit")


def _recurrences(later: Callable[[np.ndarray], np.ndarray], period: float) -> list[tuple[float, float]]:
    """Return the times at which a motion nearly returns after about a period, with the times it takes, the closest first."""
    # `later` returns the states after some times.
    step, shortest, longest = period / PARTS, round(SPANS[0] * PARTS), round(SPANS[1] * PARTS)
    try:
        states = later(step * np.arange(1, FOLLOWED * PARTS + 1))
    except FloatingPointError:  # the motion escapes
        return []
    extent = np.ptp(states, axis=0)
    scaled = states / np.where(extent > 0.0, extent, 1.0)
    matches = []
    for lag in range(shortest, longest + 1):
        gaps = np.abs(scaled[lag:] - scaled[:-lag]).max(axis=1)
        k = int(gaps.argmin())
        matches.append((float(gaps[k]), step * (k + 1), step * lag))
    return [(begin, span) for _, begin, span in sorted(matches)[:RECURRENCES]]


def check_periods(periods: object) -> None:
    """Check a number of drive periods."""
    if not isinstance(periods, Integral) or not 1 <= int(periods) <= LONGEST:
        raise ValueError(f"periods = {short_repr(periods)}; expected a whole number, at least 1, at most {LONGEST}")


def _started(scene: Scene, start: StartValue) -> Scene:
    """Return the scene with another start; numbers for one node are those of all nodes."""
    names = tuple(name for name in scene.components if name not in scene.equations.modes)
    if isinstance(start, list | tuple | np.ndarray) and is_row(start):
        try:
            numbers = np.array([*map(float, np.array(start).ravel().tolist())])  # of complex numbers a TypeError
        except (TypeError, ValueError):
            numbers = np.full(1, np.nan)
        if len(numbers) == len(scene.components) and scene.n > 0 and len(names) < len(scene.components):
            numbers = numbers[: len(names)]  # the slip state follows from the velocity
        if len(numbers) not in (len(names), len(names) * scene.n) or not np.isfinite(numbers).all():
            raise ValueError(f"start: found {short_repr(start)}; expected a number for each of {', '.join(names)}")
        if not scene.equations.mixed:
            table = np.broadcast_to(numbers.reshape(len(names), -1), (len(names), scene.n))
            return scene.replace(initial=dict(zip(names, table.tolist(), strict=True)))
    return started(scene, start)[0]


def _clusters(scene: Scene, clusters: Sequence[int] | None) -> tuple[int, ...]:
    """Return the cluster of each node, checked; by default nodes that start alike and stay alike by symmetry."""
    equations = scene.equations
    alone = tuple(range(scene.n))
    if clusters is None:
        if scene.n == 1 or equations.mixed or equations.differing:
            return alone
        rows = np.array([scene.initial[name] for name in scene.components])
        try:
            classes = quotient(equations, [tuple(column) for column in rows.T.tolist()])[1]
            quotient_of(scene, classes, ())
        except (NoQuotient, NoSynchrony, ValueError):
            classes = tuple([0] * scene.n)
            if len({tuple(column) for column in rows.T.tolist()}) > 1 or not _synchronous(scene):
                return alone
        return classes
    numbers = list(clusters) if clusters is not None and not isinstance(clusters, str) else []
    if len(numbers) != scene.n or not all(isinstance(each, Integral) for each in numbers):
        raise ValueError(f"clusters = {short_repr(clusters)}; expected a whole number for each of {scene.n} nodes")
    order = list(dict.fromkeys(numbers))
    classes = tuple(order.index(each) for each in numbers)
    if equations.mixed or equations.differing:
        raise ValueError("clusters: found nodes or links that differ; expected equal ones; leave `clusters` out")
    if len(order) > 1 and len(order) < scene.n and quotient(equations, classes)[1] != classes:
        raise ValueError(
            f"clusters = {short_repr(clusters)}: nodes of one cluster feel another one by different sums of weights; expected a "
            "balanced partition, as `clusters(graph)` lists them"
        )
    return classes


def _synchronous(scene: Scene) -> bool:
    """Return whether all nodes can move alike."""
    try:
        quotient_of(scene, (0,) * scene.n, ())
    except ValueError:
        return False
    return True


def _quotient_state(scene: Scene, classes: tuple[int, ...], count: int) -> np.ndarray:
    """Return the start of the quotient, without slip states: that of the first node of each cluster."""
    names = [name for name in scene.components if name not in scene.equations.modes]
    if count == scene.n:
        size = len(names) * scene.n if scene.equations.sticks else scene.equations.dimension
        return np.array(scene.y0)[:size]
    first = [classes.index(k) for k in range(count)]
    return np.array([scene.initial[name][i] for name in names for i in first], dtype=float)


def _settled(flow: Flow, scene: Scene, state: np.ndarray) -> np.ndarray:
    """Return the state of a driven network after the transient, at the beginning of a period of the drive."""
    unit = scene.period or 1.0
    left = round(scene.transient) if scene.time_unit == "period" else math.ceil(scene.transient / unit)
    while left > 0:
        some = min(left, TOGETHER)
        state = flow.advance(scene.parameters, state[None], np.full(1, some * unit))[0]
        left -= some
    return _unwound(flow, state)


def _unwound(flow: Flow, state: np.ndarray) -> np.ndarray:
    """Take whole turns from the angles of a state: those of the first node end near 0, those of others near the first's."""
    periods = periods_of_states(flow.equations)
    state = state - whole_turns(periods, state)
    if flow.equations.mixed:
        return state
    first = np.repeat(state.reshape(-1, flow.equations.n)[:, 0], flow.equations.n)
    return np.asarray(state - whole_turns(periods, state - first))


def _cycle(scene: Scene, classes: tuple[int, ...], flow: Flow, state: np.ndarray) -> tuple[Cycles, np.ndarray, int]:
    """Follow an undriven motion to its attracting cycle."""
    values, size = scene.parameters, flow.size
    walker, rates = flow.motion(values, state)
    turns = turns_of(walker, rates)
    walker, left = flow.motion(values, state)[0], max(round(scene.transient), 0)
    while left > 0:
        some = min(left, TOGETHER)
        walker.advance(some * turns.time)
        left -= some
    settled = walker.state[0]
    state = settled[:size] = _unwound(flow, settled[:size])
    # The speed of a held row is zero to rounding only.
    noise = rates.rounding(settled, turns.time) if flow.equations.has_rows else 0.0
    if rests(rates, settled, REST, turns.extent, noise):
        at = ", ".join(f"{name} = {x:.6g}" for name, x in islice(zip(flow.equations.state, state, strict=False), 8))
        raise ArithmeticError(f"no cycle: the motion comes to rest at {at}; `equilibrium` finds such states")
    found = returns(lambda x: flow.motion(values, x)[0], rates, turns.extent, settled)
    for time, extent in islice(found, RETURNS):
        image = flow.advance(values, state[None], np.full(1, time))[0]
        if not np.all(np.abs(rates.difference(image, state)) <= NEAR * extent[:size]):
            continue
        problem = Cycles.near(scene, (), classes, state[None], time, 0)
        z, _, steps = problem.solved()
        if not (_accepted(problem, z) and abs(problem.period(z) - time) < 0.5 * time):
            continue
        problem, z = _least(problem, z)
        # A conservative motion has a double multiplier 1, which errors of size TOLERANCE split.
        if np.all(np.abs(problem.multipliers(z)) < 1.0 - APART * math.sqrt(TOLERANCE)):
            return problem, z, steps
        break
    raise ArithmeticError(
        f"no attracting cycle near the motion after {scene.transient:g} mean return times; start elsewhere, settle longer, or "
        "give `start` and `period` of an unstable one"
    )


def _least(problem: Cycles, z: np.ndarray) -> tuple[Cycles, np.ndarray]:
    """Return the orbit with its least period: test by one call whether a fraction of the period is one."""
    state, period = problem.states(z)[0], problem.period(z)
    parts = np.arange(PARTS_OF_PERIOD, 1, -1)
    later = problem.flow.advance(problem.values(z), np.tile(state, (len(parts), 1)), period / parts)
    for part, there in zip(parts.tolist(), later, strict=True):
        if np.all(np.abs(there - state - problem.turns / part) <= math.sqrt(CLOSED) * problem.scale):
            shorter = Cycles.near(problem.scene, (), problem.classes, state[None], period / part, 0)
            solved, _, _ = shorter.solved()
            if _accepted(shorter, solved) and abs(shorter.period(solved) * part - period) < NEAR * period:
                return _least(shorter, solved)
    return problem, z


def _accepted(problem: Cycles, z: np.ndarray) -> bool:
    """Return whether Newton's method has found an orbit."""
    residual, _ = problem.linearise(z)
    gaps = residual[: problem.phase.size].reshape(problem.phase.shape)
    found = bool(np.isfinite(gaps).all()) and closed(gaps, CLOSED * problem.scale, problem.states(z))
    return found and _moves(problem, z)


def _moves(problem: Cycles, z: np.ndarray) -> bool:
    """Return whether an orbit without a drive moves in its period: every state is closed after no time, or at rest."""
    rates = problem.flow.rates(problem.values(z), problem.states(z)) / problem.scale
    return problem.periods > 0 or float(np.abs(rates).max()) * problem.period(z) > STILL


def _described(problem: Cycles, orbit: PeriodicOrbit, z: np.ndarray) -> PeriodicOrbit:
    """Return the orbit with a description of how its nodes move."""
    scene = orbit.scene
    if scene.n == 1 or scene.equations.mixed:
        return orbit
    looks = LOOKS if scene.n < MANY else FEWER_LOOKS
    # In the frame that moves with the shifts.
    distances = z[problem.phase.size : problem.phase.size + problem.shifts.shape[1]]
    frame = np.outer(np.arange(looks * problem.segments) / (looks * problem.segments), problem.shifts @ distances)
    copies = expansion(scene.equations, orbit.classes, problem.flow.size)
    motion = (problem.orbit_states(z, looks) - frame) @ copies.T
    # A point on the circle stands for an angle that turns all the way round.
    turning = np.repeat((copies @ problem.turns).reshape(-1, scene.n).any(axis=1), scene.n)
    angles = np.array([period or math.inf for period in periods_of_states(scene.equations)[: len(turning)]])
    phases = 2.0 * math.pi * motion[:, turning] / angles[turning]
    motion = np.hstack([motion[:, ~turning], np.cos(phases), np.sin(phases)])
    return replace(orbit, pattern=pattern_of(motion.reshape(looks, -1, scene.n), [*map(str, scene.topology.labels)]))


def stability_end(orbit: PeriodicOrbit, low: float, high: float) -> float:
    """Find the strength at which the largest transversal multiplier has modulus 1, to rounding.

    Parameters
    ----------
    orbit : PeriodicOrbit
        Orbit of nodes that move alike.
    low, high : float
        Strengths alpha of a mode that grows at one of them and decays at the other.

    Returns
    -------
    float
        The strength.

    Raises
    ------
    ValueError
        If a strength is not finite, or if the mode grows, or decays, at both.

    See Also
    --------
    periodic_orbit : Find the orbit.
    """
    for name, value in (("low", low), ("high", high)):
        if not isinstance(value, Real) or not math.isfinite(value):
            raise ValueError(f"{name} = {short_repr(value)}; expected a finite strength alpha")

    def growth(alpha: float) -> float:
        return float(np.log(abs(orbit.transversal_multipliers(alpha)[0])))

    if growth(low) * growth(high) > 0.0:
        raise ValueError(f"alpha: the mode grows, or decays, at {low} and at {high}; expected a change between them")
    return float(brentq(growth, low, high, xtol=1e-14, rtol=1e-14))
