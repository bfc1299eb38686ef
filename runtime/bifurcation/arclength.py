"""Follow the solutions of any problem along their arclength.

1. Step.  From a solution z with the tangent t, Newton's method starts at z + h t and stays on the hyperplane normal to t
   (Keller).  Lengths are those of the problem's metric.
2. Linear equations.  R has one unknown more than equations.  Its Jacobian without the column in which t is largest is
   square, and regular at folds; one LU factorisation gives the tangent and the step on any hyperplane (Rheinboldt).
   No row of the hyperplane enters the factors, which stay sparse.
3. Rounding.  A residual at the level of rounding is a solution: at branch points the matrix is singular.
4. Step size.  Few corrections lengthen the step, many shorten it.  A step that does not converge, or on which the
   tangent turns by more than ANGLE, is halved.

Sources: Keller, in Rabinowitz (ed.), Applications of Bifurcation Theory (Academic Press, 1977), pages 359-384;
Rheinboldt & Burkardt, ACM Trans. Math. Softw. 9, 215 (1983); Allgower & Georg, Introduction to Numerical
Continuation Methods (SIAM, 2003), chapter 6.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse
from scipy.linalg import lapack
from scipy.sparse.linalg import splu

from .problems import BranchProblem, GrowthNumbers, Matrix

MOST_CORRECTIONS = 12  # most corrections of a step (a choice)
STALLED = 100.0  # largest residual of a solution in units of rounding, where Newton's method has stalled (a choice)
CLOSE = 1e-11  # a solution is accepted after a correction of this length; the next would be its square (a choice)
# Steps of at most FEW corrections are LONGER next time, those of more than MANY are SHORTER (choices).
FEW, MANY, LONGER, SHORTER = 3, 5, 1.4, 0.7
# Cosine of the largest angle between the tangents at both ends of a step (a choice).
ANGLE = math.cos(math.radians(25.0))
# Largest correction, relative to the step, of a step that does not turn; a larger one leads to another branch (a
# choice).
ASIDE = 0.03
KINK = 1.0 / 64.0  # longest step across a kink of the branch (a choice)
# Least length of a step that ends on a bound, relative to that of its guess: a shorter one leads to another branch (a
# choice).
AHEAD = 0.1
SHORTEST = 1e-9  # shortest step; the branch is lost if it must be shorter (a choice)
# First and largest step, in parts of the range of the parameter and of the size of the states (choices).
FIRST_STEP, LARGEST_STEP = 0.01, 0.05
MOST = 1000  # most solutions in each direction (a choice)


@dataclass(frozen=True, slots=True)
class Point:
    """A solution with its tangent."""

    z: np.ndarray  # (size + 1,)
    tangent: np.ndarray  # (size + 1,): of length 1 in the metric of its problem
    corrections: int
    critical: GrowthNumbers | None = None
    counts: tuple[int, int] | None = None  # of growing values, by all solutions up to here
    length: float = 0.0  # arclength from the first solution
    crossing: np.ndarray | None = None  # tangent of the branch that is left here
    slopes: np.ndarray | None = None  # change of each growth by the length, on the step before

    @property
    def value(self) -> float:
        """The parameter."""
        return float(self.z[-1])


Test = Callable[[Point], float]
"""A function along a branch or curve, which is zero at a bifurcation or a point of codimension two."""


class BorderedFactors:
    """The LU factors of a matrix (size, size + 1) without one column; a singular matrix raises ArithmeticError."""

    def __init__(self, matrix: Matrix, column: int) -> None:
        self.kept = kept = np.flatnonzero(np.arange(matrix.shape[1]) != column)
        try:
            if isinstance(matrix, np.ndarray):
                factors, pivots, info = lapack.dgetrf(matrix[:, kept])
                singular = info != 0
                self.right = matrix[:, column]
                self._solve: Callable[[np.ndarray], np.ndarray] = lambda right: lapack.dgetrs(factors, pivots, right)[0]
            else:
                solver, singular = splu(sparse.csc_array(matrix[:, kept])), False
                self.right = matrix[:, [column]].toarray().ravel()
                self._solve = solver.solve
        except RuntimeError:  # splu met a pivot of zero
            singular = True
        if singular:
            raise ArithmeticError("the matrix of Newton's method is singular")

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Return the solution (size + 1,) whose unknown of the left-out column is 0."""
        return self._with(self._solve(right), 0.0)

    def null(self) -> np.ndarray:
        """Return the null vector (size + 1,) whose unknown of the left-out column is 1."""
        return self._with(-self._solve(self.right), 1.0)

    def _with(self, others: np.ndarray, value: float) -> np.ndarray:
        """Return a vector (size + 1,) with the unknown of the left-out column."""
        vector = np.full(len(others) + 1, value)
        vector[self.kept] = others
        return vector


