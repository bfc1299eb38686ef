"""What a kernel knows of its contacts: the loop over nodes and links says what is written out, for unequal nodes too."""

from __future__ import annotations

import numpy as np
import pytest
from samples import FLOATS, Interpreted

from synchain.codegen.kernels.observable_functions import Recording
from synchain.codegen.kernels.sweep_kernel import emit
from synchain.models.graphs.families import topology
from synchain.models.scenes.scene import Scene

OWN = {"epsilon": [0.3, 0.34, 0.4], "theta_b": [0.2, 0.25, 0.3], "mu_s": [0.3, 0.28, 0.35], "u": [0.1, 0.2, 0.3]}


def pushes(scene: Scene, looped: bool) -> np.ndarray:
    """The six groups of numbers, by plain Python."""
    source = emit(scene.equations, "dop853", Recording(()), width=1, unroll=0 if looped else 8)
    state = [0.3, -0.2, 0.1, 0.1, 0.25, -0.4, 1.0, 0.0, -1.0]
    values = [scene.parameters[name] for name in scene.equations.parameters]
    out = [0.0] * 6 * scene.n
    plan = source.elimination
    graph = () if plan is None else (plan.arrays, plan.weights)
    Interpreted.of(source, FLOATS).names["pushes"](0.7, state, [*state, *values], out, *graph)
    return np.array(out)


@pytest.mark.parametrize("coupling", ["spring", "damper"])
@pytest.mark.parametrize("parameters", [{}, OWN], ids=["equal", "unequal"])
def test_the_loop_says_what_is_written_out(coupling: str, parameters: dict[str, list[float]]) -> None:
    scene = Scene(
        topology=topology("ring", 3), coupling=coupling, contact="set-valued", parameters={"sigma": 0.3, **parameters}
    )
    written, looped = (pushes(scene, each) for each in (False, True))
    np.testing.assert_allclose(looped, written, rtol=1e-14, atol=1e-15)
    assert (len(set(looped[3:6])) == 1) == (not parameters)  # the grounds' velocities
