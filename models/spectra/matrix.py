"""The protocol `Matrix`, the input of `spectrum`: graphs and `GraphMatrix` implement it."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import sympy as sp


class Matrix(Hashable, Protocol):
    """A square rational matrix, given by its non-zero entries."""

    @property
    def name(self) -> str:
        """Name of the matrix in messages."""

    @property
    def n(self) -> int:
        """Number of rows."""

    @property
    def options(self) -> tuple[tuple[str, object], ...]:
        """Options that distinguish matrices of the same name and size."""

    @property
    def entries(self) -> tuple[tuple[int, int, Fraction], ...]:
        """The non-zero entries as (row, column, entry), each once."""

    @property
    def link_count(self) -> int:
        """The number of entries outside the diagonal."""

    @property
    def diagonalisable(self) -> bool:
        """True if eigenvectors are known to form a basis, as for a symmetric matrix."""

    def closed_form(self) -> Sequence[tuple[sp.Expr, int]] | None:
        """List the distinct eigenvalues with multiplicities; None without a closed form."""
