"""Continue periodic orbits along a smooth arc of their branch, and through a fold.

1. An arc.  All its orbits have the same phases of stick and slip.  Newton's method starts from a polynomial through the
   nearest orbits of the arc, so that it stays on the arc where the branch has a kink, as at a change of phases.
2. Tangents.  An orbit x(p) of the map P(x, p) has dx/dp = (I - M)^-1 P_p.  A step is accepted if its chord fits the
   tangents at both ends, and if no multiplier moves far.
3. Folds.  There the branch turns back in p and a multiplier is 1, so that I - M is singular.  Pseudo-arclength
continuation
   (Keller) passes through: x and p are unknowns together, and the length along a direction t is prescribed, with the
   matrix

       B = [M - I, P_p; t'].

4. Folds and branch points.  det(M - I)/det B is the parameter's share of the tangent.  At a fold only det(M - I)
changes
   its sign.  At a branch point both determinants change sign if the arc goes straight on.  If the arc turns there, as
   an arc that is born in a pitchfork does, only det B changes its sign.

Sources: Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems, in Rabinowitz
(ed.), Applications of Bifurcation Theory (Academic Press, 1977), pages 359-384; Seydel, Practical
Bifurcation and Stability Analysis, 3rd ed. (Springer, 2010), chapter 4; Kuznetsov, Elements of
Applied Bifurcation Theory, 3rd ed. (Springer, 2004), chapter 10.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import brentq, linear_sum_assignment

from synchain.models.scenes.scene import Scene

from .kinds import BifurcationKind
from .periodic import SAME, PeriodicOrbit, closed, orbit_through, periodic_orbit, relative, strobe
from .phases import Phases

NEAR = 3
"""Number of orbits that the polynomial of a first guess passes through (a choice)."""

FIT = 0.5
"""Largest difference between the chord of a step and the tangent at either end, relative to the chord (a choice)."""

MOVE = 0.75
"""Largest distance that a multiplier moves in a step, relative to its modulus if that exceeds 1 (a choice)."""

MOST_ITERATIONS = 30
"""Most steps of Newton's method to a point of an arc (a choice)."""

MOST_STEPS = 24
"""Most steps along the arc towards a turn, each at most twice as long as the one before (a choice)."""

SHORTEST = 1e-7
"""Shortest step, relative to the first; if a step must be shorter, the arc does not end at a turn (a choice)."""

BESIDE = 1e-2
"""Distance from a branch point, relative to the step, of the points that lead to it (a choice)."""

NEUTRAL = 1e-6
"""Largest distance from 1 of the multiplier at a branch point; a kink has none so near (a choice)."""

DIFFERENCE, SHARE = 1e-6, 1e-3
"""Half width of the central difference for P_p: DIFFERENCE times the parameter or, if that is more, SHARE times its way
along
the arc.  With rtol = 1e-12 the quotient has some six digits, enough for Newton's method (choices)."""

CLOSED = 1e-11
"""Largest distance of a point of an arc from its image, relative to the extent of each component (a choice)."""


