"""The skeleton of a bifurcation diagram: the periodic orbits of few periods, stable or not, and their branches.

A chaotic motion comes close to every periodic orbit on its attractor again and again, and a transient to those beside it.
States that nearly return after some periods of the drive are therefore good starts for Newton's method.

Source: Auerbach, Cvitanovic, Eckmann, Gunaratne & Procaccia, Phys. Rev. Lett. 58, 2387 (1987).
"""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Integral

import numpy as np

from synchain.models.inputs.checks import shown
from synchain.models.scenes.scene import Scene, a_scene

from ..stability.exponents import coupled_cell, initial_states
from ..stability.orbits import Orbits
from .bifurcations import BifurcationKind
from .branches import Branch, checked_values, follow
from .periodic import SAME, TOLERANCE, PeriodicOrbit, check_periods, periodic_orbit

__all__ = ["near_returns", "skeleton"]

STARTS, LENGTH, DROPPED = 16, 200, 20
"""Motions that are looked through for returns, their length in periods of the drive, and what is dropped before it."""

NEARER = 4
"""The other sheet at a fold is entered at 4^-NEARER of the distance from the fold to the last orbit before it."""

CLOSE, APART, TRIES = 0.05, 0.02, 12
"""Returns as close as this are tried, the closest first, those apart from each other by so much, and so many at most."""


def skeleton(
    scene: Scene, name: str, values: Sequence[float] | np.ndarray, periods: Sequence[int] = (1, 2), looks: int = 8
) -> tuple[Branch, ...]:
    """The skeleton of a bifurcation diagram over `values`: the branches of all orbits of these numbers of drive periods that
    are found from near returns at `looks` of the values, followed up and down from there.

    The branches rise in the parameter, and are sorted by the number of periods and the first value.  An orbit that is one of
    fewer periods is left out, and so is one that a branch passes through already.
    Raises ValueError for an unknown parameter, values that do not rise or fall all the way, and fewer looks than one.
    """
    grid = sorted(checked_values(a_scene(scene), name, values))
    if isinstance(periods, Integral | str) or len(periods) == 0:
        raise ValueError(f"periods = {shown(periods)}; expected numbers of drive periods, e.g. (1, 2)")
    scene = coupled_cell(skeleton, scene, TOLERANCE, {})
    if not isinstance(looks, Integral) or looks < 1:
        raise ValueError(f"looks = {shown(looks)}; expected a whole number, at least 1")
    for each in periods:
        check_periods(each)
    made: list[Branch] = []

    def take(k: int, orbit: PeriodicOrbit) -> None:
        """Follow an orbit at grid[k] that is new, and what its branch turns into at its folds."""
        if any(_passes(branch, grid[k], orbit) for branch in made):
            return
        made.append(_both_ways(scene, name, grid, k, orbit))
        for end, other in _other_sheets(scene, made[-1]):
            take(grid.index(end), other)

    count = min(looks, len(grid))
    for k in sorted({int((2 * j + 1) * len(grid) / (2 * count)) for j in range(count)}):
        for orbit in near_returns(scene, periods, **{name: grid[k]}):
            take(k, orbit)
    return tuple(sorted(made, key=lambda branch: (branch.orbits[0].periods, branch.values[0])))


def near_returns(scene: Scene, periods: Sequence[int], **parameters: float) -> list[PeriodicOrbit]:
    """The periodic orbits of these numbers of drive periods that motions from several starts nearly return to, each once."""
    scene = coupled_cell(near_returns, scene, TOLERANCE, parameters)
    path = _path(scene)
    found: list[PeriodicOrbit] = []
    for count in periods:
        for start in _returning(path, count):
            try:
                orbit = periodic_orbit(scene, count, start)
            except ArithmeticError:
                continue
            own = [other for other in found if other.periods == count]
            if orbit.least == count and not any(_same(orbit, other) for other in own):
                found.append(orbit)
    return found


def _path(scene: Scene) -> np.ndarray:
    """States (LENGTH + 1, starts, components) at the beginning of each period of the drive."""
    loose = scene.replace(rtol=1e-8)
    orbits = Orbits.make(loose, np.zeros(1), initial_states(loose, STARTS, 0), 1)
    orbits.settle(DROPPED)
    integrator = orbits.integrator_of(orbits.strengths)
    states = [integrator.state]
    for _ in range(LENGTH):
        integrator.advance(orbits.unit)
        states.append(integrator.state)
    return np.array(states)[:, :, : orbits.components]


def _returning(path: np.ndarray, periods: int) -> list[np.ndarray]:
    """The states of a path that come back closest after some periods, and are apart from each other."""
    gap = np.abs(path[periods:] - path[:-periods]).max(axis=2)
    chosen: list[np.ndarray] = []
    for flat in np.argsort(gap, axis=None, kind="stable"):
        k, row = np.unravel_index(flat, gap.shape)
        if gap[k, row] > CLOSE or len(chosen) == TRIES:
            break
        if all(np.abs(path[k, row] - other).max() > APART for other in chosen):
            chosen.append(path[k, row])
    return chosen


def _same(orbit: PeriodicOrbit, other: PeriodicOrbit) -> bool:
    """True where two orbits of as many periods are one, perhaps some periods of the drive later."""
    return bool(np.abs(orbit.points - other.state).max(axis=1).min() < SAME)


def _passes(branch: Branch, value: float, orbit: PeriodicOrbit) -> bool:
    """True where a branch passes through an orbit."""
    (places,) = np.nonzero(branch.values == value)
    own = branch.orbits[0].periods == orbit.periods
    return own and any(_same(orbit, branch.orbits[k]) for k in places)


def _both_ways(scene: Scene, name: str, grid: list[float], k: int, orbit: PeriodicOrbit) -> Branch:
    """The branch through an orbit at grid[k], in one piece."""
    up, down = (follow(scene, name, part, orbit) for part in (grid[k:], grid[k::-1]))
    return Branch(
        name,
        np.concatenate([down.values[:0:-1], up.values]),
        (*down.orbits[:0:-1], *up.orbits),
        (*down.bifurcations[::-1], *up.bifurcations),
        (*down.phases[:0:-1], *up.phases),
    )


def _other_sheets(scene: Scene, branch: Branch) -> list[tuple[float, PeriodicOrbit]]:
    """What a branch turns into at its folds: the value of its last orbit there, and the orbit of the other sheet at it.

    Near a fold the sheets lie on both sides of it, at distances like the square root of that of the parameter.
    """
    found = []
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
                first = periodic_orbit(scene, last.periods, start, **{branch.name: way[0]})
                sheet = follow(scene, branch.name, way, first)
            except ArithmeticError:
                continue
            found += [(end, sheet.orbits[-1])] if len(sheet.orbits) == len(way) else []
    return found
