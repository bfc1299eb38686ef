"""Follow equilibria and periodic orbits along a parameter.

`follow` chooses the problem that belongs to a solution or bifurcation, `arclength` steps along its branch, `detection`
finds the bifurcations on each step.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from numbers import Real
from typing import Literal, TypedDict, Unpack, overload

import numpy as np

from synchain.models.inputs.checks import check_number, check_positive, listed, short_repr, typed_repr
from synchain.models.inputs.keywords import warn
from synchain.models.inputs.names import expect_free
from synchain.models.scenes.scene import Scene

from .arclength import FIRST_STEP, LARGEST_STEP, MOST, Limits, Point, correct, walk
from .corners import Corner, Corners, cycle_bifurcations
from .curves import follow_curve
from .cycles import Cycles, classes_of
from .detection import Located, bifurcations
from .equilibria import Equilibria
from .equilibrium import Equilibrium
from .kinds import BifurcationKind
from .located_bifurcation import bifurcation_at
from .periodic_result import PeriodicOrbit
from .results import NAMES, Bifurcation, Branch, Curve, Diagram, diagram, digits_of
from .switching import NULL, in_family, leave

Direction = Literal["both", "up", "down"]

First = Equilibrium | PeriodicOrbit | Bifurcation
"""Where a branch begins."""

# Signs of the first step of the parameter for each direction.
SIGNS: Mapping[str, tuple[float, ...]] = {"both": (-1.0, 1.0), "up": (1.0,), "down": (-1.0,)}

Part = tuple[list[tuple[Point, Equilibrium | PeriodicOrbit]], list[Bifurcation], str]
"""The points of a branch in one direction with their solutions, the bifurcations, and how it ends."""

SAME_GRAZE = 1e-5  # two grazes at the end of a branch that are nearer to each other are one (a choice)
BORN = (BifurcationKind.HOPF, BifurcationKind.PERIOD_DOUBLING)  # where cycles are born
LEFT = (BifurcationKind.BRANCH_POINT, BifurcationKind.FOLD)  # where a branch leaves to both sides


class FollowOptions(TypedDict, total=False):
    """Keywords of `follow` in one parameter."""

    to: float | None
    values: Sequence[float] | np.ndarray | None
    within: tuple[float, float] | None
    direction: Direction
    largest_step: float | None
    vector: int
    longest_period: float | None


@overload
def follow(first: First, name: str, **options: Unpack[FollowOptions]) -> Branch: ...


@overload
def follow(first: Sequence[First], name: str, **options: Unpack[FollowOptions]) -> Diagram: ...


@overload
def follow(
    first: Bifurcation,
    name: tuple[str, str],
    *,
    within: Mapping[str, tuple[float, float]],
    direction: Direction = ...,
    largest_step: float | None = ...,
) -> Curve: ...


def follow(
    first: First | Sequence[First],
    name: str | tuple[str, str],
    *,
    to: float | None = None,
    values: Sequence[float] | np.ndarray | None = None,
    within: tuple[float, float] | Mapping[str, tuple[float, float]] | None = None,
    direction: Direction = "both",
    largest_step: float | None = None,
    vector: int = 0,
    longest_period: float | None = None,
) -> Branch | Curve | Diagram:
    """Follow an equilibrium or a periodic orbit along a parameter, through folds, and locate its bifurcations.

    The branch is followed by its arclength: stable and unstable solutions, and both sides of a fold.  It ends on the
    bounds of the parameter.

    Parameters
    ----------
    first : Equilibrium, PeriodicOrbit or Bifurcation, or a sequence of them
        Where the branch begins.  From a branch point the other branch is followed, from a fold both sides.  A sequence,
        such as `equilibria` returns, gives a diagram with a branch for each.
    name : str or (str, str)
        Name of the parameter; names of two parameters for a curve of folds or Hopf points of equilibria, of folds, period
        doublings or torus points of cycles, or of places where cycles lose synchrony.
    to : float, optional
        Follow from the value of `first` towards this one and end there, or where the branch returns to its beginning.
    values : array_like, shape (k,), optional
        Values of the parameter at which solutions are added to those of the steps.
    within : (float, float), or mapping of str to (float, float), optional
        Bounds of the parameter; by default `to`, `values` and the value of `first` set them.  For a curve the bounds of
        one or both parameters by their names.
    direction : {"both", "up", "down"}
        Which way the parameter, of two the second, goes at the beginning; `to` decides it if it is given.
    largest_step : float, optional
        Largest step of the parameter; by default a twentieth of the bounds.
    vector : int
        Which of the vectors of a branch point is followed; see `Bifurcation.vectors`.
    longest_period : float, optional
        Period at which a branch of undriven cycles ends: near a homoclinic orbit periods grow without bound.

    Returns
    -------
    Branch, Curve or Diagram

    Warns
    -----
    RuntimeWarning
        If the branch is lost: the solutions end without a bifurcation.

    Raises
    ------
    ValueError
        If the parameter is unknown, if nothing bounds it, if rates jump or time enters the equations of an equilibrium.
    TypeError
        If `first` is none of these values.
    ArithmeticError
        If there is no solution near `first`.

    See Also
    --------
    equilibrium : Find the first equilibrium.
    equilibria : Find several equilibria.
    diagram : Draw branches together.
    periodic_orbit : Find the first orbit.

    Examples
    --------
    Two machines of a power grid: beyond P/K = 1 there is no equilibrium.

    >>> from synchain import Field, Rates, Scene, equilibrium, follow
    >>> from synchain.graphs import chain
    >>> machine = Field({"delta": "w", "w": "P - w/2"}, parameters={"P": 0})
    >>> line = Rates({"w": "K*W*sin(delta_j - delta_i)"}, {"K": 1})
    >>> rest = equilibrium(Scene(machine, line, chain(2), parameters={"P": [0.5, -0.5]}))
    >>> branch = follow(rest, "K", to=0.1)
    >>> [(str(each.kind), round(each.value, 9)) for each in branch.bifurcations]
    [('fold', 0.5)]
    """
    if isinstance(first, list | tuple) and first and isinstance(name, str):
        options = {"values": values, "within": within, "direction": direction, "largest_step": largest_step}
        options |= {"to": to, "vector": vector, "longest_period": longest_period}
        return diagram(*(follow(each, name, **options) for each in first))  # type: ignore[call-overload]
    # Check what is followed, and in how many parameters.
    if not isinstance(first, Equilibrium | PeriodicOrbit | Bifurcation):
        raise TypeError(
            f"follow: first: found {typed_repr(first)}; expected an Equilibrium, PeriodicOrbit or Bifurcation, or for one "
            "parameter a sequence of them"
        )
    if direction not in SIGNS:
        raise ValueError(f"direction: found {direction!r}; expected 'both', 'up' or 'down'")
    if vector and not (isinstance(first, Bifurcation) and first.kind in (*BORN, *LEFT)):
        raise ValueError(f"vector: found {vector!r}; expected 0 for a branch that leaves no bifurcation")
    if not isinstance(name, str):
        if not isinstance(first, Bifurcation) or not isinstance(within, Mapping | None):
            raise ValueError(
                "follow: found two parameters; expected a bifurcation, and within={name: (low, high)} for a curve"
            )
        return follow_curve(first, name, within, SIGNS[direction], largest_step)
    if isinstance(within, Mapping):
        raise ValueError("within: found bounds by names; expected (low, high) for one parameter")
    scene = (first.solution if isinstance(first, Bifurcation) else first).scene
    _check_name(scene, name)
    # The range of the parameter is its unit of length.
    to = None if to is None else check_number("to", to)
    requested = [] if values is None else checked_values(scene, name, values)
    begin, bounds = scene.parameters[name], _bounds(name, scene.parameters[name], to, requested, within)
    if (parameter := scene.model.parameter(name)) is not None:
        for bound in bounds:
            parameter.check(name, bound)
    size = max(abs(bounds[1] - bounds[0]), *(abs(bound - begin) for bound in bounds))
    size = size if 0.0 < size < math.inf else abs(begin) or 1.0
    largest = LARGEST_STEP if largest_step is None else check_positive("largest_step", largest_step) / size
    ends = (bounds,) if longest_period is None else (_periods(first, longest_period), bounds)
    limits = Limits(ends, MOST, min(FIRST_STEP, largest), largest, requested)
    # Follow the branch both ways, or one way.
    if isinstance(first, Bifurcation) and first.kind in (*BORN, *LEFT):
        # The cycles that are born go to one side; the other is the same cycles, shifted in time.
        sides = SIGNS["up" if first.kind in BORN else "both"]
        parts = [_follow_one_way(*_leave(first, name, sign, vector, size), limits) for sign in sides]
        if all(len(points) == 1 for points, *_ in parts):
            raise _no_branch(first, name, bounds, parts)
        return _joined(name, parts)
    if to is not None:
        direction = "up" if to > begin else "down"
    signs = SIGNS[direction]
    if len(signs) == 2:  # a first solution on a bound is followed inwards
        signs = tuple(sign for sign, bound in zip(signs, bounds, strict=True) if begin != bound) or signs
    return _joined(name, [_follow_one_way(*_begin(first, name, sign, size), limits) for sign in signs])


def _bounds(
    name: str, begin: float, to: float | None, requested: list[float], within: tuple[float, float] | None
) -> tuple[float, float]:
    """Return the bounds of a parameter."""
    if to == begin:
        raise ValueError(f"to: found {to:g}, the value of the first solution; expected another value")
    ends = [*requested, *([] if to is None else [to])]
    if within is None:
        if not ends:
            raise ValueError(f"follow: found no end for {name}; expected to=, values= or within=")
        return min(begin, *ends), max(begin, *ends)
    low, high = (check_number("within", each) for each in within) if len(within) == 2 else (0.0, 0.0)
    if not low < high:
        raise ValueError(f"within: found {short_repr(within)}; expected two numbers, the lower one first")
    if to is not None:
        if not low <= to <= high:
            raise ValueError(f"to: found {to:g}, outside of within={short_repr(within)}; expected a value inside")
        low, high = (low, to) if to > begin else (to, high)
    if not low <= begin <= high:
        raise ValueError(f"within: found {name} = {begin:g} of the first solution outside; expected it inside")
    outside = next((value for value in ends if not low <= value <= high), None)
    if outside is not None:
        raise ValueError(f"values: found {outside:g} outside of within; expected values from {low:g} to {high:g}")
    return low, high


def _periods(first: First, longest: float) -> tuple[float, float]:
    """Return the bounds of the period."""
    solution = first.solution if isinstance(first, Bifurcation) else first
    shortest = solution.free if isinstance(solution, PeriodicOrbit) else 0.0
    if not shortest and not (isinstance(first, Bifurcation) and first.kind is BifurcationKind.HOPF):
        raise ValueError("longest_period: found solutions without a period of their own; expected undriven cycles")
    return 0.0, check_number("longest_period", longest, shortest)


def _begin(first: First, name: str, sign: float, size: float) -> tuple[Equilibria | Cycles, Point]:
    """Return the problem of a solution's branch, and its first point."""
    solution = first.solution if isinstance(first, Bifurcation) else first
    problem: Equilibria | Cycles
    problem = Equilibria.of(solution, name) if isinstance(solution, Equilibrium) else Cycles.of(solution, name)
    problem.set_ranges(np.array([size]))
    return problem, _first_point(problem, sign)


