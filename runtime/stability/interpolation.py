"""Interpolation of the propagators of many modes from few, along one orbit.

The propagator of a mode over a stretch of time is an entire function of its strength, so a short
polynomial in the strength gives it for all modes. The strengths are divided into panels, pieces of
the real line or squares of the plane. On each panel the propagators of some nodes are integrated,
and the others are interpolated from them. Every panel has further strengths that are integrated
for comparison only.

Sources: barycentric formula at Chebyshev points, Berrut & Trefethen, SIAM Review 46, 501 (2004);
on a circle, Austin, Kravanja & Trefethen, SIAM J. Numer. Anal. 52, 1795 (2014).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

__all__ = ["Interpolation", "combine", "exact_interpolation", "strength_interpolation"]

SINGLE = 2**18
"""Most multiplications of one matrix product.

Above this OpenBLAS uses several threads, whatever the number of workers.
"""

Panel = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
"""Indices of the strengths on the panel, nodes, barycentric weights, strengths for comparison."""


@dataclass(frozen=True, slots=True)
class Interpolation:
    """Linear map from the propagators of nodes to those of all strengths.

    Parameters
    ----------
    strengths : ndarray, shape (m,)
        All strengths, real or complex.
    nodes : ndarray, shape (k,)
        Strengths that are integrated.
    weights : ndarray, shape (m, k)
        Propagators of the strengths = weights @ propagators of the nodes.
    checked : ndarray, shape (c,)
        Indices of the nodes that serve for comparison only.
    checks : ndarray, shape (c, k)
        Weights that give the propagators of the checked nodes from the other nodes.
    """

    strengths: np.ndarray
    nodes: np.ndarray
    weights: np.ndarray
    checked: np.ndarray
    checks: np.ndarray

    def apply(self, propagators: np.ndarray) -> np.ndarray:
        """Compute the propagators of all strengths.

        Parameters
        ----------
        propagators : ndarray, shape (cells, k, p, p)
            Propagators of the nodes.

        Returns
        -------
        ndarray, shape (cells, m, p, p)
        """
        return propagators if self.is_exact else combine(self.weights, propagators)

    def error(self, propagators: np.ndarray) -> float:
        """Compare interpolated with integrated propagators.

        Parameters
        ----------
        propagators : ndarray, shape (cells, k, p, p)
            Propagators of the nodes.

        Returns
        -------
        float
            Largest difference at the checked nodes, relative to the size of the propagator.
        """
        if len(self.checked) == 0:
            return 0.0
        integrated = propagators[:, self.checked]
        sizes = np.maximum(np.abs(integrated).max(axis=(2, 3)), 1e-300)
        return float((np.abs(combine(self.checks, propagators) - integrated).max(axis=(2, 3)) / sizes).max())

    @property
    def is_exact(self) -> bool:
        """True if every strength is integrated."""
        return self.nodes is self.strengths


def exact_interpolation(strengths: np.ndarray) -> Interpolation:
    """Return the trivial map: every strength is integrated."""
    nothing = np.zeros((0, len(strengths)))
    return Interpolation(strengths, strengths, nothing, np.zeros(0, dtype=int), nothing)


def strength_interpolation(strengths: np.ndarray, nodes: int, parts: int = 1) -> Interpolation:
    """Divide the range of the strengths into panels with interpolation nodes.

    Parameters
    ----------
    strengths : ndarray, shape (m,)
        Real or complex strengths.
    nodes : int
        Chebyshev points on each piece of the real line; a square has twice as many on a circle.
    parts : int
        Panels on each side of the range.

    Returns
    -------
    Interpolation
        `exact_interpolation(strengths)` if the panels need as many nodes as there are strengths.

    Raises
    ------
    ValueError
        If there is no strength.
    """
    if len(strengths) == 0:
        raise ValueError("found no strength of a mode; expected at least one")
    panels = list((_squares if np.iscomplexobj(strengths) else _pieces)(strengths, parts, nodes))
    total = sum(len(points) + len(extra) for _, points, _, extra in panels)
    if total >= len(strengths):
        return exact_interpolation(strengths)
    weights = np.zeros((len(strengths), total), dtype=strengths.dtype)
    integrated, checked, checks = [], [], []
    first = 0
    for rows, points, signs, extra in panels:
        last = first + len(points)
        weights[rows, first:last] = _barycentric(strengths[rows], points, signs)
        for k, row in enumerate(_barycentric(extra, points, signs)):
            checks.append(np.zeros(total, dtype=strengths.dtype))
            checks[-1][first:last] = row
            checked.append(last + k)
        integrated += [points, extra]
        first = last + len(extra)
    return Interpolation(strengths, np.concatenate(integrated), weights, np.array(checked), np.array(checks))


def _pieces(strengths: np.ndarray, count: int, nodes: int) -> Iterator[Panel]:
    """Yield equal pieces of the real line with Chebyshev points of the second kind.

    The strengths for comparison lie between the outer points.
    """
    edges = np.linspace(strengths.min(), strengths.max(), count + 1)
    which = np.clip(np.searchsorted(edges, strengths, side="right") - 1, 0, count - 1)
    unit = np.cos(np.arange(nodes) * math.pi / (nodes - 1))
    signs = (-1.0) ** np.arange(nodes)
    signs[[0, -1]] *= 0.5
    between = (unit[:-1] + unit[1:])[[0, nodes // 2 - 1, -1]] / 2
    for k in np.unique(which):
        centre, half = (edges[k] + edges[k + 1]) / 2, (edges[k + 1] - edges[k]) / 2
        yield np.flatnonzero(which == k), centre + half * unit, signs, centre + half * between


def _squares(strengths: np.ndarray, count: int, nodes: int) -> Iterator[Panel]:
    """Yield squares that cover the rectangle of the strengths.

    The nodes of each lie on the circle through its corners.
    """
    low = complex(strengths.real.min(), strengths.imag.min())
    size = complex(strengths.real.max(), strengths.imag.max()) - low
    side = max(size.real, size.imag) / count
    cells = np.stack([(strengths - low).real, (strengths - low).imag]) // (side if side > 0.0 else 1.0)
    cells = np.minimum(cells, count - 1)
    unit = np.exp(1j * math.pi * (np.arange(2 * nodes) + 0.5) / nodes)
    for x, y in np.unique(cells, axis=1).T:
        centre, half = low + side * complex(x + 0.5, y + 0.5), side / 2
        rows = np.flatnonzero((cells[0] == x) & (cells[1] == y))
        yield rows, centre + 1.5 * half * unit, unit, centre + half * np.array([0.0, 1.0 + 1.0j, -1.0 + 1.0j])


def _barycentric(x: np.ndarray, nodes: np.ndarray, signs: np.ndarray) -> np.ndarray:
    """Interpolating polynomial as a matrix (len(x), len(nodes)); exact at the nodes."""
    gaps = x[:, None] - nodes
    at = gaps == 0.0
    terms = signs / np.where(at, 1.0, gaps)
    terms[at.any(axis=1)] = 0.0
    terms[at] = 1.0
    return np.asarray(terms / terms.sum(axis=1, keepdims=True))


def combine(weights: np.ndarray, propagators: np.ndarray, largest: int = SINGLE) -> np.ndarray:
    """Multiply a matrix of weights with propagators, in pieces that stay on one thread.

    Parameters
    ----------
    weights : ndarray, shape (m, k)
        Weights.
    propagators : ndarray, shape (cells, k, p, p)
        Propagators of the nodes.
    largest : int
        Most multiplications of one matrix product.

    Returns
    -------
    ndarray, shape (cells, m, p, p)
    """
    cells, count, p, _ = propagators.shape
    table = propagators.transpose(1, 0, 2, 3).reshape(count, -1)
    rows = max(1, largest // table.size)
    products = np.concatenate([weights[i : i + rows] @ table for i in range(0, max(len(weights), 1), rows)])
    return np.asarray(products.reshape(len(weights), cells, p, p).transpose(1, 0, 2, 3))
