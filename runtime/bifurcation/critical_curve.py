"""What curves of bifurcations in two parameters share, as problems that `arclength` follows.

With y the unknowns of an equilibrium or cycle and F(y, q, p) = 0 its equations, the unknowns are z = (y, w, q, p), with
F = 0, A w = 0 and one entry of the critical vector w equal to 1.  Where a pair of values is critical, they are
z = (y, a, u, k, q, p): A acts on both vectors w = (a, u) and depends on the number k, one entry of a is 1, and that entry
of u is 0.

Source: Kuznetsov, Elements of Applied Bifurcation Theory, 3rd ed. (Springer, 2004), sections 8.1 and 10.2 to 10.3.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy import sparse

from .arclength import Point, Test
from .kinds import BifurcationKind
from .problems import BranchProblem, GrowthNumbers, Matrix

# Largest entry of a critical vector, relative to the entry that is 1, before another entry is chosen (a choice).
LARGEST = 2.0


class CriticalEquations(NamedTuple):
    """F and A at a point of a curve, with their derivatives."""

    residual: np.ndarray  # (n,): F
    jacobian: Matrix  # (n, n + 2): of F by y and both parameters
    matrix: Matrix  # (r, r): A
    bent: Matrix  # (r, n + 2): of A w by y and both parameters
    by_number: np.ndarray  # (r,): of A w by the number of a pair


class CriticalCurve(ABC):
    """Bifurcations of one kind along two parameters, the last unknowns."""

    kinked = False

    def __init__(self, base: BranchProblem, kind: BifurcationKind, multiplicity: int = 1) -> None:
        self.base, self.names, self.kind_of_points, self.multiplicity = base, base.names, kind, multiplicity
        self.size = len(base.point) - 2  # unknowns of the equilibrium or cycle
        self.place = 0  # entry of w that is 1
        self.point = base.point
        self.reference: np.ndarray | None = None  # left null vector of the last fold
        self.last: tuple[bytes, CriticalEquations] | None = None

    @property
    def is_fold(self) -> bool:
        """Whether A is the Jacobian of F by y."""
        return self.kind_of_points is BifurcationKind.FOLD

    @property
    def is_pair(self) -> bool:
        """Whether a pair of values is critical."""
        return self.kind_of_points in (BifurcationKind.HOPF, BifurcationKind.TORUS)

    @property
    def weights(self) -> np.ndarray:
        """Lengths are those of `base`; the critical vectors follow from its unknowns."""
        return np.insert(self.base.weights, self.size, np.zeros(len(self.point) - self.size - 2))

    def solution(self, z: np.ndarray) -> np.ndarray:
        """Return the unknowns (y, q, p) of the equilibrium or cycle."""
        return np.append(z[: self.size], z[-2:])

    def vectors(self, z: np.ndarray) -> np.ndarray:
        """Return the critical vector w, or (a, u)."""
        return z[self.size : len(z) - 2 - self.is_pair]

    # --- equations ---
    @abstractmethod
    def _evaluate(self, z: np.ndarray) -> CriticalEquations: ...

    @abstractmethod
    def _errors(self, z: np.ndarray) -> np.ndarray:
        """Return the errors of A w, and of the fixed entries."""

    def equations(self, z: np.ndarray) -> CriticalEquations:
        """Return the equations at a point; the last ones are kept."""
        key = z.tobytes()
        if self.last is None or self.last[0] != key:
            self.last = key, self._evaluate(z)
        return self.last[1]

    def linearise(self, z: np.ndarray) -> tuple[np.ndarray, Matrix]:
        """Return the residual and its derivatives."""
        residual, jacobian, matrix, bent, by_number = self.equations(z)
        w, size = self.vectors(z), self.size
        ones = [self.place, self.place + len(w) // 2][: 1 + self.is_pair]
        number = by_number[:, None][:, : int(self.is_pair)]
        rows: list[list[Matrix | None]] = [
            [jacobian[:, :size], None, np.zeros((size, number.shape[1])), jacobian[:, size:]],
            [bent[:, :size], matrix, number, bent[:, size:]],
            [None, np.eye(len(w))[ones], None, None],
        ]
        return np.concatenate([residual, matrix @ w, w[ones] - np.eye(len(ones))[0]]), _stacked(rows)

    def noise(self, z: np.ndarray) -> np.ndarray:
        """Return the errors of the equations that count as zero."""
        return np.append(self.base.noise(self.solution(z)), self._errors(z))

    def accept(self, z: np.ndarray, tangent: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Make a point the reference; compute its vectors anew if `base` has other unknowns or the fixed entry is small."""
        inner, moved, uneven = z[self.size : -2], tangent[self.size : -2], np.abs(self.vectors(z)).max() > LARGEST
        point, ahead = self.base.accept(self.solution(z), self.solution(tangent))
        divided, self.size, self.last = len(point) - 2 != self.size, len(point) - 2, None
        if divided or uneven:
            inner = self._vectors_at(point, self.number(z))
            moved = np.zeros(len(inner))
        self.point, tangent = np.insert(point, self.size, inner), np.insert(ahead, self.size, moved)
        if self.is_fold:
            self.reference = self.left_null(self.point)
        return self.point, tangent / float(np.linalg.norm(self.weights * tangent))

    @abstractmethod
    def _vectors_at(self, point: np.ndarray, number: float) -> np.ndarray:
        """Compute w, or (a, u, k), at a solution; choose the entry that is 1."""

    # --- what happens along the curve ---
    def number(self, z: np.ndarray) -> float:
        """Return the number k of a pair; 0 for a single value."""
        return float(z[-3]) if self.is_pair else 0.0

    @abstractmethod
    def critical_values(self, number: float) -> list[complex]:
        """Return the critical value, or the pair of a number k."""

    def critical(self, z: np.ndarray) -> GrowthNumbers:
        """Return eigenvalues or multipliers without the critical ones."""
        return self.base.critical(self.solution(z)).without(self.critical_values(self.number(z)) * self.multiplicity)

    def kind(self, value: complex, turned: bool) -> BifurcationKind:
        """Return the kind of all points of the curve."""
        return self.kind_of_points

    def left_null(self, z: np.ndarray) -> np.ndarray:
        """Return the left null vector of A, in the direction of that of the last point."""
        matrix = self.equations(z).matrix
        u = np.linalg.svd(matrix if isinstance(matrix, np.ndarray) else matrix.toarray())[0][:, -1]
        return u if self.reference is None or len(self.reference) != len(u) or u @ self.reference > 0.0 else -u

    def cusp(self, point: Point) -> float:
        """Return u (A w)_y w, which is zero at a cusp."""
        curved = self.equations(point.z).bent[:, : self.size] @ (self.units * self.vectors(point.z))
        return float(self.left_null(point.z) @ curved)

    @property
    def units(self) -> np.ndarray | float:
        """The units of w as a change of y."""
        return 1.0

    @abstractmethod
    def tests(self) -> Mapping[str, Test]:
        """Return the test functions of points of codimension two."""

    def limits(self) -> Mapping[str, Test]:
        """Return functions that are positive on the curve; it ends where one is zero, at a point that `origin` names for ""."""
        return {}

    def origin(self, z: np.ndarray) -> str:
        """Name the point at which cycles shrink onto an equilibrium."""
        return ""

    @abstractmethod
    def passing(self, value: complex) -> str:
        """Name the point at which another value passes; real if its imaginary part is zero."""

    @abstractmethod
    def frequency(self, z: np.ndarray) -> float:
        """Return the angular frequency of the pair; 0 for a single value."""

    def period(self, z: np.ndarray) -> float:
        """Return the period of a cycle; 0 of an equilibrium."""
        return 0.0

    @abstractmethod
    def state(self, z: np.ndarray) -> np.ndarray:
        """Return the state of the network."""


def _stacked(rows: list[list[Matrix | None]]) -> Matrix:
    """Return the matrix of some blocks, zero where there is none."""
    if any(sparse.issparse(block) for row in rows for block in row):
        return sparse.csc_array(sparse.block_array(rows, format="csc"))
    heights = [next(block.shape[0] for block in row if block is not None) for row in rows]
    widths = [next(block.shape[1] for block in column if block is not None) for column in zip(*rows, strict=True)]
    filled = [
        [np.zeros((height, width)) if block is None else block for block, width in zip(row, widths, strict=True)]
        for row, height in zip(rows, heights, strict=True)
    ]
    return np.block(filled)
