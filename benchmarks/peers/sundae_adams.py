"""SUNDIALS CVODE (Adams) through scikit-SUNDAE, with right-hand side and Jacobian compiled by
Numba.
"""

from __future__ import annotations

from . import _sundae
from ._problem import Problem, Solve, ladder

NAME = "CVODE Adams (scikit-SUNDAE)"
PACKAGE = "scikit-sundae"
REQUIRES = {"module": ("sksundae.cvode",)}
TOLERANCES = ladder(5, 12)


def prepare(problem: Problem) -> Solve:
    """Return a solver by CVODE Adams."""
    return _sundae.prepare(problem, "Adams")