def _first_point(problem: Equilibria | Cycles, sign: float) -> Point:
    """Return the first point of a branch; `sign` is the direction of the parameter."""
    tangent = np.zeros(len(problem.point))
    tangent[-1] = sign / problem.weights[-1]
    found = correct(problem, problem.point, tangent)
    if found is None:
        raise ArithmeticError(f"follow: found no solution at {problem.names[-1]} = {problem.point[-1]:g} near `first`")
    if isinstance(problem, Equilibria):
        problem.scale_along(found.tangent[: problem.size])
    z, tangent = problem.accept(found.z, found.tangent)
    critical = problem.critical(z)
    if isinstance(problem, Cycles) and np.any(np.abs(critical.values - 1.0) < NULL) and in_family(problem, z):
        raise ValueError(
            f"follow: found many cycles at {problem.names[-1]} = {z[-1]:g}, as under a conserved quantity; expected one alone; "
            "follow the family in a parameter that breaks the conservation, such as a damping of strength 0 (Muñoz-Almaraz "
            "et al., Physica D 181, 1 (2003))"
        )
    return Point(z, tangent, 0, critical)


def _leave(first: Bifurcation, name: str, sign: float, vector: int, size: float) -> tuple[Equilibria | Cycles, Point]:
    """Return the problem of the branch that leaves a bifurcation, and its first point, without critical values."""
    solution, kind = first.solution, first.kind
    if not 0 <= vector < len(first.vectors):
        raise ValueError(f"vector: found {vector}; expected a number below {len(first.vectors)}")
    # Along another parameter than that of the known branch the states are taken to stay.
    known = first.tangent if first.tangent.size and first.name == name else np.append(0.0 * solution.state, 1.0)
    along, change = first.vectors[vector].real, known[:-1]
    problem: Equilibria | Cycles
    if isinstance(solution, PeriodicOrbit):
        factor = 2 if kind is BifurcationKind.PERIOD_DOUBLING else 1
        problem, along, change = Cycles.leaving(solution, name, along, change, factor)
    elif kind is BifurcationKind.HOPF:
        problem, along = Cycles.at_hopf(solution, name, first.vectors[vector], first.frequency)
    else:
        problem = Equilibria.of(solution, name)
        problem.unite(classes_of(solution.scene, np.stack([solution.state, along])))
    problem.set_ranges(np.array([size]))
    if isinstance(problem, Equilibria):
        problem.scale_along(along)
    point = leave(problem, along, np.append(change, known[-1])) if kind is BifurcationKind.BRANCH_POINT else None
    point = problem.start(along) if point is None else point
    return problem, replace(point, tangent=sign * point.tangent)


