"""SUNDIALS CVODE (BDF) through scikit-SUNDAE, right-hand side and Jacobian compiled by Numba."""

from __future__ import annotations

from . import _sundae
from ._problem import Problem, Solve, ladder

NAME = "CVODE BDF (scikit-SUNDAE)"
PACKAGE = "scikit-sundae"
REQUIRES = {"module": ("sksundae.cvode",)}
TOLERANCES = ladder(5, 13)


def prepare(problem: Problem) -> Solve:
    """Return a solver by CVODE BDF."""
    return _sundae.prepare(problem, "BDF")
