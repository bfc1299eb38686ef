"""Find the bifurcations on a step along a branch.

The critical values of a solution are sorted by their growth.  The k-th growth of the sorted list is continuous along the
branch, also where values meet or form a pair.  If the number of growing values changes on a step, then the growths
between both numbers pass zero: each is the test function of one bifurcation.  Neutral saddles, at which a sum of two
values is zero, change no number.  A branch that turns in its parameter without any change of the number touches zero
there: the branch is born in a pitchfork.

| changes on the step | bifurcation |
|---|---|
| a real value passes where the parameter turns | fold |
| a real value passes elsewhere | branch point (transcritical, pitchfork) |
| the parameter turns, a value touches zero | branch point (the branch is born in a pitchfork) |
| a pair passes | Hopf, torus |
| a multiplier passes -1 | period doubling |
| no number; a growth touches zero, or two exchange their signs | branch point, Hopf, torus |

Source: Kuznetsov, Elements of Applied Bifurcation Theory, 3rd ed. (Springer, 2004), section 10.2.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import chebyshev
from scipy.optimize import brentq, minimize_scalar

from .arclength import ANGLE, Point, Test, correct
from .kinds import BifurcationKind
from .problems import REAL, BranchProblem, GrowthNumbers

# Bifurcations nearer than this part of a step are one of higher multiplicity, or lie on a turn (a choice).
TOGETHER = 1e-8
# Largest growth of the value that touches zero at a turn, relative to the largest value (a choice): it grows as the
# square of the distance, which is located to half of the digits.
TOUCHING = 1e-5
# Distance from a turn, relative to the step, at which the value that passes or touches zero is compared: the first at
# which it differs from zero by CLEAR, relative to the largest value (choices).
BESIDE, CLEAR = (1e-3, 5e-3, 0.025), 1e-7
# Growth where one touches zero, relative to that at the ends of the step (a choice): the square of a distance, or two
# of them, are least where they are known to half of the digits.
TOUCHED = 1e-6
# Tangent in the parameter that is an error at both ends of a step, as along a conservative family (a choice).
VERTICAL = 1e-12
SHORT = 1e-3  # longest step on which a growth may seem to pass zero without doing so (a choice)
MOST_HALVINGS = 1000  # most evaluations for a zero: a multiple one takes some hundred (a choice)
# Solutions of a step from which a branch point is computed, and its largest distance from where it was looked for,
# relative to half of the step (choices).
NODES, NEAR = 9, 1e-3


@dataclass(frozen=True, slots=True)
class Located:
    """A bifurcation on a branch, before its results are computed."""

    kind: BifurcationKind
    point: Point  # with critical values
    index: int  # of the critical value
    scale: float  # size of the critical values on the step
    multiplicity: int = 1  # of values or pairs that pass together

    @property
    def critical(self) -> complex:
        """The value that passes; real if its imaginary part is a rounding error."""
        value = complex(critical_of(self.point).values[self.index])
        return value if abs(value.imag) > REAL * self.scale else complex(value.real)


def critical_of(point: Point) -> GrowthNumbers:
    """Return the critical values of a solution that has some."""
    if point.critical is None:
        raise RuntimeError("critical values were not computed")
    return point.critical


class BranchStep:
    """The solutions on the hyperplanes between both ends of a step, by their distance from its beginning."""

    def __init__(self, problem: BranchProblem, before: Point, after: Point, length: float) -> None:
        self.problem, self.before, self.after, self.length = problem, before, after, length
        self.points = {0.0: before, length: after}

    def at(self, distance: float) -> Point:
        """Return the solution at a distance; ArithmeticError if Newton's method fails."""
        if distance not in self.points:
            one, other, h = self.before, self.after, self.length
            guess, s = one.z + distance * one.tangent, distance / h
            cosine = float((self.problem.weights**2 * other.tangent) @ one.tangent)
            if cosine > ANGLE:  # the cubic through both ends with their tangents stays on the hyperplanes
                ends = h * one.tangent, other.z - one.z, h / cosine * other.tangent
                guess = one.z + s * ends[1] + s * (1 - s) * ((1 - s) * (ends[0] - ends[1]) + s * (ends[1] - ends[2]))
            point = correct(self.problem, guess, self.before.tangent)
            if point is None:
                raise ArithmeticError("no solution between two solutions of a branch")
            critical = self.problem.critical(point.z)
            self.points[distance] = replace(point, critical=critical, length=self.before.length + distance)
        return self.points[distance]

    @property
    def scale(self) -> float:
        """The size of the critical values, at both ends: where all pass together, none is left in between."""
        return max(critical_of(end).scale for end in (self.before, self.after))

    def zero(self, test: Test) -> float:
        """Return the distance at which a function of the solution passes zero."""
        ends = test(self.before), test(self.after)
        if ends[0] * ends[1] >= 0.0:  # one end is zero to rounding
            return 0.0 if abs(ends[0]) < abs(ends[1]) else self.length
        tolerance = 1e-14 * self.length
        return float(
            brentq(lambda h: test(self.at(h)), 0.0, self.length, xtol=tolerance, rtol=1e-14, maxiter=MOST_HALVINGS)
        )

    def growth(self, index: int) -> Test:
        """Return the growth of a critical value as a test function."""
        return lambda point: float((critical_of(point).signed if self.hidden else critical_of(point).growth)[index])

    @property
    def hidden(self) -> bool:
        """Whether a value is zero at both ends, as that of a conserved quantity: without a sign, it may hide others."""
        return all(critical_of(end).neutral for end in (self.before, self.after))

    def passing(self, distance: float, index: int) -> int:
        """Return the index at a distance of the value that passes as the index-th one."""
        critical = critical_of(self.at(distance))
        if not self.hidden:
            return index
        # Of all that are zero there, the nearest to the one that has passed where more values grow.
        end = max(map(critical_of, (self.before, self.after)), key=lambda each: each.growing)
        zero = np.where(np.abs(critical.growth) <= critical.errors, 0.0, np.inf)
        return int((zero + np.abs(critical.values - end.values[end.growth > end.errors][index])).argmin())

    def tangent(self, distance: float) -> np.ndarray:
        """Return the tangent at a branch point, where Newton's method finds none: the mean of those on both sides."""
        sides = (min(max(distance + d * self.length, 0.0), self.length) for d in (-BESIDE[0], BESIDE[0]))
        return np.asarray(np.mean([self.at(side).tangent for side in sides], axis=0))

    def singular_point(self, distance: float, test: Test | None) -> Point:
        """Return the solution near a distance at which a test passes zero, or for None the parameter turns.

        Newton's method has few digits where branches meet, or a cycle vanishes.  The solution follows from a polynomial
        through NODES regular ones.
        """
        nodes = -np.cos(np.pi * (np.arange(NODES + 1) + 0.5) / (NODES + 1))
        guess = 2.0 * distance / self.length - 1.0
        nodes = np.delete(nodes, np.abs(nodes - guess).argmin())
        points = [self.at(float(0.5 * self.length * (1.0 + x))) for x in nodes]
        columns = np.array([point.z for point in points]).T
        if test is not None:
            columns = np.vstack([columns, [test(point) for point in points]])
        coefficients = np.linalg.solve(chebyshev.chebvander(nodes, NODES - 1), columns.T)
        last = coefficients[:, -1]
        roots = chebyshev.chebroots(chebyshev.chebder(last) if test is None else last)
        real = roots[np.abs(roots.imag) < TOUCHING].real
        # Where values meet, the sorted growths are not smooth.
        rough = test is not None and np.abs(last[-2:]).max() > CLEAR * np.abs(last).max()
        if rough or not len(real) or np.abs(real - guess).min() > NEAR:
            return self.at(distance)
        x = float(real[np.abs(real - guess).argmin()])
        z = np.asarray(chebyshev.chebval(x, coefficients))[: len(self.before.z)]
        length = self.before.length + 0.5 * self.length * (1.0 + x)
        return replace(self.at(distance), z=z, critical=self.problem.critical(z), length=length)


