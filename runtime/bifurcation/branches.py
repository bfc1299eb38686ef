"""Follow equilibria and periodic orbits along a parameter.

`follow` chooses the problem that belongs to a solution or bifurcation, `arclength` steps along its branch, `detection`
finds the bifurcations on each step.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from numbers import Real
from typing import Literal, overload

import numpy as np
from scipy.optimize import newton

from synchain.models.inputs.checks import check_number, listed, short_repr, typed_repr
from synchain.models.inputs.keywords import warn
from synchain.models.inputs.names import expect_free
from synchain.models.scenes.scene import Scene

from .arclength import FIRST_STEP, LARGEST_STEP, MOST, Limits, Point, at_value, correct, walk
from .corners import Corner, Corners, cycle_bifurcations
from .curves import follow_curve
from .cycles import Cycles, classes_of
from .detection import TOGETHER, Located, bifurcations, critical_of
from .equilibria import Equilibria
from .equilibrium import Equilibrium, equilibrium
from .kinds import BifurcationKind
from .normal_forms import first_lyapunov_coefficient
from .periodic_result import PeriodicOrbit
from .results import NAMES, Bifurcation, Branch, Curve, Diagram, diagram, digits_of
from .switching import directions, leave
from .transversal import expansion

Direction = Literal["both", "up", "down"]

SIGNS: Mapping[str, tuple[float, ...]] = {"both": (-1.0, 1.0), "up": (1.0,), "down": (-1.0,)}
"""Signs of the first step of the parameter for each direction."""

Part = tuple[list[tuple[Point, Equilibrium | PeriodicOrbit]], list[Bifurcation], str]
"""The points of a branch in one direction with their solutions, the bifurcations, and how it ends."""

SAME_GRAZE = 1e-5
"""Two grazes at the end of a branch that are nearer to each other are one (a choice)."""

BORN = (BifurcationKind.HOPF, BifurcationKind.PERIOD_DOUBLING)
"""Where cycles are born."""

FIRST_SHIFT, SAME_VALUE = 1e-4, 0.1
"""Second value of the secant method that locates where cycles are born, relative to the range of the parameter, and
largest distance of the critical value there from that of the cycle, relative to its modulus (choices)."""

LEFT = (BifurcationKind.BRANCH_POINT, BifurcationKind.FOLD)
"""Where a branch leaves to both sides."""


@overload
def follow(
    first: Equilibrium | PeriodicOrbit | Bifurcation,
    name: str,
    *,
    to: float | None = ...,
    values: Sequence[float] | np.ndarray | None = ...,
    within: tuple[float, float] | None = ...,
    direction: Direction = ...,
    largest_step: float | None = ...,
    vector: int = ...,
    longest_period: float | None = ...,
) -> Branch: ...


@overload
def follow(
    first: Sequence[Equilibrium | PeriodicOrbit | Bifurcation],
    name: str,
    *,
    to: float | None = ...,
    values: Sequence[float] | np.ndarray | None = ...,
    within: tuple[float, float] | None = ...,
    direction: Direction = ...,
    largest_step: float | None = ...,
    vector: int = ...,
    longest_period: float | None = ...,
) -> Diagram: ...


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
    first: Equilibrium | PeriodicOrbit | Bifurcation | Sequence[Equilibrium | PeriodicOrbit | Bifurcation],
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
    if not isinstance(first, Equilibrium | PeriodicOrbit | Bifurcation):
        raise TypeError(
            f"follow: first: found {typed_repr(first)}; expected an Equilibrium, PeriodicOrbit or Bifurcation, or for one "
            "parameter a sequence of them"
        )
    if direction not in SIGNS:
        raise ValueError(f"direction: found {direction!r}; expected 'both', 'up' or 'down'")
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
    bounds, requested = _bounds(scene, name, to, values, within)
    begin = scene.parameters[name]
    # The range of the parameter is its unit of length.
    size = (
        max(bounds[1] - bounds[0], abs(bounds[0] - begin), abs(bounds[1] - begin)) if np.isfinite(bounds).all() else 0.0
    )
    size = size or abs(begin) or 1.0
    largest = LARGEST_STEP if largest_step is None else check_number("largest_step", largest_step, 0.0) / size
    limits = Limits((bounds,), MOST, min(FIRST_STEP, largest), largest, requested)
    if longest_period is not None:
        limits = replace(limits, bounds=((0.0, _longest_period(first, longest_period)), bounds))
    if isinstance(first, Bifurcation) and first.kind in (*BORN, *LEFT):
        # The cycles that are born go to one side; the other is the same cycles, shifted in time.
        sides = SIGNS["up" if first.kind in BORN else "both"]
        parts = [_trace(*_leave(first, name, sign, vector, size), limits) for sign in sides]
        if all(len(points) == 1 for points, *_ in parts):
            raise _no_branch(first, name, bounds, parts)
        return _joined(name, parts)
    if to is not None:
        direction = "up" if to > begin else "down"
    signs = SIGNS[direction]
    if len(signs) == 2:  # a first solution on a bound is followed inwards
        signs = tuple(sign for sign, bound in zip(signs, bounds, strict=True) if begin != bound) or signs
    return _joined(name, [_trace(*_begin(first, name, sign, size), limits) for sign in signs])


def _longest_period(first: Equilibrium | PeriodicOrbit | Bifurcation, longest: float) -> float:
    """Check the period at which a branch ends."""
    solution = first.solution if isinstance(first, Bifurcation) else first
    shortest = solution.free if isinstance(solution, PeriodicOrbit) else 0.0
    if not shortest and not (isinstance(first, Bifurcation) and first.kind is BifurcationKind.HOPF):
        raise ValueError("longest_period: found solutions without a period of their own; expected undriven cycles")
    return check_number("longest_period", longest, shortest)


def _begin(
    first: Equilibrium | PeriodicOrbit | Bifurcation, name: str, sign: float, size: float
) -> tuple[Equilibria | Cycles, Point]:
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
    return Point(z, tangent, 0, problem.critical(z))


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
        raise ValueError(f"follow: unknown parameter {name!r}; known: {listed(scene.parameters)}")
    if name not in scene.equations.parameters:
        raise ValueError(
            f"follow: found {name!r}, which does not enter the equations; expected one of {listed(scene.equations.parameters)}"
        )
    expect_free("branch", [name], NAMES)


def _bounds(
    scene: Scene,
    name: str,
    to: float | None,
    values: Sequence[float] | np.ndarray | None,
    within: tuple[float, float] | None,
) -> tuple[tuple[float, float], list[float]]:
    """Return the bounds of a parameter and the values at which solutions are requested."""
    requested = [] if values is None else checked_values(scene, name, values)
    begin = scene.parameters[name]
    if to is not None:
        to = check_number("to", to)
        if to == begin:
            raise ValueError(f"to: found {to!r}, the value of the first solution; expected another value")
    if within is not None:
        if len(within) != 2 or not within[0] < within[1]:
            raise ValueError(f"within: found {short_repr(within)}; expected two numbers, the lower one first")
        low, high = (check_number("within", each) for each in within)
        if to is not None:
            low, high = (low, to) if to > begin else (to, high)
        if not low <= begin <= high:
            raise ValueError(f"within: found {name} = {begin:g} of the first solution outside; expected it inside")
        return (low, high), requested
    ends = [*requested, *([] if to is None else [to])]
    if not ends:
        raise ValueError(f"follow: found no end for {name}; expected to=, values= or within=")
    return (min(begin, *ends), max(begin, *ends)), requested


def _trace(problem: Equilibria | Cycles, start: Point, limits: Limits) -> Part:
    """Walk along a branch; return its points with their solutions, the bifurcations and how it ends."""
    corners = None
    events = cycle_bifurcations if isinstance(problem, Cycles) else bifurcations
    if isinstance(problem, Cycles) and problem.flow.equations.sticks and problem.flow.equations.n == 1:
        corners = Corners(problem)
    points: list[tuple[Point, Equilibrium | PeriodicOrbit]] = [(start, problem.solution(start))]
    found: list[Bifurcation] = []
    for each in walk(problem, start, limits, corners or events):
        if isinstance(each, Point):
            points.append((each, problem.solution(each)))
        elif isinstance(each, Corner):
            found.append(_corner(problem, each))
        elif isinstance(each, Located):
            found.append(_bifurcation(problem, each))
            if found[-1].kind in BORN and each.kind is BifurcationKind.BRANCH_POINT:
                # The branch is born there; beyond it are the same cycles, shifted in time.
                return points, found, f"{found[-1].kind} at {problem.names[-1]} = {found[-1].value:.8g}"
    end = f"{each}: homoclinic?" if str(each).startswith("period") else str(each)
    corner = corners.at_end([point for point, _ in points]) if corners and end.startswith("lost") else None
    if corner is not None:
        last = [each for each in found if each.kind is BifurcationKind.GRAZING][-1:]
        if not last or abs(last[0].length - corner.point.length) > SAME_GRAZE:
            found.append(_corner(problem, corner))
        end = f"grazing at {problem.names[-1]} = {corner.point.value:.8g}"
    elif isinstance(problem, Cycles) and corners and end.startswith("lost"):
        point, orbit = points[-1]
        begin = corners.between_events(point)
        if begin is not None and isinstance(orbit, PeriodicOrbit):  # go on with cycles that begin at another time
            again = Cycles.of(orbit, *problem.names, begin=begin)
            again.set_ranges(problem.spans)
            first = _first_point(again, math.copysign(1.0, point.tangent[-1]))
            more, others, end = _trace(again, replace(first, length=point.length), limits)
            return points + more[1:], found + others, end
    return points, found, end


def _corner(problem: Equilibria | Cycles, corner: Corner) -> Bifurcation:
    """Return what belongs to a change of phases."""
    solution = problem.solution(corner.point)
    return Bifurcation(
        corner.point.value, corner.kind, corner.residual, solution, problem.names[-1], corner.point.length
    )


def _bifurcation(problem: Equilibria | Cycles, located: Located) -> Bifurcation:
    """Compute what belongs to a located bifurcation."""
    point, critical = located.point, critical_of(located.point)
    crosses = located.kind is BifurcationKind.BRANCH_POINT
    kind = problem.birth(point.z) if crosses and isinstance(problem, Cycles) else None
    if kind and isinstance(problem, Cycles) and (origin := _birth(problem, point, kind)):
        return origin
    value, block = located.critical, int(critical.blocks[located.index])
    solution, count = problem.solution(point), located.multiplicity
    coefficient = math.nan
    if isinstance(problem, Cycles):
        value = complex(value.real, abs(value.imag))
        basis = problem.vectors(point.z, value if value.imag else complex(round(value.real)), count, block)
        alike = count == 1 or value.imag or solution.scene.equations.sticks
        vectors = basis.T if alike else directions(problem.scene, solution.state, basis.real)
        mode = "" if block < 0 or problem.transversal is None else problem.transversal.text(block)
    elif located.kind is BifurcationKind.HOPF:
        value = complex(value.real, abs(value.imag))
        vectors = directions(problem.scene, solution.state, problem.vectors(point.z, value, count))
        # Real and imaginary part of the eigenvector are orthogonal at this phase.
        vectors = vectors * np.exp(-0.5j * np.angle((vectors**2).sum(axis=1)))[:, None]
        mode = problem.blocks.text(block) if problem.blocks is not None and block >= 0 else ""
        if count == 1:
            coefficient = first_lyapunov_coefficient(problem, point.z, vectors[0], value.imag)
    else:
        vectors = directions(problem.scene, solution.state, problem.vectors(point.z, 0.0, count))
        mode = problem.blocks.text(block) if problem.blocks is not None and block >= 0 else ""
    tangent = np.zeros(0)
    if crosses and not (isinstance(problem, Cycles) and problem.begin):
        count_of_states = problem.flow.size if isinstance(problem, Cycles) else problem.size
        change = point.tangent[:count_of_states]
        if isinstance(problem, Cycles):
            change = expansion(problem.scene.equations, problem.classes, count_of_states) @ change
        tangent = np.append(change, point.tangent[-1])
    return Bifurcation(
        point.value,
        located.kind,
        abs(critical.growth[located.index]) / located.scale,
        solution,
        problem.names[-1],
        point.length,
        value,
        count,
        vectors.astype(complex),
        mode,
        coefficient,
        tangent,
    )


def _birth(problem: Cycles, point: Point, kind: BifurcationKind) -> Bifurcation | None:
    """Return the bifurcation of the equilibrium, or of the cycle of half the period, at which cycles are born.

    Cycles vanish there with the root of the distance, the growth of their origin is linear in it.
    """
    orbit, name = problem.solution(point), problem.names[-1]
    parent: Equilibria | Cycles
    try:
        if kind is BifurcationKind.HOPF:
            copies = expansion(orbit.scene.equations, problem.classes, problem.flow.size)
            parent = Equilibria.of(equilibrium(orbit.scene, copies @ problem.orbit_states(point.z).mean(axis=0)), name)
            target = 2j * math.pi / orbit.period
        else:
            half = problem.states(point.z)[: (problem.segments + 1) // 2]
            period, periods = 0.5 * orbit.period, problem.periods // 2
            parent = Cycles.near(orbit.scene, problem.names, problem.classes, half, period, periods)
            target = -1.0 + 0.0j
        span = float(problem.spans[-1])
        parent.set_ranges(np.array([span]))

        def located(value: float) -> Located:
            """Return the parent's solution at a value of the parameter with the critical value nearest to the target."""
            solution = at_value(parent, np.append(parent.point[:-1], value))
            if solution is None:
                raise ArithmeticError(f"no solution at {name} = {value:g}")
            critical = parent.critical(solution.z)
            distances = abs(critical.values - target)
            together = int((distances < distances.min() + TOGETHER * critical.scale).sum())
            solution = replace(solution, critical=critical, length=point.length)
            return Located(kind, solution, int(distances.argmin()), critical.scale, together)

        def growth(value: float) -> float:
            each = located(value)
            return float(critical_of(each.point).growth[each.index])

        value = newton(growth, point.value, x1=point.value + FIRST_SHIFT * span, tol=1e-14 * span, rtol=1e-14)
        found = located(float(value))
    except (ArithmeticError, RuntimeError):  # the origin has no solution there
        return None
    return _bifurcation(parent, found) if abs(found.critical - target) < SAME_VALUE * abs(target) else None


