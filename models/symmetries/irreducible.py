"""Finest blocks: split a space into the smallest subspaces that several rational matrices leave invariant, exactly.

The matrices and their adjoints generate an algebra.  The space is a sum of irreducible subspaces of this algebra;
equivalent ones carry the same matrices in suitable bases, so that one of them stands for all.

1. `_isotypic` splits the space by a generic self-adjoint element a of the algebra.  Let f be an irreducible factor of
   its characteristic polynomial.  The images of the null space of f(a) under the algebra span all subspaces that are
   equivalent to each other, or conjugate over the rationals.
2. `_irreducible` finds one irreducible subspace there: the images of an eigenvector v of some element.  Its eigenvalue
   θ may be irrational; all entries are then polynomials in θ.  The eigenvalue is simple on the subspace exactly if the
   subspace is irreducible, because a sum of two subspaces, each with a part of v, has a null space of dimension two.

Sources: Maehara & Murota, Jpn. J. Ind. Appl. Math. 27, 263 (2010): generic elements; Zhang & Motter, SIAM Rev. 62, 817
(2020): stability of synchronous states; Holt & Rees, J. Aust. Math. Soc. A 57, 1 (1994): images of a null vector.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import partial
from math import gcd
from typing import Any, TypeAlias

from flint import arb, fmpq, fmpq_mat, fmpq_poly, nmod_mat, nmod_poly

from ..algebra.balls import Ball, nearest, precision
from ..algebra.rationals import to_flint, to_fraction
from ..algebra.roots import RealRoot, roots
from ..spectra.eigenvalue import ProofError

# Number of generic elements that are tried if one of them splits the space, and at most (a choice).
ENOUGH, ELEMENTS = 2, 6
# Primes below 2**31 for ranks modulo a prime.
PRIMES = (2147483647, 2147483629, 2147483587, 2147483579, 2147483563, 2147483549, 2147483543, 2147483497)
# A number of a field Q(θ) as a polynomial in θ, reduced by the minimal polynomial of θ (flint has no types).
Polynomial: TypeAlias = Any

Vector: TypeAlias = list[Polynomial]


@dataclass(frozen=True, slots=True)
class FieldNumber:
    """A number of Q(θ), a polynomial in the real algebraic number θ; `float(number)` is the nearest float."""

    coefficients: tuple[Fraction, ...]  # of 1, θ, θ² …
    root: RealRoot  # θ
    value: float = field(init=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "value", nearest(self._ball).real)

    def _ball(self, bits: int) -> Ball:
        theta = self.root.enclosure(bits)
        with precision(bits):
            total = arb(0)
            for c in reversed(self.coefficients):
                total = total * theta + arb(to_flint(c))
            return total

    def __float__(self) -> float:
        return self.value

    def __repr__(self) -> str:
        return f"{self.value:.16g}"


Exact: TypeAlias = Fraction | FieldNumber  # an exact real number; `float(number)` is the nearest float


def plus(number: Exact, more: Fraction) -> Exact:
    """Return the sum of an exact number and a rational one."""
    if isinstance(number, Fraction):
        return number + more
    first, *others = number.coefficients
    return FieldNumber((first + more, *others), number.root)


Rows: TypeAlias = tuple[tuple[Exact, ...], ...]


@dataclass(frozen=True, slots=True)
class Subspace:
    """An irreducible subspace, in the coordinates of its reduced echelon form, and the number of equivalent ones."""

    pivots: tuple[int, ...]  # for each of the d coordinates of the subspace, the equal coordinate of the whole space
    matrices: tuple[Rows, ...]  # (d, d): the matrices in the coordinates of the subspace
    multiplicity: int  # number of equivalent subspaces
    hull: tuple[tuple[Fraction, ...], ...]  # basis (rows) of the sum of all equivalent and conjugate subspaces


@dataclass(frozen=True, slots=True)
class Generator:
    """A rational matrix with its adjoint; equal for a self-adjoint matrix."""

    matrix: fmpq_mat
    adjoint: fmpq_mat

    @property
    def both(self) -> tuple[fmpq_mat, ...]:
        """The matrix, and the adjoint if that is another one."""
        return (self.matrix,) if self.matrix == self.adjoint else (self.matrix, self.adjoint)

    def times(self, other: Generator) -> Generator:
        """Return the product with its adjoint."""
        return Generator(self.matrix * other.matrix, other.adjoint * self.adjoint)


def irreducible_subspaces(
    matrices: Sequence[Generator], projectors: Sequence[fmpq_mat], size: int
) -> tuple[Subspace, ...]:
    """Return the irreducible subspaces of dimension `size` under matrices and self-adjoint projectors."""
    # Equivalent subspaces are returned once. Raises ProofError if the dimensions do not add up.
    generators = [*matrices, *(Generator(p, p) for p in projectors)]
    subspaces = []
    for basis in _isotypic(generators, size):
        inner = [_restricted(g, basis) for g in generators]
        hull = tuple(tuple(map(to_fraction, row)) for row in basis.tolist())
        subspaces += list(_irreducible(inner, len(matrices), hull, _pivots(basis)))
    if sum(len(part.pivots) * part.multiplicity for part in subspaces) != size:
        raise ProofError(f"finest blocks: found dimensions that do not add up to {size}")
    return tuple(sorted(subspaces, key=lambda part: part.pivots))


def _isotypic(generators: Sequence[Generator], size: int) -> list[fmpq_mat]:
    """Return bases (rows) of subspaces, each spanned by irreducible ones that are equivalent or conjugate."""
    finest: list[fmpq_mat] = []
    for trial in range(ELEMENTS if size else 0):
        if trial >= ENOUGH and finest:
            break
        element = _generic(generators, trial)
        spaces = [_span(_null_rows(element, f), generators) for f, _ in element.charpoly().factor()[1]]
        # Factors of one subspace give it several times.
        spaces = list({tuple(space.entries()): space for space in spaces}.values())
        # The element is not generic if subspaces overlap; two elements may miss different coincidences.
        if sum(space.nrows() for space in spaces) == size and len(spaces) > len(finest):
            finest = spaces
    if size and (not finest or _stacked(finest).rank() != size):
        raise ProofError(f"finest blocks: found no generic element in {ELEMENTS} trials")
    return finest


def _irreducible(
    generators: Sequence[Generator], count: int, hull: tuple[tuple[Fraction, ...], ...], columns: Sequence[int]
) -> Iterator[Subspace]:
    """Yield the irreducible subspaces of a sum of equivalent and conjugate ones: one of each kind."""
    # `count`: number of generators whose matrices are returned. `columns`: pivots of the hull.
    size = len(hull)
    # The best eigenvector has the eigenvalue of least multiplicity, which then counts the equivalent subspaces, and of
    # least degree, which makes short numbers.
    choices = []
    for order, element in enumerate(_elements(generators)):
        choices += [(times, f.degree(), order, element, f) for f, times in element.charpoly().factor()[1]]
    times, _, _, element, f = min(choices, key=lambda choice: choice[:3])
    field_ = _NumberField(f)
    start = field_.eigenvector(element, _null_rows(element, f))
    if times == 1 and f.degree() > 1 and _rank_modulo_prime(generators, start, f) == size:
        field_, start = _NumberField(fmpq_poly([0, 1])), [fmpq_poly([int(k == 0)]) for k in range(size)]
    space = field_.span(start, [g for generator in generators for g in generator.both])
    matrices = [field_.restricted(generator.matrix, space) for generator in generators[:count]]
    dimension = len(space)

    # Number of conjugate subspaces: those over other roots of f, as far as they are not equivalent.
    simple = 1 if times == 1 else field_.nullity(field_.restricted(element, space))
    multiplicity, rest = divmod(times, simple)
    conjugates, more = divmod(size, dimension * multiplicity) if not rest else (0, 1)
    if more:
        raise ProofError(f"finest blocks: a subspace of dimension {dimension} does not divide one of {size}")
    generic = field_.restricted(_generic(generators, 1), space)
    for root in field_.conjugate_roots(generic, conjugates):
        exact = partial(_exact, root=root)
        rows = tuple(tuple(tuple(map(exact, row)) for row in matrix) for matrix in matrices)
        yield Subspace(tuple(columns[pivot] for pivot in space), rows, multiplicity, hull)


def _elements(generators: Sequence[Generator]) -> Iterator[fmpq_mat]:
    """Yield self-adjoint elements of the algebra: the generators, which may have rational eigenvalues, then sums."""
    for g in generators:
        yield g.matrix if g.matrix == g.adjoint else g.matrix + g.adjoint
    for trial in range(3):
        yield _generic(generators, trial)


def _generic(generators: Sequence[Generator], trial: int) -> fmpq_mat:
    """Return a self-adjoint element with fixed integer coefficients, which differ from trial to trial."""
    total = fmpq_mat(generators[0].matrix.nrows(), generators[0].matrix.nrows())
    for k, g in enumerate(generators):
        total += (g.matrix + g.adjoint) * fmpq(1 + (7 * k * k + 5 * k * trial + 3 * trial) % 23)
    # A sum may have equal eigenvalues that products of the generators tell apart.
    for k, g in enumerate(generators if trial else ()):
        product = g.times(generators[(k + trial) % len(generators)])
        total += (product.matrix + product.adjoint) * fmpq(1 + (3 * k + 11 * trial) % 19)
    return total


def _span(rows: fmpq_mat, generators: Sequence[Generator]) -> fmpq_mat:
    """Return the reduced basis (rows) of the smallest invariant subspace that contains some vectors."""
    images = [g.transpose() for generator in generators for g in generator.both]
    while True:
        dimension = rows.nrows()
        rows = _reduced(_stacked([rows, *(rows * g for g in images)]))
        if rows.nrows() == dimension:
            return rows


def _restricted(generator: Generator, basis: fmpq_mat) -> Generator:
    """Return a generator in the coordinates of an invariant subspace, given by reduced rows."""
    pivots = _pivots(basis)

    def inside(g: fmpq_mat) -> fmpq_mat:
        images = basis * g.transpose()
        matrix = fmpq_mat([[images[k, p] for k in range(basis.nrows())] for p in pivots])
        if matrix.transpose() * basis != images:
            raise ProofError("finest blocks: a matrix does not leave a subspace invariant")
        return matrix

    return Generator(inside(generator.matrix), inside(generator.adjoint))


def _exact(polynomial: Polynomial, root: RealRoot | None) -> Exact:
    """Return a Fraction for a rational number, else a number of the field of the root."""
    coefficients = tuple(map(to_fraction, polynomial.coeffs()))
    if len(coefficients) < 2 or root is None:
        return coefficients[0] if coefficients else Fraction(0)
    return FieldNumber(coefficients, root)


class _NumberField:
    """The field Q(θ) of a root θ of an irreducible polynomial, with the linear algebra that subspaces need."""

    def __init__(self, polynomial: fmpq_poly) -> None:
        self.polynomial, self.degree = polynomial / polynomial[polynomial.degree()], int(polynomial.degree())
        self.one, self.zero = fmpq_poly([1]), fmpq_poly([0])
        self.theta = fmpq_poly([0, 1]) % self.polynomial

    def times(self, a: Polynomial, b: Polynomial) -> Polynomial:
        return a * b % self.polynomial

    def inverse(self, a: Polynomial) -> Polynomial:
        """Return 1/a, from u a + v f = 1."""
        divisor, factor, _ = a.xgcd(self.polynomial)
        return factor / divisor[0] % self.polynomial

    def eigenvector(self, element: fmpq_mat, null: fmpq_mat) -> Vector:
        """Return Σ θ^k b_k with b_(d-1) = v, b_(k-1) = a b_k + f_k v, for the first null vector v of f(a)."""
        start = fmpq_mat(null.ncols(), 1, [null[0, c] for c in range(null.ncols())])
        parts = [start]
        for k in range(self.degree - 1, 0, -1):
            parts.append(element * parts[-1] + start * self.polynomial[k])
        columns = [[part[c, 0] for part in reversed(parts)] for c in range(null.ncols())]
        return [fmpq_poly(column) % self.polynomial for column in columns]

    def image(self, matrix: fmpq_mat, vector: Vector) -> Vector:
        """Return the product of a rational matrix and a vector."""
        columns = [c for c, x in enumerate(vector) if x != 0]
        return [
            sum((vector[c] * matrix[r, c] for c in columns if matrix[r, c]), self.zero) for r in range(matrix.nrows())
        ]

    def span(self, start: Vector, matrices: Sequence[fmpq_mat]) -> dict[int, Vector]:
        """Return the reduced basis of the smallest invariant subspace that contains a vector, by pivots, ascending."""
        rows: dict[int, Vector] = {}
        waiting = [start]
        while waiting:
            vector = self.reduced(waiting.pop(), rows)
            pivot = next((c for c, x in enumerate(vector) if x != 0), None)
            if pivot is None:
                continue
            scale = self.inverse(vector[pivot])
            rows[pivot] = [self.times(scale, x) if x != 0 else x for x in vector]
            waiting += [self.image(g, rows[pivot]) for g in matrices]
        for pivot in rows:  # no row has an entry in the pivot column of another one
            others = {p: row for p, row in rows.items() if p != pivot}
            rows[pivot] = self.reduced(rows[pivot], others)
        return {pivot: rows[pivot] for pivot in sorted(rows)}

    def reduced(self, vector: Vector, rows: dict[int, Vector]) -> Vector:
        """Subtract multiples of rows until the vector is zero at every pivot."""
        for pivot in sorted(rows):
            factor = vector[pivot]
            if factor != 0:
                row = rows[pivot]
                vector = [x if y == 0 else (x - factor * y) % self.polynomial for x, y in zip(vector, row, strict=True)]
        return vector

    def restricted(self, matrix: fmpq_mat, space: dict[int, Vector]) -> list[list[Polynomial]]:
        """Return a matrix in the coordinates of an invariant subspace; the proof is that the images lie in it."""
        images = [self.image(matrix, row) for row in space.values()]
        for image in images:
            if any(x != 0 for x in self.reduced(image, space)):
                raise ProofError("finest blocks: a matrix does not leave a subspace invariant")
        return [[image[pivot] for image in images] for pivot in space]

    def nullity(self, matrix: list[list[Polynomial]]) -> int:
        """Return the number of independent eigenvectors of the eigenvalue θ."""
        shifted = [[x - self.theta if r == c else x for c, x in enumerate(row)] for r, row in enumerate(matrix)]
        rows: dict[int, Vector] = {}
        for row in shifted:
            vector = self.reduced([x % self.polynomial for x in row], rows)
            pivot = next((c for c, x in enumerate(vector) if x != 0), None)
            if pivot is not None:
                scale = self.inverse(vector[pivot])
                rows[pivot] = [self.times(scale, x) for x in vector]
        return len(matrix) - len(rows)

    def conjugate_roots(self, generic: list[list[Polynomial]], count: int) -> list[RealRoot | None]:
        """Return one root θ for each of `count` subspaces that are not equivalent; None for a rational field."""
        # `generic`: a generic element in the coordinates of the subspace.
        if self.degree == 1:
            return [None]
        coefficients = [int(c) for c in self.polynomial.numer().coeffs()]
        content = gcd(*coefficients)
        # The polynomial divides that of a self-adjoint element: all its roots are real.
        all_roots = [root for root in roots(tuple(c // content for c in coefficients)) if isinstance(root, RealRoot)]
        if count == 1:
            return [all_roots[0]]
        # A generic element has equal traces of all powers on equivalent subspaces, and only there.
        power, trace, size = generic, self.zero, range(len(generic))
        for k in size:
            trace += sum((power[r][r] for r in size), self.zero) * fmpq(1, 3 + 5 * k)
            products = [[[self.times(power[r][q], generic[q][c]) for q in size] for c in size] for r in size]
            power = [[sum(terms, self.zero) for terms in row] for row in products]
        kinds: dict[str, RealRoot | None] = {}
        for root in all_roots:
            kinds.setdefault(f"{float(_exact(trace % self.polynomial, root)):.12e}", root)
        if len(kinds) != count:
            raise ProofError(f"finest blocks: found {len(kinds)} traces of {count} conjugate subspaces")
        return list(kinds.values())


def _rank_modulo_prime(generators: Sequence[Generator], start: Vector, f: fmpq_poly) -> int:
    """Return a lower bound of the dimension of the invariant subspace of a vector, which is usually exact."""
    for prime in PRIMES:
        root = next((int(-g[0]) for g, _ in nmod_poly(_modulo(f, prime), prime).factor()[1] if g.degree() == 1), None)
        if root is None:
            continue
        row = [[int(nmod_poly(_modulo(x, prime), prime)(root)) for x in start]]
        images = [
            nmod_mat([[_residue(g[c, r], prime) for c in range(g.nrows())] for r in range(g.ncols())], prime)
            for generator in generators
            for g in generator.both
        ]
        rows, rank = nmod_mat(row, prime), 0
        while rows.nrows() > rank:
            rank = rows.nrows()
            stacked = [list(line) for m in (rows, *(rows * g for g in images)) for line in m.tolist()]
            reduced, dimension = nmod_mat([[int(x) for x in line] for line in stacked], prime).rref()
            rows = nmod_mat([[int(x) for x in line] for line in reduced.tolist()[:dimension]], prime)
        return rank
    return 0


def _modulo(polynomial: Polynomial, prime: int) -> list[int]:
    return [_residue(c, prime) for c in polynomial.coeffs()] or [0]


def _residue(x: fmpq, prime: int) -> int:
    return int(x.p) * pow(int(x.q), -1, prime) % prime


def _null_rows(element: fmpq_mat, f: fmpq_poly) -> fmpq_mat:
    """Return a basis (rows) of the null space of f(element), in reduced form."""
    size = element.nrows()
    identity = fmpq_mat([[int(r == c) for c in range(size)] for r in range(size)])
    if f.degree() == size:  # Cayley-Hamilton
        return identity
    value = fmpq_mat(size, size)
    for k in range(f.degree(), -1, -1):
        value = value * element + identity * f[k]
    reduced, rank = value.rref()
    pivots = _pivots(fmpq_mat([[reduced[r, c] for c in range(size)] for r in range(rank)])) if rank else []
    rows = []
    for free in sorted(set(range(size)).difference(pivots)):
        row = [fmpq(int(c == free)) for c in range(size)]
        for r, pivot in enumerate(pivots):
            row[pivot] = -reduced[r, free]
        rows.append(row)
    return _reduced(fmpq_mat(rows))


def _reduced(rows: fmpq_mat) -> fmpq_mat:
    """Return the reduced echelon form without zero rows."""
    reduced, rank = rows.rref()
    return fmpq_mat([[reduced[r, c] for c in range(rows.ncols())] for r in range(rank)])


def _pivots(rows: fmpq_mat) -> list[int]:
    return [next(c for c in range(rows.ncols()) if rows[r, c]) for r in range(rows.nrows())]


def _stacked(parts: Sequence[fmpq_mat]) -> fmpq_mat:
    return fmpq_mat([[part[r, c] for c in range(part.ncols())] for part in parts for r in range(part.nrows())])
