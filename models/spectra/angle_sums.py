"""Spectra as sums of cosines of rational angles, which the rules of products and of other matrices of a graph add exactly."""

from __future__ import annotations

from ..algebra.cosine_sums import AngleSum, read
from .matrix import Matrix
from .solve import spectrum

SMALL = 100
"""Most rows of a matrix without a closed form whose eigenvalues are computed for it."""


def angle_sums(matrix: Matrix) -> list[tuple[AngleSum, int]] | None:
    """Return the eigenvalues of a matrix and their multiplicities as sums of cosines."""
    pairs = matrix.closed_form()
    if pairs is None and matrix.n > SMALL:
        return None
    known = [(e.exact, e.multiplicity) for e in spectrum(matrix)] if pairs is None else pairs
    found = [(read(number), times) for number, times in known]
    return None if any(a is None for a, _ in found) else [(a, times) for a, times in found if a is not None]
