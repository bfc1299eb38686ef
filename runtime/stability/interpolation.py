"""Interpolation of the propagators of many modes from few, along one orbit.

The propagator of a mode over a stretch of time is an entire function of its strength, so a short
polynomial in the strength gives it for all modes. The strengths are divided into panels, pieces of
the real line, squares of the complex plane, or rectangles of two real strengths. On each panel the propagators of some nodes are integrated,
and the others are interpolated from them. Every panel has further strengths that are integrated
for comparison only.

Sources: barycentric formula at Chebyshev points, Berrut & Trefethen, SIAM Review 46, 501 (2004);
on a circle, Austin, Kravanja & Trefethen, SIAM J. Numer. Anal. 52, 1795 (2014).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

__all__ = ["Interpolation", "Panel", "Registers", "exact_interpolation", "on_a_cache_line", "strength_interpolation"]


@dataclass(frozen=True, slots=True)
class Panel:
    """Strengths that are interpolated from the same nodes.

    Parameters
    ----------
    rows : ndarray, shape (m,)
        Indices of the strengths.
    points : ndarray, shape (k,) or (k, 2)
        Strengths of the nodes.
    extras : ndarray, shape (c,) or (c, 2)
        Strengths that are integrated for comparison only.
    weights : ndarray, shape (m, k)
        Propagators of the strengths = weights @ propagators of the nodes.
    checks : ndarray, shape (c, k)
        Weights that give the propagators of the strengths for comparison from the nodes.
    """

    rows: np.ndarray
    points: np.ndarray
    extras: np.ndarray
    weights: np.ndarray
    checks: np.ndarray

    @classmethod
    def of(
        cls, strengths: np.ndarray, rows: np.ndarray, points: np.ndarray, signs: np.ndarray, extras: np.ndarray
    ) -> Panel:
        """Return the panel of nodes with barycentric weights `signs`."""
        weights, checks = (_barycentric(x, points, signs) for x in (strengths[rows], extras))
        return cls(rows, points, extras, weights, checks)


@dataclass(frozen=True, slots=True)
class Interpolation:
    """Linear map from the propagators of nodes to those of all strengths.

    Parameters
    ----------
    strengths : ndarray, shape (m,) or (m, layers)
        All strengths, real or complex.
    panels : tuple of Panel
        Parts of the strengths with their nodes; none if every strength is integrated.
    """

    strengths: np.ndarray
    panels: tuple[Panel, ...] = ()

    @property
    def is_exact(self) -> bool:
        """True if every strength is integrated."""
        return not self.panels

    @property
    def nodes(self) -> np.ndarray:
        """Strengths (k,) or (k, layers) that are integrated."""
        if self.is_exact:
            return self.strengths
        return np.concatenate([part for panel in self.panels for part in (panel.points, panel.extras)])

    def registers(self, lanes: int) -> Registers:
        """Return the strengths and the weights in groups of `lanes`, as kernels take them.

        Parameters
        ----------
        lanes : int
            Numbers in a register.
        """
        if self.is_exact:
            count = len(self.strengths)
            table = np.array([[0.0, -(-count // lanes), 0.0, 0.0, 0.0, 0.0, 0.0]])
            return Registers(table, np.zeros(1), np.arange(count), lanes * int(table[0, 1]), lanes)
        where, table = np.empty(len(self.strengths), dtype=np.int64), np.zeros((len(self.panels), 7))
        kinds = 2 if np.iscomplexobj(self.strengths) else 1
        spread, register, node, room = [], 0, 0, 0
        for k, panel in enumerate(self.panels):
            count, points = -(-len(panel.rows) // lanes), len(panel.points)
            where[panel.rows] = register * lanes + np.arange(len(panel.rows))
            table[k] = register, register + count, node, points, len(panel.extras), room, 0
            padded = np.zeros((count * lanes, points), dtype=panel.weights.dtype)
            padded[: len(panel.rows)] = panel.weights
            numbers = _numbers(padded).reshape(count, lanes, points * kinds)
            spread.append(numbers.transpose(0, 2, 1).reshape(-1))
            register, node, room = register + count, node + points + len(panel.extras), room + count * points * kinds
        checks = [_numbers(panel.checks).reshape(-1) for panel in self.panels]
        table[:, 6] = room * lanes + np.cumsum([0, *map(len, checks[:-1])])
        return Registers(table, on_a_cache_line(np.concatenate([*spread, *checks])), where, register * lanes, lanes)


@dataclass(frozen=True, slots=True)
class Registers:
    """The weights of an interpolation as `synchain.codegen.driver.propagators` takes them.

    Parameters
    ----------
    panels : ndarray, shape (panels, 7)
        What belongs to each panel: whole numbers.
    weights : ndarray, shape (any,)
        The weights of the strengths, then those of the strengths for comparison.
    where : ndarray of int64, shape (m,)
        Position of each strength in the registers.
    room : int
        Numbers in all registers.
    lanes : int
        Numbers in one.
    """

    panels: np.ndarray
    weights: np.ndarray
    where: np.ndarray
    room: int
    lanes: int


def exact_interpolation(strengths: np.ndarray) -> Interpolation:
    """Return the trivial map: every strength is integrated."""
    return Interpolation(strengths)


def strength_interpolation(strengths: np.ndarray, nodes: int, parts: int = 1) -> Interpolation:
    """Divide the range of the strengths into panels with interpolation nodes.

    Parameters
    ----------
    strengths : ndarray, shape (m,) or (m, layers)
        Real or complex strengths, one for each layer.
    nodes : int
        Chebyshev points on each piece of the real line and on each side of a rectangle; a square has twice as many on a
        circle.
    parts : int
        Panels on each side of the range.

    Returns
    -------
    Interpolation
        `exact_interpolation(strengths)` if the panels need as many nodes as there are strengths, for two complex strengths,
        and for more than two.

    Raises
    ------
    ValueError
        If there is no strength.
    """
    if len(strengths) == 0:
        raise ValueError("found no strength of a mode; expected at least one")
    way = _way(strengths)
    if way is None:
        return exact_interpolation(strengths)
    panels = tuple(way(strengths, parts, nodes))
    if sum(len(panel.points) + len(panel.extras) for panel in panels) >= len(strengths):
        return exact_interpolation(strengths)
    return Interpolation(strengths, panels)


def _way(strengths: np.ndarray) -> Callable[[np.ndarray, int, int], Iterator[Panel]] | None:
    """What divides strengths into panels; None if every one is integrated."""
    if strengths.ndim == 1:
        return _squares if np.iscomplexobj(strengths) else _pieces
    return _rectangles if strengths.shape[1] == 2 and not np.iscomplexobj(strengths) else None


def on_a_cache_line(values: np.ndarray) -> np.ndarray:
    """Return a copy of a row of numbers that begins on a cache line, so that no register lies across two."""
    block = np.empty(len(values) + 8)
    first = -block.ctypes.data // 8 % 8
    block[first : first + len(values)] = values
    return block[first : first + len(values)]


def _numbers(table: np.ndarray) -> np.ndarray:
    """A matrix of complex numbers as pairs of columns, one of real numbers as it is."""
    return np.ascontiguousarray(table).view(float)


def _pieces(strengths: np.ndarray, count: int, nodes: int) -> Iterator[Panel]:
    """Yield equal pieces of the real line with Chebyshev points of the second kind.

    The strengths for comparison lie between the outer points, and in the middle.
    """
    edges, which = _parted(strengths, count)
    unit, signs, between = _chebyshev(nodes)
    for k in np.unique(which):
        centre, half = (edges[k] + edges[k + 1]) / 2, (edges[k + 1] - edges[k]) / 2
        rows = np.flatnonzero(which == k)
        yield Panel.of(strengths, rows, centre + half * unit, signs, centre + half * between)


def _parted(strengths: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The ends of equal pieces of the real line that cover the strengths, and the piece of each strength."""
    edges = np.linspace(strengths.min(), strengths.max(), count + 1)
    return edges, np.clip(np.searchsorted(edges, strengths, side="right") - 1, 0, count - 1)