def _no_branch(first: Bifurcation, name: str, bounds: tuple[float, float], parts: list[Part]) -> Exception:
    """Return the error for a bifurcation from which no branch was followed."""
    value = first.solution.scene.parameters[name]
    if any(end.startswith("lost") for *_, end in parts):
        return ArithmeticError(
            f"follow: found no branch beside the known one at the {first.kind} at {name} = {value:.8g}; expected one; try "
            "another vector, a smaller largest_step, or `equilibria` or `periodic_orbit` beside it"
        )
    side = "below" if value == bounds[0] else "above"
    return ValueError(
        f"follow: found bounds {bounds[0]:.8g}, {bounds[1]:.8g} for a branch that begins {side} {name} = {value:.8g}; "
        "expected bounds on both sides, as it may turn back; give within=(low, high)"
    )


def _check_name(scene: Scene, name: str) -> None:
    """Raise ValueError for a parameter that is unknown, does not enter, or has the name of something else."""
    if name not in scene.parameters:
        raise ValueError(f"unknown parameter {name!r}; known: {listed(scene.parameters)}")
    if name not in scene.equations.parameters:
        raise ValueError(
            f"follow: found {name!r}, which does not enter the equations; expected one of {listed(scene.equations.parameters)}"
        )
    expect_free("branch", [name], NAMES)


