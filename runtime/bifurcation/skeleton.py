"""Find the skeleton of a bifurcation diagram: branches of equilibria, or of periodic orbits of few periods.

Without a drive, equilibria are searched by deflation at some values of the parameter and followed, and the cycles that
are born at their Hopf points are followed too.  With a drive, orbits of few periods are searched: a chaotic motion comes close to every periodic orbit on its attractor again and again; a transient comes close to orbits
near the attractor. P is the stroboscopic map. States x with P^k(x) near x are therefore good starts for Newton's method
(Auerbach et al.).

1. At some values of the parameter, motions from many starts are followed, and states that nearly return are collected.
2. Newton's method finds an orbit from each state; an orbit that is already on a branch is left out.
3. Each new orbit is followed up and down, and through folds.

Source: Auerbach, Cvitanovic, Eckmann, Gunaratne & Procaccia, Phys. Rev. Lett. 58, 2387 (1987).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from numbers import Integral

import numpy as np

from synchain.models.dynamics.angles import periods_of_states
from synchain.models.dynamics.reduction import without_drive
from synchain.models.inputs.checks import check_number, check_seed, short_repr
from synchain.models.inputs.frozen import FrozenDict
from synchain.models.scenes.defaults import TimeUnit
from synchain.models.scenes.scene import Scene, check_scene

from ..cells.run_keywords import Given, chosen, with_numbers
from ..stability.motion import whole_turns
from ..stability.orbits import OrbitProblem, driven_states, within
from ..support.execution import Execution
from ..support.progress import Hook
from .branches import checked_values, follow
from .deflation import checked_ranges, equilibria
from .equilibrium import Equilibrium
from .flow import TOLERANCE
from .periodic import NEWTON, check_periods, periodic_orbit
from .periodic_result import PeriodicOrbit
from .results import Branch, Diagram
from .switching import SAME, permutations_of

Range = tuple[float, float]
"""Ends of an interval."""

# Number of motions that are searched for returns, their length and their transient in drive periods (choices).
STARTS, LENGTH, DROPPED = 96, 200, 20
# Sizes of the boxes of starts around the motion from the scene's own start, relative to the extent of that motion
# (choices).
SCALES = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
MOST_STEPS = 100_000  # most steps of a motion in a drive period; one that takes more is left out (a choice)
LOOSE = 1e-8  # relative tolerance of these motions: returns are searched to CLOSE only (a choice)
# Largest distance of a return and least distance between starts, relative to the extent of the motion, and most
# starts for one period (choices).
CLOSE, APART, TRIES = 0.05, 0.02, 12


def skeleton(
    scene: Scene,
    name: str,
    values: Sequence[float] | np.ndarray,
    periods: Sequence[int] = (1, 2),
    looks: int = 8,
    *,
    ranges: Mapping[str, Range] | None = None,
    transient: float | None = None,
    rng: int | np.random.Generator | None = None,
    show_progress: bool | None = None,
    progress: Hook | None = None,
    parameters: Mapping[str, float] | None = None,
    **more: float,
) -> Diagram:
    """Find the skeleton of a bifurcation diagram: its branches, stable or not.

    For a driven oscillator, orbits are found from near returns at some of the values, and followed up and down from
    there. An orbit is left out if it repeats itself after fewer periods, or if it is already on a branch. For a network
    without a drive, equilibria are found by deflation and followed, and so are the cycles that are born at Hopf points.

    Parameters
    ----------
    scene : Scene
        Source of the driven oscillator, or a network without a drive.
    name : str
        Name of the parameter.
    values : array_like, shape (k,)
        Monotonic values of the parameter.
    periods : sequence of int
        Numbers of drive periods of the orbits; without a drive not used.
    looks : int
        Number of values at which orbits are searched.
    ranges : mapping of str to (float, float), optional
        Components and the ends of the initial values between which motions are searched; other components start as the
        scene does. By default all components start in boxes of 1, 2, 4 … 32 times the extent of the motion from the
        scene's own start, around it. `Diagram.searched` holds the ranges that were searched.
    transient : float, optional
        Drive periods before the search; by default those of the scene if it was given any, else 20.
    rng : int or Generator, optional
        Seed of the initial states of the search; by default that of the scene.
    show_progress : bool, optional
        Whether to show a bar; by default a bar on terminals and in notebooks, a line a minute elsewhere.
    progress : callable, optional
        Is called with a `Progress`, which counts the values at which orbits are searched.
    parameters : mapping of str to float, optional
        Other parameters of the scene to set, for names that are keywords already.
    **more : float
        Other parameters of the scene to set.

    Returns
    -------
    Diagram
        The branches: equilibria before cycles, orbits by their periods.

    Raises
    ------
    ValueError
        If the parameter is unknown, the values are not monotonic, `looks` is less than one, a range is empty or of an
        unknown component.

    See Also
    --------
    follow : Follow one orbit.
    periodic_orbit : Find one orbit by Newton's method.

    Examples
    --------
    Near its resonance Duffing's oscillator has a large and a small oscillation:

    >>> from synchain import Field, Scene, skeleton
    >>> duffing = Field({"x": "v", "v": "-x - x**3 - v/10 + 0.3*cos(w*t)"}, parameters={"w": 1.2})
    >>> scene = Scene(duffing, None, initial={"x": 0.5, "v": 0}, transient=100)
    >>> branches = skeleton(scene, "w", [1.4, 1.5], (1,), looks=1)
    >>> len(branches), all(branch.orbits[0].stable for branch in branches)
    (2, True)
    """
    grid = sorted(checked_values(check_scene(scene), name, values))
    if isinstance(periods, Integral | str) or len(periods) == 0:
        raise ValueError(f"periods = {short_repr(periods)}; expected numbers of drive periods, e.g. (1, 2)")
    given = Given(skeleton, parameters, more, NEWTON)
    if name in given.values:
        raise ValueError(f"skeleton: {name!r} takes its values one after the other; expected others")
    scene = given.scene(scene, rtol=TOLERANCE)
    if not isinstance(looks, Integral) or looks < 1:
        raise ValueError(f"looks = {short_repr(looks)}; expected a whole number, at least 1")
    for each in periods:
        check_periods(each)
    # Search at evenly spread values: the middles of `count` equal parts of the grid.
    count = min(looks, len(grid))
    looked_at = sorted({int((2 * j + 1) * len(grid) / (2 * count)) for j in range(count)})
    seed = check_seed("rng", chosen(scene, "rng", rng, 0))
    if transient is None:  # that of the scene in drive periods, else DROPPED
        length = chosen(scene, "transient", None, None)
        unit = 1.0 if scene.time_unit == TimeUnit.PERIOD else scene.period or 1.0
        transient = DROPPED if length is None else length / unit
    transient = check_number("transient", transient, 0.0)
    if not without_drive(scene.equations, scene.parameters).forced:
        return Diagram(tuple(_resting(scene, name, grid, [grid[k] for k in looked_at], seed, ranges)))
    scene = scene.lone
    box = None if ranges is None else _box(scene, ranges)
    branches: list[Branch] = []
    searched: list[np.ndarray] = []
    with Execution(1, None, show_progress, progress).reporter(len(looked_at), "value") as reporter:
        for k in reporter.each(looked_at):
            one = with_numbers(scene, {name: grid[k]})
            states = starts_of(one, seed, box)
            searched.append(states)
            for orbit in near_returns(one, periods, transient, states):
                if not any(_passes(branch, grid[k], orbit) for branch in branches):
                    branches.append(follow(orbit, name, values=grid) if len(grid) > 1 else _single(name, orbit))
    # The box around all starts, by component.
    low, high = (of(np.concatenate(searched), axis=0).tolist() for of in (np.min, np.max))
    names = (component for component in scene.components if component not in scene.equations.modes)
    return Diagram(
        tuple(sorted(branches, key=lambda branch: (branch.orbits[0].periods, branch.values[0]))),
        FrozenDict({component: (a, b) for component, a, b in zip(names, low, high, strict=True)}),
    )


def _resting(
    scene: Scene, name: str, grid: list[float], values: list[float], seed: int, ranges: Mapping[str, Range] | None
) -> list[Branch]:
    """Return the branches of equilibria found at some values, and of the cycles born at their Hopf points."""
    branches: list[Branch] = []
    for value in values:
        for rest in equilibria(with_numbers(scene, {name: value}), rng=seed, ranges=ranges):
            known = (
                branch[int(k)].state[each]
                for branch in branches
                for k in np.flatnonzero(branch.values == value)
                for each in permutations_of(scene)
            )
            scale = float(np.abs(rest.state).max()) or 1.0
            if not any(np.abs(rest.state - state).max() < SAME * scale for state in known):
                branches.append(follow(rest, name, values=grid) if len(grid) > 1 else _single(name, rest))
    cycles: list[Branch] = []
    for point in [point for branch in branches for point in branch.points["Hopf"]]:
        ends = (each.value for branch in cycles for each in branch.points["Hopf"])
        if any(abs(end - point.value) < SAME * (grid[-1] - grid[0]) for end in ends):
            continue  # a branch of cycles that is known ends there
        for vector in range(len(point.vectors)):
            try:
                cycles.append(follow(point, name, within=(grid[0], grid[-1]), vector=vector))
            except ArithmeticError:
                continue
    return branches + cycles


def _box(scene: Scene, ranges: Mapping[str, Range]) -> np.ndarray:
    """Return the ends (2, components) of the ranges.

    A component without a range has the scene's initial value twice.
    """
    names = [name for name in scene.components if name not in scene.equations.modes]
    ends = np.array([[scene.initial[name][0]] * 2 for name in names], dtype=float).T
    for component, pair in checked_ranges("skeleton", ranges, names):
        ends[:, component] = pair
    return ends


def starts_of(scene: Scene, seed: int, box: np.ndarray | None = None) -> np.ndarray:
    """Return the starts (STARTS, components) of a search: the scene's own, and random states around its motion or in a box."""
    first = _first_start(scene)
    share = np.random.default_rng(seed).uniform(0.0, 1.0, (STARTS, len(first)))
    if box is None:
        problem, (state,) = _problem(scene, first[None])
        try:
            motion = np.concatenate(
                [first[None], *(states[:, : len(first)] for states in driven_states(problem, state))]
            )
        except FloatingPointError:  # the motion escapes: of its start only the size is a scale of bounded motion
            motion = np.array([first, -first])
        extent = np.ptp(motion, axis=0)
        extent = np.where(extent > 0.0, extent, 1.0 if not extent.any() else 0.0)  # without any motion the scale is 1
        # One box for each start, of each size in turn: box (2, STARTS, components).
        sizes = np.resize(SCALES, STARTS)[:, None] * extent
        box = 0.5 * (motion.min(axis=0) + motion.max(axis=0)) + sizes * np.array([-0.5, 0.5])[:, None, None]
    starts = box[0] + (box[1] - box[0]) * share
    starts[0] = first
    return np.asarray(starts)