def _joined(name: str, parts: list[Part]) -> Branch:
    """Return the branch of the parts that were followed in each direction from its first solution."""
    points, found, ends = parts[-1]
    begin = points[0][1]
    if isinstance(begin, Equilibrium) and not begin.complete:
        warn(
            f"follow: found {len(begin.state)} states without blocks by modes; expected fewer for all eigenvalues; Hopf points "
            f"are looked for in the {len(begin.eigenvalues)} eigenvalues nearest to zero, folds by turns"
        )
    both: tuple[str, ...] = (ends,)
    if len(parts) == 2:
        behind, found_behind, end_behind = parts[0]
        points = [(replace(p, length=-p.length), solution) for p, solution in behind[:0:-1]] + points
        found = [replace(each, length=-each.length) for each in reversed(found_behind)] + found
        both = (end_behind, ends)
    lost = tuple(
        point.value
        for (point, _), end in zip((points[0], points[-1])[-len(both) :], both, strict=True)
        if end.startswith("lost")
    )
    if lost:
        warn(
            f"follow: found no solution and no bifurcation beyond {name} = {digits_of(lost)}; expected the "
            "branch to go on, or to end at a bifurcation; try a smaller largest_step, or states scaled to the order of 1"
        )
    growing = np.array([solution.growing for _, solution in points])
    return Branch(
        name,
        np.array([p.value for p, _ in points]),
        tuple(solution for _, solution in points),
        tuple(found),
        growing,
        np.array([p.length for p, _ in points]),
        lost=lost,
        ends=both,
    )


def checked_values(scene: Scene, name: str, values: Sequence[float] | np.ndarray) -> list[float]:
    """Check the values (k,) of a parameter: finite, and rising or falling all the way; return them as floats."""
    if name not in scene.parameters:
        raise ValueError(f"unknown parameter {name!r}; known: {', '.join(scene.parameters)}")
    expect_free("branch", [name], NAMES)
    if not np.iterable(values) or not all(isinstance(value, Real) and math.isfinite(value) for value in values):
        raise ValueError(f"values: found {short_repr(values)}; expected finite numbers for {name}")
    checked = [float(value) for value in values]
    steps = np.diff(checked)
    if not checked or not (np.all(steps > 0.0) or np.all(steps < 0.0)):
        raise ValueError(
            f"values: found {short_repr(checked)}; expected at least one number, rising or falling all the way"
        )
    return checked
