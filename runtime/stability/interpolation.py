"""Interpolate the propagators of many modes from those of few modes, along one orbit.

The propagator of a mode over a stretch of time is an entire function of the mode's strength, so that a
polynomial of low degree in the strength approximates the propagators of all modes. The strengths are divided
into panels, which are pieces of the real line or squares of the complex plane. With several layers of links,
the strengths are first divided into lines, along which the strength of a single layer changes, and each line
into panels. On each panel the propagators are integrated at some strengths (the nodes), and interpolated at
all others. Every panel has further strengths at which propagators are integrated for comparison only.

Sources: barycentric formula at Chebyshev points, Berrut & Trefethen, SIAM Review 46, 501 (2004);
on a circle, Austin, Kravanja & Trefethen, SIAM J. Numer. Anal. 52, 1795 (2014).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True, slots=True)
class Panel:
    """A set of strengths whose propagators are interpolated from the same nodes."""

    rows: np.ndarray  # (m,): indices of the strengths
    points: np.ndarray  # (k,) or (k, layers): strengths of the nodes
    extras: np.ndarray  # (c,) or (c, layers): strengths that are integrated for comparison only
    weights: np.ndarray  # (m, k): propagators of the strengths = weights @ propagators of the nodes
    checks: np.ndarray  # (c, k): weights that give the propagators of the strengths for comparison from the nodes

    @classmethod
    def of(
        cls, strengths: np.ndarray, rows: np.ndarray, points: np.ndarray, signs: np.ndarray, extras: np.ndarray
    ) -> Panel:
        """Return the panel with the nodes `points`, whose barycentric weights are `signs`."""
        weights, checks = (_barycentric(x, points, signs) for x in (strengths[rows], extras))
        return cls(rows, points, extras, weights, checks)


@dataclass(frozen=True, slots=True)
class Interpolation:
    """Linear map from the propagators of nodes to those of all strengths."""

    strengths: np.ndarray  # (m,) or (m, layers): all strengths, real or complex
    panels: tuple[Panel, ...] = ()  # parts of the strengths with their nodes; none if every strength is integrated

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
        """Return the strengths and the weights in groups of `lanes`, the layout that kernels read."""
        if self.is_exact:
            count = len(self.strengths)
            table = np.array([[0.0, -(-count // lanes), 0.0, 0.0, 0.0, 0.0, 0.0]])
            return Registers(table, np.zeros(1), np.arange(count), lanes * int(table[0, 1]), lanes)
        where, table = np.empty(len(self.strengths), dtype=np.int64), np.zeros((len(self.panels), 7))
        kinds = 2 if np.iscomplexobj(self.strengths) else 1
        weights, register, node, room = [], 0, 0, 0
        for k, panel in enumerate(self.panels):
            count, points = -(-len(panel.rows) // lanes), len(panel.points)
            where[panel.rows] = register * lanes + np.arange(len(panel.rows))
            table[k] = register, register + count, node, points, len(panel.extras), room, 0
            # the weights of `lanes` strengths for one node are adjacent in memory: they fill one register
            padded = np.zeros((count * lanes, points), dtype=panel.weights.dtype)
            padded[: len(panel.rows)] = panel.weights
            weights.append(_real(padded).reshape(count, lanes, points * kinds).transpose(0, 2, 1).reshape(-1))
            register, node, room = register + count, node + points + len(panel.extras), room + count * points * kinds
        checks = [_real(panel.checks).reshape(-1) for panel in self.panels]
        table[:, 6] = room * lanes + np.cumsum([0, *map(len, checks[:-1])])
        return Registers(table, on_a_cache_line(np.concatenate([*weights, *checks])), where, register * lanes, lanes)


@dataclass(frozen=True, slots=True)
class Registers:
    """The weights of an interpolation, in the layout that `synchain.codegen.driver.propagators` reads."""

    # (panels, 7), whole numbers: first and last register, first node, number of nodes, number of strengths for
    # comparison,
    # index of the first weight of the strengths, index of the first weight of the strengths for comparison
    panels: np.ndarray
    weights: np.ndarray  # (any,): the weights of the strengths, then those of the strengths for comparison
    where: np.ndarray  # (m,): position of each strength in the registers
    room: int  # number of lanes of all registers
    lanes: int  # number of lanes of one register

    def of_strengths(self, values: np.ndarray) -> np.ndarray:
        """Return values (..., m) in the order of the strengths, from `values` (..., room) in registers."""
        return values[..., : len(self.where)] if len(self.panels) == 1 else values.take(self.where, axis=-1)


def exact_interpolation(strengths: np.ndarray) -> Interpolation:
    """Return the map without interpolation: the propagator of every strength is integrated."""
    return Interpolation(strengths)


def strength_interpolation(strengths: np.ndarray, nodes: int, parts: int = 1) -> Interpolation:
    """Divide the range of the strengths into panels with interpolation nodes. Shapes: strengths (m,) or (m, layers)."""
    if len(strengths) == 0:
        raise ValueError("found no strength of a mode; expected at least one")
    panels = tuple((_on_a_line if strengths.ndim == 1 else _along_lines)(strengths, parts, nodes))
    if sum(len(panel.points) + len(panel.extras) for panel in panels) >= len(strengths):
        return exact_interpolation(strengths)
    return Interpolation(strengths, panels)


def lines_of(strengths: np.ndarray) -> tuple[int, np.ndarray, np.ndarray]:
    """Divide strengths (m, layers) into lines, along each of which the strength of only one layer changes.

    Choose the layer with the fewest lines. Return this layer, the strengths of the other layers (lines, layers - 1),
    and the index (m,) of the line of each strength.
    """
    lines = []
    for moving in range(strengths.shape[1]):
        fixed, line = np.unique(np.delete(strengths, moving, axis=1), axis=0, return_inverse=True)
        lines.append((moving, fixed, line.reshape(-1)))
    return min(lines, key=lambda of_layer: len(of_layer[1]))


def _along_lines(strengths: np.ndarray, count: int, nodes: int) -> Iterator[Panel]:
    """Yield the panels of every line; on a line of few strengths every strength is a node."""
    moving, fixed, line = lines_of(strengths)
    for k, others in enumerate(fixed):
        rows = np.flatnonzero(line == k)
        values = strengths[rows, moving]
        if len(rows) <= nodes:
            unit = np.eye(len(values))
            parts: Iterable[Panel] = (Panel(np.arange(len(values)), values, values[:0], unit, unit[:0]),)
        else:
            parts = _on_a_line(values, count, nodes)
        for part in parts:
            points, extras = (
                np.insert(np.tile(others, (len(x), 1)), moving, x, axis=1) for x in (part.points, part.extras)
            )
            yield replace(part, rows=rows[part.rows], points=points, extras=extras)


def _on_a_line(strengths: np.ndarray, count: int, nodes: int) -> Iterator[Panel]:
    """Yield the panels of strengths of a single layer."""
    return (_squares if np.iscomplexobj(strengths) else _pieces)(strengths, count, nodes)


def on_a_cache_line(values: np.ndarray) -> np.ndarray:
    """Return a copy of a row of numbers that begins on a cache line, so that no register crosses two cache lines."""
    block = np.empty(len(values) + 8)
    first = -block.ctypes.data // 8 % 8
    block[first : first + len(values)] = values
    return block[first : first + len(values)]


def _real(table: np.ndarray) -> np.ndarray:
    """Return a complex matrix as pairs of real columns; a real matrix unchanged."""
    return np.ascontiguousarray(table).view(float)


def _pieces(strengths: np.ndarray, count: int, nodes: int) -> Iterator[Panel]:
    """Yield equal pieces of the real line with Chebyshev points; compared strengths lie at ends and middle."""
    edges = np.linspace(strengths.min(), strengths.max(), count + 1)
    piece = np.clip(np.searchsorted(edges, strengths, side="right") - 1, 0, count - 1)
    # points and barycentric weights: Berrut & Trefethen, section 5
    unit = np.cos(np.arange(nodes) * math.pi / (nodes - 1))
    signs = (-1.0) ** np.arange(nodes)
    signs[[0, -1]] *= 0.5
    between = (unit[:-1] + unit[1:])[[0, nodes // 2 - 1, -1]] / 2
    for k in np.unique(piece):
        centre, half = (edges[k] + edges[k + 1]) / 2, (edges[k + 1] - edges[k]) / 2
        rows = np.flatnonzero(piece == k)
        yield Panel.of(strengths, rows, centre + half * unit, signs, centre + half * between)


def _squares(strengths: np.ndarray, count: int, nodes: int) -> Iterator[Panel]:
    """Yield squares that cover the rectangle of the strengths; nodes lie on the circle through the corners."""
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
    """Return the weights (len(x), len(nodes)) of the interpolating polynomial at `x`; exact at the nodes."""
    gaps = x[:, None] - nodes
    at = gaps == 0.0
    terms = signs / np.where(at, 1.0, gaps)
    terms[at.any(axis=1)] = 0.0
    terms[at] = 1.0
    return np.asarray(terms / terms.sum(axis=1, keepdims=True))
