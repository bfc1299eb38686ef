"""Observables of runs beside independent integrals, records and trajectories."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from synchain.models import chain, end, maximum, mean, minimum, nodes, rate, ring, variance
from synchain.models.mechanics.components import TIME
from synchain.models.scenes.scene import Scene
from synchain.runtime.results.open import open_result
from synchain.runtime.support.status import Status
from synchain.runtime.sweeps.run import run
from synchain.runtime.sweeps.stream import stream

x, v, x_1, v_1, theta, t = sp.symbols("x v x_1 v_1 theta t")
ERROR = sp.sqrt((x - x_1) ** 2 + (v - v_1) ** 2)


def integrals(scene: Scene, values: list[sp.Expr]) -> np.ndarray:
    """The means over the window of expressions of x_1 … and t, as further states of SciPy's DOP853."""
    equations = scene.equations
    symbols = [sp.Symbol(name, real=True) for name in (*equations.state, *equations.parameters)]
    rates = sp.lambdify([TIME, *symbols], equations.rhs(), "numpy", cse=True)
    own = sp.lambdify([TIME, *symbols], [e.xreplace({s: sp.Symbol(s.name, real=True) for s in e.free_symbols})
                                         for e in values], "numpy", cse=True)  # fmt: skip
    numbers = [scene.parameters[name] for name in equations.parameters]
    size = len(equations.state)

    def before(time, y):
        return np.array(rates(time, *y, *numbers), float)

    def inside(time, y):
        return np.concatenate([before(time, y[:size]), np.array(own(time, *y[:size], *numbers), float)])

    unit = scene.period if scene.time_unit == "period" else 1.0
    begin, finish = scene.transient * unit, (scene.transient + scene.window) * unit
    start = solve_ivp(before, (0.0, begin), scene.y0, "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    whole = solve_ivp(
        inside, (begin, finish), np.concatenate([start, np.zeros(len(values))]), "DOP853", rtol=1e-13, atol=1e-14
    )
    return whole.y[size:, -1] / (finish - begin)


def names(component: str, n: int) -> list[sp.Symbol]:
    return [sp.Symbol(f"{component}_{i + 1}") for i in range(n)]


NUMBERS = {"transient": 1.0, "window": 9.0, "time_unit": "time"}


@pytest.mark.parametrize("integrator", ["rodas5p", "dop853", "taylor"])
@pytest.mark.parametrize("n", [3, 12])
def test_means_are_the_integrals_that_scipy_finds(integrator: str, n: int) -> None:
    """Of smooth values of a driven network, written out and in loops; a rule of too low an order misses them."""
    amplitudes = [0.3 + 0.01 * i for i in range(n)]
    scene = Scene(
        oscillator="duffing", topology=ring(n), integrator=integrator, rtol=1e-13, atol=1e-14, record=(), **NUMBERS,
        parameters={"sigma": 0.2, "beta": amplitudes}, initial={"x": [0.1 + 0.1 * i for i in range(n)]},
        observe={
            "energy": mean(nodes.mean(v**2 / 2 + x**2 / 2)),
            "power": mean(nodes.sum(v * sp.cos(t) * sp.Symbol("beta"))),
            "spread": mean(nodes.std(x)),
            "own": mean(x * nodes.mean(v) + sp.exp(-(nodes[2](x) ** 2))),
        },
    )  # fmt: skip
    xs, vs = names("x", n), names("v", n)
    average = sum(xs) / n
    energy = sum(a**2 / 2 + b**2 / 2 for a, b in zip(xs, vs, strict=True)) / n
    power = sum(b * sp.cos(t) * sp.Symbol(f"beta_{i + 1}") for i, b in enumerate(vs))
    spread = sp.sqrt(sum((a - average) ** 2 for a in xs) / n)
    own = [a * sum(vs) / n + sp.exp(-(xs[1] ** 2)) for a in xs]
    found = run(scene, show_progress=False)
    expected = integrals(scene, [energy, power, spread, *own])
    assert found.own.dims == ("node",)
    assert found.node.values.tolist() == list(range(1, n + 1))
    values = np.concatenate([[found.energy, found.power, found.spread], found.own])
    np.testing.assert_allclose(values, expected, rtol=0, atol=1e-10)