def bifurcations(
    problem: BranchProblem, before: Point, after: Point, length: float
) -> list[tuple[float, object]] | None:
    """Return the bifurcations on a step with their distances from its beginning; None if the step is too long."""
    step = BranchStep(problem, before, after, length)
    critical = critical_of(after)
    change, _ = critical.passed(before.counts or critical_of(before).counts)
    slopes = problem.weights[-1] * np.array([before.tangent[-1], after.tangent[-1]])
    turned = slopes[0] * slopes[1] < 0.0 and (change != 0 or abs(slopes).max() > VERTICAL)
    passes = change != 0 or turned
    nearest = None if passes else _pointing_to_zero(before, length)
    try:
        if passes:
            first = critical.growing - max(change, 0)
            return _found(step, range(first, first + abs(change)), turned)
        # The step may have passed a branch point onto the other branch, or values that exchange their signs.
        return [] if nearest is None else None if length >= SHORT else _touching(step, nearest)
    except ArithmeticError:
        return None


def _pointing_to_zero(before: Point, length: float) -> int | None:
    """Return the index of the growth that a step, begun as the last one went on, would take through zero; None if none.

    A branch that is born in a pitchfork touches zero growth there.  Beyond lies the branch that it was born from, with
    as many growing values.
    """
    critical = critical_of(before)
    if before.slopes is None or not len(critical.growth):
        return None
    nearest = int(np.where(abs(critical.growth) > critical.errors, abs(critical.growth), np.inf).argmin())
    growth = critical.growth[nearest]
    return nearest if growth * (growth + length * before.slopes[nearest]) < 0.0 else None


