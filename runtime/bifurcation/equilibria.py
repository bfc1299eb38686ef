"""Equilibria along a parameter, as a problem that `arclength` follows.

The unknowns are z = (x, s, p): state, speeds of the shifts, parameter.  The equations are r(x, p) = E s, where the
columns of E are the shifts, and x = x_ref at one node of each shifted component.  A shift makes an eigenvalue zero; these
are left out of the critical values.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from synchain.models.dynamics.equations import Equations
from synchain.models.dynamics.lift import derivative
from synchain.models.scenes.scene import Scene

from ..cells.run_keywords import with_numbers
from .arclength import Point
from .eigenvalues import DENSE, SMALL, ModeBlocks, eigenvalue_condition, eigenvalues
from .equilibrium import Equilibrium, bordered, fastest, resting_equations
from .kinds import BifurcationKind
from .linearised import Linearised
from .problems import GrowthNumbers, Matrix

NOISE = 1e-14  # residual that counts as zero, relative to the sizes of its terms: 45 rounding errors (a choice)
ROUNDING = 1e-12  # error of the Jacobian relative to its largest eigenvalue (a choice)
LEAST_SCALE = 0.1  # least scale of a component in lengths, relative to that of the largest component (a choice)
# Factor by which the scale of states near zero is lowered, and the ratio of rates at which it is low enough (a
# choice).
SHRINK = 64.0
# States that are smaller than this part of the scale are zero: at a turn they are known to the root of rounding (a
# choice).
ORIGIN = 1e-7
TINY = 1e-8  # a parameter without bounds that is smaller does not set its own length (a choice)


class Equilibria:
    """Equilibria of a network along one or two parameters, the last unknowns."""

    def __init__(
        self,
        scene: Scene,
        equations: Equations,
        names: tuple[str, ...],
        state: np.ndarray,
        shifts: tuple[str, ...],
        speeds: np.ndarray,
    ) -> None:
        self.scene, self.names, self.shifts = scene, names, shifts
        self.kinked = False
        self.size = len(state)
        self.values: Mapping[str, float] = dict(scene.parameters)
        self.network = Linearised.of(equations, self.values)
        slopes = [derivative(equations, name) for name in names]
        self.seeds = [seeds for _, seeds in slopes]
        self.by_parameters = [Linearised.of(slope, {**self.values, **seeds}) for slope, seeds in slopes]
        # Shifts: columns of ones, of which the first node is pinned.
        places = np.cumsum([0, *(len(equations.holders(name)) for name in equations.components)])
        self.first_of, self.ones = places[:-1], np.zeros((self.size, len(shifts)))
        for column, name in zip(self.ones.T, shifts, strict=True):
            column[slice(*places[equations.components.index(name) :][:2])] = 1.0
        self.pinned = self.ones.argmax(axis=0)
        self.leaders = np.arange(self.size)  # (states,): the state that each is kept equal to
        self.blocks = ModeBlocks.of(equations)
        self.point = np.concatenate([state, speeds, [self.values[name] for name in names]])
        self.component_scales = np.zeros(len(equations.components))
        self.ranges, self.unbounded = np.zeros(len(names)), np.full(len(names), True)
        self.weights = np.zeros(len(self.point))
        self.last: tuple[bytes, Linearised, list[Linearised]] = b"", self.network, self.by_parameters
        self._weigh()

    @classmethod
    def of(cls, rest: Equilibrium, *names: str) -> Equilibria:
        """Return the problem of an equilibrium along parameters."""
        return cls(rest.scene, resting_equations("follow", rest.scene), names, rest.state, rest.shifts, rest.speeds)

    def start(self, direction: np.ndarray) -> Point:
        """Return the reference with a tangent along a direction (states,)."""
        tangent = np.append(direction, np.zeros(len(self.point) - self.size))
        return Point(self.point, tangent / float(np.linalg.norm(self.weights * tangent)), 0)

    def unite(self, classes: tuple[int, ...]) -> None:
        """Keep the nodes of a cluster equal: where branches of other symmetries meet, the equations alone are singular.

        Their symmetry keeps a branch among such states (Golubitsky, Stewart & Schaeffer, section XIII.3).
        """
        first = [classes.index(each) for each in classes]
        components = np.arange(self.size).reshape(-1, len(classes))
        self.leaders = components[:, first].ravel()

    def set_ranges(self, ranges: np.ndarray) -> None:
        """Measure parameters by the lengths of their ranges; one without bounds, inf, by its largest value so far."""
        self.unbounded = ~np.isfinite(ranges)
        self.ranges = np.where(self.unbounded, 0.0, ranges)
        self._weigh()

    def _weigh(self) -> None:
        """Measure states by the largest of each component so far, and parameters by their ranges."""
        sizes = np.maximum.reduceat(np.abs(self.point[: self.size]), self.first_of)
        self.component_scales = np.maximum(self.component_scales, sizes)
        if not self.component_scales.any():  # at the origin states have no size yet
            self.component_scales += 1.0
        # Velocities of a network at rest are zero: their scale is a part of the others'.
        scales = np.maximum(self.component_scales, LEAST_SCALE * self.component_scales.max())
        counts = np.diff([*self.first_of, self.size])
        values = np.abs(self.point[len(self.point) - len(self.names) :])
        self.ranges = np.where(
            self.unbounded, np.maximum(self.ranges, np.where(values > TINY, values, 0.0)), self.ranges
        )
        self.weights = np.zeros(len(self.point))
        self.weights[: self.size] = 1.0 / (np.sqrt(self.size) * np.repeat(scales, counts))
        self.weights[len(self.weights) - len(self.names) :] = 1.0 / np.where(self.ranges > 0.0, self.ranges, 1.0)

    def scale_along(self, direction: np.ndarray) -> None:
        """Scale states near zero by the equations along a direction (states,) in which the branch leaves."""
        if not direction.any():
            return
        state, _, network, (by_parameter, *_) = self._at(self.point)
        unit, scale = direction / np.abs(direction).max(), 1.0
        rates, slope = network.rates(state), network.jacobian(state) @ unit
        shift, slope_shift = by_parameter.rates(state), by_parameter.jacobian(state) @ unit
        # The branch is where the nonlinear terms balance the change of the rates by the parameter: x^2 = r S^2 for
        # r x - x^3/S^2.  Further out the nonlinear terms are larger.
        while scale > np.finfo(float).tiny:
            change = self.ranges[0] * np.abs(shift + scale * slope_shift).max()
            with np.errstate(all="ignore"):
                nonlinear = np.abs(network.rates(state + scale * unit) - rates - scale * slope).max()
            if nonlinear <= SHRINK * change:
                break
            scale /= SHRINK
        else:  # the parameter changes no rate in this direction
            return
        if np.abs(state).max() <= ORIGIN * scale:
            self.component_scales[:] = scale
            self._weigh()

    def split(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray, dict[str, float]]:
        """Return state, speeds and the values of all parameters."""
        end = len(z) - len(self.names)
        chosen = dict(zip(self.names, map(float, z[end:]), strict=True))
        return z[: self.size], z[self.size : end], {**self.values, **chosen}

    def _at(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray, Linearised, list[Linearised]]:
        """Return state, speeds, and the equations with the parameters of z; the last ones are kept."""
        state, speeds, values = self.split(z)
        key = z[len(z) - len(self.names) :].tobytes()
        if self.last[0] != key:
            self.last = key, self.network.at(values), self.slopes_at(values, self.by_parameters)
        return state, speeds, *self.last[1:]

    def slopes_at(self, values: Mapping[str, float], by_parameters: list[Linearised]) -> list[Linearised]:
        """Return derivatives by each parameter with the values of all parameters."""
        return [each.at({**values, **seeds}) for each, seeds in zip(by_parameters, self.seeds, strict=True)]

    def linearise(self, z: np.ndarray) -> tuple[np.ndarray, Matrix]:
        """Return the remaining rates and pins, and their derivatives."""
        state, speeds, network, by_parameters = self._at(z)
        rates, columns = network.rates(state), np.zeros((self.size + len(speeds), len(by_parameters)))
        for k, each in enumerate(by_parameters):
            columns[: self.size, k] = each.rates(state)
        if not self.shifts and self.size <= SMALL:
            residual, matrix = rates, np.hstack([network.dense_jacobian(state), columns])
            entries = matrix
        else:
            residual = np.append(rates - self.ones @ speeds, state[self.pinned] - self.point[self.pinned])
            whole = sparse.hstack(
                [bordered(network.jacobian(state), self.ones), sparse.csc_array(columns)], format="csc"
            )
            entries, matrix = whole.data, whole.toarray() if self.size <= SMALL else sparse.csc_array(whole)
        if not (np.isfinite(residual).all() and np.isfinite(entries).all()):
            raise ArithmeticError("a rate or its slope has no value")
        followers = np.flatnonzero(self.leaders != np.arange(self.size))
        if len(followers):  # x_i - x_leader = 0 in units of rates
            unit, leaders = float(np.abs(entries).max()), self.leaders[followers]
            residual[followers] = unit * (state[followers] - state[leaders])
            equal = sparse.csc_array(
                (np.repeat([unit, -unit], len(followers)), (np.tile(followers, 2), np.append(followers, leaders))),
                matrix.shape,
            )
            kept = sparse.diags_array(np.isin(np.arange(len(residual)), followers, invert=True).astype(float))
            united = sparse.csc_array(kept @ sparse.csc_array(matrix) + equal)
            matrix = united.toarray() if isinstance(matrix, np.ndarray) else united
        return residual, matrix

    def noise(self, z: np.ndarray) -> np.ndarray:
        """Return the rounding errors of rates and pins."""
        state, speeds, network, _ = self._at(z)
        sizes = network.term_sizes(state)
        if not self.shifts:
            return NOISE * sizes
        return NOISE * np.append(sizes + self.ones @ np.abs(speeds), np.abs(state[self.pinned]))

    def accept(self, z: np.ndarray, tangent: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pin the shifts at a solution and measure lengths by it."""
        self.point = z
        self._weigh()
        return z, tangent / float(np.linalg.norm(self.weights * tangent))

    def critical(self, z: np.ndarray) -> GrowthNumbers:
        """Return the eigenvalues of M^-1 J without those of the shifts."""
        state, _, network, _ = self._at(z)
        jacobian, mass = network.jacobian(state), network.mass(state)
        found = self.blocks.values(jacobian) if self.blocks is not None else None
        numbers, modes = found or (eigenvalues(jacobian, mass), None)
        if self.shifts:
            others = np.argsort(np.abs(numbers), kind="stable")[len(self.shifts) :]
            numbers, modes = numbers[others], None if modes is None else modes[others]

        def condition(indices: np.ndarray) -> np.ndarray:
            """Return the condition of eigenvalues of the network, or of the blocks of their modes."""
            if self.blocks is not None and modes is not None:
                return np.array([self.blocks.condition(jacobian, modes[k], numbers[k]) for k in indices])
            if len(state) > DENSE:  # of the few eigenvalues nearest to zero none is known so well
                return np.zeros(len(indices))
            matrix = jacobian.toarray() if mass is None else np.linalg.solve(mass.toarray(), jacobian.toarray())
            return eigenvalue_condition(matrix, numbers[indices], np.abs(matrix))

        return GrowthNumbers.of(numbers.real, numbers, modes, ROUNDING, condition)

    def kind(self, value: complex, turned: bool) -> BifurcationKind:
        """Name a bifurcation by its eigenvalue."""
        if value.imag != 0.0:
            return BifurcationKind.HOPF
        return BifurcationKind.FOLD if turned else BifurcationKind.BRANCH_POINT

    def solution(self, point: Point) -> Equilibrium:
        """Return the equilibrium at a point."""
        state, speeds, values = self.split(point.z)
        scene = with_numbers(self.scene, {name: values[name] for name in self.names})
        # A shift makes an eigenvalue zero.
        critical = self.critical(point.z) if point.critical is None else point.critical
        numbers = np.append(critical.values, np.zeros(len(self.shifts)))
        numbers = numbers.astype(complex)[np.lexsort((-numbers.imag, -numbers.real))]
        residual = float(np.abs(self.linearise(point.z)[0]).max())
        return Equilibrium(scene, state, numbers, self.shifts, speeds, residual, point.corrections)

    def network_tangent(self, point: Point) -> np.ndarray:
        """Return the change of the states of the network, and of the parameters."""
        return np.append(point.tangent[: self.size], point.tangent[len(point.tangent) - len(self.names) :])

    def mode(self, block: int) -> str:
        """Describe a mode of the graph; empty if an eigenvalue belongs to none."""
        return "" if self.blocks is None or block < 0 else self.blocks.text(block)

    def vectors(self, z: np.ndarray, value: complex, count: int, block: int = -1) -> np.ndarray:
        """Return eigenvectors (states, count) of M^-1 J for an eigenvalue of some multiplicity, orthonormal."""
        state, _, network, _ = self._at(z)
        jacobian, mass = network.jacobian(state), network.mass(state)
        mass = sparse.eye_array(self.size, format="csc") if mass is None else mass
        # At zero the shifts are null vectors too: border the matrix, so that they are left out.
        shifted = jacobian if value else bordered(jacobian, self.ones)
        size, scale = shifted.shape[0], fastest(network, state) or abs(value) or 1.0
        heavy = sparse.block_diag([mass, sparse.csc_array((size - self.size,) * 2)], format="csc")
        # Inverse iteration beside the eigenvalue.
        matrix = sparse.csc_array(shifted - (value + 1e-10 * scale * (1.0 + 0.3j)) * heavy)
        solver = splu(matrix.astype(complex))
        basis = np.random.default_rng(0).normal(size=(size, count)).astype(complex)
        for _ in range(4):
            basis, _ = np.linalg.qr(solver.solve(heavy @ basis))
        basis, _ = np.linalg.qr(basis[: self.size])
        if value:
            return basis
        # A real null space: real vectors, the largest entry positive.
        real = np.linalg.svd(np.hstack([basis.real, basis.imag]), full_matrices=False)[0]
        return real[:, :count]
