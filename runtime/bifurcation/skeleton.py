"""The skeleton of a bifurcation diagram: branches of periodic orbits of few periods, stable or not.

A chaotic motion comes close to every periodic orbit on its attractor again and again, and a
transient to those beside it. States that nearly return after some periods of the drive are
therefore good starts for Newton's method.

Source: Auerbach, Cvitanovic, Eckmann, Gunaratne & Procaccia, Phys. Rev. Lett. 58, 2387 (1987).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from numbers import Integral

import numpy as np
import xarray as xr

from synchain.models.dynamics.reduction import without_drive
from synchain.models.inputs.checks import check_integer, check_keys, check_number, check_table, short_repr
from synchain.models.inputs.frozen import FrozenDict
from synchain.models.mechanics.contact import SLIP
from synchain.models.scenes.scene import Scene, check_scene

from ..cells.run_keywords import Given, with_numbers
from ..results.labelled import Labelled, dataset
from ..stability.exponents import coupled_cell
from ..stability.orbits import OrbitProblem, driven_states, within
from ..support.arrays import row
from ..support.execution import Execution
from ..support.progress import Hook
from .bifurcations import BifurcationKind
from .branches import Branch, checked_values, others, traced, warn_of_lost
from .periodic import NEWTON, TOLERANCE, PeriodicOrbit, check_periods, periodic_orbit, relative, whole_turns

Range = tuple[float, float]
"""Ends of an interval."""

STARTS, LENGTH, DROPPED = 96, 200, 20
"""Motions that are searched for returns, their length and their transient in drive periods."""

SCALES = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
"""Sizes of the boxes of their starts around the motion from the scene's own start, relative to the extent of that."""

MOST_STEPS = 100_000
"""Most steps of a motion in a drive period; one that takes more is left."""

NEARER = 4
"""The other sheet at a fold is entered at 4^-NEARER of the distance between fold and last orbit."""

CLOSE, APART, TRIES = 0.05, 0.02, 12
"""Largest distance of a return and least distance between starts, relative to the extent of the motion; most starts for one period."""


@dataclass(frozen=True, slots=True, repr=False)
class Skeleton(Labelled):
    """Branches of periodic orbits; reads like a tuple of them.

    Parameters
    ----------
    branches : tuple of Branch
        Each rises in the parameter; sorted by the number of periods and the first value.
    searched : mapping of str to (float, float)
        Between which initial values of each component motions were searched for orbits.
    """

    branches: tuple[Branch, ...]
    searched: Mapping[str, Range] = FrozenDict()

    def __len__(self) -> int:
        return len(self.branches)

    def __iter__(self) -> Iterator[Branch]:
        return iter(self.branches)

    def __getitem__(self, place: int) -> Branch:
        return self.branches[place]

    @property
    def data(self) -> xr.Dataset:
        """All orbits of all branches as one row, with branch, periods and parameter as coordinates."""
        rows = [
            (number, value, orbit)
            for number, branch in enumerate(self.branches)
            for value, orbit in zip(branch.values, branch.orbits, strict=True)
        ]
        if not rows:
            return dataset({}, {})
        numbers, values, orbits = zip(*rows, strict=True)
        return dataset(
            {
                "state": (("orbit", "component"), [o.state for o in orbits], "state at the start of a period"),
                "multipliers": (("orbit", "number"), [o.multipliers for o in orbits], "Floquet multipliers"),
                "stable": (("orbit",), [o.stable for o in orbits], "whether all multipliers lie in the circle"),
            },
            {
                self.branches[0].name: ("orbit", np.array(values)),
                "branch": ("orbit", np.array(numbers)),
                "periods": ("orbit", np.array([o.periods for o in orbits])),
                "component": list(orbits[0].components),
            },
            orbits[0].scene,
        )

    @property
    def summary(self) -> tuple[tuple[str, str], ...]:
        """One row for each branch, and where orbits were searched."""
        rows = tuple(
            (
                f"branch {k}",
                ", ".join(f"{name} {words}" if name != "orbits" else words for name, words in branch.summary),
            )
            for k, branch in enumerate(self.branches, 1)
        )
        box = ", ".join(f"{name} from {low:.4g} to {high:.4g}" for name, (low, high) in self.searched.items())
        return (*(rows or (("branches", "none"),)), *((("starts", box),) if box else ()))


