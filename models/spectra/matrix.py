"""What `spectrum` needs of a matrix; graphs and other matrices of graphs offer it."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import sympy as sp


class Matrix(Hashable, Protocol):
    """A square rational matrix, as its entries other than 0."""

    @property
    def name(self) -> str:
        """What messages call the matrix."""

    @property
    def n(self) -> int:
        """Number of rows."""

    @property
    def options(self) -> tuple[tuple[str, object], ...]:
        """What distinguishes matrices of one name and size."""

    @property
    def entries(self) -> tuple[tuple[int, int, Fraction], ...]:
        """The entries other than 0 as (row, column, entry), each once."""

    @property
    def link_count(self) -> int:
        """The number of entries outside the diagonal."""

    @property
    def diagonalisable(self) -> bool:
        """True if it is known that eigenvectors are a basis, as those of a symmetric matrix are."""

    def closed_form(self) -> Sequence[tuple[sp.Expr, int]] | None:
        """List the eigenvalues with multiplicities, each once; None without a closed form."""
