"""Taylor series of adaptive order through heyoka, compiled by LLVM for one tolerance and one number
of lanes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import sympy as sp

from .problem import Problem, Solve


def prepare(problem: Problem, lanes: int) -> Solve:
    """Return a solver by Taylor series, for `lanes` equal copies at once; it compiles at the first
    call of a tolerance.

    Parameters are run-time values, so that friction of size zero is still evaluated, as all others
    do. heyoka has one tolerance, relative to the largest component: it is given atol, the smaller
    one. |w| becomes relu(w) + relu(-w), whose side is fixed within a step. Compact mode, 2 to 3
    times slower here, is off; constants in place of run-time values saved 5 % at most.
    """
    import heyoka as hy

    system = [(hy.expression(name), _convert(e, problem, hy)) for name, e in _rows(problem)]
    numbers = list(problem.numbers.values())
    made: dict[float, Any] = {}

    def integrator(tol: float) -> Any:
        if tol not in made:
            if lanes == 1:
                made[tol] = hy.taylor_adaptive(system, problem.y0, tol=tol, compact_mode=False, pars=numbers)
            else:
                start, pars = (np.tile(np.array(column)[:, None], (1, lanes)) for column in (problem.y0, numbers))
                made[tol] = hy.taylor_adaptive_batch(system, start, tol=tol, compact_mode=False, pars=pars)
        return made[tol]

    def solve(rtol: float, atol: float, times: np.ndarray) -> np.ndarray:
        ta = integrator(atol)
        if lanes == 1:
            ta.time, ta.state[:] = 0.0, problem.y0
            return _checked(ta.propagate_grid(np.concatenate([[0.0], times]))[-1], hy)[1:]
        ta.set_time(0.0)
        ta.state[:] = problem.y0[:, None]
        grid = np.tile(np.concatenate([[0.0], times])[:, None], (1, lanes))
        return _checked(ta.propagate_grid(grid)[-1], hy)[1:, :, 0]

    return solve


def _checked(states: np.ndarray, hy: Any) -> np.ndarray:
    if not np.isfinite(states).all():
        raise RuntimeError("heyoka stopped at a state that is not finite")
    return np.asarray(states)


def _rows(problem: Problem) -> list[tuple[str, sp.Expr]]:
    return list(zip(problem.equations.state, problem.rhs(), strict=True))


def _convert(e: sp.Expr, problem: Problem, hy: Any) -> Any:
    """A SymPy expression as a heyoka expression; ValueError for a function without a rule."""
    if e.is_Symbol:
        parameters = list(problem.numbers)
        if e.name in parameters:
            return hy.par[parameters.index(e.name)]
        return hy.time if e.name == "t" else hy.expression(e.name)
    if e.is_number:
        return hy.expression(float(e))
    parts = [_convert(a, problem, hy) for a in e.args]
    if e.is_Add:
        return hy.sum(parts)
    if e.is_Mul:
        return hy.prod(parts)
    if isinstance(e, sp.Abs):
        return hy.relu(parts[0]) + hy.relu(-parts[0])
    if e.is_Pow and e.base != sp.E:
        return parts[0] ** parts[1]
    rules = {sp.exp: hy.exp, sp.atan: hy.atan, sp.cos: hy.cos, sp.sin: hy.sin, sp.tanh: hy.tanh, sp.log: hy.log}
    if e.func not in rules:
        raise ValueError(f"no heyoka rule for {e.func.__name__}; known: {', '.join(f.__name__ for f in rules)}, Abs")
    return rules[e.func](parts[0])
