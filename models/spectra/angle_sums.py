"""Write spectra as sums of cosines of rational angles, which can be added and multiplied exactly."""

from __future__ import annotations

from ..algebra.cosine_sums import AngleSum, read
from .matrix import Matrix
from .solve import spectrum

SMALL = 100  # most rows of a matrix without a closed form whose eigenvalues `angle_sums` computes


def angle_sums(matrix: Matrix) -> list[tuple[AngleSum, int]] | None:
    """Return (sum of cosines, multiplicity) for all eigenvalues; None if one is no such sum or n is too large."""
    pairs = matrix.closed_form()
    if pairs is None and matrix.n > SMALL:
        return None
    exact_pairs = [(e.exact, e.multiplicity) for e in spectrum(matrix)] if pairs is None else pairs
    sums = [(read(number), times) for number, times in exact_pairs]
    return None if any(a is None for a, _ in sums) else [(a, times) for a, times in sums if a is not None]
