"""Curves of folds and Hopf points of equilibria in two parameters.

With y = (x, s), the state and the speeds of the shifts, and K the Jacobian of the equations by y:

* folds: K w = 0;
* Hopf points: J a = M u, J u = -k M a, k = omega^2.  At a Bogdanov-Takens point k passes zero, and the curve goes on as
  one of neutral saddles.

All entries of the Jacobians are exact: r_xx v and r_xp v by derivatives of the templates along v.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property

import numpy as np
from scipy import sparse

from .arclength import Point, Test
from .critical_curve import CriticalCurve, CriticalEquations
from .equilibria import Equilibria
from .equilibrium import Equilibrium, resting_equations
from .linearised import Linearised
from .normal_forms import first_lyapunov_coefficient
from .results import Bifurcation

NOISE = 1e-13  # residual of the equations of eigenvectors that counts as zero, relative to their terms (a choice)


class EquilibriumCurve(CriticalCurve):
    """Folds or Hopf points of equilibria."""

    base: Equilibria

    def __init__(self, first: Bifurcation, rest: Equilibrium, names: tuple[str, str], ranges: np.ndarray) -> None:
        equations = resting_equations("follow", rest.scene)
        super().__init__(Equilibria(rest.scene, equations, names, rest.state, rest.shifts, rest.speeds), first.kind)
        self.base.set_ranges(ranges)
        if not self.base.network.constant_mass:
            raise ValueError(
                "follow: found a mass matrix that depends on the state; expected constant masses for a curve in two parameters"
            )
        self.point = np.insert(self.point, self.size, self._inner(first.vectors[0], first.frequency))

    @cached_property
    def along(self) -> tuple[Linearised, list[Linearised]]:
        """Derivatives along a vector of the rates, and of their derivatives by both parameters."""
        return self.base.network.along(1), [each.along(1) for each in self.base.by_parameters]

    def _inner(self, vector: np.ndarray, frequency: float) -> np.ndarray:
        """Return w, or (a, u, k), of an eigenvector (states,)."""
        self.place = int(np.abs(vector).argmax())
        vector = vector / vector[self.place]
        if self.is_pair:  # J (a + i b) = i omega M (a + i b), u = -omega b
            return np.concatenate([vector.real, -frequency * vector.imag, [frequency**2]])
        return np.append(vector.real, np.zeros(self.size - len(vector)))

    def _vectors_at(self, point: np.ndarray, number: float) -> np.ndarray:
        frequency = math.sqrt(max(number, 0.0))
        return self._inner(self.base.vectors(point, 1j * frequency, 1)[:, 0], frequency)

    def _evaluate(self, z: np.ndarray) -> CriticalEquations:
        base, point, w = self.base, self.solution(z), self.vectors(z)
        residual, jacobian = base.linearise(point)
        state, _, values = base.split(point)
        rates, by_parameters = self.along

        def second(vector: np.ndarray) -> sparse.csc_array:
            """Return the derivatives (states, n + 2) of J v by y and both parameters."""
            both = np.append(state, vector)
            mixed = np.column_stack([each.rates(both) for each in base.slopes_at(values, by_parameters)])
            curvature = rates.at(values).jacobian(both)
            curvature.resize(base.size, self.size)
            return sparse.hstack([curvature, sparse.csc_array(mixed)], format="csc")

        if not self.is_pair:
            matrix, bent, by_number = jacobian[:, : self.size], second(w[: base.size]), np.zeros(len(w))
            bent.resize(self.size, self.size + 2)
        else:
            # J a - M u = 0 and J u + k M a = 0.
            network, (a, u), k = base.network.at(values), np.split(w, 2), self.number(z)
            slopes, mass = network.jacobian(state), network.mass(state)
            heavy = sparse.eye_array(base.size, format="csc") if mass is None else mass
            matrix = sparse.block_array([[slopes, -heavy], [k * heavy, slopes]], format="csc")
            bent, by_number = sparse.vstack([second(a), second(u)]), np.append(np.zeros(base.size), heavy @ a)
            by_mass = [] if mass is None else [each.mass(state) for each in base.slopes_at(values, base.by_parameters)]
            moved = [np.zeros(len(w)) if m is None else np.append(-(m @ u), k * (m @ a)) for m in by_mass]
            if moved:
                bent = bent + sparse.hstack([sparse.csc_array((len(w), self.size)), np.column_stack(moved)])
        if isinstance(jacobian, np.ndarray):
            matrix, bent = (each if isinstance(each, np.ndarray) else each.toarray() for each in (matrix, bent))
        return CriticalEquations(residual, jacobian, matrix, bent, by_number)

    def _errors(self, z: np.ndarray) -> np.ndarray:
        matrix = abs(self.equations(z).matrix)
        fixed = [1.0, float(matrix.max())][: 1 + self.is_pair]
        return NOISE * np.append(matrix @ np.abs(self.vectors(z)), fixed)

    def critical_values(self, number: float) -> list[complex]:
        """Return 0, the pair on the imaginary axis, or the neutral pair of a saddle."""
        root = complex(np.emath.sqrt(-number))
        return [root, -root] if self.is_pair else [0.0]

    def tests(self) -> Mapping[str, Test]:
        """Return the test functions of points of codimension two."""

        def takens(point: Point) -> float:
            state, _, values = self.base.split(self.solution(point.z))
            mass, v = self.base.network.at(values).mass(state), self.vectors(point.z)[: self.base.size]
            return float(self.left_null(point.z)[: self.base.size] @ (v if mass is None else mass @ v))

        def bautin(point: Point) -> float:
            (a, u), frequency = np.split(self.vectors(point.z), 2), self.frequency(point.z)
            z, others = self.solution(point.z), self.critical(point.z)
            coefficient = first_lyapunov_coefficient(self.base, z, a - 1j * u / frequency, frequency)
            # At a zero-Hopf point the coefficient has a pole. A factor that passes zero there, as det J does, removes it.
            distance = np.abs(others.values).min() if len(others.values) else 1.0
            return float((-1.0) ** (others.growth > 0.0).sum() * distance * coefficient)

        return {"cusp": self.cusp, "Bogdanov-Takens": takens} if self.is_fold else {"Bautin": bautin}

    def limits(self) -> Mapping[str, Test]:
        """Return the function of Hopf points beyond whose zero lie neutral saddles."""
        return {"Bogdanov-Takens": lambda point: self.number(point.z)} if self.is_pair else {}

    def passing(self, value: complex) -> str:
        """Name the point at which another eigenvalue passes; a single one passes a fold at the points of `tests`."""
        if self.is_fold:
            return "zero-Hopf" if value.imag else ""
        return "double Hopf" if value.imag else "zero-Hopf"

    def frequency(self, z: np.ndarray) -> float:
        """Return the angular frequency of a Hopf point, 0 of a fold."""
        return math.sqrt(max(self.number(z), 0.0))

    def state(self, z: np.ndarray) -> np.ndarray:
        """Return the state of the network."""
        return z[: self.base.size]
