"""SUNDIALS CVODE through scikit-SUNDAE, with right-hand side and Jacobian compiled by Numba."""

from __future__ import annotations

import numpy as np

from .problem import Problem, Solve


def prepare(problem: Problem, method: str) -> Solve:
    """Return a solver by CVODE, `method` "BDF" or "Adams"; both solve their equations by Newton's
    method.
    """
    from sksundae.cvode import CVODE

    f, j = problem.compiled()

    def rhs(t: float, y: np.ndarray, out: np.ndarray) -> None:
        f(t, y, out)

    def jacobian(t: float, y: np.ndarray, rate: np.ndarray, out: np.ndarray) -> None:
        j(t, y, out)

    def solve(rtol: float, atol: float, times: np.ndarray) -> np.ndarray:
        solver = CVODE(rhs, method=method, rtol=rtol, atol=atol, jacfn=jacobian, max_num_steps=10_000_000)
        done = solver.solve(np.concatenate([[0.0, 1e-12], times]), problem.y0)
        if not done.success:
            raise RuntimeError(f"CVODE stopped: {done.message}")
        return np.asarray(done.y[2:])

    return solve
