"""What the spectra know of a connectivity matrix, whatever made it."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import sympy as sp

__all__ = ["Matrix"]


class Matrix(Hashable, Protocol):
    """A square rational matrix G with zero row sums, as links (target, source, weight)."""

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
    def links(self) -> tuple[tuple[int, int, Fraction], ...]:
        """The entries outside the diagonal, sorted."""

    @property
    def link_count(self) -> int:
        """The number of entries outside the diagonal."""

    @property
    def rows(self) -> tuple[tuple[Fraction, ...], ...]:
        """All entries."""

    @property
    def undirected(self) -> bool:
        """True if G is known to be symmetric."""

    def closed_form(self) -> Sequence[tuple[sp.Expr, int]] | None:
        """List the eigenvalues with multiplicities, each once; None without a closed form."""