def _follow_one_way(problem: Equilibria | Cycles, start: Point, limits: Limits) -> Part:
    """Walk along a branch; return its points with their solutions, the bifurcations and how it ends."""
    corners = Corners.of(problem) if isinstance(problem, Cycles) else None
    events = corners or (cycle_bifurcations if isinstance(problem, Cycles) else bifurcations)
    points: list[tuple[Point, Equilibrium | PeriodicOrbit]] = [(start, problem.solution(start))]
    found: list[Bifurcation] = []
    end, name = "", problem.names[-1]

    def add_corner(corner: Corner) -> None:
        point = corner.point
        solution = problem.solution(point)
        found.append(Bifurcation(point.value, corner.kind, corner.residual, solution, name, point.length))

    for each in walk(problem, start, limits, events):
        if isinstance(each, Point):
            try:
                points.append((each, problem.solution(each)))
            except ArithmeticError as problem_text:
                end = f"lost at {name} = {each.value:.8g}: {problem_text}"
                break
        elif isinstance(each, Corner):
            add_corner(each)
        elif isinstance(each, Located):
            found.append(bifurcation_at(problem, each))
            if found[-1].kind in BORN and each.kind is BifurcationKind.BRANCH_POINT:
                # The branch is born there; beyond it are the same cycles, shifted in time.
                return points, found, f"{found[-1].kind} at {name} = {found[-1].value:.8g}"
        else:
            end = f"{each}: homoclinic?" if str(each).startswith("period") else str(each)
    if isinstance(problem, Cycles) and corners and end.startswith("lost"):
        last, orbit = points[-1]
        if corner := corners.at_end(last):
            grazes = [each.length for each in found if each.kind is BifurcationKind.GRAZING]
            if not grazes or abs(grazes[-1] - last.length) > SAME_GRAZE:
                add_corner(corner)
            end = f"grazing at {name} = {last.value:.8g}"
        elif (begin := corners.between_events(last)) is not None and isinstance(orbit, PeriodicOrbit):
            # Go on with cycles that begin at another time.
            again = Cycles.of(orbit, *problem.names, begin=begin)
            again.set_ranges(problem.spans)
            first = replace(_first_point(again, math.copysign(1.0, last.tangent[-1])), length=last.length)
            more, others, end = _follow_one_way(again, first, limits)
            return points + more[1:], found + others, end
    return points, found, end


