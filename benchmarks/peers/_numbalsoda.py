"""The right-hand side that the solvers of numbalsoda call, compiled by Numba."""

from __future__ import annotations

from typing import Any

from ._problem import Problem, load

PACKAGE = "numbalsoda (its build needs gfortran)"
REQUIRES = {"module": ("numbalsoda",)}


def compiled(problem: Problem) -> Any:
    """Return the right-hand side as a C callback; its `address` is valid for as long as the
    callback is kept.
    """
    import numba
    from numbalsoda import lsoda_sig

    text = problem.python_rhs("def rhs(t, y, out, unused):")
    return numba.cfunc(lsoda_sig, error_model="numpy")(load(text, "rhs"))
