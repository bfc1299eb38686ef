"""Jordan blocks of a rational matrix, from exact ranks.

Let p be the minimal polynomial of an eigenvalue.  The nullity of p(G)**k, divided by the degree of p,
is the sum of min(size, k) over the Jordan blocks of the eigenvalue (F. R. Gantmacher, The Theory of
Matrices 1, Chelsea, New York, 1959, chapter VI).  A mode with exponent λ in a block of size s grows as
t**(s - 1) exp(λt) (T. Nishikawa, A. E. Motter, Phys. Rev. E 73, 065106, 2006).
"""

from __future__ import annotations

from functools import lru_cache
from math import lcm

from flint import fmpq_poly, fmpz_mat

from ..algebra.minimal_polynomials import minimal_polynomial
from .eigenvalue import Blocks, Eigenvalue
from .matrix import Matrix


def blocks(graph: Matrix, polynomial: fmpq_poly, multiplicity: int) -> Blocks:
    """Return the Jordan blocks of each root of an irreducible factor; all roots have the same blocks."""
    if multiplicity == 1 or graph.diagonalisable:
        return ((1, multiplicity),)
    first = power = value_at(graph, polynomial)
    sums, longer = [0], [multiplicity]  # Σ min(size, k) over the blocks; number of blocks longer than k
    while sums[-1] < multiplicity:
        sums.append((graph.n - int(power.rank())) // polynomial.degree())
        longer.append(sums[-1] - sums[-2])
        if longer[-1] <= 0:
            raise RuntimeError(
                f"{graph.name}: blocks of {polynomial} end at {sums[-1]} of {multiplicity}; it is no factor"
            )
        if longer[-1] == 1:  # one block remains: its size follows from the multiplicity
            size = len(sums) - 1 + multiplicity - sums[-1]
            longer += [1] * (size - len(sums) + 1)
            break
        power = power * first
    sizes = [*longer[1:], 0]
    counted = [(k + 1, sizes[k] - sizes[k + 1]) for k in range(len(sizes) - 1)]
    return tuple((size, count) for size, count in reversed(counted) if count)


def nullity(graph: Matrix, polynomial: fmpq_poly) -> int:
    """Return the dimension of the null space of p(G) for a rational polynomial p."""
    return graph.n - int(value_at(graph, polynomial).rank())


@lru_cache(maxsize=4)
def _whole(graph: Matrix) -> tuple[fmpz_mat, int]:
    """Return (G times d, d), where d is the common denominator of the entries."""
    scale = lcm(*(number.denominator for _, _, number in graph.entries))
    scaled = fmpz_mat(graph.n, graph.n)
    for i, j, number in graph.entries:
        scaled[i, j] = int(number * scale)
    return scaled, scale


def value_at(graph: Matrix, polynomial: fmpq_poly) -> fmpz_mat:
    """Return an integer multiple of p(G) with integer entries, for a rational polynomial p."""
    g, scale = _whole(graph)
    coefficients = polynomial.numer()
    d, n = coefficients.degree(), graph.n
    value = fmpz_mat(n, n)
    for k in range(d, -1, -1):  # Horner's scheme, times scale**d
        value = value * g
        shift = int(coefficients[k]) * scale ** (d - k)
        value = value + fmpz_mat([[shift * (i == j) for j in range(n)] for i in range(n)])
    return value


def geometric_multiplicity(graph: Matrix, eigenvalue: Eigenvalue) -> int:
    """Return the number of independent eigenvectors of an eigenvalue of a graph, by an exact rank."""
    # The number is the nullity of p(G) divided by the degree of p, the minimal polynomial of the eigenvalue.
    if eigenvalue.multiplicity == 1 or graph.diagonalisable:
        return eigenvalue.multiplicity
    p = minimal_polynomial(eigenvalue.number)
    return nullity(graph, p) // int(p.degree())
