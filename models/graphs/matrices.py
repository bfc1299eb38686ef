"""Matrices of a graph beside G: adjacency matrix and Laplacians, with proved spectra.

F. R. K. Chung, Spectral Graph Theory (American Mathematical Society, 1997), chapter 1; A. E. Brouwer,
W. H. Haemers, Spectra of Graphs (Springer, 2012), section 1.1.  Only eigenvalues, eigenvectors and
`matrix` load SymPy.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction
from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING, Protocol

from ..inputs.rational_text import total
from ..spectra.matrix import Matrix
from .links import Link, one_degree

if TYPE_CHECKING:
    import sympy as sp

    from ..spectra.eigenspaces import Eigenspace
    from ..spectra.spectrum import Spectrum


class Exact:
    """Mixin of `Topology` and `GraphMatrix`: compute rows, exact spectrum and eigenvectors from the entries."""

    __slots__ = ()

    @property
    def rows(self: Matrix) -> tuple[tuple[Fraction, ...], ...]:
        """The matrix as n rows of n fractions."""
        zero = Fraction(0)
        table = [[zero] * self.n for _ in range(self.n)]
        for i, j, entry in self.entries:
            table[i][j] = entry
        return tuple(map(tuple, table))

    @property
    def matrix(self: Matrix) -> sp.ImmutableDenseMatrix:
        """The matrix as an immutable SymPy matrix, n x n."""
        import sympy as sp

        table = sp.zeros(self.n)
        for i, j, entry in self.entries:
            table[i, j] = sp.Rational(entry.numerator, entry.denominator)
        return table.as_immutable()

    @property
    def spectrum(self: Matrix) -> Spectrum:
        """The exact eigenvalues with multiplicities, the largest first (see `synchain.models.spectra.solve`)."""
        from ..spectra.solve import spectrum

        return spectrum(self)

    @property
    def eigenspaces(self: Matrix) -> tuple[Eigenspace, ...]:
        """The exact eigenvectors (see `synchain.models.spectra.eigenspaces`)."""
        from ..spectra.eigenspaces import eigenspaces

        return eigenspaces(self)


class MatrixKind(StrEnum):
    """Matrices of a graph: W holds the weights with which node i (row) feels node j (column), D the row sums of W."""

    ADJACENCY = "adjacency matrix"  # W
    LAPLACIAN = "Laplacian"  # D - W, which is -G
    SIGNLESS = "signless Laplacian"  # D + W; of undirected graphs
    # 1 - W/D, with a row of zeros for a node without links; of undirected graphs. The matrix is rational and similar to
    # the normalised Laplacian L = 1 - D^(-1/2) W D^(-1/2), whose entries are square roots. Both have the same
    # eigenvalues; v is an eigenvector of 1 - W/D if D^(1/2) v is one of L.
    RANDOM_WALK = "random-walk Laplacian"


class GraphMatrices(Matrix, Protocol):
    """Protocol of a graph (its matrix G and its links) from which a `GraphMatrix` is made; `Topology` fulfils it."""

    @property
    def links(self) -> tuple[Link, ...]:
        """The links (target, source, weight), sorted."""

    @property
    def undirected(self) -> bool:
        """True if G is known to be symmetric."""

    @property
    def asymmetry(self) -> str:
        """Message on the first links that differ from their mirror image; "" if the graph is undirected."""


@dataclass(frozen=True, slots=True)
class GraphMatrix(Exact):
    """A matrix of a graph beside its connectivity matrix G."""

    graph: GraphMatrices
    kind: MatrixKind

    def __post_init__(self) -> None:
        if self.kind in (MatrixKind.ADJACENCY, MatrixKind.LAPLACIAN):
            return
        if self.graph.asymmetry:
            raise ValueError(f"{self.name}: found {self.graph.asymmetry}; expected an undirected graph")
        if self.kind is MatrixKind.RANDOM_WALK:
            for i, degree in self._degrees.items():
                if degree <= 0:
                    raise ValueError(f"{self.name}: node {i} has the degree {degree}; expected a positive one")

    @property
    def name(self) -> str:
        return f"{self.graph.name}, {self.kind}"

    @property
    def n(self) -> int:
        return self.graph.n

    @property
    def options(self) -> tuple[tuple[str, object], ...]:
        return self.graph.options

    @property
    def link_count(self) -> int:
        return self.graph.link_count

    @property
    def diagonalisable(self) -> bool:
        """True if the matrix is known to be similar to a symmetric one, so that eigenvectors form a basis."""
        return self.graph.undirected

    @property
    def _degrees(self) -> dict[int, Fraction]:
        """Node -> sum of the weights that the node feels; nodes without links are left out."""
        return {i: total(weight for _, _, weight in row) for i, row in groupby(self.graph.links, itemgetter(0))}

    @property
    def entries(self) -> tuple[tuple[int, int, Fraction], ...]:
        """The entries other than 0 as (row, column, entry), each once."""
        links, degrees = self.graph.links, self._degrees
        if self.kind is MatrixKind.ADJACENCY:
            return links
        if self.kind is MatrixKind.RANDOM_WALK:
            walks = ((i, j, -weight / degrees[i]) for i, j, weight in links)
            return (*walks, *((i, i, Fraction(1)) for i in degrees))
        sign = 1 if self.kind is MatrixKind.SIGNLESS else -1
        return (*((i, j, sign * weight) for i, j, weight in links), *((i, i, d) for i, d in degrees.items() if d))

    def closed_form(self) -> Sequence[tuple[sp.Expr, int]] | None:
        """List the distinct eigenvalues with multiplicities if they follow from the eigenvalues of G; else None."""
        from ..algebra.cosine_sums import AngleSum, expressions
        from ..spectra.angle_sums import angle_sums

        # The matrix equals a G + b (a, b numbers) for the Laplacian, and for a common in-degree d of all nodes.
        d = one_degree(self.n, self.graph.links) if self.kind is not MatrixKind.LAPLACIAN else Fraction(0)
        if d is None or self.graph.closed_form() is None or (gammas := angle_sums(self.graph)) is None:
            return None
        a, b = {
            MatrixKind.LAPLACIAN: (Fraction(-1), Fraction(0)),
            MatrixKind.ADJACENCY: (Fraction(1), d),
            MatrixKind.SIGNLESS: (Fraction(1), 2 * d),
            MatrixKind.RANDOM_WALK: (-1 / d if d else Fraction(0), Fraction(0)),
        }[self.kind]
        factor, shift = AngleSum.rational(a), AngleSum.rational(b)
        return expressions([(factor * gamma + shift, times) for gamma, times in gammas])

    def __repr__(self) -> str:
        return f"GraphMatrix({self.graph!r}, {str(self.kind)!r})"