def skeleton(
    scene: Scene,
    name: str,
    values: Sequence[float] | np.ndarray,
    periods: Sequence[int] = (1, 2),
    looks: int = 8,
    *,
    ranges: Mapping[str, Range] | None = None,
    transient: float = DROPPED,
    seed: int = 0,
    show_progress: bool | None = None,
    progress: Hook | None = None,
    parameters: Mapping[str, float] | None = None,
    **more: float,
) -> Skeleton:
    """Find the skeleton of a bifurcation diagram.

    Orbits are found from near returns at some of the values and followed up and down from there. An
    orbit that repeats itself after fewer periods is left out, and so is one that a branch passes
    through already.

    Parameters
    ----------
    scene : Scene
        Source of the driven oscillator.
    name : str
        Name of the parameter.
    values : array_like, shape (k,)
        Monotonic values of the parameter.
    periods : sequence of int
        Numbers of drive periods of the orbits.
    looks : int
        Number of values at which orbits are searched.
    ranges : mapping of str to (float, float), optional
        Components and the ends of the initial values between which motions are searched; other components start as the
        scene does. By default all components start in boxes of 1, 2, 4 … 32 times the extent of the motion from the
        scene's own start, around it. `Skeleton.searched` says what was searched.
    transient : float
        Drive periods before the search.
    seed : int
        Seed of the initial states of the search.
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
    Skeleton
        The branches.

    Raises
    ------
    ValueError
        If the parameter is unknown, the values are not monotonic, `looks` is less than one, a range is empty or of an
        unknown component, and for an oscillator without a drive.
    """
    grid = sorted(checked_values(check_scene(scene), name, values))
    if isinstance(periods, Integral | str) or len(periods) == 0:
        raise ValueError(f"periods = {short_repr(periods)}; expected numbers of drive periods, e.g. (1, 2)")
    scene = coupled_cell(Given(skeleton), others(Given(skeleton, parameters, more, NEWTON), scene, name), TOLERANCE)
    if not isinstance(looks, Integral) or looks < 1:
        raise ValueError(f"looks = {short_repr(looks)}; expected a whole number, at least 1")
    for each in periods:
        check_periods(each)
    if not without_drive(scene.equations, scene.parameters).forced:
        raise ValueError(
            "skeleton: found an oscillator without a drive; expected one with a drive, whose periods count those of orbits; "
            "periodic_orbit(scene) finds the cycle that attracts it at one value, equilibrium(scene) a state at rest"
        )
    box = None if ranges is None else _box(scene, ranges)
    branches: list[Branch] = []
    searched: list[np.ndarray] = []

    def take(k: int, orbit: PeriodicOrbit) -> None:
        """Follow an orbit at grid[k] that is new, and what its branch turns into at its folds."""
        if any(_passes(branch, grid[k], orbit) for branch in branches):
            return
        branches.append(_both_ways(scene, name, grid, k, orbit))
        for end, other in _other_sheets(scene, branches[-1]):
            take(grid.index(end), other)

    count = min(looks, len(grid))
    places = sorted({int((2 * j + 1) * len(grid) / (2 * count)) for j in range(count)})
    transient, seed = check_number("transient", transient, 0.0), check_integer("seed", seed, 0)
    with Execution(1, None, show_progress, progress).reporter(len(places), "value") as reporter:
        for k in reporter.each(places):
            one = with_numbers(scene, {name: grid[k]})
            states = starts_of(one, seed, box)
            searched.append(states)
            for orbit in near_returns(one, periods, transient, states):
                take(k, orbit)
    warn_of_lost("skeleton", branches)
    low, high = (of(np.concatenate(searched), axis=0).tolist() for of in (np.min, np.max))
    names = (component for component in scene.components if component != SLIP.name)
    return Skeleton(
        tuple(sorted(branches, key=lambda branch: (branch.orbits[0].periods, branch.values[0]))),
        FrozenDict({component: (a, b) for component, a, b in zip(names, low, high, strict=True)}),
    )


