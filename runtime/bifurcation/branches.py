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

from synchain.models.inputs.checks import check_number, listed, short_repr, typed_repr
from synchain.models.inputs.keywords import warn
from synchain.models.inputs.names import expect_free
from synchain.models.scenes.scene import Scene

from .arclength import FIRST_STEP, LARGEST_STEP, MOST, Limits, Point, correct, walk
from .corners import Corner, Corners, cycle_bifurcations
from .curves import follow_curve
from .cycles import Cycles
from .detection import Located, bifurcations
from .equilibria import Equilibria
from .equilibrium import Equilibrium, resting_equations
from .kinds import BifurcationKind
from .normal_forms import first_lyapunov_coefficient
from .periodic_result import PeriodicOrbit
from .results import NAMES, Bifurcation, Branch, Curve, Diagram, diagram, digits_of
from .switching import directions

Direction = Literal["both", "up", "down"]

SIGNS: Mapping[str, tuple[float, ...]] = {"both": (-1.0, 1.0), "up": (1.0,), "down": (-1.0,)}
"""Signs of the first step of the parameter for each direction."""

Part = tuple[list[tuple[Point, Equilibrium | PeriodicOrbit]], list[Bifurcation], str]
"""The points of a branch in one direction with their solutions, the bifurcations, and how it ends."""

SAME_GRAZE = 1e-5
"""Two grazes at the end of a branch that are nearer to each other are one (a choice)."""

BORN = (BifurcationKind.HOPF, BifurcationKind.PERIOD_DOUBLING)
"""Where cycles are born."""

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
    solution = first.solution if isinstance(first, Bifurcation) else first
    scene = solution.scene
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
        is_cycle = isinstance(solution, PeriodicOrbit) and solution.free > 0.0
        if not is_cycle and not (isinstance(first, Bifurcation) and first.kind is BifurcationKind.HOPF):
            raise ValueError("longest_period: found solutions without a period of their own; expected undriven cycles")
        longest = check_number(
            "longest_period", longest_period, solution.free if isinstance(solution, PeriodicOrbit) else 0.0
        )
        limits = replace(limits, bounds=((0.0, longest), bounds))
    if to is not None:
        direction = "up" if to > begin else "down"
    signs = SIGNS[direction]
    if len(signs) == 2:  # a first solution on a bound is followed inwards
        signs = tuple(sign for sign, bound in zip(signs, bounds, strict=True) if begin != bound) or signs
    if isinstance(first, Bifurcation) and first.kind in BORN:
        # The cycles that are born there go to one side; the other is the same cycles, shifted in time.
        signs = (1.0,)
    elif isinstance(first, Bifurcation) and first.kind in LEFT:
        signs = (-1.0, 1.0)
    parts = [_trace(*_begin(first, name, sign, vector, size), limits) for sign in signs]
    return _joined(name, parts)


def _begin(
    first: Equilibrium | PeriodicOrbit | Bifurcation, name: str, sign: float, vector: int, size: float
) -> tuple[Equilibria | Cycles, Point]:
    """Return the problem of a branch and its first point, without critical values where it leaves a bifurcation."""
    leaves = isinstance(first, Bifurcation) and first.kind in {*BORN, *LEFT}
    if isinstance(first, Bifurcation) and leaves and not 0 <= vector < len(first.vectors):
        raise ValueError(f"vector: found {vector}; expected a number below {len(first.vectors)}")
    problem: Equilibria | Cycles
    solution = first.solution if isinstance(first, Bifurcation) else first
    if isinstance(solution, Equilibrium):
        if isinstance(first, Bifurcation) and first.kind is BifurcationKind.HOPF:
            problem, point = Cycles.at_hopf(solution, name, first.vectors[vector], first.frequency)
            problem.set_ranges(np.array([size]))
            return problem, point
        equations = resting_equations("follow", solution.scene)
        problem = Equilibria(solution.scene, equations, (name,), solution.state, solution.shifts, solution.speeds)
        tangent = np.zeros(len(problem.point))
        if isinstance(first, Bifurcation) and leaves:
            tangent[: problem.size] = sign * first.vectors[vector].real
    elif isinstance(first, Bifurcation) and leaves:
        factor = 2 if first.kind is BifurcationKind.PERIOD_DOUBLING else 1
        problem, point = Cycles.leaving(solution, name, sign * first.vectors[vector].real, factor)
        tangent = point.tangent
    else:
        problem = Cycles.of(solution, name)
        tangent = np.zeros(len(problem.point))
    problem.set_ranges(np.array([size]))
    if leaves:
        if isinstance(problem, Equilibria):
            problem.scale_along(tangent[: problem.size])
        return problem, Point(problem.point, tangent / float(np.linalg.norm(problem.weights * tangent)), 0)
    tangent[-1] = sign / problem.weights[-1]
    found = correct(problem, problem.point, tangent)
    if found is None:
        raise ArithmeticError(f"follow: found no solution at {problem.names[-1]} = {problem.point[-1]:g} near `first`")
    if isinstance(problem, Equilibria):
        problem.scale_along(found.tangent[: problem.size])
    z, tangent = problem.accept(found.z, found.tangent)
    return problem, Point(z, tangent, 0, problem.critical(z))


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
                return points, found, f"{found[-1].kind} at {problem.names[-1]} = {each.point.value:.8g}"
    end = f"{each}: homoclinic?" if str(each).startswith("period") else str(each)
    corner = corners.at_end([point for point, _ in points]) if corners and end.startswith("lost") else None
    if corner is not None:
        last = [each for each in found if each.kind is BifurcationKind.GRAZING][-1:]
        if not last or abs(last[0].length - corner.point.length) > SAME_GRAZE:
            found.append(_corner(problem, corner))
        end = f"grazing at {problem.names[-1]} = {corner.point.value:.8g}"
    elif corners and end.startswith("lost") and corners.event_at_start([point for point, _ in points]):
        at = f"{problem.names[-1]} = {points[-1][0].value:.8g}"
        end = f"an event at the beginning of a period at {at}, where the state jumps; shift the drive in time"
    return points, found, end


def _corner(problem: Equilibria | Cycles, corner: Corner) -> Bifurcation:
    """Return what belongs to a change of phases."""
    solution = problem.solution(corner.point)
    return Bifurcation(
        corner.point.value, corner.kind, corner.residual, solution, problem.names[-1], corner.point.length
    )


def _bifurcation(problem: Equilibria | Cycles, located: Located) -> Bifurcation:
    """Compute what belongs to a located bifurcation."""
    point, critical = located.point, located.point.critical
    if critical is None:
        raise RuntimeError("a bifurcation without critical values")
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
    kind = located.kind
    if isinstance(problem, Cycles) and kind is BifurcationKind.BRANCH_POINT:
        kind = problem.birth(point.z) or kind
    return Bifurcation(
        point.value,
        kind,
        abs(critical.growth[located.index]) / located.scale,
        solution,
        problem.names[-1],
        point.length,
        value,
        count,
        vectors.astype(complex),
        mode,
        coefficient,
    )


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
