"""Exact eigenvectors of a rational matrix.

Let γ be an eigenvalue with the minimal polynomial p = Σ p_k z^k of degree d.  Its eigenvectors have
entries in Q(γ): polynomials in γ with rational coefficients.  Let v be a rational vector with
p(G) v = 0, b_(d-1) = v and b_(k-1) = G b_k + p_k v.  Then w = Σ γ^k b_k is an eigenvector, because
(G - γ) w = p(G) v - p(γ) v = 0.  Vectors v independent over Q(γ) give independent eigenvectors, and all
roots of p share the b_k.

The proof has three parts: G b_k = b_(k-1) - p_k b_(d-1) holds for each w, entry by entry; the number of
eigenvectors is the number of Jordan blocks; the rank of all b_k shows that the eigenvectors are
independent (F. R. Gantmacher, The Theory of Matrices 1, Chelsea, New York, 1959, chapter VII).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial, reduce
from math import gcd, lcm
from typing import TypeAlias

import sympy as sp
from flint import arb, fmpq, fmpq_mat, fmpq_poly, fmpz_mat

from ..algebra.balls import Ball, accurate, nearest, precision
from ..algebra.minimal_polynomials import minimal_polynomial
from ..algebra.rationals import to_flint
from .eigenvalue import Eigenvalue, ProofError
from .jordan import value_at
from .matrix import Matrix
from .solve import spectrum

# Most nodes of a graph whose eigenvectors are computed, which takes a few seconds if no eigenvalue is rational.
LARGEST = 100
# A number of Q(γ): integer coefficients of 1, γ, γ² … γ^(d-1), where d is the degree of γ.
Entry: TypeAlias = tuple[int, ...]

Vector: TypeAlias = tuple[Entry, ...]


@dataclass(frozen=True, slots=True)
class Eigenspace:
    """All eigenvectors of one eigenvalue."""

    eigenvalue: Eigenvalue  # the eigenvalue γ
    basis: tuple[Vector, ...]  # independent eigenvectors; an entry lists coefficients of 1, γ, γ² …

    @property
    def dimension(self) -> int:
        return len(self.basis)

    @property
    def vectors(self) -> tuple[sp.ImmutableDenseMatrix, ...]:
        """The eigenvectors as SymPy columns, n x 1, entries in powers of the exact eigenvalue."""
        gamma = self.eigenvalue.exact
        powers = [sp.expand(gamma**k) for k in range(len(self.basis[0][0]))]

        def number(entry: Entry) -> sp.Expr:
            return sp.expand(sp.Add(*(c * power for c, power in zip(entry, powers, strict=True))))

        return tuple(sp.ImmutableDenseMatrix([[number(entry)] for entry in vector]) for vector in self.basis)

    @property
    def values(self) -> tuple[tuple[float | complex, ...], ...]:
        """The eigenvectors as nearest floats, each divided by its entry of largest modulus (the first of several)."""
        return tuple(tuple(self._floats(vector)) for vector in self.basis)

    def _floats(self, vector: Vector) -> Iterator[float | complex]:
        top: Entry | None = None
        for entry in filter(any, vector):
            if top is None or self._size(entry) > self._size(top):
                top = entry
        for entry in vector:
            yield nearest(partial(self._ratio, entry, top)) if any(entry) and top is not None else 0.0

    def _size(self, entry: Entry) -> Ball:
        """Return the modulus of a number of Q(γ) other than 0, to 64 bits."""
        return abs(accurate(partial(self._ratio, entry, None), 64))

    def _ratio(self, entry: Entry, other: Entry | None, bits: int) -> Ball:
        """Return a ball around entry / other; `other` None stands for 1."""
        gamma = self.eigenvalue.enclosure(bits)
        with precision(bits):
            above, below = (
                reduce(lambda value, c: value * gamma + c, reversed(x), arb(0)) for x in (entry, other or (1,))
            )
            return above / below


def eigenspaces(matrix: Matrix) -> tuple[Eigenspace, ...]:
    """Return the eigenspaces of a matrix in the order of its spectrum."""
    if matrix.n > LARGEST:
        raise ValueError(f"eigenspaces of {matrix.name}: found {matrix.n} nodes; expected at most {LARGEST}")
    bases: dict[tuple[fmpq, ...], tuple[Vector, ...]] = {}
    spaces = []
    for eigenvalue in spectrum(matrix):
        polynomial = minimal_polynomial(eigenvalue.number)
        key = tuple(polynomial.coeffs())
        if key not in bases:
            # Eigenvectors are polynomials in γ, valid for every root γ of a monic irreducible polynomial.
            rational, kernel = _rational(matrix), null_space(value_at(matrix, polynomial))
            degree, independent, basis = int(polynomial.degree()), list[list[fmpq]](), list[Vector]()
            for start in kernel:
                if degree > 1 and fmpq_mat([*independent, start]).rank() == len(independent):
                    continue
                # b_(d-1) = v, b_(k-1) = G b_k + p_k v: see the head of this module
                parts = [fmpq_mat(matrix.n, 1, start)]
                for k in range(degree - 1, 0, -1):
                    parts.append(rational * parts[-1] + parts[0] * polynomial[k])
                columns = [[part[i, 0] for i in range(matrix.n)] for part in reversed(parts)]
                independent += columns
                basis.append(_whole(columns))
            bases[key] = tuple(basis)
            check(matrix, polynomial, bases[key])
            if eigenvalue.geometric not in (None, len(bases[key])):
                raise ProofError(
                    f"eigenspaces of {matrix.name}: found {len(bases[key])} eigenvectors of {eigenvalue}; expected "
                    f"{eigenvalue.geometric}"
                )
        spaces.append(Eigenspace(eigenvalue, bases[key]))
    return tuple(spaces)


def _rational(matrix: Matrix) -> fmpq_mat:
    rows = fmpq_mat(matrix.n, matrix.n)
    for i, j, number in matrix.entries:
        rows[i, j] = to_flint(number)
    return rows


def null_space(matrix: fmpz_mat) -> list[list[fmpq]]:
    """Return a basis of the null space: each vector is 1 at one column without pivot, 0 at the other such columns."""
    reduced, below, rank = matrix.rref()
    n, pivots = matrix.ncols(), list[int]()
    for i in range(rank):
        start = pivots[-1] + 1 if pivots else 0
        pivots.append(next(j for j in range(start, n) if reduced[i, j]))
    basis = []
    for free in sorted(set(range(n)).difference(pivots)):
        vector = [fmpq(int(j == free)) for j in range(n)]
        for i, pivot in enumerate(pivots):
            vector[pivot] = fmpq(-reduced[i, free], below)
        basis.append(vector)
    return basis


def _whole(columns: Sequence[Sequence[fmpq]]) -> Vector:
    """Scale the columns b_0, b_1 … together to coprime integers; return the entries of w, one a row."""
    coefficients = [number for column in columns for number in column]
    below = lcm(*(int(number.q) for number in coefficients))
    above = gcd(*(int(number.p) * (below // int(number.q)) for number in coefficients))
    return tuple(
        tuple(int(number.p) * (below // int(number.q)) // above for number in entry)
        for entry in zip(*columns, strict=True)
    )


def check(matrix: Matrix, polynomial: fmpq_poly, basis: Sequence[Vector]) -> None:
    """Raise ProofError unless the vectors are independent eigenvectors for every root of a monic polynomial."""
    rational, degree = _rational(matrix), int(polynomial.degree())
    for vector in basis:
        image = rational * fmpq_mat([list(map(fmpq, entry)) for entry in vector])
        for i, entry in enumerate(vector):
            for k in range(degree):  # G b_k = b_(k-1) - p_k b_(d-1)
                expected = (entry[k - 1] if k else 0) - polynomial[k] * entry[-1]
                if image[i, k] != expected:
                    raise ProofError(
                        f"eigenspaces of {matrix.name}: entry {i} of G v and of γ v differ for the roots γ of {polynomial}"
                    )
    # The vectors are independent over Q(γ) if all b_k are independent over the rationals.
    parts = [[entry[k] for entry in vector] for vector in basis for k in range(degree)]
    if int(fmpz_mat(parts).rank()) != len(parts):
        raise ProofError(f"eigenspaces of {matrix.name}: eigenvectors of the roots of {polynomial} are dependent")