def _touching(step: BranchStep, index: int) -> list[tuple[float, object]]:
    """Return the point of a step at which a growth touches zero, or two exchange their signs, so that no number changes."""
    ends = [abs(critical_of(end).growth[index]) for end in (step.before, step.after)]
    search = minimize_scalar(
        lambda h: abs(critical_of(step.at(float(h))).growth[index]), bounds=(0.0, step.length), method="bounded",
        options={"xatol": 1e-13 * step.length},
    )  # fmt: skip
    critical, distance = critical_of(step.at(float(search.x))), float(search.x)
    together = abs(critical.growth) <= TOUCHED * max(ends)
    if not together[index] or min(ends) <= TOUCHED * max(ends):
        return []
    pairs = abs(critical.values[together].imag) > REAL * step.scale
    value = complex(critical.values[index])
    kind = step.problem.kind(value if pairs.any() else complex(value.real), False)
    point = replace(step.at(distance), tangent=step.tangent(distance))
    count = int(np.where(pairs, 0.5, 1.0).sum())
    return [(distance, Located(kind, point, index, step.scale, count))]


def _found(step: BranchStep, indices: range, turned: bool) -> list[tuple[float, object]] | None:
    """Return the bifurcations of the critical values that pass on a step, and that of its turn."""
    problem, length = step.problem, step.length
    turn = step.zero(lambda point: float(point.tangent[-1])) if turned else None
    located = [*_passing(step, indices, turn)]
    if turn is not None and not any(each.kind is BifurcationKind.FOLD for _, each in located):
        critical = critical_of(step.at(turn))
        touching = int(abs(critical.growth).argmin())
        if abs(critical.growth[touching]) > TOUCHING * step.scale:
            return None  # two changes of the number cancel on this step
        near = [h for h, each in located if abs(h - turn) < TOGETHER * length and not abs(each.critical.imag) > 0.0]
        if not near:
            # Of few eigenvalues of a large network one may pass although the number of growing ones stays the same.
            for beside in BESIDE:
                places = (min(max(turn + d * length, 0.0), length) for d in (-beside, beside))
                sides = [min(critical_of(step.at(place)).growth, key=abs) for place in places]
                if min(map(abs, sides)) > CLEAR * step.scale:
                    break
            kind = problem.kind(complex(critical.values[touching].real), sides[0] * sides[1] < 0.0)
            point = step.at(turn) if kind is BifurcationKind.FOLD else step.singular_point(turn, None)
            located.append((turn, Located(kind, point, touching, step.scale)))
    for k, (distance, each) in enumerate(located):
        if each.kind is BifurcationKind.BRANCH_POINT:
            located[k] = distance, replace(each, point=replace(each.point, tangent=step.tangent(distance)))
    # Join bifurcations of one kind at one place to one of higher multiplicity.
    joined: list[tuple[float, Located]] = []
    for distance, each in sorted(located, key=lambda pair: pair[0]):
        last = joined[-1] if joined else None
        if last and last[1].kind is each.kind and distance - last[0] < TOGETHER * length:
            joined[-1] = (last[0], replace(last[1], multiplicity=last[1].multiplicity + 1))
        else:
            joined.append((distance, each))
    return [*joined]


def _passing(step: BranchStep, indices: range, turn: float | None) -> Iterator[tuple[float, Located]]:
    """Yield a bifurcation for each critical value, or pair of values, that passes on a step."""
    index, neutral = indices.start, np.zeros(indices.stop, dtype=bool)
    if turn is not None:  # real values that are neutral where the parameter turns
        critical = critical_of(step.at(turn))
        small = abs(critical.growth) <= TOUCHING * step.scale
        neutral = small & (abs(critical.values.imag) <= REAL * step.scale)
    while index < indices.stop:
        turned = bool(neutral[index])
        # A fold is located better by the turn: its value is a square root of the parameter.
        distance = turn if turned and turn is not None else step.zero(step.growth(index))
        critical = critical_of(step.at(distance))
        passing = step.passing(distance, index)
        value = complex(critical.values[passing])
        paired = abs(value.imag) > REAL * step.scale
        kind, point = step.problem.kind(value if paired else complex(value.real), turned), step.at(distance)
        if kind is BifurcationKind.BRANCH_POINT:
            point = step.singular_point(distance, step.growth(index))
        yield distance, Located(kind, point, passing, step.scale)
        index += 2 if paired else 1
