"""The master stability function over complex strengths, and the modes of a network on it.

A mode with a complex eigenvalue gamma has the strength alpha + i beta = -sigma gamma. With growing sigma the strength
moves along a ray from the origin. The network is stable if all its modes lie inside the contour of exponent zero.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from synchain.models.graphs.topology import Topology
from synchain.models.scenes.scene import Scene

from ..plots.csv_table import as_csv
from ..plots.plane import draw_plane, draw_rays
from ..plots.style import COLUMN
from ..stability.exponent_plane import Plane, plane
from .exponent_figure import HIGHEST, effort
from .figure_runs import FigureRuns

NAMES = ("msf_plane",)
SIZE = (COLUMN, 2.5)
# Frequency, coupling at which the modes are marked, and size of the network (a choice).
OMEGA, SIGMA, NODES = 1.40, 0.13, 4
TOP = 0.6  # largest imaginary part beta of the grid
FINE = 161  # number of real parts alpha of the full grid


def uneven_ring(n: int, back: Fraction = Fraction(1, 2)) -> Topology:
    """Return a ring with weight 1 in one direction and another weight in the other."""
    links = [(i, (i + 1) % n, Fraction(1)) for i in range(n)] + [(i, (i - 1) % n, back) for i in range(n)]
    return Topology("uneven ring", n, tuple(sorted(links)))


def compute(name: str, runs: FigureRuns) -> Plane:
    """Compute the function at one frequency; the lower half of the plane mirrors the upper."""
    scene = Scene(topology=uneven_ring(NODES), parameters={"omega": OMEGA})
    grid = runs.quality.grid
    count = FINE if grid is None else min(grid // 2 + 1, FINE)  # fewer than on a line: the cost grows as count squared
    alpha, beta = np.linspace(0.0, HIGHEST, count), np.linspace(0.0, TOP, count // 2 + 1)
    return plane(scene, alpha, beta, **effort(runs))


def texts(data: Plane) -> dict[str, str]:
    """Return exponents with standard errors, per unit of time, and the zero contour line by line."""
    points = [
        (a, b, data.exponent[i, j], data.stderr[i, j]) for i, a in enumerate(data.across) for j, b in enumerate(data.up)
    ]
    contour = [(k, a, b) for k, line in enumerate(data.contours) for a, b in line]
    return {
        ".csv": as_csv((*data.names, "exponent", "stderr"), points),
        "_ranges.csv": as_csv(("line", "alpha", "beta"), contour),
    }


def draw(figure: Figure, data: Plane) -> Axes:
    axes = figure.add_subplot()
    draw_plane(axes, data)
    return draw_rays(axes, data, SIGMA)
