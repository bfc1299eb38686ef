"""LSODA through SciPy's odeint, whose loop over steps is compiled (solve_ivp's is Python), with a
compiled Jacobian.
"""

from __future__ import annotations

import warnings

import numpy as np

from ._problem import Problem, Solve, ladder

NAME = "SciPy LSODA (odeint)"
PACKAGE = "scipy"
REQUIRES = {"module": ("scipy.integrate",)}
TOLERANCES = ladder(5, 13)


def prepare(problem: Problem) -> Solve:
    """Return a solver by LSODA."""
    from scipy.integrate import ODEintWarning, odeint

    f, jacobian = problem.callbacks()

    def solve(rtol: float, atol: float, times: np.ndarray) -> np.ndarray:
        ends = np.concatenate([[0.0], times])
        with warnings.catch_warnings():
            warnings.simplefilter("error", ODEintWarning)
            states = odeint(f, problem.y0, ends, Dfun=jacobian, tfirst=True, rtol=rtol, atol=atol, mxstep=10_000_000)
        return np.asarray(states[1:])

    return solve
