"""SciPy's solve_ivp with right-hand side and Jacobian compiled by Numba."""

from __future__ import annotations

import numpy as np

from ._problem import Problem, Solve


def prepare(problem: Problem, method: str, implicit: bool) -> Solve:
    """Return a solver by one method of solve_ivp.

    Each output time ends one call and starts the next: dense output of Radau and BDF is of lower
    order than their steps.
    """
    from scipy.integrate import solve_ivp

    f, jacobian = problem.callbacks()
    options = {"jac": jacobian} if implicit else {}

    def solve(rtol: float, atol: float, times: np.ndarray) -> np.ndarray:
        t, y, states = 0.0, problem.y0, []
        for end in times:
            done = solve_ivp(
                f, (t, float(end)), y, method=method, rtol=rtol, atol=atol, t_eval=(float(end),), **options
            )
            if not done.success:
                raise RuntimeError(f"{method} stopped at t = {done.t[-1] if len(done.t) else t:g}: {done.message}")
            t, y = float(end), np.ascontiguousarray(done.y[:, -1])
            states.append(y)
        return np.array(states)

    return solve