def _box(scene: Scene, ranges: Mapping[str, Range]) -> np.ndarray:
    """The ends (2, components) of the initial values in some ranges and, of other components, those of the scene."""
    names = [name for name in scene.components if name != SLIP.name]
    check_keys("skeleton: ranges", check_table("skeleton: ranges", ranges), names)
    ends = np.array([[scene.initial[name][0]] * 2 for name in names], dtype=float).T
    for name, given in ranges.items():
        pair = row(f"skeleton: the range of {name}", given, 2)
        if len(pair) != 2 or not pair[0] < pair[1]:
            raise ValueError(
                f"skeleton: the range of {name} is {short_repr(given)}; expected two numbers, the lower one first"
            )
        ends[:, names.index(name)] = pair
    return ends


def starts_of(scene: Scene, seed: int, box: np.ndarray | None = None) -> np.ndarray:
    """Return the starts (STARTS, components) of a search: the scene's own, and random ones around its motion, or in a box."""
    own = _own_start(scene)
    share = np.random.default_rng(seed).uniform(0.0, 1.0, (STARTS, len(own)))
    if box is None:
        problem, (state,) = _problem(scene, own[None])
        try:
            motion = np.concatenate([own[None], *(states[:, : len(own)] for states in driven_states(problem, state))])
        except FloatingPointError:  # its own start escapes, and says nothing of bounded motion but its size
            motion = np.array([own, -own])
        extent = np.ptp(motion, axis=0)
        extent = np.where(extent > 0.0, extent, 1.0 if not extent.any() else 0.0)  # nothing moves, so no scale is known
        sizes = np.resize(SCALES, STARTS)[:, None] * extent
        box = 0.5 * (motion.min(axis=0) + motion.max(axis=0)) + sizes * np.array([-0.5, 0.5])[:, None, None]
    starts = box[0] + (box[1] - box[0]) * share
    starts[0] = own
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
    """States (LENGTH + 1, motions, components) at the beginning of periods of bounded motions, and the extents of those."""
    loose = scene.replace(rtol=1e-8, max_steps=min(scene.max_steps, MOST_STEPS))
    parts = [starts]
    found: list[tuple[np.ndarray, np.ndarray]] = []
    for part in parts:
        try:
            found.append(_path(loose, transient, part))
        except FloatingPointError:  # some escape or take too many steps: halves are tried
            parts += np.array_split(part, 2) if len(part) > 1 else []
    if not found:
        return np.empty((LENGTH + 1, 0, starts.shape[1])), np.empty((0, starts.shape[1]))
    return np.concatenate([path for path, _ in found], axis=1), np.concatenate([extent for _, extent in found])


