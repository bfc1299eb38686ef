"""Taylor series through heyoka, eight trajectories in SIMD lanes."""

from __future__ import annotations

from . import _heyoka
from ._problem import Problem, Solve

NAME = "heyoka Taylor batch"
PACKAGE = "heyoka"
REQUIRES = {"module": ("heyoka",)}
TOLERANCES = tuple((10.0 * tol, tol) for tol in (1e-6, 1e-8, 1e-10, 1e-12, 1e-14))
CELLS = 8


def prepare(problem: Problem) -> Solve:
    """Return a solver by Taylor series."""
    return _heyoka.prepare(problem, CELLS)