@dataclass(slots=True)
class Arc:
    """Orbits along a parameter, in the order in which they were found."""

    scene: Scene  # scene of the orbits
    name: str  # name of the parameter
    periods: int  # drive periods of each orbit
    span: float = 0.0  # length of the whole range of the parameter
    values: list[float] = field(default_factory=list)  # values of the parameter
    orbits: list[PeriodicOrbit] = field(default_factory=list)  # orbit at each value
    # phases of each orbit; None for friction that is not set-valued
    phases: list[Phases | None] = field(default_factory=list)
    # (components,): derivatives of states by the parameter, relative to the extents, by value and state
    tangents: dict[tuple[float, bytes], np.ndarray] = field(default_factory=dict)

    def take(self, value: float, orbit: PeriodicOrbit, phases: Phases | None) -> Arc:
        """Append an orbit and return the arc."""
        self.values.append(value)
        self.orbits.append(orbit)
        self.phases.append(phases)
        return self

    def empty(self) -> Arc:
        """Return an arc of the same scene without orbits."""
        return Arc(self.scene, self.name, self.periods, self.span)

    def copy(self) -> Arc:
        """Return an arc with the same orbits, which can be extended independently."""
        return replace(self, values=[*self.values], orbits=[*self.orbits], phases=[*self.phases])

    def guess(self, value: float) -> np.ndarray:
        """Extrapolate the state of the orbit, shape (components,), at a value of the parameter."""
        return _through(self.values, [orbit.state for orbit in self.orbits], value)

    def at(self, value: float) -> PeriodicOrbit:
        """Find the orbit at a value of the parameter."""
        return periodic_orbit(self.scene, self.periods, self.guess(value), parameters={self.name: value})

    def image(self, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the state after the drive periods, and its derivative by the state.

        Shapes: point (components + 1,); returns image (components,), matrix (components, components).
        """
        return strobe(self.scene, point[:-1], self.periods, {self.name: float(point[-1])}, self.orbits[-1].extent)

    def slope(self, point: np.ndarray, way: float) -> np.ndarray:
        """Return P_p (components,), the derivative of `image` by the parameter, which goes a `way` along the arc."""
        step = np.zeros(len(point))
        step[-1] = max(DIFFERENCE * abs(point[-1]), SHARE * abs(way))
        return np.asarray((self.image(point + step)[0] - self.image(point - step)[0]) / (2.0 * step[-1]))

    def tangent(self, value: float, orbit: PeriodicOrbit) -> np.ndarray:
        """Solve (I - M) dx/dp = dP/dp for dx/dp (components,) of an orbit, in units of its extent.

        P is the map over its period and M the Jacobian of P.
        """
        key = (value, orbit.state.tobytes())
        if key not in self.tangents:
            point, units = np.append(orbit.state, value), _units(orbit)
            matrix = np.eye(len(units)) - self.image(point)[1] * units / units[:, None]
            slope = self.slope(point, SHARE * self.span) / units
            self.tangents[key] = np.linalg.lstsq(matrix, slope, rcond=None)[0]
        return self.tangents[key]

    def joins(self, value: float, orbit: PeriodicOrbit) -> bool:
        """Return whether the arc can go from its last orbit to another one of the same phases in one step."""
        last = self.orbits[-1]
        # A step on which a multiplier moves far can hide bifurcations.
        if not _moved(last.multipliers, orbit.multipliers) < MOVE:
            return False
        way, change = value - self.values[-1], orbit.state - last.state
        allowed = FIT * relative(change, orbit.extent) + SAME
        # An orbit of another branch does not fit the tangent at the last orbit, or the chord does not fit its tangent.
        # Under
        # set-valued friction the state has a kink where the start of the period passes from stick to slip: only the
        # tangent
        # at the end fits.
        ends = [(value, orbit), (self.values[-1], last)]
        for at, end in ends if self.phases[-1] is None else ends[:1]:
            if not np.abs(change / _units(end) - way * self.tangent(at, end)).max() < allowed:
                return False
        return not turns(self, (self.values[-1], value), (last, orbit))


def _units(orbit: PeriodicOrbit) -> np.ndarray:
    """Return the extent (components,) of an orbit, 1 for components that do not move."""
    return np.where(orbit.extent > 0.0, orbit.extent, 1.0)


def _moved(before: np.ndarray, after: np.ndarray) -> float:
    """Return the largest distance that a multiplier moves, relative to its modulus if that exceeds 1."""
    # Multipliers are paired so that the sum of their distances is least.
    distances = np.abs(before[:, None] - after) / np.maximum(1.0, np.maximum(np.abs(before)[:, None], np.abs(after)))
    return float(distances[linear_sum_assignment(distances)].max())


def _through(values: Sequence[float], points: Sequence[np.ndarray], value: float) -> np.ndarray:
    """Interpolate points, or extrapolate them, by the polynomial through those at the NEAR values nearest to `value`."""
    order = np.argsort(np.abs(np.array(values) - value), kind="stable")[:NEAR].tolist()
    point = np.zeros_like(points[-1])
    for k in order:  # Lagrange's form
        share = math.prod((value - values[j]) / (values[k] - values[j]) for j in order if j != k)
        point += share * points[k]
    return point


def det(orbit: PeriodicOrbit, point: float) -> float:
    """Return det(M - point) of an orbit's monodromy matrix M for a real number."""
    return float(np.prod(orbit.multipliers - point).real)


def turns(arc: Arc, values: tuple[float, float], orbits: tuple[PeriodicOrbit, PeriodicOrbit]) -> bool:
    """Return whether an arc turns back between two orbits: det(M - I) changes its sign, and det B does not."""
    if (det(orbits[0], 1.0) < 0.0) == (det(orbits[1], 1.0) < 0.0):
        return False
    start, end = (np.append(orbit.state, value) for value, orbit in zip(values, orbits, strict=True))
    chord = ArclengthStep(arc, start, end - start)
    return (chord.border(start) < 0.0) == (chord.border(end) < 0.0)


def find_turn(arc: Arc, beyond: float) -> tuple[BifurcationKind, float, PeriodicOrbit] | None:
    """Find by arclength steps the fold or branch point at which an arc turns back before the value `beyond`."""
    if len(arc.values) < 2:
        return None
    slip_states = None if arc.phases[-1] is None else arc.phases[-1].slip_states
    here, before = (np.append(arc.orbits[k].state, arc.values[k]) for k in (-1, -2))
    # Steps begin in the direction of the last two orbits, with the length of the distance between them.
    step, path = ArclengthStep(arc, here, here - before), [before, here]
    length = step.length(here - before)
    shortest = SHORTEST * length
    for _ in range(MOST_STEPS):
        there = step.point(length)
        # Refuse a point that is far from its prediction, or whose orbit has other phases.
        if (
            there is None
            or not step.length(there - step.guess(length)) < FIT * length
            or _slip_states(step.orbit(there)) != slip_states
        ):
            length *= 0.25
            if length < shortest:
                return None
            continue
        path.append(there)
        # Fold or branch point on this step: the signs of det(M - I) and of det B with the chord as direction.
        chord = ArclengthStep(arc, step.start, there - step.start)
        turned = (step.side(step.start) < 0.0) != (step.side(there) < 0.0)
        branched = (chord.border(step.start) < 0.0) != (chord.border(there) < 0.0)
        if turned and not branched:
            return BifurcationKind.FOLD, *step.root(step.side, path)
        if branched and not turned:
            value, orbit = step.summit(chord.rate, path)
            neutral = np.abs(orbit.multipliers - 1.0).min() < NEUTRAL
            return (BifurcationKind.BRANCH_POINT, value, orbit) if neutral else None
        if not (beyond - there[-1]) * (there[-1] - step.start[-1]) > 0.0:  # past the end, or back without a turn
            return None
        step = ArclengthStep(arc, there, there - step.start)
        length *= 2.0
    return None


def _slip_states(orbit: PeriodicOrbit) -> tuple[int, ...] | None:
    """Return the slip states of an orbit's phases, None without set-valued friction."""
    phases = orbit.phases
    return None if phases is None else phases.slip_states


@dataclass(slots=True)
class ArclengthStep:
    """A step from a point (state, parameter) of an arc along a direction."""

    arc: Arc  # arc that is continued
    start: np.ndarray  # (components + 1,): state and parameter at the start
    along: np.ndarray  # (components + 1,): direction, of any length

    def orbit(self, point: np.ndarray) -> PeriodicOrbit:
        """Return the periodic orbit at a point."""
        return orbit_through(self.arc.scene, self.arc.periods, point[:-1], {self.arc.name: float(point[-1])})

    def side(self, point: np.ndarray) -> float:
        """Return det(M - I) of the monodromy matrix M at a point: zero at a fold."""
        return det(self.orbit(point), 1.0)

    def border(self, point: np.ndarray) -> float:
        """Return det B at a point: zero at a branch point."""
        return float(np.linalg.det(self._bordered(self.arc.image(point)[1], self._slope(point))))

    def rate(self, point: np.ndarray) -> float:
        """Return the parameter's share of the tangent at a point: zero where the arc turns."""
        return self.side(point) / self.border(point)

    def guess(self, length: float) -> np.ndarray:
        """Return the point (components + 1,) at a length from the start on the direction."""
        return np.asarray(self.start + length * self.along / self.length(self.along))

    def point(self, length: float, guess: np.ndarray | None = None) -> np.ndarray | None:
        """Find the point of the arc at a length from the start, measured along the direction.

        Shapes: guess (components + 1,); returns (components + 1,).
        """
        guess = self.guess(length) if guess is None else guess
        slope = self._slope(guess)  # kept for all steps: their limit depends on the gap alone
        point, best = guess, np.inf
        for _ in range(MOST_ITERATIONS):
            image, matrix = self.arc.image(point)
            gap, ahead = image - point[:-1], self.along_way(point - guess)
            size = max(relative(gap, self.weights[:-1]), abs(ahead))
            if not size < best:
                break
            best, nearest, left = size, point, gap
            try:
                point = point - np.linalg.solve(self._bordered(matrix, slope), np.append(gap, ahead))
            except np.linalg.LinAlgError:
                return None
        return nearest if closed(left, CLOSED * self.weights[:-1], nearest[:-1]) else None

    def root(self, test: Callable[[np.ndarray], float], path: Sequence[np.ndarray]) -> tuple[float, PeriodicOrbit]:
        """Locate the zero of a function of the point between the last two points of a path along the arc."""
        points = self._by_length(path)
        one, other = [*points][-2:]
        at = brentq(lambda at: test(self._between(points, at)), one, other, xtol=1e-13 * abs(other - one), rtol=1e-13)
        return self._value_and_orbit(self._between(points, float(at)))

    def summit(self, test: Callable[[np.ndarray], float], path: Sequence[np.ndarray]) -> tuple[float, PeriodicOrbit]:
        """Locate the turn at a branch point between the last two points of a path, where a function changes its sign.

        B is singular at the branch point itself: a cubic through four points beside it leads there.
        """
        points = self._by_length(path)
        one, other = [*points][-2:]
        length = abs(other - one)
        at = float(brentq(lambda at: test(self._between(points, at)), one, other, xtol=BESIDE * length))
        beside = BESIDE * length * np.array([-2.0, -1.0, 1.0, 2.0])
        cubic = np.polyfit(beside, [self._between(points, at + each) for each in beside], 3)
        # The turn is the zero of the cubic's derivative of the parameter, its last column, that lies nearest.
        turns = np.roots(cubic[:3, -1] * [3.0, 2.0, 1.0])
        turn = turns[np.abs(turns).argmin()].real
        return self._value_and_orbit(np.array([np.polyval(each, turn) for each in cubic.T]))

    def _by_length(self, path: Sequence[np.ndarray]) -> dict[float, np.ndarray]:
        """Return points by their length along the direction."""
        return {self.along_way(point - self.start): point for point in path}

    def _between(self, points: dict[float, np.ndarray], length: float) -> np.ndarray:
        """Return the point at a length, from a polynomial through the points, and add it to them."""
        if length not in points:
            point = self.point(length, _through([*points], [*points.values()], length))
            if point is None:
                raise ArithmeticError("the arc of a branch is lost close to its turn")
            points[length] = point
        return points[length]

    def _value_and_orbit(self, point: np.ndarray) -> tuple[float, PeriodicOrbit]:
        """Return parameter and orbit at a point."""
        return float(point[-1]), self.orbit(point)

    def length(self, way: np.ndarray) -> float:
        """Return the length of a difference of points, relative to the weights."""
        return float(np.linalg.norm(way / self.weights))

    def along_way(self, way: np.ndarray) -> float:
        """Return the part of a difference of points along the direction."""
        return float(self._row @ way)

    @property
    def weights(self) -> np.ndarray:
        """Units (components + 1,) of state and parameter: the extent of the orbit, and the way along the whole arc.

        Near a turn the parameter hardly moves in this unit, so that the direction is that of the state.
        """
        ways = [abs(value - self.arc.values[-1]) for value in self.arc.values]
        units = np.append(self.arc.orbits[-1].extent, max(ways) or abs(self.along[-1]))
        return np.where(units > 0.0, units, 1.0)

    @property
    def _row(self) -> np.ndarray:
        """The row t' of B: its product with a difference of points is the part along the direction."""
        return np.asarray(self.along / self.weights**2 / self.length(self.along))

    def _slope(self, point: np.ndarray) -> np.ndarray:
        """Return P_p (components,) at a point."""
        return self.arc.slope(point, float(self.weights[-1]))

    def _bordered(self, matrix: np.ndarray, slope: np.ndarray) -> np.ndarray:
        """Return B = [M - I, P_p; t']."""
        return np.vstack([np.column_stack([matrix - np.eye(len(matrix)), slope]), self._row])