def _chebyshev(nodes: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Chebyshev points of the second kind, their barycentric weights, and three points between them."""
    unit = np.cos(np.arange(nodes) * math.pi / (nodes - 1))
    signs = (-1.0) ** np.arange(nodes)
    signs[[0, -1]] *= 0.5
    return unit, signs, (unit[:-1] + unit[1:])[[0, nodes // 2 - 1, -1]] / 2


def _rectangles(strengths: np.ndarray, count: int, nodes: int) -> Iterator[Panel]:
    """Yield rectangles that cover pairs of real strengths; their nodes are those of the pieces of both sides.

    A side without length has a single node.
    """
    edges, which = zip(*(_parted(side, count) for side in strengths.T), strict=True)
    places = np.stack(which, axis=1)
    for cell in np.unique(places, axis=0):
        rows = np.flatnonzero((places == cell).all(axis=1))
        sides, extras = [], []
        for k, (ends, turn) in enumerate(zip(edges, (0, 1), strict=True)):
            centre, half = (ends[cell[k]] + ends[cell[k] + 1]) / 2, (ends[cell[k] + 1] - ends[cell[k]]) / 2
            unit, signs, between = _chebyshev(nodes) if half > 0.0 else (np.zeros(1), np.ones(1), np.zeros(3))
            sides.append((centre + half * unit, signs))
            extras.append(centre + half * np.roll(between, turn))
        points = np.stack(np.meshgrid(*(side for side, _ in sides), indexing="ij"), axis=-1).reshape(-1, 2)
        compared = np.stack(extras, axis=1)
        weights, checks = (_of_sides(x, sides) for x in (strengths[rows], compared))
        yield Panel(rows, points, compared, weights, checks)


def _of_sides(x: np.ndarray, sides: Sequence[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Interpolating polynomial of two variables (len(x), nodes of both sides)."""
    first, second = (_barycentric(column, *side) for column, side in zip(x.T, sides, strict=True))
    return (first[:, :, None] * second[:, None, :]).reshape(len(x), -1)


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
        extras = centre + half * np.array([0.0, 1.0 + 1.0j, -1.0 + 1.0j])
        yield Panel.of(strengths, rows, centre + 1.5 * half * unit, unit, extras)


def _barycentric(x: np.ndarray, nodes: np.ndarray, signs: np.ndarray) -> np.ndarray:
    """Interpolating polynomial as a matrix (len(x), len(nodes)); exact at the nodes."""
    gaps = x[:, None] - nodes
    at = gaps == 0.0
    terms = signs / np.where(at, 1.0, gaps)
    terms[at.any(axis=1)] = 0.0
    terms[at] = 1.0
    return np.asarray(terms / terms.sum(axis=1, keepdims=True))
