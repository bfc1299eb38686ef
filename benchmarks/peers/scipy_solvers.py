"""Solvers of SciPy, with right-hand side and Jacobian compiled by Numba."""

from __future__ import annotations

import warnings

import numpy as np

from .problem import Problem, Solve


def implicit(problem: Problem, method: str) -> Solve:
    """Return a solver by an implicit method of solve_ivp, "BDF" or "Radau".

    Each output time ends one call and starts the next: dense output of Radau and BDF is of lower
    order than their steps.
    """
    from scipy.integrate import solve_ivp

    f, jacobian = problem.callbacks()

    def solve(rtol: float, atol: float, times: np.ndarray) -> np.ndarray:
        t, y, states = 0.0, problem.y0, []
        for end in map(float, times):
            done = solve_ivp(f, (t, end), y, method=method, rtol=rtol, atol=atol, t_eval=(end,), jac=jacobian)
            if not done.success:
                raise RuntimeError(f"{method} stopped at t = {done.t[-1] if len(done.t) else t:g}: {done.message}")
            t, y = end, np.ascontiguousarray(done.y[:, -1])
            states.append(y)
        return np.array(states)

    return solve


def lsoda(problem: Problem) -> Solve:
    """Return a solver by odeint: its loop over steps is compiled, that of solve_ivp is Python."""
    from scipy.integrate import ODEintWarning, odeint

    f, jacobian = problem.callbacks()

    def solve(rtol: float, atol: float, times: np.ndarray) -> np.ndarray:
        ends = np.concatenate([[0.0], times])
        with warnings.catch_warnings():
            warnings.simplefilter("error", ODEintWarning)
            states = odeint(f, problem.y0, ends, Dfun=jacobian, tfirst=True, rtol=rtol, atol=atol, mxstep=10_000_000)
        return np.asarray(states[1:])

    return solve
