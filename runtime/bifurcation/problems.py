"""What the continuation of equilibria, cycles and curves of bifurcations has in common.

A problem is a system of equations R(z) = 0 with one unknown more than equations, so that its solutions form curves.
The last unknown is the parameter.  `arclength` solves and follows any problem, `detection` finds the bifurcations.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol, TypeAlias

import numpy as np
from scipy import sparse

from .kinds import BifurcationKind

Matrix: TypeAlias = np.ndarray | sparse.csc_array


class GrowthNumbers(NamedTuple):
    """Eigenvalues or multipliers of a solution that decide its stability, without those that are always neutral."""

    growth: np.ndarray  # (k,): distance past neutrality, real part or |multiplier| - 1; the largest first
    values: np.ndarray  # (k,) complex, in the same order
    blocks: np.ndarray  # (k,): index of the mode of the graph; -1 if a value belongs to the whole network
    errors: np.ndarray  # (k,): growth that counts as zero

    @classmethod
    def of(
        cls,
        growth: np.ndarray,
        values: np.ndarray,
        blocks: np.ndarray | None,
        relative: float,
        condition: Callable[[np.ndarray], np.ndarray],
    ) -> GrowthNumbers:
        """Sort values by their growth; the members of a pair have equal growth and stay together.

        `relative` is the error of the matrices, and `condition` returns the factors (u,) by which the values at some
        indices (u,) magnify it: that of a conserved momentum is known to the root of rounding.
        """
        blocks = np.full(len(values), -1) if blocks is None else blocks
        scale = float(np.abs(values).max(initial=0.0)) or 1.0
        errors = np.full(len(values), relative * scale)
        unsure = np.flatnonzero((np.abs(growth) > errors) & (np.abs(growth) < UNSURE * scale))
        if len(unsure):
            errors[unsure] = np.clip(relative * condition(unsure), relative * scale, UNSURE * scale)
        order = np.lexsort((-values.imag, np.abs(values.imag), -growth))
        return cls(growth[order], values[order], blocks[order], errors[order])

    def without(self, values: list[complex]) -> GrowthNumbers:
        """Leave out the number that is nearest to each value."""
        kept = np.arange(len(self.values))
        for value in values:
            kept = np.delete(kept, np.abs(self.values[kept] - value).argmin())
        return GrowthNumbers(self.growth[kept], self.values[kept], self.blocks[kept], self.errors[kept])

    @property
    def scale(self) -> float:
        """Largest modulus of the values, the unit of their rounding errors."""
        return float(np.abs(self.values).max(initial=0.0)) or 1.0

    @property
    def signed(self) -> np.ndarray:
        """Growths (k,), the largest first; those that are zero to their errors count as decaying by the errors."""
        return -np.sort(-np.where(np.abs(self.growth) > self.errors, self.growth, -self.errors))

    @property
    def neutral(self) -> bool:
        """Whether a value is zero to its error."""
        return bool((np.abs(self.growth) <= self.errors).any())

    @property
    def growing(self) -> int:
        """Number of values past neutrality by more than their errors."""
        return int((self.growth > self.errors).sum())

    @property
    def counts(self) -> tuple[int, int]:
        """Least and largest number of growing values: real ones that are zero to their errors may grow.

        A neutral pair may not: where it meets and parts on the real axis a value passes.
        """
        unsure = (np.abs(self.growth) <= self.errors) & (np.abs(self.values.imag) <= REAL * self.scale)
        return self.growing, self.growing + int(unsure.sum())

    def passed(self, counts: tuple[int, int]) -> tuple[int, tuple[int, int]]:
        """Return how many values have passed zero beyond their errors since there were `counts`, and the counts now.

        A value that was never decaying, as of cycles that are just born, passes nowhere when its sign shows.
        """
        (low, high), (least, most) = counts, self.counts
        steps = sorted((least - low, most - high), key=abs)
        change = steps[0] if steps[0] * steps[1] > 0 else 0
        low, high = max(low + change, least), min(high + change, most)
        return change, ((low, high) if low <= high else self.counts)


# A value whose imaginary part is smaller, relative to the largest value, is real: the square root of rounding.
REAL = 1e-7
# Growth of which the error is estimated, relative to the largest value: a thousand roots of rounding, to which the
# error of a multiple eigenvalue is known (a choice).
UNSURE = 1e-6


class BranchProblem(Protocol):
    """Equations R(z) = 0 whose solutions form a curve; z ends with the parameters `names`."""

    names: tuple[str, ...]
    point: np.ndarray  # (size + 1,): the last accepted solution

    @property
    def weights(self) -> np.ndarray:
        """The metric (size + 1,): lengths are norms of `weights * dz`."""

    @property
    def kinked(self) -> bool:
        """True if the branch may have kinks, as under set-valued friction."""

    def linearise(self, z: np.ndarray) -> tuple[np.ndarray, Matrix]:
        """Return R (size,) and its derivative (size, size + 1); ArithmeticError where there is no value."""

    def noise(self, z: np.ndarray) -> np.ndarray:
        """Return for each equation the largest residual (size,) that counts as zero."""

    def accept(self, z: np.ndarray, tangent: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Make a solution the reference of the next ones; return it and its tangent in the unknowns that follow."""

    def critical(self, z: np.ndarray) -> GrowthNumbers:
        """Return what decides the stability of a solution."""

    def kind(self, value: complex, turned: bool) -> BifurcationKind:
        """Name the bifurcation at which a critical value passes; `turned` if the branch turns in its parameter."""
