"""Kvaerno5, a stiff Runge-Kutta method of order 5, through diffrax in double precision, compiled by
JAX.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import sympy as sp

from .problem import Problem, Solve


def prepare(problem: Problem) -> Solve:
    """Return a solver by Kvaerno5 that steps to every output time; JAX compiles at the first call
    of a number of times.

    JAX is switched to double precision for the whole process.
    """
    import diffrax
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    term = diffrax.ODETerm(_vector_field(problem, jnp))

    @jax.jit  # type: ignore[untyped-decorator]
    def run(rtol: float, atol: float, times: Any) -> Any:
        control = diffrax.ClipStepSizeController(diffrax.PIDController(rtol, atol), step_ts=times)
        done = diffrax.diffeqsolve(
            term,
            diffrax.Kvaerno5(),
            0.0,
            times[-1],
            None,
            jnp.asarray(problem.y0),
            max_steps=None,
            stepsize_controller=control,
            saveat=diffrax.SaveAt(ts=times),
            throw=False,
        )
        return done.ys, done.result == diffrax.RESULTS.successful

    def solve(rtol: float, atol: float, times: np.ndarray) -> np.ndarray:
        states, success = run(rtol, atol, jnp.asarray(times))
        if not bool(success):
            raise RuntimeError(f"Kvaerno5 gave up at rtol = {rtol:g}")
        return np.asarray(states)

    return solve


def _vector_field(problem: Problem, jnp: Any) -> Any:
    """f(t, y, args) on JAX arrays."""
    symbols = [sp.Symbol(name, real=True) for name in problem.equations.state]
    free = {s for e in problem.rhs() for s in e.free_symbols}
    times = [s for s in free if s.name == "t"]
    values = {s: sp.Float(problem.numbers[s.name], 17) for s in free if s.name in problem.numbers}
    rows = [e.xreplace(values) for e in problem.rhs()]
    function = sp.lambdify([times, symbols], rows, modules="jax", cse=True)

    def field(t: Any, y: Any, args: Any) -> Any:
        return jnp.stack(function([t] * len(times), list(y)))

    return field
