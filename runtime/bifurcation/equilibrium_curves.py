"""Curves of folds and Hopf points of equilibria in two parameters, as problems that `arclength` follows.

With y = (x, s), the state and the speeds of the shifts, F(y, q, p) = 0 the equations of equilibria and K their Jacobian:

* folds: z = (y, w, q, p) with F = 0, K w = 0 and one entry of w equal to 1;
* Hopf points: z = (y, a, u, k, q, p) with F = 0, J a = M u, J u = -k M a, k = omega^2, where one entry of a is 1 and that
  entry of u is 0.  At a Bogdanov-Takens point k passes zero, and the curve goes on as one of neutral saddles.

All entries of the Jacobians are exact: r_xx v and r_xp v by derivatives of the templates along v.

Source: Kuznetsov, Elements of Applied Bifurcation Theory, 3rd ed. (Springer, 2004), sections 8.1 and 10.3.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np
from scipy import sparse

from .arclength import Point, Test
from .equilibria import Equilibria
from .equilibrium import Equilibrium, resting_equations
from .kinds import BifurcationKind
from .linearised import Linearised
from .normal_forms import first_lyapunov_coefficient
from .problems import GrowthNumbers, Matrix
from .results import Bifurcation

NOISE = 1e-13
"""Residual of the equations of eigenvectors that counts as zero, relative to their terms (a choice)."""


class EigenvectorCurve:
    """What curves of folds and of Hopf points share: the equilibrium, and derivatives along a vector."""

    kinked = False

    kind_of_points: BifurcationKind

    def __init__(self, first: Bifurcation, rest: Equilibrium, names: tuple[str, str], ranges: np.ndarray) -> None:
        equations = resting_equations("follow", rest.scene)
        self.base = base = Equilibria(rest.scene, equations, names, rest.state, rest.shifts, rest.speeds)
        base.set_ranges(ranges)
        if not base.network.constant_mass:
            raise ValueError(
                "follow: found a mass matrix that depends on the state; expected constant masses for a curve in two parameters"
            )
        self.names = base.names
        self.size = base.size + len(base.shifts)  # unknowns of the equilibrium
        vector = first.vectors[0]
        self.place = int(np.abs(vector[: base.size]).argmax())
        self.point = self._first(vector / vector[self.place], first.frequency)
        self.weights = np.zeros(len(self.point))
        self._weigh()

    def _first(self, vector: np.ndarray, frequency: float) -> np.ndarray:
        raise NotImplementedError

    @cached_property
    def along(self) -> tuple[Linearised, list[Linearised]]:
        """Derivatives along a vector of the rates, and of their derivatives by both parameters."""
        return self.base.network.along(1), [each.along(1) for each in self.base.by_parameters]

    def equilibrium(self, z: np.ndarray) -> np.ndarray:
        """Return the unknowns (y, q, p) of the equilibrium at a point of the curve."""
        return np.append(z[: self.size], z[-2:])

    def _weigh(self) -> None:
        """Measure lengths by states and parameters; vectors follow from these."""
        weights = self.base.weights
        self.weights[: self.size], self.weights[-2:] = weights[:-2], weights[-2:]

    def accept(self, z: np.ndarray, tangent: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Make a point the reference: pin the shifts there."""
        self.point = z
        self.base.accept(self.equilibrium(z), self.equilibrium(tangent))
        self._weigh()
        return z, tangent / float(np.linalg.norm(self.weights * tangent))

    def parts(self, z: np.ndarray) -> tuple[np.ndarray, sparse.csc_array, Linearised, dict[str, float], np.ndarray]:
        """Return residual and Jacobian of the equilibrium, network, values of parameters and state."""
        point = self.equilibrium(z)
        residual, matrix = self.base.linearise(point)
        state, _, values = self.base.split(point)
        return residual, sparse.csc_array(matrix), self.base.network.at(values), values, state

    def second(
        self, values: Mapping[str, float], state: np.ndarray, vector: np.ndarray
    ) -> tuple[Matrix, list[np.ndarray]]:
        """Return r_xx v, and r_xp v for both parameters, at a state and a vector v."""
        network, by_parameters = self.along
        both = np.append(state, vector)
        return network.at(values).jacobian(both), [each.at(values).rates(both) for each in by_parameters]

    def kind(self, value: complex, turned: bool) -> BifurcationKind:
        """Return the kind of all points of the curve."""
        return self.kind_of_points

    def limits(self) -> Mapping[str, Test]:
        """Return functions that are positive on the curve; it ends where one is zero."""
        return {}

    def frequency(self, z: np.ndarray) -> float:
        """Return the frequency of a Hopf point, 0 of a fold."""
        return 0.0

    def period(self, z: np.ndarray) -> float:
        """Return 0: equilibria have no period."""
        return 0.0

    def state(self, z: np.ndarray) -> np.ndarray:
        """Return the state of the network."""
        return z[: self.base.size]


