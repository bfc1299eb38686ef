"""Nodes with equal entries in eigenvectors: the nodes that a mode of the graph does not separate.

x_a - x_b contains the mode of an eigenvalue γ if the rows a and b of the projection onto the eigenspace of γ differ.
The vector e_a - e_b is rational, and conjugation maps the projection of γ to those of the other roots of the minimal
polynomial f of γ.  So x_a - x_b contains all modes of f or none: equal entries are decided for all roots of f together,
by exact integers, without eigenvectors and without a tolerance.

Let s be the size of the largest Jordan block and g the product of the other factors of the characteristic polynomial,
each with its multiplicity.  The null space of f(G)^s is the column space of g(G).  Either matrix decides; the
polynomial of lower degree costs less.

Source: Bayani et al., Nat. Commun. 15, 4955 (2024), where entries of floating-point eigenvectors are compared.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

from flint import fmpq_poly

from ..algebra.minimal_polynomials import minimal_polynomial
from ..graphs.links import numbered
from ..graphs.readers import as_topology
from ..graphs.topology import Topology
from ..spectra.characteristic import characteristic
from ..spectra.eigenspaces import null_space
from ..spectra.eigenvalue import Eigenvalue
from ..spectra.jordan import value_at

LARGEST = 300  # most nodes of a graph whose eigenvectors are compared, a choice


@dataclass(frozen=True, slots=True)
class ModeClasses:
    """Conjugate modes, and the nodes that these modes do not separate."""

    eigenvalues: tuple[Eigenvalue, ...]  # the roots of one irreducible factor, in the order of the spectrum
    classes: tuple[int, ...]  # the class of each node; nodes of one class have equal entries in every eigenvector


@lru_cache(maxsize=16)
def mode_classes(graph: Topology) -> tuple[ModeClasses, ...]:
    """Return the classes of all transversal modes of a graph; ValueError on more than LARGEST nodes."""
    graph = as_topology("mode_classes", graph)
    if graph.n > LARGEST:
        raise ValueError(
            f"{graph.name}({graph.n}): expected at most {LARGEST} nodes, whose eigenvectors are compared exactly; take the "
            "quotient by a balanced partition"
        )
    conjugate: dict[tuple[int, ...], list[Eigenvalue]] = {}
    for eigenvalue in graph.spectrum:
        polynomial = minimal_polynomial(eigenvalue.number)
        conjugate.setdefault(tuple(map(int, polynomial.numer().coeffs())), []).append(eigenvalue)
    whole, modes = characteristic(graph), list[ModeClasses]()
    for coefficients, roots in conjugate.items():
        first = roots[0]
        if first.value == 0 and first.multiplicity == 1:
            continue  # the synchronous motion
        factor = fmpq_poly(list(coefficients)) / coefficients[-1]
        power = factor ** (1 if first.blocks is None else first.blocks[0][0])
        others = whole / factor**first.multiplicity
        if others.degree() < power.degree():
            rows = value_at(graph, others).tolist()
        else:
            rows = list(zip(*null_space(value_at(graph, power)), strict=True))
        modes.append(ModeClasses(tuple(roots), numbered(tuple(map(str, row)) for row in rows)))
    return tuple(modes)


def together(n: int, modes: Iterable[ModeClasses]) -> tuple[int, ...]:
    """Return the classes of nodes that none of some modes separates; without modes all n nodes are one class."""
    columns = [mode.classes for mode in modes]
    return numbered(tuple(column[i] for column in columns) for i in range(n))