def near_returns(
    scene: Scene, periods: Sequence[int], transient: float = DROPPED, starts: np.ndarray | None = None
) -> list[PeriodicOrbit]:
    """Find the periodic orbits to which motions from several starts nearly return. Shapes: starts (any, components)."""
    path, extent = _paths(scene, transient, starts_of(scene, 0) if starts is None else starts)
    orbits: list[PeriodicOrbit] = []
    for count in periods:
        for start in _returning(scene, path, extent, count):
            try:
                orbit = periodic_orbit(scene, count, start)
            except ArithmeticError:
                continue
            alike = [other for other in orbits if other.periods == count]
            if orbit.least == count and not any(_same(orbit, other) for other in alike):
                orbits.append(orbit)
    return orbits


def _paths(scene: Scene, transient: float, starts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return states (LENGTH + 1, motions, components) at the beginning of periods of bounded motions, and their extents."""
    loose = scene.replace(rtol=LOOSE, max_steps=min(scene.max_steps, MOST_STEPS))
    batches = [starts]
    motions: list[tuple[np.ndarray, np.ndarray]] = []
    for batch in batches:
        try:
            motions.append(_path(loose, transient, batch))
        except FloatingPointError:  # some escape or take too many steps: try both halves
            batches += np.array_split(batch, 2) if len(batch) > 1 else []
    if not motions:
        return np.empty((LENGTH + 1, 0, starts.shape[1])), np.empty((0, starts.shape[1]))
    return np.concatenate([path for path, _ in motions], axis=1), np.concatenate([extent for _, extent in motions])


def _path(scene: Scene, transient: float, starts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return states (LENGTH + 1, starts, components) at the beginning of each period, and the extent of each motion."""
    problem, states = _problem(scene, starts)
    problem, states = problem.settled(states, transient)
    integrator = problem.integrator(states)
    strobes = [integrator.state]
    for _ in range(LENGTH):
        integrator.advance(problem.unit)
        strobes.append(integrator.state)
    path = np.array(strobes)[:, :, : problem.components]
    # States inside the last period count for the extent, too.
    inner = [within(problem, last[None])[:, : problem.components] for last in strobes[-1]]
    return path, np.array([np.ptp([*path[:, k], *states], axis=0) for k, states in enumerate(inner)])


def _problem(scene: Scene, starts: np.ndarray) -> tuple[OrbitProblem, np.ndarray]:
    """Return orbits from starts (any, components) without slip states, and the starts with slip states."""
    states = np.zeros((len(starts), len(scene.initial)))
    states[:, : starts.shape[1]] = starts
    problem = OrbitProblem.of_modes(scene, np.zeros(1), states, 1)
    return problem, problem.with_slip_states(states)


def _returning(scene: Scene, path: np.ndarray, extent: np.ndarray, periods: int) -> list[np.ndarray]:
    """Return states of paths with the closest returns after some periods, apart from each other, the closest first."""
    size = np.where(extent > 0.0, extent, 1.0)
    # |x(j + periods) - x(j)| of each motion, the largest component in units of its extent.
    gap = np.abs((path[periods:] - path[:-periods]) / size).max(axis=2)
    # An angle is counted in the turn of the scene's own start: an orbit some turns away is the same orbit.
    first = _first_start(scene)
    starts: list[tuple[np.ndarray, np.ndarray]] = []
    for flat in np.argsort(gap, axis=None, kind="stable"):
        k, motion = np.unravel_index(flat, gap.shape)
        if gap[k, motion] > CLOSE or len(starts) == TRIES:
            break
        state = path[k, motion] - whole_turns(periods_of_states(scene.equations), path[k, motion] - first)
        if all(np.abs((state - start) / np.minimum(size[motion], its)).max() > APART for start, its in starts):
            starts.append((state, size[motion]))
    return [state for state, _ in starts]


def _first_start(scene: Scene) -> np.ndarray:
    """Return the initial state (components,) of the first oscillator, without a slip state."""
    return np.array(
        [values[0] for name, values in scene.initial.items() if name not in scene.equations.modes], dtype=float
    )


def _same(orbit: PeriodicOrbit, other: PeriodicOrbit) -> bool:
    """Return whether two orbits of equal periods are one, perhaps shifted by drive periods."""
    return any(other.meets(point) for point in orbit.points)


def _passes(branch: Branch, value: float, orbit: PeriodicOrbit) -> bool:
    """Return whether a branch passes through an orbit."""
    alike = branch.orbits[0].periods == orbit.periods
    return alike and any(_same(orbit, branch.orbits[k]) for k in np.flatnonzero(branch.values == value))


def _single(name: str, solution: Equilibrium | PeriodicOrbit) -> Branch:
    """Return a branch of one solution."""
    value, growing = np.array([solution.scene.parameters[name]]), np.array([solution.growing])
    return Branch(name, value, (solution,), (), growing, np.zeros(1))
