"""SciPy's Radau with right-hand side and Jacobian compiled by Numba."""

from __future__ import annotations

from . import _scipy
from ._problem import Problem, Solve, ladder

NAME = "SciPy Radau"
PACKAGE = "scipy"
REQUIRES = {"module": ("scipy.integrate",)}
TOLERANCES = ladder(4, 12, 2)


def prepare(problem: Problem) -> Solve:
    """Return a solver by Radau."""
    return _scipy.prepare(problem, "Radau", implicit=True)