def correct(problem: BranchProblem, guess: np.ndarray, tangent: np.ndarray) -> Point | None:
    """Solve a problem on the hyperplane through `guess` normal to `tangent`; None if Newton's method fails.

    A tangent with a single entry keeps that unknown fixed.
    """
    weights = problem.weights
    row, z, last, stalled = weights**2 * tangent, guess, math.inf, False
    column = int(np.argmax(np.abs(weights * tangent)))
    for count in range(MOST_CORRECTIONS):
        try:
            residual, matrix = problem.linearise(z)
        except ArithmeticError:
            return None
        # Where steps no longer shrink the residual is rounding, if it is as small as that.
        noise = problem.noise(z) * (STALLED if stalled else 1.0)
        solved = last < CLOSE or bool(np.all(np.abs(residual) <= noise))
        try:
            factors = BorderedFactors(matrix, column)
            null = factors.null()
            if not np.isfinite(null).all() or row @ null == 0.0:
                raise ArithmeticError("the tangent is not determined")
        except ArithmeticError:  # at a branch point: any direction will do
            return Point(z, tangent, count) if solved else None
        if solved:
            null *= math.copysign(1.0, row @ null) / float(np.linalg.norm(weights * null))
            return Point(z, null, count)
        step = factors.solve(-residual)
        step -= null * (row @ (step + z - guess)) / (row @ null)
        size = float(np.linalg.norm(weights * step))
        if not size < 10.0 * last:
            return None
        z, last, stalled = z + step, size, size > 0.3 * last
    return None


def at_value(problem: BranchProblem, guess: np.ndarray, place: int = -1) -> Point | None:
    """Solve a problem with one unknown fixed to its value in `guess`, by default the parameter."""
    fixed = np.zeros(len(guess))
    fixed[place] = 1.0 / problem.weights[place]
    return correct(problem, guess, fixed)


@dataclass(frozen=True, slots=True)
class Limits:
    """How far a branch is followed."""

    bounds: Sequence[tuple[float, float]]  # of the last unknowns: each parameter, and the period before them
    most: int  # most solutions
    first_step: float  # lengths in the problem's metric
    largest_step: float
    values: Sequence[float] = ()  # values of the parameter at which solutions are added


Events = Callable[[BranchProblem, Point, Point, float], "list[tuple[float, object]] | None"]
"""Bifurcations on a step (problem, before, after, length), each with its length from `before`; None: halve the step."""


def walk(problem: BranchProblem, first: Point, limits: Limits, events: Events) -> Iterator[object]:
    """Yield solutions and bifurcations along a branch from a first solution, and at last how the branch ends, a str.

    A bifurcation is what `events` returns. Nothing is looked for on the first step if `first` has no critical values.
    """
    before, step = first, limits.first_step
    for _ in range(limits.most):
        found = _advance(problem, before, min(step, limits.largest_step), limits, events)
        if found is None:
            yield f"lost at {problem.names[-1]} = {before.value:.8g}"
            return
        after, located, length, end = found
        if after is before:
            yield end
            return
        # Solutions at requested values and bifurcations in the order of their distance.
        extra = [(h, point) for h, point in _at_values(problem, before, after, length, limits)]
        for _, each in sorted([*located, *extra], key=lambda pair: pair[0]):
            yield each
        z, tangent = problem.accept(after.z, after.tangent)
        before = replace(after, z=z, tangent=tangent, slopes=_slopes(before, after))
        yield before
        if end:
            yield end
            return
        few, many = after.corrections <= FEW, after.corrections > MANY
        step = length * (LONGER if few else SHORTER if many else 1.0)
    yield f"{limits.most} solutions"


