"""JiTCODE's Lyapunov exponents: C code of the network and of deviations, orthogonalised between calls.

The class is `jitcode_lyap` (Ansmann, Chaos 28, 043116 (2018)), integrated by a method of SciPy's ode.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from synchain.models.scenes.scene import Scene

from .jitcode_solvers import compile_c, converter
from .problem import Problem


def growths(scene: Scene, count: int, method: str, rtol: float, block: float) -> Iterator[np.ndarray]:
    """Compile the network, and yield the growth (count,) of the directions over one block after the other.

    atol is rtol/10.
    """
    from jitcode import jitcode, jitcode_lyap

    problem = Problem(scene)
    rates = [*map(converter(problem), problem.rhs())]
    system = jitcode_lyap(rates, n_lyap=count, simplify=False, verbose=False)
    compile_c(system)
    # the class's own set_integrator hands `interpolate` on in the place of `nsteps`
    jitcode.set_integrator(system, method, nsteps=10_000_000, interpolate=False, rtol=rtol, atol=0.1 * rtol)
    system.set_initial_value(problem.y0, 0.0)
    blocks = 0
    while True:
        blocks += 1
        yield np.array(system.integrate(blocks * block)[1]) * block
