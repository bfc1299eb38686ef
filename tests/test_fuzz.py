"""Random scenes against SciPy on the exported Python equations: a few, or as many as SYNCHAIN_FUZZ_SECONDS allows.

Structures are few, so that kernels are; numbers, starts and lengths are drawn.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest
from catalogue import FUZZ_SECONDS
from hypothesis import HealthCheck, given, note, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from synchain import Scene, run
from synchain.codegen.export.python import to_python
from synchain.graphs import topology
from synchain.results import Status

EXAMPLES = 12
"""Scenes of each structure where no time is given."""


def between(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False, width=64)


RING = topology("one_way_ring", 2)
SHARED: dict[str, Any] = {"record": (), "transient": 0.0, "time_unit": "time", "max_steps": 1_000_000}
STRUCTURES: dict[str, tuple[Scene, str, dict[str, st.SearchStrategy[float]], float]] = {
    "friction": (
        Scene(**SHARED), "Radau",
        {"theta_b": between(-0.5, 0.5), "epsilon": between(0.0, 5.0), "u": between(0.0, 0.5), "omega": between(0.1, 3.0),
         "mu_s": between(0.0, 0.6), "mu_k": between(0.0, 0.6), "a": between(0.0, 20.0), "kappa": between(1.0, 1e3)}, 5.0,
    ),
    "duffing": (
        Scene(oscillator="duffing", topology=topology("star", 3), integrator="rodas5p", **SHARED), "DOP853",
        {"delta": between(0.0, 1.0), "beta": between(0.0, 5.0), "u": between(0.0, 1.0), "omega": between(0.0, 3.0),
         "sigma": between(0.0, 20.0)}, 6.0,
    ),
    "lorenz": (
        Scene(oscillator="lorenz", coupling="x->x", integrator="dop853", topology=RING, **SHARED), "DOP853",
        {"prandtl": between(1.0, 20.0), "rayleigh": between(0.0, 40.0), "b": between(0.5, 4.0),
         "sigma": between(-1.0, 20.0)},
        1.0,
    ),
}  # fmt: skip
"""Scene, method of SciPy, what is drawn for its parameters, and the longest run."""


def reference(scene: Scene, method: str) -> np.ndarray:
    """The end state by SciPy on the exported module."""
    space: dict[str, Any] = {}
    exec(to_python(scene.equations, {name: scene.parameters[name] for name in scene.equations.parameters}), space)
    options = {"jac": space["jac"]} if method == "Radau" else {}
    done = solve_ivp(
        space["rhs"], (0.0, scene.window), np.array(scene.y0), method=method, rtol=1e-11, atol=1e-13, **options
    )
    assert done.success, done.message
    return np.array(done.y[:, -1])


def check(name: str, examples: int) -> None:
    scene, method, strategies, longest = STRUCTURES[name]

    @settings(max_examples=examples, deadline=None, derandomize=FUZZ_SECONDS == 0, database=None,
              suppress_health_check=list(HealthCheck))  # fmt: skip
    @given(
        st.fixed_dictionaries(strategies), between(0.1, longest), st.sampled_from([1e-4, 1e-7, 1e-10]),
        st.lists(between(-1.0, 1.0), min_size=len(scene.y0), max_size=len(scene.y0)),
    )  # fmt: skip
    def agree(values: dict[str, float], length: float, rtol: float, start: list[float]) -> None:
        parts = np.reshape(start, (len(scene.components), scene.n))
        initial = {c: tuple(row.tolist()) for c, row in zip(scene.components, parts, strict=True)}
        drawn = scene.replace(parameters=values, window=length, rtol=rtol, initial=initial)
        result = run(drawn, show_progress=False)
        assert int(result.status) == Status.FINISHED, result.message
        expected = reference(drawn, method)
        size = max(1.0, float(np.abs(expected).max()))
        error = float(np.abs(result.states("end") - expected).max())
        note(f"error {error:.3g}, size {size:.3g}")
        assert error <= 100.0 * rtol * size + 1e-9 * size

    agree()


@pytest.mark.parametrize("name", STRUCTURES)
def test_random_scenes_end_where_scipy_says(name: str) -> None:
    end = time.monotonic() + FUZZ_SECONDS / len(STRUCTURES)
    check(name, EXAMPLES)
    while time.monotonic() < end:
        check(name, 50)
