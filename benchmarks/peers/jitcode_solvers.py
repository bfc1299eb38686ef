"""JiTCODE: C code of the right-hand side and Jacobian, compiled and run by SciPy's ode."""

from __future__ import annotations

import logging
import tempfile
import warnings
from collections.abc import Callable
from contextlib import chdir
from typing import Any

import numpy as np
import sympy as sp

from .problem import Problem, Solve


def prepare(problem: Problem, method: str, jacobian: bool) -> Solve:
    """Return a solver by one method of SciPy's ode."""
    from jitcode import jitcode

    convert = converter(problem)
    system = jitcode([convert(e) for e in problem.rhs()], verbose=False, wants_jacobian=jacobian)
    if jacobian:  # ours: JiTCODE's own would leave the derivative of |w| open
        system._jac_sym = [[convert(e) for e in row] for row in problem.jacobian()]
    system.generate_f_C(do_cse=True)
    if jacobian:
        system.generate_jac_C(do_cse=True, sparse=False)
    compile_c(system)

    def solve(rtol: float, atol: float, times: np.ndarray) -> np.ndarray:
        system.set_initial_value(problem.y0, 0.0)
        system.set_integrator(method, rtol=rtol, atol=atol, nsteps=10_000_000)
        with warnings.catch_warnings():
            warnings.simplefilter("error", UserWarning)  # how SciPy's ode says that it gave up
            return np.array([np.array(system.integrate(float(end))) for end in times])  # the same array each call

    return solve


def converter(problem: Problem) -> Callable[[sp.Expr], Any]:
    """Return the function that converts expressions to those of JiTCODE, with the numbers of parameters."""
    import symengine
    from jitcode import t, y

    names = {sp.Symbol(name, real=True): sp.Symbol(f"{name}_") for name in problem.equations.state}
    values = {**{str(new): y(i) for i, new in enumerate(names.values())}, "t": t, **problem.numbers}

    def convert(e: sp.Expr) -> Any:
        plain = e.xreplace(names).xreplace({s: sp.Symbol(s.name) for s in e.free_symbols if s not in names})
        return symengine.sympify(plain).subs({symengine.Symbol(name): value for name, value in values.items()})

    return convert


def compile_c(system: Any) -> None:
    """Compile C code by the compiler of Python's own build, at -O3 and -march=native."""
    level = logging.root.level
    with tempfile.TemporaryDirectory() as folder, chdir(folder):  # setuptools reads a pyproject.toml where it works
        system.compile_C(extra_compile_args=["-O3", "-march=native", "-w"])
    logging.root.setLevel(level)  # setuptools' own logging raises it