def _path(scene: Scene, transient: float, starts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """States (LENGTH + 1, starts, components) at the beginning of each period, and the extent of each motion."""
    problem, states = _problem(scene, starts)
    problem, states = problem.settled(states, transient)
    integrator = problem.integrator(states)
    strobes = [integrator.state]
    for _ in range(LENGTH):
        integrator.advance(problem.unit)
        strobes.append(integrator.state)
    path = np.array(strobes)[:, :, : problem.components]
    inner = [within(problem, last[None])[:, : problem.components] for last in strobes[-1]]
    return path, np.array([np.ptp([*path[:, k], *looks], axis=0) for k, looks in enumerate(inner)])


def _problem(scene: Scene, starts: np.ndarray) -> tuple[OrbitProblem, np.ndarray]:
    """Orbits from starts (any, components) without slip states, and these states with them."""
    states = np.zeros((len(starts), len(scene.initial)))
    states[:, : starts.shape[1]] = starts
    problem = OrbitProblem.of_modes(scene, np.zeros(1), states, 1)
    return problem, problem.with_slip_states(states)


def _returning(scene: Scene, path: np.ndarray, extent: np.ndarray, periods: int) -> list[np.ndarray]:
    """States of paths with the closest returns after some periods, apart from each other."""
    size = np.where(extent > 0.0, extent, 1.0)
    gap = np.abs((path[periods:] - path[:-periods]) / size).max(axis=2)
    # An angle is counted in the turn of the scene's own start: an orbit some turns away is the same orbit.
    own = _own_start(scene)
    starts: list[tuple[np.ndarray, np.ndarray]] = []
    for flat in np.argsort(gap, axis=None, kind="stable"):
        k, motion = np.unravel_index(flat, gap.shape)
        if gap[k, motion] > CLOSE or len(starts) == TRIES:
            break
        state = path[k, motion] - whole_turns(scene, path[k, motion] - own)
        if all(relative(state - start, np.minimum(size[motion], its)) > APART for start, its in starts):
            starts.append((state, size[motion]))
    return [state for state, _ in starts]


def _own_start(scene: Scene) -> np.ndarray:
    """Initial state (components,) of the first oscillator."""
    return np.array([values[0] for name, values in scene.initial.items() if name != SLIP.name], dtype=float)


def _same(orbit: PeriodicOrbit, other: PeriodicOrbit) -> bool:
    """True if two orbits of as many periods are one, perhaps shifted by drive periods."""
    return any(other.meets(point) for point in orbit.points)


def _passes(branch: Branch, value: float, orbit: PeriodicOrbit) -> bool:
    """True if a branch passes through an orbit."""
    (places,) = np.nonzero(branch.values == value)
    alike = branch.orbits[0].periods == orbit.periods
    return alike and any(_same(orbit, branch.orbits[k]) for k in places)


def _both_ways(scene: Scene, name: str, grid: list[float], k: int, orbit: PeriodicOrbit) -> Branch:
    """Branch through an orbit at grid[k], in one piece."""
    up, down = (traced(scene, name, part, orbit, grid[-1] - grid[0]) for part in (grid[k:], grid[k::-1]))
    return Branch(
        name,
        np.concatenate([down.values[:0:-1], up.values]),
        (*down.orbits[:0:-1], *up.orbits),
        (*down.bifurcations[::-1], *up.bifurcations),
        (*down.phases[:0:-1], *up.phases),
        (*down.lost, *up.lost),
    )


def _other_sheets(scene: Scene, branch: Branch) -> list[tuple[float, PeriodicOrbit]]:
    """Values of a branch's ends at folds, with the orbits of the other sheets there.

    Near a fold the sheets lie on both sides of it, at distances proportional to the square root of
    that of the parameter.
    """
    sheets = []
    for turn in branch.bifurcations:
        if turn.kind is not BifurcationKind.FOLD:
            continue
        fold = turn.value
        for k, inner in ((0, fold < branch.values[0]), (-1, fold > branch.values[-1])):
            if not inner:
                continue
            end, last = float(branch.values[k]), branch.orbits[k]
            way = [fold + 4.0**-j * (end - fold) for j in range(NEARER, -1, -1)]
            try:
                start = turn.orbit.state - 2.0**-NEARER * (last.state - turn.orbit.state)
                first = periodic_orbit(scene, last.periods, start, parameters={branch.name: way[0]})
                sheet = traced(scene, branch.name, way, first, abs(end - fold))
            except ArithmeticError:
                continue
            sheets += [(end, sheet.orbits[-1])] if len(sheet.orbits) == len(way) else []
    return sheets
