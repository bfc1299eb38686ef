"""Grazing and stick loss: where the phases of stick and slip of a periodic orbit change along a branch.

On a step across which the phases differ, the change is located first; smooth bifurcations are looked for on both sides
of it, since multipliers may jump there.  In stick loss the load at a landing passes the limit of static friction: a sign
change on both sides.  In grazing a gap inside a phase closes: it exists on the side of fewer phases alone, so that each
point on the way has a sixteenth of the gap of the one before, until no digit is left.

Source: di Bernardo, Budd, Champneys & Kowalczyk, Piecewise-smooth Dynamical Systems (Springer, 2008), chapters 7-8.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, linear_sum_assignment

from .arclength import Point
from .cycles import Cycles
from .detection import BranchStep, bifurcations
from .kinds import BifurcationKind
from .phases import Phases, RowPhases, phases_of
from .problems import BranchProblem

APART = 1.0 / 64.0  # longest step on which a change of phases is located; two changes on one count as one (a choice)
# A gap of SHUT is an error of the integration; each step towards a graze leaves SHARE of the gap (choices).
SHUT, SHARE, MOST_STEPS = 1e-13, 1.0 / 16.0, 80
CLOSING = 1e-6  # largest gap of the last orbit of a branch that ends in a graze (a choice)
# Where an event is this near to the beginning of a cycle, in cycles, the cycle begins elsewhere (a choice).
EARLY = 1e-4
# Largest distance that a multiplier moves in a step, relative to its modulus if that exceeds 1 (a choice): a step
# that leads to another branch shows in the multipliers.
MOVE = 0.75


def cycle_bifurcations(
    problem: BranchProblem, before: Point, after: Point, length: float
) -> list[tuple[float, object]] | None:
    """Return the smooth bifurcations on a step of a branch of cycles; None if the step is too long."""
    if before.critical is None or after.critical is None:
        return []
    one, other = before.critical.values, after.critical.values
    # Multipliers are paired so that the sum of their distances is least.
    sizes = np.maximum(1.0, np.maximum(np.abs(one)[:, None], np.abs(other)))
    distances = np.abs(one[:, None] - other) / sizes
    if len(one) and not float(distances[linear_sum_assignment(distances)].max()) < MOVE:
        return None
    return bifurcations(problem, before, after, length)


@dataclass(frozen=True, slots=True)
class Corner:
    """A change of phases."""

    kind: BifurcationKind
    point: Point
    residual: float  # the gap, or the excess of the load


class Corners:
    """Find bifurcations on the steps of a branch of orbits with stick and slip."""

    @classmethod
    def of(cls, problem: Cycles) -> Corners | None:
        """Return the search for corners of one oscillator with stick and slip; None of others."""
        equations = problem.flow.equations
        return cls(problem) if equations.sticks and equations.n == 1 else None

    def __init__(self, problem: Cycles) -> None:
        self.lone, self.problem = problem.scene.lone, problem
        self.known: dict[bytes, Phases] = {}

    def phases(self, point: Point) -> Phases:
        """Return the phases of the orbit at a point."""
        key = point.z.tobytes()
        if key not in self.known:
            values = {name: x for name, x in self.problem.values(point.z).items() if name in self.lone.parameters}
            phases = phases_of(self.lone, values, self.problem.at_drive(point.z)[0][0], self.problem.period(point.z))
            if phases is None:
                raise RuntimeError("friction without phases has no corners")
            self.known[key] = phases
        return self.known[key]

    def __call__(
        self, problem: BranchProblem, before: Point, after: Point, length: float
    ) -> list[tuple[float, object]] | None:
        """Return the bifurcations on a step with their distances from its beginning; None if the step is too long."""
        one, other = self.phases(before), self.phases(after)
        if one.slip_states == other.slip_states:
            return cycle_bifurcations(problem, before, after, length)
        if length > APART:
            return None
        step = BranchStep(problem, before, after, length)
        try:
            corner, near, far = self._located(step, one, other)
        except ArithmeticError:
            return None
        first = bifurcations(problem, before, step.at(near), near) if near > 0.0 else []
        second = bifurcations(problem, step.at(far), after, length - far) if far < length else []
        if first is None or second is None:
            return None
        return [*first, (near, corner), *((far + h, each) for h, each in second)]

    def _located(self, step: BranchStep, one: Phases, other: Phases) -> tuple[Corner, float, float]:
        """Return the change of phases, and the nearest distances on both sides of it."""
        slips = [sorted(mode for mode in phases.slip_states if mode != 0) for phases in (one, other)]
        sticks = [phases.slip_states.count(0) for phases in (one, other)]
        # Only stick phases come or go, and the load at the landing passes the limit.
        if slips[0] == slips[1] and sticks[0] != sticks[1] and one.landing * other.landing < 0.0:
            at = float(brentq(lambda h: self.phases(step.at(h)).landing, 0.0, step.length, xtol=1e-14 * step.length))
            point = step.at(at)
            return Corner(BifurcationKind.STICK_LOSS, point, abs(self.phases(point).landing)), at, at
        if isinstance(one, RowPhases) and isinstance(other, RowPhases) and one.crossings == other.crossings:
            at = self._bisected(step, one)
            return Corner(BifurcationKind.STICK_LOSS, step.at(at), 0.0), at, at
        ahead = len(one.slip_states) <= len(other.slip_states)
        near, far = (0.0, step.length) if ahead else (step.length, 0.0)
        side, gaps = self.phases(step.at(near)).slip_states, [(near, self.phases(step.at(near)).gap)]
        for _ in range(MOST_STEPS):
            gap = gaps[-1][1]
            if gap < SHUT or abs(far - near) <= 1e-14 * step.length:
                break
            at = 0.5 * (near + far)
            if len(gaps) > 1 and gaps[-2][1] > gap:
                # Linear in the distance: aim at a share of the gap.
                guess = near + (1.0 - SHARE) * gap * (near - gaps[-2][0]) / (gaps[-2][1] - gap)
                at = guess if min(near, far) < guess < max(near, far) else at
            phases = self.phases(step.at(at))
            if phases.slip_states == side and phases.gap > -SHUT:
                near = at
                gaps.append((at, phases.gap))
            else:
                far = at
        if isinstance(one, RowPhases) and not abs(gaps[-1][1]) < CLOSING:
            raise ArithmeticError("events change, but no gap closes")
        corner = Corner(BifurcationKind.GRAZING, step.at(near), abs(gaps[-1][1]))
        return (corner, near, far) if ahead else (corner, far, near)

    def _bisected(self, step: BranchStep, one: Phases) -> float:
        """Return the distance at which the phases are those of the beginning no longer."""
        near, far = 0.0, step.length
        while far - near > 1e-13 * step.length:
            at = 0.5 * (near + far)
            near, far = (at, far) if self.phases(step.at(at)).slip_states == one.slip_states else (near, at)
        return near

    def at_end(self, last: Point) -> Corner | None:
        """Return the graze at which a branch ends; None if the gap of its last orbit is open."""
        gap = self.phases(last).gap
        return Corner(BifurcationKind.GRAZING, last, abs(gap)) if abs(gap) < CLOSING else None

    def between_events(self, point: Point) -> float | None:
        """Return a time far from events if one meets the beginning of the cycle, where the state jumps; None else."""
        phases, period = self.phases(point), self.problem.period(point.z)
        if not isinstance(phases, RowPhases) or not phases.times:
            return None
        away = (np.array(phases.times) - self.problem.begin / period + 0.5) % 1.0 - 0.5
        if np.abs(away).min() >= EARLY:
            return None
        times = np.append(phases.times, phases.times[0] + 1.0)
        widest = int(np.diff(times).argmax())
        return float(times[widest : widest + 2].mean() % 1.0) * period
