"""The master stability function over complex strengths, and the modes of a network on it.

A mode with a complex eigenvalue gamma has the strength alpha + i beta = -sigma gamma: with sigma it
moves along a ray from the origin. The network is stable if all its modes lie inside the zero
contour.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from matplotlib.axes import Axes

from synchain.models.graphs.topology import Topology
from synchain.models.scenes.scene import Scene

from ..plots.csv_table import Table
from ..plots.plane import draw_plane, draw_rays
from ..plots.style import COLUMN
from ..stability.msf import Plane, plane
from .exponent_figure import HIGHEST, effort
from .figure_runs import FigureRuns

NAMES = ("msf_plane",)
SIZE = (COLUMN, 2.5)
OMEGA, SIGMA, NODES = 1.40, 0.13, 4
TOP = 0.6
"""Largest imaginary part."""
FINE = 161
"""Real parts of the full grid."""


@dataclass(frozen=True, slots=True)
class Rays:
    """A function over the plane with the modes of its scene's network."""

    found: Plane  # master stability function
    sigma: float  # coupling at which the modes are marked


def uneven_ring(n: int, back: Fraction = Fraction(1, 2)) -> Topology:
    """Return a ring with weight 1 in one direction and another weight in the other."""
    links = [(i, (i + 1) % n, Fraction(1)) for i in range(n)] + [(i, (i - 1) % n, back) for i in range(n)]
    return Topology("uneven ring", n, tuple(sorted(links)))


def compute(name: str, runs: FigureRuns) -> Rays:
    """Compute the function at one frequency; the lower half of the plane mirrors the upper."""
    scene = Scene(topology=uneven_ring(NODES), parameters={"omega": OMEGA})
    grid = runs.quality.grid
    count = FINE if grid is None else min(grid // 2 + 1, FINE)  # the square of a line's effort
    alpha, beta = np.linspace(0.0, HIGHEST, count), np.linspace(0.0, TOP, count // 2 + 1)
    return Rays(plane(scene, alpha, beta, **effort(runs)), SIGMA)


def table(data: Rays) -> Table:
    """Return exponent and standard error, per unit of time, at every point of the grid."""
    function = data.found
    rows = [
        (a, b, function.exponent[i, j], function.stderr[i, j])
        for i, a in enumerate(function.across)
        for j, b in enumerate(function.up)
    ]
    return Table((*function.names, "exponent", "stderr"), tuple(rows))


def ranges(data: Rays) -> Table:
    """Return the zero contour, line by line."""
    rows = [(k, a, b) for k, line in enumerate(data.found.contours) for a, b in line]
    return Table(("line", "alpha", "beta"), tuple(rows))


def draw(axes: Axes, data: Rays) -> Axes:
    """Draw the plane with the rays of its scene's network."""
    draw_plane(axes, data.found)
    return draw_rays(axes, data.found, data.sigma)
