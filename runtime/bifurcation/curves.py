"""Follow bifurcations in two parameters.

Points of codimension two are zeros of test functions along the curve, or places where a further eigenvalue or
multiplier passes:

| point | on folds | on Hopf points |
|---|---|---|
| cusp | u r_xx v v | |
| Bogdanov-Takens | u M v | k; the curve ends |
| Bautin (generalised Hopf) | | first Lyapunov coefficient |
| zero-Hopf | a pair passes | a real eigenvalue passes |
| double Hopf | | a pair passes |

Here u and v are the left and right null vectors.

| point | on curves of cycles |
|---|---|
| cusp | on folds u K_y w w |
| 1:1, 1:2 resonance | a second multiplier passes 1, -1 on folds, period doublings; torus points end there |
| 1:3, 1:4 resonance | on torus points the cosine of the angle passes -1/2, 0 |
| Bautin, zero-Hopf, double Hopf | the cycle shrinks onto an equilibrium: the curve ends |
| "fold with torus" … | a multiplier of another kind passes |

Source: Kuznetsov, Elements of Applied Bifurcation Theory, 3rd ed. (Springer, 2004), chapters 8 to 10.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import chain

import numpy as np

from synchain.models.inputs.checks import check_keys, check_positive, check_table, listed

from .arclength import FIRST_STEP, LARGEST_STEP, MOST, Limits, Point, correct, walk
from .critical_curve import CriticalCurve
from .cycle_curves import CycleCurve
from .detection import TOGETHER, VERTICAL, BranchStep, critical_of
from .equilibrium import Equilibrium
from .equilibrium_curves import EquilibriumCurve
from .kinds import BifurcationKind
from .problems import REAL, BranchProblem
from .results import Bifurcation, Curve, CurvePoint, digits_of


def codimension_two(
    problem: BranchProblem, before: Point, after: Point, length: float
) -> list[tuple[float, object]] | None:
    """Return the points of codimension two on a step of a curve with their distances; None if it is too long."""
    if not isinstance(problem, CriticalCurve):
        raise TypeError("points of codimension two belong to curves")
    try:
        return sorted(_points(problem, BranchStep(problem, before, after, length)), key=lambda pair: pair[0])
    except ArithmeticError:
        return None


def _points(problem: CriticalCurve, step: BranchStep) -> Iterator[tuple[float, CurvePoint | str]]:
    """Yield points of codimension two, those at which a parameter is extreme, and how the curve ends, in any order."""

    def point(kind: str, distance: float, z: np.ndarray | None = None) -> tuple[float, CurvePoint]:
        z = step.at(distance).z if z is None else z
        return distance, CurvePoint(kind, (float(z[-2]), float(z[-1])), problem.state(z), problem.frequency(z))

    ends = step.before, step.after
    for name, test in problem.limits().items():
        if test(ends[1]) <= 0.0:
            distance = step.zero(test)
            z = (step.at(distance) if name else step.singular_point(distance, test)).z
            _, end = point(name or problem.origin(z), distance, z)
            yield distance, end
            yield distance, f"{end.kind} at {digits_of(end.values)}"
            return
    cusps = list[float]()
    for name, test in problem.tests().items():
        one, other = map(test, ends)
        if one * other < 0.0:
            cusps += [step.zero(test)] if name == "cusp" else []
            yield point(name, step.zero(test))
    for place, name in zip((-2, -1), problem.names, strict=True):
        slopes = problem.weights[place] * np.array([each.tangent[place] for each in ends])
        if slopes[0] * slopes[1] < 0.0 and abs(slopes).max() > VERTICAL:
            distance = step.zero(lambda at, place=place: float(at.tangent[place]))  # type: ignore[misc]
            # Parameters turn at a cusp, too.
            if all(abs(distance - cusp) > TOGETHER * step.length for cusp in cusps):
                yield point(f"extreme {name}", distance)
    critical = critical_of(ends[1])
    change, _ = critical.passed(ends[0].counts or critical_of(ends[0]).counts)
    index = critical.growing - max(change, 0)
    beyond = index + abs(change)
    while index < beyond:
        distance = step.zero(step.growth(index))
        critical = problem.critical(step.at(distance).z)
        value = complex(critical.values[step.passing(distance, index)])
        paired = abs(value.imag) > REAL * critical.scale
        if kind := problem.passing(value if paired else complex(value.real)):
            yield point(kind, distance)
        index += 2 if paired else 1


def follow_curve(
    first: Bifurcation,
    names: tuple[str, str],
    within: Mapping[str, tuple[float, float]] | None,
    signs: tuple[float, ...],
    largest_step: float | None,
) -> Curve:
    """Follow a bifurcation in two parameters, as `follow` does."""
    solution, kind = first.solution, first.kind
    if isinstance(solution, Equilibrium):
        followed = kind in (BifurcationKind.FOLD, BifurcationKind.HOPF)
    else:
        along = kind in (BifurcationKind.FOLD, BifurcationKind.PERIOD_DOUBLING, BifurcationKind.TORUS)
        followed = along or (kind is BifurcationKind.BRANCH_POINT and bool(first.mode))
    if not followed:
        raise ValueError(
            f"follow: found a {kind} in two parameters; expected a fold or Hopf point of equilibria, or a fold, period doubling, "
            "torus point or loss of synchrony of cycles"
        )
    scene = solution.scene
    if len(set(names)) != 2:
        raise ValueError(f"follow: found {names!r}; expected two different parameters")
    known = scene.equations.parameters
    if strange := next((name for name in names if name not in known), None):
        raise ValueError(f"follow: unknown parameter {strange!r}; known: {listed(known)}")
    within = {} if within is None else within
    check_keys("within", check_table("within", within), names)
    if not within:
        raise ValueError(f"follow: found no bounds; expected within={{{names[1]!r}: (…, …)}}")
    bounds, sizes = [], []
    for name in names:
        low, high = within.get(name, (-np.inf, np.inf))
        value = scene.parameters[name]
        if not low <= value <= high:
            raise ValueError(f"within: found {name} = {value:g} outside; expected it between {low:g} and {high:g}")
        bounds.append((float(low), float(high)))
        sizes.append(float(high - low))
    largest = LARGEST_STEP
    if largest_step is not None:
        unit = sizes[1] if np.isfinite(sizes[1]) else abs(scene.parameters[names[1]]) or 1.0
        largest = check_positive("largest_step", largest_step) / unit
    limits = Limits(bounds, MOST, min(FIRST_STEP, largest), largest)
    parts = [_part(first, names, np.array(sizes), sign, limits) for sign in signs]
    points, special, end = parts[-1]
    ends: tuple[str, ...] = (end,)
    if len(parts) == 2:
        behind, special_behind, end_behind = parts[0]
        points, special, ends = behind[:0:-1] + points, special_behind[::-1] + special, (end_behind, end)
    values, states, frequencies, periods, growing = (np.array(column) for column in zip(*points, strict=True))
    return Curve(scene, kind, names, values, states, frequencies, growing, tuple(special), ends, periods)


CurveRow = tuple[np.ndarray, np.ndarray, float, float, int]
"""Both parameters, state, frequency, period and number of growing values of a point of a curve."""


def _part(
    first: Bifurcation, names: tuple[str, str], ranges: np.ndarray, sign: float, limits: Limits
) -> tuple[list[CurveRow], list[CurvePoint], str]:
    """Follow a curve in one direction; return its points, the special ones and how it ends."""
    solution = first.solution
    rests = isinstance(solution, Equilibrium)
    problem = (EquilibriumCurve if rests else CycleCurve)(first, solution, names, ranges)  # type: ignore[arg-type]
    along = np.zeros(len(problem.point))
    along[-1] = sign / problem.weights[-1]
    point = correct(problem, problem.point, along)
    if point is None:
        raise ArithmeticError(f"follow: found no {first.kind} near `first`; it may have more than one critical vector")
    z, tangent = problem.accept(point.z, point.tangent)
    start = replace(point, z=z, tangent=tangent, critical=problem.critical(z))
    points, special = list[CurveRow](), list[CurvePoint]()
    for each in chain([start], walk(problem, start, limits, codimension_two)):
        if isinstance(each, CurvePoint):
            special.append(each)
        elif isinstance(each, Point):
            z, growing = each.z, 0 if each.critical is None else each.critical.growing
            points.append((z[-2:], problem.state(z), problem.frequency(z), problem.period(z), growing))
        else:
            break
    return points, special, str(each)