def _advance(
    problem: BranchProblem, before: Point, step: float, limits: Limits, events: Events
) -> tuple[Point, list[tuple[float, object]], float, str] | None:
    """Take one step: the next solution, the bifurcations on the step, its length and how the branch ends there."""
    while step >= SHORTEST:
        after = correct(problem, before.z + step * before.tangent, before.tangent)
        length, end = step, ""
        weights = problem.weights
        if after is not None and (_fits(weights, before, after, step) or (problem.kinked and step < KINK)):
            # An unknown that has left its bounds, if one has: the branch ends on the bound.
            places = zip(range(-len(limits.bounds), 0), limits.bounds, strict=True)
            inside = ((place, min(max(after.z[place], low), high)) for place, (low, high) in places)
            passed = next(((place, bound) for place, bound in inside if bound != after.z[place]), None)
            if passed is not None:
                place, bound = passed
                if (
                    bound == before.z[place] and before.critical is None
                ):  # it leaves a bifurcation on this bound outwards
                    return before, [], 0.0, f"{problem.names[place]} = {bound:.8g}"
                share = (bound - before.z[place]) / (after.z[place] - before.z[place])
                guess = before.z + share * (after.z - before.z)
                guess[place] = bound
                after = at_value(problem, guess, place)
                if after is not None:
                    # The tangent of a solution with a fixed unknown points towards it: keep the direction of the step.
                    ahead = (weights * after.tangent) @ (weights * before.tangent)
                    length = float((weights * (after.z - before.z)) @ (weights * before.tangent))
                    turned = after.tangent * math.copysign(1.0, ahead)
                    # Newton's method may have met the branch that is left, at no distance along the tangent.
                    on_branch = length > AHEAD * share * step
                    after = Point(after.z, turned, after.corrections) if on_branch else None
                    end = f"{('period', *problem.names)[place]} = {bound:.8g}"
            if after is not None:
                critical = problem.critical(after.z)
                known = before.counts or (before.critical or critical).counts
                after = Point(
                    after.z,
                    after.tangent,
                    after.corrections,
                    critical,
                    critical.passed(known)[1],
                    before.length + length,
                )
                located = [] if before.critical is None else events(problem, before, after, length)
                if located is not None:
                    return after, located, length, end
        step *= 0.5
    return None


def _slopes(before: Point, after: Point) -> np.ndarray | None:
    """Return the change of each growth by the length; None without growths."""
    one, other = before.critical, after.critical
    if one is None or other is None or len(one.growth) != len(other.growth):
        return None
    return np.asarray((other.growth - one.growth) / (after.length - before.length))


def _fits(weights: np.ndarray, before: Point, after: Point, step: float) -> bool:
    """Return whether two solutions lie on one smooth branch: the step bends as its tangents turn."""
    cosine, moved = float((weights * after.tangent) @ (weights * before.tangent)), weights * (after.z - before.z)
    # On an arc of a circle the correction is the step times the tangent of half the angle.
    aside = float(np.linalg.norm(moved - step * weights * before.tangent)) / step
    if before.crossing is not None:
        other = weights * before.crossing
        if np.linalg.norm(moved - (moved @ other) * other) < aside * step:
            return False
    return cosine > ANGLE and aside < math.tan(math.acos(min(1.0, cosine))) + ASIDE


def _at_values(
    problem: BranchProblem, before: Point, after: Point, length: float, limits: Limits
) -> Iterator[tuple[float, Point]]:
    """Yield the solutions at requested values between two solutions, with their lengths from the first."""
    low, high = sorted((before.value, after.value))
    for value in limits.values:
        if low < value < high:
            share = (value - before.value) / (after.value - before.value)
            guess = before.z + share * (after.z - before.z)
            guess[-1] = value
            point = at_value(problem, guess)
            if point is not None:
                h = share * length
                critical = problem.critical(point.z)
                yield h, replace(point, critical=critical, length=before.length + h)
