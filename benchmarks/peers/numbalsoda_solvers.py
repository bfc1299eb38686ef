"""Solvers of numbalsoda, with a right-hand side compiled by Numba; its interface takes no Jacobian.

numbalsoda builds its library at installation and needs a Fortran compiler for it: without one pip
ends with "Failed building wheel for numbalsoda", and installing gfortran is the remedy.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .problem import Problem, Solve, load


def compiled(problem: Problem) -> Any:
    """Return the right-hand side as a C callback, whose `address` is valid as long as the callback is referenced."""
    import numba
    from numbalsoda import lsoda_sig

    text = problem.python_rhs("def rhs(t, y, out, unused):")
    return numba.cfunc(lsoda_sig, error_model="numpy")(load(text, "rhs"))


def dop853(problem: Problem) -> Solve:
    """Return a solver by DOP853, explicit of order 8."""
    from numbalsoda import solve_ivp

    rhs = compiled(problem)

    def solve(rtol: float, atol: float, times: np.ndarray) -> np.ndarray:
        span = np.array([0.0, times[-1]])
        done = solve_ivp(rhs.address, span, problem.y0, t_eval=np.ascontiguousarray(times), rtol=rtol, atol=atol)
        if not done.success or len(done.t) != len(times):
            raise RuntimeError(f"numbalsoda DOP853 gave up at rtol = {rtol:g}: {done.message}")
        return np.asarray(done.y)

    return solve


def lsoda(problem: Problem) -> Solve:
    """Return a solver by LSODA in C++."""
    from numbalsoda import lsoda

    rhs, data = compiled(problem), np.zeros(1)

    def solve(rtol: float, atol: float, times: np.ndarray) -> np.ndarray:
        ends = np.concatenate([[0.0], times])
        states, success = lsoda(rhs.address, problem.y0, ends, data=data, rtol=rtol, atol=atol, mxstep=10_000_000)
        if not success:
            raise RuntimeError(f"numbalsoda LSODA gave up at rtol = {rtol:g}")
        return np.asarray(states[1:])

    return solve
