"""Joint eigenvalues of commuting matrices, such as the connectivity matrices of several graphs on the same nodes.

Commuting matrices A and B are triangular in a common basis (R. A. Horn, C. R. Johnson, Matrix Analysis, Cambridge
University Press, 2013, theorem 2.3.3).  Each common mode has a pair (a, b) of eigenvalues, and A + t B has the
eigenvalue a + t b there.  Choose t such that all sums a + t b of eigenvalues of A and B differ.  The exact spectrum of
A + t B then determines the pairs and their multiplicities, without eigenvectors and without rounding.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from itertools import product
from typing import TypeAlias

from flint import acb, fmpq, fmpq_poly

from ..algebra.balls import disjoint, precision
from ..inputs.checks import typed_repr
from .eigenvalue import Eigenvalue, ProofError
from .jordan import value_at
from .matrix import Matrix
from .solve import DENSE_LIMIT, spectrum

BITS = (64, 256, 1024)  # precisions in bits at which sums of eigenvalues are separated, tried in this order
# Try factors t = k/PRIME of a further matrix, k = 1 … TRIED; only few of these make two sums equal.
PRIME, TRIED = 97, 100
# For each common mode: the eigenvalue of each graph, and the eigenvalue of the combined matrix.
Modes: TypeAlias = "tuple[tuple[tuple[Eigenvalue, ...], Eigenvalue], ...]"


@dataclass(frozen=True, slots=True)
class JointEigenvalue:
    """The eigenvalues of several graphs on one common mode."""

    parts: tuple[Eigenvalue, ...]  # the eigenvalue of each graph; `multiplicity` in it is that in the graph
    multiplicity: int  # how often these eigenvalues occur together

    @property
    def values(self) -> tuple[float | complex, ...]:
        return tuple(part.value for part in self.parts)

    def __str__(self) -> str:
        return f"({', '.join(map(str, self.parts))})"


@dataclass(frozen=True, slots=True)
class _Combination:
    """The matrix A + t B of two matrices that commute."""

    first: Matrix
    second: Matrix
    factor: Fraction

    @property
    def name(self) -> str:
        return f"{self.first.name} and {self.second.name}"

    @property
    def n(self) -> int:
        return self.first.n

    @property
    def options(self) -> tuple[tuple[str, object], ...]:
        return ()

    @property
    def entries(self) -> tuple[tuple[int, int, Fraction], ...]:
        sums = {(i, j): number for i, j, number in self.first.entries}
        for i, j, number in self.second.entries:
            sums[i, j] = sums.get((i, j), Fraction(0)) + self.factor * number
        return tuple((i, j, number) for (i, j), number in sums.items() if number)

    @property
    def link_count(self) -> int:
        return sum(i != j for i, j, _ in self.entries)

    @property
    def diagonalisable(self) -> bool:
        """True if both matrices are diagonalisable: commuting ones then have a basis of common eigenvectors."""
        return self.first.diagonalisable and self.second.diagonalisable

    def closed_form(self) -> None:
        return None


def joint_spectrum(graphs: Sequence[Matrix]) -> tuple[JointEigenvalue, ...]:
    """Return the distinct joint eigenvalues of the connectivity matrices of graphs, exactly.

    Parameters
    ----------
    graphs : sequence of Matrix
        Graphs on the same nodes, or other rational matrices of one size; for one graph the result is its spectrum.

    Returns
    -------
    tuple of JointEigenvalue
        The joint eigenvalues.  One of them is all zeros, the mode of equal states; with positive weights it is the
        first, and the others follow in decreasing order.

    Raises
    ------
    TypeError
        If `graphs` is no sequence.
    ValueError
        If the graphs have different numbers of nodes, if there are several with more than DENSE_LIMIT nodes, or if two
        of their matrices do not commute.
    ProofError
        If an eigenvalue of A + t B is no sum a + t b, a mistake of the program.

    See Also
    --------
    synchain.graphs.Spectrum
    synchain.graphs.Topology

    Examples
    --------
    >>> from synchain.graphs import complete, joint_spectrum, ring
    >>> [str(mode) for mode in joint_spectrum((ring(4), complete(4)))]
    ['(0, 0)', '(-2, -4)', '(-4, -4)']
    """
    if not isinstance(graphs, Sequence):
        raise TypeError(f"joint_spectrum: found {typed_repr(graphs)}; expected several graphs, (first, second)")
    return _joint(tuple(graphs))


@lru_cache(maxsize=32)
def _joint(graphs: tuple[Matrix, ...]) -> tuple[JointEigenvalue, ...]:
    """Compute and cache `joint_spectrum` of a tuple of graphs."""
    _check(graphs)
    modes: Modes = tuple(((e,), e) for e in spectrum(graphs[0]))
    combined = graphs[0]
    for graph in graphs[1:]:
        modes, combined = _joined(modes, combined, graph)
    return tuple(JointEigenvalue(parts, number.multiplicity) for parts, number in modes)


def _check(graphs: Sequence[Matrix]) -> None:
    """Raise ValueError unless the graphs have the same nodes and their matrices commute."""
    sizes = sorted({graph.n for graph in graphs})
    if len(sizes) != 1:
        node_counts = " and ".join(map(str, sizes)) or "no"
        raise ValueError(f"joint spectrum: found graphs of {node_counts} nodes; expected graphs on the same nodes")
    if len(graphs) == 1:
        return
    if sizes[0] > DENSE_LIMIT:
        raise ValueError(f"joint spectrum: found {sizes[0]} nodes; expected at most {DENSE_LIMIT} for several graphs")
    if pair := _apart(tuple(graphs)):
        first, second = (f"{graph.name}({graph.n})" for graph in pair)
        raise ValueError(
            f"joint spectrum of {first} and {second}: found matrices that do not commute; expected graphs with common "
            "modes, such as any undirected graph and a complete one; clusters(graphs, [0, 0, …]) has the blocks of others"
        )


@lru_cache(maxsize=32)
def _apart(graphs: tuple[Matrix, ...]) -> tuple[Matrix, Matrix] | None:
    """Return the first two graphs whose matrices do not commute, or None."""
    itself = fmpq_poly([0, 1])
    # Matrices scaled to integers commute exactly if the matrices themselves do.
    matrices = [value_at(graph, itself) for graph in graphs] if len(graphs) > 1 else []
    pairs = ((j, i) for i in range(len(matrices)) for j in range(i))
    return next(
        ((graphs[j], graphs[i]) for j, i in pairs if matrices[j] * matrices[i] != matrices[i] * matrices[j]), None
    )


def commute(graphs: Sequence[Matrix]) -> bool:
    """Return True if the matrices of graphs on the same nodes commute, so that they have joint eigenvalues."""
    return len(graphs) == 1 or graphs[0].n > DENSE_LIMIT or _apart(tuple(graphs)) is None


def _joined(modes: Modes, combined: Matrix, graph: Matrix) -> tuple[Modes, Matrix]:
    """Add the eigenvalues of one more graph B to the modes of A; return the modes and the matrix A + t B."""
    # Find the first t for which the balls around all sums a + t b are disjoint.
    eigenvalues = tuple(spectrum(graph))
    pairs = [(parts, e) for parts, _ in modes for e in eigenvalues]
    for bits, k in product(BITS, range(1, TRIED)):
        factor = Fraction(k, PRIME)
        with precision(2 * bits):
            share, second = fmpq(k, PRIME), [b.enclosure(bits) for b in eigenvalues]
            sums = [acb(a.enclosure(bits) + share * b) for _, a in modes for b in second]
            if disjoint(sums):
                break
    else:
        raise ProofError(
            f"joint spectrum of {graph.name}({graph.n}): found equal sums for {TRIED} factors; expected one"
        )
    # Each eigenvalue of A + t B now lies in the ball of exactly one pair (a, b).
    combined = _Combination(combined, graph, factor)
    extended = []
    for number in spectrum(combined):
        with precision(2 * bits):
            ball = acb(number.enclosure(bits))
            at = [pair for pair, pair_sum in zip(pairs, sums, strict=True) if ball.overlaps(pair_sum)]
        if len(at) != 1:
            raise ProofError(
                f"joint spectrum of {graph.name}({graph.n}): found {len(at)} pairs for {number}; expected one"
            )
        extended.append(((*at[0][0], at[0][1]), number))
    return tuple(extended), combined
