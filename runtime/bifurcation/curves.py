"""Curves of folds and Hopf points of equilibria in two parameters, as problems that `arclength` follows.

With y = (x, s), the state and the speeds of the shifts, F(y, q, p) = 0 the equations of equilibria and K their Jacobian:

* folds: z = (y, w, q, p) with F = 0, K w = 0 and one entry of w equal to 1;
* Hopf points: z = (y, a, u, k, q, p) with F = 0, J a = M u, J u = -k M a, k = omega^2, where one entry of a is 1 and that
  entry of u is 0.  At a Bogdanov-Takens point k passes zero, and the curve goes on as one of neutral saddles.

All entries of the Jacobians are exact: r_xx v and r_xp v by derivatives of the templates along v.  Points of
codimension two are zeros of test functions along the curve:

| point | on folds | on Hopf points |
|---|---|---|
| cusp | u r_xx v v | |
| Bogdanov-Takens | u M v | k; the curve ends |
| Bautin (generalised Hopf) | | first Lyapunov coefficient |
| zero-Hopf | a pair passes | a real eigenvalue passes |
| double Hopf | | a pair passes |

Here u and v are the left and right null vectors.

Source: Kuznetsov, Elements of Applied Bifurcation Theory, 3rd ed. (Springer, 2004), sections 8.1 and 10.3.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cached_property

import numpy as np
from scipy import sparse

from synchain.models.inputs.checks import check_keys, check_table, listed

from .arclength import FIRST_STEP, LARGEST_STEP, MOST, Limits, Point, correct, walk
from .detection import REAL, BranchStep
from .equilibria import Equilibria
from .equilibrium import Equilibrium, resting_equations
from .kinds import BifurcationKind
from .linearised import Linearised
from .normal_forms import first_lyapunov_coefficient
from .problems import BranchProblem, GrowthNumbers, Matrix
from .results import Bifurcation, Curve, CurvePoint, digits_of

Test = Callable[[Point], float]
"""A function of a point of a curve that is zero at a point of codimension two."""

NOISE = 1e-13
"""Residual of the equations of eigenvectors that counts as zero, relative to their terms (a choice)."""


class EigenvectorCurve:
    """What curves of folds and of Hopf points share: the equilibrium, and derivatives along a vector."""

    kinked = False

    kind_of_points: BifurcationKind

    def __init__(self, base: Equilibria, vector: np.ndarray, frequency: float = 0.0) -> None:
        self.base, self.names = base, base.names
        self.size = base.size + len(base.shifts)  # unknowns of the equilibrium
        self.frequency = frequency
        self.place = int(np.abs(vector[: base.size]).argmax())
        vector = vector / vector[self.place]
        self.point = self._first(vector)
        self.weights = np.zeros(len(self.point))
        self._weigh()

    def _first(self, vector: np.ndarray) -> np.ndarray:
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

    def others(self, z: np.ndarray, taken: list[complex]) -> GrowthNumbers:
        """Return the eigenvalues without those that are critical on the whole curve."""
        critical = self.base.critical(self.equilibrium(z))
        kept = np.arange(len(critical.values))
        for value in taken:
            kept = np.delete(kept, np.abs(critical.values[kept] - value).argmin())
        return GrowthNumbers(critical.growth[kept], critical.values[kept], critical.blocks[kept])

    def frequency_at(self, point: Point) -> float:
        """Return the frequency of a Hopf point, 0 of a fold."""
        return float(np.sqrt(max(point.z[-3], 0.0))) if self.frequency else 0.0

    def kind(self, value: complex, turned: bool) -> BifurcationKind:
        """Return the kind of all points of the curve."""
        return self.kind_of_points


class FoldCurve(EigenvectorCurve):
    """Folds, or branch points, of equilibria: z = (y, w, q, p)."""

    kind_of_points = BifurcationKind.FOLD
    reference: np.ndarray | None = None  # (states,): left null vector of the last point

    def _first(self, vector: np.ndarray) -> np.ndarray:
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
        return self.others(z, [0.0])

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


class HopfCurve(EigenvectorCurve):
    """Hopf points of equilibria: z = (y, a, u, k, q, p) with k = omega^2; beyond a Bogdanov-Takens point k < 0."""

    kind_of_points = BifurcationKind.HOPF

    def _first(self, vector: np.ndarray) -> np.ndarray:
        # J (a + i b) = i omega M (a + i b), u = -omega b.
        point, square = self.base.point, self.frequency**2
        return np.concatenate([point[:-2], vector.real, -self.frequency * vector.imag, [square], point[-2:]])

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
        return self.others(z, [root, -root])

    def vector(self, point: Point) -> np.ndarray:
        """Return the eigenvector (states,) at a point."""
        size, states = self.size, self.base.size
        u = point.z[size + states : size + 2 * states]
        return np.asarray(point.z[size : size + states] - 1j * u / self.frequency_at(point))

    def tests(self) -> Mapping[str, Test]:
        """Return the test functions of points of codimension two."""

        def bautin(point: Point) -> float:
            z = self.equilibrium(point.z)
            return first_lyapunov_coefficient(self.base, z, self.vector(point), self.frequency_at(point))

        return {"Bautin": bautin}


def _small_dense(matrix: sparse.csc_array) -> Matrix:
    """Return a matrix in dense form if it is small: sparse factors would spend their time in Python."""
    return matrix.toarray() if matrix.shape[0] <= 200 else sparse.csc_array(matrix)


def codimension_two(
    problem: BranchProblem, before: Point, after: Point, length: float
) -> list[tuple[float, object]] | None:
    """Return the points of codimension two on a step of a curve with their distances; None if it is too long."""
    if not isinstance(problem, FoldCurve | HopfCurve):
        raise TypeError("points of codimension two belong to curves")
    try:
        return sorted(_points(problem, BranchStep(problem, before, after, length)), key=lambda pair: pair[0])
    except ArithmeticError:
        return None


def _points(problem: FoldCurve | HopfCurve, step: BranchStep) -> Iterator[tuple[float, CurvePoint]]:
    """Yield the points of codimension two, and those at which a parameter is extreme, in any order."""

    def point(kind: str, distance: float) -> tuple[float, CurvePoint]:
        at = step.at(distance)
        return distance, CurvePoint(
            kind, (float(at.z[-2]), float(at.z[-1])), at.z[: problem.base.size], problem.frequency_at(at)
        )

    ends = step.before, step.after
    if isinstance(problem, HopfCurve) and ends[1].z[-3] <= 0.0:  # what follows are neutral saddles
        distance = step.zero(lambda at: float(at.z[-3]))
        yield point("Bogdanov-Takens", distance)
        return
    for name, test in problem.tests().items():
        one, other = map(test, ends)
        if one * other < 0.0:
            yield point(name, step.zero(test))
    for place, name in zip((-2, -1), problem.names, strict=True):
        if ends[0].tangent[place] * ends[1].tangent[place] < 0.0:
            yield point(f"extreme {name}", step.zero(lambda at, place=place: float(at.tangent[place])))  # type: ignore[misc]
    counts = sorted(at.critical.growing for at in ends if at.critical is not None)
    index = counts[0]
    while index < counts[1]:
        distance = step.zero_of_growth(index)
        critical = problem.critical(step.at(distance).z)
        paired = abs(critical.values[index].imag) > REAL * critical.scale
        if paired or isinstance(problem, HopfCurve):
            yield point("double Hopf" if paired and isinstance(problem, HopfCurve) else "zero-Hopf", distance)
        index += 2 if paired else 1


def follow_curve(
    first: Bifurcation,
    names: tuple[str, str],
    within: Mapping[str, tuple[float, float]] | None,
    signs: tuple[float, ...],
    largest_step: float | None,
) -> Curve:
    """Follow a fold or Hopf point of equilibria in two parameters, as `follow` does."""
    solution = first.solution
    if not isinstance(solution, Equilibrium) or first.kind not in (BifurcationKind.FOLD, BifurcationKind.HOPF):
        raise ValueError(f"follow: found a {first.kind} in two parameters; expected a fold or Hopf point of equilibria")
    scene = solution.scene
    if len(set(names)) < 2:
        raise ValueError(f"follow: found {names!r}; expected two different parameters")
    known = scene.equations.parameters
    if strange := next((name for name in names if name not in known), None):
        raise ValueError(f"follow: unknown parameter {strange!r}; known: {listed(known)}")
    within = {} if within is None else within
    check_keys("within", check_table("within", within), names)
    if not within:
        raise ValueError(f"follow: found no bounds; expected within={{{names[1]!r}: (…, …)}}")
    bounds, sizes = [], []
    for name in names:
        low, high = within.get(name, (-np.inf, np.inf))
        value = scene.parameters[name]
        if not low <= value <= high:
            raise ValueError(f"within: found {name} = {value:g} outside; expected it between {low:g} and {high:g}")
        bounds.append((float(low), float(high)))
        sizes.append(float(high - low))
    largest = (
        LARGEST_STEP
        if largest_step is None
        else largest_step / (sizes[1] if np.isfinite(sizes[1]) else abs(scene.parameters[names[1]]) or 1.0)
    )
    limits = Limits(bounds, MOST, min(FIRST_STEP, largest), largest)
    parts = [_part(first, solution, names, np.array(sizes), sign, limits) for sign in signs]
    points, special, ends = parts[-1]
    both: tuple[str, ...] = (ends,)
    if len(parts) == 2:
        behind, special_behind, end_behind = parts[0]
        points, special = behind[:0:-1] + points, special_behind[::-1] + special
        both = (end_behind, ends)
    rows = np.array([point.z for point in points])
    return Curve(
        scene,
        first.kind,
        names,
        rows[:, -2:],
        rows[:, : len(solution.state)],
        np.sqrt(rows[:, -3]) if first.kind is BifurcationKind.HOPF else np.zeros(len(rows)),
        np.array([0 if point.critical is None else point.critical.growing for point in points]),
        tuple(special),
        both,
    )


def _part(
    first: Bifurcation,
    solution: Equilibrium,
    names: tuple[str, str],
    sizes: np.ndarray,
    sign: float,
    limits: Limits,
) -> tuple[list[Point], list[CurvePoint], str]:
    """Follow a curve in one direction; return its points, the special ones and how it ends."""
    equations = resting_equations("follow", solution.scene)
    base = Equilibria(solution.scene, equations, names, solution.state, solution.shifts, solution.speeds)
    base.set_ranges(sizes)
    if not base.network.constant_mass:
        raise ValueError(
            "follow: found a mass matrix that depends on the state; expected constant masses for a curve in two parameters"
        )
    problem: FoldCurve | HopfCurve
    if first.kind is BifurcationKind.HOPF:
        problem = HopfCurve(base, first.vectors[0], first.frequency)
    else:
        problem = FoldCurve(base, first.vectors[0])
    along = np.zeros(len(problem.point))
    along[-1] = sign / problem.weights[-1]
    point = correct(problem, problem.point, along)
    if point is None:
        raise ArithmeticError(f"follow: found no {first.kind} near `first`; it may have more than one critical vector")
    z, tangent = problem.accept(point.z, point.tangent)
    start = replace(point, z=z, tangent=tangent, critical=problem.critical(z))
    points, special = [start], list[CurvePoint]()
    steps = walk(problem, start, limits, codimension_two)
    while True:
        try:
            each = next(steps)
        except StopIteration as end:
            return points, special, end.value
        if isinstance(each, CurvePoint):
            special.append(each)
            if each.kind == "Bogdanov-Takens" and isinstance(problem, HopfCurve):
                return points, special, f"Bogdanov-Takens at {digits_of(each.values)}"
        elif isinstance(each, Point):
            points.append(each)