def _joined(name: str, parts: list[Part]) -> Branch:
    """Return the branch of the parts that were followed in each direction from its first solution."""
    points, found, end = parts[-1]
    ends: tuple[str, ...] = (end,)
    begin = points[0][1]
    if isinstance(begin, Equilibrium) and not begin.complete:
        warn(
            f"follow: found {len(begin.state)} states without blocks by modes; expected fewer for all eigenvalues; Hopf points "
            f"are looked for in the {len(begin.eigenvalues)} eigenvalues nearest to zero, folds by turns"
        )
    if len(parts) == 2:
        behind, found_behind, end_behind = parts[0]
        points = [(replace(p, length=-p.length), solution) for p, solution in behind[:0:-1]] + points
        found = [replace(each, length=-each.length) for each in reversed(found_behind)] + found
        ends = (end_behind, end)
    outer = (points[0], points[-1])[-len(ends) :]
    lost = tuple(point.value for (point, _), end in zip(outer, ends, strict=True) if end.startswith("lost"))
    if lost:
        warn(
            f"follow: found no solution and no bifurcation beyond {name} = {digits_of(lost)}; expected the "
            "branch to go on, or to end at a bifurcation; try a smaller largest_step, or states scaled to the order of 1"
        )
    values, lengths, growing = np.array([(p.value, p.length, solution.growing) for p, solution in points]).T
    solutions = tuple(solution for _, solution in points)
    return Branch(name, values, solutions, tuple(found), growing.astype(int), lengths, lost, ends)


def checked_values(scene: Scene, name: str, values: Sequence[float] | np.ndarray) -> list[float]:
    """Check the values (k,) of a parameter: finite, and rising or falling all the way; return them as floats."""
    _check_name(scene, name)
    if not np.iterable(values) or not all(isinstance(value, Real) and math.isfinite(value) for value in values):
        raise ValueError(f"values: found {short_repr(values)}; expected finite numbers for {name}")
    checked = [float(value) for value in values]
    steps = np.diff(checked)
    if not checked or not (np.all(steps > 0.0) or np.all(steps < 0.0)):
        raise ValueError(
            f"values: found {short_repr(checked)}; expected at least one number, rising or falling all the way"
        )
    return checked
