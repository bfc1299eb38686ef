"""LSODA in C++ through numbalsoda, with a right-hand side compiled by Numba; its interface takes no
Jacobian.

numbalsoda builds its library at installation and needs a Fortran compiler for it: without one pip
ends with "Failed building wheel for numbalsoda", and installing gfortran is the remedy.
"""

from __future__ import annotations

import numpy as np

from ._numbalsoda import PACKAGE, REQUIRES, compiled
from ._problem import Problem, Solve, ladder

__all__ = ["NAME", "PACKAGE", "REQUIRES", "TOLERANCES", "prepare"]

NAME = "numbalsoda LSODA"
TOLERANCES = ladder(5, 13)


def prepare(problem: Problem) -> Solve:
    """Return a solver by LSODA."""
    from numbalsoda import lsoda

    rhs = compiled(problem)
    address, data = rhs.address, np.zeros(1)

    def solve(rtol: float, atol: float, times: np.ndarray) -> np.ndarray:
        ends = np.concatenate([[0.0], times])
        states, success = lsoda(address, problem.y0, ends, data=data, rtol=rtol, atol=atol, mxstep=10_000_000)
        if not success:
            raise RuntimeError(f"numbalsoda LSODA gave up at rtol = {rtol:g}")
        return np.asarray(states[1:])

    solve.rhs = rhs  # type: ignore[attr-defined]  # keeps the compiled function alive
    return solve