class FoldCurve(EigenvectorCurve):
    """Folds, or branch points, of equilibria: z = (y, w, q, p)."""

    kind_of_points = BifurcationKind.FOLD
    reference: np.ndarray | None = None  # (states,): left null vector of the last point

    def _first(self, vector: np.ndarray, frequency: float) -> np.ndarray:
        point = self.base.point
        return np.concatenate([point[:-2], vector.real, np.zeros(len(self.base.shifts)), point[-2:]])

    def linearise(self, z: np.ndarray) -> tuple[np.ndarray, Matrix]:
        """Return the residual and its derivatives."""
        residual, matrix, _, values, state = self.parts(z)
        size, states, w = self.size, self.base.size, z[self.size : 2 * self.size]
        bordered = matrix[:, :size]
        curvature, mixed = self.second(values, state, w[:states])
        columns = np.zeros((size, 2))
        columns[:states] = np.transpose(mixed)
        bent = sparse.block_diag([curvature, sparse.csc_array((size - states,) * 2)])
        unit = sparse.csc_array(([1.0], ([0], [self.place])), (1, size))
        full = sparse.block_array(
            [[bordered, None, matrix[:, size:]], [bent, bordered, sparse.csc_array(columns)], [None, unit, None]],
            format="csc",
        )
        return np.concatenate([residual, bordered @ w, [w[self.place] - 1.0]]), _small_dense(full)

    def noise(self, z: np.ndarray) -> np.ndarray:
        """Return the rounding errors of the equations."""
        _, matrix, *_ = self.parts(z)
        sizes = abs(matrix[:, : self.size]) @ np.abs(z[self.size : 2 * self.size])
        return np.concatenate([self.base.noise(self.equilibrium(z)), NOISE * sizes, [NOISE]])

    def critical(self, z: np.ndarray) -> GrowthNumbers:
        """Return the eigenvalues but zero."""
        return self.base.critical(self.equilibrium(z)).without([0.0])

    def left(self, z: np.ndarray) -> np.ndarray:
        """Return the left null vector (states,), in the direction of that of the last point."""
        _, matrix, *_ = self.parts(z)
        u = np.linalg.svd(matrix[:, : self.size].toarray())[0][: self.base.size, -1]
        return u if self.reference is None or u @ self.reference > 0.0 else -u

    def accept(self, z: np.ndarray, tangent: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pin the shifts and keep the direction of the left null vector."""
        self.reference = self.left(z)
        return super().accept(z, tangent)

    def tests(self) -> Mapping[str, Test]:
        """Return the test functions of points of codimension two."""

        def cusp(point: Point) -> float:
            *_, values, state = self.parts(point.z)
            v = point.z[self.size : self.size + self.base.size]
            curvature, _ = self.second(values, state, v)
            return float(self.left(point.z) @ (curvature @ v))

        def takens(point: Point) -> float:
            _, _, network, _, state = self.parts(point.z)
            mass, v = network.mass(state), point.z[self.size : self.size + self.base.size]
            return float(self.left(point.z) @ (v if mass is None else mass @ v))

        return {"cusp": cusp, "Bogdanov-Takens": takens}

    def passing(self, value: complex) -> str:
        """Name the point at which another eigenvalue passes; a single one passes at the Bogdanov-Takens points of `tests`."""
        return "zero-Hopf" if value.imag else ""


class HopfCurve(EigenvectorCurve):
    """Hopf points of equilibria: z = (y, a, u, k, q, p) with k = omega^2; beyond a Bogdanov-Takens point k < 0."""

    kind_of_points = BifurcationKind.HOPF

    def _first(self, vector: np.ndarray, frequency: float) -> np.ndarray:
        # J (a + i b) = i omega M (a + i b), u = -omega b.
        point = self.base.point
        return np.concatenate([point[:-2], vector.real, -frequency * vector.imag, [frequency**2], point[-2:]])

    def linearise(self, z: np.ndarray) -> tuple[np.ndarray, Matrix]:
        """Return the residual and its derivatives."""
        residual, matrix, network, values, state = self.parts(z)
        size, states, square = self.size, self.base.size, z[-3]
        a, u = z[size : size + states], z[size + states : size + 2 * states]
        jacobian, mass = network.jacobian(state), network.mass(state)
        heavy = sparse.eye_array(states, format="csc") if mass is None else mass
        by_mass = [each.at(values).mass(state) for each in self.base.by_parameters]
        rows, left = [], []
        # J a - M u = 0 and J u + k M a = 0: the factor of M, and its derivative by k.
        for v, other, factor, by_square in ((a, u, -1.0, 0.0), (u, a, square, 1.0)):
            curvature, mixed = self.second(values, state, v)
            left.append(jacobian @ v + factor * (heavy @ other))
            columns = [
                m if mass is None or by is None else m + factor * (by @ other)
                for m, by in zip(mixed, by_mass, strict=True)
            ]
            bent = sparse.hstack([curvature, sparse.csc_array((states, size - states))], format="csc")
            blocks = (jacobian, factor * heavy) if v is a else (factor * heavy, jacobian)
            last = np.column_stack([by_square * (heavy @ other), *columns])
            rows.append([bent, *blocks, sparse.csc_array(last)])
        unit = sparse.csc_array(([1.0], ([0], [self.place])), (1, states))
        parameters = sparse.hstack([sparse.csc_array((size, 1)), matrix[:, size:]], format="csc")
        first = [matrix[:, :size], sparse.csc_array((size, states)), None, parameters]
        full = sparse.block_array([first, *rows, [None, unit, None, None], [None, None, unit, None]], format="csc")
        scaled = [a[self.place] - 1.0, u[self.place]]
        return np.concatenate([residual, *left, scaled]), _small_dense(full)

    def noise(self, z: np.ndarray) -> np.ndarray:
        """Return the rounding errors of the equations."""
        _, matrix, *_ = self.parts(z)
        size, states = self.size, self.base.size
        jacobian = abs(matrix[:states, :states])
        a, u = np.abs(z[size : size + states]), np.abs(z[size + states : size + 2 * states])
        scale = float(jacobian.max())
        sizes = np.concatenate([jacobian @ a + u, jacobian @ u + abs(z[-3]) * a])
        return np.concatenate([self.base.noise(self.equilibrium(z)), NOISE * sizes, [NOISE, NOISE * scale]])

    def critical(self, z: np.ndarray) -> GrowthNumbers:
        """Return the eigenvalues but the pair on the imaginary axis, or the neutral pair of a saddle."""
        root = np.emath.sqrt(-z[-3])
        return self.base.critical(self.equilibrium(z)).without([root, -root])

    def tests(self) -> Mapping[str, Test]:
        """Return the test functions of points of codimension two."""

        def bautin(point: Point) -> float:
            (size, states), frequency = (self.size, self.base.size), self.frequency(point.z)
            a, u = point.z[size : size + states], point.z[size + states : size + 2 * states]
            z, others = self.equilibrium(point.z), self.critical(point.z)
            coefficient = first_lyapunov_coefficient(self.base, z, a - 1j * u / frequency, frequency)
            # At a zero-Hopf point the coefficient has a pole. A factor that passes zero there, as det J does, removes it.
            distance = np.abs(others.values).min() if len(others.values) else 1.0
            return float((-1.0) ** (others.growth > 0.0).sum() * distance * coefficient)

        return {"Bautin": bautin}

    def limits(self) -> Mapping[str, Test]:
        """Return a function that is positive on the curve: what follows its zero are neutral saddles."""
        return {"Bogdanov-Takens": lambda point: float(point.z[-3])}

    def passing(self, value: complex) -> str:
        """Name the point at which another eigenvalue passes."""
        return "double Hopf" if value.imag else "zero-Hopf"

    def frequency(self, z: np.ndarray) -> float:
        """Return the angular frequency."""
        return float(np.sqrt(max(z[-3], 0.0)))


def _small_dense(matrix: sparse.csc_array) -> Matrix:
    """Return a matrix in dense form if it is small: sparse factors would spend their time in Python."""
    return matrix.toarray() if matrix.shape[0] <= 200 else sparse.csc_array(matrix)
