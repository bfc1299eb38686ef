"""JiTCODE's transversal exponents: growth of a deviation that leaves the synchronous state of two
coupled oscillators.

The class is `jitcode_transversal_lyap` (Ansmann, Chaos 28, 043116 (2018)): C code of one oscillator
and of the variational equation, derived by JiTCODE from the right-hand side of the pair, integrated
by a method of SciPy's ode.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import sympy as sp

from synchain.models.scenes.scene import Scene

from .jitcode_solvers import compile_c
from .problem import Problem

Growths = Callable[[float, np.ndarray, float, int], Iterator[float]]
"""growths(alpha, start (components,), block, skipped): the logarithms of the growth over one block
of time after the other, without end; the first `skipped` blocks are the transient and not among
them.
"""

STRENGTH = "strength"


def prepare(scene: Scene, method: str, rtol: float) -> Growths:
    """Compile the transversal mode of a scene with two oscillators; the strength alpha stays a
    parameter. atol is rtol/10.

    Raises ValueError for another number of oscillators.
    """
    if scene.n != 2:
        raise ValueError(f"JiTCODE's transversal exponents: found {scene.n} oscillators; expected two")
    import symengine
    from jitcode import jitcode, jitcode_transversal_lyap

    groups = [[2 * k, 2 * k + 1] for k in range(len(scene.components))]
    system = jitcode_transversal_lyap(
        _right_hand_side(Problem(scene)),
        groups=groups,
        simplify=False,
        verbose=False,
        control_pars=[symengine.Symbol(STRENGTH)],
        wants_jacobian=method == "lsoda",
    )
    compile_c(system)
    # the class's own set_integrator hands `interpolate` on in the place of `nsteps`
    jitcode.set_integrator(system, method, nsteps=10_000_000, interpolate=False, rtol=rtol, atol=0.1 * rtol)

    def growths(alpha: float, start: np.ndarray, block: float, skipped: int) -> Iterator[float]:
        system.set_parameters(alpha)
        system.set_initial_value(start, 0.0)
        end = 0
        while True:
            end += 1
            _, rate = system.integrate(end * block)
            if end > skipped:
                yield float(rate) * block

    return growths


def _right_hand_side(problem: Problem) -> list[Any]:
    """The equations of the pair for JiTCODE, sigma = alpha/2: the eigenvalue of two coupled
    oscillators is -2.
    """
    import symengine
    from jitcode import t, y

    names = {sp.Symbol(name, real=True): sp.Symbol(f"{name}_") for name in problem.equations.state}
    values = {str(new): y(i) for i, new in enumerate(names.values())} | {"t": t, **problem.numbers}
    values["sigma"] = symengine.Symbol(STRENGTH) / 2

    def convert(e: sp.Expr) -> Any:
        plain = e.xreplace(names).xreplace({s: sp.Symbol(s.name) for s in e.free_symbols if s not in names})
        smooth = plain.replace(sp.Abs, lambda w: sp.sqrt(w**2))  # JiTCODE leaves the derivative of |w| open
        return symengine.sympify(smooth).subs({symengine.Symbol(name): value for name, value in values.items()})

    return [convert(e) for e in problem.rhs()]
