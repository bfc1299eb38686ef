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

from synchain.models.inputs.checks import check_integer, check_number, short_repr
from synchain.models.scenes.scene import Scene, a_scene

from ..cells.keywords import Given, with_numbers
from ..results.labelled import Labelled, dataset
from ..stability.exponents import coupled_cell, initial_states
from ..stability.orbits import Orbits
from ..support.execution import Execution
from ..support.progress import Hook
from .bifurcations import BifurcationKind
from .branches import Branch, checked_values, others, traced, warn_of_lost
from .periodic import NEWTON, SAME, TOLERANCE, PeriodicOrbit, check_periods, periodic_orbit

__all__ = ["Skeleton", "near_returns", "skeleton"]

STARTS, LENGTH, DROPPED = 16, 200, 20
"""Motions that are searched for returns, their length and their transient in drive periods."""

NEARER = 4
"""The other sheet at a fold is entered at 4^-NEARER of the distance between fold and last orbit."""

CLOSE, APART, TRIES = 0.05, 0.02, 12
"""Largest distance of a return, least distance between starts, most starts for one period."""


@dataclass(frozen=True, slots=True, repr=False)
class Skeleton(Labelled):
    """Branches of periodic orbits; reads like a tuple of them.

    Parameters
    ----------
    branches : tuple of Branch
        Each rises in the parameter; sorted by the number of periods and the first value.
    """

    branches: tuple[Branch, ...]

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
        """One row for each branch."""
        rows = tuple(
            (
                f"branch {k}",
                ", ".join(f"{name} {words}" if name != "orbits" else words for name, words in branch.summary),
            )
            for k, branch in enumerate(self.branches, 1)
        )
        return rows or (("branches", "none"),)


def skeleton(
    scene: Scene,
    name: str,
    values: Sequence[float] | np.ndarray,
    periods: Sequence[int] = (1, 2),
    looks: int = 8,
    *,
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
        If the parameter is unknown, the values are not monotonic, or `looks` is less than one.
    """
    grid = sorted(checked_values(a_scene(scene), name, values))
    if isinstance(periods, Integral | str) or len(periods) == 0:
        raise ValueError(f"periods = {short_repr(periods)}; expected numbers of drive periods, e.g. (1, 2)")
    scene = coupled_cell(Given(skeleton), others(Given(skeleton, parameters, more, NEWTON), scene, name), TOLERANCE)
    if not isinstance(looks, Integral) or looks < 1:
        raise ValueError(f"looks = {short_repr(looks)}; expected a whole number, at least 1")
    for each in periods:
        check_periods(each)
    branches: list[Branch] = []

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
            for orbit in near_returns(with_numbers(scene, {name: grid[k]}), periods, transient, seed):
                take(k, orbit)
    warn_of_lost("skeleton", branches)
    return Skeleton(tuple(sorted(branches, key=lambda branch: (branch.orbits[0].periods, branch.values[0]))))


def near_returns(
    scene: Scene, periods: Sequence[int], transient: float = DROPPED, seed: int = 0
) -> list[PeriodicOrbit]:
    """Find the periodic orbits to which motions from several starts nearly return.

    Parameters
    ----------
    scene : Scene
        Source of the driven oscillator.
    periods : sequence of int
        Numbers of drive periods of the orbits.
    transient : float
        Drive periods before the search.
    seed : int
        Seed of the initial states.

    Returns
    -------
    list of PeriodicOrbit
        Each orbit once.
    """
    path = _path(scene, transient, seed)
    orbits: list[PeriodicOrbit] = []
    for count in periods:
        for start in _returning(path, count):
            try:
                orbit = periodic_orbit(scene, count, start)
            except ArithmeticError:
                continue
            alike = [other for other in orbits if other.periods == count]
            if orbit.least == count and not any(_same(orbit, other) for other in alike):
                orbits.append(orbit)
    return orbits


def _path(scene: Scene, transient: float, seed: int) -> np.ndarray:
    """States (LENGTH + 1, starts, components) at the beginning of each period of the drive."""
    loose = scene.replace(rtol=1e-8)
    orbits = Orbits.make(loose, np.zeros(1), initial_states(loose, STARTS, seed), 1)
    orbits.settle(transient)
    integrator = orbits.integrator_of(orbits.strengths)
    states = [integrator.state]
    for _ in range(LENGTH):
        integrator.advance(orbits.unit)
        states.append(integrator.state)
    return np.array(states)[:, :, : orbits.components]


def _returning(path: np.ndarray, periods: int) -> list[np.ndarray]:
    """States of a path with the closest returns after some periods, apart from each other."""
    gap = np.abs(path[periods:] - path[:-periods]).max(axis=2)
    starts: list[np.ndarray] = []
    for flat in np.argsort(gap, axis=None, kind="stable"):
        k, row = np.unravel_index(flat, gap.shape)
        if gap[k, row] > CLOSE or len(starts) == TRIES:
            break
        if all(np.abs(path[k, row] - other).max() > APART for other in starts):
            starts.append(path[k, row])
    return starts


def _same(orbit: PeriodicOrbit, other: PeriodicOrbit) -> bool:
    """True if two orbits of as many periods are one, perhaps shifted by drive periods."""
    return bool(np.abs(orbit.points - other.state).max(axis=1).min() < SAME)


def _passes(branch: Branch, value: float, orbit: PeriodicOrbit) -> bool:
    """True if a branch passes through an orbit."""
    (places,) = np.nonzero(branch.values == value)
    alike = branch.orbits[0].periods == orbit.periods
    return alike and any(_same(orbit, branch.orbits[k]) for k in places)


def _both_ways(scene: Scene, name: str, grid: list[float], k: int, orbit: PeriodicOrbit) -> Branch:
    """Branch through an orbit at grid[k], in one piece."""
    up, down = (traced(scene, name, part, orbit) for part in (grid[k:], grid[k::-1]))
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
                sheet = traced(scene, branch.name, way, first)
            except ArithmeticError:
                continue
            sheets += [(end, sheet.orbits[-1])] if len(sheet.orbits) == len(way) else []
    return sheets
