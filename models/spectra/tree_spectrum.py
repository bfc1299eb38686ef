"""Spanning trees and resistances of a graph, from the characteristic polynomial of G without eigenvalues.

Let det(z - G) = z^n + … + c_2 z² + c_1 z.  The product of the nonzero eigenvalues μ of -G is c_1, and the
sum of 1/μ is c_2 / c_1 (A. E. Brouwer, W. H. Haemers, Spectra of Graphs, Springer, 2012, section 1.3.5).
"""

from __future__ import annotations

from fractions import Fraction
from typing import Protocol

from ..algebra.rationals import to_fraction
from .characteristic import characteristic
from .matrix import Matrix
from .solve import DENSE_LIMIT


class WeightedGraph(Matrix, Protocol):
    """The matrix G of a graph: weights of links, with rows that sum to 0."""

    @property
    def asymmetry(self) -> str:
        """Message on the first links that differ from their mirror image; "" if the graph is undirected."""


def spanning_trees(graph: WeightedGraph) -> Fraction:
    """Return the sum over all spanning trees of the products of their weights, by the matrix-tree theorem."""
    # If all weights are 1, the sum is the number of spanning trees. The sum is 0 if the graph is not connected.
    first, _ = _lowest(graph, "spanning trees")
    return first / graph.n


def kirchhoff_index(graph: WeightedGraph) -> Fraction:
    """Return the sum of the resistances between all pairs of nodes, with weights as conductances."""
    # The sum equals n Σ 1/μ over the nonzero eigenvalues μ of -G (D. J. Klein, M. Randić, J. Math. Chem. 12, 81, 1993;
    # I. Gutman, B. Mohar, J. Chem. Inf. Comput. Sci. 36, 982, 1996).
    first, second = _lowest(graph, "Kirchhoff index")
    if not first:
        raise ValueError(
            f"Kirchhoff index: found {graph.name} with {graph.n} nodes, on which 0 is a multiple eigenvalue; expected a "
            "connected graph: some resistances are infinite"
        )
    return graph.n * second / first


def _lowest(graph: WeightedGraph, what: str) -> tuple[Fraction, Fraction]:
    """Return the coefficients of z and z² of det(z - G)."""
    if graph.asymmetry:
        raise ValueError(f"{what}: found {graph.asymmetry} in {graph.name}; expected an undirected graph")
    if graph.n > DENSE_LIMIT:
        raise ValueError(f"{what}: found {graph.n} nodes; expected at most {DENSE_LIMIT}")
    polynomial = characteristic(graph)
    return to_fraction(polynomial[1]), to_fraction(polynomial[2])
