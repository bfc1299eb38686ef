"""DOP853, explicit of order 8, through numbalsoda, with a right-hand side compiled by Numba."""

from __future__ import annotations

import numpy as np

from ._numbalsoda import PACKAGE, REQUIRES, compiled
from ._problem import Problem, Solve, ladder

__all__ = ["NAME", "PACKAGE", "REQUIRES", "TOLERANCES", "prepare"]

NAME = "numbalsoda DOP853"
TOLERANCES = ladder(5, 12)


def prepare(problem: Problem) -> Solve:
    """Return a solver by DOP853."""
    from numbalsoda import solve_ivp

    rhs = compiled(problem)
    address = rhs.address

    def solve(rtol: float, atol: float, times: np.ndarray) -> np.ndarray:
        span = np.array([0.0, times[-1]])
        done = solve_ivp(address, span, problem.y0, t_eval=np.ascontiguousarray(times), rtol=rtol, atol=atol)
        if not done.success or len(done.t) != len(times):
            raise RuntimeError(f"numbalsoda DOP853 gave up at rtol = {rtol:g}: {done.message}")
        return np.asarray(done.y)

    solve.rhs = rhs  # type: ignore[attr-defined]  # keeps the compiled function alive
    return solve
