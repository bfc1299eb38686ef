"""Curves of folds, period doublings and torus points of cycles in two parameters.

With y the unknowns of a cycle (states x_1 … x_m of m segments, shifts, period), K the Jacobian of its equations by y and
M_i the propagators:

* folds: K w = 0;
* period doublings: M_i w_i = w_(i+1), M_m w_m = -w_1;
* torus points with multipliers e^(+-ia), c = cos a: a_i and u_i are handed on like w_i, and at the end
  M_m a_m = c a_1 - u_1, M_m u_m = (1 - c^2) a_1 + c u_1.  The equations stay regular at the strong resonances c = 1 and
  c = -1, where the curve ends: beyond them lie neutral saddles;
* branch points, period doublings and torus points of differences within clusters: M_i act on these differences.

The derivatives of M_i w_i by states and parameters are exact: (x, w) is a state of the lifted network, and its
propagators contain them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from scipy import linalg

from synchain.models.dynamics.lift import lifted
from synchain.models.dynamics.reduction import without_drive

from .arclength import Point, Test
from .critical_curve import CriticalCurve, CriticalEquations
from .cycles import Cycles
from .flow import TOLERANCE, Image, flow_of
from .kinds import BifurcationKind
from .periodic_result import PeriodicOrbit
from .results import Bifurcation
from .transversal import expansion

# Largest part of the image of a mode's deviations that leaves the mode, relative to the image (a choice).
ONE_MODE = 1e-6
# Largest distance from 1 of a multiplier that is 1 where the cycles vanish: the root of the errors there (a choice).
AT_ONE = 1e-3


class CycleCurve(CriticalCurve):
    """Folds, branch points of differences, period doublings or torus points of cycles."""

    base: Cycles

    def __init__(self, first: Bifurcation, orbit: PeriodicOrbit, names: Sequence[str], ranges: np.ndarray) -> None:
        scene = orbit.scene
        if scene.equations.sticks:
            raise ValueError(
                "follow: found set-valued friction, stops or resets in two parameters; expected smooth rates; follow the "
                "cycles in one parameter for some values of the other"
            )
        base = Cycles.of(orbit, *names)
        base.set_ranges(ranges)
        super().__init__(base, first.kind, first.multiplicity)
        n = base.flow.size
        # Deviations of the equations `network`, whose states are `copies` of those of the quotient, are the columns of
        # `right`: all of them, or differences within clusters.  `left` returns their coordinates, in units of the extents.
        self.of_differences = bool(first.mode)
        network, self.copies, basis = base.flow.equations, np.eye(n), np.eye(n)
        if self.of_differences:
            network = without_drive(scene.equations, scene.parameters)
            self.copies = expansion(network, orbit.classes, n)
            basis = linalg.qr(self.copies)[0][:, n:]
            if self.multiplicity > 1:  # one of the modes that pass together
                parts = first.vectors.reshape(len(first.vectors) * (len(basis) // scene.n), scene.n)
                mode = np.linalg.svd(np.vstack([parts.real, parts.imag]))[2][0]
                basis = np.kron(np.eye(len(basis) // scene.n), mode[:, None])
        elif self.multiplicity > 1:
            raise ValueError(f"follow: found {self.multiplicity} multipliers that pass together; expected a single one")
        self.scale = self.copies @ base.scale
        self.right, self.left = self.scale[:, None] * basis, basis.T / self.scale
        self.lift = lifted(network, [name for name in self.names if name in network.parameters])
        self.seeds = dict.fromkeys(self.lift.seeds.values(), 0.0)
        first_state = self._both(base.states(base.point)[:1] @ self.copies.T, 0.0)[0]
        self.flow = flow_of(scene, self.lift.equations, self.names, first_state)
        start = base.accept(base.point, np.ones(len(base.point)))[0]
        self.size = len(start) - 2
        number = first.critical.real / abs(first.critical)
        self.point = np.insert(start, self.size, self._vectors_at(start, number))

    @property
    def units(self) -> np.ndarray:
        """The units of w: extents of the states, shifts by the largest of them, the period."""
        base = self.base
        shifts = np.full(base.shifts.shape[1], float(base.scale.max()))
        period = [] if base.periods else [base.point[self.size - 1]]
        return np.concatenate([np.tile(self.scale, base.segments), shifts, period])

    def _vectors_at(self, point: np.ndarray, number: float) -> np.ndarray:
        m = self.base.segments
        if self.is_fold:
            inner = np.linalg.svd(self._bordered(point)[0])[2][-1]
        else:
            image, one = self._image(point, np.zeros((m, len(self.left)))), np.eye(len(self.left))
            propagators = self._own(image)
            values, vectors = np.linalg.eig(np.linalg.multi_dot([one, *propagators[::-1], one]))
            chosen = int(np.abs(values - self.critical_values(number)[0]).argmin())
            if self.multiplicity > 1:
                moved = image.propagators[0][np.ix_(self.lift.deviations, self.lift.deviations)] @ self.right
                if np.abs(moved - self.right @ propagators[0]).max() > ONE_MODE * np.abs(moved).max():
                    raise ValueError(
                        "follow: found modes that do not separate; expected differences of one mode of the graph"
                    )
            parts = [vectors[:, chosen]]
            for each in propagators[: m - 1]:
                parts.append(each @ parts[-1])
            inner = np.concatenate(parts)
        self.place = int(np.abs(inner).argmax())
        inner = inner / inner[self.place]
        if self.is_pair:
            value = values[chosen] / abs(values[chosen])
            return np.concatenate([inner.real, value.imag * inner.imag, [value.real]])
        return np.asarray(inner.real)

    # --- equations ---
    def _both(self, states: np.ndarray, deviations: np.ndarray | float) -> np.ndarray:
        """Return states (k, 2 N) of the lifted network."""
        both = np.zeros((len(states), self.lift.equations.dimension))
        both[:, self.lift.states], both[:, self.lift.deviations] = states, deviations
        return both

    def _image(self, point: np.ndarray, vectors: np.ndarray) -> Image:
        """Integrate cycle and deviations over all segments. Shapes: vectors (r m, k), r of them for each segment."""
        base, count = self.base, len(vectors)
        values = {**base.values(point), **self.seeds}
        states = np.tile(base.states(point) @ self.copies.T, (count // base.segments, 1))
        scale = self._both(self.scale[None], self.scale)[0]
        times = np.full(count, base.period(point) / base.segments)
        return self.flow.linearise(values, self._both(states, vectors @ self.right.T), times, scale)

    def _own(self, image: Image) -> np.ndarray:
        """Return the propagators (r m, k, k) of the deviations."""
        deviations = [*self.lift.deviations]
        return np.asarray(self.left @ image.propagators[:, deviations][:, :, deviations] @ self.right)

    def _bordered(self, point: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return K in units of the extents, and residual and Jacobian of the cycle."""
        residual, matrix = self.base.linearise(point)
        scaled = matrix[:, : self.size] * self.units
        scaled[: self.base.phase.size] /= np.tile(self.scale, self.base.segments)[:, None]
        return scaled, residual, matrix

    def _cyclic(self, propagators: np.ndarray, turn: np.ndarray) -> np.ndarray:
        """Return the matrix that hands deviations (r, m, k) on from segment to segment, with a matrix (r, r) at the end."""
        r, m, k = len(turn), len(propagators), propagators.shape[1]
        matrix, one = np.zeros((r, m, k, r, m, k)), np.eye(k)
        for s in range(r):
            for i in range(m):
                matrix[s, i, :, s, i] += propagators[i]
                for t, share in enumerate(turn[s] if i == m - 1 else np.eye(r)[s]):
                    matrix[s, i, :, t, (i + 1) % m] -= share * one
        return matrix.reshape(r * m * k, r * m * k)

    def _evaluate(self, z: np.ndarray) -> CriticalEquations:
        base, (m, n), point, w = self.base, self.base.phase.shape, self.solution(z), self.vectors(z)
        rows = w[: m * n].reshape(m, n) if self.is_fold else w.reshape(-1, len(self.left))
        image, values = self._image(point, rows), {**base.values(point), **self.seeds}
        states, deviations = [*self.lift.states], [*self.lift.deviations]
        moved = self.left @ image.propagators[:, deviations][:, :, states] @ self.copies
        by_time = self.flow.rates(values, image.states)[:, deviations] @ self.left.T / m
        columns = self.left @ image.columns[:, deviations] + by_time[:, :, None] * base.period_slopes(
            base.values(point)
        )
        by_cosine = np.zeros(len(w))
        if self.is_fold:
            matrix, residual, jacobian = self._bordered(point)
            if not base.periods:
                # A change tau of the period moves the end by f tau/m: the derivatives of f along those of the end.
                ends, tau = image.states[:, states], w[-1] * self.units[-1] / m
                rates = self.flow.rates(values, image.states)[:, states]
                ahead = np.concatenate([image.propagators[:, states][:, :, states], rates[:, :, None] / m], axis=2)
                for i, end in enumerate(ends):
                    along = self.flow.rates(values, self._both(np.tile(end, (n + 1, 1)), ahead[i].T))
                    along = tau * along[:, deviations] / self.scale
                    moved[i] += along[:n].T
                    by_time[i] += along[n]
                    for j, name in enumerate(self.names):
                        seeds = {self.lift.seeds[name]: 1.0} if name in self.lift.seeds else {}
                        both = self._both(end[None], image.columns[i, states, j])
                        columns[i, :, j] += tau * self.flow.rates({**values, **seeds}, both)[0, deviations] / self.scale
        else:
            residual, jacobian = base.linearise(point)
            sign = -1.0 if self.kind_of_points is BifurcationKind.PERIOD_DOUBLING else 1.0
            turn, by = np.full((1, 1), sign), np.zeros((1, 1))
            if self.is_pair:
                c = self.number(z)
                turn, by = np.array([[c, -1.0], [1.0 - c * c, c]]), np.array([[1.0, 0.0], [-2.0 * c, 1.0]])
            matrix = self._cyclic(self._own(image)[:m], turn)
            ends = by_cosine.reshape(len(turn), m, -1)
            ends[:, -1] = -by @ w.reshape(len(turn), m, -1)[:, 0]
        bent = np.zeros((len(w), len(point)))
        for i, (block, time, column) in enumerate(zip(moved, by_time, columns, strict=True)):
            k, s = len(block), i % m
            bent[i * k : i * k + k, s * n : s * n + n] = block
            bent[i * k : i * k + k, -2:] = column
            if not base.periods:
                bent[i * k : i * k + k, self.size - 1] = time
        return CriticalEquations(residual, jacobian, matrix, bent, by_cosine)

    def _errors(self, z: np.ndarray) -> np.ndarray:
        w = self.vectors(z)
        return np.full(len(w) + 1 + self.is_pair, TOLERANCE * max(1.0, float(np.abs(w).max())))

    def critical_values(self, number: float) -> list[complex]:
        """Return 1, -1, or the pair with a cosine on the unit circle; beyond it that of a neutral saddle."""
        root = 1j * complex(np.emath.sqrt(1.0 - number**2))
        if self.is_pair:
            return [number + root, number - root]
        return [-1.0 if self.kind_of_points is BifurcationKind.PERIOD_DOUBLING else 1.0]

    def tests(self) -> Mapping[str, Test]:
        """Return the test functions of points of codimension two."""
        if self.is_pair:
            return {
                "1:3 resonance": lambda point: self.number(point.z) + 0.5,
                "1:4 resonance": lambda point: self.number(point.z),
            }
        return {"cusp": self.cusp} if self.is_fold else {}

    def limits(self) -> Mapping[str, Test]:
        """Return functions that are positive on the curve; it ends where one is zero."""

        def amplitude(point: Point) -> float:
            """Return the motion along that of the last point: a cycle that shrinks onto an equilibrium turns it round."""
            return float(np.sum(self._motion(self.point) * self._motion(point.z)))

        ends: dict[str, Test] = {}
        if self.is_pair:
            ends |= {
                "1:1 resonance": lambda point: 1.0 - self.number(point.z),
                "1:2 resonance": lambda point: 1.0 + self.number(point.z),
            }
        if not self.base.periods:
            ends[""] = amplitude
        return ends

    def origin(self, z: np.ndarray) -> str:
        """Name the point at which the cycles shrink onto a Hopf point, by the multiplier that is critical there."""
        if self.is_fold:
            return "Bautin"
        return "zero-Hopf" if abs(self.critical_values(self.number(z))[0] - 1.0) < AT_ONE else "double Hopf"

    def _motion(self, z: np.ndarray) -> np.ndarray:
        """Return the rates (m, n) in the frame of the shifts, in units of the extents."""
        base, point = self.base, self.solution(z)
        m, n = base.phase.shape
        frame = base.shifts @ point[m * n : m * n + base.shifts.shape[1]] / base.period(point)
        return np.asarray((base.flow.rates(base.values(point), base.states(point)) - frame) / base.scale)

    def passing(self, value: complex) -> str:
        """Name the point at which another multiplier passes; real if its imaginary part is zero."""
        other = self.base.kind(value, turned=True)
        if other is self.kind_of_points and not self.of_differences and not self.is_pair:
            return "1:1 resonance" if self.is_fold else "1:2 resonance"
        return f"{self.kind_of_points} with {other}"

    def frequency(self, z: np.ndarray) -> float:
        """Return the angular frequency of the second oscillation at a torus point, 0 elsewhere."""
        return math.acos(min(1.0, max(-1.0, self.number(z)))) / self.period(z) if self.is_pair else 0.0

    def period(self, z: np.ndarray) -> float:
        """Return the period of the cycle."""
        return self.base.period(self.solution(z))

    def state(self, z: np.ndarray) -> np.ndarray:
        """Return the state of the network at the beginning of a period."""
        base = self.base
        states = base.states(self.solution(z))
        return np.asarray(expansion(base.scene.equations, base.classes, base.flow.size) @ states[0])
